# SPDX-License-Identifier: GPL-3.0-or-later
"""1,600 instances of one mesh of 16,128 triangles under a sun and an even sky: 25.8 million triangles seen, one stored."""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks


def knob(segments=128, rings=64):
    """A sphere with waves around and along it: 2·128·63 = 16,128 triangles when its quads are split."""
    vertices, faces = [(0.0, 0.0, -0.5)], []
    for ring in range(1, rings):
        polar = math.pi * (ring / rings - 0.5)
        for step in range(segments):
            around = 2 * math.pi * step / segments
            radius = 0.5 + 0.05 * math.cos(polar) * math.sin(9 * around) * math.cos(7 * polar)
            flat = radius * math.cos(polar)
            vertices.append((flat * math.cos(around), flat * math.sin(around), radius * math.sin(polar)))
    vertices.append((0.0, 0.0, 0.5))
    top = len(vertices) - 1
    for step in range(segments):
        following = (step + 1) % segments
        faces.append((0, 1 + following, 1 + step))
        for ring in range(rings - 2):
            lower, upper = 1 + ring * segments, 1 + (ring + 1) * segments
            faces.append((lower + step, lower + following, upper + following, upper + step))
        last = 1 + (rings - 2) * segments
        faces.append((last + step, last + following, top))
    return blocks.mesh("Knob", vertices, faces, smooth=True)


def main():
    scene = blocks.begin()
    ground = blocks.simple("Ground", "ShaderNodeBsdfDiffuse", Color=(0.35, 0.33, 0.3))
    paint = blocks.principled("Paint", Base_Color=(0.6, 0.25, 0.1), Roughness=0.4)
    blocks.place(scene, blocks.quad("Ground", [(-60, -60, 0), (60, -60, 0), (60, 60, 0), (-60, 60, 0)]), ground)
    shape = knob()
    for column in range(40):
        for row in range(40):
            turn = 37.0 * column + 53.0 * row
            size = 0.75 + 0.25 * math.sin(1.7 * column) * math.cos(2.3 * row)
            place = (1.3 * (column - 19.5), 1.3 * (row - 19.5), 0.5 * size)
            blocks.place(scene, shape, paint, place, (0, 0, turn), (size, size, size), name=f"Knob {column:02} {row:02}")
    blocks.light(scene, "SUN", "Sun", 3.0, (0, 0, 10), (6, 4, 0), (1.0, 0.95, 0.85), angle=math.radians(0.53))
    blocks.world(scene, (0.35, 0.5, 0.8), 0.6)
    blocks.camera(scene, (22, -30, 16), (0, -4, 0), 40.0)
    blocks.finish(scene, 480, 270)


main()
