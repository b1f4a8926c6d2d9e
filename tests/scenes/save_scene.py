# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside Blender with the add-on enabled: saves the open scene as a .lambent file, as the daemon would render it.

    blender -b SCENE.blend --python-exit-code 1 --python save_scene.py -- OUT.lambent DAEMON [WIDTH SAMPLES [SETTINGS]]

The same as File > Export > Lambent Scene. DAEMON is the program lambentd; SETTINGS a JSON
object of values for scene.lambent.
"""

import json
import os
import sys

import addon_utils
import bpy


def main():
    out, daemon, *rest = sys.argv[sys.argv.index("--") + 1 :]
    out = os.path.abspath(out)
    addon_utils.enable("lambent", default_set=True)
    bpy.context.preferences.addons["lambent"].preferences.daemon_path = os.path.abspath(daemon)
    scene = bpy.context.scene
    scene.render.engine = "LAMBENT"
    if rest:
        width, samples = (int(text) for text in rest[:2])
        render = scene.render
        render.resolution_y = round(width * render.resolution_y / render.resolution_x)
        render.resolution_x, render.resolution_percentage = width, 100
        scene.lambent.samples = samples
        for name, value in json.loads(rest[2] if len(rest) > 2 else "{}").items():
            setattr(scene.lambent, name, value)
    os.makedirs(os.path.dirname(out), exist_ok=True)
    bpy.ops.lambent.scene_export(filepath=out)  # raises when it reports an error


main()
