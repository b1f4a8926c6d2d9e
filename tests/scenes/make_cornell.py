# SPDX-License-Identifier: GPL-3.0-or-later
"""A diffuse Cornell box of 2 m with one square area light under its ceiling: the simplest whole light transport."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks


def main():
    scene = blocks.begin()
    white = blocks.simple("White", "ShaderNodeBsdfDiffuse", Color=(0.73, 0.73, 0.73))
    red = blocks.simple("Red", "ShaderNodeBsdfDiffuse", Color=(0.63, 0.06, 0.05))
    green = blocks.simple("Green", "ShaderNodeBsdfDiffuse", Color=(0.14, 0.45, 0.09))
    walls = (
        ("Floor", [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], white),
        ("Ceiling", [(-1, 1, 2), (1, 1, 2), (1, -1, 2), (-1, -1, 2)], white),
        ("Back", [(-1, 1, 0), (1, 1, 0), (1, 1, 2), (-1, 1, 2)], white),
        ("Left", [(-1, -1, 0), (-1, 1, 0), (-1, 1, 2), (-1, -1, 2)], red),
        ("Right", [(1, 1, 0), (1, -1, 0), (1, -1, 2), (1, 1, 2)], green),
    )
    for name, corners, kind in walls:
        blocks.place(scene, blocks.quad(name, corners), kind)
    blocks.place(scene, blocks.box("Tall box", (0.6, 0.6, 1.2)), white, (-0.33, 0.3, 0.6), (0, 0, 18))
    blocks.place(scene, blocks.box("Short box", (0.6, 0.6, 0.6)), white, (0.35, -0.35, 0.3), (0, 0, -17))
    blocks.light(scene, "AREA", "Lamp", 25.0, (0, 0, 1.98), color=(1.0, 0.9, 0.75), shape="SQUARE", size=0.5)
    blocks.world(scene)
    blocks.camera(scene, (0, -4.3, 1), (0, 0, 1), 50.0)
    blocks.finish(scene, 256, 256)


main()
