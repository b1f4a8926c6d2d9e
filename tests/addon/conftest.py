# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Runs scripts in a real Blender against the fake daemon and reads what the add-on sent.

$BLENDER is the command that starts Blender (default: blender; may have arguments). Without one these tests skip.
"""

import os
import pickle
import shlex
import shutil
import subprocess
import sys

import numpy as np
import pytest

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


@pytest.fixture
def run_blender(tmp_path):
    """Callable (script, mode="normal", prelude=True, arguments=(), environment={}, timeout=90, wrapper=None) -> Run.

    wrapper: a command that starts Blender with a display for a real window; without one it runs in the background.
    """
    command = blender_command()
    if command is None:
        pytest.skip("no Blender: set BLENDER or put blender on PATH")

    def run(
        script, mode="normal", prelude=True, arguments=(), environment=None, timeout=90, wrapper=None, daemon=FAKE_DAEMON
    ):
        record = tmp_path / "record"
        record.mkdir(exist_ok=True)
        path = tmp_path / "script.py"
        path.write_text((PRELUDE if prelude else "") + script)
        variables = dict(
            os.environ,
            LAMBENT_DAEMON=str(daemon),
            LAMBENT_FAKE_RECORD=str(record),
            LAMBENT_FAKE_MODE=mode,
            LAMBENT_TEST_DIR=str(tmp_path),
            **(environment or {}),
        )
        for name in ("LAMBENT_ADDRESS", "LAMBENT_TOKEN_FILE"):
            if name not in (environment or {}):
                variables.pop(name, None)
        started = [*wrapper, *command] if wrapper else [*command, "-b"]
        full = [*started, "--factory-startup", "--python-exit-code", "9", *arguments]
        process = subprocess.run(
            [*full, "--python", str(path)],
            env=variables,
            timeout=timeout,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
        )
        assert process.returncode != 9, process.stdout
        return Run(process, record)

    return run
