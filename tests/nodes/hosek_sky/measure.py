# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside Blender 3.4: what Cycles' sky of Hosek and Wilkie is at the parameters and directions that fit.py needs.

    blender -b --factory-startup --python-exit-code 1 --python measure.py -- SKIES.npz

Writes sky float32[sky][theta][phi][3] (linear Rec. 709), parameters float64[sky][3] (turbidity, ground albedo, elevation of the sun in
radians; the sun is in the plane y = 0) and way float32[theta][phi][3]. Each direction is a face of a mesh whose material shows
the sky there, one pixel a face.
"""

import math
import pathlib
import random
import sys

import bpy
import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from faces_in_cycles import Faces

k_knots = 9


def parameters():
    """Whole turbidities with a black and a white ground at Chebyshev's knots of the fits' variable; the middle of neighbours, which
    tells their factors apart; and some by chance to test with."""
    elevations = [math.pi / 2 * (0.5 - 0.5 * math.cos(math.pi * k / (k_knots - 1))) ** 3 for k in range(k_knots)]
    found = [(t, albedo, e) for t in range(1, 11) for albedo in (0.0, 1.0) for e in elevations]
    found += [(t + 0.5, 0.0, e) for t in range(1, 10) for e in elevations]
    found += [(t, 0.5, e) for t in range(1, 11) for e in elevations]
    numbers = random.Random(3)
    found += [(1 + 9 * numbers.random(), numbers.random(), math.pi / 2 * numbers.random() ** 3) for _ in range(24)]
    return found + [(2.2, 0.3, math.radians(15))]


def directions():
    """float32[32][48][3], denser near the horizon and the sun's side."""
    theta = numpy.radians(90.0 * numpy.linspace(0, 1, 32) ** 0.8)
    theta[-1] = math.radians(89.9)
    theta, phi = numpy.meshgrid(theta, math.pi * numpy.linspace(0, 1, 48) ** 1.5, indexing="ij")
    way = (numpy.sin(theta) * numpy.cos(phi), numpy.sin(theta) * numpy.sin(phi), numpy.cos(theta))
    return numpy.stack(way, -1).astype(numpy.float32)


def sky_material():
    """Emission of Hosek and Wilkie's sky in the direction of the attribute "way"."""
    material = bpy.data.materials.new("Sky")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    attribute, sky = nodes.new("ShaderNodeAttribute"), nodes.new("ShaderNodeTexSky")
    emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    attribute.attribute_name, sky.sky_type = "way", "HOSEK_WILKIE"
    links.new(attribute.outputs["Vector"], sky.inputs["Vector"])
    links.new(sky.outputs["Color"], emission.inputs["Color"])
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return material


def main():
    way = directions()
    scene = Faces("way", way.reshape(-1, 3), way.shape[1], sky_material)
    sky = next(node for node in bpy.data.materials["Sky"].node_tree.nodes if node.type == "TEX_SKY")
    skies = []
    for turbidity, albedo, elevation in parameters():
        sky.turbidity, sky.ground_albedo = turbidity, albedo
        sky.sun_direction = (math.cos(elevation), 0, math.sin(elevation))
        skies.append(scene.render().reshape(way.shape))
    numpy.savez(sys.argv[sys.argv.index("--") + 1], sky=numpy.array(skies), parameters=numpy.array(parameters()), way=way)


main()
