# SPDX-License-Identifier: GPL-3.0-or-later
"""Veach's plates: four lamps of equal power and unequal size mirrored in four plates of unequal roughness. Sampling the
lamps suits small lamps and rough plates, sampling the plates the opposite: only weighing both does well everywhere."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks
import mathutils

k_eye = mathutils.Vector((0.0, -7.5, 2.6))
k_lamps = mathutils.Vector((0.0, 1.5, 2.6))  # their middle
# (radius m, colour)
k_balls = ((0.025, (1.0, 0.35, 0.25)), (0.08, (1.0, 0.8, 0.35)), (0.22, (0.45, 1.0, 0.5)), (0.55, (0.4, 0.6, 1.0)))
# (depth m, height m, roughness as Blender's: the square root of GGX's alpha), from the back to the front
k_plates = ((0.9, 0.98, 0.07), (-0.1, 0.62, 0.14), (-1.1, 0.36, 0.22), (-2.1, 0.18, 0.32))


def main():
    scene = blocks.begin()
    grey = blocks.diffuse("Grey", (0.5, 0.5, 0.52))
    blocks.place(scene, blocks.quad("Floor", [(-12, -9, 0), (12, -9, 0), (12, 3.2, 0), (-12, 3.2, 0)]), grey)
    blocks.place(scene, blocks.quad("Wall", [(-12, 3.2, 0), (12, 3.2, 0), (12, 3.2, 9), (-12, 3.2, 9)]), grey)
    for number, (y, z, roughness) in enumerate(k_plates):
        centre = mathutils.Vector((0.0, y, z))
        # The plate's normal halves the angle between the eye and the lamps.
        normal = ((k_eye - centre).normalized() + (k_lamps - centre).normalized()).normalized()
        plate = blocks.place(
            scene, blocks.box(f"Plate {number}", (4.6, 0.6, 0.04)), blocks.metal(f"Plate {number}", (0.62, 0.62, 0.64), roughness)
        )
        plate.location = centre
        plate.rotation_euler = normal.to_track_quat("Z", "Y").to_euler()
    for number, (radius, color) in enumerate(k_balls):
        glow = blocks.emission(f"Lamp {number}", color, 0.62 / radius**2)
        blocks.place(scene, blocks.sphere(f"Lamp {number}", radius, 48, 24), glow, (-1.8 + 1.2 * number, k_lamps.y, k_lamps.z))
    blocks.light(scene, "AREA", "Fill", 260.0, (0, -5.0, 7.0), (0, 0, 0.5), shape="SQUARE", size=2.0)
    blocks.world(scene)
    blocks.camera(scene, k_eye, (0.0, 0.0, 1.12), 48.0)
    blocks.transport(scene, 6)
    blocks.finish(scene, 480, 360)


main()
