"""Runs node cases in Blender, judges them and writes the table: what compare_with_cycles and the tests share."""

import json
import pathlib
import sys

k_here = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(k_here), str(k_here.parent / "agreement")]
import blender_runs
import compare
import known_differences

k_kinds = ("value", "input", "surface")


def run(folder, kinds, nodes=None, every=1, samples=None, sky_alone=False, timeout_s=3600):
    """Renders the cases with both engines in one Blender; returns (Blender's version, [compare.Verdict]). The verdicts of
    cases that differ as known carry the reason as their note."""
    folder.mkdir(parents=True, exist_ok=True)
    job = {
        "daemon": str(blender_runs.build_dir() / "bin" / "lambentd"), "out": str(folder), "kinds": list(kinds),
        "nodes": nodes, "every": every, "engines": ["CYCLES", "LAMBENT"], "sky_alone": sky_alone,
    }  # fmt: skip
    if samples:
        job["samples"] = samples
    path = folder / "job.json"
    path.write_text(json.dumps(job), encoding="utf-8")
    command = ["-b", "--factory-startup", "--python-exit-code", "1", "--python", str(k_here / "render_nodes.py"), "--", str(path)]
    blender_runs.run_blender(command, blender_runs.user_environment(folder / "user"), timeout_s=timeout_s)
    version, verdicts = "", []
    for kind in kinds:
        found = compare.read_cases(folder, kind)
        version = found["blender"]
        for verdict in compare.verdicts_of(folder, kind) if found["cases"] else []:
            verdict.note = "" if verdict.agrees else known_differences.reason(verdict, version, bounded=not sky_alone)
            verdicts.append(verdict)
    return version, verdicts


def line_of(verdict):
    reason = f": {verdict.note}" if verdict.note else ""
    return (
        f"{compare.label(verdict.case)}: differs by {verdict.difference:.2g} of its largest value in "
        f"{100 * verdict.differing:.0f}% of places{reason}"
    )


def table_path(version):
    short = ".".join(version.split()[0].split(".")[:2])
    return k_here / ("NODES.md" if short == "3.4" else f"NODES-{short}.md")


def table(version, verdicts):
    """The page of verdicts: a line a node, and below the cases that differ."""
    agreeing = sum(verdict.agrees for verdict in verdicts)
    lines = [
        "# Shader nodes against Cycles",
        "",
        f"Written by `tests/nodes/compare_with_cycles` with Blender {version}: {agreeing} of {len(verdicts)} cases agree.",
        "",
        "A case is a node with one set of options and one output. Values (patterns, arithmetic) are compared face by face and",
        "agree when they differ by rounding only; inputs and shaders are compared on spheres, tile by tile, by Welch's test",
        "with eight pictures of each engine. How: README.md.",
        "",
        "| node | cases | agree |",
        "|---|---|---|",
    ]
    by_node = {}
    for verdict in verdicts:
        by_node.setdefault(verdict.case["node"], []).append(verdict)
    for node in sorted(by_node):
        agree = sum(verdict.agrees for verdict in by_node[node])
        lines.append(f"| {node} | {len(by_node[node])} | {'all' if agree == len(by_node[node]) else agree} |")
    lines += ["", "## Cases that differ", "", "| case | largest difference | places | why |", "|---|---|---|---|"]
    for verdict in verdicts:
        if not verdict.agrees:
            why = verdict.note or "not explained"
            lines.append(
                f"| {compare.label(verdict.case)} | {100 * verdict.difference:.2g}% | {100 * verdict.differing:.0f}% | {why} |"
            )
    lines += ["", "## All cases", ""]
    for node in sorted(by_node):
        names = ", ".join(compare.label(verdict.case)[len(node) :] for verdict in by_node[node])
        lines.append(f"- **{node}**: {names}")
    return "\n".join(lines) + "\n"
