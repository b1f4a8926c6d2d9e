# SPDX-License-Identifier: GPL-3.0-or-later
"""A room with no lamp, lit by what comes through a door ajar from a lit room beside it, after Veach's scene of that name.
The lamp there shines away from the door, so nearly all light in the picture has been reflected several times."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks


def teapot(scene, material, location, turn):
    """Places a teapot of body, lid, spout and handle, 0.2 m high, turned about its axis by `turn` degrees."""
    profile = blocks.curve_through(
        [(0.07, 0.0), (0.115, 0.03), (0.14, 0.08), (0.125, 0.13), (0.09, 0.155), (0.06, 0.168), (0.025, 0.178)]
        + [(0.012, 0.19), (0.02, 0.205), (0.0, 0.215)]
    )
    body = blocks.place(scene, blocks.lathe("Teapot", [(0.0, 0.0), *profile]), material, location, (0, 0, turn))
    spout = [(0.11, 0, 0.06), (0.16, 0, 0.075), (0.19, 0, 0.11), (0.21, 0, 0.15), (0.235, 0, 0.165)]
    handle = [(-0.115, 0, 0.13), (-0.16, 0, 0.14), (-0.2, 0, 0.125), (-0.21, 0, 0.095), (-0.185, 0, 0.06), (-0.13, 0, 0.045)]
    for name, points, radii in (
        ("Spout", smooth(spout), (0.036, 0.013)),
        ("Handle", smooth(handle), (0.012, 0.012)),
    ):
        count = len(points)
        widths = [radii[0] + (radii[1] - radii[0]) * (index / (count - 1)) ** 0.7 for index in range(count)]
        blocks.place(scene, blocks.tube(name, points, widths), material).parent = body


def smooth(points):
    """Returns a finer polyline through points in the plane y = 0."""
    lifted = blocks.curve_through([(x + 10.0, z) for x, _, z in points])
    return [(x - 10.0, 0.0, z) for x, z in lifted]


def main():
    scene = blocks.begin()
    plaster = blocks.diffuse("Plaster", (0.72, 0.66, 0.56))
    warm = blocks.diffuse("Other room", (0.85, 0.72, 0.5))
    boards = blocks.textured(
        "Boards", blocks.tiles("boards", [(0.62, 0.42, 0.26), (0.55, 0.36, 0.22), (0.68, 0.47, 0.30)], (0.2, 0.13, 0.08), 0.03),
        Roughness=0.3,
    )  # fmt: skip
    wood = blocks.principled("Door", Base_Color=(0.32, 0.16, 0.07), Roughness=0.4)

    # This room: x -2..2, y -2.6..2. The other: y 2.1..4.
    blocks.place(scene, blocks.quad("Floor", [(-2, -2.6, 0), (2, -2.6, 0), (2, 4, 0), (-2, 4, 0)], 3.0), boards)
    blocks.place(scene, blocks.quad("Ceiling", [(-2, 4, 2.6), (2, 4, 2.6), (2, -2.6, 2.6), (-2, -2.6, 2.6)]), plaster)
    blocks.place(scene, blocks.wall("Left", 4.6, 2.6, 0.1), plaster, (-2, -2.6, 0), (0, 0, 90))
    blocks.place(scene, blocks.wall("Right", 4.6, 2.6, 0.1), plaster, (2.1, -2.6, 0), (0, 0, 90))
    blocks.place(scene, blocks.wall("Front", 4.0, 2.6, 0.1), plaster, (-2, -2.7, 0))
    blocks.place(scene, blocks.wall("Back", 4.0, 2.6, 0.1, (2.35, 3.25, 0.0, 2.05)), plaster, (-2, 2.0, 0))
    blocks.place(scene, blocks.wall("Far left", 1.9, 2.6, 0.1), warm, (-2, 2.1, 0), (0, 0, 90))
    blocks.place(scene, blocks.wall("Far right", 1.9, 2.6, 0.1), warm, (2.1, 2.1, 0), (0, 0, 90))
    blocks.place(scene, blocks.wall("Far", 4.0, 2.6, 0.1), warm, (-2, 4.0, 0))
    # Hinged at the right of the opening, ajar by 22 degrees into the other room.
    door = blocks.place(scene, blocks.box("Door", (0.89, 0.04, 2.04)), wood)
    hinge = blocks.place(scene, blocks.box("Hinge", (0.02, 0.02, 1.9)), wood, (1.24, 2.08, 1.02), (0, 0, -22))
    door.parent, door.location = hinge, (-0.45, 0.0, 0.005)
    knob = blocks.place(scene, blocks.sphere("Knob", 0.03, 32, 16), blocks.metal("Brass", (0.9, 0.62, 0.25), 0.25))
    knob.parent, knob.location = hinge, (-0.83, -0.06, 0.0)

    table = blocks.principled("Table", Base_Color=(0.10, 0.05, 0.03), Roughness=0.15)
    blocks.place(scene, blocks.box("Table top", (1.5, 0.8, 0.04)), table, (-0.2, -0.35, 0.72))
    for x in (-0.88, 0.48):
        for y in (-0.7, 0.0):
            blocks.place(scene, blocks.box("Leg", (0.05, 0.05, 0.7)), table, (x, y, 0.35))
    picture = blocks.principled("Picture", Base_Color=(0.05, 0.16, 0.28), Roughness=0.6)
    blocks.place(scene, blocks.box("Frame", (0.9, 0.04, 0.66)), wood, (-1.0, 1.98, 1.5))
    blocks.place(scene, blocks.box("Picture", (0.8, 0.05, 0.56)), picture, (-1.0, 1.98, 1.5))
    teapot(scene, blocks.metal("Steel", (0.8, 0.81, 0.83), 0.12), (-0.68, -0.32, 0.74), 20)
    teapot(scene, blocks.principled("Glaze", Base_Color=(0.62, 0.10, 0.05), Roughness=0.12), (0.24, -0.30, 0.74), -25)
    vase = [(0.05, 0.0), (0.085, 0.03), (0.095, 0.10), (0.06, 0.19), (0.035, 0.25), (0.05, 0.31)]
    inside = [(0.043, 0.308), (0.028, 0.25), (0.052, 0.19), (0.086, 0.10), (0.075, 0.035), (0.0, 0.02)]
    blocks.place(
        scene, blocks.lathe("Vase", [(0.0, 0.0), *blocks.curve_through(vase), *blocks.curve_through(inside)], 128),
        blocks.glass("Glass", 1.5, (0.9, 1.0, 0.95)), (-0.2, -0.35, 0.742),
    )  # fmt: skip

    blocks.light(
        scene, "AREA", "Lamp", 1500.0, (1.7, 3.1, 2.0), (-2.0, 3.3, 1.2), (1.0, 0.86, 0.62), shape="RECTANGLE", size=0.6, size_y=0.6
    )
    blocks.world(scene)
    blocks.camera(scene, (-0.55, -2.5, 1.5), (0.02, 0.6, 0.98), 26.0)
    blocks.transport(scene, 12)
    blocks.finish(scene, 480, 360)


main()
