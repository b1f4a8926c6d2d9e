# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on with the built lambentd: pictures whose numbers are known, bad input, and a daemon that dies or hangs."""

import os
import subprocess

import numpy as np
import OpenImageIO as oiio
import pytest

from harness import ROOT, SAVE

LAMBENTD = os.path.join(os.environ.get("LAMBENT_BUILD_DIR") or os.path.join(ROOT, "build", "release"), "bin", "lambentd")

# Emission materials and quads that face the camera, which looks along -Z from the origin.
SCENE = (
    SAVE
    + """
scene.world.use_nodes = True
scene.world.node_tree.nodes['Background'].inputs['Strength'].default_value = 0
scene.lambent.samples = 16
scene.render.resolution_x, scene.render.resolution_y = 96, 64
def emission(name, color, strength=1.0):
    material, nodes, links = node_material(name)
    node = nodes.new('ShaderNodeEmission')
    node.inputs['Color'].default_value, node.inputs['Strength'].default_value = (*color, 1), strength
    links.new(node.outputs[0], nodes.new('ShaderNodeOutputMaterial').inputs['Surface'])
    return material
def glowing(name, x, y, z, half, color, strength=1.0):
    ob = add_mesh(name, [(x-half, y-half, z), (x+half, y-half, z), (x+half, y+half, z), (x-half, y+half, z)], [(0, 1, 2, 3)])
    ob.data.materials.append(emission(name, color, strength))
    return ob
"""
)


def read_picture(path):
    """float32[height][width][4] of a picture file, row 0 at the bottom."""
    return oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)[::-1]


@pytest.fixture
def run_real(run_blender):
    """run_blender with the built lambentd."""
    if not os.access(LAMBENTD, os.X_OK):
        pytest.skip(f"no lambentd at {LAMBENTD}: build it or set LAMBENT_BUILD_DIR")
    return lambda script, **options: run_blender(SCENE + script, daemon=LAMBENTD, **options)


def test_an_emitting_wall_fills_the_picture_with_its_radiance(run_real, tmp_path):
    run = run_real("glowing('wall', 0, 0, -2, 50, (0.25, 0.5, 1.0), 3.0)\nprint(render())\nsave('wall')\n")
    assert "{'FINISHED'}" in run.output, run.output
    assert np.allclose(np.load(tmp_path / "wall.npy"), [0.75, 1.5, 3.0, 1.0], rtol=1e-5)


def test_every_integrator_renders_a_wall_lit_by_a_panel_alike(run_real, tmp_path):
    run = run_real(
        """
wall, nodes, links = node_material('wall')
links.new(nodes.new('ShaderNodeBsdfDiffuse').outputs[0], nodes.new('ShaderNodeOutputMaterial').inputs['Surface'])
ob = add_mesh('wall', [(-9, -9, -4), (9, -9, -4), (9, 9, -4), (-9, 9, -4)], [(0, 1, 2, 3)])
ob.data.materials.append(wall)
lamp = bpy.data.lights.new('panel', 'AREA')
lamp.size, lamp.energy = 4.0, 300.0
add('panel', lamp).location = (0, 0, 2)
scene.lambent.samples = 64
for name in ('PT', 'LT', 'VPL', 'BPT', 'PPM', 'BPM', 'VCM'):
    scene.lambent.integrator = name
    print(name, render())
    save(name)
"""
    )
    assert run.output.count("{'FINISHED'}") == 7, run.output
    pictures = {name: np.load(tmp_path / f"{name}.npy")[..., :3] for name in ("PT", "LT", "VPL", "BPT", "PPM", "BPM", "VCM")}
    brightness = pictures["PT"].mean()
    assert brightness > 0.1
    # The light falls off smoothly, so what differs from a neighbourhood's mean bounds the noise of a pixel from above.
    deviation = {name: (picture - pictures["PT"]).std() for name, picture in pictures.items()}
    for name, picture in pictures.items():
        error = deviation[name] / np.sqrt(picture[..., 0].size)
        assert abs(picture.mean() - brightness) <= 5 * error + 1e-6, name


@pytest.mark.parametrize(
    "camera",
    [
        "pass",
        "data.lens, data.shift_x, data.shift_y = 35, 0.1, -0.15",
        "data.sensor_fit, data.sensor_height, data.sensor_width = 'VERTICAL', 30, 20",
        "data.sensor_fit = 'HORIZONTAL'; scene.render.resolution_x, scene.render.resolution_y = 64, 96",
        "scene.render.resolution_x, scene.render.resolution_y = 64, 96",
        "scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = 1, 2",
        "scene.render.pixel_aspect_x = 2; data.shift_x, data.shift_y = 0.1, 0.1",
        "data.type, data.ortho_scale, data.shift_x = 'ORTHO', 5.0, 0.1",
        "scene.camera.rotation_euler, scene.camera.location, scene.camera.scale = (0.1, 0.2, 0.3), (0.2, 0.1, 0.3), (3, 2, 1)",
        "data.sensor_fit, data.shift_y = 'VERTICAL', 0.1; scene.render.resolution_x, scene.render.resolution_y = 120, 40",
    ],
)
def test_things_appear_where_blender_says_they_are(run_real, tmp_path, camera):
    run = run_real(
        f"""
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector
data = scene.camera.data
{camera}
places = {{'red': (-0.6, -0.3, -4), 'green': (0.7, 0.35, -4.5), 'blue': (0.1, 0.5, -5)}}
for index, (name, place) in enumerate(places.items()):
    glowing(name, *place, 0.12, [float(index == k) for k in range(3)])
print(render())
save('dots')
expected = [world_to_camera_view(scene, scene.camera, Vector(place)) for place in places.values()]
np.save(os.path.join(os.environ['LAMBENT_TEST_DIR'], 'expected.npy'), np.array([e[:2] for e in expected]))
"""
    )
    assert "{'FINISHED'}" in run.output, run.output
    pixels, expected = np.load(tmp_path / "dots.npy"), np.load(tmp_path / "expected.npy")
    height, width = pixels.shape[:2]
    for channel, (x, y) in enumerate(expected):
        light = pixels[..., channel].astype(np.float64)
        if not (0.1 < x < 0.9 and 0.1 < y < 0.9):
            continue
        found_x = (light.sum(axis=0) * (np.arange(width) + 0.5)).sum() / light.sum()
        found_y = (light.sum(axis=1) * (np.arange(height) + 0.5)).sum() / light.sum()
        # The dot's centre of gravity, a fifth of a pixel for perspective and noise.
        assert abs(found_x - x * width) < 0.2 and abs(found_y - y * height) < 0.2
    assert ((expected > 0.1) & (expected < 0.9)).all(axis=1).sum() >= 2


def test_a_point_light_gives_cycles_irradiance(run_real, tmp_path):
    run = run_real(
        """
scene.camera.location.z = 1
wall = add_mesh('wall', [(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)], [(0, 1, 2, 3)])
material, nodes, links = node_material('white')
diffuse = nodes.new('ShaderNodeBsdfDiffuse'); diffuse.inputs['Color'].default_value = (1, 1, 1, 1)
links.new(diffuse.outputs[0], nodes.new('ShaderNodeOutputMaterial').inputs['Surface'])
wall.data.materials.append(material)
lamp = bpy.data.lights.new('lamp', 'POINT'); lamp.energy, lamp.shadow_soft_size = 100, 0
ob = add('lamp', lamp); ob.location.z = 1
scene.lambent.max_bounces = 0
scene.camera.data.lens = 400
render(); save('wall')
"""
    )
    assert run.code == 0
    pixels = np.load(tmp_path / "wall.npy")
    middle = pixels[30:34, 46:50, :3].mean()
    # blender_facts.md: irradiance 1.98942 at 2 m (100 W / 4 pi / 4), and radiance of a white wall is that over pi.
    assert middle == pytest.approx(100 / (4 * np.pi) / 4 / np.pi, rel=0.01)


def test_film_transparency_leaves_alpha_at_zero(run_real, tmp_path):
    run = run_real(
        """
scene.render.film_transparent = True
glowing('half', -10, 0, -4, 10, (1, 1, 1))
render(); save('half')
"""
    )
    assert run.code == 0
    pixels = np.load(tmp_path / "half.npy")
    assert (pixels[:, :44, 3] == 1).all() and not pixels[:, 52:].any()


def test_region_crop_and_percentage_give_the_same_pixels_as_the_whole(run_real, tmp_path):
    run = run_real(
        """
scene.lambent.samples = 4
for i in range(20): glowing(f'g{i}', (i % 5) - 2, i // 5 - 1.5, -6 - i % 3, 0.4, (i / 20, 1 - i / 20, 0.5))
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 192, 128, 50
render(); save('whole')
scene.render.use_border, scene.render.use_crop_to_border = True, True
scene.render.border_min_x, scene.render.border_max_x, scene.render.border_min_y, scene.render.border_max_y = 0.25, 0.75, 0.5, 1.0
render(); save('part')
"""
    )
    assert run.code == 0
    whole, part = np.load(tmp_path / "whole.npy"), np.load(tmp_path / "part.npy")
    assert part.shape == (32, 48, 4)
    assert np.allclose(part, whole[32:64, 24:72], atol=1e-6)


def test_bad_input_is_named_and_the_rest_is_rendered(run_real, tmp_path):
    run = run_real(
        """
glowing('good', 0, 0, -4, 10, (1, 1, 1))
add_mesh('nan', [(float('nan'),0,-3),(1,0,-3),(0,1,-3)], [(0,1,2)])
add_mesh('no_faces', [(0,0,0),(1,1,1)], [])
add_mesh('no_area', [(0,0,-3),(0,0,-3),(0,0,-3)], [(0,1,2)])
singular = quad('singular'); singular.scale = (0, 0, 0); singular.location.z = -3
for name, energy in (('zero', 0), ('negative', -5), ('huge', 1e30)):
    lamp = bpy.data.lights.new(name, 'POINT'); lamp.energy = energy
    add(name, lamp).location = (0, 0, -50)
material, nodes, links = node_material('textured')
path = os.path.join(os.environ['LAMBENT_TEST_DIR'], 'picture.png')
blank = bpy.data.images.new('blank', 4, 4); blank.filepath_raw = path; blank.file_format = 'PNG'; blank.save()
image = bpy.data.images.load(path); image.name = 'gone'; os.remove(path)
node, glow = nodes.new('ShaderNodeTexImage'), nodes.new('ShaderNodeEmission'); node.image = image
links.new(node.outputs[0], glow.inputs[0]); links.new(glow.outputs[0], nodes.new('ShaderNodeOutputMaterial').inputs['Surface'])
textured = quad('textured'); textured.location = (20, 20, -60); textured.data.materials.append(material)
print('RESULT', render()); save('picture')
from lambent.render import report
for message in report.listed(scene.name): print('LISTED', message['text'])
"""
    )
    assert "RESULT {'FINISHED'}" in run.output, run.output
    pixels = np.load(tmp_path / "picture.npy")
    assert np.allclose(pixels[20:44, 30:66, :3], 1.0, atol=1e-4)
    listed = [line for line in run.output.splitlines() if line.startswith("LISTED")]
    for name in ("nan", "picture.png"):
        assert any(name in line for line in listed), listed


def test_an_empty_scene_renders_its_world(run_real, tmp_path):
    run = run_real(
        """
background = scene.world.node_tree.nodes['Background']
background.inputs['Color'].default_value, background.inputs['Strength'].default_value = (0.5, 0.25, 1, 1), 2
print(render()); save('world')
"""
    )
    assert "{'FINISHED'}" in run.output, run.output
    assert np.allclose(np.load(tmp_path / "world.npy"), [1, 0.5, 2, 1], rtol=1e-5)


BUSY = """
glowing('wall', 0, 0, -4, 1, (1, 1, 1))
scene.render.resolution_x, scene.render.resolution_y = 1920, 1080
scene.lambent.samples = 100000
"""


@pytest.mark.parametrize("number, text", [(9, "SIGKILL"), (19, "hangs")])
def test_a_daemon_killed_or_stopped_in_a_render_is_an_error_and_the_next_works(run_real, tmp_path, number, text):
    run = run_real(
        BUSY
        + f"""
import threading, time
from lambent.render import session
def strike():
    while session._owned_daemon is None: time.sleep(0.05)
    time.sleep(1.5)
    state['at'] = time.monotonic()
    os.kill(session._owned_daemon.pid, {number})
state = {{}}
threading.Thread(target=strike, daemon=True).start()
try:
    render(write_still=True)
except RuntimeError as error:
    print('NOTICED', round(time.monotonic() - state['at'], 1), error)
scene.lambent.samples = 4
scene.render.resolution_x, scene.render.resolution_y = 96, 64
print('SECOND', render())
"""
    )
    assert "SECOND {'FINISHED'}" in run.output, run.output
    noticed = run.output.split("NOTICED ")[1]
    assert text in noticed.splitlines()[0] and float(noticed.split()[0]) < 10


def test_ctrl_c_stops_a_long_render_at_once_and_keeps_what_is_done(run_real, tmp_path):
    run = run_real(
        BUSY
        + """
import threading, signal, time
state = {}
def strike():
    time.sleep(3)
    state['at'] = time.monotonic()
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=strike, daemon=True).start()
render()
print('STOPPED', time.monotonic() - state['at'])
save('kept')
"""
    )
    # A second where nothing else runs; the render would take minutes.
    assert float(run.output.split("STOPPED ")[1].split()[0]) < 10.0
    pixels = np.load(tmp_path / "kept.npy")
    assert (pixels[500:580, 900:1000, :3] > 0.99).all()


def test_an_animation_follows_its_frames(run_real, tmp_path):
    run = run_real(
        """
dot = glowing('dot', 0, 0, -4, 0.2, (1, 1, 1))
for frame, x in ((1, -1), (3, 1)):
    dot.location.x = x; dot.keyframe_insert('location', frame=frame)
for curve in getattr(dot.animation_data.action, 'fcurves', ()):
    for key in curve.keyframe_points: key.interpolation = 'LINEAR'
for frame in (1, 2, 3):
    scene.frame_set(frame); render(); save(f'frame{frame}')
"""
    )
    assert run.code == 0
    places = []
    for frame in (1, 2, 3):
        light = np.load(tmp_path / f"frame{frame}.npy")[..., 0].sum(axis=0)
        places.append((light * (np.arange(96) + 0.5)).sum() / light.sum())
    # 50 mm on 36 mm of sensor: 96 px are 2.88 m at a distance of 4 m.
    assert np.allclose(places, [48 - 96 / 2.88, 48, 48 + 96 / 2.88], atol=0.3)


def test_a_scene_exported_from_the_menu_renders_to_the_same_picture_without_blender(run_real, tmp_path):
    lambent = os.path.join(os.path.dirname(LAMBENTD), "lambent")
    if not os.access(lambent, os.X_OK):
        pytest.skip(f"no lambent at {lambent}")
    run = run_real(
        """
glowing('left', -1, 0, -4, 0.5, (1, 0.5, 0.25))
scene.render.engine = 'CYCLES'
path = os.path.join(os.environ['LAMBENT_TEST_DIR'], 'saved.lambent')
print('EXPORTED', bpy.ops.lambent.scene_export(filepath=path), scene.render.engine)
try:
    bpy.ops.lambent.scene_export(filepath='/no/such/folder/a.lambent')
except RuntimeError as error:
    print('REFUSED', error)
scene.render.engine = 'LAMBENT'
render(); save('rendered')
"""
    )
    assert "EXPORTED {'FINISHED'} CYCLES" in run.output, run.output
    assert "/no/such/folder/a.lambent" in run.output.split("REFUSED ")[1], run.output
    picture = tmp_path / "saved.exr"
    subprocess.run([lambent, "render", tmp_path / "saved.lambent", "-o", picture, "--quiet"], check=True, timeout=60)
    assert np.array_equal(read_picture(picture), np.load(tmp_path / "rendered.npy"))
