"""Measures what Cycles returns for single materials: the reference of cycles_test.cpp.

    blender -b --factory-startup --python tests/furnace/measure_cycles.py -- tests/furnace/cycles_reference.json [PART]

PART: measure only the cases whose name holds it, and replace those in the file.

A plane seen by an orthographic camera from direction wi is lit by a sun without size from direction wo (irradiance 1:
the pixel is f·cos, without noise) or by a white world (the pixel is the directional albedo).
"""
import json
import math
import sys
import tempfile

import bpy
import numpy as np
from mathutils import Vector

# Looked at: generated coordinates (0.75, 0.5, 0), where the default tangent is +Y.
CENTER = Vector((2.5, 0.0, 0.0))


def set_up():
    scene = bpy.context.scene
    for collection in (bpy.data.objects, bpy.data.meshes, bpy.data.lights):
        for item in list(collection):
            collection.remove(item)
    mesh = bpy.data.meshes.new("plane")
    mesh.from_pydata([(-5, -5, 0), (5, -5, 0), (5, 5, 0), (-5, 5, 0)], [], [(0, 1, 2, 3)])
    plane = bpy.data.objects.new("plane", mesh)
    scene.collection.objects.link(plane)
    material = bpy.data.materials.new("measured")
    material.use_nodes = True
    mesh.materials.append(material)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = 0.01
    scene.collection.objects.link(camera)
    scene.camera = camera
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy = 1.0
    sun.data.angle = 0.0
    scene.collection.objects.link(sun)
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.color_mode = "RGB"
    cycles = scene.cycles
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.sample_clamp_indirect = 0
    cycles.light_sampling_threshold = 0
    cycles.pixel_filter_type = "BOX"
    cycles.blur_glossy = 0
    return scene, material, camera, sun


def direction(theta, phi):
    return Vector((math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)))


def aim(thing, towards, distance):
    thing.location = CENTER + towards * distance
    thing.rotation_euler = (-towards).to_track_quat("-Z", "Y").to_euler()


def set_material(material, nodes):
    """nodes: list of (type, inputs, properties); an input ("link", index, socket) links to another node."""
    tree = material.node_tree
    tree.nodes.clear()
    made = []
    for kind, inputs, properties in nodes:
        node = tree.nodes.new("ShaderNode" + kind)
        for name, value in properties.items():
            setattr(node, name, value)
        sockets = {socket.identifier: socket for socket in node.inputs}
        for name, value in inputs.items():
            if isinstance(value, tuple) and value[0] == "link":
                source = {socket.identifier: socket for socket in made[value[1]].outputs}
                tree.links.new(source[value[2]], sockets[name])
            else:
                sockets[name].default_value = value
        made.append(node)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(made[-1].outputs[0], output.inputs["Surface"])


def pixel(scene):
    path = tempfile.gettempdir() + "/lambent_measured.exr"
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(path)
    values = np.array(image.pixels[:]).reshape(-1, 4)[:, :3]
    bpy.data.images.remove(image)
    return values.mean(axis=0).tolist(), (values.std(axis=0) / math.sqrt(len(values))).tolist()


def red(x):
    return (0.8, 0.4, x, 1.0)


def cases():
    principled = []
    base = {"Base Color": red(0.1)}
    for name, inputs in {
        "default": {},
        "rough": {"Roughness": 0.9},
        "smooth": {"Roughness": 0.2},
        "metal": {"Metallic": 1.0, "Roughness": 0.3},
        "half metal": {"Metallic": 0.5, "Roughness": 0.4},
        "specular 0": {"Specular": 0.0},
        "specular 1": {"Specular": 1.0, "Roughness": 0.4},
        "specular tint": {"Specular Tint": 0.8, "Specular": 1.0},
        "sheen": {"Sheen": 1.0, "Sheen Tint": 0.5},
        "clearcoat": {"Clearcoat": 1.0, "Clearcoat Roughness": 0.3},
        "anisotropic": {"Metallic": 1.0, "Anisotropic": 0.8, "Roughness": 0.4},
        "anisotropic rotated": {"Metallic": 1.0, "Anisotropic": 0.5, "Anisotropic Rotation": 0.15, "Roughness": 0.5},
        "transmission": {"Transmission": 1.0, "Roughness": 0.4, "IOR": 1.3},
        "transmission tinted": {"Transmission": 0.7, "Roughness": 0.5, "Specular Tint": 0.6},
        "transmission roughness": {"Transmission": 1.0, "Roughness": 0.3, "Transmission Roughness": 0.5},
        "alpha": {"Alpha": 0.6},
        "emission": {"Emission": (0.3, 0.2, 0.1, 1), "Emission Strength": 2.0},
        # With sheen or clearcoat besides, Cycles runs out of closures and drops some.
        "many": {"Metallic": 0.3, "Transmission": 0.4, "Roughness": 0.6, "Specular": 0.8, "Specular Tint": 0.3},
    }.items():
        principled.append(("principled " + name, [("BsdfPrincipled", {**base, **inputs}, {"distribution": "GGX"})]))
    for roughness in (0.3, 0.8, 1.0):
        principled.append((f"principled multiscatter metal {roughness}",
                           [("BsdfPrincipled", {**base, "Metallic": 1.0, "Roughness": roughness},
                             {"distribution": "MULTI_GGX"})]))
        principled.append((f"principled multiscatter glass {roughness}",
                           [("BsdfPrincipled", {**base, "Transmission": 1.0, "Roughness": roughness},
                             {"distribution": "MULTI_GGX"})]))
    color = {"Color": red(0.2)}
    simple = [
        ("diffuse", [("BsdfDiffuse", color, {})]),
        ("diffuse rough", [("BsdfDiffuse", {**color, "Roughness": 0.7}, {})]),
        ("translucent", [("BsdfTranslucent", color, {})]),
        ("transparent", [("BsdfTransparent", color, {})]),
        ("velvet", [("BsdfVelvet", {**color, "Sigma": 0.5}, {})]),
        ("velvet 1", [("BsdfVelvet", color, {})]),
        ("glossy sharp", [("BsdfGlossy", color, {"distribution": "SHARP"})]),
    ]
    for distribution in ("GGX", "BECKMANN", "MULTI_GGX"):
        for roughness in (0.3, 0.7, 1.0) if distribution == "MULTI_GGX" else (0.3, 0.7):
            simple.append((f"glossy {distribution} {roughness}",
                           [("BsdfGlossy", {**color, "Roughness": roughness}, {"distribution": distribution})]))
            simple.append((f"glass {distribution} {roughness}",
                           [("BsdfGlass", {**color, "Roughness": roughness}, {"distribution": distribution})]))
    for distribution in ("GGX", "BECKMANN"):
        simple.append((f"refraction {distribution}",
                       [("BsdfRefraction", {**color, "Roughness": 0.4, "IOR": 1.3}, {"distribution": distribution})]))
        simple.append((f"anisotropic {distribution}",
                       [("BsdfAnisotropic", {**color, "Roughness": 0.5, "Anisotropy": 0.6, "Rotation": 0.1},
                         {"distribution": distribution})]))
    simple.append(("glass sharp", [("BsdfGlass", color, {"distribution": "SHARP"})]))
    diffuse, gloss = ("BsdfDiffuse", color, {}), ("BsdfGlossy", {"Roughness": 0.4}, {"distribution": "GGX"})
    mixed = []
    for kind, socket in (("Fresnel", "Fac"), ("LayerWeight", "Fresnel"), ("LayerWeight", "Facing")):
        inputs = {"IOR": 1.4} if kind == "Fresnel" else {"Blend": 0.3}
        mixed.append((f"mix by {kind} {socket}",
                      [diffuse, gloss, (kind, inputs, {}),
                       ("MixShader", {"Fac": ("link", 2, socket), "Shader": ("link", 0, "BSDF"),
                                      "Shader_001": ("link", 1, "BSDF")}, {})]))
    mixed.append(("add", [diffuse, gloss, ("AddShader", {"Shader": ("link", 0, "BSDF"),
                                                         "Shader_001": ("link", 1, "BSDF")}, {})]))
    mixed.append(("normal map world",
                  [("NormalMap", {"Color": (0.7, 0.6, 0.9, 1), "Strength": 0.8}, {"space": "WORLD"}),
                   ("BsdfDiffuse", {**color, "Normal": ("link", 0, "Normal")}, {})]))
    mixed.append(("normal map glossy",
                  [("NormalMap", {"Color": (0.75, 0.6, 0.9, 1)}, {"space": "WORLD"}),
                   ("BsdfGlossy", {**color, "Roughness": 0.5, "Normal": ("link", 0, "Normal")}, {"distribution": "GGX"})]))
    values = []
    for name, nodes, socket in (
            ("hue", [("HueSaturation", {"Hue": 0.7, "Saturation": 1.4, "Value": 0.9, "Fac": 0.8, "Color": red(0.3)}, {})], "Color"),
            ("noise 3D", [("TexCoord", {}, {}), ("TexNoise", {"Vector": ("link", 0, "Object"), "Scale": 3.3, "Detail": 3.5,
                                                             "Distortion": 0.7}, {})], "Color"),
            ("noise 2D", [("TexCoord", {}, {}), ("TexNoise", {"Vector": ("link", 0, "Object"), "Scale": 2.1},
                                                 {"noise_dimensions": "2D"})], "Color"),
            ("noise 4D", [("TexCoord", {}, {}), ("TexNoise", {"Vector": ("link", 0, "Object"), "W": 0.7},
                                                 {"noise_dimensions": "4D"})], "Color"),
            ("noise 1D", [("TexNoise", {"W": 0.37}, {"noise_dimensions": "1D"})], "Color"),
            ("blackbody", [("Blackbody", {"Temperature": 3300.0}, {})], "Color"),
            ("blackbody 6500", [("Blackbody", {"Temperature": 6500.0}, {})], "Color"),
            ("mapping", [("TexCoord", {}, {}), ("Mapping", {"Vector": ("link", 0, "Generated"), "Location": (0.1, 0.2, 0.3),
                                                            "Rotation": (0.3, 0.2, 0.1), "Scale": (1.1, 0.9, 0.5)}, {})], "Vector"),
            ("overlay", [("MixRGB", {"Fac": 0.7, "Color1": red(0.7), "Color2": (0.3, 0.6, 0.2, 1)},
                          {"blend_type": "OVERLAY"})], "Color"),
            ("gamma", [("Gamma", {"Color": red(0.3), "Gamma": 2.2}, {})], "Color"),
            ("bright", [("BrightContrast", {"Color": red(0.3), "Bright": 0.1, "Contrast": 0.3}, {})], "Color")):
        values.append(("value " + name,
                       nodes + [("Emission", {"Color": ("link", len(nodes) - 1, socket)}, {})]))
    return principled + simple + mixed + values


def measure_skies(scene, camera, plane, results):
    """Skies as worlds, seen by the camera alone; "wi" is against the ray."""
    nishita = {"sky_type": "NISHITA", "sun_elevation": 0.6, "sun_rotation": 0.5, "altitude": 300.0, "dust_density": 2.0}
    sun = (math.cos(0.601) * math.sin(0.5), math.cos(0.601) * math.cos(0.5), math.sin(0.601))
    skies = (nishita, {"sky_type": "NISHITA", "sun_elevation": math.pi / 2, "altitude": 0.0},
             {"sky_type": "PREETHAM", "sun_direction": (0.3, 0.2, 0.933), "turbidity": 3.0})
    plane.hide_render = True
    tree = scene.world.node_tree
    background = tree.nodes["Background"]
    background.inputs["Strength"].default_value = 1.0
    scene.cycles.samples = 1
    for properties in skies:
        sky = tree.nodes.new("ShaderNodeTexSky")
        for name, value in properties.items():
            setattr(sky, name, value)
        tree.links.new(sky.outputs["Color"], background.inputs["Color"])
        for towards in ((0.2, 0.3, 0.8), (0.7, -0.6, 0.05), (-0.9, 0.3, 0.3), (0.5, 0.5, -0.1), sun):
            towards = Vector(towards).normalized()
            aim(camera, -towards, 10.0)
            # to_track_quat is good to 0.001 only, which shows at the sun's rim
            bpy.context.view_layer.update()
            towards = -camera.matrix_world.to_3x3().col[2]
            mean, error = pixel(scene)
            results.append({"name": "sky", "world": True, "wi": list(-towards), "wo": None, "value": mean, "error": error,
                            "nodes": [{"type": "TexSky", "inputs": {}, "properties": properties},
                                      {"type": "Background", "inputs": {"Color": ["link", 0, "Color"]}, "properties": {}}]})


def main():
    scene, material, camera, sun = set_up()
    views = [direction(0.35, 0.4), direction(1.1, 0.4)]
    suns = [direction(0.5, 3.3), direction(1.2, 2.2), direction(0.2, 0.9)]
    world = scene.world or bpy.data.worlds.new("world")
    scene.world = world
    world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    results = []
    out, *part = sys.argv[sys.argv.index("--") + 1 :]
    for name, nodes in cases():
        if part and part[0] not in name:
            continue
        set_material(material, nodes)
        described = [{"type": kind, "inputs": {k: list(v) if isinstance(v, tuple) else v for k, v in inputs.items()},
                      "properties": properties} for kind, inputs, properties in nodes]
        is_value = name.startswith("value ")
        from_below = any(kind in ("BsdfGlass", "BsdfRefraction", "BsdfTranslucent", "BsdfPrincipled") or "mix" in name
                         for kind, _, _ in nodes)
        for view in [views[0]] if is_value else views + ([Vector((views[0].x, views[0].y, -views[0].z))] if from_below else []):
            aim(camera, view, 10.0)
            lights = [None] if is_value else [None] + suns + ([Vector((s.x, s.y, -s.z)) for s in suns[:2]] if from_below else [])
            for light in lights:
                sun.hide_render = light is None
                background.inputs["Color"].default_value = (1, 1, 1, 1) if light is None and not is_value else (0, 0, 0, 1)
                background.inputs["Strength"].default_value = 1.0 if light is None and not is_value else 0.0
                scene.cycles.samples = 1 if light is not None or is_value else 256
                if "MULTI_GGX" in str(nodes) and light is not None:
                    scene.cycles.samples = 256  # its evaluation is itself random
                if light is not None:
                    aim(sun, light, 10.0)
                mean, error = pixel(scene)
                results.append({"name": name, "nodes": described, "wi": list(view),
                                "wo": list(light) if light is not None else None, "value": mean, "error": error})
    if part:
        with open(out) as file:
            before = json.load(file)["measurements"]
        results = [result for result in before if part[0] not in result["name"]] + results
    else:
        measure_skies(scene, camera, bpy.data.objects["plane"], results)
    with open(out, "w") as file:
        lines = ",\n ".join(json.dumps(result) for result in results)
        file.write('{"made_by": "measure_cycles.py", "blender": "%s", "measurements": [\n %s]}\n'
                   % (bpy.app.version_string, lines))


main()
