# SPDX-License-Identifier: GPL-3.0-or-later
"""Twelve tiles, each with three 4096 x 4096 textures (colour, roughness, normals) of its own beside the .blend: 36 pictures of
16 million texels, of which the picture sees most at a distance. What a texture cache is for: 1.7 GiB as bytes, four times that
as floats."""

import os
import pathlib
import sys

import bpy
import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks

k_size = 4096
k_columns, k_rows = 4, 3


def picture(folder, name, channels):
    """A file of smooth patterns with grain; returns the image, its pixels not kept in the .blend."""
    path = os.path.join(folder, name + ".png")
    if not os.path.exists(path):
        made = bpy.data.images.new(name, k_size, k_size, alpha=False)
        pixels = numpy.ones((k_size, k_size, 4), numpy.float32)
        pixels[..., :3] = numpy.stack(channels, -1)
        made.pixels.foreach_set(pixels.ravel())
        made.filepath_raw, made.file_format = path, "PNG"
        made.save()
        bpy.data.images.remove(made)
    return bpy.data.images.load(path)


def textured(folder, number):
    """A Principled surface with a colour, a roughness and a normal map."""
    rng = numpy.random.default_rng(number)
    y, x = numpy.mgrid[0:k_size, 0:k_size].astype(numpy.float32) / k_size
    grain = rng.random((k_size, k_size), numpy.float32)
    waves = 0.5 + 0.5 * numpy.sin(60.0 * x + 8.0 * numpy.sin(20.0 * y + number))
    color = picture(folder, f"color_{number}", [0.2 + 0.6 * waves, 0.3 + 0.3 * grain, 0.2 + 0.5 * y])
    rough = picture(folder, f"roughness_{number}", [0.2 + 0.6 * waves * grain] * 3)
    slope = 0.5 + 0.15 * numpy.cos(60.0 * x + number)
    normal = picture(folder, f"normal_{number}", [slope, 0.5 + 0.1 * (grain - 0.5), numpy.full_like(x, 0.95)])
    rough.colorspace_settings.name = normal.colorspace_settings.name = "Non-Color"
    material = blocks.principled(f"Textured {number}")
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = next(node for node in nodes if node.bl_idname == "ShaderNodeBsdfPrincipled")

    def texture(image):
        node = nodes.new("ShaderNodeTexImage")
        node.image = image
        return node.outputs["Color"]

    links.new(texture(color), shader.inputs["Base Color"])
    links.new(texture(rough), shader.inputs["Roughness"])
    bent = nodes.new("ShaderNodeNormalMap")
    links.new(texture(normal), bent.inputs["Color"])
    links.new(bent.outputs[0], shader.inputs["Normal"])
    return material


def main():
    scene = blocks.begin()
    folder = os.path.dirname(os.path.abspath(blocks.arguments()[0]))
    os.makedirs(folder, exist_ok=True)
    for index in range(k_columns * k_rows):
        x, y = 2.0 * (index % k_columns) - k_columns, 2.0 * (index // k_columns) - k_rows
        corners = [(x, y, 0), (x + 1.95, y, 0), (x + 1.95, y + 1.95, 0), (x, y + 1.95, 0)]
        blocks.place(scene, blocks.quad(f"Tile {index}", corners), textured(folder, index))
    blocks.light(scene, "AREA", "Lamp", 400.0, (0, 0, 5), size=3.0)
    blocks.world(scene, (0.4, 0.45, 0.5))
    blocks.camera(scene, (0, -6.5, 6), (0, -0.2, 0), 35.0)
    blocks.finish(scene, 480, 270)


main()
