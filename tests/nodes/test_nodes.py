"""A sample of the shader nodes computes what Cycles computes. The whole comparison is compare_with_cycles."""

import os
import pathlib
import shutil
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import node_runs

k_blender = os.environ.get("BLENDER", "blender")

pytestmark = pytest.mark.skipif(shutil.which(k_blender) is None, reason=f"no Blender: '{k_blender}'")


def differing(folder, *arguments, **options):
    _, verdicts = node_runs.run(folder, *arguments, **options)
    assert verdicts
    return [node_runs.line_of(verdict) for verdict in verdicts if not verdict.agrees and not verdict.note]


def test_values_of_every_node_agree_with_cycles_to_rounding(tmp_path):
    assert differing(tmp_path, ["value"]) == []


def test_a_sample_of_shaders_and_inputs_agrees_with_cycles(tmp_path):
    assert differing(tmp_path, ["input", "surface"], every=6, samples=16) == []
