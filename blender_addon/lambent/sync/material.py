# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Materials, and the node graphs of materials, worlds and lights."""

from . import compat, image, mesh_shape
from .edits import DEFAULT_MATERIAL
from .graph import GraphBuilder

# As Cycles calls it in Cryptomatte.
_DEFAULT_NAME = "default_surface"


def export_graph(edits, datablock, outputs, aovs=frozenset()):
    """The GRAPH of a material, world or light with the given outputs and what outputs aovs (names of shader AOVs); None where
    there is neither."""
    builder = GraphBuilder(edits, datablock.name_full, lambda found, user, tile=None: image.export_image(edits, found, user, tile))
    graph = builder.build(datablock.node_tree, outputs, aovs)
    if graph is None:
        return None
    graph["cycles_version"] = compat.CYCLES_VERSION
    if "volume" in graph["outputs"]:
        _replace_volume(edits, datablock, builder, graph)
    return graph


def export_material(edits, material):
    """Puts a material (evaluated, or None for the default surface) once and returns its id."""
    if material is None:
        if not edits.contains("material", DEFAULT_MATERIAL):
            graph = _single_node("BsdfDiffuse", "BSDF", {"Color": [0.8, 0.8, 0.8], "Roughness": 0.0})
            edits.put("material", DEFAULT_MATERIAL, {"name": _DEFAULT_NAME, "graph": graph})
        edits.mattes["material"].add(_DEFAULT_NAME)
        return DEFAULT_MATERIAL
    identifier = material.name_full
    edits.mattes["material"].add(material.name)
    if edits.contains("material", identifier):
        return identifier
    try:
        _put_material(edits, material, identifier)
    except Exception as error:  # One material must not take its objects with it; what fails is reported.
        edits.report("error", "export_failed", identifier, f"{identifier}: could not be exported; grey stands in for it: {error!r}")
        return export_material(edits, None)
    return identifier


def _put_material(edits, material, identifier):
    name = material.name_full
    if material.is_grease_pencil:
        edits.unsupported(name, f"{name}: grease pencil material; a diffuse surface stands in for it")
    if compat.uses_nodes(material):
        graph = export_graph(edits, material, ("surface", "volume", "displacement"), edits.aovs)
        method = compat.displacement_method(material)
        if graph is not None and "displacement" in graph["outputs"] and method != "BUMP":
            graph["displacement_method"] = "DISPLACEMENT" if method == "TRUE" else method
        graph = graph or {"nodes": [], "outputs": {}}
        if not compat.bump_map_correction(material):
            graph["bump_map_correction"] = False
        if not compat.transparent_shadow(material):
            graph["transparent_shadow"] = False
    else:
        graph = _single_node("BsdfDiffuse", "BSDF", {"Color": list(material.diffuse_color)[:3], "Roughness": 0.0})
    # Cryptomatte goes by the name without the library.
    edits.put("material", identifier, {"name": material.name, "graph": graph, "pass_index": material.pass_index})


def background_graph(color):
    """A GRAPH of one background of linear RGB color and strength 1."""
    return _single_node("Background", "Background", {"Color": list(color), "Strength": 1.0})


# Outputs of the Geometry node that are worked out from the mesh, and the attributes that they travel as.
_SHAPE = {"Pointiness": mesh_shape.POINTINESS, "Random Per Island": mesh_shape.ISLAND}


def attribute_names(materials):
    """Names of the mesh attributes that nodes of these materials read, groups included."""
    names = set()
    for node in _all_nodes(materials):
        if node.bl_idname == "ShaderNodeAttribute":
            names.add(node.attribute_name)
        elif node.bl_idname == "ShaderNodeVertexColor":
            names.add(node.layer_name)
        elif node.bl_idname == "ShaderNodeNewGeometry":
            names.update(name for output, name in _SHAPE.items() if node.outputs[output].is_linked)
        elif node.bl_idname == "ShaderNodeRaycast" or getattr(node, "node_tree", None) is not None:
            # Texts name attributes of what rays meet; groups hand them on.
            names.update(socket.default_value for socket in node.inputs if socket.type == "STRING")
    return names


def object_attribute_names(materials):
    """Names that nodes of these materials look up on objects or instancers, groups included."""
    return {
        node.attribute_name
        for node in _all_nodes(materials)
        if node.bl_idname == "ShaderNodeAttribute" and node.attribute_type in ("OBJECT", "INSTANCER") and node.attribute_name
    }


def datablock_attribute(datablocks, name):
    """[r, g, b, a] of the first of some datablocks that has a custom property or property path of a name, else None.

    As Blender: a number counts for all channels, and alpha is 1 where there is none.
    """
    for datablock in datablocks:
        for path in (f'["{name}"]', name):
            try:
                value = datablock.path_resolve(path)
            except (AttributeError, ValueError):
                continue
            if isinstance(value, (bool, int, float)):
                return [float(value)] * 3 + [1.0]
            try:
                numbers = [float(component) for component in value]
            except (TypeError, ValueError):
                continue
            if 1 <= len(numbers) <= 4:
                return (numbers + [0.0] * 3)[:3] + (numbers[3:] or [1.0])
    return None


def any_node(materials, kinds):
    """Whether a node of one of these bl_idnames is in these materials, groups included."""
    return any(node.bl_idname in kinds for node in _all_nodes(materials))


def _all_nodes(materials):
    trees = [material.node_tree for material in materials if material.node_tree is not None]
    seen = set()
    while trees:
        tree = trees.pop()
        if tree in seen:
            continue
        seen.add(tree)
        for node in tree.nodes:
            if getattr(node, "node_tree", None) is not None:
                trees.append(node.node_tree)
            yield node


def _replace_volume(edits, datablock, builder, graph):
    name = datablock.name_full
    del graph["outputs"]["volume"]
    if "surface" in graph["outputs"]:
        edits.unsupported(name, f"{name}: its volume is not supported and left out; its surface is rendered")
    else:
        node = builder.add("BsdfTransparent", "Transparent BSDF", {"Color": [1.0, 1.0, 1.0]})
        graph["outputs"]["surface"] = [node, "BSDF"]
        edits.unsupported(name, f"{name}: its volume is not supported; a transparent surface stands in for it")


def _single_node(kind, output, inputs):
    node = {"name": kind, "type": kind, "inputs": inputs, "properties": {}}
    return {"nodes": [node], "outputs": {"surface": [0, output]}}
