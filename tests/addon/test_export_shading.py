# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Node graphs, images, lights, worlds and cameras."""

import math

import numpy as np
import pytest

GROUPED = """
inner = bpy.data.node_groups.new('inner', 'ShaderNodeTree')
outer = bpy.data.node_groups.new('outer', 'ShaderNodeTree')
def socket(tree, kind, name, direction, default=None):
    if hasattr(tree, 'interface'):
        made = tree.interface.new_socket(name, in_out=direction, socket_type=kind)
    else:
        made = (tree.inputs if direction == 'INPUT' else tree.outputs).new(kind, name)
    if default is not None: made.default_value = default
socket(inner, 'NodeSocketColor', 'Tint', 'INPUT', (0.1, 0.2, 0.3, 1))
socket(inner, 'NodeSocketFloat', 'Gloss', 'INPUT', 0.25)
socket(inner, 'NodeSocketShader', 'Shader', 'OUTPUT')
socket(outer, 'NodeSocketFloat', 'Gloss', 'INPUT', 0.5)
socket(outer, 'NodeSocketShader', 'Shader', 'OUTPUT')
start, end = inner.nodes.new('NodeGroupInput'), inner.nodes.new('NodeGroupOutput')
principled = inner.nodes.new('ShaderNodeBsdfPrincipled')
inner.links.new(start.outputs['Tint'], principled.inputs['Base Color'])
inner.links.new(start.outputs['Gloss'], principled.inputs['Roughness'])
inner.links.new(principled.outputs[0], end.inputs[0])
start, end = outer.nodes.new('NodeGroupInput'), outer.nodes.new('NodeGroupOutput')
use = outer.nodes.new('ShaderNodeGroup'); use.node_tree = inner
reroute = outer.nodes.new('NodeReroute')
outer.links.new(start.outputs['Gloss'], reroute.inputs[0])
outer.links.new(reroute.outputs[0], use.inputs['Gloss'])
outer.links.new(use.outputs[0], end.inputs[0])
material, nodes, links = node_material('m')
quad().data.materials.append(material)
output, mix = nodes.new('ShaderNodeOutputMaterial'), nodes.new('ShaderNodeMixShader')
a, b = nodes.new('ShaderNodeGroup'), nodes.new('ShaderNodeGroup')
a.node_tree = b.node_tree = outer
a.inputs['Gloss'].default_value = 0.75
value = nodes.new('ShaderNodeRGB'); value.outputs[0].default_value = (1, 0, 0, 1)
links.new(value.outputs[0], b.inputs['Gloss'])
links.new(a.outputs[0], mix.inputs[1]); links.new(b.outputs[0], mix.inputs[2])
links.new(mix.outputs[0], output.inputs['Surface'])
render()
"""


def graph_of(run, name="m"):
    return run.values("material")[name]["graph"]


def surface_node(graph):
    index, socket = graph["outputs"]["surface"]
    return graph["nodes"][index]


def linked(graph, node, socket):
    """(node, output socket) that an input is linked to."""
    index, output = node["inputs"][socket]["link"]
    return graph["nodes"][index], output


def simple(script):
    """A material 'm' on a quad with nodes made by script, which has output, nodes, links; then a render."""
    return f"""
material, nodes, links = node_material('m')
quad().data.materials.append(material)
output = nodes.new('ShaderNodeOutputMaterial')
{script}
render()
"""


def test_nested_groups_are_flattened_with_each_use_its_own_values(run_blender):
    graph = graph_of(run_blender(GROUPED))
    assert sorted(node["type"] for node in graph["nodes"]) == ["BsdfPrincipled", "BsdfPrincipled", "MixShader"]
    mix = surface_node(graph)
    first, second = (linked(graph, mix, socket)[0] for socket in ("Shader", "Shader_001"))
    assert first["inputs"]["Roughness"] == 0.75
    # A colour that enters a number's socket is its luminance.
    assert second["inputs"]["Roughness"] == pytest.approx(0.2126729)
    assert np.allclose(first["inputs"]["Base Color"][:3], [0.1, 0.2, 0.3])


def test_muted_nodes_pass_through_and_muted_links_do_not_count(run_blender):
    graph = graph_of(
        run_blender(
            simple(
                """
diffuse = nodes.new('ShaderNodeBsdfDiffuse')
gamma, noise = nodes.new('ShaderNodeGamma'), nodes.new('ShaderNodeTexNoise')
gamma.mute = True
links.new(noise.outputs['Color'], gamma.inputs['Color'])
links.new(gamma.outputs[0], diffuse.inputs['Color'])
links.new(noise.outputs[0], diffuse.inputs['Roughness']).is_muted = True
links.new(diffuse.outputs[0], output.inputs['Surface'])
"""
            )
        )
    )
    diffuse = surface_node(graph)
    noise, socket = linked(graph, diffuse, "Color")
    assert (noise["type"], socket) == ("TexNoise", "Color")
    assert diffuse["inputs"]["Roughness"] == 0.0
    # What defaults to something of the surface is not sent.
    assert "Normal" not in diffuse["inputs"] and "Vector" not in noise["inputs"]
    assert noise["properties"]["noise_dimensions"] == "3D" and "W" not in noise["inputs"]


def test_cycles_of_muted_nodes_and_of_groups_end(run_blender):
    run = run_blender(
        simple(
            """
diffuse = nodes.new('ShaderNodeBsdfDiffuse')
first, second = nodes.new('ShaderNodeGamma'), nodes.new('ShaderNodeGamma')
first.mute = second.mute = True
links.new(first.outputs[0], second.inputs['Color'])
links.new(second.outputs[0], first.inputs['Color'])
links.new(second.outputs[0], diffuse.inputs['Color'])
tree = bpy.data.node_groups.new('through', 'ShaderNodeTree')
if hasattr(tree, 'interface'):
    for way in ('INPUT', 'OUTPUT'): tree.interface.new_socket('Value', in_out=way, socket_type='NodeSocketFloat')
else:
    tree.inputs.new('NodeSocketFloat', 'Value'), tree.outputs.new('NodeSocketFloat', 'Value')
tree.links.new(tree.nodes.new('NodeGroupInput').outputs[0], tree.nodes.new('NodeGroupOutput').inputs[0])
group = nodes.new('ShaderNodeGroup')
group.node_tree = tree
links.new(group.outputs[0], group.inputs[0])
links.new(group.outputs[0], diffuse.inputs['Roughness'])
links.new(diffuse.outputs[0], output.inputs['Surface'])
"""
        )
    )
    assert "could not be exported" not in run.output
    assert surface_node(graph_of(run))["type"] == "BsdfDiffuse"


def test_long_chains_of_nodes_travel_whole(run_blender):
    graph = graph_of(
        run_blender(
            simple(
                """
diffuse = nodes.new('ShaderNodeBsdfDiffuse')
end = nodes.new('ShaderNodeTexNoise').outputs['Color']
for _ in range(800):
    link = nodes.new('ShaderNodeGamma')
    links.new(end, link.inputs['Color'])
    end = link.outputs[0]
links.new(end, diffuse.inputs['Color'])
links.new(diffuse.outputs[0], output.inputs['Surface'])
"""
            )
        )
    )
    assert len(graph["nodes"]) == 802


def test_settings_ramps_and_curves_of_nodes(run_blender):
    run = run_blender(
        simple(
            """
glossy = nodes.new('ShaderNodeBsdfGlass'); glossy.distribution = 'BECKMANN'
ramp, eased = nodes.new('ShaderNodeValToRGB'), nodes.new('ShaderNodeValToRGB')
ramp.color_ramp.elements[1].position = 0.75
ramp.color_ramp.elements[1].color = (1, 0.5, 0, 1)
ramp.color_ramp.interpolation = 'CONSTANT'
eased.color_ramp.interpolation = 'EASE'
curves = nodes.new('ShaderNodeRGBCurve')
curves.mapping.curves[3].points[1].location = (1, 0.5)
links.new(ramp.outputs[0], curves.inputs['Color'])
links.new(curves.outputs[0], glossy.inputs['Color'])
links.new(eased.outputs[0], glossy.inputs['Roughness'])
links.new(glossy.outputs[0], output.inputs['Surface'])
"""
        )
    )
    rows = 257 if run.blender_major >= 4 else 256  # as many as that Blender's Cycles has
    graph = graph_of(run)
    glass = surface_node(graph)
    assert glass["properties"]["distribution"] == "BECKMANN"
    curves, _ = linked(graph, glass, "Color")
    sampled = np.array(curves["properties"]["curves"])
    assert sampled.shape == (3, rows, 2)
    # The combined curve halves everything, before the three straight ones.
    assert np.allclose(sampled[:, -1], [1.0, 0.5]) and np.allclose(sampled[:, 128, 1], 0.25, atol=1e-3)
    ramp, _ = linked(graph, curves, "Color")
    assert ramp["properties"]["ramp_interpolation"] == "CONSTANT"
    assert ramp["properties"]["ramp"] == [[0, 0, 0, 0, 1], [0.75, 1, 0.5, 0, 1]]
    eased, _ = linked(graph, glass, "Roughness")
    assert eased["properties"]["ramp_interpolation"] == "LINEAR" and len(eased["properties"]["ramp"]) == rows


def test_principled_names_its_generation_and_sockets(run_blender):
    run = run_blender(simple("links.new(nodes.new('ShaderNodeBsdfPrincipled').outputs[0], output.inputs['Surface'])"))
    node = surface_node(graph_of(run))
    if run.blender_major < 4:
        assert node["properties"]["generation"] == 1 and "Subsurface" in node["inputs"] and "Clearcoat" in node["inputs"]
    else:
        assert node["properties"]["generation"] == 2 and "Subsurface Weight" in node["inputs"] and "Coat Weight" in node["inputs"]
    assert not {"Normal", "Tangent", "Weight"} & set(node["inputs"])


def test_colour_on_a_shader_socket_is_emission(run_blender):
    graph = graph_of(run_blender(simple("links.new(nodes.new('ShaderNodeTexNoise').outputs['Color'], output.inputs['Surface'])")))
    emission = surface_node(graph)
    assert emission["type"] == "Emission" and linked(graph, emission, "Color")[0]["type"] == "TexNoise"


def test_object_coordinates_of_another_object_undo_its_transform(run_blender):
    graph = graph_of(
        run_blender(
            simple(
                """
target = add('target', None)
target.location, target.rotation_euler, target.scale = (1, 2, 3), (0, 0, 0.5), (2, 2, 2)
bpy.context.view_layer.update()
coordinates, noise = nodes.new('ShaderNodeTexCoord'), nodes.new('ShaderNodeTexNoise')
coordinates.object = target
links.new(coordinates.outputs['Object'], noise.inputs['Vector'])
diffuse = nodes.new('ShaderNodeBsdfDiffuse')
links.new(noise.outputs['Color'], diffuse.inputs['Color'])
links.new(diffuse.outputs[0], output.inputs['Surface'])
"""
            )
        )
    )
    noise, _ = linked(graph, surface_node(graph), "Color")
    mapping, _ = linked(graph, noise, "Vector")
    assert mapping["properties"]["vector_type"] == "TEXTURE"
    assert np.allclose(mapping["inputs"]["Location"], [1, 2, 3]) and np.allclose(mapping["inputs"]["Rotation"], [0, 0, 0.5])
    assert linked(graph, mapping, "Vector")[1] == "Position"


def test_volume_only_material_becomes_transparent_and_is_listed(run_blender):
    run = run_blender(simple("links.new(nodes.new('ShaderNodeVolumeScatter').outputs[0], output.inputs['Volume'])"))
    graph = graph_of(run)
    assert surface_node(graph)["type"] == "BsdfTransparent" and "volume" not in graph["outputs"]
    assert "m: its volume is not supported" in run.output


def test_materials_tell_whether_shadow_rays_go_through_what_is_transparent(run_blender):
    run = run_blender(
        """
for name, through in (('clear', True), ('veil', False)):
    material, nodes, links = node_material(name)
    output = nodes.new('ShaderNodeOutputMaterial')
    links.new(nodes.new('ShaderNodeBsdfTransparent').outputs[0], output.inputs['Surface'])
    (material if hasattr(material, 'use_transparent_shadow') else material.cycles).use_transparent_shadow = through
    quad(name).data.materials.append(material)
render()
"""
    )
    materials = run.values("material")
    assert "transparent_shadow" not in materials["clear"]["graph"]
    assert materials["veil"]["graph"]["transparent_shadow"] is False


def test_displacement_methods_travel_and_adaptive_subdivision_is_listed(run_blender):
    run = run_blender(
        """
for method in ('BUMP', 'DISPLACEMENT', 'BOTH'):
    material, nodes, links = node_material(method)
    output, node = nodes.new('ShaderNodeOutputMaterial'), nodes.new('ShaderNodeDisplacement')
    links.new(nodes.new('ShaderNodeBsdfDiffuse').outputs[0], output.inputs['Surface'])
    links.new(node.outputs[0], output.inputs['Displacement'])
    (material if hasattr(material, 'displacement_method') else material.cycles).displacement_method = method
    found = quad(method)
    found.data.materials.append(material)
modifier = found.modifiers.new('subdivided', 'SUBSURF')
(modifier if hasattr(modifier, 'use_adaptive_subdivision') else found.cycles).use_adaptive_subdivision = True
render()
"""
    )
    materials = run.values("material")
    assert [materials[name]["graph"].get("displacement_method", "BUMP") for name in ("BUMP", "DISPLACEMENT", "BOTH")] == [
        "BUMP",
        "DISPLACEMENT",
        "BOTH",
    ]
    assert "BOTH: adaptive subdivision is not supported" in run.output


def test_images_by_path_by_bytes_and_by_pixels(run_blender, tmp_path):
    run = run_blender(
        simple(
            f"""
import numpy as np
images = {{}}
def texture(image):
    node = nodes.new('ShaderNodeTexImage'); node.image = image; node.interpolation = 'Closest'
    links.new(node.outputs['Color'], add_node.inputs[0] if not add_node.inputs[0].is_linked else add_node.inputs[1])
def colour_sum():
    node = nodes.new('ShaderNodeVectorMath'); return node
made = bpy.data.images.new('made', 4, 2, float_buffer=True)
made.pixels.foreach_set(np.arange(32, dtype=np.float32))
disk = bpy.data.images.new('disk', 4, 2); disk.filepath_raw = {str(tmp_path / 'disk.png')!r}; disk.file_format = 'PNG'; disk.save()
disk.source = 'FILE'
disk.colorspace_settings.name = 'Non-Color'
packed = bpy.data.images.new('packed', 4, 2); packed.file_format = 'PNG'; packed.filepath_raw = {str(tmp_path / 'packed.png')!r}; packed.save()
packed = bpy.data.images.load({str(tmp_path / 'packed.png')!r}); packed.name = 'packed'; packed.pack()
missing = bpy.data.images.load({str(tmp_path / 'disk.png')!r}); missing.name = 'missing'; missing.filepath = {str(tmp_path / 'gone.png')!r}
diffuse = nodes.new('ShaderNodeBsdfDiffuse')
previous = None
for image in (made, disk, packed, missing):
    node = nodes.new('ShaderNodeTexImage'); node.image = image; node.interpolation = 'Closest'
    adding = nodes.new('ShaderNodeVectorMath')
    links.new(node.outputs['Color'], adding.inputs[0])
    if previous: links.new(previous.outputs[0], adding.inputs[1])
    previous = adding
links.new(previous.outputs[0], diffuse.inputs['Color'])
links.new(diffuse.outputs[0], output.inputs['Surface'])
"""
        )
    )
    images = run.values("image")
    assert images["disk"]["path"] == str(tmp_path / "disk.png") and images["disk"]["colorspace"] == "Non-Color"
    assert images["missing"]["path"] == str(tmp_path / "gone.png")
    made = run.array(images["made"]["pixels"])
    assert made.shape == (2, 4, 4) and made.reshape(-1).tolist() == list(range(32)) and "colorspace" not in images["made"]
    packed = images["packed" if "packed" in images else "packed.001"]
    assert packed["extension"] == ".png" and run.array(packed["encoded"]).tobytes().startswith(b"\x89PNG")
    used = {node["properties"].get("image") for node in graph_of(run)["nodes"] if node["type"] == "TexImage"}
    assert used == set(images)


def test_lights_arrive_in_blenders_units(run_blender):
    run = run_blender(
        """
point = bpy.data.lights.new('point', 'POINT'); point.energy = 100; point.shadow_soft_size = 0.25; point.color = (1, 0.5, 0.25)
spot = bpy.data.lights.new('spot', 'SPOT'); spot.spot_size = 1.0; spot.spot_blend = 0.5; spot.energy = 1e30
sun = bpy.data.lights.new('sun', 'SUN'); sun.angle = 0.1; sun.energy = 3
area = bpy.data.lights.new('area', 'AREA'); area.shape = 'ELLIPSE'; area.size, area.size_y = 2, 3; area.spread = 1.5
square = bpy.data.lights.new('square', 'AREA'); square.shape = 'SQUARE'; square.size, square.size_y = 2, 3; square.energy = -5
for light in (point, spot, sun, area, square): add(light.name, light)
noded = bpy.data.lights.new('noded', 'POINT'); noded.use_nodes = True
noded.node_tree.nodes['Emission'].inputs['Strength'].default_value = 2
add('noded', noded)
plain = bpy.data.lights.new('plain', 'POINT'); plain.use_nodes = True
add('plain', plain)
render()
"""
    )
    lights = run.values("light")
    assert lights["point"]["energy"] == 100 and lights["point"]["radius_m"] == 0.25 and lights["point"]["color"] == [1, 0.5, 0.25]
    assert lights["spot"]["spot_size_rad"] == pytest.approx(1) and lights["spot"]["energy"] == pytest.approx(1e30, rel=1e-6)
    assert lights["sun"]["angle_rad"] == pytest.approx(0.1) and lights["sun"]["energy"] == 3
    assert lights["area"]["shape"] == "ellipse" and lights["area"]["size_m"] == [2, 3] and lights["area"]["spread_rad"] == 1.5
    # The wire has the area lights of Blender 3, whose watts are 4/pi of those since 4.0 (measured with Cycles of both).
    unit = 1.0 if run.blender_major < 4 else 4 / math.pi
    assert lights["square"]["size_m"] == [2, 2] and lights["square"]["energy"] == pytest.approx(-5 * unit)
    assert "graph" not in lights["plain"] and "graph" not in lights["point"]
    assert surface_node(lights["noded"]["graph"])["inputs"]["Strength"] == 2
    assert all(run.values("object")[name]["light"] == name for name in lights)


def test_camera_with_shift_sensor_and_focus_object(run_blender):
    run = run_blender(
        """
data = scene.camera.data
data.lens, data.sensor_width, data.sensor_height, data.sensor_fit = 35, 30, 20, 'VERTICAL'
data.shift_x, data.shift_y = 0.1, -0.2
data.dof.use_dof = True
data.dof.aperture_fstop, data.dof.aperture_blades, data.dof.aperture_ratio = 1.4, 6, 2.0
target = add('target', None); target.location = (3, 4, -12)
data.dof.focus_object = target
scene.camera.scale = (2, 2, 2)
render()
data.type, data.ortho_scale, data.dof.use_dof = 'ORTHO', 3.5, False
render()
"""
    )
    first = run.values("camera", 1)["camera"]
    assert (first["type"], first["focal_length_mm"], first["sensor_fit"]) == ("perspective", 35, "vertical")
    assert first["shift"] == pytest.approx([0.1, -0.2]) and first["sensor_height_mm"] == 20
    focus = first["depth_of_field"]
    # Along the axis, whatever the camera's scale.
    assert focus["focus_distance_m"] == pytest.approx(12) and focus["blades"] == 6 and focus["ratio"] == 2
    second = run.values("camera")["camera"]
    assert second["type"] == "orthographic" and second["ortho_scale"] == 3.5 and "depth_of_field" not in second


def test_world_graph_and_visibility(run_blender):
    run = run_blender(
        """
world = scene.world
world.use_nodes = True
world.node_tree.nodes['Background'].inputs['Strength'].default_value = 2.5
world.cycles_visibility.glossy = False
render()
"""
    )
    (world,) = run.values("world").values()
    assert surface_node(world["graph"])["inputs"]["Strength"] == 2.5
    assert world["visibility"]["glossy"] is False and world["visibility"]["camera"] is True


def test_a_failing_object_is_named_and_the_rest_is_rendered(run_blender):
    run = run_blender(
        """
from lambent.sync import mesh
original = mesh.export_mesh
def broken(edits, identifier, name, data, attribute_names):
    if name == 'bad': raise ZeroDivisionError('on purpose')
    original(edits, identifier, name, data, attribute_names)
mesh.export_mesh = broken
quad('bad'); quad('good')
print(render())
"""
    )
    assert "{'FINISHED'}" in run.output and run.code == 0
    assert "bad: could not be exported and is left out" in run.output
    assert set(run.values("object")) == {"good"}


def test_numbers_that_no_float_holds_are_reported_by_name(run_blender):
    run = run_blender(
        """
from lambent.sync import compat
light = bpy.data.lights.new('odd', 'POINT')
add('odd', light)
compat.light_color = lambda light: [float('nan'), 3.5e38, 3.4e38]
render()
"""
    )
    assert run.values("light")["odd"]["color"] == [0.0, 0.0, 3.4e38]
    assert "odd: color is nan; 0 is used instead" in run.output and "odd: color is 3.5e+38; 0" in run.output


def test_focus_distance_is_measured_in_metres_from_the_camera(run_blender):
    run = run_blender("scene.camera.data.dof.use_dof = True\nscene.camera.data.dof.focus_distance = 7\nrender()\n")
    assert run.values("camera")["camera"]["depth_of_field"]["focus_distance_m"] == 7
    assert math.isclose(run.values("camera")["camera"]["transform"][0], 1.0)


def test_attributes_of_objects_and_of_the_scene_travel(run_blender):
    run = run_blender(
        simple(
            """
bpy.context.scene['wear'] = 0.25
for thing in bpy.data.objects: thing['own'] = [0.1, 0.2, 0.3]
own, wear = nodes.new('ShaderNodeAttribute'), nodes.new('ShaderNodeAttribute')
own.attribute_type, own.attribute_name = 'OBJECT', 'own'
wear.attribute_type, wear.attribute_name = 'VIEW_LAYER', 'wear'
diffuse = nodes.new('ShaderNodeBsdfDiffuse')
links.new(own.outputs['Color'], diffuse.inputs['Color'])
links.new(wear.outputs['Fac'], diffuse.inputs['Roughness'])
links.new(diffuse.outputs[0], output.inputs['Surface'])
"""
        )
    )
    diffuse = surface_node(graph_of(run))
    assert diffuse["inputs"]["Roughness"] == pytest.approx(0.25)
    attributes = [value["attributes"] for value in run.values("object").values() if "mesh" in value]
    assert attributes and all(np.allclose(found["own"], [0.1, 0.2, 0.3, 1.0]) for found in attributes)


def test_light_profiles_and_directions_of_normal_nodes_travel(run_blender):
    graph = graph_of(
        run_blender(
            simple(
                """
text = bpy.data.texts.new('profile'); text.from_string('TILT=NONE')
profile, normal = nodes.new('ShaderNodeTexIES'), nodes.new('ShaderNodeNormal')
profile.ies = text
normal.outputs['Normal'].default_value = (0.6, 0.0, 0.8)
diffuse = nodes.new('ShaderNodeBsdfDiffuse')
links.new(profile.outputs['Fac'], diffuse.inputs['Color'])
links.new(normal.outputs['Dot'], diffuse.inputs['Roughness'])
links.new(diffuse.outputs[0], output.inputs['Surface'])
"""
            )
        )
    )
    diffuse = surface_node(graph)
    assert linked(graph, diffuse, "Color")[0]["properties"]["profile"].strip() == "TILT=NONE"
    assert np.allclose(linked(graph, diffuse, "Roughness")[0]["properties"]["direction"], [0.6, 0.0, 0.8])


def test_each_tile_of_a_tiled_image_is_a_texture(run_blender, tmp_path):
    run = run_blender(
        simple(
            f"""
for number in (1001, 1012):
    tile = bpy.data.images.new('tile', 2, 2)
    tile.filepath_raw, tile.file_format = {str(tmp_path)!r} + f'/tile.{{number}}.png', 'PNG'
    tile.save()
tiles = bpy.data.images.load({str(tmp_path)!r} + '/tile.1001.png')
tiles.source, tiles.filepath = 'TILED', {str(tmp_path)!r} + '/tile.<UDIM>.png'
if not any(tile.number == 1012 for tile in tiles.tiles): tiles.tiles.new(1012)
image = nodes.new('ShaderNodeTexImage'); image.image = tiles
emission = nodes.new('ShaderNodeEmission')
links.new(image.outputs['Color'], emission.inputs['Color'])
links.new(emission.outputs[0], output.inputs['Surface'])
"""
        )
    )
    graph = graph_of(run)
    textures = [node for node in graph["nodes"] if node["type"] == "TexImage"]
    paths = {run.values("image")[node["properties"]["image"]]["path"] for node in textures}
    assert {path.rsplit("/", 1)[1] for path in paths} == {"tile.1001.png", "tile.1012.png"}
    moved = [graph["nodes"][node["inputs"]["Vector"]["link"][0]]["inputs"]["Location"] for node in textures]
    assert sorted(moved) == [[-1.0, -1.0, 0.0], [-0.0, -0.0, 0.0]]
    # Where no tile lies it is pink.
    mixes = [node for node in graph["nodes"] if node["type"] == "Mix" and "A_Color" in node["inputs"]]
    assert any(node["inputs"]["A_Color"] == [1.0, 0.0, 1.0] for node in mixes)
