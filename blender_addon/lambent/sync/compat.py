# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""What differs between Blender 3.4 and 5.2. The rest of the add-on asks here and never looks at a version number."""

import math
import os

import bpy
import numpy as np
from bl_ui import properties_view_layer

# foreach_get looks at the first item to learn the type, and before 5.0 that leaks the instances of the object it comes
# from, which Blender reports as an error when it quits.
FOREACH_LEAKS_INSTANCES = bpy.app.version < (5, 0, 0)

# Rows of the tables into which Blender samples ramps and curves for Cycles (3.4, 4.3 and 5.2 were looked at).
RAMP_TABLE_ROWS = 257 if bpy.app.version >= (4, 0, 0) else 256

# Passes are called "Diffuse Direct" and not "DiffDir" since 5.0.
LONG_PASS_NAMES = bpy.app.version >= (5, 0, 0)

# Where nothing is met, the pass Vector has the motion of the world.
WORLD_MOVES = bpy.app.version >= (5, 2, 0)

# What denoisers are to see of mirrors and glass fades into what those show, instead of changing at one roughness.
FEATURES_ARE_BLENDED = bpy.app.version >= (5, 1, 0)

# Whose rules shaders follow, as the daemon counts versions of Cycles.
CYCLES_VERSION = 100 * bpy.app.version[0] + bpy.app.version[1]


def _layer_panel(name):
    """Blender's class that draws a panel of a view layer, called otherwise in later versions."""
    return getattr(properties_view_layer, f"{name}Helper", None) or getattr(properties_view_layer, name)


AOVPanel = _layer_panel("ViewLayerAOVPanel")
CryptomattePanel = _layer_panel("ViewLayerCryptomattePanel")
LightGroupsPanel = _layer_panel("ViewLayerLightgroupsPanel")


def corner_vertices(mesh):
    """int32[corners]: the vertex of each face corner."""
    values = np.empty(len(mesh.loops), np.int32)
    attribute = mesh.attributes.get(".corner_vert")
    if attribute is not None:
        attribute.data.foreach_get("value", values)
    else:
        mesh.loops.foreach_get("vertex_index", values)
    return values


def positions(mesh):
    """float32[vertices][3] in object space."""
    values = np.empty(len(mesh.vertices) * 3, np.float32)
    attribute = mesh.attributes.get("position")
    if attribute is not None:
        attribute.data.foreach_get("vector", values)
    else:
        mesh.vertices.foreach_get("co", values)
    return values.reshape(-1, 3)


def edge_vertices(mesh):
    """int32[edges][2]."""
    values = np.empty(len(mesh.edges) * 2, np.int32)
    mesh.edges.foreach_get("vertices", values)
    return values.reshape(-1, 2)


def vertex_normals(mesh):
    """float32[vertices][3], unit, whatever the shading."""
    return _vectors(mesh.vertices, "normal")


def triangle_faces(mesh):
    """int32[triangles]: the face of each triangle; calc_loop_triangles must have been called."""
    values = np.empty(len(mesh.loop_triangles), np.int32)
    if hasattr(mesh, "loop_triangle_polygons"):
        mesh.loop_triangle_polygons.foreach_get("value", values)
    else:
        mesh.loop_triangles.foreach_get("polygon_index", values)
    return values


def face_materials(mesh):
    """int32[faces]: material slots, or None where all faces use the first."""
    attribute = mesh.attributes.get("material_index")
    if attribute is not None and attribute.domain == "FACE" and attribute.data_type == "INT":
        values = np.empty(len(mesh.polygons), np.int32)
        attribute.data.foreach_get("value", values)
        return values
    return None


def normals(mesh):
    """("vertex" or "corner", float32[n][3]) shading normals, or None where all faces are flat; zero: flat there.

    Blender before 4.1 computes corner normals on request and keeps them in the mesh; they are freed again here.
    """
    if hasattr(mesh, "normals_domain"):
        domain = mesh.normals_domain
        if domain == "FACE":
            return None
        if domain == "POINT":
            return "vertex", _vectors(mesh.vertex_normals, "vector")
        return "corner", _vectors(mesh.corner_normals, "vector")
    smooth = np.empty(len(mesh.polygons), bool)
    mesh.polygons.foreach_get("use_smooth", smooth)
    custom = mesh.use_auto_smooth and mesh.has_custom_normals
    if not smooth.any() and not custom:
        return None
    if smooth.all() and not mesh.use_auto_smooth:
        return "vertex", _vectors(mesh.vertex_normals, "vector")
    mesh.calc_normals_split()
    values = _vectors(mesh.loops, "normal")
    mesh.free_normals_split()
    if not mesh.use_auto_smooth:
        # Without auto smooth Cycles shades each triangle of these by itself, and displacement keeps them so.
        values[np.repeat(~smooth, _face_sizes(mesh))] = 0.0
    return "corner", values


def _face_sizes(mesh):
    """int32[faces]: numbers of corners."""
    sizes = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", sizes)
    return sizes


def uv_values(layer):
    """float32[corners][2] of a UV layer."""
    collection, name = (layer.uv, "vector") if hasattr(layer, "uv") else (layer.data, "uv")
    values = np.empty(len(collection) * 2, np.float32)
    collection.foreach_get(name, values)
    return values.reshape(-1, 2)


def write_pass(render_pass, pixels):
    """Writes float32[height][width][channels] (row 0 at the bottom) to a render pass of that size.

    Blender 5 wants as many numbers as the pass has, earlier versions as many items as it has pixels.
    """
    global _flat_pass_writes
    flat = np.ascontiguousarray(pixels, np.float32).reshape(-1)
    try:
        render_pass.rect.foreach_set(flat if _flat_pass_writes else flat.reshape(-1, pixels.shape[-1]))
    except TypeError:
        _flat_pass_writes = not _flat_pass_writes
        render_pass.rect.foreach_set(flat if _flat_pass_writes else flat.reshape(-1, pixels.shape[-1]))


_flat_pass_writes = bpy.app.version >= (5, 0, 0)


def light_color(light):
    """Linear RGB of a light, its colour temperature included."""
    color = light.color
    if getattr(light, "use_temperature", False):
        return [a * b for a, b in zip(color, light.temperature_color)]
    return list(color)


def light_energy(light):
    """A light's energy in the wire's unit, that of Blender 3: an area light's radiance is energy / (4 area).

    Since 4.0 Blender's is energy / (pi area); it multiplies the energy of area lights in older files by pi/4.
    """
    if light.type == "AREA" and bpy.app.version >= (4, 0, 0):
        return light.energy * 4.0 / math.pi
    return light.energy


def light_shadows(light):
    """Whether a light casts shadows: Cycles' own switch before 4.2, Blender's since."""
    cycles = getattr(light, "cycles", None)
    if cycles is not None and hasattr(cycles, "cast_shadow"):
        return cycles.cast_shadow
    return light.use_shadow


def owner_of_switch(material, name):
    """Who has a switch that Cycles looks at: the material, where it moved to since 4.1 and 4.2, or its Cycles settings; None: nobody."""
    owners = (material, getattr(material, "cycles", None))
    return next((owner for owner in owners if hasattr(owner, name)), None)


def _switch(material, name, otherwise):
    return getattr(owner_of_switch(material, name), name, otherwise)


def displacement_method(material):
    """"BUMP", "DISPLACEMENT" or "BOTH"."""
    return _switch(material, "displacement_method", "BUMP")


def adaptive_subdivision(found):
    """Whether Cycles would subdivide a (evaluated) object by its size in the picture: the object's own switch before 5.0, its
    last modifier's since."""
    last = found.modifiers[-1] if len(found.modifiers) else None
    if last is None or last.type != "SUBSURF":
        return False
    if hasattr(last, "use_adaptive_subdivision"):
        return last.use_adaptive_subdivision
    return getattr(getattr(found, "cycles", None), "use_adaptive_subdivision", False)


def transparent_shadow(material):
    """Whether shadow rays go through what is transparent. Files of before 4.2 come to later Blenders with it off where EEVEE's were
    opaque."""
    return _switch(material, "use_transparent_shadow", True)


def bump_map_correction(material):
    """Whether bumped diffuse surfaces darken towards the terminator: a switch of Cycles' since 4.2."""
    return _switch(material, "use_bump_map_correction", True)


def aov_name(node):
    """The name of the AOV that an AOV Output node writes; before 4.2 it hides the node's own name."""
    return node.aov_name if hasattr(node, "aov_name") else node.name


def uses_nodes(datablock):
    """Whether a material, world or light is described by its node tree (always, for materials and worlds, since 5.0)."""
    if datablock.node_tree is None:
        return False
    return bpy.app.version >= (5, 0, 0) and not isinstance(datablock, bpy.types.Light) or datablock.use_nodes


def color_management_path():
    """The OpenColorIO configuration that this Blender uses, or "" where it cannot be told."""
    configured = os.environ.get("OCIO", "")
    if os.path.isfile(configured):
        return configured
    directory = bpy.utils.system_resource("DATAFILES", path="colormanagement")
    path = os.path.join(directory, "config.ocio") if directory else ""
    return path if os.path.isfile(path) else ""


def working_space():
    """The colour space of that configuration that colours are in where the file may choose (from 5.0 on), else ""."""
    chosen = getattr(bpy.data, "colorspace", None)
    return chosen.working_space if chosen is not None else ""


def _vectors(collection, name):
    values = np.empty(len(collection) * 3, np.float32)
    collection.foreach_get(name, values)
    return values.reshape(-1, 3)
