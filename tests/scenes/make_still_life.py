# SPDX-License-Identifier: GPL-3.0-or-later
"""The README's and the quickstart's picture: a still life of ordinary materials.

Metals, glass, clearcoat, glazed and matte surfaces by the Principled BSDF, an image texture with UVs, a softly lit
environment image with windows in it, two area lights, a lens out of focus before and behind. About 60,000 triangles.
"""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks


def hashed(*values):
    """Returns a repeatable number in 0..1 from integers."""
    state = 2166136261
    for value in values:
        state = ((state ^ (value & 0xFFFFFFFF)) * 16777619) & 0xFFFFFFFF
        state ^= state >> 15
    return ((state * 2654435761) & 0xFFFFFFFF) / 2**32


def noise(x, y, cells):
    """Returns smooth value noise in 0..1 with `cells` cells to the unit square."""
    x, y = x * cells, y * cells
    column, row = math.floor(x), math.floor(y)
    fx, fy = x - column, y - row
    fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
    corner = [[hashed(column + i, row + j, cells) for i in (0, 1)] for j in (0, 1)]
    low, high = (side[0] + (side[1] - side[0]) * fx for side in corner)
    return low + (high - low) * fy


def marble_tile(u, v):
    """Two by two tiles of cream and green marble with a thin joint (sRGB)."""
    column, row = int(u * 2), int(v * 2)
    inside_u, inside_v = u * 2 - column, v * 2 - row
    joint = 0.012
    if min(inside_u, inside_v, 1 - inside_u, 1 - inside_v) < joint:
        return (0.32, 0.30, 0.27)
    cloud = sum(noise(u + 0.31 * k, v, 4 << k) / 2**k for k in range(4)) / 1.875
    vein = math.exp(-((math.sin(9 * u + 7 * v + 9 * cloud) / 0.10) ** 2))
    if (column + row) % 2:
        base, line = (0.10, 0.24, 0.20), (0.42, 0.55, 0.48)
    else:
        base, line = (0.86, 0.82, 0.74), (0.62, 0.55, 0.46)
    shade = 0.86 + 0.28 * (cloud - 0.5)
    return tuple(min(1.0, (b * (1 - 0.6 * vein) + l * 0.6 * vein) * shade) for b, l in zip(base, line))


def studio(u, v):
    """A dim room with a tall window, a strip light and a warm floor (scene-linear radiance)."""
    height = v - 0.5  # 0 at the horizon, 0.5 at the zenith
    color = [0.10 + 0.16 * max(height, 0), 0.11 + 0.20 * max(height, 0), 0.14 + 0.28 * max(height, 0)]
    if height < 0:
        color = [0.09, 0.075, 0.06]

    def soft_box(centre_u, centre_v, half_u, half_v, edge):
        across = min(max((half_u - abs(u - centre_u)) / edge, 0), 1)
        along = min(max((half_v - abs(v - centre_v)) / edge, 0), 1)
        return across * along

    window = soft_box(0.30, 0.66, 0.055, 0.11, 0.01)
    bar = soft_box(0.30, 0.66, 0.003, 0.12, 0.002) + soft_box(0.30, 0.67, 0.06, 0.004, 0.003)
    window *= 1 - min(bar, 1)
    strip = soft_box(0.80, 0.72, 0.10, 0.018, 0.012)
    return tuple(c + 5.5 * window * w + 2.5 * strip * s for c, w, s in zip(color, (1.0, 0.97, 0.9), (1.0, 0.72, 0.45)))


def textured_floor():
    """The table: marble tiles under a glossy polish, through an image texture and a mapping of the UVs."""
    made, nodes, links, output = blocks.material("Marble table")
    shader = nodes.new("ShaderNodeBsdfPrincipled")
    blocks.set_inputs(shader, {"Roughness": 0.18, "Specular_IOR_Level": 0.5})
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = blocks.image("marble", 512, 512, marble_tile)
    mapping = nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = (0, 0, math.radians(28))
    coordinates = nodes.new("ShaderNodeTexCoord")
    links.new(coordinates.outputs["UV"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    links.new(shader.outputs[0], output.inputs["Surface"])
    return made


def goblet():
    """A wine glass as one closed surface: the outside up, the inside down. Stands 4 mm over the table, so that no glass
    lies in the plane of the marble."""
    outside = blocks.curve_through(
        [(0.34, 0.012), (0.20, 0.035), (0.055, 0.09), (0.036, 0.25), (0.036, 0.42), (0.07, 0.52), (0.24, 0.66)]
        + [(0.325, 0.86), (0.315, 1.06), (0.285, 1.20)]
    )
    inside = blocks.curve_through(
        [(0.275, 1.20), (0.303, 1.06), (0.312, 0.86), (0.225, 0.68), (0.09, 0.575), (0.0, 0.555)]
    )
    return blocks.lathe("Goblet", [(0.0, 0.0), (0.33, 0.0), *outside, (0.28, 1.205), *inside], segments=128)


def vase():
    """A gold vase: open, with a rim, and a dark inside."""
    outside = blocks.curve_through(
        [(0.30, 0.0), (0.40, 0.12), (0.52, 0.42), (0.44, 0.78), (0.22, 1.08), (0.185, 1.28), (0.26, 1.46), (0.29, 1.50)]
    )
    inside = blocks.curve_through([(0.265, 1.49), (0.165, 1.28), (0.20, 1.06), (0.40, 0.76), (0.46, 0.42), (0.0, 0.06)])
    return blocks.lathe("Vase", [(0.0, 0.0), *outside, *inside], segments=128)


def apple():
    """An apple: a sphere that sinks in at both poles."""
    profile = blocks.curve_through(
        [(0.0, 0.055), (0.05, 0.035), (0.13, 0.0), (0.245, 0.10), (0.325, 0.30), (0.30, 0.48), (0.20, 0.575)]
        + [(0.10, 0.575), (0.03, 0.52), (0.0, 0.49)]
    )
    return blocks.lathe("Apple", profile, segments=96)


def bowl():
    """A glazed bowl with a foot."""
    outside = blocks.curve_through([(0.24, 0.0), (0.24, 0.06), (0.42, 0.16), (0.60, 0.36), (0.66, 0.52)])
    inside = blocks.curve_through([(0.635, 0.53), (0.575, 0.37), (0.40, 0.20), (0.18, 0.12), (0.0, 0.11)])
    return blocks.lathe("Bowl", [(0.0, 0.0), *outside, *inside], segments=128)


def main():
    scene = blocks.begin()
    blocks.place(scene, blocks.quad("Table", [(-8, -5, 0), (8, -5, 0), (8, 11, 0), (-8, 11, 0)], 6.0), textured_floor())
    wall = blocks.simple("Wall", "ShaderNodeBsdfDiffuse", Color=(0.34, 0.27, 0.21), Roughness=0.5)
    blocks.place(scene, blocks.quad("Wall", [(-14, 6.5, 0), (14, 6.5, 0), (14, 6.5, 10), (-14, 6.5, 10)]), wall)

    gold = blocks.principled("Gold", Base_Color=(1.0, 0.61, 0.16), Metallic=1.0, Roughness=0.18)
    copper = blocks.principled("Brushed copper", Base_Color=(0.95, 0.50, 0.35), Metallic=1.0, Roughness=0.38)
    steel = blocks.principled("Steel", Base_Color=(0.82, 0.83, 0.85), Metallic=1.0, Roughness=0.04)
    lacquer = blocks.principled(
        "Red lacquer", Base_Color=(0.55, 0.012, 0.015), Roughness=0.45, Coat_Weight=1.0, Coat_Roughness=0.03
    )
    green = blocks.principled(
        "Green lacquer", Base_Color=(0.22, 0.42, 0.03), Roughness=0.5, Coat_Weight=0.7, Coat_Roughness=0.05
    )
    glaze = blocks.principled("Blue glaze", Base_Color=(0.015, 0.07, 0.32), Roughness=0.07, Coat_Weight=0.4)
    stem = blocks.principled("Stem", Base_Color=(0.10, 0.045, 0.015), Roughness=0.7)
    clay = blocks.principled("Terracotta", Base_Color=(0.50, 0.16, 0.065), Roughness=0.85)
    glass = blocks.simple("Glass", "ShaderNodeBsdfGlass", Color=(1.0, 1.0, 1.0), Roughness=0.0, IOR=1.5)
    tinted = blocks.simple("Amber glass", "ShaderNodeBsdfGlass", Color=(1.0, 0.62, 0.18), Roughness=0.05, IOR=1.52)

    blocks.place(scene, vase(), gold, (-0.92, 0.75, 0.0))
    blocks.place(scene, bowl(), glaze, (0.38, 0.42, 0.0))
    blocks.place(scene, goblet(), glass, (1.32, -0.30, 0.004), scale=(1.08, 1.08, 1.08))
    fruit, twig = apple(), blocks.lathe("Stem", [(0.0, 0.0), (0.014, 0.0), (0.011, 0.16), (0.018, 0.2), (0.0, 0.2)], 16)
    for location, rotation, kind in (
        ((-0.30, -0.62, 0.0), (0, 0, 0), lacquer),
        ((0.26, 0.30, 0.30), (16, 8, 40), lacquer),
        ((0.58, 0.58, 0.27), (-22, 20, 0), green),
    ):
        body = blocks.place(scene, fruit.copy(), None, location, rotation, name="Apple")
        body.data.materials.clear()
        body.data.materials.append(kind)
        top = blocks.place(scene, twig, stem, (0.012, 0.0, 0.47), (0, 12, 0), name="Stem")
        top.parent = body
    blocks.place(scene, blocks.sphere("Steel ball", 0.27), steel, (0.50, -1.02, 0.27))
    blocks.place(scene, blocks.sphere("Copper ball", 0.19), copper, (-1.12, -0.66, 0.19))
    blocks.place(scene, blocks.sphere("Amber ball", 0.15), tinted, (0.98, -1.22, 0.15))
    blocks.place(scene, blocks.lathe("Pot", [(0, 0), (0.42, 0), (0.56, 0.8), (0.6, 0.8), (0.6, 0.95), (0.52, 0.95), (0.4, 0.1), (0, 0.1)], 96, smooth=False), clay, (-2.35, 2.9, 0.0), scale=(1.2, 1.2, 1.2))  # fmt: skip

    blocks.light(
        scene, "AREA", "Key", 240.0, (-3.4, -2.0, 4.2), (0, 0, 0.4), (1.0, 0.93, 0.84), shape="RECTANGLE", size=1.8, size_y=1.2
    )
    blocks.light(scene, "AREA", "Rim", 90.0, (3.6, 3.4, 2.8), (0, 0, 0.5), (0.62, 0.78, 1.0), shape="DISK", size=1.4)
    blocks.world(scene, strength=0.8, image=blocks.image("studio", 256, 128, studio, is_float=True))
    blocks.camera(scene, (0.55, -6.4, 2.35), (0.12, 0.0, 0.52), 62.0, fstop=1.1, focus=(-0.1, -0.6, 0.35), blades=7)
    blocks.finish(scene, 960, 600, samples=64, exposure=0.35, view_transform="Filmic")


main()
