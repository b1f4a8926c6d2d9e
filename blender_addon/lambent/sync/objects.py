# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Objects and their instances.

One pass over depsgraph.object_instances sorts instances into groups that share object, data and instancer; matrices and
random ids are then fetched for all of them in one call each. A group is exported when it is first met, because the
object that Blender hands out is valid only until the next step.
"""

import bpy
import numpy as np

from . import compat, instances, light, light_linking, material, mesh, particles

_CONVERTIBLE = ("MESH", "CURVE", "SURFACE", "FONT", "META")
_NOT_RENDERED = {
    "VOLUME": "volume objects",
    "CURVES": "hair curves",
    "POINTCLOUD": "point clouds",
    "GPENCIL": "grease pencil objects",
    "GREASEPENCIL": "grease pencil objects",
}
_VISIBILITY = ("camera", "diffuse", "glossy", "transmission", "shadow", "volume_scatter")
_STOP_CHECK_INTERVAL = 256


class Interrupted(Exception):
    """should_stop said so during the export."""


class ObjectExporter:
    """Puts all objects of a depsgraph into edits.

    keep_mesh: callable(mesh id, original object, original data or None) -> True where that mesh is known to be unchanged.
    neighbours: motion.Motion, or None where no pass asks for it. mattes: {original object: names of passes that show it}.
    """

    def __init__(self, edits, depsgraph, keep_mesh, neighbours=None, mattes=None):
        self._edits = edits
        self._depsgraph = depsgraph
        self._keep_mesh = keep_mesh
        self._neighbours = neighbours
        self._mattes = mattes or {}
        self._instance_keys = []
        self._view_layer = depsgraph.view_layer
        self._override = depsgraph.view_layer_eval.material_override
        self._surfaces = depsgraph.view_layer_eval.use_solid
        self._modifiers_of = "RENDER" if depsgraph.mode == "RENDER" else "PREVIEW"
        self._names = set()
        self._meshes = {}
        self._mesh_names = set()
        self._converted = set()
        self._links = light_linking.Links()
        materials = bpy.data.materials
        self._attribute_names = material.attribute_names(materials)
        self._object_attribute_names = material.object_attribute_names(materials)
        self._random_ids = material.any_node(materials, ("ShaderNodeObjectInfo",))
        asked = material.any_node(materials, ("ShaderNodeParticleInfo",))
        self._particles = particles.Particles(depsgraph.scene_eval) if asked else None

    def export(self, should_stop):
        """Exports everything; what fails is reported by the object's name. Raises Interrupted."""
        groups = []
        group_of_key = {}
        group_of_instance = []
        later = {}
        stopped = first_is_instancer = False
        for index, instance in enumerate(self._depsgraph.object_instances):
            if stopped:
                # To the end all the same: Blender leaks the instances of an object that iteration stops inside of.
                continue
            if index % _STOP_CHECK_INTERVAL == 0 and should_stop():
                stopped = True
                continue
            if self._neighbours is not None:
                self._instance_keys.append(instances.instance_key(instance))
            if index < 2:
                # The instances of an object follow it, if it is shown itself.
                first_is_instancer |= instance.is_instance
            group = -1
            found = instance.object
            kind = found.type
            if kind in ("CAMERA", "EMPTY", "ARMATURE", "LATTICE", "SPEAKER") or not instance.show_self:
                group_of_instance.append(group)
                continue
            if instance.is_instance:
                owner, parent = instance.instance_object, instance.parent
                data = found.data
                key = (owner.as_pointer(), parent.as_pointer(), data.as_pointer() if data else 0)
            else:
                owner = parent = found
                key = index
            group = group_of_key.get(key)
            if group is None:
                group = len(groups)
                group_of_key[key] = group
                if kind in _CONVERTIBLE and kind != "MESH":
                    # Blender also hands out its mesh as an instance, unless this version does not do so for this type.
                    later[group] = (owner.original, parent.original)
                    groups.append(None)
                else:
                    groups.append(self._guarded(self._begin, found, owner, parent))
            if self._particles is not None:
                self._particles.add(len(group_of_instance), instance)
            group_of_instance.append(group)
        if stopped:
            raise Interrupted()
        for group, (original, parent) in later.items():
            if original not in self._converted:
                found = original.evaluated_get(self._depsgraph)
                groups[group] = self._guarded(self._begin, found, found, parent.evaluated_get(self._depsgraph))
        if any(group is not None for group in groups):
            self._links.finish()
            arrays = instances.instance_arrays(self._depsgraph, len(group_of_instance), self._random_ids, first_is_instancer)
            self._put_groups(groups, np.array(group_of_instance, np.int64), *arrays)

    def _guarded(self, export, found, owner, parent):
        try:
            return export(found, owner, parent)
        except Exception as error:  # One object must not stop the others; what fails is reported.
            name = owner.name_full
            self._edits.report("error", "export_failed", name, f"{name}: could not be exported and is left out: {error!r}")
            return None

    def _begin(self, found, owner, parent):
        """(object id, value without transforms) of a new group, or None where there is nothing to render."""
        name = owner.name_full
        if found.type == "LIGHT":
            identifier = light.export_light(self._edits, found.data)
            value = None if identifier is None else {"light": identifier}
        elif found.type in _CONVERTIBLE:
            value = self._begin_surface(found, owner, parent)
        else:
            if found.type in _NOT_RENDERED:
                self._edits.unsupported(name, f"{name} is left out: {_NOT_RENDERED[found.type]} are not supported")
            value = None
        if value is None:
            return None
        if owner == parent and "mesh" in value:
            self._report_unsupported(owner)
        # Cryptomatte goes by the name without the library.
        value["name"] = owner.name
        if "mesh" in value:
            self._mask(value, owner, parent)
        value["visibility"] = self._visibility(owner, parent)
        if owner.lightgroup:
            value["light_group"] = owner.lightgroup
        self._links.add(value, owner, parent)
        base = name if owner == parent else f"{parent.name_full}/{name}"
        return _unique(base, self._names), value

    def _begin_surface(self, found, owner, parent):
        if not self._surfaces:
            return None
        identifier = self._mesh(found, owner)
        if identifier is None:
            return None
        if self._override is not None:
            slots = [self._override] * max(len(found.material_slots), 1)
        else:
            slots = [slot.material for slot in found.material_slots] or [None]
        return {
            "mesh": identifier,
            "materials": [material.export_material(self._edits, slot) for slot in slots],
            "pass_index": owner.pass_index,
            "color": list(owner.color),
            "attributes": self._object_attributes(owner, parent),
        }

    def _object_attributes(self, owner, parent):
        """{name: [4 numbers]} of what Attribute nodes read of the object, and "INSTANCER:name" of its instancer."""
        values = {}
        for name in self._object_attribute_names:
            for prefix, datablocks in (("", (owner, owner.data)), ("INSTANCER:", (parent,) if parent != owner else ())):
                value = material.datablock_attribute(datablocks, name)
                if value is not None:
                    values[prefix + name] = value
        return values

    def _mesh(self, found, owner):
        """The id of the mesh of an object, exported if this is its first use; None where it has no faces to show."""
        data, original = found.data, owner.original
        pointer = data.as_pointer()
        if original.type != "MESH":
            self._converted.add(original)
        if pointer in self._meshes:
            return self._meshes[pointer]
        own = pointer == owner.data.as_pointer()
        if own and original.type == "MESH" and not original.is_modified(self._depsgraph.scene, self._modifiers_of):
            base = f"mesh:{original.data.name_full}"
        elif own or original.type != "MESH":
            base = f"object:{original.name_full}"
        else:
            base = f"object:{original.name_full}|{data.name_full}"
        identifier = _unique(base, self._mesh_names)
        if self._keep_mesh(identifier, original, original.data if own else None):
            self._edits.keep("mesh", identifier)
        elif own:
            # Owned data goes through to_mesh, which gives a copy that may be given normals and must be given back.
            converted = found.to_mesh()
            try:
                if converted is None or not len(converted.polygons) and _may_be_without_faces(original):
                    identifier = None
                else:
                    self._export_mesh(identifier, data.name_full, converted)
            finally:
                found.to_mesh_clear()
        elif not len(data.polygons) and _may_be_without_faces(original):
            identifier = None
        else:
            self._export_mesh(identifier, data.name_full, data)
        self._meshes[pointer] = identifier
        return identifier

    def _export_mesh(self, identifier, name, data):
        mesh.export_mesh(self._edits, identifier, name, data, self._attribute_names)

    def _visibility(self, owner, parent):
        visibility = {name: getattr(owner, f"visible_{name}") for name in _VISIBILITY}
        if owner != parent:
            visibility = {name: seen and getattr(parent, f"visible_{name}") for name, seen in visibility.items()}
        # As in Cycles, an object whose collection is both is a holdout.
        original = parent.original
        if original.indirect_only_get(view_layer=self._view_layer) and not original.holdout_get(view_layer=self._view_layer):
            visibility["camera"] = False
        return visibility

    def _mask(self, value, owner, parent):
        """Puts into value what mattes need: the name of the asset, and whether it is a hole in the picture."""
        asset = owner
        while asset.parent is not None:
            asset = asset.parent
        if asset != owner:
            value["asset"] = asset.name
        if parent.original.holdout_get(view_layer=self._view_layer):
            value["holdout"] = True
        if owner.is_shadow_catcher or parent.is_shadow_catcher:
            value["shadow_catcher"] = True
            if owner.original.lambent.matte or parent.original.lambent.matte:
                value["matte"] = True
        if parent.original.lambent.shadow_pass:
            value["shadow_pass"] = True
        shown_by = {name for thing in (owner, parent) for name in self._mattes.get(thing.original, ())}
        if shown_by:
            value["mattes"] = sorted(shown_by)
        mattes = self._edits.mattes
        mattes["object"].add(owner.name)
        mattes["asset"].add(asset.name)

    def _report_unsupported(self, owner):
        edits, name = self._edits, owner.name_full
        if compat.adaptive_subdivision(owner):
            edits.unsupported(name, f"{name}: adaptive subdivision is not supported; the levels of its modifier are used")
        for system in owner.particle_systems:
            if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
                edits.unsupported(name, f"{name}: hair particles ({system.name}) are not supported and are left out")

    def _put_groups(self, groups, group_of_instance, matrices, random_ids):
        order = np.argsort(group_of_instance, kind="stable")
        ends = np.searchsorted(group_of_instance[order], np.arange(len(groups)), side="right")
        starts = np.searchsorted(group_of_instance[order], np.arange(len(groups)), side="left")
        for group, start, end in zip(groups, starts, ends):
            if group is None:
                continue
            identifier, value = group
            chosen = order[start:end]
            transforms = matrices[chosen]
            if len(chosen) == 1 and np.isfinite(transforms).all():
                value["transform"] = transforms.reshape(-1).tolist()
            else:
                value["transforms"] = self._edits.array(transforms)
            if self._neighbours is not None and "mesh" in value:
                keys = [self._instance_keys[number] for number in chosen]
                moved = self._neighbours.object(self._edits, keys, transforms)
                if moved is not None:
                    value["motion"] = moved
            if random_ids is not None:
                value["random_ids"] = self._edits.array(random_ids[chosen])
            rows = self._particles.of(chosen.tolist()) if self._particles is not None and "mesh" in value else None
            if rows is not None:
                value["particles"] = self._edits.array(rows)
            self._edits.put("object", identifier, value)


def _may_be_without_faces(original):
    """Whether an object without faces is no surprise, and so not worth a message (Cycles never gives one).

    True of curves without thickness and their like, and of meshes that are there for what they make: instances or
    particles. A mesh that simply has no face is named in the render report.
    """
    return (
        original.type != "MESH"
        or original.instance_type != "NONE"
        or len(original.particle_systems) > 0
        or any(modifier.type == "NODES" for modifier in original.modifiers)
    )


def _unique(base, taken):
    """base, or base#2, base#3... if it is taken already; the result is taken afterwards."""
    name, number = base, 1
    while name in taken:
        number += 1
        name = f"{base}#{number}"
    taken.add(name)
    return name
