# SPDX-License-Identifier: GPL-3.0-or-later
"""Building blocks for the scenes that tests and the README render. Runs inside Blender 3.4 to 5.2.

A scene script calls `begin`, adds objects, and ends with `finish`, which saves a .blend at the path after `--`:

    blender -b --factory-startup --python tests/scenes/make_cornell.py -- out.blend

Lengths are metres, powers Blender's watts, colours scene-linear.
"""

import math
import os
import sys

import bpy
import mathutils

# Principled sockets by their names from Blender 4.0 on -> before.
k_principled_before_4 = {
    "Specular IOR Level": "Specular",
    "Coat Weight": "Clearcoat",
    "Coat Roughness": "Clearcoat Roughness",
    "Transmission Weight": "Transmission",
    "Subsurface Weight": "Subsurface",
    "Sheen Weight": "Sheen",
    "Emission Color": "Emission",
}


def begin():
    """Empties Blender and returns the scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def arguments():
    """Returns what follows `--` on Blender's command line (list of str)."""
    return sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []


def finish(scene, width, height, samples=64, exposure=0.0, view_transform="Standard"):
    """Sets the picture's size (pixels) and sampling for Cycles and Lambent alike, and saves the .blend."""
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = view_transform
    scene.view_settings.exposure = exposure
    if hasattr(scene, "cycles"):
        scene.cycles.samples = samples
    # Only where the add-on is enabled: a scene without its settings renders with the defaults.
    if hasattr(scene, "lambent"):
        scene.lambent.samples = samples
        scene.render.engine = "LAMBENT"
    path = os.path.abspath(arguments()[0])
    os.makedirs(os.path.dirname(path), exist_ok=True)
    for image in bpy.data.images:
        if image.source == "GENERATED" or image.is_dirty:
            image.pack()
    bpy.ops.wm.save_as_mainfile(filepath=path, compress=True)
    print(f"saved {path}")


def transport(scene, bounces):
    """Has both engines follow light for `bounces` bounces of every kind, and leave nothing of it out: no clamping, no
    blurring of glossy surfaces, caustics on. For the scenes that compare integrators."""
    if not hasattr(scene, "cycles"):
        return
    # Where scene.lambent has no value of its own it follows these.
    limits = ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "transparent_max_bounces")
    for name in limits:
        setattr(scene.cycles, name, bounces)
    for name in ("sample_clamp_direct", "sample_clamp_indirect", "blur_glossy"):
        setattr(scene.cycles, name, 0.0)
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = True
    scene.cycles.use_adaptive_sampling = False


# --- Materials ------------------------------------------------------------------------------------------------------


def material(name):
    """Returns an empty node material and its node tree's (nodes, links, output node)."""
    made = bpy.data.materials.new(name)
    if not made.use_nodes:  # always true from Blender 5.0 on, where setting it is deprecated
        made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    return made, tree.nodes, tree.links, tree.nodes.new("ShaderNodeOutputMaterial")


def simple(name, node_type, **inputs):
    """Returns a material of one shader node of `node_type`, such as "ShaderNodeBsdfDiffuse"; inputs by socket name
    with underscores for blanks. Colours are (r, g, b)."""
    made, nodes, links, output = material(name)
    shader = nodes.new(node_type)
    set_inputs(shader, inputs)
    links.new(shader.outputs[0], output.inputs["Surface"])
    return made


def set_inputs(node, inputs):
    """Sets a node's inputs; names as in Blender 4.0 and later, with underscores for blanks."""
    for key, value in inputs.items():
        name = key.replace("_", " ")
        if name not in node.inputs:
            name = k_principled_before_4[name]
        if isinstance(value, tuple) and len(value) == 3 and node.inputs[name].type == "RGBA":
            value = (*value, 1.0)
        node.inputs[name].default_value = value


def principled(name, **inputs):
    """Returns a Principled material; inputs as in `simple`."""
    return simple(name, "ShaderNodeBsdfPrincipled", **inputs)


def emission(name, color, strength):
    """Returns an emissive material: radiance `strength`·`color`."""
    return simple(name, "ShaderNodeEmission", Color=color, Strength=strength)


def textured(name, texture, **inputs):
    """Returns a Principled material whose base colour is the image `texture`, by UV; inputs as in `simple`."""
    made, nodes, links, output = material(name)
    shader = nodes.new("ShaderNodeBsdfPrincipled")
    set_inputs(shader, inputs)
    sampled = nodes.new("ShaderNodeTexImage")
    sampled.image = texture
    links.new(sampled.outputs["Color"], shader.inputs["Base Color"])
    links.new(shader.outputs[0], output.inputs["Surface"])
    return made


def glass(name, ior=1.5, color=(1.0, 1.0, 1.0)):
    """Returns smooth glass; `color` filters at each crossing of the surface."""
    return simple(name, "ShaderNodeBsdfGlass", Color=color, Roughness=0.0, IOR=ior)


def metal(name, color, roughness):
    """Returns a glossy reflector of one colour (GGX; 0: a mirror)."""
    return simple(name, "ShaderNodeBsdfGlossy", Color=color, Roughness=roughness)


def diffuse(name, color):
    """Returns a Lambertian material."""
    return simple(name, "ShaderNodeBsdfDiffuse", Color=color)


# --- Shapes ---------------------------------------------------------------------------------------------------------


def mesh(name, vertices, faces, smooth=False, uv=None):
    """Returns a mesh. `uv`: a function from a vertex index to (u, v), or None for no UV set."""
    made = bpy.data.meshes.new(name)
    made.from_pydata(vertices, [], faces)
    made.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    if uv:
        layer = made.uv_layers.new(name="UVMap")
        for loop in made.loops:
            layer.data[loop.index].uv = uv(loop.vertex_index)
    made.update()
    return made


def place(scene, mesh_or_light, material=None, location=(0, 0, 0), rotation=(0, 0, 0), scale=(1, 1, 1), name=None):
    """Returns a new object of the scene; rotation in degrees."""
    if material is not None and not mesh_or_light.materials:
        mesh_or_light.materials.append(material)
    made = bpy.data.objects.new(name or mesh_or_light.name, mesh_or_light)
    made.location = location
    made.rotation_euler = [math.radians(angle) for angle in rotation]
    made.scale = scale
    scene.collection.objects.link(made)
    return made


def quad(name, corners, uv_scale=1.0):
    """Returns a mesh of one quadrilateral; its front is where the corners run counter-clockwise."""
    corner_uv = [(0, 0), (uv_scale, 0), (uv_scale, uv_scale), (0, uv_scale)]
    return mesh(name, corners, [(0, 1, 2, 3)], uv=lambda vertex: corner_uv[vertex])


def box(name, size=(1, 1, 1)):
    """Returns a box mesh centred on the origin."""
    x, y, z = (extent / 2 for extent in size)
    vertices = [(sx * x, sy * y, sz * z) for sx in (-1, 1) for sy in (-1, 1) for sz in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return mesh(name, vertices, faces)


def wall(name, length, height, thickness, opening=None):
    """Returns a wall from the origin along x (`length`) and z (`height`), with its thickness towards +y. `opening`:
    (x0, x1, z0, z1) of a rectangular hole, or None."""
    x0, x1, z0, z1 = opening or (0.0, 0.0, 0.0, 0.0)
    parts = ((0, x0, 0, height), (x1, length, 0, height), (x0, x1, 0, z0), (x0, x1, z1, height))
    vertices, faces = [], []
    for left, right, low, high in parts if opening else ((0, length, 0, height),):
        if right - left > 1e-9 and high - low > 1e-9:
            first = len(vertices)
            vertices += [(x, y, z) for x in (left, right) for y in (0, thickness) for z in (low, high)]
            sides = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
            faces += [tuple(first + corner for corner in face) for face in sides]
    return mesh(name, vertices, faces)


def tube(name, points, radii, segments=24):
    """Returns a closed tube through points [(x, y, z)..] with a radius at each, smooth, with flat ends."""
    points = [mathutils.Vector(point) for point in points]
    vertices, faces, across = [], [], None
    for index, (point, radius) in enumerate(zip(points, radii)):
        along = (points[min(index + 1, len(points) - 1)] - points[max(index - 1, 0)]).normalized()
        if across is None:
            across = along.orthogonal().normalized()
        across = (across - along * across.dot(along)).normalized()  # carried along, so that the tube does not twist
        beside = along.cross(across)
        for step in range(segments):
            angle = 2 * math.pi * step / segments
            vertices.append(point + radius * (math.cos(angle) * across + math.sin(angle) * beside))
    for ring in range(len(points) - 1):
        for step in range(segments):
            a, b = ring * segments + step, ring * segments + (step + 1) % segments
            faces.append((a, b, b + segments, a + segments))
    last = len(vertices) - segments
    faces += [tuple(reversed(range(segments))), tuple(range(last, len(vertices)))]
    made = mesh(name, vertices, faces, True)
    for end in made.polygons[-2:]:
        end.use_smooth = False
    return made


def lathe(name, profile, segments=96, smooth=True):
    """Returns the surface of revolution of a profile [(radius, z)..] about the z axis, front outside where the profile
    runs upwards. Radii of 0 at the ends close it."""
    vertices, rings = [], []
    for radius, z in profile:
        if radius <= 1e-9:
            rings.append([len(vertices)] * segments)
            vertices.append((0.0, 0.0, z))
        else:
            rings.append(list(range(len(vertices), len(vertices) + segments)))
            for step in range(segments):
                angle = 2 * math.pi * step / segments
                vertices.append((radius * math.cos(angle), radius * math.sin(angle), z))
    faces = []
    for lower, upper in zip(rings, rings[1:]):
        for step in range(segments):
            following = (step + 1) % segments
            face = (lower[step], lower[following], upper[following], upper[step])
            distinct = tuple(dict.fromkeys(face))
            if len(distinct) >= 3:
                faces.append(distinct)
    return mesh(name, vertices, faces, smooth)


def sphere(name, radius=1.0, segments=64, rings=32):
    """Returns a sphere mesh around the origin with smooth normals."""
    angles = [math.pi * (ring / rings - 0.5) for ring in range(rings + 1)]
    profile = [(radius * math.cos(a), radius * math.sin(a)) for a in angles]
    profile[0], profile[-1] = (0.0, -radius), (0.0, radius)
    return lathe(name, profile, segments)


def curve_through(points, steps=8):
    """Returns a profile that runs smoothly (Catmull-Rom) through points [(radius, z)..], `steps` to each piece."""
    padded = [points[0], *points, points[-1]]
    out = []
    for a, b, c, d in zip(padded, padded[1:], padded[2:], padded[3:]):
        for step in range(steps):
            t = step / steps
            out.append(
                tuple(
                    0.5 * (2 * q + (r - p) * t + (2 * p - 5 * q + 4 * r - s) * t * t + (3 * q - p - 3 * r + s) * t**3)
                    for p, q, r, s in zip(a, b, c, d)
                )
            )
    out.append(points[-1])
    return [(max(radius, 0.0), z) for radius, z in out]


# --- Camera, lights, world ------------------------------------------------------------------------------------------


def look_at(made, location, target):
    """Places an object at `location`, its −Z axis towards `target`, its Y axis as upright as it can be."""
    made.location = location
    direction = mathutils.Vector(target) - mathutils.Vector(location)
    made.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()
    return made


def camera(scene, location, target, focal_length_mm=50.0, fstop=None, focus=None, blades=0):
    """Adds the scene's camera; with `fstop`, a thin lens focused on the point `focus` (default: the target)."""
    lens = bpy.data.cameras.new("Camera")
    lens.lens = focal_length_mm
    made = bpy.data.objects.new("Camera", lens)
    scene.collection.objects.link(made)
    look_at(made, location, target)
    if fstop:
        direction = (mathutils.Vector(target) - mathutils.Vector(location)).normalized()
        lens.dof.use_dof = True
        lens.dof.aperture_fstop = fstop
        lens.dof.aperture_blades = blades
        lens.dof.focus_distance = (mathutils.Vector(focus or target) - mathutils.Vector(location)).dot(direction)
    scene.camera = made
    return made


def light(scene, kind, name, energy, location=(0, 0, 0), target=None, color=(1, 1, 1), **properties):
    """Adds a light of Blender's `kind` (POINT SPOT SUN AREA) that shines at `target` (default: straight down)."""
    made = bpy.data.lights.new(name, kind)
    made.energy, made.color = energy, color
    for key, value in properties.items():
        setattr(made, key, value)
    placed = place(scene, made, location=location)
    if target:
        look_at(placed, location, target)
    return placed


def world(scene, color=(0, 0, 0), strength=1.0, image=None):
    """Gives the scene a world: one colour, or an environment image."""
    made = bpy.data.worlds.new("World")
    if not made.use_nodes:
        made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    background = nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (*color, 1.0)
    background.inputs["Strength"].default_value = strength
    links.new(background.outputs[0], nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    if image:
        texture = nodes.new("ShaderNodeTexEnvironment")
        texture.image = image
        links.new(texture.outputs["Color"], background.inputs["Color"])
    scene.world = made
    return made


def tiles(name, colors, joint_color, joint, count=4, pixels=64):
    """Returns an image of `count` by `count` square tiles, `pixels` wide, that repeats: each tile one of the colours, by
    a fixed choice (sRGB). `joint`: width between tiles as a fraction of a tile."""

    def pixel(u, v):
        column, row = int(u * count), int(v * count)
        inside = (u * count - column, v * count - row)
        if min(*inside, 1 - inside[0], 1 - inside[1]) < joint / 2:
            return joint_color
        return colors[(column * 7 + row * 13 + column * row * 5) % len(colors)]

    return image(name, count * pixels, count * pixels, pixel)


def image(name, width, height, pixel, is_float=False):
    """Returns an image; `pixel(u, v)` gives (r, g, b) at 0..1 from the lower left, as stored (sRGB unless float)."""
    made = bpy.data.images.new(name, width, height, float_buffer=is_float)
    values = []
    for y in range(height):
        for x in range(width):
            values.extend((*pixel((x + 0.5) / width, (y + 0.5) / height), 1.0))
    made.pixels.foreach_set(values)
    made.update()
    made.pack()
    return made
