# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""What all panels share."""

import bpy


class LambentPanel:
    """A panel of the properties editor that shows while Lambent is the engine."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    COMPAT_ENGINES = {"LAMBENT"}

    @classmethod
    def poll(cls, context):
        """Whether the panel is shown."""
        return context.engine in cls.COMPAT_ENGINES

    def split_layout(self):
        """The layout with labels and values in two columns."""
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        return self.layout


def register_classes(classes):
    """Registers classes in order."""
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister_classes(classes):
    """Unregisters classes in reverse order."""
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
