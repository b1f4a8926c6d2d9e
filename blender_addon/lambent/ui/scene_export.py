# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""File > Export > Lambent Scene: what a render would send, as a file for `lambent render`."""

import os

import bpy
from bpy_extras.io_utils import ExportHelper

from ..render import final


class LAMBENT_OT_scene_export(bpy.types.Operator, ExportHelper):
    """Save the scene as Lambent would render this frame of this view layer, for the command line and render farms"""

    bl_idname = "lambent.scene_export"
    bl_label = "Export Lambent Scene"
    bl_options = {"REGISTER"}

    filename_ext = ".lambent"
    filter_glob: bpy.props.StringProperty(default="*.lambent", options={"HIDDEN"})

    def execute(self, context):
        """Exports through a render that ends where it would start to sample: Blender evaluates a scene as rendered only there."""
        scene = context.scene
        path = os.path.abspath(bpy.path.abspath(self.filepath))
        engine = scene.render.engine
        scene.render.engine = "LAMBENT"
        try:
            with final.saving_to(path) as saved:
                bpy.ops.render.render(scene=scene.name, layer=context.view_layer.name)
        except RuntimeError as error:  # The render's own error report has been shown; this is its text.
            self.report({"ERROR"}, str(error).strip())
            return {"CANCELLED"}
        finally:
            scene.render.engine = engine
        if not saved:
            self.report({"ERROR"}, f"Lambent: '{path}' was not saved: the export was stopped")
            return {"CANCELLED"}
        self.report({"INFO"}, f"Lambent: saved '{saved['path']}' ({saved['bytes']} bytes)")
        return {"FINISHED"}


def _draw_entry(self, context):
    self.layout.operator(LAMBENT_OT_scene_export.bl_idname, text="Lambent Scene (.lambent)")


def register():
    """Registers the operator and its entry in the Export menu."""
    bpy.utils.register_class(LAMBENT_OT_scene_export)
    bpy.types.TOPBAR_MT_file_export.append(_draw_entry)


def unregister():
    """Undoes register."""
    bpy.types.TOPBAR_MT_file_export.remove(_draw_entry)
    bpy.utils.unregister_class(LAMBENT_OT_scene_export)
