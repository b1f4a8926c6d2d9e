# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What scripts in a real window have to hand: steps that a timer runs, screenshots, keys."""

import os

# Steps run one after another from a timer: each is (seconds to wait before it, function).
STEPS = f"""
import os, sys, time, traceback
sys.path.append({os.path.dirname(os.path.abspath(__file__))!r})
from screenshots import gradient_pixels, orange_pixels, read_screenshot
"""
STEPS += """
FOLDER = os.environ['LAMBENT_TEST_DIR']
def window(): return bpy.context.window_manager.windows[0]
def screenshot(name):
    # What Xvfb shows, from its memory: Blender's own screenshots are black in 5.2 without a graphics card.
    import shutil
    shutil.copyfile(os.path.join(FOLDER, 'Xvfb_screen0'), os.path.join(FOLDER, name))
def screenshot_when(steps, name, condition):
    # A step that takes screenshots until one is as wanted, or the test has to judge the last one: drawing in software takes long
    # on a busy machine, the first time above all.
    begun = []
    def look():
        begun.append(time.monotonic())
        screenshot(name)
        if not condition(read_screenshot(os.path.join(FOLDER, name))) and time.monotonic() < begun[0] + 60: steps.insert(0, (0.25, look))
    return look
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
    try:
        x11, test = ctypes.CDLL('libX11.so.6'), ctypes.CDLL('libXtst.so.6')
    except OSError:
        print('NO XTST', flush=True); os._exit(0)
    x11.XOpenDisplay.restype = ctypes.c_void_p
    display = ctypes.c_void_p(x11.XOpenDisplay(None))
    key = x11.XKeysymToKeycode(display, ctypes.c_ulong(0xFF1B))
    test.XTestFakeMotionEvent(display, -1, 400, 400, ctypes.c_ulong(0))
    for down in (1, 0): test.XTestFakeKeyEvent(display, key, down, ctypes.c_ulong(0))
    x11.XFlush(display)
    x11.XCloseDisplay(display)
bpy.context.preferences.view.render_display_type = 'AREA'
bpy.context.preferences.view.show_splash = False
"""
WINDOW = ("-p", "0", "0", "1200", "760")
