# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes of one thing each that makes noise, for tests/perf/noise_against_cycles: what the other scenes do not cover.

    blender -b --factory-startup --python-exit-code 1 --python make_noise_cases.py -- OUT.blend CASE
"""

import math
import pathlib
import random
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks

k_glossy = {"Base_Color": (0.8, 0.5, 0.2), "Metallic": 1.0}


def floor(scene, material=None, size=6.0):
    corners = [(-size, -size, 0), (size, -size, 0), (size, size, 0), (-size, size, 0)]
    material = material or blocks.simple("Floor", "ShaderNodeBsdfDiffuse", Color=(0.6, 0.6, 0.6))
    blocks.place(scene, blocks.quad("Floor", corners), material)


def balls(scene, looks, kind="ShaderNodeBsdfPrincipled"):
    """A row of balls on the floor, one a look."""
    for index, look in enumerate(looks):
        x = 1.3 * (index - 0.5 * (len(looks) - 1))
        blocks.place(scene, blocks.sphere(f"Ball {index}", 0.6), blocks.simple(f"Look {index}", kind, **look), (x, 0, 0.6))


def row_of_materials(scene):
    """Matte, glossy and coated balls on a floor."""
    floor(scene)
    balls(scene, (
        {"Base_Color": (0.7, 0.2, 0.2), "Roughness": 0.9},
        {"Base_Color": (0.2, 0.5, 0.3), "Roughness": 0.3},
        {**k_glossy, "Roughness": 0.5},
        {**k_glossy, "Roughness": 0.15},
    ))  # fmt: skip


def room(scene, albedo=0.7):
    """A room of 6 by 6 by 3 metres, seen from inside; open towards the camera."""
    wall = blocks.diffuse("Wall", (albedo, albedo, albedo))
    floor(scene, wall, 3.0)
    blocks.place(scene, blocks.quad("Ceiling", [(-3, -3, 3), (-3, 3, 3), (3, 3, 3), (3, -3, 3)]), wall)
    blocks.place(scene, blocks.quad("Back", [(-3, 3, 0), (3, 3, 0), (3, 3, 3), (-3, 3, 3)]), wall)
    blocks.place(scene, blocks.quad("Left", [(-3, -3, 0), (-3, 3, 0), (-3, 3, 3), (-3, -3, 3)]), wall)
    blocks.place(scene, blocks.quad("Right", [(3, -3, 0), (3, -3, 3), (3, 3, 3), (3, 3, 0)]), wall)


def key_light(scene, size=1.0):
    blocks.light(scene, "AREA", "Key", 150.0, (2, -3, 4), (0, 0, 0.5), size=size)


def sun_sky(scene):
    row_of_materials(scene)
    blocks.light(scene, "SUN", "Sun", 3.0, (0, 0, 5), (2, 3, 0), (1.0, 0.9, 0.7), angle=math.radians(0.53))
    blocks.world(scene, (0.4, 0.6, 1.0), 0.6)


def sky_with_sun_map(scene):
    row_of_materials(scene)

    def pixel(u, v):
        sun = (u - 0.3) ** 2 + (v - 0.8) ** 2 < 0.00004
        return (3000.0, 2700.0, 2000.0) if sun else (0.3 + 0.3 * v, 0.5, 0.9 - 0.4 * v)

    blocks.world(scene, image=blocks.image("Sky", 256, 128, pixel, True))


def even_sky_glossy(scene):
    floor(scene, blocks.principled("Floor", Base_Color=(0.5, 0.5, 0.5), Roughness=0.3))
    balls(scene, [{**k_glossy, "Roughness": roughness} for roughness in (0.05, 0.2, 0.4, 0.7)])
    blocks.world(scene, (0.7, 0.8, 1.0))


def even_sky_room(scene):
    room(scene)
    balls(scene, ({"Base_Color": (0.7, 0.2, 0.2)}, {**k_glossy, "Roughness": 0.3}))
    blocks.world(scene, (0.7, 0.8, 1.0))


def rough_glass(scene):
    floor(scene)
    balls(scene, [{"Roughness": roughness, "IOR": 1.45} for roughness in (0.1, 0.3, 0.6)], "ShaderNodeBsdfGlass")
    key_light(scene)
    blocks.world(scene, (0.1, 0.1, 0.12))


def coats(scene):
    floor(scene)
    balls(scene, [
        {"Base_Color": (0.05, 0.1, 0.4), "Coat_Weight": 1.0, "Coat_Roughness": 0.03, "Roughness": 0.5},
        {**k_glossy, "Coat_Weight": 1.0, "Coat_Roughness": 0.2, "Roughness": 0.4},
        {"Base_Color": (0.6, 0.05, 0.05), "Coat_Weight": 0.5, "Coat_Roughness": 0.1, "Roughness": 0.2},
    ])  # fmt: skip
    key_light(scene)
    blocks.world(scene, (0.2, 0.22, 0.3))


def sheen(scene):
    floor(scene)
    balls(scene, [
        {"Base_Color": (0.1, 0.02, 0.02), "Sheen_Weight": 1.0, "Roughness": 0.9},
        {"Base_Color": (0.4, 0.3, 0.2), "Sheen_Weight": 0.5, "Roughness": 0.5},
    ])  # fmt: skip
    velvet = blocks.simple("Velvet", "ShaderNodeBsdfVelvet", Color=(0.3, 0.1, 0.5), Sigma=0.4)
    blocks.place(scene, blocks.sphere("Velvet", 0.6), velvet, (0, -1.3, 0.6))
    key_light(scene)


def leaves(scene):
    """Many leaves cut out by an image's alpha, lit through each other by a sun and a sky."""
    floor(scene, size=10.0)
    leaf, nodes, links, output = blocks.material("Leaf")

    def pixel(u, v):
        inside = ((u - 0.5) / 0.35) ** 2 + ((v - 0.5) / 0.48) ** 2 < 1.0
        return (1.0, 1.0, 1.0) if inside else (0.0, 0.0, 0.0)

    texture, mix, clear, both = (nodes.new(f"Shader{kind}") for kind in ("NodeTexImage", "NodeMixShader", "NodeBsdfTransparent", "NodeMixShader"))
    front, back = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeBsdfTranslucent")
    front.inputs["Color"].default_value, back.inputs["Color"].default_value = (0.1, 0.35, 0.05, 1), (0.25, 0.5, 0.05, 1)
    texture.image = blocks.image("Leaf", 64, 64, pixel)
    links.new(front.outputs[0], both.inputs[1])
    links.new(back.outputs[0], both.inputs[2])
    links.new(texture.outputs["Color"], mix.inputs[0])
    links.new(clear.outputs[0], mix.inputs[1])
    links.new(both.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], output.inputs["Surface"])
    card = blocks.quad("Leaf", [(-0.25, -0.25, 0), (0.25, -0.25, 0), (0.25, 0.25, 0), (-0.25, 0.25, 0)])
    numbers = random.Random(3)
    for _ in range(400):
        place = (numbers.gauss(0, 0.7), numbers.gauss(0, 0.7), 1.2 + numbers.gauss(0, 0.45))
        blocks.place(scene, card, leaf, place, [numbers.uniform(0, 360) for _ in range(3)])
    blocks.light(scene, "SUN", "Sun", 3.0, (0, 0, 5), (2, 3, 0), (1.0, 0.9, 0.7), angle=math.radians(0.53))
    blocks.world(scene, (0.4, 0.6, 1.0), 0.5)


def lens(scene):
    row_of_materials(scene)
    for index in range(6):
        glow = blocks.emission(f"Glow {index}", (1.0, 0.7, 0.3), 300.0)
        blocks.place(scene, blocks.sphere(f"Bulb {index}", 0.03, 16, 8), glow, (index - 2.5, 3.0, 0.5 + 0.2 * index))
    key_light(scene)


def big_lamp_near(scene):
    row_of_materials(scene)
    blocks.light(scene, "AREA", "Panel", 60.0, (0, 0.5, 1.5), (0, 0.5, 0), shape="RECTANGLE", size=5.0, size_y=2.0)
    blocks.light(scene, "AREA", "Low", 10.0, (-1.0, -1.2, 0.15), (0, -1.2, 0.1), shape="DISK", size=0.8)


def sphere_lamps(scene):
    row_of_materials(scene)
    for index, radius in enumerate((0.02, 0.1, 0.3)):
        blocks.light(scene, "POINT", f"Ball {index}", 30.0, (2.0 * index - 2.0, -1.0, 1.6), shadow_soft_size=radius)


def spots(scene):
    row_of_materials(scene)
    for index, (size, blend, radius) in enumerate(((20, 0.0, 0.0), (45, 1.0, 0.1), (120, 0.3, 0.3))):
        properties = {"spot_size": math.radians(size), "spot_blend": blend, "shadow_soft_size": radius}
        blocks.light(scene, "SPOT", f"Spot {index}", 150.0, (2.0 * index - 2.0, -2.0, 2.5), (index - 1.0, 0, 0), **properties)


def screens(scene):
    """Meshes that shine by textures: a screen with a small bright part, and a finely divided ball."""
    row_of_materials(scene)

    def pixel(u, v):
        return (1.0, 0.9, 0.6) if (u - 0.7) ** 2 + (v - 0.4) ** 2 < 0.01 else (0.02, 0.03, 0.05)

    made, nodes, links, output = blocks.material("Screen")
    shader, texture = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeTexImage")
    texture.image = blocks.image("Screen", 64, 64, pixel)
    shader.inputs["Strength"].default_value = 40.0
    links.new(texture.outputs["Color"], shader.inputs["Color"])
    links.new(shader.outputs[0], output.inputs["Surface"])
    blocks.place(scene, blocks.quad("Screen", [(-2.5, 2, 0.2), (2.5, 2, 0.2), (2.5, 2, 2.4), (-2.5, 2, 2.4)]), made)
    blocks.place(scene, blocks.sphere("Lantern", 0.25, 48, 24), blocks.emission("Lantern", (0.4, 0.7, 1.0), 8.0), (-1.5, -1.2, 0.3))


def many_lamps(scene):
    """Sixty lamps of powers a thousand apart in a room with walls between them."""
    room(scene, 0.6)
    numbers = random.Random(5)
    grey = blocks.diffuse("Grey", (0.5, 0.5, 0.5))
    for index in range(3):
        blocks.place(scene, blocks.box(f"Wall {index}", (0.05, 4.0, 2.0)), grey, (1.5 * index - 1.5, 1.0, 1.0))
    for index in range(60):
        place = [numbers.uniform(-2.8, 2.8), numbers.uniform(-2.5, 2.8), numbers.uniform(0.2, 2.8)]
        kind = ("POINT", "SPOT", "AREA")[index % 3]
        properties = {"size": 0.2} if kind == "AREA" else {"shadow_soft_size": 0.03}
        blocks.light(scene, kind, f"Lamp {index}", 10 ** numbers.uniform(-1.5, 1.3), place, (0, 0, 0), **properties)


def close_lamps(scene):
    """Lamps a few centimetres from a wall."""
    room(scene)
    for index in range(5):
        blocks.light(scene, "POINT", f"Near {index}", 2.0, (index - 2.0, 2.9, 1.0 + 0.2 * index), shadow_soft_size=0.02)
    blocks.light(scene, "AREA", "Up", 20.0, (0, 0, 2.9), (0, 0, 4), size=1.0)


def thin(scene):
    floor(scene)
    grey = blocks.diffuse("Grey", (0.6, 0.4, 0.3))
    for index in range(60):
        x = 0.08 * (index - 30)
        blocks.place(scene, blocks.tube(f"Wire {index}", [(x, 0.2 * math.sin(index), 0), (x, 0, 2)], [0.008, 0.008], 8), grey)
    key_light(scene, 0.2)
    blocks.world(scene, (0.3, 0.4, 0.5))


def white_room(scene):
    room(scene, 0.9)
    balls(scene, ({"Base_Color": (0.9, 0.9, 0.9)}, {**k_glossy, "Roughness": 0.3}))
    blocks.light(scene, "AREA", "Window", 40.0, (-2.9, 0, 1.5), (0, 0, 1.5), size=0.8)


k_cases = {
    case.__name__: case
    for case in (
        sun_sky, sky_with_sun_map, even_sky_glossy, even_sky_room, rough_glass, coats, sheen, leaves, lens, big_lamp_near,
        sphere_lamps, spots, screens, many_lamps, close_lamps, thin, white_room,
    )
}  # fmt: skip


def main():
    name = blocks.arguments()[1]
    scene = blocks.begin()
    k_cases[name](scene)
    if not scene.world:
        blocks.world(scene)
    blocks.camera(scene, (0, -6.5, 1.8), (0, 0, 0.9), 40.0, fstop=0.4 if name == "lens" else None)
    blocks.finish(scene, 320, 180)


main()
