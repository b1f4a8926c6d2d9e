# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lambent in a real window under Xvfb: F12 with buckets and Esc, panels, and the rendered viewport."""

import numpy as np
import pytest
from screenshots import gradient_pixels, orange_pixels, read_screenshot


def test_f12_shows_buckets_and_esc_stops_at_once_and_keeps_them(run_window, tmp_path):
    run = run_window(
        """
quad()
scene.render.resolution_x, scene.render.resolution_y = 640, 400
state = {}
def cancelled():
    if bpy.app.is_job_running('RENDER'):
        assert time.monotonic() - state['escape'] < 3, 'Esc did not stop the render'
        steps.insert(0, (0.05, cancelled)); return
    print('STOPPED AFTER', time.monotonic() - state['escape'])
def press():
    assert bpy.app.is_job_running('RENDER'), 'the render is not running'
    state['escape'] = time.monotonic()
    escape()
steps = [(1.0, render_in_window)]
steps += [(1.0, screenshot_when(steps, 'during', lambda pixels: gradient_pixels(pixels) > 10_000 and orange_pixels(pixels) > 16)),
          (0.1, press), (0.05, cancelled),
          (1.0, screenshot_when(steps, 'after', lambda pixels: orange_pixels(pixels) < 8))]
run(steps)
""",
        mode="endless",
    )
    if "NO XTST" in run.output:
        pytest.skip("this Blender's system has no libXtst to press keys with")
    assert "STOPPED AFTER" in run.output, run.output
    assert len(run.of_type("render_cancel")) == 1
    during, after = read_screenshot(tmp_path / "during"), read_screenshot(tmp_path / "after")
    # Some of the tiles of 4096 px are there, and they stay after Esc.
    shown, kept = gradient_pixels(during), gradient_pixels(after)
    assert shown > 10_000 and kept >= shown
    # The corners of the tile that was being worked on are gone.
    assert orange_pixels(during) > 16 and orange_pixels(after) < 8


def test_the_viewport_is_rendered_follows_changes_and_sends_only_those(run_window, tmp_path):
    run = run_window(
        """
still, moving = quad('still'), quad('moving')
def view(): return next(area for area in window().screen.areas if area.type == 'VIEW_3D')
def shade(kind): view().spaces.active.shading.type = kind
def move(): moving.location.z = 2
def turn(): view().spaces.active.region_3d.view_rotation = (1, 0, 0, 0)
def change(): moving.data.vertices[0].co.x = 9; moving.data.update()
steps = [(1.0, lambda: shade('RENDERED'))]
steps += [(1.0, screenshot_when(steps, 'view', lambda pixels: gradient_pixels(pixels) > 50_000)), (0.5, move), (1.0, turn),
          (1.0, change), (1.0, lambda: shade('SOLID'))]
run(steps)
"""
    )
    assert gradient_pixels(read_screenshot(tmp_path / "view")) > 50_000
    sent = [{(edit["op"], edit["kind"], edit["id"]) for edit in edits} for edits in run.transactions]
    assert ("upsert", "mesh", "mesh:still") in sent[0] and ("upsert", "object", "moving") in sent[0]
    assert {("upsert", "object", "moving")} in sent[1:]
    assert {("upsert", "camera", "lambent:view")} in sent[1:]
    assert {("upsert", "mesh", "mesh:moving")} in sent[1:]
    # The other mesh never travels again.
    assert not any(("upsert", "mesh", "mesh:still") in edits for edits in sent[1:])
    assert "Traceback" not in run.output


def test_passes_switched_on_under_a_rendered_viewport_leave_it_alone(run_window, tmp_path):
    run = run_window(
        """
ob = quad()
layer = bpy.context.view_layer
def view(): return next(area for area in window().screen.areas if area.type == 'VIEW_3D')
def shade(): view().spaces.active.shading.type = 'RENDERED'
def switch():
    layer.use_pass_normal = layer.use_pass_cryptomatte_object = True
    layer.aovs.add().name = 'tint'
    layer.lambent.use_pass_error = True
    bpy.ops.lambent.light_path_add()
def move(): ob.location.z = 2
steps = [(1.0, shade), (1.5, switch), (1.0, move), (1.0, lambda: screenshot('view')), (0.1, render_in_window), (3.0, lambda: print('DONE'))]
run(steps)
""",
        mode="normal",
    )
    assert "DONE" in run.output and "Traceback" not in run.output
    assert gradient_pixels(read_screenshot(tmp_path / "view")) > 50_000
    asked = [
        (message["session"], edit["value"]["passes"])
        for message in run.of_type("transaction")
        for edit in message["header"]["edits"]
        if edit["op"] == "upsert" and edit["kind"] == "settings"
    ]
    viewport = asked[0][0]
    assert all(passes == ["combined"] for session, passes in asked if session == viewport)
    final = next(passes for session, passes in asked if session != viewport)
    assert [entry["kind"] for entry in final[1:]] == ["normal", "cryptomatte_object", "aov_color", "error", "light_path"]


def test_a_viewport_without_a_daemon_says_so_and_blender_lives(run_window, tmp_path):
    run = run_window(
        """
quad()
def view(): return next(area for area in window().screen.areas if area.type == 'VIEW_3D')
def shade(): view().spaces.active.shading.type = 'RENDERED'
steps = [(1.0, shade), (1.5, lambda: screenshot('view')), (0.1, lambda: print('STILL HERE'))]
run(steps)
""",
        daemon="/nowhere/lambentd",
    )
    assert "STILL HERE" in run.output and "Traceback" not in run.output


def test_a_viewports_camera_sees_what_blender_draws(run_window):
    """Projects points by the wire's camera, as PROTOCOL.md and Blender define it, and by Blender's own matrix."""
    run = run_window(
        """
import math, random
from mathutils import Matrix, Vector
from lambent.sync.view_camera import view_camera
scene.camera.location, scene.camera.rotation_euler = (3, -4, 5), (0.7, 0.1, 0.6)
scene.camera.data.shift_x, scene.camera.data.shift_y = 0.1, -0.05
def view(): return next(area for area in window().screen.areas if area.type == 'VIEW_3D')
def set_view(perspective):
    space = view().spaces.active
    space.region_3d.view_perspective = perspective
    space.lens = 35
    if perspective == 'CAMERA': space.region_3d.view_camera_zoom, space.region_3d.view_camera_offset = 10, (0.05, 0.1)
def check(name):
    region = next(r for r in view().regions if r.type == 'WINDOW')
    space = view().spaces.active
    w, h = region.width, region.height
    looking = scene.camera if space.region_3d.view_perspective == 'CAMERA' else None
    value = view_camera(space.region_3d, space, w, h, looking)
    t = value['transform']
    camera_from_world = Matrix((t[0:4], t[4:8], t[8:12], (0, 0, 0, 1))).inverted()
    worst = 0
    for _ in range(50):
        point = Vector([random.uniform(-1, 1) for _ in range(3)])
        p = camera_from_world @ point
        if value['type'] == 'perspective':
            x = value['focal_length_mm'] / value['sensor_width_mm'] * p.x / -p.z - value['shift'][0]
            y = value['focal_length_mm'] / value['sensor_width_mm'] * p.y / -p.z - value['shift'][1]
        else:
            x, y = p.x / value['ortho_scale'] - value['shift'][0], p.y / value['ortho_scale'] - value['shift'][1]
        clip = space.region_3d.perspective_matrix @ point.to_4d()
        worst = max(worst, abs((0.5 + x) * w - (0.5 + clip.x / clip.w / 2) * w), abs((h / w / 2 + y) * w - (0.5 + clip.y / clip.w / 2) * h))
    print('WORST', name, worst, value['clip_m'])
steps = [(1.0, lambda: None)]
for name in ('PERSP', 'ORTHO', 'CAMERA'):
    steps += [(0.3, lambda name=name: set_view(name)), (0.5, lambda name=name: check(name))]
run(steps)
"""
    )
    found = [line.split() for line in run.output.splitlines() if line.startswith("WORST")]
    assert [line[1] for line in found] == ["PERSP", "ORTHO", "CAMERA"]
    for line in found:
        assert float(line[2]) < 0.05, "pixels off in " + line[1]


def test_all_panels_draw_for_every_kind_of_datablock(run_window, tmp_path):
    run = run_window(
        """
from lambent.render import report
material, nodes, links = node_material('m')
links.new(nodes.new('ShaderNodeBsdfPrincipled').outputs[0], nodes.new('ShaderNodeOutputMaterial').inputs['Surface'])
shown = [quad('mesh')]
shown[0].data.materials.append(material)
for kind in ('POINT', 'SPOT', 'SUN', 'AREA'): shown.append(add(kind, bpy.data.lights.new(kind, kind)))
shown.append(scene.camera)
scene.cycles.samples = 77
scene.lambent.integrator, scene.lambent.preview_integrator = 'VPL', 'VCM'
layer = bpy.context.view_layer
for name in layer.bl_rna.properties.keys():
    if name.startswith('use_pass_'): setattr(layer, name, True)
layer.aovs.add(); layer.lightgroups.add(name='keys'); scene.world.lightgroup = 'unknown'
for _ in range(2): bpy.ops.lambent.light_path_add()
report.store(scene.name, [{'severity': 'warning', 'code': 'unsupported', 'object': 'x', 'text': 'x: something'}])
def properties(): return next(area for area in window().screen.areas if area.type == 'PROPERTIES').spaces.active
def show(ob, tab):
    bpy.context.view_layer.objects.active = ob
    properties().context = tab
def big():
    area = next(area for area in window().screen.areas if area.type == 'VIEW_3D')
    area.type = 'PROPERTIES'
    for other in window().screen.areas:
        if other.type == 'PROPERTIES' and other != area: other.type = 'CONSOLE'
    bpy.context.view_layer.objects.active = shown[0]
steps = [(1.0, big)]
for tab in ('RENDER', 'OUTPUT', 'VIEW_LAYER', 'SCENE', 'WORLD', 'OBJECT', 'DATA', 'MATERIAL'):
    steps += [(0.2, lambda tab=tab: show(shown[0], tab)), (0.3, lambda tab=tab: screenshot(f'{tab}'))]
for ob in shown[1:]:
    steps += [(0.2, lambda ob=ob: show(ob, 'DATA')), (0.3, lambda ob=ob: screenshot(f'DATA_{ob.name}'))]
run(steps)
"""
    )
    for marker in ("Traceback", "Error:", "rna_uiItem"):
        assert marker not in run.output, run.output
    pictures = [read_screenshot(tmp_path / name) for name in ("RENDER", "MATERIAL", "WORLD", "DATA_AREA", "DATA_camera")]
    assert all(np.abs(a - b).max() > 0.1 for a, b in zip(pictures, pictures[1:]))


def test_material_previews_are_rendered(run_window, tmp_path):
    run = run_window(
        """
material, nodes, links = node_material('m')
links.new(nodes.new('ShaderNodeBsdfPrincipled').outputs[0], nodes.new('ShaderNodeOutputMaterial').inputs['Surface'])
ob = quad()
ob.data.materials.append(material)
bpy.context.view_layer.objects.active = ob
class TEST_PT_preview(bpy.types.Panel):
    bl_label, bl_space_type, bl_region_type, bl_context = 'Preview of the test', 'PROPERTIES', 'WINDOW', 'material'
    bl_options, bl_order = {'HIDE_HEADER'}, -1
    def draw(self, context): self.layout.template_preview(material)
bpy.utils.register_class(TEST_PT_preview)
def show(): next(a for a in window().screen.areas if a.type == 'PROPERTIES').spaces.active.context = 'MATERIAL'
steps = [(1.0, show), (5.0, lambda: screenshot('preview'))]
run(steps)
"""
    )
    assert "Traceback" not in run.output, run.output
    settings = run.values("settings")["render"]
    assert settings["width"] < 400 and settings["samples"] == 32
    # Blender's preview scene: a ball or the like with the material, lights and a floor.
    assert "m" in run.values("material") and len(run.values("object")) > 2
    assert gradient_pixels(read_screenshot(tmp_path / "preview")) > 2000
