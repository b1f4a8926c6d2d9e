# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lambent in a real window under Xvfb: F12 with buckets and Esc, panels, and the rendered viewport."""

import ctypes.util
import shutil

import numpy as np
import pytest

# Steps run one after another from a timer: each is (seconds to wait before it, function).
STEPS = """
import os, traceback
FOLDER = os.environ['LAMBENT_TEST_DIR']
def window(): return bpy.context.window_manager.windows[0]
def screenshot(name):
    with bpy.context.temp_override(window=window()):
        bpy.ops.screen.screenshot(filepath=os.path.join(FOLDER, name))
def run(steps):
    def step():
        if not steps:
            bpy.ops.wm.quit_blender()
            return None
        _, function = steps.pop(0)
        try:
            function()
        except Exception:
            traceback.print_exc()
            os._exit(9)
        return steps[0][0] if steps else 0.1
    bpy.app.timers.register(step, first_interval=steps[0][0], persistent=True)
def render_in_window():
    with bpy.context.temp_override(window=window()):
        bpy.ops.render.render('INVOKE_DEFAULT')
def escape():
    # A key of the X server itself: Blender stops renders on it before its event system, which event_simulate would enter.
    import ctypes
    x11, test = ctypes.CDLL('libX11.so.6'), ctypes.CDLL('libXtst.so.6')
    x11.XOpenDisplay.restype = ctypes.c_void_p
    display = ctypes.c_void_p(x11.XOpenDisplay(None))
    key = x11.XKeysymToKeycode(display, ctypes.c_ulong(0xFF1B))
    test.XTestFakeMotionEvent(display, -1, 400, 400, ctypes.c_ulong(0))
    for down in (1, 0): test.XTestFakeKeyEvent(display, key, down, ctypes.c_ulong(0))
    x11.XFlush(display)
    x11.XCloseDisplay(display)
def load_picture(name):
    image = bpy.data.images.load(os.path.join(FOLDER, name))
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    np.save(os.path.join(FOLDER, name + '.npy'), pixels.reshape(image.size[1], image.size[0], 4))
import numpy as np
bpy.context.preferences.view.render_display_type = 'AREA'
bpy.context.preferences.view.show_splash = False
"""
WINDOW = ("-p", "0", "0", "1200", "760")


@pytest.fixture
def run_window(run_blender):
    """run_blender with a window of 1200 x 760."""
    if not shutil.which("xvfb-run") or not ctypes.util.find_library("Xtst"):
        pytest.skip("no xvfb-run or no libXtst")
    wrapper = ("xvfb-run", "-a", "-s", "-screen 0 1280x800x24")

    def run(script, **options):
        return run_blender(STEPS + script, wrapper=wrapper, arguments=WINDOW, timeout=120, **options)

    return run


def orange_pixels(pixels):
    """How many pixels of a screenshot are Blender's colour of tiles being worked on."""
    red, green, blue = pixels[..., 0], pixels[..., 1], pixels[..., 2]
    return int(((red > 0.8) & (green > 0.3) & (green < 0.75) & (blue < 0.45)).sum())


def gradient_pixels(pixels):
    """How many pixels of a screenshot look like the fake daemon's picture (its blue is 0.5 everywhere)."""
    blue = pixels[..., 2]
    colourful = np.abs(pixels[..., 0] - pixels[..., 1]) > 0.15
    return int(((np.abs(blue - 0.5) < 0.02) & colourful).sum())


def test_f12_shows_buckets_and_esc_stops_at_once_and_keeps_them(run_window, tmp_path):
    run = run_window(
        """
import time
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
steps = [(1.0, render_in_window), (2.0, lambda: screenshot('during.png')), (0.1, press), (0.05, cancelled),
         (1.0, lambda: screenshot('after.png')), (0.1, lambda: [load_picture(n) for n in ('during.png', 'after.png')])]
run(steps)
""",
        mode="endless",
    )
    assert "STOPPED AFTER" in run.output, run.output
    assert len(run.of_type("render_cancel")) == 1
    during, after = np.load(tmp_path / "during.png.npy"), np.load(tmp_path / "after.png.npy")
    # 0.05 s for a tile of 4096 px: some are there, and they stay after Esc.
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
steps = [(1.0, lambda: shade('RENDERED')), (2.0, lambda: screenshot('view.png')), (0.5, move), (1.0, turn),
         (1.0, change), (1.0, lambda: shade('SOLID')), (0.5, lambda: load_picture('view.png'))]
run(steps)
"""
    )
    assert gradient_pixels(np.load(tmp_path / "view.png.npy")) > 50_000
    sent = [{(edit["op"], edit["kind"], edit["id"]) for edit in edits} for edits in run.transactions]
    assert ("upsert", "mesh", "mesh:still") in sent[0] and ("upsert", "object", "moving") in sent[0]
    assert {("upsert", "object", "moving")} in sent[1:]
    assert {("upsert", "camera", "lambent:view")} in sent[1:]
    assert {("upsert", "mesh", "mesh:moving")} in sent[1:]
    # The other mesh never travels again.
    assert not any(("upsert", "mesh", "mesh:still") in edits for edits in sent[1:])
    assert "Traceback" not in run.output


def test_a_viewport_without_a_daemon_says_so_and_blender_lives(run_window, tmp_path):
    run = run_window(
        """
quad()
def view(): return next(area for area in window().screen.areas if area.type == 'VIEW_3D')
def shade(): view().spaces.active.shading.type = 'RENDERED'
steps = [(1.0, shade), (1.5, lambda: screenshot('view.png')), (0.1, lambda: print('STILL HERE'))]
run(steps)
""",
        daemon="/nowhere/lambentd",
    )
    assert "STILL HERE" in run.output and "Traceback" not in run.output
