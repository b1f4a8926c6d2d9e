# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What travels of the frames before and after, and of mattes and shadow passes of light groups."""

import numpy as np
import pytest

# At frame 5: travels 1 m a frame along x; turns stands on it; keyed grows; an instancer moves 2 m along y a frame.
MOVING = """
scene.frame_start, scene.frame_end = 1, 10
def animate(owner, path, first, last):
    for frame, value in ((1, first), (10, last)):
        setattr(owner, path, value)
        owner.keyframe_insert(path, frame=frame)
    action = owner.id_data.animation_data.action
    bags = [action] if hasattr(action, 'fcurves') else action.layers[0].strips[0].channelbags
    curves = [curve for bag in bags for curve in bag.fcurves]
    for curve in curves:
        for key in curve.keyframe_points: key.interpolation = 'LINEAR'
travels, still, keyed = quad('travels'), quad('still'), quad('keyed')
animate(travels, 'location', (0, 0, 0), (9, 0, 0))
keyed.shape_key_add(name='Basis')
for point in keyed.shape_key_add(name='Up').data: point.co.z += 9
animate(keyed.data.shape_keys.key_blocks['Up'], 'value', 0, 1)
source = bpy.data.collections.new('source')
quad('thing', source)
empty = add('empty', None)
empty.instance_type, empty.instance_collection = 'COLLECTION', source
animate(empty, 'location', (0, 0, 0), (0, 18, 0))
animate(scene.camera, 'location', (0, -5, 0), (0, -5, 9))
animate(scene.camera.data, 'lens', 20, 29)
scene.frame_set(5)
layer = bpy.context.view_layer
"""


def moved(value, step, row):
    """The translation along an axis of a step."""
    return value["motion"][step]["transform"][4 * row + 3]


def test_the_frames_before_and_after_travel_where_the_pass_is_on(run_blender):
    run = run_blender(
        MOVING
        + """
layer.use_pass_vector = True
render()
print('FRAME', scene.frame_current, travels.location.x)
layer.use_pass_vector = False
render()
"""
    )
    assert "FRAME 5 4.0" in run.output
    objects = run.values("object", 1)
    for name, step, row, expected in (("travels", "previous", 0, 3), ("travels", "next", 0, 5), ("empty/thing", "previous", 1, 6), ("empty/thing", "next", 1, 10)):
        transforms = run.array(objects[name]["motion"][step]["transforms"])
        assert transforms.shape == (1, 3, 4) and transforms[0, row, 3] == pytest.approx(expected)
    assert objects["travels"]["transform"][3] == pytest.approx(4)
    assert "motion" not in objects["still"]
    assert "positions" not in objects["travels"]["motion"]["next"]
    for step, height in (("previous", 3), ("next", 5)):
        positions = run.array(objects["keyed"]["motion"][step]["positions"])
        assert np.allclose(positions[:, 2], height, atol=1e-5)
    camera = next(iter(run.values("camera", 1).values()))
    assert [moved(camera, step, 2) for step in ("previous", "next")] == pytest.approx([3, 5])
    assert [camera["motion"][step]["focal_length_mm"] for step in ("previous", "next")] == pytest.approx([23, 25])
    assert camera["focal_length_mm"] == pytest.approx(24)
    # Without the pass nothing of it.
    assert not any("motion" in value for value in run.values("object", 2).values())
    assert "motion" not in next(iter(run.values("camera", 2).values()))


def test_with_motion_blur_the_pass_is_empty_as_for_cycles(run_blender):
    run = run_blender(MOVING + "layer.use_pass_vector = scene.render.use_motion_blur = True\nrender()\n")
    assert not any("motion" in value for value in run.values("object").values())
    assert "vector" in str(run.values("settings")["render"]["passes"])


def test_an_animation_moves_from_frame_to_frame_with_persistent_data(run_blender):
    run = run_blender(
        MOVING
        + """
scene.render.use_persistent_data = layer.use_pass_vector = True
import os
scene.render.filepath = os.path.join(os.environ['LAMBENT_TEST_DIR'], 'frame')
scene.frame_start, scene.frame_end = 3, 5
bpy.ops.render.render(animation=True)
"""
    )
    for count, frame in enumerate((3, 4, 5), start=1):
        value = run.values("object", count)["travels"]
        assert value["transform"][3] == pytest.approx(frame - 1)
        assert run.array(value["motion"]["next"]["transforms"])[0, 0, 3] == pytest.approx(frame)
        mesh = next(value for name, value in run.values("mesh", count).items() if "keyed" in name)
        assert np.allclose(run.array(mesh["positions"])[:, 2], frame - 1, atol=1e-5)


def test_an_instance_that_is_not_there_in_the_other_frame_stands_still(run_blender):
    run = run_blender(
        MOVING
        + """
hidden = quad('hidden')
for frame, value in ((4, True), (5, False)):
    hidden.hide_render = value
    hidden.keyframe_insert('hide_render', frame=frame)
scene.frame_set(5)
layer.use_pass_vector = True
render()
"""
    )
    assert "motion" not in run.values("object")["hidden"]


def test_mattes_name_their_objects_and_shadow_passes_their_light_groups(run_blender):
    run = run_blender(
        """
inner = bpy.data.collections.new('inner'); scene.collection.children.link(inner)
nested = bpy.data.collections.new('nested'); inner.children.link(nested)
quad('inside', nested); quad('outside'); quad('chosen')
layer = bpy.context.view_layer
for number in range(3): bpy.ops.lambent.matte_add()
mattes = layer.lambent.mattes
mattes[0].collection, mattes[1].object = inner, bpy.data.objects['chosen']
mattes[1].name = 'One'
layer.lambent.active_matte = 2
bpy.ops.lambent.matte_remove()
print('NAMES', [matte.name for matte in mattes], layer.lambent.active_matte)
bpy.data.objects['outside'].is_shadow_catcher = bpy.data.objects['outside'].lambent.matte = True
bpy.data.objects['chosen'].lambent.matte = True
layer.lambent.use_pass_matte_light = layer.lambent.use_pass_shadow_ratio = layer.lambent.use_shadow_groups = True
for name in ('keys', 'rim'): layer.lightgroups.add(name=name)
render()
"""
    )
    assert "NAMES ['Matte 1', 'One'] 1" in run.output
    objects = run.values("object")
    assert objects["inside"]["mattes"] == ["Matte 1"] and objects["chosen"]["mattes"] == ["One"]
    assert "mattes" not in objects["outside"]
    # A matte is a shadow catcher.
    assert objects["outside"]["matte"] and "matte" not in objects["chosen"]
    entries = {entry["name"]: (entry["kind"], entry.get("argument")) for entry in run.values("settings")["render"]["passes"][1:]}
    assert entries["Matte 1"] == ("matte", "Matte 1") and entries["One"] == ("matte", "One")
    assert entries["Shadow Ratio"] == ("shadow_ratio", None) and entries["Shadow Ratio_rim"] == ("shadow_ratio", "rim")
    assert entries["Matte Light"] == ("matte_light", None) and "Without Shadow_rim" not in entries
