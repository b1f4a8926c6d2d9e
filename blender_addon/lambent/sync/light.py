# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Lights, in the units of Blender 3."""

from . import compat, material


def export_light(edits, light):
    """Puts a light (evaluated) once and returns its id, or None for a light portal, which adds no light of its own.

    Its light group is not the light's: objects that share it may be of different groups.
    """
    identifier = light.name_full
    if edits.contains("light", identifier):
        return identifier
    cycles = getattr(light, "cycles", None)
    if light.type == "AREA" and getattr(cycles, "is_portal", False):
        edits.unsupported(identifier, f"{identifier}: light portals are not supported; the world is sampled without it")
        return None
    value = {
        "name": identifier,
        "type": light.type.lower(),
        "color": compat.light_color(light),
        "energy": compat.light_energy(light),
        "exposure": getattr(light, "exposure", 0.0),
        "normalize": getattr(light, "normalize", True),
        "shadows": compat.light_shadows(light),
        "multiple_importance": getattr(cycles, "use_multiple_importance_sampling", True),
        "max_bounces": getattr(cycles, "max_bounces", 1024),
    }
    value["cycles_version"] = compat.CYCLES_VERSION
    if light.type in ("POINT", "SPOT"):
        value["radius_m"] = light.shadow_soft_size
        value["soft_falloff"] = getattr(light, "use_soft_falloff", True)
    if light.type == "SPOT":
        value["spot_size_rad"] = light.spot_size
        value["spot_blend"] = light.spot_blend
    elif light.type == "SUN":
        value["angle_rad"] = light.angle
    elif light.type == "AREA":
        two_sizes = light.shape in ("RECTANGLE", "ELLIPSE")
        value["shape"] = light.shape.lower()
        value["size_m"] = [light.size, light.size_y if two_sizes else light.size]
        value["spread_rad"] = light.spread
    if compat.uses_nodes(light):
        graph = material.export_graph(edits, light, ("surface",))
        if graph is not None and not _is_identity(graph):
            value["graph"] = graph
    edits.put("light", identifier, value)
    return identifier


def _is_identity(graph):
    """Whether a graph is one white emission of strength 1, which multiplies by nothing."""
    nodes = graph["nodes"]
    if len(nodes) != 1 or nodes[0]["type"] != "Emission" or "surface" not in graph["outputs"]:
        return False
    inputs = nodes[0]["inputs"]
    color = inputs.get("Color")
    return isinstance(color, list) and color[:3] == [1.0, 1.0, 1.0] and inputs.get("Strength") == 1.0
