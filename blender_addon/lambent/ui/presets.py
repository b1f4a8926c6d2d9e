# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Render presets: those that come with the add-on, and the user's own."""

import os

import bpy
from bl_operators.presets import AddPresetBase

_SUBDIRECTORY = "lambent/render"
_BUNDLED = os.path.join(os.path.dirname(os.path.dirname(__file__)), "presets")
_SAVED = (
    "integrator",
    "samples",
    "time_limit",
    "noise_threshold",
    "max_bounces",
    "diffuse_bounces",
    "glossy_bounces",
    "transmission_bounces",
    "volume_bounces",
    "transparent_bounces",
    "clamp_direct",
    "clamp_indirect",
    "light_threshold",
    "caustics_reflective",
    "caustics_refractive",
    "merge_radius",
    "merge_alpha",
    "shared_light_paths",
    "clamp_connection",
    "pixel_filter",
    "filter_width",
)


class LAMBENT_MT_render_presets(bpy.types.Menu):
    """The presets for sampling and light paths."""

    bl_label = "Lambent Presets"
    preset_operator = "script.execute_preset"

    def draw(self, context):
        """Blender calls this to show the menu."""
        paths = [_BUNDLED, *bpy.utils.preset_paths(_SUBDIRECTORY)]
        extra = {"menu_idname": "LAMBENT_MT_render_presets"}
        self.path_menu(
            paths, self.preset_operator, prop_filepath="filepath", props_default=extra, filter_ext=lambda ext: ext == ".py"
        )
        self.layout.separator()
        self.layout.operator(LAMBENT_OT_render_preset_add.bl_idname, text="Save Preset...", icon="ADD")


class LAMBENT_OT_render_preset_add(AddPresetBase, bpy.types.Operator):
    """Save the settings for sampling and light paths as a preset"""

    bl_idname = "lambent.render_preset_add"
    bl_label = "Save Lambent Preset"
    preset_menu = "LAMBENT_MT_render_presets"
    preset_defines = ["lambent = bpy.context.scene.lambent"]
    preset_values = [f"lambent.{name}" for name in _SAVED]
    preset_subdir = _SUBDIRECTORY

    def invoke(self, context, event):
        """Asks for a name."""
        return context.window_manager.invoke_props_dialog(self)


_CLASSES = (LAMBENT_MT_render_presets, LAMBENT_OT_render_preset_add)


def register():
    """Registers menu and operator."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    """Undoes register."""
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
