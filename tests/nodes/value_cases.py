"""The cases of nodes that compute values: every node, every item of its enumerated properties, every output. Runs inside
Blender.

A case is compared on a patch of faces. Each face has its own inputs as face attributes, so that all points of a face have the
same inputs, bit for bit but for the rounding of the interpolation: what the two engines compute must agree to rounding.
"""

import itertools

import bpy

# Face attributes of a patch (render_nodes.py fills them), by the name that the tables below use.
k_vectors = ("v", "v2", "v3")  # in [-2.5, 2.5]
k_colors = ("c", "c2")  # in [0, 1.2]
k_numbers = {"s": "in [-2.5, 2.5]", "t": "in [0, 1]", "u": "in [0, 1]"}

# What feeds the inputs whose plain rule (see `drive`) would not exercise them: an attribute's name or a constant.
k_inputs = {
    "Blackbody": {"Temperature": "kelvin"},
    "Wavelength": {"Wavelength": "nanometres"},
    "BrightContrast": {"Bright": 0.1, "Contrast": 0.3},
    "Clamp": {"Value": "s", "Min": 0.6, "Max": -0.3},
    "FloatCurve": {"Factor": 0.8, "Value": "s"},
    "Gamma": {"Gamma": "s"},
    "HueSaturation": {"Hue": "t", "Saturation": 1.4, "Value": 1.1, "Fac": 0.8},
    "LightFalloff": {"Strength": "t", "Smooth": 0.3},
    "MapRange": {"Value": "s", "From Min": -1.0, "From Max": 1.5, "To Min": 2.0, "To Max": -0.5, "Steps": 3.0,
                 "From_Min_FLOAT3": (-1.0, -0.5, 0.0), "From_Max_FLOAT3": (1.5, 1.0, 2.0),
                 "To_Min_FLOAT3": (0.2, 2.0, -1.0), "To_Max_FLOAT3": (1.0, -0.5, 3.0), "Steps_FLOAT3": (3.0, 4.0, 2.5)},
    "Mapping": {"Location": (0.3, -0.2, 0.5), "Rotation": (0.4, 1.1, -0.7), "Scale": (1.5, 0.7, -2.0)},
    "Math": {"Value": "s", "Value_001": "s2", "Value_002": "t"},
    "Mix": {"Factor_Float": "s", "Factor_Vector": "v3", "A_Float": "s2", "B_Float": 0.7},
    "MixRGB": {"Fac": "s"},
    "RGBCurve": {"Fac": 0.8},
    "Squeeze": {"Value": "s", "Width": 1.7, "Center": 0.2},
    "ValToRGB": {"Fac": "t"},
    "VectorCurve": {"Fac": 0.8},
    "VectorMath": {"Scale": "s"},
    "VectorRotate": {"Center": (0.3, -0.2, 0.5), "Axis": (0.2, 0.5, 1.0), "Angle": "s", "Rotation": (0.4, 1.1, -0.7)},
    "TexBrick": {"Scale": 1.7, "Mortar Size": 0.05, "Mortar Smooth": 0.3, "Bias": 0.1, "Brick Width": 0.6,
                 "Row Height": 0.3, "Mortar": (0.1, 0.6, 0.2, 1.0)},
    "TexChecker": {"Scale": 1.7},
    "TexGabor": {"Scale": 1.7, "Frequency": 2.3, "Anisotropy": "t", "Orientation": 0.6, "Orientation_2D": 0.6,
                 "Orientation_3D": (0.4, 0.8, 0.2)},
    "TexMagic": {"Scale": 1.7, "Distortion": 1.3},
    "TexMusgrave": {"W": "s", "Scale": 1.7, "Detail": 3.4, "Dimension": 0.8, "Lacunarity": 2.2, "Offset": 0.4, "Gain": 1.6},
    "TexNoise": {"W": "s", "Scale": 1.7, "Detail": 3.4, "Roughness": 0.6, "Lacunarity": 2.2, "Offset": 0.4, "Gain": 1.6,
                 "Distortion": 0.7},
    "TexVoronoi": {"W": "s", "Scale": 1.7, "Detail": 1.6, "Roughness": 0.6, "Lacunarity": 2.2, "Smoothness": 0.7,
                   "Exponent": 0.8, "Randomness": 0.9},
    "TexWave": {"Scale": 1.7, "Distortion": 1.3, "Detail": 2.4, "Detail Scale": 1.2, "Detail Roughness": 0.6,
                "Phase Offset": 0.5},
    "TexWhiteNoise": {"W": "s"},
}  # fmt: skip

# Further settings of a node that no enumeration shows: label -> {input or property: value}.
k_variants = {
    "TexBrick": {"squashed": {"offset": 0.3, "offset_frequency": 3, "squash": 1.6, "squash_frequency": 2}},
    "TexMagic": {f"depth {depth}": {"turbulence_depth": depth} for depth in (0, 1, 5, 10)},
    "TexNoise": {
        "no detail": {"Detail": 0.0},
        "15 octaves": {"Detail": 15.0, "Roughness": 0.5},
        "undistorted": {"Distortion": 0.0},
        "rough": {"Roughness": 1.0},
    },
    "TexMusgrave": {"no detail": {"Detail": 0.0}, "dimension 2": {"Dimension": 2.0}, "negative offset": {"Offset": -0.5}},
    "TexVoronoi": {
        "regular": {"Randomness": 0.0},
        "exponent 0.5": {"distance": "MINKOWSKI", "Exponent": 0.5},
        "exponent 3": {"distance": "MINKOWSKI", "Exponent": 3.0},
        "sharp": {"feature": "SMOOTH_F1", "Smoothness": 0.0},
        "detailed": {"Detail": 4.0, "Roughness": 0.8},
    },
    "TexWave": {"undistorted": {"Distortion": 0.0}, "no detail": {"Detail": 0.0}},
    "ValToRGB": {
        f"{mode} {interpolation}": {"ramp": (mode, interpolation)}
        for mode, interpolation in itertools.chain(
            itertools.product(["RGB"], ["EASE", "CARDINAL", "LINEAR", "B_SPLINE", "CONSTANT"]),
            itertools.product(["HSV", "HSL"], ["NEAR", "FAR", "CW", "CCW"]),
        )
    },
    "RGBCurve": {"curved": {"curves": True}},
    "VectorCurve": {"curved": {"curves": True}},
    "FloatCurve": {"curved": {"curves": True}},
}

# Nodes that read what a flat patch with uniform faces cannot show; surface_cases.py has them.
k_elsewhere = {
    "AddShader", "AmbientOcclusion", "Attribute", "Background", "Bevel", "Bump", "CameraData", "Displacement", "EeveeSpecular",
    "Emission", "Fresnel", "HairInfo", "Holdout", "LayerWeight", "LightFalloff", "LightPath", "MixShader", "NewGeometry",
    "NormalMap", "ObjectInfo", "ParticleInfo", "PointInfo", "Script", "ShaderToRGB", "SubsurfaceScattering", "Tangent",
    "TexCoord", "TexEnvironment", "TexIES", "TexImage", "TexPointDensity", "TexSky", "UVAlongStroke", "UVMap",
    "VectorDisplacement", "VectorTransform", "VertexColor", "VolumeInfo", "Wireframe", "Group", "Raycast",
}  # fmt: skip
# Of these a part of the items only makes a difference: the others are not multiplied with them.
k_irrelevant = {
    # node: (property, its item, properties that do nothing then)
    "MapRange": [],
    "TexWave": [("wave_type", "BANDS", ("rings_direction",)), ("wave_type", "RINGS", ("bands_direction",))],
    "Mix": [("data_type", "FLOAT", ("blend_type", "factor_mode")), ("data_type", "VECTOR", ("blend_type",)),
            ("data_type", "RGBA", ("factor_mode",)), ("data_type", "ROTATION", ("blend_type", "factor_mode"))],
    "TexVoronoi": [("feature", "DISTANCE_TO_EDGE", ("distance",)), ("feature", "N_SPHERE_RADIUS", ("distance",)),
                   ("voronoi_dimensions", "1D", ("distance",))],
}  # fmt: skip
k_base_properties = frozenset(bpy.types.Node.bl_rna.properties.keys())


def value_nodes():
    """Identifiers, without ShaderNode, of the nodes that this file covers."""
    tree = bpy.data.node_groups.new("probe", "ShaderNodeTree")
    names = []
    for name in sorted(dir(bpy.types)):
        short = name[len("ShaderNode") :]
        if not name.startswith("ShaderNode") or short in k_elsewhere or short.startswith(("Output", "Bsdf", "Volume")):
            continue
        try:
            node = tree.nodes.new(name)
        except RuntimeError:  # abstract, or of another editor
            continue
        if any(socket.type != "SHADER" for socket in node.outputs):
            names.append(short)
    bpy.data.node_groups.remove(tree)
    return names


def options_of(node):
    """[{property: item}]: every combination of the enumerated and boolean properties that makes a difference."""
    choices = {}
    for definition in node.bl_rna.properties:
        if definition.identifier in k_base_properties or definition.is_hidden:
            continue
        if definition.type == "ENUM":
            choices[definition.identifier] = [
                item.identifier for item in definition.enum_items if _settable(node, definition.identifier, item.identifier)
            ]
        elif definition.type == "BOOLEAN":
            choices[definition.identifier] = [False, True]
    rules = k_irrelevant.get(node.bl_idname[len("ShaderNode") :], [])
    found = []
    for items in itertools.product(*choices.values()):
        options = dict(zip(choices, items))
        for name, item, idle in rules:
            if options.get(name) == item and any(options[other] != choices[other][0] for other in idle if other in choices):
                break
        else:
            found.append(options)
    return found


def _settable(node, name, item):
    """Whether the item is one for shader nodes: some are of the same node in other editors."""
    before = getattr(node, name)
    try:
        setattr(node, name, item)
    except TypeError:
        return False
    setattr(node, name, before)
    return True


def value_cases():
    """[{"node", "options", "variant", "output"}], in a fixed order."""
    cases = []
    for name in value_nodes():
        tree = bpy.data.node_groups.new("probe", "ShaderNodeTree")
        node = tree.nodes.new("ShaderNode" + name)
        for options in options_of(node):
            for key, item in options.items():
                setattr(node, key, item)
            for socket in node.outputs:
                if socket.enabled and not getattr(socket, "is_unavailable", False):
                    cases.append({"node": name, "options": options, "variant": "", "output": socket.identifier})
        for variant in k_variants.get(name, {}):
            for socket in tree.nodes.new("ShaderNode" + name).outputs:
                if socket.enabled:
                    cases.append({"node": name, "options": {}, "variant": variant, "output": socket.identifier})
        bpy.data.node_groups.remove(tree)
    return cases


def build(case, tree):
    """Makes the case's node in a tree, its inputs fed; returns the socket to look at."""
    name = case["node"]
    node = tree.nodes.new("ShaderNode" + name)
    for key, item in case["options"].items():
        setattr(node, key, item)
    settings = dict(k_variants.get(name, {}).get(case["variant"], {}))
    for key in list(settings):
        if key in node.bl_rna.properties and key != "name":
            setattr(node, key, settings.pop(key))
    if "ramp" in settings or name == "ValToRGB":
        _set_ramp(node.color_ramp, *settings.pop("ramp", ("RGB", "LINEAR")))
    if settings.pop("curves", False):
        _set_curves(node)
    if name == "Value":
        node.outputs[0].default_value = 0.37
    elif name == "RGB":
        node.outputs[0].default_value = (0.2, 0.5, 0.8, 1.0)
    elif name == "Normal":
        node.outputs["Normal"].default_value = (0.6, 0.0, 0.8)
    fed = {"VECTOR": 0, "RGBA": 0, "VALUE": 0}
    for socket in node.inputs:
        if socket.enabled and not getattr(socket, "is_unavailable", False):
            _feed(tree, name, socket, settings, fed)
    return next(socket for socket in node.outputs if socket.identifier == case["output"])


def _feed(tree, name, socket, settings, fed):
    source = settings.get(socket.identifier, k_inputs.get(name, {}).get(socket.identifier))
    if source is None:
        by_type = {"VECTOR": k_vectors, "RGBA": k_colors, "VALUE": ("t", "u")}.get(socket.type)
        if by_type is None or fed[socket.type] >= len(by_type):
            return
        source = by_type[fed[socket.type]]
        fed[socket.type] += 1
    if isinstance(source, str):
        if socket.type in ("MENU", "STRING", "BOOLEAN"):
            return
        attribute = tree.nodes.new("ShaderNodeAttribute")
        attribute.attribute_name = source
        output = attribute.outputs["Fac" if socket.type in ("VALUE", "INT") else "Vector"]
        tree.links.new(output, socket)
    else:
        socket.default_value = source


def _set_ramp(ramp, mode, interpolation):
    ramp.color_mode = mode
    if mode == "RGB":
        ramp.interpolation = interpolation
    else:
        ramp.hue_interpolation = interpolation
    ramp.elements[0].position, ramp.elements[0].color = 0.1, (0.9, 0.1, 0.2, 0.3)
    ramp.elements[1].position, ramp.elements[1].color = 0.83, (0.1, 0.2, 0.9, 1.0)
    middle = ramp.elements.new(0.4)
    middle.color = (0.2, 0.8, 0.3, 0.6)


def _set_curves(node):
    mapping = node.mapping
    for index, curve in enumerate(mapping.curves):
        curve.points[0].location = (curve.points[0].location[0], 0.1 + 0.05 * index)
        curve.points.new(0.4, 0.7 - 0.1 * index)
        curve.points.new(0.7, 0.3 + 0.1 * index)
    mapping.update()
