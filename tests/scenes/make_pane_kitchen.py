# SPDX-License-Identifier: GPL-3.0-or-later
"""The kitchen of the path integral tutorial in small: a small lamp outside behind a window pane, a mirror wall, glossy tiles
and counters, glass and metal on a table. All strong light enters through the glass, so no shadow ray ever finds the lamp."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks


def tableware(scene, top):
    """Places glass and metal on the table, whose top is at height `top` (m)."""
    clear = blocks.glass("Glass")
    carafe = [(0.05, 0.0), (0.075, 0.03), (0.078, 0.10), (0.05, 0.18), (0.03, 0.23), (0.045, 0.28)]
    inside = [(0.040, 0.278), (0.025, 0.23), (0.045, 0.18), (0.072, 0.10), (0.066, 0.03), (0.0, 0.018)]
    profile = [(0.0, 0.0), *blocks.curve_through(carafe), *blocks.curve_through(inside)]
    blocks.place(scene, blocks.lathe("Carafe", profile, 96), clear, (-0.42, 0.05, top + 0.002))
    tumbler = [(0.0, 0.0), (0.033, 0.0), (0.042, 0.11), (0.0395, 0.11), (0.031, 0.012), (0.0, 0.012)]
    for x, y in ((-0.18, -0.22), (0.12, 0.22)):
        blocks.place(scene, blocks.lathe("Tumbler", tumbler, 96), clear, (x, y, top + 0.002))
    copper = blocks.metal("Copper", (0.93, 0.50, 0.33), 0.12)
    pan = [(0.0, 0.0), (0.12, 0.0), (0.135, 0.015), (0.14, 0.07), (0.135, 0.07), (0.13, 0.018), (0.0, 0.006)]
    blocks.place(scene, blocks.lathe("Pan", pan, 96), copper, (0.30, -0.12, top))
    handle = blocks.tube("Handle", [(0.30 + 0.13 * t, -0.12 - 0.05 * t, top + 0.06 + 0.012 * t) for t in (1.02, 1.6, 2.4)], (0.009, 0.01, 0.012))
    blocks.place(scene, handle, copper)
    steel = blocks.metal("Steel", (0.86, 0.87, 0.88), 0.0)
    bowl = blocks.curve_through([(0.05, 0.0), (0.11, 0.03), (0.15, 0.09)])
    hollow = blocks.curve_through([(0.147, 0.09), (0.107, 0.034), (0.0, 0.006)])
    blocks.place(scene, blocks.lathe("Bowl", [(0.0, 0.0), *bowl, *hollow], 96), steel, (0.0, 0.0, top))
    orange = blocks.principled("Orange", Base_Color=(0.85, 0.30, 0.03), Roughness=0.4)
    for x, y, z in ((0.03, 0.03, 0.045), (-0.045, -0.02, 0.045), (-0.005, 0.02, 0.105)):
        blocks.place(scene, blocks.sphere("Orange", 0.042, 48, 24), orange, (x, y, top + z))


def main():
    scene = blocks.begin()
    plaster = blocks.diffuse("Plaster", (0.75, 0.73, 0.68))
    slabs = blocks.tiles("slabs", [(0.80, 0.78, 0.74), (0.76, 0.72, 0.66)], (0.42, 0.40, 0.38), 0.04)
    floor = blocks.textured("Floor tiles", slabs, Roughness=0.22)
    oak = blocks.principled("Oak", Base_Color=(0.45, 0.26, 0.12), Roughness=0.25)
    stone = blocks.principled("Counter", Base_Color=(0.06, 0.06, 0.07), Roughness=0.12)
    doors = blocks.principled("Cupboards", Base_Color=(0.12, 0.24, 0.26), Roughness=0.35)

    # x -1.8..1.8, y -2.4..1.8; open to a dim world behind the camera.
    blocks.place(scene, blocks.quad("Floor", [(-1.8, -2.4, 0), (1.8, -2.4, 0), (1.8, 1.8, 0), (-1.8, 1.8, 0)], 3.0), floor)
    blocks.place(scene, blocks.quad("Ceiling", [(-1.8, 1.8, 2.5), (1.8, 1.8, 2.5), (1.8, -2.4, 2.5), (-1.8, -2.4, 2.5)]), plaster)
    blocks.place(scene, blocks.wall("Back", 3.6, 2.5, 0.1), plaster, (-1.8, 1.8, 0))
    blocks.place(scene, blocks.wall("Left", 4.2, 2.5, 0.12, (1.75, 3.35, 0.95, 2.1)), plaster, (-1.8, -2.4, 0), (0, 0, 90))
    blocks.place(scene, blocks.wall("Right", 4.2, 2.5, 0.1), plaster, (1.92, -2.4, 0), (0, 0, 90))
    mirror = [(1.79, -2.4, 0.0), (1.79, 1.79, 0.0), (1.79, 1.79, 2.5), (1.79, -2.4, 2.5)]
    blocks.place(scene, blocks.quad("Mirror", mirror), blocks.metal("Mirror", (0.9, 0.9, 0.9), 0.0))
    blocks.place(scene, blocks.box("Pane", (0.008, 1.6, 1.15)), blocks.glass("Pane", 1.52), (-1.86, 0.15, 1.525))
    for size, at in (((0.05, 0.04, 1.15), (-1.86, 0.15, 1.525)), ((0.05, 1.6, 0.04), (-1.86, 0.15, 1.62))):
        blocks.place(scene, blocks.box("Bar", size), oak, at)

    blocks.place(scene, blocks.box("Cupboard", (2.9, 0.55, 0.84)), doors, (-0.35, 1.52, 0.42))
    blocks.place(scene, blocks.box("Counter", (2.95, 0.6, 0.04)), stone, (-0.35, 1.5, 0.86))
    for x in (-1.25, -0.55, 0.15, 0.85):
        blocks.place(scene, blocks.box("Grip", (0.16, 0.015, 0.015)), blocks.metal("Grip", (0.8, 0.8, 0.8), 0.2), (x - 0.2, 1.235, 0.74))
    jar = [(0.0, 0.0), (0.07, 0.0), (0.085, 0.03), (0.085, 0.18), (0.06, 0.21), (0.06, 0.23), (0.0, 0.24)]
    for number, color in enumerate(((0.6, 0.08, 0.05), (0.75, 0.5, 0.08), (0.1, 0.25, 0.1))):
        kind = blocks.principled(f"Jar {number}", Base_Color=color, Roughness=0.15)
        blocks.place(scene, blocks.lathe("Jar", jar, 64), kind, (-0.2 + 0.26 * number, 1.6, 0.88))
    blocks.place(scene, blocks.box("Table top", (1.3, 0.85, 0.035)), oak, (-0.1, 0.1, 0.7425))
    for x in (-0.68, 0.48):
        for y in (-0.26, 0.46):
            blocks.place(scene, blocks.box("Leg", (0.05, 0.05, 0.725)), oak, (x, y, 0.3625))
    tableware(scene, 0.76)

    blocks.light(scene, "POINT", "Lamp", 1500.0, (-4.0, 0.05, 3.1), color=(1.0, 0.88, 0.7), shadow_soft_size=0.03)
    blocks.world(scene, (0.5, 0.65, 0.9), 0.05)
    blocks.camera(scene, (0.75, -2.35, 1.55), (-0.12, 0.5, 0.85), 28.0)
    blocks.transport(scene, 16)
    blocks.finish(scene, 480, 360)


main()
