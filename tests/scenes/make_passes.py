# SPDX-License-Identifier: GPL-3.0-or-later
"""Every class of material, light groups, shader AOVs, parents, indices and a transparent film, for all passes that Blender has
switches for, in two view layers: "ViewLayer" with everything, "Masked" with a holdout and an object that only others see."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks
import bpy

k_groups = ("keys", "rim", "signs", "sky")


def aov_output(nodes, name):
    node = nodes.new("ShaderNodeOutputAOV")
    if hasattr(node, "aov_name"):
        node.aov_name = name
    else:
        node.name = name
    return node


def tiled_floor():
    """A rough floor whose tiles go to the AOV "tint" too, and whose height in the texture to "amount"."""
    squares = blocks.image(
        "squares", 64, 64, lambda u, v: ((0.75, 0.45, 0.2) if int(u * 4) + int(v * 4) & 1 else (0.35, 0.4, 0.5))
    )
    made, nodes, links, output = blocks.material("Floor")
    shader, texture = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeTexImage")
    texture.image = squares
    links.new(texture.outputs["Color"], shader.inputs["Color"])
    links.new(shader.outputs[0], output.inputs["Surface"])
    links.new(texture.outputs["Color"], aov_output(nodes, "tint").inputs["Color"])
    aov_output(nodes, "amount").inputs["Value"].default_value = 0.25
    return made


def half_transparent():
    """Half a diffuse surface, half nothing: what is behind it shows through."""
    made, nodes, links, output = blocks.material("Veil")
    mix, diffuse = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (0.2, 0.6, 0.3, 1.0)
    mix.inputs[0].default_value = 0.4
    links.new(nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[1])
    links.new(diffuse.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], output.inputs["Surface"])
    aov_output(nodes, "amount").inputs["Value"].default_value = 1.0
    return made


def add_objects(scene):
    simple, ball = blocks.simple, lambda: blocks.sphere("Ball", 0.5, 64, 32)
    blocks.place(scene, blocks.quad("Floor", [(-3, -2, 0), (3, -2, 0), (3, 2, 0), (-3, 2, 0)]), tiled_floor(), name="Floor")
    row = (
        ("Diffuse", simple("Diffuse", "ShaderNodeBsdfDiffuse", Color=(0.7, 0.3, 0.25))),
        ("Glossy", simple("Glossy", "ShaderNodeBsdfGlossy", Color=(0.8, 0.75, 0.6), Roughness=0.3)),
        ("Coated", blocks.principled("Coated", Base_Color=(0.15, 0.3, 0.6), Roughness=0.4, Coat_Weight=0.5)),
        ("Glass", simple("Glass", "ShaderNodeBsdfGlass", Color=(0.9, 1.0, 0.95), Roughness=0.2, IOR=1.45)),
    )
    placed = {}
    for index, (name, material) in enumerate(row):
        placed[name] = blocks.place(scene, ball(), material, (1.2 * index - 1.8, 0.2, 0.5), name=name)
        placed[name].pass_index, material.pass_index = index + 1, 10 * (index + 1)
    leaf = simple("Leaf", "ShaderNodeBsdfTranslucent", Color=(0.6, 0.7, 0.2))
    placed["Leaf"] = blocks.place(scene, blocks.quad("Leaf", [(-0.5, 0, 0), (0.5, 0, 0), (0.5, 0, 1), (-0.5, 0, 1)]), leaf, (2.2, 1, 0))
    veil = blocks.quad("Veil", [(-0.6, 0, 0), (0.6, 0, 0), (0.6, 0, 0.8), (-0.6, 0, 0.8)])
    placed["Veil"] = blocks.place(scene, veil, half_transparent(), (-0.6, -0.8, 0))
    sign = blocks.emission("Sign", (1.0, 0.55, 0.2), 4.0)
    placed["Sign"] = blocks.place(scene, blocks.box("Sign", (0.5, 0.05, 0.25)), sign, (-0.4, 1.2, 1.3))
    placed["Sign"].lightgroup = "signs"
    for name in ("Glossy", "Coated"):
        placed[name].parent = placed["Diffuse"]
        placed[name].matrix_parent_inverse = placed["Diffuse"].matrix_basis.inverted()
    return placed


def ask_for_everything(layer):
    """Switches on each of Blender's and Cycles' passes, the AOVs and light groups."""
    for name in layer.bl_rna.properties.keys():
        if name.startswith("use_pass_") and not name.startswith("use_pass_subsurface") and name != "use_pass_grease_pencil":
            setattr(layer, name, True)
    if hasattr(layer, "cycles"):
        for name in ("use_pass_shadow_catcher", "pass_debug_sample_count", "denoising_store_passes"):
            setattr(layer.cycles, name, True)
    layer.pass_cryptomatte_depth = 8
    for name, kind in (("tint", "COLOR"), ("amount", "VALUE")):
        aov = layer.aovs.add()
        aov.name, aov.type = name, kind
    for name in k_groups:
        layer.lightgroups.add(name=name)


def add_masked_layer(scene, placed):
    layer = scene.view_layers.new("Masked")
    for name, objects in (("Hole", ("Coated",)), ("Unseen", ("Sign", "Glossy"))):
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        for key in objects:
            scene.collection.objects.unlink(placed[key])
            collection.objects.link(placed[key])
    layer.layer_collection.children["Hole"].holdout = True
    layer.layer_collection.children["Unseen"].indirect_only = True
    layer.use_pass_z = layer.use_pass_cryptomatte_object = layer.use_pass_emit = True


def main():
    scene = blocks.begin()
    placed = add_objects(scene)
    key = blocks.light(scene, "AREA", "Key", 120.0, (-2.5, -2.5, 3.5), (0, 0, 0.4), (1, 0.9, 0.8), size=1.0)
    rim = blocks.light(scene, "POINT", "Rim", 60.0, (2.8, 1.8, 2.2), color=(0.6, 0.8, 1.0), shadow_soft_size=0.2)
    key.lightgroup, rim.lightgroup = "keys", "rim"
    blocks.world(scene, (0.25, 0.3, 0.4)).lightgroup = "sky"
    scene.world.mist_settings.start, scene.world.mist_settings.depth = 4.0, 6.0
    scene.world.light_settings.distance = 1.0
    camera = blocks.camera(scene, (0.4, -6.5, 2.6), (0, 0, 0.55), 50.0)
    for frame, x in ((0, 0.3), (2, 0.5)):
        camera.location.x = x
        camera.keyframe_insert("location", frame=frame)
    scene.frame_set(1)
    scene.render.film_transparent = True
    blocks.transport(scene, 4)
    layer = scene.view_layers[0]
    layer.name = "ViewLayer"
    ask_for_everything(layer)
    add_masked_layer(scene, placed)
    blocks.finish(scene, 240, 144, 64)


main()
