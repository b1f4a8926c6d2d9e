# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""space.shading.lambent: which pass a viewport shows, and its panel in the shading popover."""

import bpy
from bpy.props import EnumProperty, PointerProperty, StringProperty

from ..render import session
from ..sync import shown_pass
from .panel import LambentPanel, register_classes, unregister_classes

# Blender keeps pointers to the strings of items and does not own them: {text: the same}.
_strings = {}


def _items(_self, context):
    layer = getattr(context or bpy.context, "view_layer", None)
    columns = [("General", [(shown_pass.COMBINED_KEY, "Combined")])]
    if layer is not None:
        columns = shown_pass.choices(layer, session.offered_passes())
    items = []
    for heading, entries in columns:
        items.append(("", heading, ""))
        items += [(key, label, f"Show the render pass {label}") for key, label in entries]
    return [tuple(_strings.setdefault(text, text) for text in item) for item in items]


def _number(self):
    keys = [key for key, *_ in _items(self, None)]
    return keys.index(self.render_pass_key if self.render_pass_key in keys else shown_pass.COMBINED_KEY)


def _choose(self, number):
    self.render_pass_key = _items(self, None)[number][0] or shown_pass.COMBINED_KEY


def _redraw(self, _context):
    # The owner is a screen, or for viewport renders a scene.
    for area in getattr(self.id_data, "areas", ()):
        area.tag_redraw()


class LambentShadingSettings(bpy.types.PropertyGroup):
    """What a viewport shows."""

    # A name and not a number, which would be another pass's once an AOV is added before it.
    render_pass_key: StringProperty(default=shown_pass.COMBINED_KEY, options={"HIDDEN"}, update=_redraw)
    render_pass: EnumProperty(
        name="Render Pass", description="Render pass to show in the 3D Viewport", items=_items, get=_number, set=_choose
    )


class LAMBENT_VIEW3D_PT_shading_render_pass(LambentPanel, bpy.types.Panel):
    bl_label = "Render Pass"
    bl_space_type = "VIEW_3D"
    bl_region_type = "HEADER"
    bl_parent_id = "VIEW3D_PT_shading"

    @classmethod
    def poll(cls, context):
        """Whether the viewport is rendered by Lambent."""
        return super().poll(context) and context.space_data.shading.type == "RENDERED"

    def draw(self, context):
        chosen = context.space_data.shading.lambent
        self.layout.prop(chosen, "render_pass", text="")
        if chosen.render_pass != chosen.render_pass_key:
            self.layout.label(text=f"There is no '{shown_pass.name(chosen.render_pass_key)}' here", icon="ERROR")


_CLASSES = (LambentShadingSettings, LAMBENT_VIEW3D_PT_shading_render_pass)


def register():
    """Adds space.shading.lambent and the panel."""
    register_classes(_CLASSES)
    bpy.types.View3DShading.lambent = PointerProperty(type=LambentShadingSettings, name="Lambent Settings")


def unregister():
    """Removes them."""
    del bpy.types.View3DShading.lambent
    unregister_classes(_CLASSES)
