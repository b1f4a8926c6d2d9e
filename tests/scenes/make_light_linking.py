# SPDX-License-Identifier: GPL-3.0-or-later
"""Light and shadow linking (Blender 4.0 and later), in lanes between walls: lamps and an emissive mesh that reach some objects
only or all but some, and whose shadows some objects throw, or all but some; a mirror that shows the lights."""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks
import bpy


def collection(name, included=(), excluded=(), nested=()):
    """Returns a collection for linking; nested: names of objects that are included through a collection within it."""
    made = bpy.data.collections.new(name)
    for thing in (*included, *excluded):
        made.objects.link(thing)
    for thing, state in zip(made.objects, made.collection_objects):
        state.light_linking.link_state = "EXCLUDE" if thing in excluded else "INCLUDE"
    if nested:
        child = bpy.data.collections.new(f"{name}, nested")
        for thing in nested:
            child.objects.link(thing)
        made.children.link(child)
    return made


def main():
    scene = blocks.begin()
    grey = blocks.simple("Grey", "ShaderNodeBsdfDiffuse", Color=(0.7, 0.7, 0.7))
    glossy = blocks.metal("Glossy", (0.8, 0.8, 0.8), 0.25)
    mirror = blocks.metal("Mirror", (0.8, 0.85, 0.9), 0.0)
    floor = blocks.place(scene, blocks.quad("Floor", [(-7, -7, 0), (7, -7, 0), (7, 7, 0), (-7, 7, 0)]), grey)
    blocks.place(scene, blocks.quad("Mirror", [(-4, 2, 0), (4, 2, 0), (4, 2, 2), (-4, 2, 2)]), mirror)
    ball, shiny = blocks.sphere("Ball", 0.3, 48, 24), blocks.sphere("Glossy ball", 0.3, 48, 24)
    shiny.materials.append(glossy)
    wall = blocks.box("Wall", (0.06, 3.0, 1.6))
    for column in range(5):
        blocks.place(scene, wall, grey, (2.0 * column - 4.0, 0.5, 0.8))
    lanes = [-3.0, -1.0, 1.0, 3.0]
    front = [blocks.place(scene, ball, grey, (x, -0.3, 0.3), name=f"Front {x:+.0f}") for x in lanes]
    behind = [blocks.place(scene, shiny, None, (x + 0.2, 0.7, 0.3), name=f"Behind {x:+.0f}") for x in lanes]
    tiles = [blocks.place(scene, blocks.box("Tile", (0.7, 0.5, 0.04)), grey, (x - 0.3, 0.5, 0.9), (15, 20, 0), name=f"Tile {x:+.0f}") for x in lanes]

    # Receivers: an area lamp that reaches one ball through a nested collection and a tile, a ball of light that does not reach
    # the floor.
    def lamp(kind, name, energy, location, color, **properties):
        blocks.light(scene, kind, name, energy, location, (location[0], location[1] + 0.4, 0), color, **properties)
        return bpy.data.objects[name].light_linking

    linked = lamp("AREA", "Area of some", 60.0, (-3.0, -0.2, 1.8), (1.0, 0.6, 0.3), shape="SQUARE", size=0.6)
    linked.receiver_collection = collection("Some", included=[tiles[0]], nested=[behind[0]])
    linked = lamp("POINT", "Ball of all but the floor", 40.0, (-1.0, 0.0, 1.6), (0.4, 0.7, 1.0), shadow_soft_size=0.2)
    linked.receiver_collection = collection("All but the floor", excluded=[floor])
    # Blockers: an area lamp and an emissive mesh that some objects let through, a point that one object alone blocks.
    linked = lamp("AREA", "Area through a tile", 30.0, (1.0, 0.2, 1.8), (1.0, 0.9, 0.5), shape="DISK", size=0.7)
    linked.blocker_collection = collection("All but a tile", excluded=[tiles[2]])
    linked = lamp("POINT", "Point that a tile blocks", 20.0, (1.0, -0.4, 2.2), (0.4, 1.0, 0.5), shadow_soft_size=0.0)
    linked.blocker_collection = collection("A tile", included=[tiles[2]])
    glow = blocks.emission("Glow", (0.9, 0.5, 1.0), 15.0)
    box = blocks.place(scene, blocks.box("Glowing box", (0.5, 0.25, 0.15)), glow, (3.1, 0.2, 1.5), (20, 30, 0))
    box.light_linking.receiver_collection = collection("All but a ball", excluded=[front[3]])
    box.light_linking.blocker_collection = collection("All but another tile", excluded=[tiles[3], behind[3]])
    linked = lamp("SUN", "Sun through walls", 0.4, (0, 0, 5), (1.0, 0.9, 0.7), angle=math.radians(6))
    linked.blocker_collection = collection("All but walls", excluded=[thing for thing in scene.objects if thing.name.startswith("Wall")])
    bpy.data.objects["Sun through walls"].rotation_euler = (math.radians(10), math.radians(50), 0)
    blocks.world(scene, (0.03, 0.04, 0.06))
    blocks.camera(scene, (0, -7.0, 5.5), (0, 0.2, 0.4), 40.0)
    blocks.finish(scene, 320, 200)


main()
