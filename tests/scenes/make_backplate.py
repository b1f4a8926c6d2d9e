# SPDX-License-Identifier: GPL-3.0-or-later
"""A place as a photograph shows it (a tiled floor before a painted wall) and things that are to be put into it: a mirror ball,
a glass ball, a red box, lit by a lamp and a sky."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks
import bpy


def main():
    scene = blocks.begin()
    tiles = blocks.tiles("Tiles", [(0.75, 0.7, 0.6), (0.45, 0.4, 0.35), (0.6, 0.3, 0.2)], (0.2, 0.2, 0.2), 0.06)
    paint = blocks.image("Paint", 64, 64, lambda u, v: (0.5 + 0.2 * u, 0.55, 0.65 - 0.2 * v))
    floor = blocks.quad("Floor", [(-4, -3, 0), (4, -3, 0), (4, 2, 0), (-4, 2, 0)], 4.0)
    wall = blocks.quad("Wall", [(-4, 2, 0), (4, 2, 0), (4, 2, 3), (-4, 2, 3)])
    blocks.place(scene, floor, blocks.textured("Floor", tiles, Roughness=0.4), name="Floor")
    blocks.place(scene, wall, blocks.textured("Wall", paint, Roughness=0.8), name="Wall")
    blocks.place(scene, blocks.sphere("Mirror", 0.5), blocks.metal("Mirror", (0.9, 0.9, 0.9), 0.1), (-1.2, 0.4, 0.5), name="Mirror")
    blocks.place(scene, blocks.sphere("Glass", 0.45), blocks.glass("Glass"), (0.1, -0.4, 0.45), name="Glass")
    red = blocks.simple("Red", "ShaderNodeBsdfDiffuse", Color=(0.8, 0.1, 0.05))
    blocks.place(scene, blocks.box("Box", (0.8, 0.8, 1.0)), red, (1.2, 0.5, 0.5), (0, 0, 30.0), name="Box")
    blocks.light(scene, "AREA", "Lamp", 250.0, (-2.0, -2.0, 3.5), (0, 0, 0), size=1.0)
    blocks.world(scene, (0.5, 0.6, 0.8), 0.5)
    blocks.camera(scene, (0, -6.5, 2.2), (0, 0, 0.7), 45.0)
    scene.render.film_transparent = True
    blocks.transport(scene, 8)
    blocks.finish(scene, 192, 108)


main()
