# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Runs scripts in a real Blender against a daemon and reads what the add-on sent.

$BLENDER is the command that starts Blender (default: blender; may have arguments). Without one these tests skip.
"""

import os
import pickle
import shlex
import shutil
import subprocess
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
ADDONS = os.path.join(ROOT, "blender_addon")
FAKE_DAEMON = os.path.join(HERE, "fake_daemon.py")
sys.path.insert(0, HERE)
sys.path.insert(0, os.path.join(ADDONS, "lambent"))

# Runs before every script: the add-on from the source tree, in an empty scene with a camera at the origin.
PRELUDE = f"""
import sys
sys.path.insert(0, {ADDONS!r})
import bpy, lambent
print('VERSION', *bpy.app.version)
lambent.register()
scene = bpy.context.scene
def empty_scene():
    for ob in list(bpy.data.objects): bpy.data.objects.remove(ob)
    for mesh in list(bpy.data.meshes): bpy.data.meshes.remove(mesh)
    for found in list(bpy.data.materials): bpy.data.materials.remove(found)
    scene.render.engine = 'LAMBENT'
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 160, 96, 100
    scene.view_settings.view_transform = 'Raw'
    scene.camera = add('camera', bpy.data.cameras.new('camera'))
def add(name, data, collection=None):
    ob = bpy.data.objects.new(name, data)
    (collection or scene.collection).objects.link(ob)
    return ob
def add_mesh(name, vertices, faces, collection=None):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    return add(name, mesh, collection)
def quad(name='quad', collection=None):
    return add_mesh(name, [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)], collection)
def node_material(name):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    material.node_tree.nodes.clear()
    return material, material.node_tree.nodes, material.node_tree.links
def render(**arguments):
    return bpy.ops.render.render(**arguments)
empty_scene()
"""


# Saves the render as raw floats, so that tests see what the engine wrote.
SAVE = """
import numpy as np, os
def save(name):
    path = os.path.join(os.environ['LAMBENT_TEST_DIR'], name)
    settings = scene.render.image_settings
    if hasattr(settings, 'media_type'): settings.media_type = 'IMAGE'
    settings.file_format, settings.color_depth, settings.color_mode, settings.exr_codec = 'OPEN_EXR', '32', 'RGBA', 'NONE'
    bpy.data.images['Render Result'].save_render(path + '.exr')
    image = bpy.data.images.load(path + '.exr')
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    np.save(path + '.npy', pixels.reshape(image.size[1], image.size[0], 4))
"""


def blender_command():
    """The command line that starts Blender, or None."""
    command = shlex.split(os.environ.get("BLENDER", "blender"))
    return command if shutil.which(command[0]) else None


class Run:
    """What one run of Blender left behind.

    output, code: of the process. messages: recorded by the fake daemon, in order, as {"header", "arrays", "session"}.
    """

    def __init__(self, process, record):
        self.output = process.stdout
        self.code = process.returncode
        self.messages = []
        for name in sorted(os.listdir(record)):
            if name.endswith(".pickle"):
                with open(os.path.join(record, name), "rb") as file:
                    message = pickle.load(file)
                for key, (dtype, shape, content) in message["arrays"].items():
                    message["arrays"][key] = np.frombuffer(content, dtype).reshape(shape)
                self.messages.append(message)

    def of_type(self, kind):
        """The recorded messages of a type."""
        return [message for message in self.messages if message["header"]["type"] == kind]

    @property
    def blender_major(self):
        """The first number of the version of the Blender that ran PRELUDE."""
        return int(self.output.split("VERSION ")[1].split()[0])

    @property
    def transactions(self):
        """The edits of each transaction."""
        return [message["header"]["edits"] for message in self.of_type("transaction")]

    @property
    def arrays(self):
        """All arrays that travelled, by hash."""
        return {key: values for message in self.messages for key, values in message["arrays"].items()}

    def values(self, kind, transactions=None):
        """{id: value} of a kind after all (or the first few) transactions."""
        found = {}
        for edits in self.transactions[:transactions]:
            for edit in edits:
                if edit["op"] == "clear":
                    found.clear()
                elif edit["kind"] == kind and edit["op"] == "remove":
                    found.pop(edit["id"])
                elif edit["kind"] == kind:
                    found[edit["id"]] = edit["value"]
        return found

    def array(self, reference):
        """The array behind {"array": hash}."""
        return self.arrays[reference["array"]]


def run_script(
    script, folder, mode="normal", prelude=True, arguments=(), environment=None, timeout=90, wrapper=None, daemon=FAKE_DAEMON
):
    """Runs a Python script in Blender and returns the Run.

    folder: a pathlib.Path for what it writes (LAMBENT_TEST_DIR) and what the fake daemon records. mode: the fake
    daemon's. prelude: whether PRELUDE runs first. wrapper: a command that starts Blender with a display for a real
    window; without one it runs in the background. Fails where the script raises.
    """
    command = blender_command()
    record = folder / "record"
    record.mkdir(exist_ok=True)
    path = folder / "script.py"
    path.write_text((PRELUDE if prelude else "") + script)
    variables = {
        **os.environ,
        "LAMBENT_DAEMON": str(daemon),
        "LAMBENT_FAKE_RECORD": str(record),
        "LAMBENT_FAKE_MODE": mode,
        "LAMBENT_TEST_DIR": str(folder),
    }
    for name in ("LAMBENT_ADDRESS", "LAMBENT_TOKEN_FILE"):
        variables.pop(name, None)
    variables.update(environment or {})
    started = [*wrapper, *command] if wrapper else [*command, "-b"]
    process = subprocess.run(
        [*started, "--factory-startup", "--python-exit-code", "9", *arguments, "--python", str(path)],
        env=variables,
        timeout=timeout,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    )
    assert process.returncode != 9, process.stdout
    return Run(process, record)
