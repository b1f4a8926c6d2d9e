# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The RenderEngine that Blender sees."""

import weakref

import bpy

from . import final, viewport


class LambentRenderEngine(bpy.types.RenderEngine):
    """Final renders, previews and the viewport through lambentd."""

    bl_idname = "LAMBENT"
    bl_label = "Lambent"
    bl_use_preview = True
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False
    bl_use_spherical_stereo = False
    bl_use_eevee_viewport = True

    # Set on the class and not in __init__, whose signature differs between versions.
    _viewport = None

    def render(self, depsgraph):
        """Blender calls this for each view layer of each frame."""
        final.render(self, depsgraph)

    def view_update(self, context, depsgraph):
        """Blender calls this when something changed that a rendered viewport shows."""
        self._viewport_render().update(self, context, depsgraph)

    def view_draw(self, context, depsgraph):
        """Blender calls this to draw a rendered viewport."""
        self._viewport_render().draw(self, context, depsgraph)

    def _viewport_render(self):
        if self._viewport is None:
            self._viewport = viewport.ViewportRender(self)
            # Not __del__: when that runs, Blender has taken the engine's attributes away.
            weakref.finalize(self, self._viewport.close)
        return self._viewport

    def update_render_passes(self, scene, view_layer):
        """Names the passes that a layer gets."""
        self.register_pass(scene, view_layer, "Combined", 4, "RGBA", "COLOR")


def register():
    """Makes the engine known to Blender."""
    bpy.utils.register_class(LambentRenderEngine)


def unregister():
    """Undoes register."""
    bpy.utils.unregister_class(LambentRenderEngine)
