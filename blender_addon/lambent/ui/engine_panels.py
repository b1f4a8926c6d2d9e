# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Panels for Lambent's own settings, where Cycles has them."""

import bpy

from ..render import report
from ..sync import settings
from . import integrator_menus, properties
from .panel import LambentPanel, register_classes, unregister_classes


class LAMBENT_OT_follow_cycles(bpy.types.Operator):
    """Use the value that the scene has for Cycles"""

    bl_idname = "lambent.follow_cycles"
    bl_label = "Follow Cycles"
    bl_options = {"INTERNAL", "UNDO"}

    name: bpy.props.StringProperty()

    def execute(self, context):
        """Unsets the setting."""
        context.scene.lambent.property_unset(self.name)
        return {"FINISHED"}


class LAMBENT_OT_own_setting(bpy.types.Operator):
    """Give Lambent a value of its own instead of the one for Cycles"""

    bl_idname = "lambent.own_setting"
    bl_label = "Own Value"
    bl_options = {"INTERNAL", "UNDO"}

    name: bpy.props.StringProperty()

    def execute(self, context):
        """Sets the setting to what it followed."""
        scene = context.scene
        setattr(scene.lambent, self.name, settings.effective(scene, self.name))
        return {"FINISHED"}


def draw_setting(layout, scene, name, text=None):
    """Shows scene.lambent.<name>, or Cycles' setting with a link sign where that one counts."""
    options = {} if text is None else {"text": text}
    row = layout.row(align=True)
    cycles_name = settings.followed(scene, name)
    if cycles_name is not None:
        options.setdefault("text", scene.lambent.bl_rna.properties[name].name)
        row.prop(scene.cycles, cycles_name, **options)
        row.operator(LAMBENT_OT_own_setting.bl_idname, text="", icon="LINKED", emboss=False).name = name
        return
    row.prop(scene.lambent, name, **options)
    if settings.could_follow(scene, name):
        row.operator(LAMBENT_OT_follow_cycles.bl_idname, text="", icon="UNLINKED", emboss=False).name = name


class LAMBENT_RENDER_PT_sampling(LambentPanel, bpy.types.Panel):
    bl_label = "Sampling"
    bl_context = "render"

    def draw_header_preset(self, context):
        self.layout.menu("LAMBENT_MT_render_presets", text="", icon="PRESET")

    def draw(self, context):
        integrator_menus.draw(self.layout, context.scene, "integrator")


class LAMBENT_RENDER_PT_sampling_viewport(LambentPanel, bpy.types.Panel):
    bl_label = "Viewport"
    bl_context = "render"
    bl_parent_id = "LAMBENT_RENDER_PT_sampling"

    def draw(self, context):
        integrator_menus.draw(self.layout, context.scene, "preview_integrator")
        column = self.split_layout().column()
        draw_setting(column, context.scene, "preview_samples", "Samples")
        for name in ("preview_noise_threshold", "preview_time_limit"):
            column.prop(context.scene.lambent, name, text=context.scene.lambent.bl_rna.properties[name[8:]].name)


class LAMBENT_RENDER_PT_sampling_render(LambentPanel, bpy.types.Panel):
    bl_label = "Render"
    bl_context = "render"
    bl_parent_id = "LAMBENT_RENDER_PT_sampling"

    def draw(self, context):
        column = self.split_layout().column()
        for name in ("samples", "noise_threshold", "time_limit"):
            draw_setting(column, context.scene, name)


def _in_use(scene):
    """The integrators that the scene renders with, finally and in the viewport."""
    return {settings.effective(scene, prefix + "integrator") for prefix in ("", "preview_")}


class LAMBENT_RENDER_PT_sampling_merging(LambentPanel, bpy.types.Panel):
    bl_label = "Photon Merging"
    bl_context = "render"
    bl_parent_id = "LAMBENT_RENDER_PT_sampling"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and not _in_use(context.scene).isdisjoint(properties.MERGING)

    def draw(self, context):
        column = self.split_layout().column()
        for name in ("merge_radius", "merge_alpha"):
            column.prop(context.scene.lambent, name)


class LAMBENT_RENDER_PT_sampling_virtual_lights(LambentPanel, bpy.types.Panel):
    bl_label = "Virtual Point Lights"
    bl_context = "render"
    bl_parent_id = "LAMBENT_RENDER_PT_sampling"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and "VPL" in _in_use(context.scene)

    def draw(self, context):
        column = self.split_layout().column()
        for name in ("shared_light_paths", "clamp_connection"):
            column.prop(context.scene.lambent, name)


class LAMBENT_RENDER_PT_sampling_advanced(LambentPanel, bpy.types.Panel):
    bl_label = "Advanced"
    bl_context = "render"
    bl_parent_id = "LAMBENT_RENDER_PT_sampling"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self.split_layout().column()
        for name in ("seed", "animated_seed", "light_threshold"):
            draw_setting(column, context.scene, name)


class LAMBENT_RENDER_PT_light_paths(LambentPanel, bpy.types.Panel):
    bl_label = "Light Paths"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        pass


class LAMBENT_RENDER_PT_light_paths_max_bounces(LambentPanel, bpy.types.Panel):
    bl_label = "Max Bounces"
    bl_context = "render"
    bl_parent_id = "LAMBENT_RENDER_PT_light_paths"

    def draw(self, context):
        column = self.split_layout().column(align=True)
        draw_setting(column, context.scene, "max_bounces")
        column.separator()
        for name in ("diffuse", "glossy", "transmission", "volume", "transparent"):
            draw_setting(column, context.scene, f"{name}_bounces")


class LAMBENT_RENDER_PT_light_paths_clamping(LambentPanel, bpy.types.Panel):
    bl_label = "Clamping"
    bl_context = "render"
    bl_parent_id = "LAMBENT_RENDER_PT_light_paths"

    def draw(self, context):
        column = self.split_layout().column(align=True)
        column.prop(context.scene.lambent, "clamp_direct", text="Direct Light")
        column.prop(context.scene.lambent, "clamp_indirect", text="Indirect Light")


class LAMBENT_RENDER_PT_light_paths_caustics(LambentPanel, bpy.types.Panel):
    bl_label = "Caustics"
    bl_context = "render"
    bl_parent_id = "LAMBENT_RENDER_PT_light_paths"

    def draw(self, context):
        column = self.split_layout().column()
        draw_setting(column, context.scene, "caustics_reflective", "Reflective")
        draw_setting(column, context.scene, "caustics_refractive", "Refractive")


class LAMBENT_RENDER_PT_film(LambentPanel, bpy.types.Panel):
    bl_label = "Film"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self.split_layout().column()
        draw_setting(column, context.scene, "film_exposure")


class LAMBENT_RENDER_PT_film_transparency(LambentPanel, bpy.types.Panel):
    bl_label = "Transparent"
    bl_context = "render"
    bl_parent_id = "LAMBENT_RENDER_PT_film"

    def draw_header(self, context):
        self.layout.prop(context.scene.render, "film_transparent", text="")

    def draw(self, context):
        column = self.split_layout().column()
        column.active = context.scene.render.film_transparent
        draw_setting(column, context.scene, "film_transparent_glass")
        column = column.column()
        column.active = settings.effective(context.scene, "film_transparent_glass")
        draw_setting(column, context.scene, "film_transparent_roughness")


class LAMBENT_RENDER_PT_film_pixel_filter(LambentPanel, bpy.types.Panel):
    bl_label = "Pixel Filter"
    bl_context = "render"
    bl_parent_id = "LAMBENT_RENDER_PT_film"

    def draw(self, context):
        column = self.split_layout().column()
        draw_setting(column, context.scene, "pixel_filter", "Type")
        if settings.effective(context.scene, "pixel_filter") != "BOX" or not settings.followed(context.scene, "pixel_filter"):
            draw_setting(column, context.scene, "filter_width", "Width")


class LAMBENT_RENDER_PT_performance(LambentPanel, bpy.types.Panel):
    bl_label = "Performance"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self.split_layout().column()
        render = context.scene.render
        column.prop(render, "threads_mode")
        sub = column.column()
        sub.enabled = render.threads_mode == "FIXED"
        sub.prop(render, "threads")
        column.prop(context.scene.lambent, "tile_size")
        column.prop(render, "use_persistent_data", text="Persistent Data")


class LAMBENT_RENDER_PT_report(LambentPanel, bpy.types.Panel):
    bl_label = "Lambent Report"
    bl_context = "render"

    _ICONS = {"error": "ERROR", "warning": "INFO", "info": "DOT"}
    _SHOWN = 100

    @classmethod
    def poll(cls, context):
        return super().poll(context) and bool(report.listed(context.scene.name))

    def draw(self, context):
        column = self.layout.column(align=True)
        messages = report.listed(context.scene.name)
        for message in messages[: self._SHOWN]:
            column.label(text=str(message.get("text", "")), icon=self._ICONS.get(message.get("severity"), "DOT"))
        if len(messages) > self._SHOWN:
            column.label(text=f"and {len(messages) - self._SHOWN} more")


class LAMBENT_VIEWLAYER_PT_layer(LambentPanel, bpy.types.Panel):
    bl_label = "Filter and Override"
    bl_context = "view_layer"

    def draw(self, context):
        column = self.split_layout().column()
        layer = context.view_layer
        column.prop(layer, "use_sky", text="Environment")
        column.prop(layer, "use_solid", text="Surfaces")
        column.prop(layer, "material_override")
        if hasattr(layer, "world_override"):
            column.prop(layer, "world_override")
        column.prop(layer, "samples")


_CLASSES = (
    LAMBENT_OT_follow_cycles,
    LAMBENT_OT_own_setting,
    LAMBENT_RENDER_PT_sampling,
    LAMBENT_RENDER_PT_sampling_viewport,
    LAMBENT_RENDER_PT_sampling_render,
    LAMBENT_RENDER_PT_sampling_merging,
    LAMBENT_RENDER_PT_sampling_virtual_lights,
    LAMBENT_RENDER_PT_sampling_advanced,
    LAMBENT_RENDER_PT_light_paths,
    LAMBENT_RENDER_PT_light_paths_max_bounces,
    LAMBENT_RENDER_PT_light_paths_clamping,
    LAMBENT_RENDER_PT_light_paths_caustics,
    LAMBENT_RENDER_PT_film,
    LAMBENT_RENDER_PT_film_transparency,
    LAMBENT_RENDER_PT_film_pixel_filter,
    LAMBENT_RENDER_PT_performance,
    LAMBENT_RENDER_PT_report,
    LAMBENT_VIEWLAYER_PT_layer,
)


def register():
    """Registers panels and operators."""
    register_classes(_CLASSES)


def unregister():
    """Undoes register."""
    unregister_classes(_CLASSES)
