# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""A node's own settings under Blender's property names, read through its RNA, so that no node needs code of its own."""

import bpy

from . import compat

# As many as Blender hands to Cycles, at the same places.
CURVE_SAMPLES = compat.RAMP_TABLE_ROWS

_BASE_PROPERTIES = frozenset(bpy.types.Node.bl_rna.properties.keys()) | {"node_tree", "interface"}


def read(node, images, edits, owner_name):
    """{property: number, boolean, string or list}, with image, ramp and curves as the protocol has them.

    Two are not properties of the protocol: "object_transform", (location, rotation, scale) of the object a node points to, and
    "texture_mapping", (vector type, location, rotation, scale) of the mapping inside a texture node that has one.
    """
    found = {}
    for definition in node.bl_rna.properties:
        name = definition.identifier
        if name in _BASE_PROPERTIES or definition.is_hidden and name != "image":
            continue
        if definition.type == "POINTER":
            _read_pointer(node, name, getattr(node, name), images, edits, owner_name, found)
        elif definition.type != "COLLECTION":
            value = plain(getattr(node, name))
            if value is not None:
                found[name] = value
    special = _SPECIAL.get(node.bl_idname)
    if special is not None:
        special(node, found)
    return found


def _principled(node, found):
    found["generation"] = 2 if "Subsurface Weight" in node.inputs else 1


def _normal(node, found):
    # The direction is kept as the default of the output.
    found["direction"] = list(node.outputs["Normal"].default_value)


def _light_profile(node, found):
    """The text of an IES file as the property "profile"; empty where it cannot be read."""
    found.pop("filepath", None)
    found["profile"] = ""
    if node.mode == "INTERNAL":
        if node.ies is not None:
            found["profile"] = node.ies.as_string()
    elif node.filepath:
        path = bpy.path.abspath(node.filepath, library=node.id_data.library)
        try:
            with open(path, encoding="latin-1") as file:
                found["profile"] = file.read()
        except OSError:
            pass


def _raycast(node, found):
    # Of which type an item is: its sockets have the name alone.
    for socket in node.outputs:
        if socket.identifier.startswith("Attribute_") and not socket.identifier.endswith("_Alpha"):
            item = socket.identifier[len("Attribute_") :]
            found["type_" + item] = "FLOAT" if socket.type == "VALUE" else socket.type


def _aov(node, found):
    found.pop("aov_name", None)
    found["aov"] = compat.aov_name(node)


_SPECIAL = {
    "ShaderNodeOutputAOV": _aov,
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeNormal": _normal,
    "ShaderNodeRaycast": _raycast,
    "ShaderNodeTexIES": _light_profile,
}


def _read_pointer(node, name, value, images, edits, owner_name, found):
    if value is None:
        return
    if isinstance(value, bpy.types.Image):
        if value.source == "TILED" and node.bl_idname == "ShaderNodeTexImage":
            return  # graph.py makes a node for each tile.
        identifier = images(value, getattr(node, "image_user", None))
        if identifier is not None:
            found["image"] = identifier
    elif isinstance(value, bpy.types.ColorRamp):
        found["ramp"], found["ramp_interpolation"] = _ramp(value)
        found["table_rows"] = CURVE_SAMPLES
    elif isinstance(value, bpy.types.CurveMapping):
        found["curves"] = _curves(node, value)
        found["extend"] = value.extend
        found["table_rows"] = CURVE_SAMPLES
    elif isinstance(value, bpy.types.Object):
        location, rotation, scale = value.matrix_world.decompose()
        found["object_transform"] = (location, rotation.to_euler("XYZ"), scale)
    elif isinstance(value, bpy.types.TexMapping):
        if not _is_identity(value):
            found["texture_mapping"] = (value.vector_type, list(value.translation), list(value.rotation), list(value.scale))
            if not _is_plain(value):
                edits.unsupported(
                    owner_name,
                    f"{owner_name}: node '{node.name}': of the mapping inside it, limits, exchanged axes and projection are ignored",
                )
    elif isinstance(value, bpy.types.Text) and node.bl_idname != "ShaderNodeTexIES":
        edits.unsupported(owner_name, f"{owner_name}: the text that node '{node.name}' reads ({value.name}) is ignored")


def plain(value):
    """value as the wire has constants: number, boolean, string or a list of 2 to 4 numbers; None for anything else."""
    if isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, set):
        return None
    try:
        components = [float(component) for component in value]
    except (TypeError, ValueError):
        return None
    return components if 2 <= len(components) <= 4 else None


def _ramp(ramp):
    """(stops, "LINEAR" or "CONSTANT"): what is neither is sampled, since a dense linear ramp can stand for any."""
    if ramp.color_mode == "RGB" and ramp.interpolation in ("LINEAR", "CONSTANT"):
        return [[stop.position, *stop.color] for stop in ramp.elements], ramp.interpolation
    positions = [i / (CURVE_SAMPLES - 1) for i in range(CURVE_SAMPLES)]
    return [[position, *ramp.evaluate(position)] for position in positions], "LINEAR"


def _curves(node, mapping):
    """One sampled curve for each component, the combined curve of RGB Curves included."""
    mapping.initialize()
    curves = list(mapping.curves)
    low = min(curve.points[0].location[0] for curve in curves)
    high = max(curve.points[-1].location[0] for curve in curves)
    positions = [low + (high - low) * i / (CURVE_SAMPLES - 1) for i in range(CURVE_SAMPLES)]
    combined = curves.pop() if node.bl_idname == "ShaderNodeRGBCurve" else None
    through = [mapping.evaluate(combined, x) for x in positions] if combined else positions
    return [[[x, mapping.evaluate(curve, y)] for x, y in zip(positions, through)] for curve in curves]


def _is_identity(mapping):
    return (
        not any(mapping.translation)
        and not any(mapping.rotation)
        and all(component == 1.0 for component in mapping.scale)
        and _is_plain(mapping)
    )


def _is_plain(mapping):
    """Whether location, rotation and scale are all that a TexMapping has."""
    return (
        not mapping.use_min
        and not mapping.use_max
        and (mapping.mapping_x, mapping.mapping_y, mapping.mapping_z) == ("X", "Y", "Z")
        and mapping.mapping == "FLAT"
    )
