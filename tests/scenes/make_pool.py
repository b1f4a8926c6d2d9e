# SPDX-License-Identifier: GPL-3.0-or-later
"""A tiled pool seen through its water, lit by one small lamp: the caustics on its floor reach the camera through the water
again (specular, diffuse, specular), which only density estimation finds."""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks

k_width, k_length, k_depth, k_level = 3.0, 4.0, 1.1, -0.12  # m; the level of the water below the deck
# (wavelength m, heading degrees, height m, phase)
k_waves = ((0.95, 20, 0.016, 0.3), (0.61, 75, 0.009, 1.9), (0.43, -38, 0.006, 4.0), (0.30, 140, 0.0035, 2.2), (0.22, 5, 0.002, 5.1))


def height(x, y):
    """Returns the height of the water over its level (m)."""
    total = 0.0
    for length, heading, amplitude, phase in k_waves:
        angle = math.radians(heading)
        total += amplitude * math.sin(2 * math.pi / length * (x * math.cos(angle) + y * math.sin(angle)) + phase)
    return total


def water(columns=150, rows=200):
    """Returns the water's surface: one sheet, front upwards."""
    vertices = [
        (x, y, k_level + height(x, y))
        for row in range(rows + 1)
        for column in range(columns + 1)
        for x, y in [(k_width * (column / columns - 0.5), k_length * (row / rows - 0.5))]
    ]
    line = columns + 1
    faces = [
        (row * line + column, row * line + column + 1, (row + 1) * line + column + 1, (row + 1) * line + column)
        for row in range(rows)
        for column in range(columns)
    ]
    return blocks.mesh("Water", vertices, faces, smooth=True)


def main():
    scene = blocks.begin()
    blue = [(0.32, 0.68, 0.78), (0.40, 0.75, 0.82), (0.26, 0.60, 0.74), (0.46, 0.79, 0.84), (0.36, 0.71, 0.80)]
    tiles = blocks.textured("Pool tiles", blocks.tiles("pool tiles", blue, (0.85, 0.88, 0.88), 0.07), Roughness=0.9)
    deck = blocks.textured(
        "Deck", blocks.tiles("deck", [(0.66, 0.60, 0.53), (0.70, 0.64, 0.56), (0.62, 0.57, 0.50)], (0.40, 0.36, 0.32), 0.04),
        Roughness=0.7,
    )  # fmt: skip
    x, y, low = k_width / 2, k_length / 2, -k_depth
    for name, corners in (
        ("Floor", [(-x, -y, low), (x, -y, low), (x, y, low), (-x, y, low)]),
        ("Far", [(-x, y, low), (x, y, low), (x, y, 0), (-x, y, 0)]),
        ("Near", [(x, -y, low), (-x, -y, low), (-x, -y, 0), (x, -y, 0)]),
        ("Left", [(-x, -y, low), (-x, y, low), (-x, y, 0), (-x, -y, 0)]),
        ("Right", [(x, y, low), (x, -y, low), (x, -y, 0), (x, y, 0)]),
    ):
        blocks.place(scene, blocks.quad(name, corners, 4.0), tiles)
    for name, corners in (
        ("Deck left", [(-6, -6, 0), (-x, -6, 0), (-x, 6, 0), (-6, 6, 0)]),
        ("Deck right", [(x, -6, 0), (6, -6, 0), (6, 6, 0), (x, 6, 0)]),
        ("Deck far", [(-x, y, 0), (x, y, 0), (x, 6, 0), (-x, 6, 0)]),
        ("Deck near", [(-x, -6, 0), (x, -6, 0), (x, -y, 0), (-x, -y, 0)]),
    ):
        blocks.place(scene, blocks.quad(name, corners, 3.0), deck)
    blocks.place(scene, water(), blocks.glass("Water", 1.33))

    for number in range(4):  # stairs in the far left corner
        step = blocks.box("Step", (0.9, 0.28 * (4 - number), 0.22))
        blocks.place(scene, step, blocks.diffuse("Stairs", (0.75, 0.78, 0.78)), (-x + 0.45, y - 0.14 * (4 - number), low + 0.11 + 0.22 * number))
    chrome = blocks.metal("Chrome", (0.85, 0.86, 0.88), 0.08)
    for side in (0.0, 0.45):
        arc = [(x - 0.14, 0.5 + side, -0.8), (x - 0.14, 0.5 + side, 0.45)]
        arc += [(x - 0.14 + 0.17 * (1 - math.cos(a)), 0.5 + side, 0.45 + 0.17 * math.sin(a)) for a in (0.5, 1.0, 1.57, 2.1, 2.7, 3.14)]
        arc += [(x + 0.2, 0.5 + side, 0.0)]
        blocks.place(scene, blocks.tube("Rail", arc, [0.022] * len(arc)), chrome)
    for depth in (-0.25, -0.5, -0.75):
        blocks.place(scene, blocks.box("Rung", (0.05, 0.45, 0.03)), chrome, (x - 0.14, 0.725, depth))
    ball = blocks.place(scene, blocks.sphere("Ball", 0.17, 48, 24), blocks.principled("Ball", Base_Color=(0.75, 0.07, 0.05), Roughness=0.35))
    ball.location = (-0.65, -0.25, k_level + 0.08)

    blocks.light(scene, "POINT", "Lamp", 900.0, (-1.6, 1.9, 3.4), color=(1.0, 0.93, 0.82), shadow_soft_size=0.03)
    blocks.world(scene, (0.35, 0.5, 0.9), 0.06)
    blocks.camera(scene, (1.7, -4.5, 2.7), (0.12, 0.05, -0.55), 35.0)
    blocks.transport(scene, 12)
    blocks.finish(scene, 480, 360)


main()
