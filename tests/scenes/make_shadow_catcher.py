# SPDX-License-Identifier: GPL-3.0-or-later
"""A floor and a wall that only catch shadows, under a box and a ball, lit by a lamp, a sun and a sky; transparent film."""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks
import bpy


def main():
    scene = blocks.begin()
    grey = blocks.simple("Grey", "ShaderNodeBsdfDiffuse", Color=(0.6, 0.6, 0.6))
    red = blocks.simple("Red", "ShaderNodeBsdfDiffuse", Color=(0.8, 0.15, 0.1))
    blue = blocks.principled("Blue", Base_Color=(0.1, 0.25, 0.7), Roughness=0.3)
    floor = blocks.place(scene, blocks.quad("Floor", [(-4, -3, 0), (4, -3, 0), (4, 3, 0), (-4, 3, 0)]), grey, name="Floor")
    wall = blocks.place(scene, blocks.quad("Wall", [(-4, 2, 0), (4, 2, 0), (4, 2, 2), (-4, 2, 2)]), grey, name="Wall")
    floor.is_shadow_catcher = wall.is_shadow_catcher = True
    blocks.place(scene, blocks.sphere("Ball", 0.6, 64, 32), blue, (-0.9, 0.2, 0.6), name="Ball")
    blocks.place(scene, blocks.box("Box", (0.9, 0.9, 1.2)), red, (0.9, 0.3, 0.6), (0, 0, 30.0), name="Box")
    blocks.light(scene, "AREA", "Lamp", 200.0, (-2.5, -2.0, 3.5), (0, 0, 0), size=1.0)
    blocks.light(scene, "SUN", "Sun", 1.0, (3, -2, 5), (0, 0, 0), angle=math.radians(2.0))
    blocks.world(scene, (0.5, 0.6, 0.8), 0.4)
    blocks.camera(scene, (0, -7, 3.0), (0, 0, 0.5), 45.0)
    scene.render.film_transparent = True
    bpy.context.view_layer.cycles.use_pass_shadow_catcher = True
    blocks.finish(scene, 192, 108)


main()
