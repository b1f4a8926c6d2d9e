# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The world: its graph, its ray visibility and how finely it is sampled."""

from . import compat, material

_VISIBILITY = {
    "camera": "camera",
    "diffuse": "diffuse",
    "glossy": "glossy",
    "transmission": "transmission",
    "volume_scatter": "scatter",
}


def export_world(edits, world):
    """Puts a world (evaluated) and returns its id."""
    name = world.name_full
    if compat.uses_nodes(world):
        graph = material.export_graph(edits, world, ("surface", "volume"), edits.aovs) or {"nodes": [], "outputs": {}}
    else:
        graph = material.background_graph(world.color)
    value = {"name": name, "graph": graph}
    if world.lightgroup:
        value["light_group"] = world.lightgroup
    visibility = getattr(world, "cycles_visibility", None)
    if visibility is not None:
        value["visibility"] = {ours: getattr(visibility, theirs) for ours, theirs in _VISIBILITY.items()}
    cycles = getattr(world, "cycles", None)
    if cycles is not None and cycles.sampling_method == "MANUAL":
        value["importance_resolution"] = cycles.sample_map_resolution
    edits.put("world", name, value)
    return name
