# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""What passes read of objects and worlds: light groups, whose shadows, mist and the distance of ambient occlusion."""

import bpy

from .panel import LambentPanel, register_classes, unregister_classes


def _draw_light_group(layout, owner, layer):
    """The light group of an object or world, chosen from those of the layer, with a button that adds a new one to it."""
    row = layout.row(align=True)
    row.prop_search(owner, "lightgroup", layer, "lightgroups", text="Light Group", results_are_suggestions=True)
    button = row.column(align=True)
    button.enabled = bool(owner.lightgroup) and owner.lightgroup not in layer.lightgroups
    button.operator("scene.view_layer_add_lightgroup", icon="ADD", text="").name = owner.lightgroup


class _ObjectPanel(LambentPanel):
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return super().poll(context) and context.object is not None


class LAMBENT_OBJECT_PT_shadow_passes(_ObjectPanel, bpy.types.Panel):
    bl_label = "Shadow Passes"

    def draw_header(self, context):
        self.layout.prop(context.object.lambent, "shadow_pass", text="")

    def draw(self, context):
        layout = self.split_layout()
        layout.active = context.object.lambent.shadow_pass
        layout.label(text="Casts what the passes of shadows take away")


class LAMBENT_OBJECT_PT_matte(_ObjectPanel, bpy.types.Panel):
    bl_label = "Matte"

    def draw_header(self, context):
        self.layout.prop(context.object.lambent, "matte", text="")

    def draw(self, context):
        layout = self.split_layout()
        layout.active = context.object.lambent.matte
        layout.prop(context.object, "is_shadow_catcher")
        if context.object.lambent.matte and not context.object.is_shadow_catcher:
            layout.label(text="Mattes are shadow catchers", icon="ERROR")


class LAMBENT_OBJECT_PT_light_group(_ObjectPanel, bpy.types.Panel):
    bl_label = "Light Group"

    def draw(self, context):
        _draw_light_group(self.split_layout(), context.object, context.view_layer)


class _WorldPanel(LambentPanel):
    bl_context = "world"
    bl_options = {"DEFAULT_CLOSED"}
    # The switch of the pass that the panel is about; "" for a panel that always shows.
    switch = ""

    @classmethod
    def poll(cls, context):
        """Whether there is a world, and a view layer asks for the pass."""
        if not super().poll(context) or context.world is None:
            return False
        return not cls.switch or any(getattr(layer, cls.switch) for layer in context.scene.view_layers)


class LAMBENT_WORLD_PT_light_group(_WorldPanel, bpy.types.Panel):
    bl_label = "Light Group"

    def draw(self, context):
        _draw_light_group(self.split_layout(), context.world, context.view_layer)


class LAMBENT_WORLD_PT_mist(_WorldPanel, bpy.types.Panel):
    bl_label = "Mist Pass"
    switch = "use_pass_mist"

    def draw(self, context):
        column = self.split_layout().column(align=True)
        for name in ("start", "depth"):
            column.prop(context.world.mist_settings, name)
        column.prop(context.world.mist_settings, "falloff")


class LAMBENT_WORLD_PT_ambient_occlusion(_WorldPanel, bpy.types.Panel):
    bl_label = "Ambient Occlusion Pass"
    switch = "use_pass_ambient_occlusion"

    def draw(self, context):
        self.split_layout().prop(context.world.light_settings, "distance")


_CLASSES = (
    LAMBENT_OBJECT_PT_light_group,
    LAMBENT_OBJECT_PT_shadow_passes,
    LAMBENT_OBJECT_PT_matte,
    LAMBENT_WORLD_PT_light_group,
    LAMBENT_WORLD_PT_mist,
    LAMBENT_WORLD_PT_ambient_occlusion,
)


def register():
    """Registers the panels."""
    register_classes(_CLASSES)


def unregister():
    """Undoes register."""
    unregister_classes(_CLASSES)
