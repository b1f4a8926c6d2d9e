# SPDX-License-Identifier: GPL-3.0-or-later
"""200 spheres, each with a material of its own that mixes eight layers, some by patterns: many programs, many lobes."""

import pathlib
import sys

import bpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks

k_columns, k_rows = 20, 10


def layered(name, number):
    """Eight shaders, mixed one over the other by constants, a fresnel curve and noise."""
    material, nodes, links, output = blocks.material(name)

    def shader(kind, **inputs):
        node = nodes.new("ShaderNode" + kind)
        blocks.set_inputs(node, inputs)
        return node.outputs[0]

    def mixed(factor, under, over):
        node = nodes.new("ShaderNodeMixShader")
        if isinstance(factor, float):
            node.inputs[0].default_value = factor
        else:
            links.new(factor, node.inputs[0])
        links.new(under, node.inputs[1])
        links.new(over, node.inputs[2])
        return node.outputs[0]

    hue = 0.1 + 0.8 * (number * 0.618034 % 1.0)
    glossy = "BsdfAnisotropic" if hasattr(bpy.types, "ShaderNodeBsdfAnisotropic") else "BsdfGlossy"
    noise = nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 3.0 + number % 7
    layers = [
        ("BsdfDiffuse", {"Color": (hue, 0.3, 1.0 - hue)}, None),
        ("BsdfDiffuse", {"Color": (0.2, hue, 0.3), "Roughness": 0.7}, noise.outputs["Fac"]),
        (glossy, {"Color": (0.8, 0.7, 0.5), "Roughness": 0.5}, 0.3),
        ("BsdfTranslucent", {"Color": (0.4, 0.5, hue)}, 0.15),
        (glossy, {"Color": (0.9, 0.9, 0.9), "Roughness": 0.25}, 0.2),
        ("BsdfDiffuse", {"Color": (0.7, 0.6, hue)}, noise.outputs["Fac"]),
        ("BsdfTransparent", {}, 0.05),
        (glossy, {"Color": (1.0, 1.0, 1.0), "Roughness": 0.05}, nodes.new("ShaderNodeFresnel").outputs[0]),
    ]
    result = None
    for kind, inputs, factor in layers:
        made = shader(kind, **inputs)
        result = made if result is None else mixed(factor, result, made)
    links.new(result, output.inputs["Surface"])
    return material


def main():
    scene = blocks.begin()
    grey = blocks.simple("Grey", "ShaderNodeBsdfDiffuse", Color=(0.6, 0.6, 0.6))
    blocks.place(scene, blocks.quad("Floor", [(-14, -9, 0), (14, -9, 0), (14, 9, 0), (-14, 9, 0)]), grey)
    ball = blocks.sphere("Ball", 0.5)
    for index in range(k_columns * k_rows):
        column, row = index % k_columns, index // k_columns
        place = (1.2 * (column - 0.5 * (k_columns - 1)), 1.2 * (row - 0.5 * (k_rows - 1)), 0.5)
        blocks.place(scene, ball, layered(f"Layers {index:03}", index), place)
    blocks.light(scene, "AREA", "Lamp", 900.0, (0, -2, 9), size=5.0)
    blocks.world(scene, (0.3, 0.35, 0.4))
    blocks.camera(scene, (0, -15, 14), (0, -0.5, 0), 32.0)
    blocks.finish(scene, 480, 270)


main()
