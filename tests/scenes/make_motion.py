# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that moves over a picture, for the Vector pass: a camera that travels and turns, an object that travels, one that
turns and grows, instances that travel with their instancer, instances of geometry nodes, a curve that grows, a mesh that a shape key deforms, one that a modifier bends while it
travels, a half-transparent thing in front, and things that stand still; the world behind. At frame 5, between keys."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks
import bpy

k_frame = 5


def animate(owner, path, first, last, linear=True):
    """Keys a property at frames 1 and 10; between them it changes evenly, or by Blender's ease."""
    for frame, value in ((1, first), (10, last)):
        setattr(owner, path, value)
        owner.keyframe_insert(path, frame=frame)
    action = owner.id_data.animation_data.action
    # Since Blender 4.4 an object and its data may share an action.
    bags = [action] if hasattr(action, "fcurves") else action.layers[0].strips[0].channelbags
    for bag in bags:
        for curve in bag.fcurves:
            for key in curve.keyframe_points:
                if curve.data_path.endswith(path):
                    key.interpolation = "LINEAR" if linear else "BEZIER"


def add_objects(scene):
    grey = blocks.simple("Grey", "ShaderNodeBsdfDiffuse", Color=(0.6, 0.6, 0.6))
    red = blocks.simple("Red", "ShaderNodeBsdfDiffuse", Color=(0.8, 0.15, 0.1))
    blocks.place(scene, blocks.quad("Floor", [(-3, -2, 0), (3, -2, 0), (3, 2, 0), (-3, 2, 0)]), grey)
    travels = blocks.place(scene, blocks.box("Travels", (0.5, 0.5, 0.5)), red, (-1.5, 0, 0.3), name="Travels")
    animate(travels, "location", (-2, 0.2, 0.3), (0.0, -0.5, 0.6), linear=False)
    turns = blocks.place(scene, blocks.box("Turns", (0.6, 0.6, 0.6)), grey, (1.5, 0.6, 0.5), name="Turns")
    animate(turns, "rotation_euler", (0, 0, 0), (0.4, 0.2, 1.8))
    animate(turns, "scale", (0.6, 0.6, 0.6), (1.4, 1.0, 1.0))

    keyed = blocks.place(scene, blocks.sphere("Keyed", 0.4, 24, 12), red, (0.2, 1.0, 0.5), name="Keyed")
    keyed.shape_key_add(name="Basis")
    longer = keyed.shape_key_add(name="Longer")
    for point in longer.data:
        point.co.z *= 2.0
    animate(longer, "value", 0.0, 1.0)
    bent = blocks.place(scene, blocks.sphere("Bent", 0.35, 24, 12), grey, (0.9, -0.9, 0.5), name="Bent")
    bend = bent.modifiers.new("Bend", "SIMPLE_DEFORM")
    bend.deform_method, bend.deform_axis = "TWIST", "X"
    animate(bend, "angle", 0.0, 2.0)
    animate(bent, "location", (0.9, -0.9, 0.5), (1.1, -1.2, 0.6))

    instanced = bpy.data.collections.new("Instanced")
    for number in range(3):
        piece = blocks.place(scene, blocks.box(f"Piece{number}", (0.25, 0.25, 0.25)), red, (0.4 * number, 0, 0))
        scene.collection.objects.unlink(piece)
        instanced.objects.link(piece)
        if number == 1:
            animate(piece, "location", (0.4, 0, -0.2), (0.4, 0, 0.4))
    instancer = bpy.data.objects.new("Instancer", None)
    instancer.instance_type, instancer.instance_collection = "COLLECTION", instanced
    scene.collection.objects.link(instancer)
    animate(instancer, "location", (-2.2, -1.0, 0.2), (-1.4, -1.2, 0.7))
    add_node_instances(scene, grey)
    add_curve(scene, red)


def new_node_group(name):
    """A geometry node tree with an input and an output of geometry."""
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        if hasattr(group, "interface"):
            group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
        else:
            (group.inputs if way == "INPUT" else group.outputs).new("NodeSocketGeometry", "Geometry")
    return group


def add_node_instances(scene, material):
    """A line of boxes that geometry nodes place on points, which nodes move apart while their object travels."""
    piece = blocks.place(scene, blocks.box("Node Piece", (0.22, 0.22, 0.22)), material, (0, 9, 0), name="Node Piece")
    group = new_node_group("Spread")
    nodes, links = group.nodes, group.links
    info, points, output = nodes.new("GeometryNodeObjectInfo"), nodes.new("GeometryNodeInstanceOnPoints"), nodes.new("NodeGroupOutput")
    info.inputs["Object"].default_value = piece
    info.inputs["As Instance"].default_value = True
    moved = nodes.new("GeometryNodeTranslateInstances")
    links.new(nodes.new("NodeGroupInput").outputs[0], points.inputs["Points"])
    links.new(info.outputs["Geometry"], points.inputs["Instance"])
    links.new(points.outputs["Instances"], moved.inputs["Instances"])
    links.new(moved.outputs["Instances"], output.inputs[0])
    animate(moved.inputs["Translation"], "default_value", (0, 0, -0.2), (0, 0.3, 0.5))
    row = bpy.data.meshes.new("Row")
    row.from_pydata([(0.45 * i, 0, 0) for i in range(4)], [], [])
    owner = blocks.place(scene, row, material, (-0.3, 1.5, 1.3), name="Row")
    owner.modifiers.new("Spread", "NODES").node_group = group
    animate(owner, "location", (-0.6, 1.5, 1.2), (0.3, 1.4, 1.4))


def add_curve(scene, material):
    """A bevelled curve that travels while its bevel grows: a mesh of other vertices in each frame."""
    curve = bpy.data.curves.new("Wire", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.08
    spline = curve.splines.new("POLY")
    spline.points.add(2)
    for point, place in zip(spline.points, ((0, 0, 0, 1), (0.5, 0.2, 0.3, 1), (1.0, 0, 0, 1))):
        point.co = place
    curve.materials.append(material)
    wire = bpy.data.objects.new("Wire", curve)
    scene.collection.objects.link(wire)
    animate(wire, "location", (-2.4, 1.4, 0.9), (-1.8, 1.4, 1.2))
    animate(curve, "bevel_depth", 0.05, 0.15)


def veil_material():
    made = bpy.data.materials.new("Veil")
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    mix, output = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeOutputMaterial")
    mix.inputs["Fac"].default_value = 0.3
    links.new(nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[1])
    links.new(nodes.new("ShaderNodeBsdfDiffuse").outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], output.inputs["Surface"])
    return made


def main():
    scene = blocks.begin()
    scene.frame_start, scene.frame_end = 1, 10
    add_objects(scene)
    veil = blocks.place(scene, blocks.quad("Veil", [(-0.4, 0, 0), (0.4, 0, 0), (0.4, 0, 0.8), (-0.4, 0, 0.8)]), veil_material())
    animate(veil, "location", (-0.6, -1.5, 0.1), (0.2, -1.5, 0.1))
    blocks.light(scene, "SUN", "Sun", 3.0, (3, -2, 5), (0, 0, 0))
    blocks.world(scene, (0.5, 0.6, 0.8), 0.4)
    made = blocks.camera(scene, (0, -6.5, 2.6), (0, 0, 0.5), 40.0)
    animate(made, "location", (-0.5, -6.6, 2.4), (0.6, -6.2, 2.9))
    turn = made.rotation_euler.copy()
    animate(made, "rotation_euler", turn, (turn.x - 0.05, turn.y + 0.04, turn.z + 0.15))
    bpy.context.view_layer.use_pass_vector = bpy.context.view_layer.use_pass_z = True
    scene.frame_set(k_frame)
    blocks.finish(scene, 192, 108)


main()
