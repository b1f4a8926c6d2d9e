# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The choice of the integrator: only what the daemon in use has is offered, whatever the property can hold."""

import bpy

from ..render import session
from .panel import register_classes, unregister_classes
from .properties import INTEGRATORS


def offered():
    """The integrators (name, label) to choose from: those of the daemon connected last; all before there was one."""
    of_daemon = session.offered_integrators()
    return [(name, label) for name, label, *_ in INTEGRATORS if of_daemon is None or name in of_daemon]


class LAMBENT_MT_integrator(bpy.types.Menu):
    """How light is found in a render"""

    bl_label = "Integrator"
    setting = "integrator"

    def draw(self, context):
        """Blender calls this to show the menu."""
        for name, _ in offered():
            self.layout.prop_enum(context.scene.lambent, self.setting, name)


class LAMBENT_MT_preview_integrator(bpy.types.Menu):
    """How light is found in the viewport"""

    bl_label = "Viewport Integrator"
    setting = "preview_integrator"

    draw = LAMBENT_MT_integrator.draw


_MENUS = {"integrator": LAMBENT_MT_integrator, "preview_integrator": LAMBENT_MT_preview_integrator}


def draw(layout, scene, setting):
    """Shows scene.lambent.<setting>, "integrator" or "preview_integrator", as a menu, with a warning where the daemon has
    not what was chosen."""
    chosen = getattr(scene.lambent, setting)
    row = layout.split(factor=0.4)
    label = row.row()
    label.alignment = "RIGHT"
    label.label(text="Integrator")
    row.menu(_MENUS[setting].__name__, text=next(label for name, label, *_ in INTEGRATORS if name == chosen))
    if chosen not in (name for name, _ in offered()):
        layout.label(text=f"This daemon has no {chosen}", icon="ERROR")


def register():
    """Registers the menus."""
    register_classes(_MENUS.values())


def unregister():
    """Undoes register."""
    unregister_classes(_MENUS.values())
