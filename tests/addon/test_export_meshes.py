# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What meshes of known numbers become on the wire."""

import numpy as np


def test_a_quad_arrives_with_its_numbers(run_blender):
    run = run_blender("quad()\nrender()\n")
    (mesh,) = run.values("mesh").values()
    assert run.array(mesh["positions"]).tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    triangles = run.array(mesh["triangles"])
    assert triangles.dtype == np.uint32 and triangles.shape == (2, 3)
    assert sorted(set(triangles.reshape(-1).tolist())) == [0, 1, 2, 3]
    # Both triangles look the way the quad does, and corners belong to their vertices (corner i is vertex i here).
    positions = run.array(mesh["positions"])
    for a, b, c in positions[triangles]:
        assert np.cross(b - a, c - a)[2] > 0
    assert (run.array(mesh["triangle_corners"]) == triangles).all()
    assert run.array(mesh["triangle_faces"]).tolist() == [0, 0]
    assert "normals" not in mesh and "triangle_materials" not in mesh


def test_triangles_need_no_index_arrays(run_blender):
    run = run_blender("add_mesh('t', [(0,0,0),(1,0,0),(0,1,0),(1,1,1)], [(0,1,2),(1,3,2)])\nrender()\n")
    (mesh,) = run.values("mesh").values()
    assert "triangle_corners" not in mesh and "triangle_faces" not in mesh
    assert run.array(mesh["triangles"]).tolist() == [[0, 1, 2], [1, 3, 2]]


def test_uv_sets_and_colours_arrive_by_domain(run_blender):
    run = run_blender(
        """
mesh = quad().data
for name, scale in (('first', 1.0), ('second', 2.0)):
    layer = mesh.uv_layers.new(name=name)
    for corner in range(4):
        layer.data[corner].uv = (scale * corner, -corner)
mesh.uv_layers['second'].active_render = True
points = mesh.color_attributes.new('points', 'FLOAT_COLOR', 'POINT')
for i in range(4): points.data[i].color = (i, 0.5, 0.25, 1)
corners = mesh.color_attributes.new('corners', 'BYTE_COLOR', 'CORNER')
for i in range(4): corners.data[i].color = (1, 0, 0, 1)
mesh.color_attributes.render_color_index = 1
extra = mesh.attributes.new('extra', 'FLOAT', 'FACE')
extra.data[0].value = 7
unread = mesh.attributes.new('unread', 'FLOAT', 'FACE')
material, nodes, links = node_material('m')
node = nodes.new('ShaderNodeAttribute'); node.attribute_name = 'extra'
mesh.materials.append(material)
render()
"""
    )
    (mesh,) = run.values("mesh").values()
    found = {attribute["name"]: attribute for attribute in mesh["attributes"]}
    assert set(found) == {"first", "second", "points", "corners", "extra"}
    assert run.array(found["second"]["values"]).tolist() == [[0, 0], [2, -1], [4, -2], [6, -3]]
    assert (found["second"]["domain"], found["second"]["role"]) == ("corner", "uv")
    assert mesh["active_uv"] == "second"
    assert (found["points"]["domain"], found["points"]["role"]) == ("vertex", "color")
    assert run.array(found["points"]["values"]).tolist() == [[i, 0.5, 0.25, 1] for i in range(4)]
    assert run.array(found["corners"]["values"]).shape == (4, 4)
    assert mesh["active_color"] == "corners"
    assert (found["extra"]["domain"], found["extra"]["role"]) == ("face", "generic")
    assert run.array(found["extra"]["values"]).tolist() == [[7]]


def test_smooth_cylinder_has_vertex_normals_and_a_mixed_one_corner_normals(run_blender):
    run = run_blender(
        """
import math
ring = [(math.cos(a * math.pi / 8), math.sin(a * math.pi / 8), z) for z in (-1, 1) for a in range(16)]
sides = [(i, (i + 1) % 16, 16 + (i + 1) % 16, 16 + i) for i in range(16)]
caps = [tuple(range(15, -1, -1)), tuple(range(16, 32))]
all_smooth = add_mesh('open', ring, sides)
for face in all_smooth.data.polygons: face.use_smooth = True
mixed = add_mesh('mixed', ring, sides + caps)
for face in mixed.data.polygons[:16]: face.use_smooth = True
for face in mixed.data.polygons[16:]: face.use_smooth = False
render()
"""
    )
    meshes = {value["name"]: value for value in run.values("mesh").values()}
    smooth = meshes["open"]["normals"]
    assert smooth["domain"] == "vertex"
    normals, positions = run.array(smooth["values"]), run.array(meshes["open"]["positions"])
    assert np.allclose(normals[:, :2], positions[:, :2], atol=1e-3) and np.allclose(normals[:, 2], 0, atol=1e-6)
    mixed = meshes["mixed"]["normals"]
    assert mixed["domain"] == "corner"
    values = run.array(mixed["values"])
    assert values.shape == (16 * 4 + 32, 3)
    # Flat caps are zero (before 4.1, when Cycles shades their triangles one by one) or keep the normal of their face.
    if values[64:].any():
        assert np.allclose(values[64:80], [0, 0, -1], atol=1e-5) and np.allclose(values[80:], [0, 0, 1], atol=1e-5)
    assert np.allclose(np.linalg.norm(values[:64], axis=1), 1, atol=1e-4)
    assert (np.abs(values[:64, 2]) < 0.9).all()


def test_material_slots_travel_by_triangle_and_objects_may_override_them(run_blender):
    run = run_blender(
        """
ob = add_mesh('t', [(0,0,0),(1,0,0),(0,1,0),(1,1,1)], [(0,1,2),(1,3,2)])
red, green, blue = (bpy.data.materials.new(name) for name in ('red', 'green', 'blue'))
ob.data.materials.append(red); ob.data.materials.append(green)
ob.data.polygons[1].material_index = 1
other = add('other', ob.data)
other.material_slots[1].link = 'OBJECT'
other.material_slots[1].material = blue
bare = quad('bare')
render()
"""
    )
    objects = run.values("object")
    assert objects["t"]["materials"] == ["red", "green"]
    assert objects["other"]["materials"] == ["red", "blue"]
    assert objects["t"]["mesh"] == objects["other"]["mesh"]
    assert run.array(run.values("mesh")[objects["t"]["mesh"]]["triangle_materials"]).tolist() == [0, 1]
    (default,) = objects["bare"]["materials"]
    (node,) = run.values("material")[default]["graph"]["nodes"]
    assert node["type"] == "BsdfDiffuse" and np.allclose(node["inputs"]["Color"], 0.8)


def test_curves_text_surfaces_and_metaballs_become_one_mesh_each(run_blender):
    run = run_blender(
        """
bpy.ops.curve.primitive_bezier_circle_add(); bpy.context.object.name = 'Circle'; bpy.context.object.data.bevel_depth = 0.1
bpy.ops.curve.primitive_bezier_curve_add()
bpy.ops.object.text_add()
bpy.ops.surface.primitive_nurbs_surface_sphere_add()
bpy.ops.object.metaball_add(); bpy.context.object.name = 'Ball'
render()
"""
    )
    objects = run.values("object")
    assert sorted(objects) == ["Ball", "Circle", "SurfSphere", "Text"]
    assert len(run.values("mesh")) == 4
    for value in run.values("mesh").values():
        assert len(run.array(value["triangles"])) > 10


def test_modifiers_are_applied_and_do_not_touch_other_users(run_blender):
    run = run_blender(
        """
plain = quad()
plain.data.materials.append(None)
divided = add('divided', plain.data)
divided.modifiers.new('s', 'SUBSURF').render_levels = 2
divided.modifiers['s'].subdivision_type = 'SIMPLE'
render()
"""
    )
    objects, meshes = run.values("object"), run.values("mesh")
    assert len(run.array(meshes[objects["quad"]["mesh"]]["triangles"])) == 2
    assert len(run.array(meshes[objects["divided"]["mesh"]]["triangles"])) == 32


def test_meshes_without_faces_that_make_instances_or_particles_stay_at_home(run_blender):
    run = run_blender(
        """
add_mesh('points', [(0,0,0),(1,1,1)], [])
add_mesh('instancer', [(0,0,0),(1,1,1)], []).instance_type = 'VERTS'
add_mesh('emitter', [(0,0,0),(1,1,1)], []).modifiers.new('particles', 'PARTICLE_SYSTEM')
add_mesh('nodes', [(0,0,0),(1,1,1)], []).modifiers.new('nodes', 'NODES')
print(render())
"""
    )
    assert "{'FINISHED'}" in run.output and run.code == 0
    assert {value["name"] for value in run.values("object").values()} == {"points"}


def test_meshes_without_faces_and_with_nan_vertices_pass_through(run_blender):
    run = run_blender(
        """
add_mesh('points', [(0,0,0),(1,1,1)], [])
add_mesh('broken', [(float('nan'),0,0),(1,float('inf'),0),(0,1,0)], [(0,1,2)])
print(render())
"""
    )
    assert "{'FINISHED'}" in run.output and run.code == 0
    meshes = {value["name"]: value for value in run.values("mesh").values()}
    assert run.array(meshes["points"]["triangles"]).shape == (0, 3)
    assert not np.isfinite(run.array(meshes["broken"]["positions"])).all()


def test_pointiness_and_islands_travel_where_a_material_reads_them(run_blender):
    script = """
corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
two = add_mesh('two', corners + [(x + 3, y, z) for x, y, z in corners], faces + [tuple(i + 8 for i in face) for face in faces]).data
material, nodes, links = node_material('m')
two.materials.append(material)
node = nodes.new('ShaderNodeNewGeometry')
"""
    run = run_blender(script + "render()\n")
    (mesh,) = run.values("mesh").values()
    assert mesh["attributes"] == []
    linked = """
for name in ('Pointiness', 'Random Per Island'):
    links.new(node.outputs[name], nodes.new('ShaderNodeMath').inputs[0])
render()
"""
    run = run_blender(script + linked)
    (mesh,) = run.values("mesh").values()
    found = {attribute["name"]: (attribute["domain"], run.array(attribute["values"])) for attribute in mesh["attributes"]}
    assert {name: domain for name, (domain, _) in found.items()} == {".pointiness": "vertex", ".random_per_island": "face"}
    # All corners of cubes; see test_mesh_shape.py.
    assert np.ptp(found[".pointiness"][1]) < 1e-5 and found[".pointiness"][1][0] > 0.6
    islands = found[".random_per_island"][1].ravel()
    assert len(set(islands[:6])) == len(set(islands[6:])) == 1 and islands[0] != islands[6]
