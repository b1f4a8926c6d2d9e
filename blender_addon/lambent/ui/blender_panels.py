# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Panels for materials, worlds, lights and objects in place of those that only Cycles shows."""

import bpy

from ..sync import compat
from .panel import LambentPanel, register_classes, unregister_classes


def _draw_nodes(layout, datablock, input_name, plain_property):
    """The node tree that leads to an input of the output node, or plain_property where there are no nodes."""
    if not compat.uses_nodes(datablock):
        if hasattr(datablock, "use_nodes"):
            layout.prop(datablock, "use_nodes", icon="NODETREE")
        if plain_property:
            layout.prop(datablock, plain_property)
        return
    tree = datablock.node_tree
    node = tree.get_output_node("CYCLES")
    if node is None:
        layout.label(text="No output node")
        return
    socket = next((socket for socket in node.inputs if socket.identifier == input_name), None)
    if socket is None:
        layout.label(text="Incompatible output node")
    else:
        layout.template_node_view(tree, node, socket)


class _MaterialPanel(LambentPanel):
    bl_context = "material"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and context.material is not None and not context.material.is_grease_pencil


class LAMBENT_MATERIAL_PT_context(LambentPanel, bpy.types.Panel):
    bl_label = ""
    bl_context = "material"
    bl_options = {"HIDE_HEADER"}

    @classmethod
    def poll(cls, context):
        return super().poll(context) and (context.material is not None or context.object is not None)

    def draw(self, context):
        layout, ob, slot, space = self.layout, context.object, context.material_slot, context.space_data
        if ob is not None:
            row = layout.row()
            row.template_list("MATERIAL_UL_matslots", "", ob, "material_slots", ob, "active_material_index", rows=3)
            column = row.column(align=True)
            column.operator("object.material_slot_add", icon="ADD", text="")
            column.operator("object.material_slot_remove", icon="REMOVE", text="")
            column.separator()
            column.operator("object.material_slot_move", icon="TRIA_UP", text="").direction = "UP"
            column.operator("object.material_slot_move", icon="TRIA_DOWN", text="").direction = "DOWN"
            if ob.mode == "EDIT":
                row = layout.row(align=True)
                row.operator("object.material_slot_assign", text="Assign")
                row.operator("object.material_slot_select", text="Select")
                row.operator("object.material_slot_deselect", text="Deselect")
            row = layout.row()
            row.template_ID(ob, "active_material", new="material.new")
            if slot is not None:
                row.prop(slot, "link", text="", icon_only=True)
        elif context.material is not None:
            layout.template_ID(space, "pin_id")


class LAMBENT_MATERIAL_PT_surface(_MaterialPanel, bpy.types.Panel):
    bl_label = "Surface"

    def draw(self, context):
        _draw_nodes(self.split_layout(), context.material, "Surface", "diffuse_color")


class LAMBENT_MATERIAL_PT_displacement(_MaterialPanel, bpy.types.Panel):
    bl_label = "Displacement"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        _draw_nodes(self.split_layout(), context.material, "Displacement", "")


class LAMBENT_MATERIAL_PT_settings(_MaterialPanel, bpy.types.Panel):
    bl_label = "Settings"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self.split_layout().column()
        column.prop(context.material, "pass_index")
        for name in ("displacement_method", "use_transparent_shadow", "use_bump_map_correction"):
            if owner := compat.owner_of_switch(context.material, name):
                column.prop(owner, name)


class LAMBENT_WORLD_PT_surface(LambentPanel, bpy.types.Panel):
    bl_label = "Surface"
    bl_context = "world"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and context.world is not None

    def draw(self, context):
        _draw_nodes(self.split_layout(), context.world, "Surface", "color")


class LAMBENT_WORLD_PT_ray_visibility(LambentPanel, bpy.types.Panel):
    bl_label = "Ray Visibility"
    bl_context = "world"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return super().poll(context) and hasattr(context.world, "cycles_visibility")

    def draw(self, context):
        column = self.split_layout().column()
        for name in ("camera", "diffuse", "glossy", "transmission", "scatter"):
            column.prop(context.world.cycles_visibility, name)


class _LightPanel(LambentPanel):
    bl_context = "data"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and context.light is not None


class LAMBENT_LIGHT_PT_light(_LightPanel, bpy.types.Panel):
    bl_label = "Light"

    def draw(self, context):
        light = context.light
        self.layout.row().prop(light, "type", expand=True)
        column = self.split_layout().column()
        if hasattr(light, "use_temperature"):
            column.prop(light, "use_temperature")
            if light.use_temperature:
                column.prop(light, "temperature")
        column.prop(light, "color")
        column.prop(light, "energy")
        for name in ("exposure", "normalize"):
            if hasattr(light, name):
                column.prop(light, name)
        column.separator()
        if light.type in ("POINT", "SPOT"):
            column.prop(light, "shadow_soft_size", text="Radius")
        elif light.type == "SUN":
            column.prop(light, "angle")
        elif light.type == "AREA":
            column.prop(light, "shape")
            sub = column.column(align=True)
            if light.shape in ("SQUARE", "DISK"):
                sub.prop(light, "size")
            else:
                sub.prop(light, "size", text="Size X")
                sub.prop(light, "size_y", text="Y")
        cycles = getattr(light, "cycles", None)
        for owner, name in ((cycles, "max_bounces"), (cycles, "cast_shadow"), (cycles, "use_multiple_importance_sampling")):
            if owner is not None and hasattr(owner, name):
                column.prop(owner, name)
        if not hasattr(cycles, "cast_shadow"):
            column.prop(light, "use_shadow")


class LAMBENT_LIGHT_PT_beam_shape(_LightPanel, bpy.types.Panel):
    bl_label = "Beam Shape"
    bl_parent_id = "LAMBENT_LIGHT_PT_light"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and context.light.type in ("SPOT", "AREA")

    def draw(self, context):
        column = self.split_layout().column()
        if context.light.type == "SPOT":
            column.prop(context.light, "spot_size")
            column.prop(context.light, "spot_blend", slider=True)
            column.prop(context.light, "show_cone")
        else:
            column.prop(context.light, "spread")


class LAMBENT_LIGHT_PT_nodes(_LightPanel, bpy.types.Panel):
    bl_label = "Nodes"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        _draw_nodes(self.split_layout(), context.light, "Surface", "")


class LAMBENT_OBJECT_PT_ray_visibility(LambentPanel, bpy.types.Panel):
    bl_label = "Ray Visibility"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return super().poll(context) and context.object is not None and context.object.type != "EMPTY"

    def draw(self, context):
        column = self.split_layout().column()
        for name in ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
            column.prop(context.object, f"visible_{name}")
        column = self.layout.column(heading="Mask")
        column.prop(context.object, "is_shadow_catcher")
        column.prop(context.object, "is_holdout")


_CLASSES = (
    LAMBENT_MATERIAL_PT_context,
    LAMBENT_MATERIAL_PT_surface,
    LAMBENT_MATERIAL_PT_displacement,
    LAMBENT_MATERIAL_PT_settings,
    LAMBENT_WORLD_PT_surface,
    LAMBENT_WORLD_PT_ray_visibility,
    LAMBENT_LIGHT_PT_light,
    LAMBENT_LIGHT_PT_beam_shape,
    LAMBENT_LIGHT_PT_nodes,
    LAMBENT_OBJECT_PT_ray_visibility,
)


def register():
    """Registers the panels."""
    register_classes(_CLASSES)


def unregister():
    """Undoes register."""
    unregister_classes(_CLASSES)
