"""The cases of nodes that need a surface, light or the camera: shaders, and inputs that vary over a surface. Runs inside Blender.

Each case is a small sphere under a sun and a sky of many colours ("surface"); where the node computes a value, the sphere emits
it ("input"). The two are different pictures: emitting spheres would light the others.
"""

from functools import partial

import bpy

k_cases = []  # (node, label, function(tree, object) -> shader socket)
k_emitting = set()  # of these functions, those of the kind "input"


def case(node, label, emits=False):
    def add(function):
        if emits:
            k_emitting.add(function)
        k_cases.append((node, label, function))
        return function

    return add


def emits(function):
    k_emitting.add(function)
    return function


def shader(tree, kind, inputs=None, **properties):
    """Adds a node with properties and input values (numbers, colours, or sockets to link); returns it."""
    node = tree.nodes.new("ShaderNode" + kind)
    for key, value in properties.items():
        setattr(node, key, value)
    for name, value in (inputs or {}).items():
        socket = next((s for s in node.inputs if s.name == name and s.enabled), None) or node.inputs[name]
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return node


def emitted(tree, socket):
    """A shader that emits a value, moved into the positive by a half so that its sign shows."""
    half = shader(tree, "VectorMath", {}, operation="MULTIPLY_ADD")
    tree.links.new(socket, half.inputs[0])
    half.inputs[1].default_value = half.inputs[2].default_value = (0.5, 0.5, 0.5)
    return shader(tree, "Emission", {"Color": half.outputs[0]}).outputs[0]


def add_shader(kind, label, inputs=None, **properties):
    """A case of one shader node, if this Blender has it and its settings."""
    if not hasattr(bpy.types, "ShaderNode" + kind):
        return
    k_cases.append((kind, label, lambda tree, _thing: shader(tree, kind, inputs, **properties).outputs[0]))


def thin_subsurface(falloff, tree, thing):
    """Scattering in a flat lens whose thickness is about the radius, so that light comes through."""
    thing.scale[2] *= 0.15
    return shader(tree, "SubsurfaceScattering", {"Color": k_blue, "Scale": 0.5}, falloff=falloff).outputs[0]


def add_sheet(kind, label, inputs=None, **properties):
    """A case of a shader that light goes through once: the far side of the sphere is not seen from within. Spheres cast no
    shadow; if they were seen, how much light comes through would depend on how lights and directions share the samples."""
    if not hasattr(bpy.types, "ShaderNode" + kind):
        return

    def build(tree, thing):
        thing.visible_transmission = False
        return shader(tree, kind, inputs, **properties).outputs[0]

    k_cases.append((kind, label, build))


def add_value(kind, output, label="", inputs=None, **properties):
    """A case of one output of a node that computes a value."""
    if not hasattr(bpy.types, "ShaderNode" + kind):
        return

    def build(tree, _thing):
        node = shader(tree, kind, inputs, **properties)
        return emitted(tree, node.outputs[output])

    k_emitting.add(build)
    k_cases.append((kind, f"{label}.{output}" if label else output, build))


def items(kind, name):
    """The items of an enumerated property of a node, or nothing where this Blender lacks either."""
    node_type = getattr(bpy.types, "ShaderNode" + kind, None)
    definition = node_type.bl_rna.properties.get(name) if node_type else None
    return [item.identifier for item in definition.enum_items] if definition else []


k_blue = (0.2, 0.5, 0.8, 1.0)


def add_simple_shaders():
    for roughness in (0.0, 0.5, 1.0):
        add_shader("BsdfDiffuse", f"roughness {roughness}", {"Color": k_blue, "Roughness": roughness})
    for kind in ("BsdfGlossy", "BsdfGlass", "BsdfRefraction"):
        for distribution in items(kind, "distribution"):
            for roughness in (0.0,) if distribution == "SHARP" else (0.0, 0.2, 0.5, 1.0):
                add_shader(kind, f"{distribution} roughness {roughness}", {"Color": k_blue, "Roughness": roughness},
                           distribution=distribution)  # fmt: skip
        if kind != "BsdfGlossy":
            add_shader(kind, "index 0.8", {"Color": k_blue, "Roughness": 0.3, "IOR": 0.8}, distribution="GGX")
            add_shader(kind, "index 2.4", {"Color": k_blue, "Roughness": 0.3, "IOR": 2.4}, distribution="GGX")
            add_shader(kind, "index 1", {"Color": k_blue, "Roughness": 0.3, "IOR": 1.0}, distribution="GGX")
    kind = "BsdfAnisotropic"
    for distribution in items(kind, "distribution"):
        for anisotropy, rotation in ((0.7, 0.0), (-0.6, 0.0), (0.7, 0.2)):
            add_shader(kind, f"{distribution} anisotropy {anisotropy} rotation {rotation}",
                       {"Color": k_blue, "Roughness": 0.4, "Anisotropy": anisotropy, "Rotation": rotation},
                       distribution=distribution)  # fmt: skip
    for direction in ("RADIAL", "UV_MAP"):
        for axis in ("X", "Y", "Z") if direction == "RADIAL" else ("Z",):

            def tangent(tree, _thing, direction=direction, axis=axis):
                node = shader(tree, "Tangent", direction_type=direction, axis=axis)
                inputs = {"Roughness": 0.4, "Anisotropy": 0.8, "Tangent": node.outputs[0]}
                return shader(tree, "BsdfAnisotropic", inputs, distribution="GGX").outputs[0]

            k_cases.append(("Tangent", f"{direction} {axis} in a glossy shader", tangent))
            add_value("Tangent", "Tangent", f"{direction} {axis}", direction_type=direction, axis=axis)
    add_sheet("BsdfTranslucent", "", {"Color": k_blue})
    add_shader("BsdfTransparent", "", {"Color": k_blue})
    if hasattr(bpy.types, "ShaderNodeBsdfRayPortal"):

        @case("BsdfRayPortal", "straight on")
        def straight(tree, _thing):
            return shader(tree, "BsdfRayPortal", {"Color": k_blue}).outputs[0]

        @case("BsdfRayPortal", "elsewhere")
        def elsewhere(tree, _thing):
            geometry = shader(tree, "NewGeometry").outputs
            far = shader(tree, "VectorMath", {}, operation="MULTIPLY_ADD")
            tree.links.new(geometry["Position"], far.inputs[0])
            far.inputs[1].default_value, far.inputs[2].default_value = (1.0, 1.0, 1.0), (0.0, 0.0, 5.0)
            inputs = {"Color": k_blue, "Position": far.outputs[0], "Direction": geometry["Normal"]}
            return shader(tree, "BsdfRayPortal", inputs).outputs[0]

        @case("BsdfRayPortal", "half")
        def half_portal(tree, _thing):
            node = shader(tree, "MixShader")
            tree.links.new(shader(tree, "BsdfDiffuse", {"Color": k_blue}).outputs[0], node.inputs[1])
            direction = shader(tree, "NewGeometry").outputs["Normal"]
            tree.links.new(shader(tree, "BsdfRayPortal", {"Direction": direction}).outputs[0], node.inputs[2])
            return node.outputs[0]

    @case("Emission", "", emits=True)
    def emission(tree, _thing):
        return shader(tree, "Emission", {"Color": k_blue, "Strength": 1.5}).outputs[0]

    add_shader("Holdout", "")
    for sigma in (0.2, 0.6, 1.0):
        add_shader("BsdfVelvet", f"sigma {sigma}", {"Color": k_blue, "Sigma": sigma})
    for distribution in items("BsdfSheen", "distribution"):
        for roughness in (0.1, 0.4, 0.8):
            add_shader("BsdfSheen", f"{distribution} roughness {roughness}", {"Color": k_blue, "Roughness": roughness},
                       distribution=distribution)  # fmt: skip
    for component in items("BsdfToon", "component"):
        for size, smooth in ((0.5, 0.0), (0.5, 0.3), (0.9, 0.5), (0.1, 0.1)):
            add_shader("BsdfToon", f"{component} size {size} smooth {smooth}",
                       {"Color": k_blue, "Size": size, "Smooth": smooth}, component=component)  # fmt: skip
    for component in items("BsdfHair", "component"):
        for roughness in (0.1, 0.5):
            add_shader("BsdfHair", f"{component} roughness {roughness}",
                       {"Color": k_blue, "RoughnessU": roughness, "RoughnessV": 1.0}, component=component)  # fmt: skip
    for parametrization in items("BsdfHairPrincipled", "parametrization"):
        # Light goes through it.
        model = {"model": "CHIANG"} if items("BsdfHairPrincipled", "model") else {}
        add = lambda label, inputs={}, model=model, **properties: add_sheet(  # noqa: E731
            "BsdfHairPrincipled", f"{parametrization} {label}".strip(), inputs, parametrization=parametrization, **model, **properties)  # fmt: skip
        add("")
        add("rough", {"Roughness": 0.8, "Radial Roughness": 0.9, "IOR": 1.4})
        add("tilted", {"Offset": 0.2})
        add("coat", {"Coat": 0.5})
        pale = {
            "COLOR": {"Color": k_blue},
            "MELANIN": {"Melanin": 0.2, "Melanin Redness": 0.3, "Tint": k_blue, "Random Color": 0.5},
            "ABSORPTION": {"Absorption Coefficient": (0.05, 0.1, 0.3)},
        }[parametrization]
        add("pale", {**pale, "Random": 0.8, "Random Roughness": 0.5})
        if model:
            add("Huang", model={"model": "HUANG"})
    for falloff in items("SubsurfaceScattering", "falloff"):
        add_shader("SubsurfaceScattering", falloff, {"Color": k_blue, "Scale": 0.2}, falloff=falloff)
        k_cases.append(("SubsurfaceScattering", f"{falloff} of a lens", partial(thin_subsurface, falloff)))
    for kind in ("BsdfGlass", "BsdfMetallic"):
        if not hasattr(bpy.types, "ShaderNode" + kind) or "Thin Film Thickness" not in shader_inputs(kind):
            continue
        for fresnel in items(kind, "fresnel_type") or (None,):
            for thickness, index in ((400.0, 1.33), (1500.0, 1.8), (0.5, 1.5)):
                add_shader(kind, " ".join(filter(None, (fresnel, f"film {thickness} {index}"))),
                           {"Roughness": 0.2, "Thin Film Thickness": thickness, "Thin Film IOR": index},
                           distribution="GGX", **({"fresnel_type": fresnel} if fresnel else {}))  # fmt: skip
    if hasattr(bpy.types, "ShaderNodeBsdfGlass") and "Thin Film Thickness" in shader_inputs("BsdfGlass"):
        add_shader("BsdfGlass", "film of a bubble", {"IOR": 1.0, "Thin Film Thickness": 350.0})
    for fresnel in items("BsdfMetallic", "fresnel_type"):
        for distribution in items("BsdfMetallic", "distribution"):
            add_shader("BsdfMetallic", f"{fresnel} {distribution}", {"Roughness": 0.3}, fresnel_type=fresnel,
                       distribution=distribution)  # fmt: skip


def add_mixes():
    @case("MixShader", "")
    def mix(tree, _thing):
        diffuse = shader(tree, "BsdfDiffuse", {"Color": k_blue}).outputs[0]
        node = shader(tree, "MixShader", {"Fac" if "Fac" in shader_inputs("MixShader") else "Factor": 0.3})
        tree.links.new(diffuse, node.inputs[1])
        tree.links.new(shader(tree, "BsdfGlossy", {"Roughness": 0.3}).outputs[0], node.inputs[2])
        return node.outputs[0]

    @case("MixShader", "second input empty")
    def half(tree, _thing):
        node = shader(tree, "MixShader")
        tree.links.new(shader(tree, "BsdfDiffuse", {"Color": k_blue}).outputs[0], node.inputs[1])
        return node.outputs[0]

    @case("AddShader", "")
    def add(tree, _thing):
        node = shader(tree, "AddShader")
        tree.links.new(shader(tree, "BsdfDiffuse", {"Color": k_blue}).outputs[0], node.inputs[0])
        tree.links.new(shader(tree, "BsdfGlossy", {"Color": (0.1, 0.2, 0.1, 1.0)}).outputs[0], node.inputs[1])
        return node.outputs[0]


def shader_inputs(kind):
    tree = bpy.data.node_groups.new("probe", "ShaderNodeTree")
    names = [socket.name for socket in tree.nodes.new("ShaderNode" + kind).inputs]
    bpy.data.node_groups.remove(tree)
    return names


def add_principled():
    names = shader_inputs("BsdfPrincipled")
    newer = "Specular IOR Level" in names
    specular, clearcoat, sheen, transmission, subsurface = (
        ("Specular IOR Level", "Coat Weight", "Sheen Weight", "Transmission Weight", "Subsurface Weight")
        if newer
        else ("Specular", "Clearcoat", "Sheen", "Transmission", "Subsurface")
    )
    sets = {
        "plain": {},
        "smooth": {"Roughness": 0.0},
        "rough": {"Roughness": 1.0},
        "no specular": {specular: 0.0},
        "strong specular": {specular: 1.0, "Roughness": 0.3},
        "metal": {"Metallic": 1.0, "Roughness": 0.3},
        "rough metal": {"Metallic": 1.0, "Roughness": 0.9},
        "half metal": {"Metallic": 0.5, "Roughness": 0.3},
        "anisotropic metal": {"Metallic": 1.0, "Roughness": 0.4, "Anisotropic": 0.8, "Anisotropic Rotation": 0.1},
        "coat": {clearcoat: 1.0, "Roughness": 0.6},
        "sheen": {sheen: 1.0},
        "glass": {transmission: 1.0, "Roughness": 0.0},
        "rough glass": {transmission: 1.0, "Roughness": 0.4},
        "half glass": {transmission: 0.5, "Roughness": 0.2},
        "alpha": {"Alpha": 0.4},
        "subsurface": {subsurface: 0.5},
    }

    @case("BsdfPrincipled", "glow", emits=True)
    def glow(tree, _thing):
        values = {"Base Color": (0, 0, 0, 1), specular: 0.0, "Emission Strength": 1.5}
        values["Emission Color" if newer else "Emission"] = (0.3, 0.1, 0.2, 1.0)
        return shader(tree, "BsdfPrincipled", values).outputs[0]

    if newer:
        sets["tinted coat"] = {"Coat Weight": 0.7, "Coat Tint": (0.9, 0.5, 0.2, 1.0), "Coat Roughness": 0.2}
        sets["tinted specular"] = {"Specular Tint": (0.9, 0.5, 0.2, 1.0), "Roughness": 0.2}
        sets["diffuse roughness"] = {"Diffuse Roughness": 0.8}
        sets["thin film"] = {"Thin Film Thickness": 400.0, "Roughness": 0.2}
        sets["thin film metal"] = {"Thin Film Thickness": 400.0, "Metallic": 1.0, "Roughness": 0.2}
        sets["thin film glass"] = {"Thin Film Thickness": 300.0, "Transmission Weight": 1.0, "Roughness": 0.1}
        sets["thin wall"] = {"Thin Wall": True, "Transmission Weight": 0.8}
        sets["thin wall, rough"] = {"Thin Wall": True, "Transmission Weight": 1.0, "Roughness": 0.3}
        sets["thin wall, smooth"] = {"Thin Wall": True, "Transmission Weight": 1.0, "Roughness": 0.0}
        sets["thin wall, film"] = {"Thin Wall": True, "Transmission Weight": 1.0, "Roughness": 0.3,
                                   "Thin Film Thickness": 400.0}  # fmt: skip
        sets["thin wall, subsurface"] = {"Thin Wall": True, "Subsurface Weight": 0.8, "Subsurface Anisotropy": 0.4}
        sets["thin wall, rough subsurface"] = {"Thin Wall": True, "Subsurface Weight": 0.8, "Diffuse Roughness": 0.6}
    else:
        sets["tinted specular"] = {"Specular Tint": 1.0, "Roughness": 0.2}
        sets["rough transmission"] = {"Transmission": 1.0, "Roughness": 0.1, "Transmission Roughness": 0.3}
        sets["rough coat"] = {"Clearcoat": 1.0, "Clearcoat Roughness": 0.4}
        sets["tinted sheen"] = {"Sheen": 1.0, "Sheen Tint": 1.0}
    for distribution in items("BsdfPrincipled", "distribution"):
        for label, values in sets.items():
            if all(name in names for name in values):
                add = add_sheet if "Thin Wall" in values and "smooth" not in label else add_shader
                add("BsdfPrincipled", f"{label} ({distribution})", {"Base Color": k_blue, **values}, distribution=distribution)


def add_point_density(space, interpolation, output):
    """A case of the density around the sphere's own vertices, as long as Blender has it."""
    if not hasattr(bpy.types, "ShaderNodeTexPointDensity"):
        return

    def build(tree, thing):
        node = shader(tree, "TexPointDensity", point_source="OBJECT", object=thing, resolution=12, radius=0.4, space=space,
                      interpolation=interpolation)  # fmt: skip
        return emitted(tree, node.outputs[output])

    k_emitting.add(build)
    k_cases.append(("TexPointDensity", f"{space} {interpolation}.{output}", build))


def add_raycast(output, label, only_local, length, direction, from_normal, attribute=None):
    """A case of an output of Raycast, from the surface along a direction, or the normal scaled by it. `attribute`: (type, name)
    of one that the node reads there; the output is then a part of that one's name."""
    if not hasattr(bpy.types, "ShaderNodeRaycast"):
        return

    def build(tree, _thing):
        node = shader(tree, "Raycast", {"Length": length}, only_local=only_local)
        read = output
        if attribute:
            node.sample_attribute_items.new(attribute[0], "read")
            node.inputs["Value_0"].default_value = attribute[1]
            read = output.split()[0]
        along = shader(tree, "VectorMath", {}, operation="MULTIPLY")
        along.inputs[0].default_value, along.inputs[1].default_value = (1.0, 1.0, 1.0), direction
        if from_normal:
            tree.links.new(shader(tree, "NewGeometry").outputs["Normal"], along.inputs[0])
        tree.links.new(along.outputs[0], node.inputs["Direction"])
        scaled = shader(tree, "VectorMath", {}, operation="MULTIPLY")
        tree.links.new(next(s for s in node.outputs if s.identifier == read), scaled.inputs[0])
        scaled.inputs[1].default_value = (0.2, 0.2, 0.2)
        return emitted(tree, scaled.outputs[0])

    k_emitting.add(build)
    k_cases.append(("Raycast", f"{label}{' own' if only_local else ''}.{output}", build))


def add_particles(output):
    """A case of an output of Particle Info on what particles show: 9 of them, born before the picture, take the sphere's place."""

    def build(tree, thing):
        thing.hide_render = True
        scene = bpy.context.scene
        drop = bpy.data.objects.new("drop", thing.data.copy())
        drop.location = (0.0, 0.0, -100.0)
        emitter = bpy.data.objects.new("emitter", bpy.data.meshes.new("emitter"))
        emitter.data.from_pydata([(x, y, 0.0) for x in (-0.6, 0.0, 0.6) for y in (-0.6, 0.0, 0.6)], [], [])
        emitter.location = thing.location
        for made in (drop, emitter):
            scene.collection.objects.link(made)
        emitter.show_instancer_for_render = False
        settings = emitter.modifiers.new("particles", "PARTICLE_SYSTEM").particle_system.settings
        settings.count, settings.emit_from, settings.use_emit_random = 9, "VERT", False
        settings.frame_start, settings.frame_end, settings.lifetime, settings.lifetime_random = -8, -1, 40, 0.5
        settings.normal_factor, settings.factor_random, settings.effector_weights.gravity = 0.5, 0.8, 0.0
        settings.particle_size, settings.size_random = 0.3, 0.4
        settings.use_rotations, settings.angular_velocity_mode, settings.angular_velocity_factor = True, "RAND", 0.7
        settings.render_type, settings.instance_object = "OBJECT", drop
        drop.material_slots[0].link = "OBJECT"
        drop.material_slots[0].material = next(m for m in bpy.data.materials if m.node_tree == tree)
        value = shader(tree, "ParticleInfo").outputs[output]
        scaled = shader(tree, "VectorMath", {}, operation="MULTIPLY")
        tree.links.new(value, scaled.inputs[0])
        scaled.inputs[1].default_value = (0.05, 0.05, 0.05)
        return emitted(tree, scaled.outputs[0])

    k_emitting.add(build)
    k_cases.append(("ParticleInfo", f"of particles.{output}", build))


def add_inputs():
    for output in ("Position", "Normal", "Tangent", "True Normal", "Incoming", "Parametric", "Backfacing", "Pointiness",
                   "Random Per Island"):  # fmt: skip
        add_value("NewGeometry", output)
    for output in ("Generated", "Normal", "UV", "Object", "Camera", "Window", "Reflection"):
        add_value("TexCoord", output)
    for output in ("View Vector", "View Z Depth", "View Distance"):
        add_value("CameraData", output)
    for output in ("Location", "Color", "Alpha", "Object Index", "Material Index"):
        add_value("ObjectInfo", output)
    for output in ("Is Strand", "Intercept", "Length", "Thickness", "Tangent Normal", "Random"):
        add_value("HairInfo", output)
    for output in ("Index", "Random", "Age", "Lifetime", "Location", "Size", "Velocity", "Angular Velocity"):
        add_value("ParticleInfo", output)
        add_particles(output)
    for output in ("Position", "Radius", "Random"):
        add_value("PointInfo", output)
    for index in (1.45, 0.7, 1.0):
        add_value("Fresnel", "Fac", f"index {index}", {"IOR": index})
    for blend in (0.1, 0.5, 0.9):
        for output in ("Fresnel", "Facing"):
            add_value("LayerWeight", output, f"blend {blend}", {"Blend": blend})
    for output in ("Is Camera Ray", "Is Shadow Ray", "Ray Length", "Ray Depth", "Transparent Depth"):
        add_value("LightPath", output)
    add_value("UVMap", "UV")
    for kind in ("UV_MAP",):
        add_value("UVMap", "UV", "by name", uv_map="second")
    for layer in ("", "paint", "absent"):
        for output in ("Color", "Alpha"):
            add_value("VertexColor", output, layer or "active", layer_name=layer)
    for name in ("number", "vector", "paint", "point", "corner", "whole", "flag", "absent", "second"):
        for output in ("Color", "Vector", "Fac", "Alpha"):
            add_value("Attribute", output, name, attribute_type="GEOMETRY", attribute_name=name)
    for name in ("own", "color", "absent"):
        for output in ("Color", "Fac", "Alpha"):
            add_value("Attribute", output, f"OBJECT {name}", attribute_type="OBJECT", attribute_name=name)
    for name in ("scene_number", "absent"):
        add_value("Attribute", "Fac", f"VIEW_LAYER {name}", attribute_type="VIEW_LAYER", attribute_name=name)
    for pixels in (False, True):
        add_value("Wireframe", "Fac", "in pixels" if pixels else "", {"Size": 2.0 if pixels else 0.05}, use_pixel_size=pixels)
    add_value("Bevel", "Normal", "", {"Radius": 0.1})
    for space in items("TexPointDensity", "space"):
        for interpolation in ("Linear", "Closest", "Cubic"):
            for output in ("Density", "Color"):
                add_point_density(space, interpolation, output)
    for output in ("Is Hit", "Self Hit", "Hit Distance", "Hit Position", "Hit Normal"):
        for own in (False, True):
            add_raycast(output, "inwards", own, 3.0, (-1.0, -1.0, -1.0), from_normal=True)
            add_raycast(output, "sideways", own, 2.5, (0.9, 0.1, 0.1), from_normal=False)
    for name in ("number", "vector", "paint", "point", "corner", "whole", "flag", "second", "absent", ""):
        for item, parts in (("FLOAT", ("",)), ("VECTOR", ("",)), ("RGBA", ("", "_Alpha"))):
            for part in parts:
                add_raycast(f"Attribute_0{part} {item} {name}", "sideways", False, 2.5, (0.9, 0.1, 0.1), from_normal=False,
                            attribute=(item, name))  # fmt: skip
    add_value("AmbientOcclusion", "AO")
    for kind in items("VectorTransform", "vector_type"):
        for source in items("VectorTransform", "convert_from"):
            for target in items("VectorTransform", "convert_to"):
                add_value("VectorTransform", "Vector", f"{kind} {source} {target}", {"Vector": (0.3, -0.4, 0.8)},
                          vector_type=kind, convert_from=source, convert_to=target)  # fmt: skip

    @case("LightPath", "Is Diffuse Ray seen by a diffuse shader")
    def diffuse_ray(tree, _thing):
        path = shader(tree, "LightPath").outputs["Is Camera Ray"]
        return shader(tree, "BsdfDiffuse", {"Color": path}).outputs[0]


def add_normals():
    def bumped(inputs, **properties):
        def build(tree, _thing):
            coordinates = shader(tree, "TexCoord").outputs["Object"]
            waves = shader(tree, "TexWave", {"Vector": coordinates, "Scale": 1.5})
            height = next(output for output in waves.outputs if output.type == "VALUE")
            node = shader(tree, "Bump", {"Height": height, **inputs}, **properties)
            return shader(tree, "BsdfDiffuse", {"Normal": node.outputs[0]}).outputs[0]

        return build

    k_cases.append(("Bump", "strength 0.4", bumped({"Strength": 0.4, "Distance": 0.1})))
    k_cases.append(("Bump", "strength 1", bumped({"Strength": 1.0, "Distance": 0.1})))
    k_cases.append(("Bump", "inverted", bumped({"Strength": 1.0, "Distance": 0.1}, invert=True)))
    for space in items("NormalMap", "space"):
        for strength in (1.0, 0.4):

            def normal_map(tree, thing, space=space, strength=strength):
                # Where a normal points into the surface, Cycles from 4.5 on lets it be lit from below: not through a solid.
                thing.visible_shadow = True
                node = shader(tree, "NormalMap", {"Color": (0.7, 0.4, 0.9, 1.0), "Strength": strength}, space=space)
                return shader(tree, "BsdfDiffuse", {"Normal": node.outputs[0]}).outputs[0]

            k_cases.append(("NormalMap", f"{space} strength {strength}", normal_map))

    @case("NormalMap", "as a value", emits=True)
    def value(tree, _thing):
        node = shader(tree, "NormalMap", {"Color": (0.7, 0.4, 0.9, 1.0)})
        return emitted(tree, node.outputs[0])


def add_images():
    for projection in items("TexImage", "projection"):
        for interpolation in items("TexImage", "interpolation"):
            for extension in items("TexImage", "extension") if projection == "FLAT" else ("REPEAT",):

                @emits
                def image(tree, _thing, projection=projection, interpolation=interpolation, extension=extension):
                    coordinates = shader(tree, "TexCoord").outputs["UV" if projection == "FLAT" else "Object"]
                    larger = shader(tree, "Mapping", {"Vector": coordinates, "Scale": (1.7, 1.7, 1.7)}).outputs[0]
                    node = shader(tree, "TexImage", {"Vector": larger}, projection=projection,
                                  interpolation=interpolation, extension=extension, projection_blend=0.3)  # fmt: skip
                    node.image = bpy.data.images["opaque"]
                    return shader(tree, "Emission", {"Color": node.outputs[0]}).outputs[0]

                k_cases.append(("TexImage", f"{projection} {interpolation} {extension}", image))
    for image_name in ("pattern", "float pattern", "non-color"):
        for output in ("Color", "Alpha"):

            @emits
            def image(tree, _thing, image_name=image_name, output=output):
                node = shader(tree, "TexImage")
                node.image = bpy.data.images[image_name]
                return shader(tree, "Emission", {"Color": node.outputs[output]}).outputs[0]

            k_cases.append(("TexImage", f"{image_name}.{output}", image))
    @case("TexImage", "UDIM tiles", emits=True)
    def tiles(tree, _thing):
        coordinates = shader(tree, "TexCoord").outputs["UV"]
        larger = shader(tree, "Mapping", {"Vector": coordinates, "Scale": (3.2, 2.2, 1.0)}).outputs[0]
        node = shader(tree, "TexImage", {"Vector": larger}, interpolation="Closest")
        node.image = bpy.data.images["tiles"]
        return shader(tree, "Emission", {"Color": node.outputs[0]}).outputs[0]

    for kind in ("POINT", "TEXTURE"):

        @emits
        def mapped(tree, _thing, kind=kind):
            coordinates = shader(tree, "TexCoord").outputs["UV"]
            node = shader(tree, "TexImage", {"Vector": coordinates})
            node.image = bpy.data.images["opaque"]
            node.texture_mapping.vector_type = kind
            node.texture_mapping.translation = (0.2, 0.1, 0.0)
            node.texture_mapping.rotation = (0.0, 0.0, 0.5)
            node.texture_mapping.scale = (1.5, 0.8, 1.0)
            return shader(tree, "Emission", {"Color": node.outputs[0]}).outputs[0]

        k_cases.append(("TexImage", f"mapping inside {kind}", mapped))
    for projection in items("TexEnvironment", "projection"):
        for interpolation in items("TexEnvironment", "interpolation"):

            @emits
            def environment(tree, _thing, projection=projection, interpolation=interpolation):
                normal = shader(tree, "NewGeometry").outputs["Normal"]
                node = shader(tree, "TexEnvironment", {"Vector": normal}, projection=projection, interpolation=interpolation)
                node.image = bpy.data.images["opaque"]
                return shader(tree, "Emission", {"Color": node.outputs[0]}).outputs[0]

            k_cases.append(("TexEnvironment", f"{projection} {interpolation}", environment))
    for sky_type in items("TexSky", "sky_type"):

        @emits
        def sky(tree, _thing, sky_type=sky_type):
            normal = shader(tree, "NewGeometry").outputs["Normal"]
            node = shader(tree, "TexSky", sky_type=sky_type)
            if hasattr(node, "sun_disc"):
                node.sun_disc = False
            tree.links.new(normal, node.inputs["Vector"])
            return shader(tree, "Emission", {"Color": node.outputs[0], "Strength": 0.1}).outputs[0]

        k_cases.append(("TexSky", sky_type, sky))

    @case("TexIES", "INTERNAL", emits=True)
    def profile(tree, _thing):
        text = bpy.data.texts.get("profile") or bpy.data.texts.new("profile")
        text.from_string(k_profile)
        normal = shader(tree, "NewGeometry").outputs["Normal"]
        node = shader(tree, "TexIES", {"Vector": normal, "Strength": 0.1}, mode="INTERNAL")
        node.ies = text
        return emitted(tree, node.outputs[0])


k_profile = """IESNA:LM-63-1995
TILT=NONE
1 1000 1.0 7 4 1 2 0 0 0
1.0 1.0 100
0 30 60 90 120 150 180
0 30 60 90
100 90 70 20 10 5 3
100 80 60 30 15 5 3
100 70 50 40 20 5 3
100 60 40 50 25 5 3
"""


def add_groups():
    def nested(tree, depth, source):
        """A group in a group that scales a colour by 0.8 at each level."""
        if depth == 0:
            return source
        group = bpy.data.node_groups.new(f"level {depth}", "ShaderNodeTree")
        if hasattr(group, "interface"):
            group.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketColor")
            group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
        else:
            group.inputs.new("NodeSocketColor", "In")
            group.outputs.new("NodeSocketColor", "Out")
        begin, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
        scaled = shader(group, "VectorMath", operation="MULTIPLY")
        scaled.inputs[1].default_value = (0.8, 0.8, 0.8)
        group.links.new(begin.outputs[0], scaled.inputs[0])
        reroute = group.nodes.new("NodeReroute")
        group.links.new(scaled.outputs[0], reroute.inputs[0])
        group.links.new(nested(group, depth - 1, reroute.outputs[0]), end.inputs[0])
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = group
        tree.links.new(source, node.inputs[0])
        return node.outputs[0]

    for depth in (1, 2, 6):

        @emits
        def groups(tree, _thing, depth=depth):
            source = shader(tree, "NewGeometry").outputs["Normal"]
            return emitted(tree, nested(tree, depth, source))

        k_cases.append(("Group", f"{depth} deep", groups))

    @case("Group", "muted node", emits=True)
    def muted(tree, _thing):
        source = shader(tree, "NewGeometry").outputs["Normal"]
        node = shader(tree, "Gamma", {"Color": source, "Gamma": 3.0})
        node.mute = True
        return emitted(tree, node.outputs[0])

    @case("Group", "muted link", emits=True)
    def muted_link(tree, _thing):
        node = shader(tree, "Gamma", {"Color": (0.2, 0.5, 0.3, 1.0), "Gamma": 2.0})
        link = tree.links.new(shader(tree, "NewGeometry").outputs["Normal"], node.inputs[0])
        link.is_muted = True
        return emitted(tree, node.outputs[0])


def cases_of(kind):
    """[(node, label, build)] of the kind "surface" or "input", in a fixed order."""
    k_cases.clear()
    k_emitting.clear()
    add_simple_shaders()
    add_mixes()
    add_principled()
    add_inputs()
    add_normals()
    add_images()
    add_groups()
    return [found for found in k_cases if (found[2] in k_emitting) == (kind == "input")]
