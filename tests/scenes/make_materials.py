# SPDX-License-Identifier: GPL-3.0-or-later
"""A chart of 35 spheres, a material each: every surface node that Lambent knows, mixed, added, bumped and textured."""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks


def mixed(name, node_type, first, second, factor=None):
    """A Mix or Add shader of two shader nodes, each (node type, inputs)."""
    made, nodes, links, output = blocks.material(name)
    join = nodes.new(node_type)
    sockets = [socket for socket in join.inputs if socket.type == "SHADER"]
    for socket, (kind, inputs) in zip(sockets, (first, second)):
        shader = nodes.new(kind)
        blocks.set_inputs(shader, inputs)
        links.new(shader.outputs[0], socket)
    if factor is not None:
        join.inputs[0].default_value = factor
    links.new(join.outputs[0], output.inputs["Surface"])
    return made


def textured(name, image, bump=0.0):
    """A Principled material whose colour, or height of a bump, comes from an image by UV."""
    made, nodes, links, output = blocks.material(name)
    shader = nodes.new("ShaderNodeBsdfPrincipled")
    blocks.set_inputs(shader, {"Roughness": 0.4, "Base_Color": (0.7, 0.7, 0.7)})
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    if bump:
        node = nodes.new("ShaderNodeBump")
        node.inputs["Strength"].default_value = bump
        node.inputs["Distance"].default_value = 0.05
        links.new(texture.outputs["Color"], node.inputs["Height"])
        links.new(node.outputs["Normal"], shader.inputs["Normal"])
    else:
        links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    links.new(shader.outputs[0], output.inputs["Surface"])
    return made


def ball():
    """A sphere with UVs by longitude and latitude."""
    made = blocks.sphere("Ball", 0.42, 48, 24)
    layer = made.uv_layers.new(name="UVMap")
    for polygon in made.polygons:
        east = [made.vertices[index].co for index in polygon.vertices]
        angles = [math.atan2(p.y, p.x) / (2 * math.pi) % 1.0 for p in east]
        for loop, point, angle in zip(polygon.loop_indices, east, angles):
            seam = angle + 1.0 if angle < 0.25 and max(angles) > 0.75 else angle
            layer.data[loop].uv = (seam, 0.5 + math.asin(max(-1, min(1, point.z / 0.42))) / math.pi)
    return made


def materials():
    simple, principled = blocks.simple, blocks.principled
    squares = blocks.image(
        "squares", 64, 64, lambda u, v: ((0.8, 0.3, 0.1) if int(u * 8) + int(v * 4) & 1 else (0.1, 0.25, 0.5))
    )
    dots = blocks.image(
        "dots", 128, 128, lambda u, v: (max(0.0, 1 - 30 * ((u * 8 % 1 - 0.5) ** 2 + (v * 8 % 1 - 0.5) ** 2) / 4),) * 3
    )
    dots.colorspace_settings.name = "Non-Color"
    diffuse, glossy, glass = "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfGlossy", "ShaderNodeBsdfGlass"
    teal, white, sand = (0.1, 0.5, 0.45), (0.8, 0.8, 0.8), (0.75, 0.5, 0.25)
    yield from (simple(f"Diffuse {r}", diffuse, Color=teal, Roughness=r) for r in (0.0, 1.0))
    yield from (simple(f"Glossy {r}", glossy, Color=sand, Roughness=r) for r in (0.0, 0.1, 0.3, 0.7))
    yield from (simple(f"Glass {r}", glass, Color=white, Roughness=r, IOR=1.45) for r in (0.0, 0.15, 0.5))
    yield simple("Refraction", "ShaderNodeBsdfRefraction", Color=white, Roughness=0.1, IOR=1.3)
    yield simple("Translucent", "ShaderNodeBsdfTranslucent", Color=sand)
    yield simple("Transparent", "ShaderNodeBsdfTransparent", Color=(0.9, 0.6, 0.6))
    yield blocks.emission("Emission", (1.0, 0.6, 0.2), 3.0)
    yield mixed("Mix", "ShaderNodeMixShader", (diffuse, {"Color": teal}), (glossy, {"Roughness": 0.1}), 0.35)
    yield mixed("Add", "ShaderNodeAddShader", (diffuse, {"Color": teal}), (glossy, {"Color": sand, "Roughness": 0.3}))
    yield textured("Image", squares)
    yield textured("Bump", dots, 0.8)
    for roughness in (0.0, 0.3, 0.6, 1.0):
        yield principled(f"Plastic {roughness}", Base_Color=(0.6, 0.1, 0.1), Roughness=roughness)
    for roughness in (0.05, 0.3, 0.6):
        yield principled(f"Metal {roughness}", Base_Color=sand, Metallic=1.0, Roughness=roughness)
    for roughness in (0.0, 0.3):
        yield principled(f"Clear {roughness}", Base_Color=white, Transmission_Weight=1.0, Roughness=roughness, IOR=1.5)
    for coat in (0.5, 1.0):
        yield principled(f"Coat {coat}", Base_Color=(0.1, 0.1, 0.5), Roughness=0.6, Coat_Weight=coat, Coat_Roughness=0.05)
    for sheen in (0.5, 1.0):
        yield principled(f"Sheen {sheen}", Base_Color=(0.2, 0.1, 0.25), Roughness=0.9, Sheen_Weight=sheen)
    yield principled("Half metal", Base_Color=sand, Metallic=0.5, Roughness=0.3)
    yield principled("Matte", Base_Color=sand, Roughness=0.8, Specular_IOR_Level=0.0)
    yield principled("Glow", Base_Color=teal, Emission_Color=(0.2, 1.0, 0.6), Emission_Strength=0.5)
    yield principled("Alpha", Base_Color=(0.8, 0.3, 0.6), Alpha=0.4)
    yield principled("Anisotropic", Base_Color=sand, Metallic=1.0, Roughness=0.35, Anisotropic=0.8)


def main():
    scene = blocks.begin()
    floor = blocks.simple("Floor", "ShaderNodeBsdfDiffuse", Color=(0.4, 0.4, 0.4))
    blocks.place(scene, blocks.quad("Floor", [(-30, -30, 0), (30, -30, 0), (30, 30, 0), (-30, 30, 0)]), floor)
    shape = ball()
    for index, kind in enumerate(materials()):
        column, row = index % 7, index // 7
        made = blocks.place(scene, shape.copy(), None, (column - 3.0, row - 2.0, 0.42), name=kind.name)
        made.data.materials.clear()
        made.data.materials.append(kind)
    blocks.light(scene, "AREA", "Key", 160.0, (-3, -3, 5), (0, 0, 0), shape="SQUARE", size=2.0)
    blocks.world(scene, (0.5, 0.6, 0.8), 0.5)
    blocks.camera(scene, (0, -8.6, 7.4), (0, -0.35, 0.2), 45.0)
    blocks.finish(scene, 448, 320)


main()
