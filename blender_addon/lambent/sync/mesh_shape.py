# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""What the Geometry node says of a mesh's shape: pointiness and islands, which Cycles too works out when it reads a mesh.

Knows no bpy. Vertices are float32[V][3], edges int32[E][2].
"""

import numpy as np

# The attributes that they travel as.
POINTINESS, ISLAND = ".pointiness", ".random_per_island"


def pointiness(positions, normals, edges):
    """float32[V]: the angle between a vertex's normal and the mean direction of its edges over pi, averaged with its neighbours'.

    Flat is 0.5, ridges are above it, valleys below. As Cycles (blender/mesh.cpp, attr_create_pointiness): vertices at one place
    count as one.
    """
    if not len(positions):
        return np.zeros(0, np.float32)
    places = np.ascontiguousarray(positions, np.float32).view([("", np.float32)] * 3).ravel()
    _, first, place_of = np.unique(places, return_index=True, return_inverse=True)
    place_of = place_of.ravel()
    count = len(first)
    normal = _sums(place_of, normals, count)
    alone = np.bincount(place_of, minlength=count) == 1
    normal[alone] = np.asarray(normals)[first[alone]]
    normal = _unit(normal)
    edges = np.unique(np.sort(place_of[edges], axis=1), axis=0)
    edges = edges[edges[:, 0] != edges[:, 1]]
    starts, ends = edges[:, 0], edges[:, 1]
    along = _unit(positions[first[ends]].astype(np.float64) - positions[first[starts]])
    degree = np.bincount(edges.ravel(), minlength=count)
    mean = (_sums(starts, along, count) - _sums(ends, along, count)) / np.maximum(degree, 1)[:, None]
    angle = np.arccos(np.clip(np.einsum("ij,ij->i", normal, mean), -1.0, 1.0)) / np.pi
    angle[degree == 0] = 0.0
    blurred = angle + np.bincount(starts, angle[ends], count) + np.bincount(ends, angle[starts], count)
    return (blurred / (degree + 1))[place_of].astype(np.float32)


def islands(vertex_count, edges):
    """int64[V]: the lowest number of the vertices that edges join each vertex with."""
    root = np.arange(vertex_count)
    while True:
        low, high = np.sort(root[edges], axis=1).T if len(edges) else (root[:0], root[:0])
        if (low == high).all():
            return root
        np.minimum.at(root, high, low)
        while (root != root[root]).any():
            root = root[root]


def random_numbers(integers):
    """float32 in [0, 1) for integers, the same for the same."""
    bits = np.asarray(integers).astype(np.uint64)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        bits = (bits + np.uint64(0x9E3779B97F4A7C15)) if shift == 30 else bits
        bits = (bits ^ (bits >> np.uint64(shift))) * np.uint64(factor)
    return ((bits ^ (bits >> np.uint64(31))) >> np.uint64(40)).astype(np.float32) / np.float32(1 << 24)


def _sums(indices, vectors, count):
    return np.stack([np.bincount(indices, vectors[:, axis], count) for axis in range(3)], axis=1)


def _unit(vectors):
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)
