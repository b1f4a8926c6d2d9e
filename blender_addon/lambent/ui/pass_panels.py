# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The panels of a view layer's passes, as Cycles has them, and Lambent's own passes beside them."""

import bpy

from ..render import session
from ..sync import compat, passes
from .panel import LambentPanel, register_classes, unregister_classes


def _draw_switches(layout, layer, heading, switches):
    """A column of pass switches under a heading. switches: (kind, text or None for the property's own name)."""
    column = layout.column(heading=heading, align=True)
    for kind, text in switches:
        owner, name = passes.switch(layer, kind)
        column.prop(owner, name, **({} if text is None else {"text": text}))
    return column


class _LayerPanel(LambentPanel):
    bl_context = "view_layer"


class LAMBENT_VIEWLAYER_PT_passes(_LayerPanel, bpy.types.Panel):
    bl_label = "Passes"

    def draw(self, context):
        pass


class LAMBENT_VIEWLAYER_PT_passes_data(_LayerPanel, bpy.types.Panel):
    bl_label = "Data"
    bl_parent_id = "LAMBENT_VIEWLAYER_PT_passes"

    def draw(self, context):
        layout, layer = self.split_layout(), context.view_layer
        column = layout.column(heading="Include", align=True)
        column.prop(layer, "use_pass_combined")
        for kind in ("depth", "mist", "position", "normal"):
            column.prop(*passes.switch(layer, kind))
        vector = column.column()
        vector.active = not context.scene.render.use_motion_blur
        vector.prop(*passes.switch(layer, "vector"))
        column.prop(*passes.switch(layer, "uv"))
        column.prop(*passes.switch(layer, "denoising_albedo"), text="Denoising Data")
        _draw_switches(layout, layer, "Indexes", (("object_index", None), ("material_index", None)))
        _draw_switches(layout, layer, "Debug", (("sample_count", "Sample Count"),))
        layout.prop(layer, "pass_alpha_threshold")


class LAMBENT_VIEWLAYER_PT_passes_light(_LayerPanel, bpy.types.Panel):
    bl_label = "Light"
    bl_parent_id = "LAMBENT_VIEWLAYER_PT_passes"

    def draw(self, context):
        layout, layer = self.split_layout(), context.view_layer
        for name in ("Diffuse", "Glossy", "Transmission"):
            parts = [(f"{name.lower()}_{part.lower()}", part) for part in ("Direct", "Indirect", "Color")]
            _draw_switches(layout, layer, name, parts)
        _draw_switches(layout, layer, "Volume", (("volume_direct", "Direct"), ("volume_indirect", "Indirect")))
        other = (
            ("emission", "Emission"),
            ("environment", None),
            ("shadow", None),
            ("ambient_occlusion", "Ambient Occlusion"),
            ("shadow_catcher", None),
        )
        _draw_switches(layout, layer, "Other", other)


class LAMBENT_VIEWLAYER_PT_passes_cryptomatte(LambentPanel, compat.CryptomattePanel, bpy.types.Panel):
    bl_label = "Cryptomatte"
    bl_parent_id = "LAMBENT_VIEWLAYER_PT_passes"


class LAMBENT_VIEWLAYER_PT_passes_aov(LambentPanel, compat.AOVPanel, bpy.types.Panel):
    bl_label = "Shader AOV"
    bl_parent_id = "LAMBENT_VIEWLAYER_PT_passes"


class LAMBENT_VIEWLAYER_PT_passes_light_groups(LambentPanel, compat.LightGroupsPanel, bpy.types.Panel):
    bl_label = "Light Groups"
    bl_parent_id = "LAMBENT_VIEWLAYER_PT_passes"


class LAMBENT_VIEWLAYER_PT_passes_own(_LayerPanel, bpy.types.Panel):
    bl_label = "Lambent"
    bl_parent_id = "LAMBENT_VIEWLAYER_PT_passes"

    def draw(self, context):
        layout, layer = self.split_layout(), context.view_layer
        offered = session.offered_passes()

        def column_of(heading, kinds):
            column = layout.column(heading=heading, align=True)
            for kind in kinds:
                # What a file asks for stays visible, so that it can be switched off.
                if offered is None or kind in offered or getattr(*passes.switch(layer, kind)):
                    column.prop(*passes.switch(layer, kind))

        column_of("Caustics", ("caustics_direct", "caustics_indirect"))
        column_of("Techniques", [f"technique_{name}" for name in ("unidirectional", "connection", "merging")])
        column_of("Shadows", ("without_shadow", "shadow_difference", "shadow_ratio"))
        layout.prop(layer.lambent, "use_shadow_groups")
        column_of("Mattes", ("matte_light",))
        column_of("Debug", ("error", "time"))


def _add(context, items, active, base):
    """Adds to a list of the layer's passes, under a name that no other there has, and chooses what it added."""
    chosen = context.view_layer.lambent
    listed = getattr(chosen, items)
    names, number = {item.name for item in listed}, 1
    while f"{base} {number}" in names:
        number += 1
    listed.add().name = f"{base} {number}"
    setattr(chosen, active, len(listed) - 1)
    return {"FINISHED"}


def _remove(context, items, active):
    """Removes the chosen one of a list of the layer's passes, and chooses the one before."""
    chosen = context.view_layer.lambent
    number = getattr(chosen, active)
    getattr(chosen, items).remove(number)
    setattr(chosen, active, max(number - 1, 0))
    context.view_layer.update_render_passes()
    return {"FINISHED"}


class LAMBENT_UL_light_paths(bpy.types.UIList):
    """Names and expressions."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_name):
        """Blender calls this for each line."""
        split = layout.split(factor=0.4)
        split.prop(item, "name", text="", emboss=False, icon="NONE" if item.name else "ERROR")
        split.prop(item, "expression", text="", emboss=False)


class LAMBENT_OT_light_path_add(bpy.types.Operator):
    """Add a pass of the light that came by certain paths"""

    bl_idname = "lambent.light_path_add"
    bl_label = "Add Light Path Pass"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Adds it under a name that no other of them has."""
        return _add(context, "light_paths", "active_light_path", "Light Path")


class LAMBENT_OT_light_path_remove(bpy.types.Operator):
    """Remove the chosen light path pass"""

    bl_idname = "lambent.light_path_remove"
    bl_label = "Remove Light Path Pass"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Whether there is one."""
        return context.view_layer.lambent.active_light_path < len(context.view_layer.lambent.light_paths)

    def execute(self, context):
        """Removes it and chooses the one before."""
        return _remove(context, "light_paths", "active_light_path")


class LAMBENT_UL_mattes(bpy.types.UIList):
    """Names, and what they show."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_name):
        """Blender calls this for each line."""
        split = layout.split(factor=0.5)
        split.prop(item, "name", text="", emboss=False, icon="NONE" if item.name else "ERROR")
        shown = [(thing.name, icon) for thing, icon in ((item.object, "OBJECT_DATA"), (item.collection, "OUTLINER_COLLECTION")) if thing]
        row = split.row()
        for name, icon in shown or [("nothing", "ERROR")]:
            row.label(text=name, icon=icon)


class LAMBENT_OT_matte_add(bpy.types.Operator):
    """Add a pass of the cover of an object or a collection"""

    bl_idname = "lambent.matte_add"
    bl_label = "Add Matte Pass"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Adds it under a name that no other of them has."""
        return _add(context, "mattes", "active_matte", "Matte")


class LAMBENT_OT_matte_remove(bpy.types.Operator):
    """Remove the chosen matte pass"""

    bl_idname = "lambent.matte_remove"
    bl_label = "Remove Matte Pass"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Whether there is one."""
        return context.view_layer.lambent.active_matte < len(context.view_layer.lambent.mattes)

    def execute(self, context):
        """Removes it and chooses the one before."""
        return _remove(context, "mattes", "active_matte")


class LAMBENT_VIEWLAYER_PT_passes_mattes(_LayerPanel, bpy.types.Panel):
    bl_label = "Mattes"
    bl_parent_id = "LAMBENT_VIEWLAYER_PT_passes"

    def draw(self, context):
        chosen = context.view_layer.lambent
        row = self.layout.row()
        row.template_list("LAMBENT_UL_mattes", "", chosen, "mattes", chosen, "active_matte", rows=3)
        column = row.column(align=True)
        column.operator(LAMBENT_OT_matte_add.bl_idname, icon="ADD", text="")
        column.operator(LAMBENT_OT_matte_remove.bl_idname, icon="REMOVE", text="")
        if chosen.active_matte < len(chosen.mattes):
            # Fields of their own: side by side in a line of the list nobody could read them.
            column = self.split_layout().column()
            for name in ("object", "collection"):
                column.prop(chosen.mattes[chosen.active_matte], name)


class LAMBENT_VIEWLAYER_PT_passes_light_paths(_LayerPanel, bpy.types.Panel):
    bl_label = "Light Paths"
    bl_parent_id = "LAMBENT_VIEWLAYER_PT_passes"

    def draw(self, context):
        chosen = context.view_layer.lambent
        row = self.layout.row()
        row.template_list("LAMBENT_UL_light_paths", "", chosen, "light_paths", chosen, "active_light_path", rows=3)
        column = row.column(align=True)
        column.operator(LAMBENT_OT_light_path_add.bl_idname, icon="ADD", text="")
        column.operator(LAMBENT_OT_light_path_remove.bl_idname, icon="REMOVE", text="")


_CLASSES = (
    LAMBENT_VIEWLAYER_PT_passes,
    LAMBENT_VIEWLAYER_PT_passes_data,
    LAMBENT_VIEWLAYER_PT_passes_light,
    LAMBENT_VIEWLAYER_PT_passes_cryptomatte,
    LAMBENT_VIEWLAYER_PT_passes_aov,
    LAMBENT_VIEWLAYER_PT_passes_light_groups,
    LAMBENT_VIEWLAYER_PT_passes_own,
    LAMBENT_UL_light_paths,
    LAMBENT_OT_light_path_add,
    LAMBENT_OT_light_path_remove,
    LAMBENT_VIEWLAYER_PT_passes_light_paths,
    LAMBENT_UL_mattes,
    LAMBENT_OT_matte_add,
    LAMBENT_OT_matte_remove,
    LAMBENT_VIEWLAYER_PT_passes_mattes,
)


def register():
    """Registers panels and operators."""
    register_classes(_CLASSES)


def unregister():
    """Undoes register."""
    unregister_classes(_CLASSES)
