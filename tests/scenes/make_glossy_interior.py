# SPDX-License-Identifier: GPL-3.0-or-later
"""A hall of glossy surfaces lit from coves, so that nearly all light is reflected before it is seen, often by what is
neither matte nor a mirror. Merging photons shows blotches here unless its weights know of their correlation."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks


def main():
    scene = blocks.begin()
    white = blocks.diffuse("Ceiling", (0.78, 0.76, 0.72))
    squares = blocks.tiles("marble", [(0.10, 0.10, 0.11), (0.55, 0.52, 0.47)], (0.25, 0.24, 0.22), 0.015, 2)
    floor = blocks.textured("Floor", squares, Roughness=0.12)
    panel = blocks.metal("Brushed steel", (0.66, 0.65, 0.62), 0.38)
    lacquer = blocks.principled("Red lacquer", Base_Color=(0.42, 0.03, 0.03), Roughness=0.16)
    bronze = blocks.metal("Bronze", (0.78, 0.50, 0.24), 0.28)

    # x -2.2..2.2, y -3..3, z 0..2.8
    blocks.place(scene, blocks.quad("Floor", [(-2.2, -3, 0), (2.2, -3, 0), (2.2, 3, 0), (-2.2, 3, 0)], 3.0), floor)
    blocks.place(scene, blocks.quad("Ceiling", [(-2.2, 3, 2.8), (2.2, 3, 2.8), (2.2, -3, 2.8), (-2.2, -3, 2.8)]), white)
    blocks.place(scene, blocks.wall("Front", 4.4, 2.8, 0.1), white, (-2.2, -3.1, 0))
    blocks.place(scene, blocks.wall("Back", 4.4, 2.8, 0.1), lacquer, (-2.2, 3.0, 0))
    for side in (-1, 1):
        blocks.place(scene, blocks.quad("Side", [(2.2 * side, -3, 0), (2.2 * side, 3, 0), (2.2 * side, 3, 2.8), (2.2 * side, -3, 2.8)]), white)
        for number in range(5):
            blocks.place(scene, blocks.box("Panel", (0.05, 1.1, 2.2)), panel, (2.17 * side, -2.4 + 1.2 * number, 1.12))
        # A cove: a ledge that hides its lamp, which shines at the ceiling.
        blocks.place(scene, blocks.box("Ledge", (0.34, 6.0, 0.05)), white, (2.03 * side, 0, 2.36))
        blocks.place(scene, blocks.box("Lip", (0.03, 6.0, 0.16)), white, (1.86 * side, 0, 2.42))
        blocks.light(
            scene, "AREA", "Cove", 75.0, (2.03 * side, 0, 2.40), (2.03 * side, 0, 3.0), (1.0, 0.84, 0.62), shape="RECTANGLE", size=0.12, size_y=5.6
        )
    for x, y in ((-1.35, 1.4), (1.35, 1.4)):
        profile = [(0.0, 0.0), (0.26, 0.0), (0.26, 0.06), (0.19, 0.1), (0.17, 2.1), (0.19, 2.16), (0.26, 2.2), (0.26, 2.26), (0.0, 2.26)]
        blocks.place(scene, blocks.lathe("Column", profile, 64, smooth=False), bronze, (x, y, 0))
    plinth = blocks.principled("Plinth", Base_Color=(0.03, 0.03, 0.035), Roughness=0.1)
    vase = blocks.curve_through(
        [(0.10, 0.0), (0.14, 0.05), (0.20, 0.17), (0.17, 0.32), (0.08, 0.45), (0.07, 0.53), (0.10, 0.60)]
    )
    for x, y, height, kind in (
        (-0.55, 0.9, 0.55, blocks.metal("Gold", (1.0, 0.66, 0.24), 0.2)),
        (0.55, 0.5, 0.4, blocks.principled("Blue glaze", Base_Color=(0.02, 0.09, 0.4), Roughness=0.14)),
    ):
        blocks.place(scene, blocks.box("Plinth", (0.5, 0.5, height)), plinth, (x, y, height / 2), (0, 0, 12))
        blocks.place(scene, blocks.lathe("Vase", [(0.0, 0.0), *vase, (0.09, 0.60), (0.06, 0.53), (0.0, 0.2)], 96), kind, (x, y, height))
    blocks.place(scene, blocks.sphere("Ball", 0.22), blocks.metal("Copper", (0.95, 0.55, 0.40), 0.3), (-0.15, -0.45, 0.22))
    blocks.place(scene, blocks.sphere("Small ball", 0.14), blocks.metal("Steel", (0.85, 0.85, 0.87), 0.14), (0.33, -0.75, 0.14))
    picture = blocks.emission("Lamp", (1.0, 0.9, 0.75), 6.0)
    blocks.place(scene, blocks.box("Lit niche", (0.7, 0.02, 0.5)), picture, (0.0, 2.98, 1.55))
    blocks.world(scene)
    blocks.camera(scene, (0.0, -2.9, 1.45), (0.0, 0.4, 0.92), 27.0)
    blocks.transport(scene, 12)
    blocks.finish(scene, 480, 360)


main()
