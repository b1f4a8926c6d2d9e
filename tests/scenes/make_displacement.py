# SPDX-License-Identifier: GPL-3.0-or-later
"""True displacement, alone and with bump: noise, images and vectors in every space, on smooth, flat and mixed meshes, some of
them scaled unevenly, with two materials, emissive, or shared by objects."""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks


def set_method(material, method):
    (material if hasattr(material, "displacement_method") else material.cycles).displacement_method = method


def displaced(name, method, make_height, node_type="ShaderNodeDisplacement", space="OBJECT", shader=None, **inputs):
    """A material; make_height(nodes, links) returns the socket of the height or vector."""
    made, nodes, links, output = blocks.material(name)
    surface = nodes.new(shader or "ShaderNodeBsdfDiffuse")
    if shader is None:
        surface.inputs["Color"].default_value = (0.7, 0.6, 0.5, 1.0)
    links.new(surface.outputs[0], output.inputs["Surface"])
    node = nodes.new(node_type)
    node.space = space
    blocks.set_inputs(node, inputs)
    links.new(make_height(nodes, links), node.inputs["Vector" if "Vector" in node_type else "Height"])
    links.new(node.outputs[0], output.inputs["Displacement"])
    set_method(made, method)
    return made


def noise(coordinates, scale, output="Fac"):
    def make(nodes, links):
        texture = nodes.new("ShaderNodeTexNoise")
        texture.inputs["Scale"].default_value = scale
        texture.inputs["Detail"].default_value = 1.0
        if coordinates == "Position":
            links.new(nodes.new("ShaderNodeNewGeometry").outputs["Position"], texture.inputs["Vector"])
        else:
            links.new(nodes.new("ShaderNodeTexCoord").outputs[coordinates], texture.inputs["Vector"])
        return texture.outputs[output] if output in texture.outputs else texture.outputs[0]

    return make


def picture(image):
    def make(nodes, links):
        texture = nodes.new("ShaderNodeTexImage")
        texture.image = image
        return texture.outputs["Color"]

    return make


def grid(name, count, smooth):
    step = 1.6 / count
    vertices = [(x * step - 0.8, y * step - 0.8, 0.0) for y in range(count + 1) for x in range(count + 1)]
    faces = [
        (row + x, row + x + 1, row + x + count + 2, row + x + count + 1)
        for row in range(0, count * (count + 1), count + 1)
        for x in range(count)
    ]
    return blocks.mesh(name, vertices, faces, smooth, uv=lambda i: ((vertices[i][0] + 0.8) / 1.6, (vertices[i][1] + 0.8) / 1.6))


def main():
    scene = blocks.begin()
    waves = blocks.image(
        "Waves", 64, 64, lambda u, v: (*(0.5 + 0.5 * math.sin(2 * math.pi * (k * u + 2 * v)) for k in (1, 2, 0)),), is_float=True
    )
    waves.colorspace_settings.name = "Non-Color"
    ball = lambda name: blocks.sphere(name, 0.7, 64, 32)
    two = ball("Two")
    two.materials.append(displaced("Half", "DISPLACEMENT", noise("Object", 3.0), Scale=0.6))
    two.materials.append(blocks.simple("Plain", "ShaderNodeBsdfDiffuse", Color=(0.3, 0.5, 0.7)))
    two.polygons.foreach_set("material_index", [1 if polygon.center.x > 0.1 else 0 for polygon in two.polygons])
    shared = ball("Shared")
    shared.materials.append(displaced("Same", "DISPLACEMENT", noise("Object", 4.0), Scale=0.4))
    places = [
        (ball("Noise"), displaced("True", "DISPLACEMENT", noise("Object", 2.5), Scale=0.8), (1.0, 0.8, 1.2)),
        (blocks.sphere("Coarse", 0.7, 24, 12), displaced("Both", "BOTH", noise("Generated", 6.0), Scale=0.3), (1.0, 1.0, 1.0)),
        (blocks.sphere("Uneven", 0.7, 32, 16), displaced("Both uneven", "BOTH", noise("Object", 4.0), Scale=0.3), (1.2, 0.8, 1.0)),
        (grid("Flat", 24, False), displaced("World", "DISPLACEMENT", noise("Position", 2.0), space="WORLD", Scale=0.8), (1.0, 1.0, 0.5)),
        (grid("Smooth", 48, True), displaced("Image", "DISPLACEMENT", picture(waves), Scale=0.2, Midlevel=0.3), (1.0, 1.0, 1.0)),
        (grid("Both", 24, True), displaced("Image both", "BOTH", picture(waves), Scale=0.2), (1.0, 1.0, 1.0)),
        (
            grid("Vector", 48, True),
            displaced("Vector", "DISPLACEMENT", picture(waves), "ShaderNodeVectorDisplacement", "OBJECT", Scale=0.2, Midlevel=0.5),
            (1.0, 0.8, 1.0),
        ),
        (
            grid("Tangent", 48, True),
            displaced("Tangent", "DISPLACEMENT", picture(waves), "ShaderNodeVectorDisplacement", "TANGENT", Scale=0.2),
            (1.0, 0.9, 1.0),
        ),
        (
            ball("World vector"),
            displaced("World vector", "DISPLACEMENT", noise("Position", 2.0, "Color"), "ShaderNodeVectorDisplacement", "WORLD", Scale=0.5, Midlevel=0.5),
            (1.0, 1.0, 0.7),
        ),
        (two, None, (1.0, 1.0, 1.0)),
        (ball("Glow"), displaced("Glow", "DISPLACEMENT", noise("Object", 3.0), shader="ShaderNodeEmission", Scale=0.8), (0.6, 0.6, 0.6)),
        (
            blocks.tube("Mixed", [(0, 0, z / 8 - 0.6) for z in range(10)], [0.5] * 10, 48),
            displaced("Mixed", "DISPLACEMENT", noise("Object", 3.0), Scale=0.5),
            (1.0, 1.0, 1.0),
        ),
        (shared, None, (1.0, 1.0, 1.0)),
        (shared, None, (0.6, 0.9, 1.1)),
        (blocks.sphere("Glossy", 0.7, 48, 24), displaced("Rough", "BOTH", noise("Object", 8.0), Scale=0.1, shader="ShaderNodeBsdfPrincipled"), (1.0, 1.0, 1.0)),
    ]
    for index, (mesh, material, scale) in enumerate(places):
        x, y = 2.0 * (index % 5) - 4.0, 2.2 * (index // 5) - 2.2
        turn = (0, 0, 0) if len(mesh.vertices) and mesh.name.startswith(("Flat", "Smooth", "Both", "Vector", "Tangent")) else (20, 10, 30)
        blocks.place(scene, mesh, material, (x, y, 0.7), turn, scale)
    floor = blocks.diffuse("Floor", (0.5, 0.5, 0.5))
    blocks.place(scene, blocks.quad("Floor", [(-12, -12, -0.3), (12, -12, -0.3), (12, 12, -0.3), (-12, 12, -0.3)]), floor)
    blocks.light(scene, "SUN", "Sun", 2.5, (0, 0, 5), (3, 4, 0), angle=math.radians(10))
    blocks.world(scene, (0.25, 0.3, 0.4))
    blocks.camera(scene, (0, -9.0, 9.0), (0, -0.4, 0.3), 42.0)
    blocks.finish(scene, 640, 400)


main()
