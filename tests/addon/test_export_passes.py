# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What travels of AOV nodes, masks and light groups."""

import pytest

# A material with an AOV output of its own, one in a group (with the group's input linked), a muted one and one of another name.
AOVS = """
def aov_output(tree, name):
    node = tree.nodes.new('ShaderNodeOutputAOV')
    if hasattr(node, 'aov_name'): node.aov_name = name
    else: node.name = name
    return node
material, nodes, links = node_material('shaded')
tree = material.node_tree
diffuse, output = nodes.new('ShaderNodeBsdfDiffuse'), nodes.new('ShaderNodeOutputMaterial')
links.new(diffuse.outputs[0], output.inputs['Surface'])
noise = nodes.new('ShaderNodeTexNoise')
links.new(noise.outputs['Color'], aov_output(tree, 'tint').inputs['Color'])
muted = aov_output(tree, 'tint')
muted.mute = True
if not muted.mute: nodes.remove(muted) # Blender 5 mutes no outputs
links.new(nodes.new('ShaderNodeTexWave').outputs['Color'], aov_output(tree, 'unwanted').inputs['Color'])
group = bpy.data.node_groups.new('group', 'ShaderNodeTree')
if hasattr(group, 'interface'): group.interface.new_socket('Amount', in_out='INPUT', socket_type='NodeSocketFloat')
else: group.inputs.new('NodeSocketFloat', 'Amount')
group.links.new(group.nodes.new('NodeGroupInput').outputs[0], aov_output(group, 'amount').inputs['Value'])
used = nodes.new('ShaderNodeGroup'); used.node_tree = group; used.inputs[0].default_value = 0.25
quad().data.materials.append(material)
def ask(layer, **names):
    for name, kind in names.items():
        aov = layer.aovs.add(); aov.name, aov.type = name, kind
"""


def test_only_aov_nodes_that_the_layer_asks_for_travel(run_blender):
    run = run_blender(
        AOVS
        + """
ask(bpy.context.view_layer, tint='COLOR', amount='VALUE')
second = scene.view_layers.new('Second')
render()
"""
    )
    first, second = (run.values("material", count)["shaded"]["graph"] for count in (1, 2))
    found = [first["nodes"][index] for index in first["outputs"]["aovs"]]
    assert sorted(node["properties"]["aov"] for node in found) == ["amount", "tint"]
    assert all(node["type"] == "OutputAOV" and "aov_name" not in node["properties"] for node in found)
    tint = next(node for node in found if node["properties"]["aov"] == "tint")
    amount = next(node for node in found if node["properties"]["aov"] == "amount")
    source, socket = tint["inputs"]["Color"]["link"]
    assert (first["nodes"][source]["type"], socket) == ("TexNoise", "Color")
    assert amount["inputs"]["Value"] == 0.25
    assert not any(node["type"] == "TexWave" for node in first["nodes"])
    assert "aovs" not in second["outputs"] and {node["type"] for node in second["nodes"]} == {"BsdfDiffuse"}


def test_a_material_without_an_output_node_still_has_its_aovs(run_blender):
    run = run_blender(AOVS + "nodes.remove(output)\nask(bpy.context.view_layer, tint='COLOR')\nrender()\n")
    graph = run.values("material")["shaded"]["graph"]
    assert set(graph["outputs"]) == {"aovs"} and len(graph["outputs"]["aovs"]) == 1


def test_a_world_may_write_aovs(run_blender):
    run = run_blender(
        AOVS
        + """
scene.world.use_nodes = True
aov_output(scene.world.node_tree, 'tint').inputs['Color'].default_value = (1, 2, 3, 1)
ask(bpy.context.view_layer, tint='COLOR')
render()
"""
    )
    graph = next(iter(run.values("world").values()))["graph"]
    node = graph["nodes"][graph["outputs"]["aovs"][0]]
    assert node["inputs"]["Color"][:3] == [1, 2, 3]


COLLECTIONS = """
inner = bpy.data.collections.new('inner'); scene.collection.children.link(inner)
quad('inside', inner); quad('outside')
layer = bpy.context.view_layer
chosen = layer.layer_collection.children['inner']
"""


@pytest.mark.parametrize(
    "what, holdout, camera",
    [
        ("pass", False, True),
        ("chosen.holdout = True", True, True),
        ("chosen.indirect_only = True", False, False),
        ("chosen.holdout = chosen.indirect_only = True", True, True),
        ("bpy.data.objects['inside'].is_holdout = True", True, True),
    ],
)
def test_masks_of_objects_and_collections_travel(run_blender, what, holdout, camera):
    run = run_blender(COLLECTIONS + f"{what}\nrender()\n")
    objects = run.values("object")
    assert objects["inside"].get("holdout", False) == holdout and objects["inside"]["visibility"]["camera"] == camera
    assert "holdout" not in objects["outside"] and objects["outside"]["visibility"]["camera"]
    assert "not supported" not in run.output


def test_shadow_catchers_travel_and_their_pass_is_asked_for(run_blender):
    run = run_blender(
        COLLECTIONS
        + """
bpy.data.objects['inside'].is_shadow_catcher = True
scene.render.film_transparent = True
(layer.cycles if hasattr(layer, 'cycles') else layer.lambent).use_pass_shadow_catcher = True
render()
"""
    )
    objects = run.values("object")
    assert objects["inside"]["shadow_catcher"] and "shadow_catcher" not in objects["outside"]
    assert "not supported" not in run.output


def test_the_choice_of_objects_for_shadow_passes_travels(run_blender):
    run = run_blender(
        COLLECTIONS
        + """
bpy.data.objects['inside'].lambent.shadow_pass = True
layer.lambent.use_pass_shadow_ratio = layer.lambent.use_pass_without_shadow = True
render()
"""
    )
    objects = run.values("object")
    assert objects["inside"]["shadow_pass"] and "shadow_pass" not in objects["outside"]


def test_instances_of_a_collection_take_the_mask_of_what_instances_them(run_blender):
    run = run_blender(
        """
source = bpy.data.collections.new('source')
quad('thing', source).is_holdout = True
masked, plain = add('masked', None), add('plain', None)
for empty in (masked, plain): empty.instance_type, empty.instance_collection = 'COLLECTION', source
masked.is_holdout = True
render()
"""
    )
    objects = run.values("object")
    # As in Cycles.
    assert objects["masked/thing"]["holdout"] and "holdout" not in objects["plain/thing"]
    assert objects["masked/thing"]["name"] == "thing"


def test_light_groups_of_lamps_meshes_and_the_world_travel(run_blender):
    run = run_blender(
        """
lamp = add('lamp', bpy.data.lights.new('lamp', 'POINT')); lamp.lightgroup = 'keys'
twin = add('twin', lamp.data); twin.lightgroup = 'rim'
add('third', lamp.data)
quad('glowing').lightgroup = 'signs'; quad('plain')
scene.world.lightgroup = 'sky'
for name in ('keys', 'rim', 'signs', 'sky'): bpy.context.view_layer.lightgroups.add(name=name)
render()
"""
    )
    objects = run.values("object")
    assert [objects[name].get("light_group", "") for name in ("lamp", "twin", "third", "glowing", "plain")] == [
        "keys", "rim", "", "signs", ""
    ]  # fmt: skip
    assert "light_group" not in run.values("light")["lamp"]
    assert next(iter(run.values("world").values()))["light_group"] == "sky"
    entries = run.values("settings")["render"]["passes"]
    groups = [entry for entry in entries[1:] if entry["kind"] == "light_group"]
    assert [(entry["name"], entry["argument"]) for entry in groups] == [(f"Combined_{n}", n) for n in ("keys", "rim", "signs", "sky")]


def test_the_topmost_parent_is_the_asset(run_blender):
    run = run_blender(
        """
top, middle, bottom = add('top', None), quad('middle'), quad('bottom')
middle.parent, bottom.parent = top, middle
render()
"""
    )
    objects = run.values("object")
    assert objects["middle"]["asset"] == objects["bottom"]["asset"] == "top"
