# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The RenderEngine that Blender sees."""

import weakref

import bpy

from ..sync import passes
from ..sync.changes import GeometryChanges
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
    _changes = None

    def update(self, data, depsgraph):
        """Blender calls this before each render."""
        if self._changes is None:
            self._changes = GeometryChanges()
        self._changes.add(depsgraph)

    def render(self, depsgraph):
        """Blender calls this for each view layer of each frame."""
        # Engine and depsgraph live on only with persistent data, and only for a single layer is it the same depsgraph.
        scene = depsgraph.scene
        persistent = scene.render.use_persistent_data and sum(layer.use for layer in scene.view_layers) == 1
        changes = self._changes if persistent and self._changes is not None else GeometryChanges()
        if final.render(self, depsgraph, changes):
            changes.sent()

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
        # Those whose name another has are registered too: that is how Blender marks AOVs as conflicting.
        for entry in passes.asked(scene, view_layer):
            for name in entry.names:
                self.register_pass(scene, view_layer, name, len(entry.channels), entry.channels, entry.type)


def register():
    """Makes the engine known to Blender."""
    bpy.utils.register_class(LambentRenderEngine)


def unregister():
    """Undoes register."""
    bpy.utils.unregister_class(LambentRenderEngine)
