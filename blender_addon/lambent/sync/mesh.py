# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Meshes: every array is copied from Blender in one call and transformed by numpy, never by a loop over elements."""

import numpy as np

from . import compat, mesh_shape

# Attribute types that can travel as floats: property to read and number of components.
_ATTRIBUTE_TYPES = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, bool),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "QUATERNION": ("value", 4, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
}
_DOMAINS = {"POINT": "vertex", "CORNER": "corner", "FACE": "face"}


def export_mesh(edits, identifier, name, mesh, attribute_names):
    """Puts an evaluated mesh; attribute_names are the generic attributes that some material reads."""
    if len(mesh.loops) == 3 * len(mesh.polygons):
        # A face has at least three corners, so these are triangles already; Blender 3.4 is slow at handing out its own.
        corners = np.arange(len(mesh.loops), dtype=np.int32)
        faces = np.arange(len(mesh.polygons), dtype=np.int32)
    else:
        mesh.calc_loop_triangles()
        corners = np.empty(len(mesh.loop_triangles) * 3, np.int32)
        mesh.loop_triangles.foreach_get("loops", corners)
        faces = compat.triangle_faces(mesh)
    value = {
        "name": name,
        "positions": edits.array(compat.positions(mesh)),
        "triangles": edits.array(compat.corner_vertices(mesh)[corners].astype(np.uint32).reshape(-1, 3)),
        "texture_space": {"location": list(mesh.texspace_location), "size": list(mesh.texspace_size)},
    }
    # Index arrays that say what the protocol assumes without them stay at home.
    if not _counts_up(corners, len(mesh.loops)):
        value["triangle_corners"] = edits.array(corners.view(np.uint32).reshape(-1, 3))
    if not _counts_up(faces, len(mesh.polygons)):
        value["triangle_faces"] = edits.array(faces.view(np.uint32))
    slots = compat.face_materials(mesh)
    if slots is not None and slots.any():
        # Blender shows a slot beyond the last as the last; the object that uses the mesh has as many slots as it.
        last = max(len(mesh.materials) - 1, 0)
        value["triangle_materials"] = edits.array(np.clip(slots, 0, last).astype(np.uint16)[faces])
    if len(faces):
        normals = compat.normals(mesh)
        if normals is not None:
            value["normals"] = {"domain": normals[0], "values": edits.array(normals[1])}
    value["attributes"] = _attributes(edits, mesh, attribute_names)
    active_uv = next((layer.name for layer in mesh.uv_layers if layer.active_render), None)
    if active_uv is not None:
        value["active_uv"] = active_uv
    colors = mesh.color_attributes
    if 0 <= colors.render_color_index < len(colors):
        value["active_color"] = colors[colors.render_color_index].name
    edits.put("mesh", identifier, value)


def _counts_up(indices, count):
    return len(indices) == count and bool((indices == np.arange(count, dtype=np.int32)).all())


def _attributes(edits, mesh, attribute_names):
    found = []
    uv_names = set()
    for layer in mesh.uv_layers:
        uv_names.add(layer.name)
        values = edits.array(compat.uv_values(layer))
        found.append({"name": layer.name, "domain": "corner", "role": "uv", "values": values})
    color_names = {attribute.name for attribute in mesh.color_attributes}
    for attribute in mesh.attributes:
        name = attribute.name
        if name in uv_names or name not in color_names and name not in attribute_names:
            continue
        reading, domain = _ATTRIBUTE_TYPES.get(attribute.data_type), _DOMAINS.get(attribute.domain)
        if reading is None or domain is None:
            continue
        property_name, components, dtype = reading
        values = np.empty(len(attribute.data) * components, dtype)
        attribute.data.foreach_get(property_name, values)
        role = "color" if name in color_names else "generic"
        reference = edits.array(values.astype(np.float32, copy=False).reshape(-1, components))
        found.append({"name": name, "domain": domain, "role": role, "values": reference})
    found += [
        {"name": name, "domain": domain, "role": "generic", "values": edits.array(values.reshape(-1, 1))}
        for name, domain, values in _shape(mesh, attribute_names)
    ]
    return found


def _shape(mesh, attribute_names):
    """(name, domain, float32[n]) of what some material asks for of the mesh's shape."""
    if mesh_shape.POINTINESS in attribute_names:
        edges = compat.edge_vertices(mesh)
        yield mesh_shape.POINTINESS, "vertex", mesh_shape.pointiness(compat.positions(mesh), compat.vertex_normals(mesh), edges)
    if mesh_shape.ISLAND in attribute_names and len(mesh.polygons):
        firsts = np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("loop_start", firsts)
        island = mesh_shape.islands(len(mesh.vertices), compat.edge_vertices(mesh))[compat.corner_vertices(mesh)[firsts]]
        yield mesh_shape.ISLAND, "face", mesh_shape.random_numbers(island)
