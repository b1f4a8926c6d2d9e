# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Light linking (Blender 4.0 and later): which objects a lamp or emissive object shines on, and which throw its shadows.

Blender keeps a collection of receivers and one of blockers with the object that shines, and with each member of these whether
it is included or excluded. Here collections become sets by name, and objects say which of them they are in.
"""


class Links:
    """Collects what an export puts as objects, and links them once all are known."""

    def __init__(self):
        self._objects = []

    def add(self, value, owner, parent):
        """An object's value that will be put; owner and parent (its instancer, or itself) may be evaluated."""
        original = owner.original
        linking = getattr(original, "light_linking", None)
        if linking is not None:
            chosen = (linking.receiver_collection, linking.blocker_collection)
            self._objects.append((value, original, parent.original, chosen))

    def finish(self):
        """Adds "light_linking" to the values where any light of the export is linked."""
        for side, (light_member, object_member) in enumerate((("receivers", "receives"), ("blockers", "blocks"))):
            sets = {}
            for *_, chosen in self._objects:
                if chosen[side] is not None and chosen[side].name_full not in sets:
                    sets[chosen[side].name_full] = _Members(chosen[side])
            # A collection without members leaves the light as it is.
            sets = {name: members for name, members in sets.items() if members.listed}
            if not sets:
                continue
            listed = set().union(*(members.listed for members in sets.values()))
            for value, original, parent, chosen in self._objects:
                linking = {}
                if chosen[side] is not None and chosen[side].name_full in sets:
                    linking[light_member] = chosen[side].name_full
                if "mesh" in value:
                    # Instances are what their instancer is, if that is linked at all.
                    subject = parent if parent in listed else original
                    linking[object_member] = [name for name, members in sets.items() if members.has(subject)]
                if linking:
                    value.setdefault("light_linking", {}).update(linking)


class _Members:
    """The objects that a collection of receivers or blockers means: those included, or all but those excluded."""

    def __init__(self, collection):
        self.listed = {}  # by object, in Blender's order, in which later mentions win
        for child, state in zip(collection.children, collection.collection_children):
            self._list_all(child, state.light_linking.link_state)
        for thing, state in zip(collection.objects, collection.collection_objects):
            self.listed[thing] = state.light_linking.link_state == "INCLUDE"
        self._any_included = any(self.listed.values())

    def _list_all(self, collection, link_state):
        for child in collection.children:
            self._list_all(child, link_state)
        for thing in collection.objects:
            self.listed[thing] = link_state == "INCLUDE"

    def has(self, thing):
        return self.listed.get(thing, not self._any_included)
