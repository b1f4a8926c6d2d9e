# SPDX-License-Identifier: GPL-3.0-or-later
"""A plane that fills the picture with a heavy procedural material: octaves of noise and Musgrave, Voronoi cells, bricks, waves
and magic, mixed by each other. Nearly all the time of rendering it is spent in the shader."""

import pathlib
import sys

import bpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks


def heavy(name):
    """A diffuse surface whose colour comes from seven textures."""
    material, nodes, links, output = blocks.material(name)
    coordinates = nodes.new("ShaderNodeTexCoord").outputs["Object"]

    def texture(kind, output, **inputs):
        node = nodes.new("ShaderNodeTex" + kind)
        links.new(coordinates, node.inputs["Vector"])
        blocks.set_inputs(node, inputs)
        return node.outputs[output]

    def mixed(factor, a, b):
        node = nodes.new("ShaderNodeMixRGB")
        links.new(factor, node.inputs["Fac"])
        links.new(a, node.inputs["Color1"])
        links.new(b, node.inputs["Color2"])
        return node.outputs[0]

    noise = texture("Noise", "Color", Scale=3.0, Detail=8.0, Roughness=0.6, Distortion=0.5)
    fine = texture("Noise", "Fac", Scale=20.0, Detail=4.0)
    cells = texture("Voronoi", "Color", Scale=6.0)
    edges = texture("Voronoi", "Distance", Scale=11.0)
    if hasattr(bpy.types, "ShaderNodeTexMusgrave"):
        rough = texture("Musgrave", "Fac", Scale=5.0, Detail=6.0)
    else:
        rough = texture("Noise", "Fac", Scale=5.0, Detail=5.0)
    bricks = texture("Brick", "Color", Scale=4.0)
    waves = texture("Wave", "Fac", Scale=2.0, Distortion=3.0, Detail=3.0)
    magic = texture("Magic", "Color", Scale=3.0)
    color = mixed(fine, mixed(edges, noise, cells), mixed(waves, bricks, mixed(rough, magic, noise)))
    shader = nodes.new("ShaderNodeBsdfDiffuse")
    links.new(color, shader.inputs["Color"])
    links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def main():
    scene = blocks.begin()
    plane = blocks.quad("Plane", [(-4, -3, 0), (4, -3, 0), (4, 3, 0), (-4, 3, 0)])
    blocks.place(scene, plane, heavy("Heavy"))
    blocks.world(scene, (1.0, 1.0, 1.0))
    blocks.camera(scene, (0, 0, 5), (0, 0, 0), 35.0)
    blocks.finish(scene, 480, 270)


main()
