# SPDX-License-Identifier: GPL-3.0-or-later
"""1,500 point lights of many colours and powers over a floor with pillars: a picture that only importance sampling of
lights makes affordable. An optional second argument after `--` is another number of lights."""

import colorsys
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks


def main():
    scene = blocks.begin()
    count = int(blocks.arguments()[1]) if len(blocks.arguments()) > 1 else 1500
    grey = blocks.simple("Grey", "ShaderNodeBsdfDiffuse", Color=(0.6, 0.6, 0.6))
    polished = blocks.principled("Polished", Base_Color=(0.5, 0.5, 0.5), Roughness=0.25)
    blocks.place(scene, blocks.quad("Floor", [(-20, -20, 0), (20, -20, 0), (20, 20, 0), (-20, 20, 0)]), polished)
    pillar = blocks.box("Pillar", (0.8, 0.8, 2.4))
    for column in range(-4, 5):
        for row in range(-4, 5):
            blocks.place(scene, pillar, grey, (4 * column + 0.7 * (row % 2), 4 * row, 1.2), (0, 0, 13 * (column - row)))
    for index in range(count):
        # The additive recurrence of the golden ratio's relatives spreads points evenly (Roberts 2018).
        x, y, z = (math.modf(0.5 + index * step)[0] for step in (0.8191725134, 0.6710436067, 0.5497004779))
        color = colorsys.hsv_to_rgb(math.modf(0.618034 * index)[0], 0.6, 1.0)
        power = 0.5 * 16 ** math.modf(0.754878 * index)[0]  # 0.5 to 8 W
        place = (40 * x - 20, 40 * y - 20, 0.15 + 3.3 * z)
        blocks.light(scene, "POINT", f"Lamp {index:04}", power, place, color=color, shadow_soft_size=0.03)
    blocks.world(scene)
    blocks.camera(scene, (3, -24, 11), (0, -3, 0), 35.0)
    blocks.finish(scene, 480, 270)


main()
