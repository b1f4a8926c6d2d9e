# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Node trees as the protocol's GRAPH: groups flattened, reroutes and muted nodes followed through, constants folded in.

A node inside a group is told apart from the same node in another use of the group by its path, the tuple of group nodes
that lead to it. What a socket receives is either a constant (a number, a list, a string), a link, or nothing, where the
socket is one of those that default to something of the surface (normals, texture coordinates).
"""

import contextlib
import sys

import bpy

from . import compat, node_properties, point_density, udim

_FOLDED_CONSTANTS = ("ShaderNodeValue", "ShaderNodeRGB")
# Blender allows no group inside itself; a file that holds one all the same ends here.
_DEEPEST_GROUP = 64
# Python 3.10 and before use the machine's stack for calls, which is why there is a bound.
_LONGEST_CHAIN, _CALLS_A_NODE = 2000, 5
_NUMBERS = ("VALUE", "INT", "BOOLEAN")
_TRIPLES = ("RGBA", "VECTOR")
# Rec. 709 luminance, by which a colour becomes a number when linked to a number's socket.
_LUMINANCE = (0.2126729, 0.7151522, 0.0721750)


class _Nothing:
    """Nothing arrives at a socket by links: its own value counts."""


NOTHING = _Nothing()


class GraphBuilder:
    """Builds one GRAPH. images: callable(bpy image, its ImageUser or None, tile number or None) -> image id or None."""

    def __init__(self, edits, owner_name, images):
        self._edits = edits
        self._owner_name = owner_name
        self._images = images
        self._nodes = []
        self._indices = {}
        self._entered = set()
        self._following = set()
        self._redirected = {}

    def build(self, tree, outputs, aovs=frozenset()):
        """The GRAPH of tree with those of outputs (socket names in lower case: surface, volume, displacement) that are
        linked and all nodes that output aovs (names), or None where there is neither an output node nor an AOV."""
        with _deep_recursion():
            return self._build(tree, outputs, aovs)

    def _build(self, tree, outputs, aovs):
        output_node = tree.get_output_node("CYCLES")
        links = {}
        for socket in output_node.inputs if output_node is not None else ():
            name = socket.identifier.lower()
            if name in outputs:
                value = self._received(socket, ())
                if isinstance(value, dict):
                    links[name] = value["link"]
        found = [self._node_index(node, path) for node, path in _aov_nodes(tree, (), aovs)] if aovs else []
        if found:
            links["aovs"] = found
        return None if output_node is None and not found else {"nodes": self._nodes, "outputs": links}

    def add(self, type_name, name, inputs, properties=None):
        """Adds a node of our own making and returns its index."""
        self._nodes.append({"name": name, "type": type_name, "inputs": inputs, "properties": properties or {}})
        return len(self._nodes) - 1

    def _received(self, socket, path):
        """What links bring to an input socket, converted to its type: a constant, {"link": ..} or NOTHING."""
        value, type_name = self._follow_input(socket, path)
        if value is NOTHING:
            return NOTHING
        return self._convert(value, type_name, socket.type)

    def _follow_input(self, socket, path):
        """(value, socket type it has) of what is linked to an input socket; (NOTHING, None) without a live link."""
        if not socket.is_linked:
            return NOTHING, None
        key = (_key_of(path), socket.as_pointer())
        if key in self._following:
            # A cycle through muted nodes or groups alone: cut here.
            return NOTHING, None
        self._following.add(key)
        try:
            for link in socket.links:
                if link.is_valid and not link.is_muted and link.from_socket.enabled and link.to_socket.enabled:
                    return self._follow_output(link.from_node, link.from_socket, path)
            return NOTHING, None
        finally:
            self._following.discard(key)

    def _follow_output(self, node, socket, path):
        kind = node.bl_idname
        if kind == "NodeReroute":
            return self._follow_input(node.inputs[0], path)
        if node.mute:
            for link in node.internal_links:
                if link.to_socket == socket:
                    return self._follow_input(link.from_socket, path)
            return NOTHING, None
        if kind == "NodeGroupInput":
            return self._follow_group_input(socket, path)
        if node.type in ("GROUP", "CUSTOM GROUP"):
            return self._follow_group(node, socket, path)
        if kind in _FOLDED_CONSTANTS:
            return _constant(socket), socket.type
        if kind == "ShaderNodeAttribute" and getattr(node, "attribute_type", "") == "VIEW_LAYER":
            return _view_layer_attribute(node, socket), socket.type
        index = self._node_index(node, path)
        if index is None:
            return NOTHING, None
        link = self._redirected.get((index, socket.identifier), [index, socket.identifier])
        return {"link": link}, socket.type

    def _follow_group(self, node, socket, path):
        tree = node.node_tree
        inner = next((n for n in tree.nodes if n.bl_idname == "NodeGroupOutput" and n.is_active_output), None) if tree else None
        end = next((s for s in inner.inputs if s.identifier == socket.identifier), None) if inner else None
        if end is None:
            return NOTHING, None
        value, type_name = self._follow_input(end, path + (node,))
        if value is NOTHING:
            constant = _constant(end)
            return (NOTHING, None) if constant is None else (constant, end.type)
        return self._convert(value, type_name, end.type), end.type

    def _follow_group_input(self, socket, path):
        if not path:
            return NOTHING, None
        outer = next((s for s in path[-1].inputs if s.identifier == socket.identifier), None)
        if outer is None:
            return NOTHING, None
        value, type_name = self._follow_input(outer, path[:-1])
        if value is NOTHING:
            constant = _own_value(outer)
            return (NOTHING, None) if constant is None else (constant, outer.type)
        return self._convert(value, type_name, outer.type), outer.type

    def _node_index(self, node, path):
        key = (_key_of(path), node.as_pointer())
        if key in self._indices:
            return self._indices[key]
        if key in self._entered:
            # A cycle, which Blender marks but keeps: cut here.
            return None
        self._entered.add(key)
        inputs = {}
        for socket in node.inputs:
            if not socket.enabled or getattr(socket, "is_unavailable", False):
                continue
            value = self._received(socket, path)
            if value is NOTHING:
                value = _own_value(socket)
            if value is not None:
                inputs[socket.identifier] = value
        properties = node_properties.read(node, self._images, self._edits, self._owner_name)
        if node.bl_idname == "ShaderNodeTexPointDensity":
            point_density.export(self._edits, self._edits.depsgraph, node, self._owner_name, properties)
        self._map_inside(node, inputs, properties)
        if node.bl_idname == "ShaderNodeTexImage" and node.image is not None and node.image.source == "TILED":
            return self._tiled_image(key, node, inputs, properties)
        target = properties.pop("object_transform", None)
        kind = node.bl_idname[len("ShaderNode") :] if node.bl_idname.startswith("ShaderNode") else node.bl_idname
        index = self.add(kind, node.name, inputs, properties)
        self._indices[key] = index
        if target is not None:
            self._object_coordinates(index, node, target)
        return index

    def _tiled_image(self, key, node, inputs, properties):
        vector = inputs.get("Vector")
        if vector is None:
            vector = {"link": [self.add("TexCoord", node.name, {}), "UV"]}
        tiles = [(tile.number, self._images(node.image, node.image_user, tile.number)) for tile in node.image.tiles]
        outputs = udim.add(self, node.name, vector, properties, [tile for tile in tiles if tile[1] is not None])
        index = outputs["Color"][0]
        self._indices[key] = index
        for output, link in outputs.items():
            self._redirected[(index, output)] = link
        return index

    def _map_inside(self, node, inputs, properties):
        """The mapping inside a texture node as a Mapping node before it."""
        mapping = properties.pop("texture_mapping", None)
        if mapping is None:
            return
        vector = inputs.get("Vector")
        if vector is None:
            kind = "UV" if node.bl_idname == "ShaderNodeTexImage" else "Generated"
            vector = {"link": [self.add("TexCoord", node.name, {}), kind]}
        kind, location, rotation, scale = mapping
        mapped = self.add(
            "Mapping", node.name, {"Vector": vector, "Location": location, "Rotation": rotation, "Scale": scale}, {"vector_type": kind}
        )
        inputs["Vector"] = {"link": [mapped, "Vector"]}

    def _object_coordinates(self, index, node, target):
        """Texture coordinates of another object: Mapping of type TEXTURE undoes that object's transform."""
        geometry = self.add("NewGeometry", node.name, {})
        location, rotation, scale = target
        inputs = {
            "Vector": {"link": [geometry, "Position"]},
            "Location": list(location),
            "Rotation": list(rotation),
            "Scale": list(scale),
        }
        mapped = self.add("Mapping", node.name, inputs, {"vector_type": "TEXTURE"})
        self._redirected[(index, "Object")] = [mapped, "Vector"]

    def _convert(self, value, from_type, to_type):
        """value, as it leaves a socket of from_type, as it arrives at one of to_type."""
        if to_type == "SHADER" and from_type != "SHADER":
            # Blender shows a colour that is linked to a shader socket as emission.
            color = value if isinstance(value, dict) else _as_color(value)
            emission = self.add("Emission", "Emission", {"Color": color, "Strength": 1.0})
            return {"link": [emission, "Emission"]}
        if from_type == "SHADER" and to_type != "SHADER":
            return NOTHING
        if isinstance(value, dict):
            return value
        if to_type in _NUMBERS and isinstance(value, list):
            if from_type == "RGBA":
                return sum(a * b for a, b in zip(value, _LUMINANCE))
            return sum(value[:3]) / 3.0
        if to_type in _TRIPLES and not isinstance(value, (list, str)):
            return [float(value)] * 3
        if to_type == "VECTOR" and isinstance(value, list):
            return value[:3]
        return value


@contextlib.contextmanager
def _deep_recursion():
    """Lets chains of nodes be as long as _LONGEST_CHAIN while it holds."""
    usual = sys.getrecursionlimit()
    sys.setrecursionlimit(max(usual, _LONGEST_CHAIN * _CALLS_A_NODE))
    try:
        yield
    finally:
        sys.setrecursionlimit(usual)


def _key_of(path):
    return tuple(group.as_pointer() for group in path)


def _aov_nodes(tree, path, aovs):
    """(node, path) of each AOV Output node of a tree and of the groups in it that writes one of aovs."""
    for node in tree.nodes:
        if node.mute:
            continue
        if node.bl_idname == "ShaderNodeOutputAOV":
            if compat.aov_name(node) in aovs:
                yield node, path
        elif node.type in ("GROUP", "CUSTOM GROUP") and node.node_tree is not None and len(path) < _DEEPEST_GROUP:
            yield from _aov_nodes(node.node_tree, path + (node,), aovs)


def _view_layer_attribute(node, socket):
    """What an Attribute node reads of the view layer or the scene: the same everywhere, so a constant."""
    from . import material

    context = bpy.context
    value = material.datablock_attribute((context.view_layer, context.scene), node.attribute_name) or [0.0] * 4
    if socket.identifier == "Alpha":
        return value[3]
    return sum(value[:3]) / 3.0 if socket.identifier == "Fac" else value[:3]


def _as_color(value):
    return value[:3] if isinstance(value, list) else [float(value)] * 3


def _own_value(socket):
    """The value that an input has where nothing arrives, or None where the node has a default of its own (normals, coordinates)."""
    # Hidden numbers (a hair's Random) have values all the same.
    hidden = socket.hide_value and socket.type not in _NUMBERS
    if hidden and socket.is_linked:
        # By a muted link, then. Blender 5 hides the values of all linked inputs.
        hidden = socket.type == "VECTOR" and (
            socket.name.endswith(("Normal", "Tangent")) or socket.node.bl_idname.startswith("ShaderNodeTex")
        )
    return None if hidden else _constant(socket)


def _constant(socket):
    """The value of an unlinked socket, or None for sockets that have none (shaders)."""
    return node_properties.plain(socket.default_value) if hasattr(socket, "default_value") else None
