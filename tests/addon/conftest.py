# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures of the add-on's tests."""

import ctypes.util
import functools
import os
import shutil
import sys

import pytest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import blender_command, run_script  # noqa: E402
from window import STEPS, WINDOW  # noqa: E402


@pytest.fixture
def run_blender(tmp_path):
    """harness.run_script with tmp_path as its folder; skips where there is no Blender."""
    if blender_command() is None:
        pytest.skip("no Blender: set BLENDER or put blender on PATH")
    return functools.partial(run_script, folder=tmp_path)


@pytest.fixture
def run_window(run_blender, tmp_path):
    """run_blender with a window of 1200 x 760."""
    if not shutil.which("xvfb-run") or not ctypes.util.find_library("Xtst"):
        pytest.skip("no xvfb-run or no libXtst")
    wrapper = ("xvfb-run", "-a", "-s", f"-screen 0 1280x800x24 -fbdir {tmp_path}")

    def run(script, **options):
        return run_blender(STEPS + script, wrapper=wrapper, arguments=WINDOW, **{"timeout": 120, **options})

    return run
