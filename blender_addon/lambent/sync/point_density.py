# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The voxels of Point Density nodes, which Blender up to 4.x works out itself from particles or vertices."""

import numpy as np
from mathutils import Matrix


def export(edits, depsgraph, node, owner_name, properties):
    """Puts the voxels of a node as an image, slices above one another, and into properties what the engine needs to read it:
    image, resolution, and (space WORLD) row_0 to row_2 of the transform to coordinates from 0 to 1."""
    properties.pop("object_transform", None)
    if node.object is None:
        return
    node.cache_point_density(depsgraph=depsgraph)
    # Reading the voxels frees what the bounds are known from.
    low, high = node.calc_point_density_minmax(depsgraph=depsgraph)
    voxels = np.array(node.calc_point_density(depsgraph=depsgraph), np.float32)
    n = node.resolution
    if len(voxels) != 4 * n**3:
        return
    identifier = f"point density:{owner_name}:{node.name}"
    # The four channels are read as they are.
    value = {"name": identifier, "colorspace": "Non-Color", "alpha": "channel_packed"}
    value["pixels"] = edits.array(voxels.reshape(n * n, n, 4))
    edits.put("image", identifier, value)
    properties["image"], properties["resolution"] = identifier, n
    scale = [1.0 / (b - a) if b > a else 0.0 for a, b in zip(low, high)]
    offset = [-a * s if s else 0.5 for a, s in zip(low, scale)]
    rows = Matrix.Translation(offset) @ Matrix.Diagonal((*scale, 1.0)) @ node.object.matrix_world.inverted_safe()
    for k in range(3):
        properties[f"row_{k}"] = list(rows[k])
