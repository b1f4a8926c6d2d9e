# SPDX-License-Identifier: GPL-3.0-or-later
"""Four balls on a floor under the Sky Texture that a new node has, its low sun with it: most light comes from a disc of half a
degree in a sky of many colours."""

import pathlib
import sys


sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks

k_looks = (
    {"Base_Color": (0.8, 0.1, 0.1), "Roughness": 1.0},
    {"Base_Color": (0.9, 0.7, 0.3), "Metallic": 1.0, "Roughness": 0.6},
    {"Base_Color": (0.1, 0.2, 0.6), "Roughness": 0.8},
    {"Base_Color": (0.1, 0.5, 0.2), "Roughness": 0.5},
)


def main():
    scene = blocks.begin()
    grey = blocks.simple("Grey", "ShaderNodeBsdfDiffuse", Color=(0.5, 0.45, 0.4))
    blocks.place(scene, blocks.quad("Floor", [(-30, -30, 0), (30, -30, 0), (30, 30, 0), (-30, 30, 0)]), grey)
    for index, look in enumerate(k_looks):
        ball = blocks.sphere(f"Ball {index}", 0.8)
        blocks.place(scene, ball, blocks.principled(f"Look {index}", **look), (1.75 * index - 2.6, 0, 0.8))
    blocks.world(scene, (1.0, 1.0, 1.0), 0.15)
    tree = scene.world.node_tree
    background = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBackground")
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sun_elevation, sky.sun_rotation = 0.35, 2.2
    tree.links.new(sky.outputs[0], background.inputs["Color"])
    blocks.camera(scene, (0, -11, 3.5), (0, 0, 0.6), 40.0)
    blocks.finish(scene, 480, 225)


main()
