# SPDX-License-Identifier: GPL-3.0-or-later
"""Each kind of light, in walled lanes of two: point and ball, hard and soft spot, the four area shapes, a narrow spread, an
emissive mesh; a weak wide sun and world over all of them. The spots are scaled unevenly (Blender 3.5 and later see it); in
Blender 4 and later ball and soft spot are spheres."""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks


def main():
    scene = blocks.begin()
    grey = blocks.simple("Grey", "ShaderNodeBsdfDiffuse", Color=(0.7, 0.7, 0.7))
    blocks.place(scene, blocks.quad("Floor", [(-12, -12, 0), (12, -12, 0), (12, 12, 0), (-12, 12, 0)]), grey)
    shape, wall = blocks.sphere("Ball", 0.3, 48, 24), blocks.box("Wall", (0.06, 2.0, 1.6))
    across = blocks.box("Wall across", (10.06, 0.06, 1.6))
    lamps = (
        ("Point", "POINT", 40.0, {"shadow_soft_size": 0.0}),
        ("Ball lamp", "POINT", 40.0, {"shadow_soft_size": 0.25}),
        ("Hard spot", "SPOT", 60.0, {"spot_size": math.radians(50), "spot_blend": 0.0, "shadow_soft_size": 0.0}),
        ("Soft spot", "SPOT", 60.0, {"spot_size": math.radians(60), "spot_blend": 1.0, "shadow_soft_size": 0.1}),
        ("Square", "AREA", 20.0, {"shape": "SQUARE", "size": 0.6}),
        ("Rectangle", "AREA", 20.0, {"shape": "RECTANGLE", "size": 1.0, "size_y": 0.2}),
        ("Disk", "AREA", 20.0, {"shape": "DISK", "size": 0.7}),
        ("Ellipse", "AREA", 20.0, {"shape": "ELLIPSE", "size": 1.0, "size_y": 0.3}),
        ("Narrow", "AREA", 20.0, {"shape": "DISK", "size": 0.5, "spread": math.radians(40)}),
    )
    for index in range(10):
        x, y = 2.0 * (index % 5) - 4.0, 2.0 * (index // 5) - 1.0
        blocks.place(scene, shape, grey, (x, y, 0.3))
        if index < len(lamps):
            name, kind, energy, properties = lamps[index]
            hue = 0.5 + 0.5 * math.cos(1.3 * index)
            placed = blocks.light(scene, kind, name, energy, (x + 0.3, y - 0.2, 1.5), (x, y, 0), (1, 0.6 + 0.4 * hue, 1 - 0.5 * hue), **properties)
            if kind == "SPOT":
                placed.scale = (1.4, 0.8, 1.0)
            if hasattr(placed.data, "use_soft_falloff"):
                placed.data.use_soft_falloff = False
        else:
            glow = blocks.emission("Glow", (0.5, 0.8, 1.0), 12.0)
            blocks.place(scene, blocks.box("Glowing box", (0.4, 0.2, 0.2)), glow, (x + 0.2, y - 0.1, 1.5), (20, 30, 0))
    for column in range(6):
        for y in (-1.0, 1.0):
            blocks.place(scene, wall, grey, (2.0 * column - 5.0, y, 0.8))
    blocks.place(scene, across, grey, (0, 2.0, 0.8))
    blocks.light(scene, "SUN", "Sun", 0.15, (0, 0, 5), (3, 5, 0), (1.0, 0.9, 0.7), angle=math.radians(50))
    blocks.world(scene, (0.02, 0.03, 0.05))
    blocks.camera(scene, (0, -7.5, 9.5), (0, -0.1, 0), 36.0)
    blocks.finish(scene, 512, 288)


main()
