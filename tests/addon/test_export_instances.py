# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Instances, visibility, collections and view layers."""

import numpy as np


def transforms(run, value):
    if "transform" in value:
        return np.array(value["transform"]).reshape(1, 3, 4)
    return run.array(value["transforms"])


def test_an_object_arrives_with_its_matrix(run_blender):
    run = run_blender("ob = quad()\nob.location = (1, 2, 3)\nob.scale = (2, -1, 1)\nrender()\n")
    (matrix,) = transforms(run, run.values("object")["quad"])
    assert matrix.tolist() == [[2, 0, 0, 1], [0, -1, 0, 2], [0, 0, 1, 3]]


def test_vertex_instances_share_a_mesh_and_are_one_object(run_blender):
    run = run_blender(
        """
child = quad('child')
parent = add_mesh('parent', [(x, 0, 5) for x in range(1000)], [])
child.parent = parent
parent.instance_type = 'VERTS'
parent.show_instancer_for_render = False
render()
"""
    )
    objects = run.values("object")
    assert "parent" not in objects
    matrices = transforms(run, objects["parent/child"])
    assert matrices.shape == (1000, 3, 4)
    assert sorted(matrices[:, 0, 3].tolist()) == list(range(1000)) and (matrices[:, 2, 3] == 5).all()
    assert list(run.values("mesh")) == ["mesh:child"]


def test_collection_instances_combine_visibility_of_instancer_and_instance(run_blender):
    run = run_blender(
        """
hidden = bpy.data.collections.new('library')
a, b = quad('a', hidden), quad('b', hidden)
b.visible_shadow = False
light = add('lamp', bpy.data.lights.new('lamp', 'POINT'), hidden)
for x in (3, 7):
    empty = add(f'empty{x}', None)
    empty.location.x = x
    empty.instance_type, empty.instance_collection = 'COLLECTION', hidden
bpy.data.objects['empty7'].visible_camera = False
render()
"""
    )
    objects = run.values("object")
    assert set(objects) == {f"empty{x}/{name}" for x in (3, 7) for name in ("a", "b", "lamp")}
    assert transforms(run, objects["empty7/a"])[0, 0, 3] == 7
    assert objects["empty3/a"]["visibility"]["camera"] and not objects["empty7/a"]["visibility"]["camera"]
    assert objects["empty3/a"]["visibility"]["shadow"] and not objects["empty3/b"]["visibility"]["shadow"]
    assert objects["empty3/lamp"]["light"] == objects["empty7/lamp"]["light"] == "lamp"


def test_geometry_nodes_instances_arrive_as_instances(run_blender):
    run = run_blender(
        """
group = bpy.data.node_groups.new('g', 'GeometryNodeTree')
if hasattr(group, 'interface'):
    group.interface.new_socket('Geometry', in_out='INPUT', socket_type='NodeSocketGeometry')
    group.interface.new_socket('Geometry', in_out='OUTPUT', socket_type='NodeSocketGeometry')
else:
    group.inputs.new('NodeSocketGeometry', 'Geometry'); group.outputs.new('NodeSocketGeometry', 'Geometry')
cube, on_points = group.nodes.new('GeometryNodeMeshCube'), group.nodes.new('GeometryNodeInstanceOnPoints')
start, end = group.nodes.new('NodeGroupInput'), group.nodes.new('NodeGroupOutput')
group.links.new(start.outputs[0], on_points.inputs['Points'])
group.links.new(cube.outputs[0], on_points.inputs['Instance'])
group.links.new(on_points.outputs[0], end.inputs[0])
ob = quad('ground')
ob.location.z = 4
ob.modifiers.new('g', 'NODES').node_group = group
render()
"""
    )
    cubes = [value for value in run.values("object").values() if len(transforms(run, value)) == 4]
    assert len(cubes) == 1
    assert sorted(transforms(run, cubes[0])[:, :2, 3].tolist()) == [[0, 0], [0, 1], [1, 0], [1, 1]]
    assert (transforms(run, cubes[0])[:, 2, 3] == 4).all()
    mesh = run.values("mesh")[cubes[0]["mesh"]]
    assert len(run.array(mesh["triangles"])) == 12


def test_random_ids_travel_when_a_material_reads_them(run_blender):
    script = """
child = quad('child')
parent = add_mesh('parent', [(0, 0, 0), (1, 0, 0), (2, 0, 0)], [])
child.parent = parent
parent.instance_type = 'VERTS'
material, nodes, links = node_material('m')
child.data.materials.append(material)
{extra}
render()
"""
    without = run_blender(script.format(extra=""))
    assert "random_ids" not in without.values("object")["parent/child"]
    run = run_blender(script.format(extra="nodes.new('ShaderNodeObjectInfo')"))
    ids = run.array(run.values("object")["parent/child"]["random_ids"])
    assert ids.dtype == np.uint32 and len(set(ids.tolist())) == 3


def test_what_particles_are_travels_when_a_material_asks_for_it(run_blender):
    script = """
child = quad('child')
parent = add_mesh('parent', [(0, 0, 0), (1, 0, 0), (2, 0, 0)], [])
settings = parent.modifiers.new('p', 'PARTICLE_SYSTEM').particle_system.settings
settings.count, settings.emit_from, settings.use_emit_random = 3, 'VERT', False
settings.frame_start, settings.frame_end, settings.lifetime = -4, -1, 30
settings.render_type, settings.instance_object, settings.particle_size = 'OBJECT', child, 0.5
material, nodes, links = node_material('m')
child.data.materials.append(material)
scene.frame_set(1)
{extra}
render()
"""
    without = run_blender(script.format(extra=""))
    assert not any("particles" in value for value in without.values("object").values())
    run = run_blender(script.format(extra="nodes.new('ShaderNodeParticleInfo')"))
    objects = run.values("object")
    assert "particles" not in objects["child"]
    rows = run.array(objects["parent/child"]["particles"])
    assert rows.shape == (3, 13) and rows.dtype == np.float32
    assert sorted(rows[:, 0].tolist()) == [0, 1, 2]
    assert (rows[:, 1] > 0).all() and (rows[:, 1] <= 5).all()  # frames since frame -4
    assert (rows[:, 2] == 30).all() and np.allclose(rows[:, 3], 0.5)
    assert np.allclose(rows[:, 4:7], transforms(run, objects["parent/child"])[:, :, 3], atol=1e-4)


def test_hidden_excluded_and_indirect_only_are_respected(run_blender):
    run = run_blender(
        """
quad('seen')
quad('hidden').hide_render = True
for name in ('excluded', 'indirect', 'holdout'):
    collection = bpy.data.collections.new(name)
    scene.collection.children.link(collection)
    quad(name, collection)
    layer = bpy.context.view_layer.layer_collection.children[name]
    if name == 'excluded': layer.exclude = True
    if name == 'indirect': layer.indirect_only = True
    if name == 'holdout': layer.holdout = True
render()
"""
    )
    objects = run.values("object")
    assert set(objects) == {"seen", "indirect", "holdout"}
    assert objects["seen"]["visibility"]["camera"] and not objects["indirect"]["visibility"]["camera"]
    assert objects["indirect"]["visibility"]["diffuse"]
    assert objects["holdout"]["holdout"]


def test_every_view_layer_is_rendered_and_data_travels_once(run_blender):
    run = run_blender(
        """
bpy.context.view_layer.name = 'first'
left, right = (bpy.data.collections.new(name) for name in ('left', 'right'))
for collection in (left, right):
    scene.collection.children.link(collection)
quad('left', left); quad('right', right)
second = scene.view_layers.new('second')
scene.view_layers['first'].layer_collection.children['right'].exclude = True
second.layer_collection.children['left'].exclude = True
third = scene.view_layers.new('unused'); third.use = False
scene.render.image_settings.file_format = 'PNG'
scene.frame_start, scene.frame_end = 1, 2
scene.render.filepath = '/dev/null/'
import os
scene.render.filepath = os.path.join(os.environ['LAMBENT_TEST_DIR'], 'f')
render(animation=True)
"""
    )
    assert run.code == 0
    assert len(run.of_type("render_start")) == 4
    assert set(run.values("object", 1)) == {"left"} and set(run.values("object", 2)) == {"right"}
    assert run.values("settings", 2)["render"]["metadata"]["ViewLayer"] == "second"
    upserted = [edit["id"] for edits in run.transactions for edit in edits if edit["op"] == "upsert" and edit["kind"] == "mesh"]
    assert sorted(upserted) == ["mesh:left", "mesh:right"]


def test_material_override_and_switched_off_world_and_surfaces(run_blender):
    run = run_blender(
        """
quad().data.materials.append(bpy.data.materials.new('own'))
bpy.context.view_layer.material_override = bpy.data.materials.new('override')
bpy.context.view_layer.use_sky = False
render()
bpy.context.view_layer.use_solid = False
render()
"""
    )
    assert run.values("object", 1)["quad"]["materials"] == ["override"]
    assert run.values("settings", 1)["render"]["world"] is None
    assert run.values("object") == {}


def test_what_is_not_supported_is_listed_by_name(run_blender):
    run = run_blender(
        """
add('smoke', bpy.data.volumes.new('smoke'))
scene.render.use_motion_blur = True
scene.camera.data.type = 'PANO'
bpy.context.view_layer.use_pass_normal = True
render()
from lambent.render import report
for message in report.listed(scene.name): print('LISTED', message['object'], message['code'])
""",
        mode="few_passes",
    )
    listed = {line.split()[1] for line in run.output.splitlines() if line.startswith("LISTED")}
    assert {"smoke", "Scene", "camera", "ViewLayer"} <= listed
    assert run.values("camera")["camera"]["type"] == "perspective"
    assert "smoke" not in run.values("object")
    for marker in ("Warning:", "Error:", "Exception:"):
        assert marker not in run.output, "strict farms fail a job on this"


def test_nothing_leaks_when_the_first_object_is_an_instancer(run_blender):
    run = run_blender(
        """
bpy.data.objects.remove(scene.camera)
hidden = bpy.data.collections.new('library')
quad('a', hidden); quad('b', hidden).location.x = 4
for i in range(3):
    empty = add(f'empty{i}', None)
    empty.location.y = i
    empty.instance_type, empty.instance_collection = 'COLLECTION', hidden
scene.camera = add('zcamera', bpy.data.cameras.new('zcamera'))
render()
"""
    )
    objects = run.values("object")
    assert [transforms(run, objects[f"empty{i}/b"])[0, :, 3].tolist() for i in range(3)] == [[4, i, 0] for i in range(3)]
    assert "Not freed" not in run.output and "Error" not in run.output


def test_collections_of_light_linking_arrive_as_sets(run_blender):
    run = run_blender(
        """
if bpy.app.version < (4, 0, 0):
    quad('a')
    render()
    raise SystemExit
a, b, c, d = (quad(name) for name in 'abcd')
lamps = [add(name, bpy.data.lights.new(name, 'POINT')) for name in ('some', 'but', 'nested', 'all', 'none')]
some, but, nested, everything, nothing = (lamp.light_linking for lamp in lamps)
def collection(name, *objects):
    made = bpy.data.collections.new(name)
    for thing in objects:
        made.objects.link(thing)
    return made
some.receiver_collection = some.blocker_collection = collection('S', a, b)
some.receiver_collection.collection_objects[1].light_linking.link_state = 'EXCLUDE'
but.blocker_collection = collection('B', c)
but.blocker_collection.collection_objects[0].light_linking.link_state = 'EXCLUDE'
# The state of the outermost child counts, and what is mentioned later.
outer = collection('N', d)
outer.children.link(collection('N1', c, d))
outer.children[0].children.link(collection('N2', b))
outer.collection_children[0].light_linking.link_state = 'EXCLUDE'
nested.receiver_collection = outer
everything.receiver_collection = collection('E')
a.light_linking.receiver_collection = bpy.data.collections['S']
render()
"""
    )
    objects = run.values("object")
    if "b" not in objects:
        assert "light_linking" not in objects["a"]
        return
    linking = {name: value.get("light_linking") for name, value in objects.items()}
    assert linking["some"] == {"receivers": "S", "blockers": "S"}
    assert linking["but"] == {"blockers": "B"} and linking["nested"] == {"receivers": "N"}
    assert linking["all"] is None and linking["none"] is None
    assert linking["a"] == {"receivers": "S", "receives": ["S"], "blocks": ["S", "B"]}
    assert linking["b"] == {"receives": [], "blocks": ["B"]}
    assert linking["c"] == {"receives": [], "blocks": []}
    assert linking["d"] == {"receives": ["N"], "blocks": ["B"]}
