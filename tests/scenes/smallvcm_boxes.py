# SPDX-License-Identifier: GPL-3.0-or-later
"""The four Cornell boxes that SmallVCM renders (Davidovič and Georgiev 2012, scene.hxx), rebuilt with its numbers: a glossy
floor, a mirror and a glass sphere (under the area lamp one large mirror sphere), and one kind of light each. Size and path
length are those of the figures that we compare with: 256 x 256 pixels, at most 10 edges, so 8 bounces.

What differs: spheres are 8,000 smooth triangles and not exact; the floor's Phong lobe of exponent 90 is a GGX one of the same
width; emission is two-sided, though the back of the ceiling lamp is walled in as there."""

import math

import blocks
import mathutils

k_low, k_high = (-1.27029, -1.25549, -1.28002), (1.28975, 1.30455, 1.28002)
k_lamp_radiance = 25.03329895614464
k_sky = (135 / 255, 206 / 255, 250 / 255)


def glossy_floor():
    """Returns 0.1 of diffuse and 0.7 of glossy reflectance added up. A Phong lobe of exponent n is as wide as a Blinn one of
    4n, whose alpha is sqrt(2 / (4n + 2)) (Walter et al. 2007); Blender's roughness is its square root."""
    made, nodes, links, output = blocks.material("Glossy floor")
    matte, glossy, both = (nodes.new(f"Shader{kind}") for kind in ("NodeBsdfDiffuse", "NodeBsdfGlossy", "NodeAddShader"))
    blocks.set_inputs(matte, {"Color": (0.1, 0.1, 0.1)})
    blocks.set_inputs(glossy, {"Color": (0.7, 0.7, 0.7), "Roughness": (2.0 / (4 * 90 + 2)) ** 0.25})
    links.new(matte.outputs[0], both.inputs[0])
    links.new(glossy.outputs[0], both.inputs[1])
    links.new(both.outputs[0], output.inputs["Surface"])
    return made


def spheres(scene, light):
    """Places the balls of the box with that light."""
    mirror, glass = blocks.metal("Mirror", (1.0, 1.0, 1.0), 0.0), blocks.glass("Glass", 1.6)
    middle_y = (k_low[1] + k_high[1]) / 2
    if light == "area":
        middle_x = (k_low[0] + k_high[0]) / 2
        blocks.place(scene, blocks.sphere("Large ball", 0.8), mirror, (middle_x, middle_y, k_low[2] + 0.8))
        return
    inward = 2.0 * (k_high[0] - k_low[0]) / 7.0
    blocks.place(scene, blocks.sphere("Mirror ball", 0.5), mirror, (k_low[0] + inward, middle_y, k_low[2] + 0.5))
    # A touch above the floor, so that no glass lies in its plane.
    blocks.place(scene, blocks.sphere("Glass ball", 0.5), glass, (k_high[0] - inward, middle_y, k_low[2] + 0.5 + 1e-4))


def lights(scene, light, white):
    """Adds the light of that kind, and the box under the ceiling that all but the point-lit scene have."""
    if light != "point":
        low, high, side = 1.26002, 1.28002, 0.25
        corners = [(-side, -side), (side, -side), (side, side), (-side, side)]
        rim = [(*corner, z) for z in (low, high) for corner in corners]
        faces = [(a, (a + 1) % 4, (a + 1) % 4 + 4, a + 4) for a in range(4)]
        blocks.place(scene, blocks.mesh("Light box", rim, faces), white)
        glow = blocks.emission("Lamp", (1.0, 1.0, 1.0), k_lamp_radiance) if light == "area" else white
        blocks.place(scene, blocks.quad("Light box floor", [(*corner, low) for corner in reversed(corners)]), glow)
    if light == "point":  # SmallVCM's intensity is 70 / 4π
        blocks.light(scene, "POINT", "Lamp", 70.0, (0.0, -0.5, 1.0), shadow_soft_size=0.0)
    if light == "sun":  # Irradiance 20 (0.5, 0.2, 0) along (-1, 1.5, -1)
        blocks.light(scene, "SUN", "Sun", 10.0, (2.0, -3.0, 2.0), (1.0, -1.5, 1.0), (1.0, 0.4, 0.0), angle=0.0)
    blocks.world(scene, k_sky if light == "environment" else (0, 0, 0))


def build(light):
    """Makes and saves the box lit by `light`: area, point, sun or environment."""
    scene = blocks.begin()
    white = blocks.diffuse("White", (0.803922, 0.803922, 0.803922))
    kinds = {
        "Floor": glossy_floor(),
        "Back": blocks.diffuse("Blue", (0.156863, 0.172549, 0.803922)),
        "Ceiling": white,
        "Left": blocks.diffuse("Green", (0.156863, 0.803922, 0.172549)),
        "Right": blocks.diffuse("Red", (0.803922, 0.152941, 0.152941)),
    }
    (x0, y0, z0), (x1, y1, z1) = k_low, k_high
    walls = {
        "Floor": [(x0, y0, z0), (x1, y0, z0), (x1, y1, z0), (x0, y1, z0)],
        "Back": [(x0, y1, z0), (x1, y1, z0), (x1, y1, z1), (x0, y1, z1)],
        "Ceiling": [(x0, y1, z1), (x1, y1, z1), (x1, y0, z1), (x0, y0, z1)],
        "Left": [(x0, y0, z0), (x0, y1, z0), (x0, y1, z1), (x0, y0, z1)],
        "Right": [(x1, y1, z0), (x1, y0, z0), (x1, y0, z1), (x1, y1, z1)],
    }
    for name, corners in walls.items():
        blocks.place(scene, blocks.quad(name, corners), kinds[name])
    spheres(scene, light)
    lights(scene, light, white)
    eye = mathutils.Vector((-0.0439815, -4.12529, 0.222539))
    made = blocks.camera(scene, eye, eye + mathutils.Vector((0.00688625, 0.998505, -0.0542161)))
    made.data.angle = math.radians(45.0)
    blocks.transport(scene, 8)
    blocks.finish(scene, 256, 256)
