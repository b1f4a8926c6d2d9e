# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Inside Blender: gives a random scene random view layers, passes, light groups, AOVs and mattes, the same for the same seed; and says
what must hold of the picture."""

import random

import bpy

from lambent.sync import passes

_LIGHT = [f"use_pass_{kind}_{part}" for kind in ("diffuse", "glossy", "transmission") for part in ("direct", "indirect", "color")]
_LIGHT += ["use_pass_emit", "use_pass_environment"]
_TECHNIQUES = [f"use_pass_technique_{name}" for name in ("unidirectional", "connection", "merging")]
_EXPRESSIONS = ("C.*L", "C<RD>L", "C<T.>.*L", "C[DG]*<RS>+L", "CL", "C<..'keys'>L", "C.*<L.'rim'>", "C(DL", "", "x", "C" + "." * 40 + "L", "C.*" * 30)
# Names of passes that Blender or Lambent make, names that are no names, and long ones.
_NAMES = ("tint", "amount", "Combined", "Depth", "näh", "n" * 40, "a b", "Combined_keys", "ao", "matte", "combined")
_GROUPS = ("keys", "rim", "sky", "g" * 20)


class RandomPasses:
    """Changes the scene of a RandomScene. sums: {layer: [what adds up to its Combined]}, of what was asked for on purpose; asked: {layer:
    [(name, number of channels)]} as the add-on will register them."""

    def __init__(self, seed):
        self._random = random.Random(seed)
        self._scene = scene = bpy.context.scene
        self.sums = {}
        scene.lambent.integrator = self._some(("PT", "LT", "VPL", "BPT", "PPM", "BPM", "VCM"))
        scene.lambent.film_transparent_glass = self._chance(0.5)
        if self._chance(0.7):  # what catchers show is in no light pass
            for thing in bpy.data.objects:
                thing.is_shadow_catcher = thing.lambent.matte = False
        self._catching = any(thing.is_shadow_catcher for thing in bpy.data.objects)
        self._grouped = self._group_lights()
        self._write_aovs()
        for _ in range(self._some((0, 0, 1, 2))):
            self._mask(scene.view_layers.new(self._some(("Second", "Näh", "layer"))))
        for layer in scene.view_layers:
            layer.use = True
            self._ask(layer)
        self.asked = {layer.name: self._registered(layer) for layer in scene.view_layers}

    def _chance(self, share):
        return self._random.random() < share

    def _some(self, things):
        return self._random.choice(list(things))

    def _group_lights(self):
        """Puts what shines into light groups; returns whether all of it is in some."""
        every = self._chance(0.5)
        for owner in [*bpy.data.objects, *bpy.data.worlds]:
            owner.lightgroup = self._some(_GROUPS) if every or self._chance(0.5) else ""
        return every

    def _write_aovs(self):
        for material in bpy.data.materials:
            if material.node_tree and self._chance(0.6):
                node = material.node_tree.nodes.new("ShaderNodeOutputAOV")
                if hasattr(node, "aov_name"):
                    node.aov_name = self._some(_NAMES)
                else:
                    node.name = self._some(_NAMES)
                outputs = [socket for other in material.node_tree.nodes for socket in other.outputs if socket.type in ("VALUE", "RGBA")]
                if outputs:
                    material.node_tree.links.new(self._some(outputs), self._some(node.inputs))

    def _mask(self, layer):
        collection = bpy.data.collections.new("masked")
        self._scene.collection.children.link(collection)
        things = list(self._scene.collection.objects)
        for thing in things if self._chance(0.1) else self._random.sample(things, len(things) // 3):
            self._scene.collection.objects.unlink(thing)
            collection.objects.link(thing)
        setattr(layer.layer_collection.children[collection.name], self._some(("exclude", "holdout", "indirect_only")), True)
        if self._chance(0.2) and len(bpy.data.materials):
            layer.material_override = self._some(bpy.data.materials)
        layer.samples = self._some((0, 0, 3))

    def _ask(self, layer):
        for kind in passes.kinds():
            setattr(*passes.switch(layer, kind), self._chance(0.4))
        wholes = []
        for name, owner, switches in (("light", layer, _LIGHT), ("techniques", layer.lambent, _TECHNIQUES)):
            if self._chance(0.6):
                for switch in switches:
                    setattr(owner, switch, True)
                wholes.append(name)
        layer.pass_cryptomatte_depth = self._some((2, 6, 16))
        for _ in range(self._some((0, 1, 3, 60) if self._chance(0.1) else (0, 1, 3))):
            aov = layer.aovs.add()
            aov.name, aov.type = self._some(_NAMES), self._some(("COLOR", "VALUE"))
        for name in _GROUPS if self._chance(0.5) else self._random.sample(_GROUPS, 2):
            layer.lightgroups.add(name=name)
        if self._grouped and len(layer.lightgroups) == len(_GROUPS):
            wholes.append("groups")
        layer.lambent.use_shadow_groups = self._chance(0.3)
        if self._chance(0.5):
            layer.lambent.use_pass_without_shadow = layer.lambent.use_pass_shadow_difference = True
            wholes.append("shadow")
        if self._chance(0.5):
            whole = layer.lambent.light_paths.add()
            whole.name, whole.expression = "everything", "C.*L"
            wholes.append("paths")
        for _ in range(self._some((0, 1, 4))):
            path = layer.lambent.light_paths.add()
            path.name, path.expression = self._some((*_NAMES, "path")), self._some(_EXPRESSIONS)
        for _ in range(self._some((0, 1, 2))):
            matte = layer.lambent.mattes.add()
            matte.name = self._some((*_NAMES, "cover"))
            if self._chance(0.7):
                matte.object = self._some(bpy.data.objects)
            if self._chance(0.3):
                matte.collection = self._some(bpy.data.collections)
        self.sums[layer.name] = [] if self._catching else wholes

    def _registered(self, layer):
        kept, _ = passes.unique(passes.asked(self._scene, layer))
        return [(name, len(entry.channels)) for entry in kept for name in entry.names]
