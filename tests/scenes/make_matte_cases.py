# SPDX-License-Identifier: GPL-3.0-or-later
"""Cases of mattes, masks, shadows and layers, by the name that follows the file's: a diffuse, a glossy and a glass ball and an upright card on a
floor, of which each case hides, overrides or catches something.

    blender -b --factory-startup --python tests/scenes/make_matte_cases.py -- out.blend CASE
"""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks
import bpy


def part_diffuse(name, other, share):
    """A material of which `share` is a shader node of type `other` and the rest diffuse."""
    made, nodes, links, output = blocks.material(name)
    mix, diffuse = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (0.7, 0.5, 0.2, 1.0)
    mix.inputs[0].default_value = share
    links.new(diffuse.outputs[0], mix.inputs[1])
    links.new(nodes.new(other).outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], output.inputs["Surface"])
    return made


def into_collection(scene, name, placed):
    """Moves objects of the scene to a collection of their own."""
    collection = bpy.data.collections.new(name)
    scene.collection.children.link(collection)
    for thing in placed:
        scene.collection.objects.unlink(thing)
        collection.objects.link(thing)


def transparent_glass(scene, things):
    scene.render.film_transparent = True
    scene.cycles.film_transparent_glass, scene.cycles.film_transparent_roughness = True, 0.1
    clear = blocks.simple("Clear", "ShaderNodeBsdfGlass", Color=(0.8, 1.0, 0.9), Roughness=0.0, IOR=1.3)
    frosted = blocks.simple("Frosted", "ShaderNodeBsdfGlass", Color=(1.0, 0.8, 0.7), Roughness=0.3, IOR=1.3)
    blocks.place(scene, blocks.sphere("Clear", 0.45), clear, (-0.7, -0.2, 1.7))
    blocks.place(scene, blocks.sphere("Frosted", 0.45), frosted, (0.7, -0.2, 1.7))


def holdout_shader(scene, things):
    scene.render.film_transparent = True
    things["Diffuse"].active_material = part_diffuse("Half", "ShaderNodeHoldout", 0.5)
    things["Card"].active_material = part_diffuse("Whole", "ShaderNodeHoldout", 1.0)


def holdout_shader_opaque(scene, things):
    holdout_shader(scene, things)
    scene.render.film_transparent = False


def holdout_objects(scene, things):
    scene.render.film_transparent = True
    things["Glossy"].is_holdout = True
    into_collection(scene, "Hole", [things["Card"]])
    bpy.context.view_layer.layer_collection.children["Hole"].holdout = True


def indirect_only(scene, things):
    into_collection(scene, "Unseen", [things["Card"], things["Glossy"]])
    bpy.context.view_layer.layer_collection.children["Unseen"].indirect_only = True


def ray_kinds(scene, things):
    """Each object is hidden from another kind of ray."""
    for name, kind in (("Card", "diffuse"), ("Diffuse", "glossy"), ("Glossy", "transmission"), ("Glass", "shadow"), ("Sign", "camera")):
        setattr(things[name], f"visible_{kind}", False)


def opaque_shadows(scene, things):
    """Half transparent to the camera, and a whole shadow, of a lamp that no ray meets: lights that rays meet behind it are found by those
    alone, with half a weight each engine of its own."""
    lamp = bpy.data.lights["Lamp"]
    lamp.type = "POINT"
    lamp.shadow_soft_size = 0.0
    blocks.world(scene, (0.0, 0.0, 0.0))
    things["Sign"].hide_render = True
    made = part_diffuse("Veil", "ShaderNodeBsdfTransparent", 0.5)
    (made if hasattr(made, "use_transparent_shadow") else made.cycles).use_transparent_shadow = False
    things["Card"].active_material = made
    things["Diffuse"].active_material = made


def layers(scene, things):
    """A second layer with a material for all, half the samples and, from 4.x on where there is one, a world of its own; a third
    without surfaces and sky; a fourth with a holdout alone; a fifth with nothing."""
    scene.cycles.use_layer_samples = "USE"
    second = scene.view_layers.new("Override")
    second.material_override = blocks.diffuse("Clay", (0.6, 0.55, 0.5))
    second.samples = scene.cycles.samples // 2
    if hasattr(second, "world_override"):
        shown, second.world_override = scene.world, blocks.world(scene, (0.6, 0.2, 0.1))
        scene.world = shown
    bare = scene.view_layers.new("Bare")
    bare.use_solid = bare.use_sky = False
    into_collection(scene, "All", [thing for thing in things.values() if thing.name != "Floor"])
    into_collection(scene, "Ground", [things["Floor"]])
    holes = scene.view_layers.new("Holes")
    holes.layer_collection.children["All"].holdout = True
    holes.layer_collection.children["Ground"].exclude = True
    nothing = scene.view_layers.new("Nothing")
    for child in nothing.layer_collection.children:
        child.exclude = True
    scene.render.film_transparent = True


def catch(scene, things):
    """The floor catches shadows. Without the sign: Cycles counts what objects that emit shine on catchers as brought by them, so that
    the pass is above 1, and Lambent as lights."""
    scene.render.film_transparent = True
    bpy.data.objects.remove(things.pop("Sign"))
    things["Floor"].is_shadow_catcher = True
    bpy.context.view_layer.cycles.use_pass_shadow_catcher = True


def catcher_area(scene, things):
    catch(scene, things)
    blocks.world(scene)


def catcher_environment(scene, things):
    """A bright patch of sky and no lamp."""
    catch(scene, things)
    for light in [thing for thing in scene.objects if thing.type == "LIGHT"]:
        bpy.data.objects.remove(light)
    sky = blocks.image("Sky", 64, 32, lambda u, v: (8.0, 6.0, 4.0) if (u - 0.3) ** 2 + (v - 0.8) ** 2 < 0.004 else (0.2, 0.25, 0.3), is_float=True)
    blocks.world(scene, image=sky)


def catcher_caustic(scene, things):
    """A sun whose light a mirror throws on the floor."""
    catcher_area(scene, things)
    for light in [thing for thing in scene.objects if thing.type == "LIGHT"]:
        bpy.data.objects.remove(light)
    blocks.light(scene, "SUN", "Sun", 3.0, (-2, -3, 4), (0, 0, 0), angle=math.radians(20.0))
    things["Card"].active_material = blocks.metal("Mirror", (0.9, 0.9, 0.9), 0.3)


k_cases = {
    one.__name__: one
    for one in (
        transparent_glass, holdout_shader, holdout_shader_opaque, holdout_objects, indirect_only, ray_kinds, opaque_shadows, layers,
        catcher_area, catcher_environment, catcher_caustic,
    )
}  # fmt: skip


def main():
    scene = blocks.begin()
    grey = blocks.diffuse("Grey", (0.6, 0.6, 0.6))
    ball = lambda: blocks.sphere("Ball", 0.5, 48, 24)
    things = {
        "Floor": blocks.place(scene, blocks.quad("Floor", [(-3, -2, 0), (3, -2, 0), (3, 2, 0), (-3, 2, 0)]), grey, name="Floor"),
        "Diffuse": blocks.place(scene, ball(), blocks.diffuse("Red", (0.8, 0.2, 0.15)), (-1.5, 0, 0.5), name="Diffuse"),
        "Glossy": blocks.place(scene, ball(), blocks.metal("Glossy", (0.8, 0.75, 0.6), 0.35), (-0.3, 0.2, 0.5), name="Glossy"),
        "Glass": blocks.place(
            scene, ball(), blocks.simple("Glass", "ShaderNodeBsdfGlass", Color=(1, 1, 1), Roughness=0.35, IOR=1.2), (0.9, 0, 0.5), name="Glass"
        ),
        "Card": blocks.place(
            scene, blocks.quad("Card", [(-0.6, 0, 0), (0.6, 0, 0), (0.6, 0, 1.2), (-0.6, 0, 1.2)]), blocks.diffuse("Blue", (0.2, 0.3, 0.8)),
            (1.9, 1.0, 0), (0, 0, -25), name="Card",
        ),
        "Sign": blocks.place(scene, blocks.box("Sign", (0.5, 0.05, 0.3)), blocks.emission("Sign", (1.0, 0.6, 0.3), 5.0), (-0.2, 1.3, 1.2), name="Sign"),
    }  # fmt: skip
    blocks.light(scene, "AREA", "Lamp", 120.0, (-2.0, -2.5, 3.5), (0, 0, 0.3), size=1.2)
    blocks.world(scene, (0.3, 0.35, 0.45))
    blocks.camera(scene, (0.3, -6.0, 2.4), (0, 0, 0.7), 42.0)
    blocks.transport(scene, 4)
    layer = bpy.context.view_layer
    layer.name = "ViewLayer"
    for kind in ("diffuse", "glossy", "transmission"):
        for part in ("direct", "indirect", "color"):
            setattr(layer, f"use_pass_{kind}_{part}", True)
    layer.use_pass_emit = layer.use_pass_environment = True
    k_cases[blocks.arguments()[1]](scene, things)
    blocks.finish(scene, 96, 64)


main()
