# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Settings, preferences, panels and presets."""

from . import (
    blender_panels,
    compatible,
    engine_panels,
    integrator_menus,
    layer_properties,
    pass_panels,
    pass_source_panels,
    preferences,
    presets,
    properties,
    scene_export,
    viewport_panel,
)

_MODULES = (
    properties,
    layer_properties,
    preferences,
    presets,
    integrator_menus,
    engine_panels,
    pass_panels,
    pass_source_panels,
    blender_panels,
    compatible,
    scene_export,
    viewport_panel,
)


def register():
    """Registers everything in order of dependency."""
    for module in _MODULES:
        module.register()


def unregister():
    """Undoes register."""
    for module in reversed(_MODULES):
        module.unregister()
