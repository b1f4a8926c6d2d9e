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
    """int64[V]: of the vertices that edges join, the one that stands for all in Cycles (util/disjoint_set.h).

    There each edge joins the sets of its ends: the set of lower rank goes under the root of the other, under that of the edge's
    first end where ranks are equal, which then rises by one. Here all sets of a rank are taken together. The first edge that
    leaves such a set either makes a set of the next rank, together with one for which it is the first edge too, or puts it under
    one of higher rank: afterwards all sets that edges still leave are of the next rank.
    """
    root = np.arange(vertex_count)
    edges = np.asarray(edges, np.int64).reshape(-1, 2)
    while True:
        edges = edges[edges[:, 0] != edges[:, 1]]
        if not len(edges):
            return root
        # Where in the list of ends each set comes first: of repeated indices the last assignment holds.
        ends = edges.ravel()
        first = np.full(vertex_count, -1)
        first[ends[::-1]] = np.arange(len(ends))[::-1]
        left = np.flatnonzero(first >= 0)
        above = np.arange(vertex_count)
        above[left] = ends[first[left] ^ 1]
        numbers = np.arange(len(edges))
        new = (first[edges[:, 0]] == 2 * numbers) & (first[edges[:, 1]] == 2 * numbers + 1)
        above[edges[new, 0]] = edges[new, 0]
        while (above != above[above]).any():
            above = above[above]
        root, edges = above[root], above[edges]


def random_numbers(integers):
    """float32 in [0, 1] for integers of 32 bits: Cycles' hash_uint_to_float (Jenkins 2006, lookup3)."""
    a = np.asarray(integers).astype(np.uint32) + np.uint32(0xDEADBEEF + 4 + 13)
    b = c = np.full_like(a, 0xDEADBEEF + 4 + 13)
    for step in (14, 11, 25, 16, 4, 14, 24):
        # The three take turns: c from b, a from c, b from a.
        a, b, c = b, (c ^ b) - ((b << np.uint32(step)) | (b >> np.uint32(32 - step))), a
    return b.astype(np.float32) * np.float32(1.0 / 0xFFFFFFFF)


def _sums(indices, vectors, count):
    return np.stack([np.bincount(indices, vectors[:, axis], count) for axis in range(3)], axis=1)


def _unit(vectors):
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)
