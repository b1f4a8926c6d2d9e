"""Renders node cases with Cycles and then with Lambent, in one run of Blender:
blender -b --factory-startup --python tests/nodes/render_nodes.py -- job.json

The job: {"daemon": path of lambentd, "out": folder, "kinds": ["value", "input" or "surface"..], "nodes": [names] or null for all,
"every": n, "engines": [..]}, and optionally "samples", and "sky_alone" (see light_everything).
Writes OUT/KIND.json (the cases, where each is in the picture) and OUT/KIND_ENGINE_SEED.exr.
"""

import json
import pathlib
import random
import sys

import bpy

k_here = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(k_here), str(k_here.parent / "agreement")]
import render_job
import surface_cases
import value_cases

k_patch = 8  # faces and pixels on a side
k_columns = 64  # patches in a row of the picture
k_sphere_patch = 16  # pixels on a side of the picture of one sphere
k_sphere_columns = 20
k_seeds = {"value": (1, 2), "input": tuple(range(1, 9)), "surface": tuple(range(1, 9))}
k_samples = {"value": 1, "input": 16, "surface": 32}


def patch_mesh():
    """A mesh of k_patch x k_patch unit faces around the origin, with a set of random inputs on each."""
    n = k_patch
    vertices = [(x - n / 2, y - n / 2, 0.0) for y in range(n + 1) for x in range(n + 1)]
    faces = [(y * (n + 1) + x, y * (n + 1) + x + 1, (y + 1) * (n + 1) + x + 1, (y + 1) * (n + 1) + x)
             for y in range(n) for x in range(n)]  # fmt: skip
    mesh = bpy.data.meshes.new("patch")
    mesh.from_pydata(vertices, [], faces)
    generator = random.Random(7)

    def fill(name, kind, field, make):
        attribute = mesh.attributes.new(name, kind, "FACE")
        for item in attribute.data:
            setattr(item, field, make())

    span = generator.uniform
    for name in value_cases.k_vectors:
        fill(name, "FLOAT_VECTOR", "vector", lambda: [span(-2.5, 2.5) for _ in range(3)])
    for name in value_cases.k_colors:
        fill(name, "FLOAT_VECTOR", "vector", lambda: [span(0.0, 1.2) for _ in range(3)])
    for name, low, high in (("s", -2.5, 2.5), ("s2", -2.5, 2.5), ("t", 0, 1), ("u", 0, 1), ("kelvin", 500, 15000),
                            ("nanometres", 360, 800)):  # fmt: skip
        fill(name, "FLOAT", "value", lambda low=low, high=high: span(low, high))
    return mesh


def emission_material(name, tree_of, case):
    """A material that emits the value of a case's socket, unchanged."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(tree_of(case, tree), emission.inputs["Color"])
    tree.links.new(emission.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def look_down(scene, width, height):
    """An orthographic camera over the picture whose pixels are the unit squares of the plane z = 0."""
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.ortho_scale, camera.clip_end = "ORTHO", max(width, height), 100.0
    placed = bpy.data.objects.new("camera", camera)
    placed.location = (width / 2, height / 2, 10.0)
    scene.collection.objects.link(placed)
    scene.camera = placed
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100


def value_scene(cases):
    """Makes the scene of value cases; returns the scene and the picture's columns."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    mesh = patch_mesh()
    columns = min(k_columns, max(len(cases), 2))
    rows = (len(cases) + columns - 1) // columns
    for index, case in enumerate(cases):
        material = emission_material(f"case {index}", value_cases.build, case)
        placed = bpy.data.objects.new(f"case {index}", mesh)
        placed.location = ((index % columns + 0.5) * k_patch, (index // columns + 0.5) * k_patch, 0.0)
        if not mesh.materials:
            mesh.materials.append(None)
        placed.material_slots[0].link = "OBJECT"
        placed.material_slots[0].material = material
        scene.collection.objects.link(placed)
    look_down(scene, columns * k_patch, rows * k_patch)
    return scene, columns


def sphere_mesh():
    """A smooth sphere of radius 0.8 with two UV maps, colours, and attributes of every domain."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=12, radius=0.8)
    made = bpy.context.object
    mesh = made.data
    bpy.data.objects.remove(made)
    for polygon in mesh.polygons:
        polygon.use_smooth = True
    mesh.use_auto_texspace = False
    second = mesh.uv_layers.new(name="second")
    for loop, item in zip(mesh.loops, second.data):
        x, y, z = mesh.vertices[loop.vertex_index].co
        item.uv = (x + 0.5 * z, y - z)
    mesh.uv_layers[0].active_render = True

    def fill(name, kind, domain, field, make):
        for element, item in zip(elements[domain], mesh.attributes.new(name, kind, domain).data):
            setattr(item, field, make(element))

    elements = {"POINT": mesh.vertices, "CORNER": mesh.loops, "FACE": mesh.polygons}
    fill("number", "FLOAT", "POINT", "value", lambda vertex: vertex.co.x + 0.3 * vertex.co.z)
    fill("vector", "FLOAT_VECTOR", "POINT", "vector", lambda vertex: vertex.co * 0.7)
    fill("point", "FLOAT_COLOR", "POINT", "color", lambda vertex: (*(vertex.co * 0.4), 0.7))
    fill("corner", "FLOAT_VECTOR", "CORNER", "vector", lambda loop: (loop.index % 7 / 7.0, 0.2, loop.index % 3 / 3.0))
    fill("flag", "BOOLEAN", "FACE", "value", lambda polygon: polygon.index % 3 == 0)
    fill("whole", "INT", "FACE", "value", lambda polygon: polygon.index % 5)
    paint = mesh.color_attributes.new("paint", "BYTE_COLOR", "CORNER")
    for loop, item in zip(mesh.loops, paint.data):
        item.color = (loop.index % 5 / 5.0, 0.6, loop.index % 4 / 4.0, 0.5)
    mesh.color_attributes.render_color_index = mesh.color_attributes.find("paint")
    return mesh


def pattern_images(folder):
    """Images whose texels all differ: "pattern" (bytes, with alpha), "opaque" (the same without), "float pattern", "non-color", and
    "tiles" (UDIM, from files that are written to a folder)."""
    generator = random.Random(11)
    for name, is_float in (("pattern", False), ("float pattern", True), ("non-color", False)):
        image = bpy.data.images.new(name, 8, 6, alpha=True, float_buffer=is_float)
        if name == "non-color":
            image.colorspace_settings.name = "Non-Color"
        pixels = []
        for _ in range(8 * 6):
            pixels += [generator.uniform(0.1, 0.9) for _ in range(3)] + [generator.choice((1.0, 0.6))]
        image.pixels.foreach_set(pixels)
        image.update()
    opaque = bpy.data.images.new("opaque", 8, 6)
    opaque.pixels.foreach_set([x if k % 4 < 3 else 1.0 for k, x in enumerate(bpy.data.images["pattern"].pixels)])
    opaque.update()
    for number in (1001, 1002, 1011):
        image = bpy.data.images.new("one tile", 4, 4)
        image.pixels.foreach_set([generator.uniform(0.1, 0.9) if k % 4 < 3 else 1.0 for k in range(4 * 4 * 4)])
        image.filepath_raw, image.file_format = f"{folder}/tile.{number}.png", "PNG"
        image.save()
        bpy.data.images.remove(image)
    tiles = bpy.data.images.load(f"{folder}/tile.1001.png")
    tiles.name, tiles.source, tiles.filepath = "tiles", "TILED", f"{folder}/tile.<UDIM>.png"
    for number in (1002, 1011):
        if not any(tile.number == number for tile in tiles.tiles):
            tiles.tiles.new(number)


def light_everything(scene, sky_alone):
    """A sun and a sky whose colour tells the direction. `sky_alone`: no sun, and a sky that is no light to be sampled, so
    that lobes are sampled only and never evaluated for a light."""
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.angle = 2.0, 0.4
    placed = bpy.data.objects.new("sun", sun)
    placed.rotation_euler = (0.8, 0.4, 0.3)
    if not sky_alone:
        scene.collection.objects.link(placed)
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    if sky_alone:
        world.cycles.sampling_method = "NONE"
    tree = world.node_tree
    direction = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
    color = surface_cases.shader(tree, "VectorMath", operation="MULTIPLY_ADD")
    tree.links.new(direction, color.inputs[0])
    color.inputs[1].default_value = color.inputs[2].default_value = (0.3, 0.3, 0.3)
    tree.links.new(color.outputs[0], next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBackground").inputs["Color"])
    scene.world = world


def surface_scene(cases, folder, sky_alone=False):
    """Makes the scene of surface cases [(node, label, build)]; returns the scene and the picture's columns."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene["scene_number"] = 0.3
    mesh = sphere_mesh()
    pattern_images(folder)
    light_everything(scene, sky_alone)
    columns = min(k_sphere_columns, max(len(cases), 2))
    rows = (len(cases) + columns - 1) // columns
    mesh.materials.append(None)
    for index, (_, _, build) in enumerate(cases):
        placed = bpy.data.objects.new(f"case {index}", mesh)
        placed.location = (2.0 * (index % columns + 0.5), 2.0 * (index // columns + 0.5), 0.0)
        placed.rotation_euler, placed.scale = (0.3, 0.5, 0.7), (1.0, 1.1, 0.9)
        placed.color, placed.pass_index = (0.2, 0.7, 0.4, 0.6), 3
        placed["own"] = 0.35
        # Spheres do not show in one another.
        placed.visible_diffuse = placed.visible_glossy = placed.visible_shadow = False
        material = bpy.data.materials.new(f"case {index}")
        material.use_nodes, material.pass_index = True, 2
        tree = material.node_tree
        tree.nodes.clear()
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(build(tree, placed), output.inputs["Surface"])
        placed.material_slots[0].link = "OBJECT"
        placed.material_slots[0].material = material
        scene.collection.objects.link(placed)
    look_down(scene, 2 * columns, 2 * rows)
    # Perspective, from where the plane of the centres fills the picture
    camera = scene.camera.data
    camera.type, camera.sensor_width, camera.lens = "PERSP", 36.0, 90.0
    camera.sensor_fit = "AUTO"
    scene.camera.location.z = max(2 * columns, 2 * rows) * camera.lens / camera.sensor_width
    camera.clip_end = 1000.0
    scene.render.resolution_x, scene.render.resolution_y = columns * k_sphere_patch, rows * k_sphere_patch
    return scene, columns


def render(scene, engine, job, kind, seeds, samples):
    # All samples at the pixel's centre: Cycles has its first there whatever the filter, so that of few samples its pictures are
    # sharper than the filter says.
    settings = {"filter_width": 0.01}
    size = scene.render.resolution_x, scene.render.resolution_y
    render_job.prepare(scene, {
        "engine": engine, "daemon": job["daemon"], "width": size[0], "height": size[1], "samples": samples, "variant": None,
        "settings": settings,
    })  # fmt: skip
    for seed in seeds:
        (scene.lambent if engine == "LAMBENT" else scene.cycles).seed = seed
        bpy.ops.render.render()
        render_job.save(scene, f"{job['out']}/{kind}_{engine.lower()}_{seed}.exr")


def main():
    with open(sys.argv[sys.argv.index("--") + 1], encoding="utf-8") as file:
        job = json.load(file)
    for kind in job["kinds"]:
        if kind == "value":
            cases = value_cases.value_cases()
            chosen = [case for case in cases if not job["nodes"] or case["node"] in job["nodes"]][:: job["every"]]
            scene, columns = value_scene(chosen)
        else:
            cases = surface_cases.cases_of(kind)
            chosen = [case for case in cases if not job["nodes"] or case[0] in job["nodes"]][:: job["every"]]
            scene, columns = surface_scene(chosen, job["out"], job.get("sky_alone", False))
            chosen = [{"node": node, "options": {}, "variant": label, "output": ""} for node, label, _ in chosen]
        for engine in job["engines"] if chosen else ():
            render(scene, engine, job, kind, k_seeds[kind], k_samples[kind] if kind == "value" else job.get("samples", k_samples[kind]))
        patch = k_patch if kind == "value" else k_sphere_patch
        found = {"cases": chosen, "columns": columns, "patch": patch, "blender": bpy.app.version_string}
        with open(f"{job['out']}/{kind}.json", "w", encoding="utf-8") as file:
            json.dump(found, file)


main()
