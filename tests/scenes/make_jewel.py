# SPDX-License-Identifier: GPL-3.0-or-later
"""Three cut stones on white paper under a point light: every bright fleck on the paper is a caustic of a point, and those seen
through a stone are out of reach of every technique but merging."""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks
import bmesh
import bpy
import mathutils


def cut(name, size, planes):
    """Returns what planes leave of a cube of side 2·`size` m: planes [(normal, distance m)..] keep what lies behind them.
    Flat facets."""
    shape = bmesh.new()
    bmesh.ops.create_cube(shape, size=2 * size)
    for normal, distance in planes:
        normal = mathutils.Vector(normal).normalized()
        everything = shape.verts[:] + shape.edges[:] + shape.faces[:]
        found = bmesh.ops.bisect_plane(shape, geom=everything, plane_co=normal * distance, plane_no=normal, clear_outer=True)
        edges = [part for part in found["geom_cut"] if isinstance(part, bmesh.types.BMEdge)]
        if len(edges) >= 3:
            bmesh.ops.contextual_create(shape, geom=edges)
    bmesh.ops.remove_doubles(shape, verts=shape.verts, dist=1e-6 * size)
    bmesh.ops.recalc_face_normals(shape, faces=shape.faces)
    made = bpy.data.meshes.new(name)
    shape.to_mesh(made)
    shape.free()
    return made


def facets(count, slope_degrees, through, turn=0.0):
    """Returns planes around the z axis, tilted by `slope_degrees` from the horizontal (negative: facing down), through the
    point (radius, z) of their own direction. `turn`: of a step, 0 or 0.5."""
    radius, z = through
    slope = math.radians(abs(slope_degrees))
    planes = []
    for step in range(count):
        angle = 2 * math.pi * (step + turn) / count
        up = math.copysign(math.cos(slope), slope_degrees)
        normal = (math.sin(slope) * math.cos(angle), math.sin(slope) * math.sin(angle), up)
        planes.append((normal, math.sin(slope) * radius + up * z))
    return planes


def brilliant(radius):
    """Returns a round brilliant cut (Tolkowsky's angles: crown 34.5, pavilion 40.75 degrees), its girdle in z = 0."""
    crown = 0.162 * 2 * radius * 2 * 0.5
    planes = [((0, 0, 1), crown)]
    planes += facets(32, 90.0 - 1e-3, (radius, 0.0))
    planes += facets(8, 34.5, (radius, 0.02 * radius))
    planes += facets(16, 41.5, (radius * 0.995, 0.02 * radius), 0.5)
    planes += facets(8, 21.0, (0.60 * radius, crown - 0.005 * radius), 0.5)
    planes += facets(8, -40.75, (radius, -0.02 * radius))
    planes += facets(16, -42.3, (radius * 0.998, -0.02 * radius), 0.5)
    return cut("Brilliant", 2 * radius, planes)


def step_cut(radius):
    """Returns an octagonal step cut, longer than wide, its girdle in z = 0."""
    planes = [((0, 0, 1), 0.36 * radius)]
    for slope, at, z in ((90.0 - 1e-3, 1.0, 0.0), (48.0, 1.0, 0.03), (36.0, 0.86, 0.19), (-52.0, 1.0, -0.03), (-42.0, 0.72, -0.38), (-34.0, 0.4, -0.68)):
        for turn in (0.0, 0.5):
            corner = 1.0 if turn == 0.0 else 1.17
            planes += facets(4, slope, (radius * at * corner, radius * z), turn)
    made = cut("Step cut", 2 * radius, planes)
    made.transform(mathutils.Matrix.Diagonal((1.35, 1.0, 1.0, 1.0)))
    return made


def main():
    scene = blocks.begin()
    paper = blocks.diffuse("Paper", (0.78, 0.77, 0.75))
    sweep = [(-3.0, 0.0)] + [(1.5 + 0.9 * math.sin(a), 0.9 - 0.9 * math.cos(a)) for a in (math.radians(6 * k) for k in range(16))] + [(2.4, 3.0)]
    vertices = [(x, y, z) for y, z in sweep for x in (-5.0, 5.0)]
    faces = [(2 * k, 2 * k + 1, 2 * k + 3, 2 * k + 2) for k in range(len(sweep) - 1)]
    blocks.place(scene, blocks.mesh("Paper", vertices, faces, smooth=True), paper)

    diamond = blocks.glass("Diamond", 2.42)
    ruby = blocks.glass("Ruby", 1.77, (1.0, 0.28, 0.30))
    emerald = blocks.glass("Emerald", 1.58, (0.35, 0.95, 0.55))
    # The diamond lies on its pavilion: tilted by its angle, a little above the paper.
    def lay(mesh, kind, at, tilt, turn):
        stone = blocks.place(scene, mesh, kind)
        stone.rotation_mode = "XYZ"
        stone.rotation_euler = (math.radians(tilt), 0.0, math.radians(turn))
        bpy.context.view_layer.update()
        lowest = min((stone.matrix_world @ vertex.co).z for vertex in mesh.vertices)
        stone.location = (at[0], at[1], 0.001 - lowest)

    lay(brilliant(0.42), diamond, (0.02, -0.05), 40.75, 25.0)
    lay(step_cut(0.30), emerald, (-0.92, 0.42), 180.0, 28.0)
    lay(brilliant(0.30), ruby, (0.82, 0.38), 180.0, 10.0)

    blocks.light(scene, "POINT", "Lamp", 130.0, (-1.3, 1.2, 2.3), color=(1.0, 0.95, 0.88), shadow_soft_size=0.0)
    blocks.world(scene, (0.7, 0.8, 1.0), 0.07)
    blocks.camera(scene, (0.0, -2.9, 1.75), (0.0, 0.08, 0.16), 50.0)
    blocks.transport(scene, 24)
    blocks.finish(scene, 480, 360)


main()
