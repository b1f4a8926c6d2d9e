# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The add-on's preferences: which daemon is used."""

import bpy
from bpy.props import IntProperty, StringProperty

# The add-on's own module: "lambent", or "bl_ext.<repository>.lambent" where it is an extension.
ADDON_MODULE = __package__.rpartition(".")[0]


class LambentPreferences(bpy.types.AddonPreferences):
    """Which daemon renders. Environment variables (README) win over these."""

    bl_idname = ADDON_MODULE

    daemon_path: StringProperty(
        name="Daemon",
        description="The program lambentd; empty to use the one that came with the add-on or is on PATH",
        subtype="FILE_PATH",
    )
    address: StringProperty(
        name="Address",
        description="unix:/path or host:port of a running daemon to use instead of starting one; empty to start one",
    )
    token_file: StringProperty(
        name="Token File",
        description="Token file of the daemon at that address; empty for the usual place",
        subtype="FILE_PATH",
    )
    threads: IntProperty(name="Threads", description="Threads of a started daemon; 0 for all", default=0, min=0, max=1024)

    def draw(self, context):
        """Blender calls this to show the preferences."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "daemon_path")
        layout.prop(self, "threads")
        layout.separator()
        layout.prop(self, "address")
        column = layout.column()
        column.enabled = bool(self.address)
        column.prop(self, "token_file")


def preferences():
    """The LambentPreferences of this user, or None where the add-on runs without being enabled in them."""
    addon = bpy.context.preferences.addons.get(ADDON_MODULE)
    return None if addon is None else addon.preferences


def register():
    """Registers the preferences."""
    bpy.utils.register_class(LambentPreferences)


def unregister():
    """Undoes register."""
    bpy.utils.unregister_class(LambentPreferences)
