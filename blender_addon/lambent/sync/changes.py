# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Which meshes need not be looked at again, where a depsgraph lives on and says what changed."""

import bpy

from . import material


class GeometryChanges:
    """Names of objects and of their data whose geometry changed since a session last saw them.

    At first nothing is known to be unchanged.
    """

    def __init__(self):
        self._everything = True
        self._objects = set()
        self._data = set()
        self._attribute_names = None

    def add(self, depsgraph):
        """Takes note of the updates of an evaluation."""
        for update in depsgraph.updates:
            if update.is_updated_geometry:
                names = self._objects if isinstance(update.id, bpy.types.Object) else self._data
                names.add(update.id.original.name_full)
        # Which attributes of meshes travel depends on what materials read.
        attribute_names = material.attribute_names(bpy.data.materials)
        if attribute_names != self._attribute_names:
            self._everything, self._attribute_names = True, attribute_names

    def sent(self):
        """A session has everything as it is now."""
        self._everything = False
        self._objects.clear()
        self._data.clear()

    def keeps(self, state):
        """The keep_mesh of sync.objects.ObjectExporter: whether the session of state holds that very mesh."""

        def keep_mesh(identifier, original, data):
            if self._everything or not state.knows("mesh", identifier) or original.name_full in self._objects:
                return False
            return data is None or data.name_full not in self._data

        return keep_mesh
