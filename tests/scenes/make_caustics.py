# SPDX-License-Identifier: GPL-3.0-or-later
"""Glass and metal on a matte table under a lamp of 5 cm: reflected and refracted caustics, some of them seen through glass
and in a mirror."""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks


def main():
    scene = blocks.begin()
    table = blocks.diffuse("Table", (0.62, 0.58, 0.52))
    wall = blocks.diffuse("Wall", (0.34, 0.38, 0.44))
    blocks.place(scene, blocks.quad("Table", [(-1.2, -1.0, 0), (1.2, -1.0, 0), (1.2, 0.55, 0), (-1.2, 0.55, 0)]), table)
    blocks.place(scene, blocks.quad("Wall", [(-1.2, 0.55, 0), (1.2, 0.55, 0), (1.2, 0.55, 1.6), (-1.2, 0.55, 1.6)]), wall)

    gold = blocks.metal("Gold", (1.0, 0.71, 0.29), 0.06)
    ring = [(0.100, 0.0), (0.100, 0.065), (0.106, 0.065), (0.106, 0.0)]
    blocks.place(scene, blocks.lathe("Ring", list(reversed(ring)) + [ring[-1]], 160), gold, (-0.30, -0.16, 0.001))
    silver = blocks.metal("Silver", (0.92, 0.92, 0.93), 0.0)
    blocks.place(scene, blocks.sphere("Silver ball", 0.05, 96, 48), silver, (0.02, -0.30, 0.05))
    clear = blocks.glass("Glass", 1.52)
    blocks.place(scene, blocks.sphere("Glass ball", 0.075, 128, 64), clear, (0.30, -0.24, 0.077))
    goblet = blocks.curve_through(
        [(0.052, 0.002), (0.03, 0.006), (0.009, 0.016), (0.006, 0.05), (0.006, 0.085), (0.013, 0.105), (0.042, 0.135)]
        + [(0.056, 0.175), (0.054, 0.215), (0.049, 0.245)]
    )
    inside = blocks.curve_through([(0.0475, 0.245), (0.0522, 0.215), (0.0540, 0.175), (0.0395, 0.138), (0.015, 0.114), (0.0, 0.110)])
    blocks.place(scene, blocks.lathe("Goblet", [(0.0, 0.0), (0.051, 0.0), *goblet, (0.0485, 0.246), *inside], 128), clear, (0.10, 0.10, 0.001), scale=(1.15, 1.15, 1.15))
    amber = blocks.glass("Amber", 1.5, (1.0, 0.66, 0.24))
    prism = blocks.mesh(
        "Prism", [(-0.09, 0, 0), (0.09, 0, 0), (0.09, 0.09, 0), (-0.09, 0.09, 0), (-0.09, 0.045, 0.078), (0.09, 0.045, 0.078)],
        [(0, 3, 2, 1), (0, 1, 5, 4), (2, 3, 4, 5), (3, 0, 4), (1, 2, 5)],
    )  # fmt: skip
    blocks.place(scene, prism, amber, (0.36, 0.12, 0.001), (0, 0, 24))
    mirror = blocks.place(scene, blocks.box("Mirror", (0.34, 0.012, 0.30)), silver, (-0.30, 0.26, 0.152), (-6, 0, 18))
    frame = blocks.principled("Frame", Base_Color=(0.12, 0.05, 0.03), Roughness=0.3)
    backing = blocks.place(scene, blocks.box("Frame", (0.37, 0.012, 0.33)), frame)
    backing.parent, backing.location = mirror, (0.0, 0.008, 0.0)

    blocks.light(
        scene, "SPOT", "Lamp", 18.0, (-0.62, 0.28, 0.85), (0.04, -0.06, 0.0), (1.0, 0.9, 0.76), shadow_soft_size=0.025,
        spot_size=math.radians(75), spot_blend=0.3,
    )  # fmt: skip
    blocks.world(scene, (0.6, 0.7, 1.0), 0.03)
    blocks.camera(scene, (0.12, -1.05, 0.62), (0.02, -0.04, 0.075), 40.0)
    blocks.transport(scene, 12)
    blocks.finish(scene, 480, 360)


main()
