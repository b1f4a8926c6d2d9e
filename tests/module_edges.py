#!/usr/bin/python3
"""Checks that each module includes only the modules that the architecture allows it, and only the libraries it may.

    tests/module_edges.py [ROOT]      checks the source tree (default: this one); prints `file:line: forbidden edge`
    tests/module_edges.py --self-test proves on made-up trees that each rule can fail

Exit code 0: no forbidden edge; 1: at least one, each printed. C++ includes are written from the root
(`#include "engine/geometry/mesh.h"`); the add-on imports itself relatively. The table of edges is the one that the build
itself goes by, packaging/cmake/lambent_module.cmake; it is the contract of ARCHITECTURE.md, "Allowed dependencies".
"""

import ast
import pathlib
import re
import sys
import tempfile

k_table = pathlib.Path("packaging/cmake/lambent_module.cmake")

k_engine = {
    "base", "sampling", "description", "assets", "geometry", "shading", "media", "lights", "camera", "film", "scene",
    "path", "integrators", "session", "cli",
}  # fmt: skip
k_server = {"protocol", "transport", "daemon", "replay"}

# Libraries that one module hides from the rest.
k_library_owners = [
    (re.compile(r"^embree[34]?/"), {"geometry"}),
    (re.compile(r"^OpenColorIO/"), {"assets"}),
    (re.compile(r"^OpenImageIO/"), {"assets", "film", "cli"}),
    (re.compile(r"^asio"), {"transport", "daemon", "replay"}),
    (re.compile(r"^CLI/"), {"cli", "daemon", "replay"}),
]

k_add_on_libraries = {
    "bpy", "bpy_extras", "bl_ui", "bl_operators", "nodeitems_utils", "nodeitems_builtins", "addon_utils", "gpu",
    "gpu_extras", "mathutils", "bgl", "blf", "numpy", "lambent",
}  # fmt: skip

k_include = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def allowed_edges(table_text):
    """Returns {module: set of modules it may include, itself too} from the `set(lambent_uses_...)` lines of the build."""
    uses = {}
    for name, value in re.findall(r'^set\(lambent_uses_(\w+) ([^)]*)\)$', table_text, re.MULTILINE):
        used = set()
        for word in value.replace('"', "").split():
            reference = re.fullmatch(r"\$\{lambent_uses_(\w+)\}", word)
            used |= uses[reference.group(1)] - {reference.group(1)} if reference else {word}
        uses[name] = used | {name}
    return uses


def module_of(path):
    """Returns (area, module) of a root-relative posix path, such as ("engine", "geometry"); None outside the modules."""
    parts = path.split("/")
    if len(parts) >= 3 and parts[0] in ("engine", "server"):
        return parts[0], parts[1]
    return None


def cpp_violations(path, text, uses):
    """Yields (line number, message) for each forbidden include of one C++ file (path root-relative)."""
    _, module = module_of(path)
    for number, line in enumerate(text.splitlines(), 1):
        match = k_include.match(line)
        if not match:
            continue
        quote, included = match.groups()
        target = module_of(included)
        if target:
            area, other = target
            known = k_engine if area == "engine" else k_server
            if other not in known:
                yield number, f"{area}/{other} is no module of the architecture"
            elif other not in uses[module]:
                yield number, f"{module} must not include {other} ({included})"
        elif quote == '"':
            yield number, f'"{included}" is not written from the root ("engine/..." or "server/...")'
        for pattern, owners in k_library_owners:
            if pattern.match(included) and module not in owners:
                yield number, f"{module} must not include <{included}>: only {', '.join(sorted(owners))} may"


def add_on_violations(text):
    """Yields (line number, message) for each import of an add-on file that neither Blender, numpy nor Python provides."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names = [node.module]
        else:
            continue
        for name in names:
            top = name.split(".")[0]
            if top not in sys.stdlib_module_names and top not in k_add_on_libraries:
                yield node.lineno, f"the add-on must not import {name}: only Blender, numpy and Python's own library"
            elif top == "lambent":
                yield node.lineno, f"the add-on imports itself relatively: as an extension it is not called {name}"


def violations(root, uses):
    """Yields "file:line: message" for each forbidden edge below `root`, and the number of files looked at at the end."""
    looked_at = 0
    for area, known in (("engine", k_engine), ("server", k_server)):
        for file in sorted((root / area).rglob("*")):
            if file.suffix not in (".h", ".cpp", ".hpp", ".inl"):
                continue
            path = file.relative_to(root).as_posix()
            looked_at += 1
            placed = module_of(path)
            if placed is None or placed[1] not in known:
                yield f"{path}:1: lies in no module of the architecture"
                continue
            for number, message in cpp_violations(path, file.read_text(encoding="utf-8"), uses):
                yield f"{path}:{number}: {message}"
    for file in sorted((root / "blender_addon" / "lambent").rglob("*.py")):
        looked_at += 1
        for number, message in add_on_violations(file.read_text(encoding="utf-8")):
            yield f"{file.relative_to(root).as_posix()}:{number}: {message}"
    yield looked_at


def check(root, uses):
    """Prints every forbidden edge below `root`; returns (edges found, files looked at)."""
    found = 0
    for item in violations(root, uses):
        if isinstance(item, int):
            return found, item
        print(item)
        found += 1
    raise AssertionError("violations() ends with a count")


def self_test(uses):
    """Returns (what does not hold what it promises: a list of str, empty when all is well; the number of cases)."""
    cases = [
        # path, text, whether it must be refused
        ("engine/base/a.h", '#include "engine/base/b.h"\n#include <vector>\n', False),
        ("engine/base/a.h", '#include "engine/sampling/b.h"\n', True),
        ("engine/camera/a.cpp", '#include "engine/sampling/b.h"\n', False),
        ("engine/camera/a.cpp", '#include "engine/film/b.h"\n', True),
        ("engine/camera/a.cpp", '#include "engine/description/b.h"\n', True),
        ("engine/geometry/a.cpp", "#include <embree3/rtcore.h>\n", False),
        ("engine/path/a.cpp", "#include <embree4/rtcore.h>\n", True),
        ("engine/path/a.cpp", '#include "engine/scene/b.h"\n', False),
        ("engine/path/a.cpp", '#include "engine/film/b.h"\n', True),
        ("engine/scene/a.cpp", '#include "engine/description/b.h"\n', False),
        ("engine/scene/a.cpp", '#include "engine/integrators/path_tracer/b.h"\n', True),
        ("engine/integrators/path_tracer/a.cpp", '#include "engine/film/b.h"\n', False),
        ("engine/integrators/path_tracer/a.cpp", '#include "engine/description/b.h"\n', True),
        ("engine/session/a.cpp", '#include "engine/description/b.h"\n', False),
        ("engine/session/a.cpp", '#include "server/protocol/b.h"\n', True),
        ("engine/cli/a.cpp", '#include "server/protocol/b.h"\n', True),
        ("engine/cli/a.cpp", '#include "engine/session/b.h"\n', False),
        ("server/protocol/a.cpp", '#include "engine/description/b.h"\n', False),
        ("server/protocol/a.cpp", '#include "engine/scene/b.h"\n', True),
        ("server/transport/a.cpp", '#include "engine/description/b.h"\n', True),
        ("server/transport/a.cpp", '#include "server/protocol/b.h"\n', True),
        ("server/daemon/a.cpp", '#include "engine/session/b.h"\n', False),
        ("engine/geometry/a.cpp", '#include "mesh.h"\n', True),
        ("engine/geometry/a.cpp", '#include "engine/utils/b.h"\n', True),
        ("engine/utils/a.cpp", "#include <vector>\n", True),
        ("blender_addon/lambent/a.py", "import bpy, struct\nimport numpy as np\nfrom . import sync\n", False),
        ("blender_addon/lambent/a.py", "def f():\n    import requests\n", True),
        ("blender_addon/lambent/a.py", "from lambent.sync import mesh\n", True),
    ]
    wrong = []
    for path, text, refused in cases:
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / path).parent.mkdir(parents=True)
            (root / path).write_text(text, encoding="utf-8")
            found = list(violations(root, uses))
        if found[-1] != 1:
            wrong.append(f"{path} was not looked at")
        elif (len(found) > 1) != refused:
            wrong.append(f"{path} with {text!r}: {'allowed' if refused else found[:-1]}")
    return wrong, len(cases)


def main(arguments):
    here = pathlib.Path(__file__).resolve().parent.parent
    uses = allowed_edges((here / k_table).read_text(encoding="utf-8"))
    missing = (k_engine | k_server) - set(uses)
    if missing:
        print(f"module_edges: {k_table} has no lambent_uses_ line for {', '.join(sorted(missing))}")
        return 1
    if arguments == ["--self-test"]:
        wrong, count = self_test(uses)
        for message in wrong:
            print(f"module_edges self-test: {message}")
        print(f"module_edges: {count - len(wrong)} of {count} self-tests hold")
        return 1 if wrong else 0
    root = pathlib.Path(arguments[0]).resolve() if arguments else here
    found, looked_at = check(root, uses)
    if looked_at == 0:
        print(f"module_edges: no source files below {root}")
        return 1
    print(f"module_edges: {looked_at} files, {found} forbidden edges")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
