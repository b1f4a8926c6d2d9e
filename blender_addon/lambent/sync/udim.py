# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Image Texture nodes of tiled images (UDIM) as nodes of the protocol: a texture for each tile, chosen by where the coordinates
lie. A tile covers one unit square; beyond the tiles the texture is pink, as in Cycles."""

PINK = [1.0, 0.0, 1.0]


def corner(number):
    """(u, v) of the lower left corner of a UDIM tile, counted from 1001 in rows of ten."""
    return (number - 1001) % 10, (number - 1001) // 10


def add(builder, name, vector, properties, tiles):
    """Adds nodes for a tiled image; returns {output: link} for Color and Alpha.

    vector: input value of the coordinates; properties: those of the Image Texture; tiles: [(number, image id)].
    """
    separate = builder.add("SeparateXYZ", name, {"Vector": vector})
    cell = [_math(builder, name, "FLOOR", [separate, axis]) for axis in ("X", "Y")]
    color, alpha = PINK, 1.0
    for number, identifier in tiles:
        place = corner(number)
        inside = [_math(builder, name, "COMPARE", cell[axis], float(place[axis]), 0.5) for axis in range(2)]
        chosen = _math(builder, name, "MULTIPLY", *inside)
        moved = builder.add(
            "Mapping", name, {"Vector": vector, "Location": [-float(place[0]), -float(place[1]), 0.0]}, {"vector_type": "POINT"}
        )
        texture = builder.add("TexImage", name, {"Vector": {"link": [moved, "Vector"]}}, {**properties, "image": identifier})
        color = _mix(builder, name, "RGBA", "Color", chosen, color, {"link": [texture, "Color"]})
        alpha = _mix(builder, name, "FLOAT", "Float", chosen, alpha, {"link": [texture, "Alpha"]})
    if not tiles:
        return {
            "Color": [builder.add("RGB", name, {"Color": PINK}), "Color"],
            "Alpha": [builder.add("Value", name, {"Value": 1.0}), "Value"],
        }
    return {"Color": color["link"], "Alpha": alpha["link"]}


def _math(builder, name, operation, *values):
    inputs = {}
    for socket, value in zip(("Value", "Value_001", "Value_002"), values):
        inputs[socket] = {"link": value} if isinstance(value, list) else value
    return [builder.add("Math", name, inputs, {"operation": operation}), "Value"]


def _mix(builder, name, data_type, suffix, chosen, without, with_tile):
    inputs = {"Factor_Float": {"link": chosen}, f"A_{suffix}": without, f"B_{suffix}": with_tile}
    return {"link": [builder.add("Mix", name, inputs, {"data_type": data_type, "blend_type": "MIX"}), f"Result_{suffix}"]}
