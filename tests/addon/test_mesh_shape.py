# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pointiness and islands of meshes, without Blender."""

import harness  # noqa: F401  makes the add-on's modules that know no bpy importable
import numpy as np
import pytest
from sync import mesh_shape

# A cube of edge 2 around the origin, its corners' normals outwards.
CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
EDGES = np.array([(a, b) for a in range(8) for b in range(a) if np.abs(CORNERS[a] - CORNERS[b]).sum() == 2], np.int32)
NORMALS = CORNERS / np.float32(3**0.5)


def test_a_cubes_corners_are_as_pointed_as_their_angle_says():
    # The mean of a corner's three edges points straight inwards with length 1 / sqrt 3.
    expected = np.arccos(-1 / 3**0.5 * 1.0) / np.pi
    mean = np.arccos(np.dot(NORMALS[7], -np.ones(3) / 3)) / np.pi
    assert mean == pytest.approx(expected)
    assert mesh_shape.pointiness(CORNERS, NORMALS, EDGES) == pytest.approx(np.full(8, expected), abs=1e-6)
    assert mesh_shape.pointiness(CORNERS, -NORMALS, EDGES) == pytest.approx(np.full(8, 1 - expected), abs=1e-6)


def test_a_plane_is_flat_and_vertices_at_one_place_count_as_one():
    grid = np.array([(x, y, 0) for y in range(5) for x in range(5)], np.float32)
    edges = [(5 * y + x, 5 * y + x + 1) for y in range(5) for x in range(4)]
    edges += [(5 * y + x, 5 * y + x + 5) for y in range(4) for x in range(5)]
    up = np.tile(np.array([[0, 0, 1]], np.float32), (25, 1))
    assert mesh_shape.pointiness(grid, up, np.array(edges)) == pytest.approx(np.full(25, 0.5), abs=1e-6)
    # The cube cut into its faces, each with its own vertices and the corners' normals, is the cube.
    faces = [[i for i in range(8) if CORNERS[i][axis] == side] for axis in range(3) for side in (-1, 1)]
    cut = np.concatenate([CORNERS[face] for face in faces])
    rings = [(4 * f + a, 4 * f + b) for f in range(6) for a, b in ((0, 1), (1, 3), (3, 2), (2, 0))]
    found = mesh_shape.pointiness(cut, np.concatenate([NORMALS[face] for face in faces]), np.array(rings))
    assert found == pytest.approx(np.full(24, mesh_shape.pointiness(CORNERS, NORMALS, EDGES)[0]), abs=1e-6)


def test_points_without_edges_and_nothing_at_all_are_no_trouble():
    none = np.zeros((0, 2), np.int32)
    assert mesh_shape.pointiness(CORNERS, NORMALS, none).tolist() == [0.0] * 8
    assert mesh_shape.pointiness(CORNERS[:0], NORMALS[:0], none).tolist() == []
    assert mesh_shape.islands(3, none).tolist() == [0, 1, 2]
    broken = CORNERS.copy()
    broken[0] = np.nan
    assert np.isfinite(mesh_shape.pointiness(broken, NORMALS, EDGES)[[3, 5, 6, 7]]).any()


def joined_by_rank(count, edges):
    """What Cycles' disjoint sets give, edge by edge."""
    above, rank = list(range(count)), [0] * count

    def find(x):
        while above[x] != x:
            x = above[x]
        return x

    for x, y in edges:
        x, y = find(x), find(y)
        if x == y:
            continue
        if rank[x] < rank[y]:
            x, y = y, x
        above[y] = x
        rank[x] += rank[x] == rank[y]
    return [find(x) for x in range(count)]


@pytest.mark.parametrize("seed", range(60))
def test_an_islands_root_is_that_of_cycles_disjoint_sets(seed):
    generator = np.random.default_rng(seed)
    count = int(generator.integers(1, 400))
    edges = generator.integers(0, count, (int(generator.integers(0, 2 * count)), 2))
    if seed % 3 == 0:  # neighbours, as in meshes
        edges[:, 1] = np.minimum(edges[:, 0] + generator.integers(0, 3, len(edges)), count - 1)
    assert mesh_shape.islands(count, edges).tolist() == joined_by_rank(count, edges.tolist())


def test_islands_are_what_edges_join_however_long_the_way():
    shuffled = np.random.default_rng(1).permutation(100000)
    chain = np.stack([shuffled[:-1], shuffled[1:]], axis=1)
    cut = np.delete(chain, 49999, axis=0)
    assert len(np.unique(mesh_shape.islands(100000, chain))) == 1
    roots = mesh_shape.islands(100000, cut)
    assert len(np.unique(roots)) == 2
    assert len(np.unique(roots[shuffled[:50000]])) == len(np.unique(roots[shuffled[50000:]])) == 1


def test_random_numbers_are_even_and_those_of_lookup3():
    numbers = mesh_shape.random_numbers(np.arange(10000))
    assert 0.0 <= numbers.min() and numbers.max() <= 1.0 and abs(numbers.mean() - 0.5) < 0.02
    assert (mesh_shape.random_numbers([7, 7]) == numbers[7]).all()
    assert mesh_shape.random_numbers([0, 123456]) == pytest.approx([0.58242586, 0.04113325], abs=1e-6)
