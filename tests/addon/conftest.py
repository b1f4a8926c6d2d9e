# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures of the add-on's tests."""

import functools
import os
import sys

import pytest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import blender_command, run_script  # noqa: E402


@pytest.fixture
def run_blender(tmp_path):
    """harness.run_script with tmp_path as its folder; skips where there is no Blender."""
    if blender_command() is None:
        pytest.skip("no Blender: set BLENDER or put blender on PATH")
    return functools.partial(run_script, folder=tmp_path)
