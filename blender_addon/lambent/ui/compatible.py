# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Blender's own panels and node menus for Lambent scenes.

Blender shows a panel only to the engines that it names, and offers shader nodes only to its own. Both are told of
Lambent here and made to forget it again.
"""

import importlib

import bpy

_ENGINE = "LAMBENT"
# Replaced by blender_panels.py or engine_panels.py, or without meaning here.
_REPLACED = {
    "DATA_PT_light",
    "DATA_PT_area",
    "DATA_PT_spot",
    "DATA_PT_falloff_curve",
    "NODE_DATA_PT_light",
    "NODE_DATA_PT_spot",
    "MATERIAL_PT_context_material",
    "VIEWLAYER_PT_filter",
    "VIEWLAYER_PT_layer_passes",
}
# Shown to EEVEE alone, but about things that every engine has.
_SHARED = {"DATA_PT_camera_dof", "DATA_PT_camera_dof_aperture"}
_MENU_MODULES = ("nodeitems_builtins", "bl_ui.node_add_menu_shader")
_POLL_NAME = "cycles_shader_nodes_poll"

_originals = {}


def compatible_panels():
    """Blender's panels that show what Lambent reads."""
    found = []
    for panel in _subclasses(bpy.types.Panel):
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if not isinstance(engines, set) or panel.__name__ in _REPLACED:
            continue
        if "BLENDER_RENDER" in engines or panel.__name__ in _SHARED:
            found.append(panel)
    return found


def register():
    """Tells Blender's panels and node menus of Lambent."""
    for panel in compatible_panels():
        panel.COMPAT_ENGINES.add(_ENGINE)
    for name in _MENU_MODULES:
        try:
            module = importlib.import_module(name)
        except ImportError:
            continue
        poll = getattr(module, _POLL_NAME, None)
        if poll is not None:
            # The module's other polls look this name up when called, so replacing it is enough for all of them.
            _originals[module] = poll
            setattr(module, _POLL_NAME, lambda context, poll=poll: context.engine == _ENGINE or poll(context))


def unregister():
    """Undoes register."""
    for panel in _subclasses(bpy.types.Panel):
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if isinstance(engines, set) and not panel.__module__.startswith(__package__):
            engines.discard(_ENGINE)
    for module, poll in _originals.items():
        setattr(module, _POLL_NAME, poll)
    _originals.clear()


def _subclasses(cls):
    for sub in cls.__subclasses__():
        yield sub
        yield from _subclasses(sub)
