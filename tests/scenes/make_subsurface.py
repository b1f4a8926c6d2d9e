# SPDX-License-Identifier: GPL-3.0-or-later
"""Wax, skin, marble and milk: every method of subsurface scattering, thin and thick, lit from behind and from the front,
textured, bumped, and with another object inside."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks
import bpy


def monkey():
    """Blender's own, smooth."""
    bpy.ops.mesh.primitive_monkey_add(size=1.0)
    made = bpy.context.object
    mesh = made.data
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    bpy.data.objects.remove(made)
    return mesh


def scattering(name, method, color, radius, scale, **inputs):
    made = blocks.simple(name, "ShaderNodeSubsurfaceScattering", Color=color, Radius=radius, Scale=scale, **inputs)
    node = next(node for node in made.node_tree.nodes if node.type == "SUBSURFACE_SCATTERING")
    choices = node.bl_rna.properties["falloff"].enum_items.keys()
    node.falloff = method if method in choices else "RANDOM_WALK"
    return made


def marble():
    """A Principled material with a noise's colour and bump, and a coloured radius."""
    made, nodes, links, output = blocks.material("Marble")
    shader = nodes.new("ShaderNodeBsdfPrincipled")
    blocks.set_inputs(shader, {"Subsurface Weight": 1.0 if "Subsurface Scale" in shader.inputs else 0.08, "Roughness": 0.3})
    if "Subsurface Scale" in shader.inputs:
        shader.inputs["Subsurface Scale"].default_value = 0.08
    noise = nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 4.0
    ramp = nodes.new("ShaderNodeValToRGB")
    ramp.color_ramp.elements[0].color = (0.25, 0.22, 0.24, 1.0)
    ramp.color_ramp.elements[1].color = (0.95, 0.92, 0.86, 1.0)
    ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[1].position = 0.4, 0.6
    bump = nodes.new("ShaderNodeBump")
    bump.inputs["Strength"].default_value, bump.inputs["Distance"].default_value = 0.5, 0.05
    links.new(noise.outputs["Fac"], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], shader.inputs["Base Color"])
    if "Subsurface Color" in shader.inputs:
        links.new(ramp.outputs["Color"], shader.inputs["Subsurface Color"])
    links.new(noise.outputs["Fac"], bump.inputs["Height"])
    links.new(bump.outputs["Normal"], shader.inputs["Normal"])
    links.new(shader.outputs[0], output.inputs["Surface"])
    return made


def main():
    scene = blocks.begin()
    floor = blocks.diffuse("Floor", (0.5, 0.5, 0.5))
    blocks.place(scene, blocks.quad("Floor", [(-6, -6, 0), (6, -6, 0), (6, 6, 0), (-6, 6, 0)]), floor)
    head = monkey()
    wax = scattering("Wax", "RANDOM_WALK", (0.85, 0.45, 0.2), (1.0, 0.4, 0.15), 0.25)
    skin = blocks.principled("Skin", Base_Color=(0.75, 0.45, 0.35), Roughness=0.4, Subsurface_Weight=0.15)
    if "Subsurface Color" in skin.node_tree.nodes["Principled BSDF"].inputs:
        skin.node_tree.nodes["Principled BSDF"].inputs["Subsurface Color"].default_value = (0.85, 0.4, 0.3, 1.0)
    for material, x in ((wax, -1.1), (skin, 0.05)):
        made = blocks.place(scene, head.copy(), material, (x, 0.0, 0.62), (-20, 0, 12))
    blocks.place(scene, blocks.box("Block", (0.8, 0.5, 1.1)), marble(), (1.25, 0.3, 0.55), (0, 0, 30))
    milk = scattering("Milk", "RANDOM_WALK_FIXED_RADIUS", (0.95, 0.93, 0.88), (1.0, 0.8, 0.5), 0.4)
    blocks.place(scene, blocks.sphere("Milk", 0.3), milk, (-0.45, -0.95, 0.3))
    blocks.place(scene, blocks.sphere("Stone", 0.12), blocks.diffuse("Stone", (0.1, 0.1, 0.3)), (-0.45, -0.95, 0.3))
    thin = scattering("Leaf", "BURLEY", (0.35, 0.6, 0.15), (0.5, 1.0, 0.2), 0.1)
    blocks.place(scene, blocks.box("Leaf", (0.6, 0.02, 0.5)), thin, (0.6, -0.95, 0.25), (0, 0, -15))
    blocks.light(scene, "AREA", "Key", 60.0, (-2.5, -2.5, 3.0), (0, 0, 0.5), size=1.0)
    blocks.light(scene, "SPOT", "Back", 250.0, (0.8, 3.0, 2.0), (0, 0, 0.5), color=(1.0, 0.9, 0.8), spot_size=1.2, shadow_soft_size=0.1)
    blocks.world(scene, (0.6, 0.75, 1.0), 0.25)
    blocks.camera(scene, (0.3, -5.0, 1.6), (0.05, 0.0, 0.5), 50.0)
    blocks.finish(scene, 480, 320)


main()
