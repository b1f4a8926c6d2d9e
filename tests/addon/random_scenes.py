# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Inside Blender: scenes that nobody would make, the same for the same seed. Objects of every type, modifiers, materials, lights and
worlds of randomly linked nodes with random options and values, many of them extreme or not finite, and random settings.

What Blender itself refuses or cannot do is left out of the scene; nothing here judges what the renderer makes of it."""

import contextlib
import math
import random

import bpy

_EXTREMES = (0.0, -1.0, 1.0, 1e-30, 1e30, -1e30, 50.0, 1e-6, 1e6, math.inf, math.nan)
_OUTPUTS = {"ShaderNodeOutputMaterial", "ShaderNodeOutputWorld", "ShaderNodeOutputLight", "ShaderNodeOutputLineStyle"}
_NOT_NODES = {"ShaderNode", "ShaderNodeTree", "ShaderNodeGroup", "ShaderNodeCustomGroup"} | _OUTPUTS
# Not among them: those that take Blender minutes (remesh, ocean, skin).
_MODIFIERS = (
    "ARRAY BEVEL BOOLEAN BUILD CAST CURVE DECIMATE DISPLACE EDGE_SPLIT EXPLODE LATTICE MASK MIRROR NODES PARTICLE_SYSTEM "
    "SCREW SIMPLE_DEFORM SMOOTH SOLIDIFY SUBSURF TRIANGULATE WAVE WELD WIREFRAME"
).split()
_INTEGRATORS = ("PT", "PT", "PT", "LT", "VPL", "BPT", "PPM", "BPM", "VCM")
_VISIBILITY = ("camera", "diffuse", "glossy", "transmission", "shadow")
# What has no meaning for a renderer, or leaves nothing to render.
_KEPT = set(
    "name label location width height parent select mute hide use clip_start clip_end lens angle angle_x angle_y sensor_width sensor_height "
    "ortho_scale samples".split()
)


class RandomScene:
    """Builds the scene of a seed in place of the open file; nodes: the types of shader nodes that are in it."""

    def __init__(self, seed):
        self._random = random.Random(seed)
        self.nodes = set()
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        self._types = sorted(name for name in dir(bpy.types) if name.startswith("ShaderNode") and name not in _NOT_NODES)
        self._build()

    def _chance(self, share):
        return self._random.random() < share

    def _some(self, things):
        return self._random.choice(list(things))

    def _number(self):
        return self._random.choice(_EXTREMES) if self._chance(0.3) else self._random.uniform(-0.2, 2.0)

    def _value(self, found):
        """A value for an RNA property or socket whose present value is found."""
        if isinstance(found, bool):
            return self._chance(0.5)
        if isinstance(found, int):
            return self._random.randint(-10, 20)
        if isinstance(found, float):
            return self._number()
        return [self._number() for _ in found]

    def _fill(self, thing):
        """Gives about half of the properties of thing, and of its inputs if it is a node, random values."""
        for property in thing.bl_rna.properties:
            name = property.identifier
            if property.is_readonly or name in _KEPT or name.startswith("bl_") or self._chance(0.5):
                continue
            with contextlib.suppress(AttributeError, TypeError, ValueError, IndexError):
                if property.type == "ENUM":
                    if not property.is_enum_flag:
                        setattr(thing, name, self._some(item.identifier for item in property.enum_items))
                elif property.type == "STRING":
                    setattr(thing, name, self._some(("", "UVMap", "position", "näh", "x" * 100)))
                elif property.type == "POINTER":
                    choices = {"Object": bpy.data.objects, "Image": bpy.data.images}.get(property.fixed_type.identifier)
                    if choices:
                        setattr(thing, name, self._some(choices))
                else:
                    setattr(thing, name, self._value(getattr(thing, name)))
        for socket in getattr(thing, "inputs", ()):
            if hasattr(socket, "default_value") and not isinstance(socket.default_value, str) and self._chance(0.6):
                with contextlib.suppress(AttributeError, TypeError, ValueError):
                    socket.default_value = self._value(socket.default_value)

    def _graph(self, tree, output, depth=0):
        """Fills a node tree that ends in a node of type output."""
        tree.nodes.clear()
        made = [tree.nodes.new(output)]
        for _ in range(self._random.randint(1, 12)):
            if depth < 3 and self._chance(0.08):
                node = tree.nodes.new("ShaderNodeGroup")
                node.node_tree = self._group(depth + 1)
            else:
                try:
                    node = tree.nodes.new(self._some(self._types))
                except RuntimeError:  # not for this kind of tree
                    continue
                self.nodes.add(node.bl_idname)
            self._fill(node)
            node.mute = self._chance(0.05)
            made.append(node)
        for _ in range(3 * len(made)):
            source, target = self._some(made), self._some(made)
            if source.outputs and target.inputs:
                begin = self._some(source.outputs)
                alike = [end for end in target.inputs if end.type == begin.type]
                tree.links.new(begin, self._some(alike if alike and self._chance(0.8) else target.inputs))
        closures = [socket for node in made for socket in node.outputs if socket.type == "SHADER"]
        if closures and made[0].inputs:
            tree.links.new(self._some(closures), made[0].inputs[0])

    def _group(self, depth):
        group = bpy.data.node_groups.new("group", "ShaderNodeTree")
        for kind, name in (("OUTPUT", "Shader"), ("OUTPUT", "Float"), ("INPUT", "Color")):
            if hasattr(group, "interface"):
                group.interface.new_socket(name, in_out=kind, socket_type=f"NodeSocket{name}")
            else:
                (group.outputs if kind == "OUTPUT" else group.inputs).new(f"NodeSocket{name}", name)
        self._graph(group, "NodeGroupOutput", depth)
        return group

    def _place(self):
        return [self._random.uniform(-2, 2) * (self._some((1e3, 1e6, 1e-6)) if self._chance(0.02) else 1) for _ in range(3)]

    def _object(self):
        add, place = bpy.ops, self._place()
        makers = [
            lambda: add.mesh.primitive_cube_add(location=place),
            lambda: add.mesh.primitive_uv_sphere_add(segments=12, ring_count=8, location=place),
            lambda: add.mesh.primitive_plane_add(size=6, location=place),
            lambda: add.mesh.primitive_torus_add(location=place),
            lambda: add.mesh.primitive_monkey_add(location=place),
            lambda: add.mesh.primitive_circle_add(location=place),
            lambda: add.curve.primitive_bezier_circle_add(location=place),
            lambda: add.surface.primitive_nurbs_surface_sphere_add(location=place),
            lambda: add.object.metaball_add(type="BALL", location=place),
            lambda: add.object.text_add(location=place),
            lambda: add.object.empty_add(location=place),
            lambda: add.object.armature_add(location=place),
            lambda: add.object.volume_add(location=place),
            lambda: add.object.speaker_add(location=place),
            lambda: add.object.add(type="LATTICE", location=place),
            lambda: add.object.curves_empty_hair_add(location=place),
        ]
        try:
            self._some(makers)()
        except (RuntimeError, AttributeError):  # e.g. hair without a mesh to grow on
            return
        found = bpy.context.object
        found.rotation_euler = [self._random.uniform(0, 6) for _ in range(3)]
        if self._chance(0.3):
            found.scale = [self._some((1, 1, self._random.uniform(-2, 2), 0.0, 1e-5, 1e5)) for _ in range(3)]
        if found.type == "MESH":
            self._modify(found)
        if self._chance(0.1):
            with contextlib.suppress(RuntimeError, TypeError):
                found.parent = self._some(bpy.data.objects)
        if found.type == "EMPTY" and self._chance(0.5):
            found.instance_type, found.instance_collection = "COLLECTION", self._some(bpy.data.collections)
        for _ in range(self._random.randint(0, 3)):
            if hasattr(found.data, "materials"):
                found.data.materials.append(self._some([*bpy.data.materials, None]))
        for kind in _VISIBILITY:
            setattr(found, f"visible_{kind}", not self._chance(0.05))
        found.is_shadow_catcher, found.is_holdout = self._chance(0.1), self._chance(0.05)
        found.lambent.shadow_pass = self._chance(0.1)

    def _modify(self, found):
        for _ in range(self._random.randint(0, 2)):
            modifier = found.modifiers.new("modifier", self._some(_MODIFIERS))
            if modifier is not None and modifier.type in ("BOOLEAN", "CURVE", "LATTICE"):
                with contextlib.suppress(TypeError):
                    modifier.object = self._some(bpy.data.objects)
        if self._chance(0.1):
            for vertex in self._random.sample(list(found.data.vertices), 3):
                vertex.co = [self._number() for _ in range(3)]
        if self._chance(0.1):
            found.instance_type = self._some(("VERTS", "FACES"))

    def _light(self):
        bpy.ops.object.light_add(type=self._some(("POINT", "SUN", "SPOT", "AREA")), location=self._place())
        light = bpy.context.object.data
        self._fill(light)
        if self._chance(0.3):
            light.use_nodes = True
            self._graph(light.node_tree, "ShaderNodeOutputLight")

    def _material(self):
        material = bpy.data.materials.new("material")
        material.use_nodes = True
        self._graph(material.node_tree, "ShaderNodeOutputMaterial")
        how = self._some(("BUMP", "DISPLACEMENT", "BOTH"))
        if hasattr(material, "displacement_method"):
            material.displacement_method = how
        elif hasattr(material, "cycles"):
            material.cycles.displacement_method = how

    def _build(self):
        scene = bpy.context.scene
        scene.render.engine = "LAMBENT"
        for number in range(3):
            image = bpy.data.images.new(f"image {number}", 8, 8, float_buffer=number == 1)
            if number == 2:
                image.source, image.filepath = "FILE", "/nonexistent.png"
        bpy.data.collections.new("collection")
        bpy.ops.mesh.primitive_cube_add()
        for count, make in ((4, self._material), (8, self._object), (3, self._light)):
            for _ in range(self._random.randint(1, count)):
                make()
        if self._chance(0.7):
            scene.world = bpy.data.worlds.new("world")
            scene.world.use_nodes = True
            self._graph(scene.world.node_tree, "ShaderNodeOutputWorld")
        bpy.ops.object.camera_add(location=(0, -7, 2), rotation=(math.radians(75), 0, 0))
        scene.camera = bpy.context.object
        for settings in (scene.camera.data, scene.camera.data.dof, scene.lambent, scene.view_layers[0], scene.view_layers[0].lambent):
            if self._chance(0.2):
                self._fill(settings)
        render = scene.render
        render.resolution_x, render.resolution_y, render.resolution_percentage = 32, 24, 100
        render.film_transparent = self._chance(0.3)
        scene.lambent.integrator, scene.lambent.samples = self._some(_INTEGRATORS), self._some((1, 2, 4))
        # So that the same scene is the same picture.
        scene.lambent.time_limit = 0

    def edit(self):
        """Changes something of the scene, as somebody would between two renders; returns what, for messages."""
        edits = (
            self._edit_transform,
            self._edit_vertices,
            self._edit_value,
            self._edit_link,
            self._edit_slots,
            self._edit_light,
            self._edit_modifier,
            self._object,
            self._light,
            self._remove,
            self._edit_visibility,
            self._edit_settings,
        )
        chosen = self._some(edits)
        with contextlib.suppress(RuntimeError):
            chosen()
        return chosen.__name__.lstrip("_")

    def _edit_transform(self):
        found = self._some(bpy.data.objects)
        found.location[self._random.randrange(3)] += self._random.uniform(-1, 1)
        found.rotation_euler[self._random.randrange(3)] += self._random.uniform(-1, 1)

    def _edit_vertices(self):
        mesh = self._some(bpy.data.meshes)
        for vertex in mesh.vertices[: self._random.randint(1, 8)]:
            vertex.co.x += self._random.uniform(-0.5, 0.5)
        mesh.update()

    def _trees(self):
        owners = [*bpy.data.materials, *bpy.data.worlds, *bpy.data.lights]
        return [owner.node_tree for owner in owners if owner.node_tree] + list(bpy.data.node_groups)

    def _edit_value(self):
        tree = self._some(self._trees())
        if len(tree.nodes):
            self._fill(self._some(tree.nodes))

    def _edit_link(self):
        tree = self._some(self._trees())
        if len(tree.links):
            tree.links.remove(self._some(tree.links))

    def _edit_slots(self):
        meshes = [found for found in bpy.data.objects if found.type == "MESH" and len(found.material_slots)]
        if meshes:
            self._some(self._some(meshes).material_slots).material = self._some(bpy.data.materials)

    def _edit_light(self):
        if len(bpy.data.lights):
            self._fill(self._some(bpy.data.lights))

    def _edit_modifier(self):
        found = self._some(bpy.data.objects)
        if len(found.modifiers):
            self._fill(self._some(found.modifiers))
        elif found.type == "MESH":
            self._modify(found)

    def _remove(self):
        others = [found for found in bpy.data.objects if found.type != "CAMERA"]
        if len(others) > 1:
            bpy.data.objects.remove(self._some(others))

    def _edit_visibility(self):
        found = self._some(bpy.data.objects)
        found.hide_render = not found.hide_render

    def _edit_settings(self):
        scene = bpy.context.scene
        scene.render.film_transparent = not scene.render.film_transparent
        scene.camera.data.lens *= self._random.uniform(0.5, 2.0)
