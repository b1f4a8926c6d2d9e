# SPDX-License-Identifier: GPL-3.0-or-later
"""A headlight on a bench in front of a wall: a filament of 3 x 0.8 mm in a glass bulb, in the focus of a mirror, behind a
glass cover with ribs. All its light is reflected or refracted several times before it reaches anything matte."""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks

k_focus = 0.030  # m, from the vertex of the mirror
k_radius = 0.095


def paraboloid():
    """Returns the mirror as a shell: inside facing +z, closed at its back."""
    inside = [(k_radius * step / 48, (k_radius * step / 48) ** 2 / (4 * k_focus)) for step in range(49)]
    rim = inside[-1][1]
    outside = [(k_radius + 0.004, rim), (k_radius + 0.004, rim - 0.002), (0.06, 0.012), (0.0, -0.012)]
    return blocks.lathe("Mirror", list(reversed([*inside, *outside])), 128), rim


def cover():
    """Returns the cover: flat outside, ribs along y inside, 5 mm thick."""
    count, radius = 112, k_radius + 0.0035
    rows = 56
    vertices, faces = [], []
    # A disc as a grid stretched to a circle (Shirley and Chiu 1997 would keep areas; here only the outline matters).
    for side in (0, 1):
        for row in range(rows + 1):
            for column in range(count + 1):
                u, v = 2 * column / count - 1, 2 * row / rows - 1
                x, y = radius * u * math.sqrt(1 - v * v / 2), radius * v * math.sqrt(1 - u * u / 2)
                ribs = 0.0009 * (1 + math.cos(2 * math.pi * x / 0.012)) * (1 - max(u * u, v * v) ** 4)
                vertices.append((x, y, 0.005 if side else -ribs))
    line, layer = count + 1, (count + 1) * (rows + 1)
    for row in range(rows):
        for column in range(count):
            a = row * line + column
            faces.append((a, a + line, a + line + 1, a + 1))
            faces.append((layer + a, layer + a + 1, layer + a + line + 1, layer + a + line))
    edge = [column for column in range(count)] + [row * line + count for row in range(rows)]
    edge += [rows * line + column for column in range(count, 0, -1)] + [row * line for row in range(rows, 0, -1)]
    for a, b in zip(edge, edge[1:] + edge[:1]):
        faces.append((a, b, layer + b, layer + a))
    return blocks.mesh("Cover", vertices, faces, smooth=False)


def main():
    scene = blocks.begin()
    bench = blocks.diffuse("Bench", (0.42, 0.40, 0.37))
    wall = blocks.diffuse("Wall", (0.55, 0.54, 0.52))
    blocks.place(scene, blocks.quad("Bench", [(-1.2, -1.2, 0), (0.5, -1.2, 0), (0.5, 0.38, 0), (-1.2, 0.38, 0)]), bench)
    blocks.place(scene, blocks.quad("Right wall", [(0.5, 0.38, 0), (0.5, -1.2, 0), (0.5, -1.2, 1.4), (0.5, 0.38, 1.4)]), wall)
    blocks.place(scene, blocks.quad("Back wall", [(-1.2, 0.38, 0), (0.5, 0.38, 0), (0.5, 0.38, 1.4), (-1.2, 0.38, 1.4)]), wall)

    mirror, rim = paraboloid()
    chrome = blocks.metal("Reflector", (0.93, 0.93, 0.94), 0.0)
    # The axis of the lamp is its local z; here it points along +x, a little down and away from the camera.
    body = blocks.place(scene, mirror, chrome, (-0.30, 0.12, 0.17), (0, 91, 10))
    clear = blocks.glass("Glass", 1.5)
    parts = (
        ("Cover", cover(), clear, (0, 0, rim + 0.004)),
        ("Bulb", blocks.lathe("Bulb", [(0.0, -0.014), (0.006, -0.012), (0.0085, -0.004), (0.0085, 0.006), (0.006, 0.013), (0.0, 0.0155)], 48), clear, (0, 0, k_focus)),
        ("Hollow", blocks.lathe("Hollow", list(reversed([(0.0, -0.013), (0.0053, -0.0112), (0.0077, -0.0038), (0.0077, 0.0055), (0.0053, 0.0122), (0.0, 0.0145)])), 48), clear, (0, 0, k_focus)),
        ("Filament", blocks.lathe("Filament", [(0.0, -0.0015), (0.0004, -0.0015), (0.0004, 0.0015), (0.0, 0.0015)], 16, smooth=False), blocks.emission("Filament", (1.0, 0.82, 0.58), 45000.0), (0, 0, k_focus)),
        ("Housing", blocks.lathe("Housing", [(0.0, -0.05), (0.05, -0.045), (0.085, 0.0), (0.106, rim - 0.012), (0.106, rim + 0.012), (0.1, rim + 0.012), (0.1, rim)], 96), blocks.principled("Housing", Base_Color=(0.03, 0.05, 0.08), Roughness=0.25), (0, 0, 0)),
    )  # fmt: skip
    for name, mesh, kind, at in parts:
        part = blocks.place(scene, mesh, kind, name=name)
        part.parent, part.location = body, at
    iron = blocks.principled("Stand", Base_Color=(0.05, 0.05, 0.05), Roughness=0.4)
    blocks.place(scene, blocks.lathe("Stand", [(0.0, 0.0), (0.09, 0.0), (0.09, 0.012), (0.012, 0.02), (0.012, 0.09), (0.0, 0.09)], 64), iron, (-0.30, 0.12, 0.0))
    for x, y, height, color in ((0.12, 0.13, 0.20, (0.6, 0.12, 0.05)), (0.30, 0.02, 0.13, (0.08, 0.3, 0.12))):
        blocks.place(scene, blocks.lathe("Peg", [(0.0, 0.0), (0.035, 0.0), (0.03, height), (0.0, height)], 48, smooth=False), blocks.diffuse("Peg", color), (x, y, 0.0))

    blocks.light(scene, "AREA", "Fill", 1.6, (-0.2, -1.1, 1.3), (-0.2, 0, 0.1), (0.6, 0.75, 1.0), shape="SQUARE", size=0.5)
    blocks.world(scene, (0.5, 0.6, 1.0), 0.004)
    blocks.camera(scene, (0.12, -0.60, 0.36), (0.06, 0.12, 0.165), 27.0)
    blocks.transport(scene, 24)
    blocks.finish(scene, 480, 360)


main()
