# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering in the background: pixels, regions, animations, cancelling, and daemons that fail."""

import os
import signal
import subprocess
import time

import numpy as np
import pytest

from harness import FAKE_DAEMON, PRELUDE, SAVE, blender_command

def gradient(width, height):
    pixels = np.empty((height, width, 4), np.float32)
    pixels[..., 0] = (np.arange(width) + 0.5) / width
    pixels[..., 1] = ((np.arange(height) + 0.5) / height)[:, None]
    pixels[..., 2], pixels[..., 3] = 0.5, 1
    return pixels


def test_tiles_land_where_they_belong(run_blender, tmp_path):
    run = run_blender(SAVE + "quad()\nscene.render.resolution_percentage = 50\nrender()\nsave('full')\n")
    settings = run.values("settings")["render"]
    assert (settings["width"], settings["height"]) == (80, 48) and "region" not in settings
    assert np.allclose(np.load(tmp_path / "full.npy"), gradient(80, 48), atol=1e-6)


@pytest.mark.parametrize("crop", [False, True])
def test_a_region_is_rendered_alone_and_in_place(run_blender, tmp_path, crop):
    run = run_blender(
        SAVE
        + f"""
scene.render.resolution_x, scene.render.resolution_y = 321, 201
scene.render.use_border, scene.render.use_crop_to_border = True, {crop}
scene.render.border_min_x, scene.render.border_max_x = 0.3, 0.7
scene.render.border_min_y, scene.render.border_max_y = 0.1, 0.47
render()
save('region')
"""
    )
    x0, y0, x1, y1 = run.values("settings")["render"]["region"]
    assert (x0, y0) == (96, 20)
    pixels, expected = np.load(tmp_path / "region.npy"), gradient(321, 201)
    if crop:
        assert pixels.shape == (y1 - y0, x1 - x0, 4)
        assert np.allclose(pixels, expected[y0:y1, x0:x1], atol=1e-6)
    else:
        assert np.allclose(pixels[y0:y1, x0:x1], expected[y0:y1, x0:x1], atol=1e-6)
        assert not pixels[: y0 - 1].any() and not pixels[:, : x0 - 1].any()


def test_only_what_changes_travels_between_frames(run_blender):
    run = run_blender(
        """
import os
quad('still')
moving = quad('moving')
for frame in (1, 3):
    moving.location.x = frame
    moving.keyframe_insert('location', frame=frame)
scene.frame_start, scene.frame_end = 1, 3
scene.render.filepath = os.path.join(os.environ['LAMBENT_TEST_DIR'], 'f')
render(animation=True)
"""
    )
    assert run.code == 0 and len(run.of_type("render_start")) == 3
    assert len({message["session"] for message in run.messages}) == 1
    for edits in run.transactions[1:]:
        assert [(edit["op"], edit["kind"], edit["id"]) for edit in edits] == [
            ("upsert", "object", "moving"),
            ("upsert", "settings", "render"),
        ]
    assert len(run.of_type("arrays")) == 1
    moved = [next(edit["value"] for edit in edits if edit["id"] == "moving")["transform"][3] for edits in run.transactions]
    assert moved == [1, 2, 3]


def test_with_persistent_data_only_changed_meshes_are_looked_at(run_blender):
    run = run_blender(
        """
import os
from lambent.sync import mesh
original, exported = mesh.export_mesh, []
def counted(edits, identifier, *others):
    exported.append(identifier)
    original(edits, identifier, *others)
mesh.export_mesh = counted
quad('still'); moving = quad('moving'); morphing = quad('morphing'); bending = quad('bending')
moving.location.x = 1; moving.keyframe_insert('location', frame=1)
moving.location.x = 3; moving.keyframe_insert('location', frame=3)
morphing.shape_key_add(name='Basis')
key = morphing.shape_key_add(name='wide'); key.data[0].co.x = -5
for frame in (1, 3): key.value = (frame - 1) / 2; key.keyframe_insert('value', frame=frame)
cast = bending.modifiers.new('cast', 'CAST'); cast.object = moving
scene.render.use_persistent_data = True
scene.frame_start, scene.frame_end = 1, 3
scene.render.filepath = os.path.join(os.environ['LAMBENT_TEST_DIR'], 'f')
render(animation=True)
print('EXPORTED', *sorted(exported))
"""
    )
    assert run.code == 0 and len(run.of_type("render_start")) == 3
    counts = run.output.split("EXPORTED ")[1].splitlines()[0].split()
    assert counts.count("mesh:still") == 1 and counts.count("mesh:moving") == 1
    assert counts.count("object:morphing") == 3 and counts.count("object:bending") == 3
    first_corner = [
        run.array(edit["value"]["positions"])[0, 0]
        for edits in run.transactions
        for edit in edits
        if edit["id"] == "object:morphing" and edit["op"] == "upsert"
    ]
    assert first_corner == [0, -2.5, -5]


def test_a_second_render_of_the_same_scene_sends_nothing_but_the_start(run_blender):
    run = run_blender("quad()\nrender()\nrender()\n")
    assert len(run.transactions) == 1 and len(run.of_type("render_start")) == 2
    epochs = [message["header"]["epoch"] for message in run.of_type("render_start")]
    assert epochs[0] < epochs[1]


def test_removed_objects_and_meshes_are_removed(run_blender):
    run = run_blender("quad('a'); b = quad('b')\nrender()\nbpy.data.objects.remove(b)\nrender()\n")
    assert [(edit["op"], edit["kind"], edit["id"]) for edit in run.transactions[1]] == [
        ("remove", "object", "b"),
        ("remove", "mesh", "mesh:b"),
    ]


def test_settings_follow_cycles_until_they_are_set(run_blender):
    run = run_blender(
        """
render()
cycles = scene.cycles
cycles.samples, cycles.seed, cycles.max_bounces, cycles.transparent_max_bounces = 77, 5, 3, 2
cycles.pixel_filter_type, cycles.film_exposure, cycles.time_limit = 'BOX', 2.0, 9
cycles.sample_clamp_indirect = 10
cycles.film_transparent_glass, cycles.film_transparent_roughness = True, 0.25
scene.render.film_transparent = True
render()
scene.lambent.samples, scene.lambent.pixel_filter, scene.lambent.filter_width = 5, 'GAUSSIAN', 2
render()
"""
    )
    default, followed, own = (run.values("settings", count)["render"] for count in (1, 2, 3))
    assert (default["samples"], default["pixel_filter"], default["filter_width_px"]) == (128, "BLACKMAN_HARRIS", 1.5)
    assert (followed["samples"], followed["seed"], followed["max_bounces"], followed["transparent_bounces"]) == (77, 5, 3, 2)
    assert (followed["pixel_filter"], followed["filter_width_px"], followed["exposure"]) == ("BOX", 1, 2)
    assert "film_transparent_glass" not in default and followed["film_transparent_glass"]
    assert followed["film_transparent_roughness"] == 0.25
    assert followed["time_limit_s"] == 9 and followed["clamp_indirect"] == 0
    assert (own["samples"], own["pixel_filter"], own["filter_width_px"], own["max_bounces"]) == (5, "GAUSSIAN", 2, 3)


def test_integrators_and_their_settings_travel_and_the_daemons_are_offered(run_blender):
    run = run_blender(
        """
from lambent.ui import integrator_menus
print('before', [name for name, _ in integrator_menus.offered()])
render()
print('after', [name for name, _ in integrator_menus.offered()])
chosen = scene.lambent
chosen.integrator, chosen.merge_radius, chosen.merge_alpha = 'VCM', 3.5, 1.0
chosen.shared_light_paths, chosen.clamp_connection = 64, 2.5
render()
chosen.preview_integrator = 'PPM'
print('numbers', [item.value for item in chosen.bl_rna.properties['integrator'].enum_items])
"""
    )
    default, own = (run.values("settings", count)["render"] for count in (1, 2))
    assert (default["integrator"], default["merge_radius_px"], default["merge_alpha"]) == ("PT", 2, 0.75)
    assert (default["shared_light_paths"], default["clamp_connection"]) == (16, 0)
    assert (own["integrator"], own["merge_radius_px"], own["merge_alpha"]) == ("VCM", 3.5, 1)
    assert (own["shared_light_paths"], own["clamp_connection"]) == (64, 2.5)
    assert "before ['PT', 'LT', 'VPL', 'BPT', 'PPM', 'BPM', 'VCM']" in run.output
    assert "after ['PT', 'VCM']" in run.output
    assert "numbers [0, 1, 2, 3, 4, 5, 6]" in run.output  # files keep these


def test_the_status_line_serves_the_farms(run_blender):
    import re

    run = run_blender("quad()\nrender()\n")
    if run.blender_major >= 5:
        pytest.skip("Blender 5 prints no statistics in the background")
    lines = [line for line in run.output.splitlines() if "Rendered" in line]
    assert lines
    for line in lines:
        assert re.match(r"^Fra:.*Sample\s(\d+)\/(\d+)$", line)
        assert re.search(r"Rendered \d+/\d+ Tiles", line) and re.search(r"Remaining:\d\d:\d\d\.\d\d", line)
        assert re.search(r"Peak:\d+", line) and "Time:" in line and "| Scene, ViewLayer |" in line


def test_no_camera_is_an_error_that_says_so(tmp_path):
    path = tmp_path / "never.png"
    failed = render_from_command_line(tmp_path, "scene.camera = None\n", path)
    assert failed.returncode == 1 and not path.exists()
    assert "camera" in failed.stdout


def render_from_command_line(tmp_path, script, path, mode="normal", environment=None, timeout=60):
    """blender -b --python SCRIPT -o PATH -f 1, as farms run it."""
    command = blender_command()
    if command is None:
        pytest.skip("no Blender: set BLENDER or put blender on PATH")
    script_path = tmp_path / "setup.py"
    script_path.write_text(PRELUDE + script + "scene.render.use_file_extension = False\n")
    variables = {**os.environ, "LAMBENT_DAEMON": FAKE_DAEMON, "LAMBENT_FAKE_MODE": mode, **(environment or {})}
    started = time.monotonic()
    process = subprocess.run(
        [*command, "-b", "--factory-startup", "--python", str(script_path), "-o", str(path), "-f", "1"],
        env=variables,
        timeout=timeout,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    process.seconds = time.monotonic() - started
    return process


@pytest.mark.parametrize(
    "mode, text",
    [
        ("crash", "SIGSEGV"),
        ("hang", "hangs"),
        ("garbage", "not the protocol"),
        ("bad_tile", "not the protocol"),
        ("fail", "out of memory on purpose"),
        ("reject", "Cube: rejected on purpose"),
        ("mute", "does not answer"),
        ("old", "protocol 99"),
        ("no_start", "no_start was asked for"),
    ],
)
def test_a_failing_daemon_gives_exit_code_1_and_no_file_within_seconds(tmp_path, mode, text):
    path = tmp_path / "never.png"
    process = render_from_command_line(tmp_path, "quad()\n", path, mode)
    assert process.returncode == 1, process.stdout
    assert not list(tmp_path.glob("never*"))
    assert text in process.stdout
    assert process.seconds < 20


def test_a_daemon_that_is_not_there_is_an_error(tmp_path):
    path = tmp_path / "never.png"
    process = render_from_command_line(tmp_path, "quad()\n", path, environment={"LAMBENT_DAEMON": "/nowhere/lambentd"})
    assert process.returncode == 1 and "/nowhere/lambentd" in process.stdout and not path.exists()


@pytest.mark.parametrize("mode", ["crash", "hang", "garbage", "fail", "reject"])
def test_the_render_after_a_failure_works(run_blender, tmp_path, mode):
    mode_file = tmp_path / "mode"
    run = run_blender(
        SAVE
        + f"""
quad()
open({str(mode_file)!r}, 'w').write({mode!r})
try:
    render()
    print('NO ERROR')
except RuntimeError as error:
    print('FAILED AS IT SHOULD')
open({str(mode_file)!r}, 'w').write('normal')
print('SECOND', render())
save('second')
""",
        environment={"LAMBENT_FAKE_MODE_FILE": str(mode_file)},
    )
    assert "FAILED AS IT SHOULD" in run.output and "SECOND {'FINISHED'}" in run.output, run.output
    assert np.allclose(np.load(tmp_path / "second.npy"), gradient(160, 96), atol=1e-6)


def test_sigint_cancels_within_seconds_and_the_daemon_is_told(run_blender):
    run = run_blender(
        """
import pathlib, threading, os, signal, time
quad()
scene.render.resolution_x = 1600
interrupted = []
def interrupt():
    # Once the render has begun: before, Blender takes the signal for itself and forgets it.
    record = pathlib.Path(os.environ["LAMBENT_FAKE_RECORD"])
    while not any(b"render_start" in path.read_bytes() for path in record.iterdir()):
        time.sleep(0.05)
    time.sleep(1.0)
    interrupted.append(time.monotonic())
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=interrupt, daemon=True).start()
print('RESULT', render())
print('SECONDS', time.monotonic() - interrupted[0])
""",
        mode="endless",
        timeout=120,
    )
    seconds = float(run.output.split("SECONDS ")[1].split()[0])
    assert seconds < 2.0
    assert len(run.of_type("render_cancel")) == 1


def test_a_configured_daemon_is_used_over_tcp_with_its_token(run_blender, tmp_path):
    import socket

    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    token = tmp_path / "token"
    token.write_text("ab" * 32)
    record = tmp_path / "record"
    record.mkdir()
    command = [FAKE_DAEMON, "--socket", str(tmp_path / "socket"), "--token-file", str(token)]
    server = subprocess.Popen(
        [*command, "--listen", f"127.0.0.1:{port}"], stdout=subprocess.PIPE, env=dict(os.environ, LAMBENT_FAKE_RECORD=str(record))
    )
    try:
        assert b"listening" in server.stdout.readline()
        where = {"LAMBENT_ADDRESS": f"127.0.0.1:{port}", "LAMBENT_TOKEN_FILE": str(token)}
        run = run_blender("quad()\nprint(render())\n", environment=where, daemon="/nowhere")
        assert "{'FINISHED'}" in run.output
        assert run.values("object").keys() == {"quad"} and not run.of_type("arrays")[0]["header"].get("in_fd")
        token.write_text("cd" * 32)
        wrong = run_blender("try: render()\nexcept RuntimeError as error: print(error)\n", environment=where, daemon="/nowhere")
        assert "the proof is wrong" in wrong.output
    finally:
        server.send_signal(signal.SIGTERM)
        server.wait(5)


def test_the_daemon_starts_when_a_file_that_renders_with_lambent_is_opened(run_blender, tmp_path):
    run = run_blender(
        f"""
from lambent.render import session
bpy.ops.wm.save_as_mainfile(filepath={str(tmp_path / "ours.blend")!r})
scene.render.engine = 'BLENDER_WORKBENCH'
bpy.ops.wm.save_as_mainfile(filepath={str(tmp_path / "other.blend")!r})
session.close_all()
bpy.ops.wm.open_mainfile(filepath={str(tmp_path / "other.blend")!r})
print('AFTER OTHER', session._owned_daemon)
bpy.ops.wm.open_mainfile(filepath={str(tmp_path / "ours.blend")!r})
print('RUNNING', session._owned_daemon.running)
first = session._owned_daemon
print(bpy.ops.render.render())
print('THE SAME', session._owned_daemon is first)
"""
    )
    assert "AFTER OTHER None" in run.output and "RUNNING True" in run.output and "THE SAME True" in run.output, run.output
    assert "{'FINISHED'}" in run.output


def test_the_daemon_starts_before_blender_evaluates_what_a_script_renders(run_blender):
    run = run_blender(
        """
from lambent.render import session
session.close_all()
bpy.app.handlers.render_pre.append(lambda *_: print('RUNNING', session._owned_daemon is not None and session._owned_daemon.running))
print(bpy.ops.render.render())
"""
    )
    assert "RUNNING True" in run.output and "{'FINISHED'}" in run.output, run.output


def test_opening_a_file_says_nothing_of_a_daemon_that_is_not_there(run_blender, tmp_path):
    run = run_blender(
        f"""
bpy.ops.wm.save_as_mainfile(filepath={str(tmp_path / "ours.blend")!r})
bpy.ops.wm.open_mainfile(filepath={str(tmp_path / "ours.blend")!r})
print('OPENED')
""",
        daemon="/nowhere",
    )
    assert "OPENED" in run.output and "nowhere" not in run.output


def test_the_owned_daemon_is_gone_after_blender(run_blender):
    run = run_blender("quad()\nrender()\nfrom lambent.render import session\nprint('PID', session._owned_daemon.pid)\n")
    pid = int(run.output.split("PID ")[1].split()[0])
    deadline = time.monotonic() + 3
    while os.path.exists(f"/proc/{pid}") and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not os.path.exists(f"/proc/{pid}")


def test_stereo_views_are_rendered_from_their_own_cameras(run_blender):
    run = run_blender(
        """
quad()
scene.render.use_multiview = True
scene.camera.data.stereo.interocular_distance = 2.0
scene.camera.data.stereo.convergence_mode = 'PARALLEL'
scene.camera.data.stereo.pivot = 'CENTER'
print(render())
"""
    )
    assert "{'FINISHED'}" in run.output and len(run.of_type("render_start")) == 2
    left, right = (run.values("camera", count)["camera"]["transform"][3] for count in (1, 2))
    assert left == pytest.approx(-1) and right == pytest.approx(1)
