"""Lambent and Cycles agree on small scenes of the project's own. The whole comparison is compare_with_cycles."""

import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blender_runs
import image_statistics

k_blender = os.environ.get("BLENDER", "blender")

pytestmark = pytest.mark.skipif(shutil.which(k_blender) is None, reason=f"no Blender: '{k_blender}'")


@pytest.mark.parametrize(("name", "width", "samples"), [("cornell", 96, 128), ("lights", 128, 64), ("displacement", 240, 32)])
def test_no_tile_differs_from_cycles_by_over_one_percent(name, width, samples, tmp_path):
    scene = blender_runs.own_scene(name, tmp_path)
    pictures = [
        blender_runs.render(scene, engine, range(first, first + 8), samples, width, tmp_path / engine).pictures[..., :3]
        for first, engine in ((1, "CYCLES"), (1001, "LAMBENT"))
    ]
    found = image_statistics.compare(*pictures)
    assert found.failing_beyond_margin == 0.0, found
    assert abs(found.mean_ratio - 1.0) <= 0.01 + 4 * found.mean_ratio_error, found


def test_light_linking_agrees_with_cycles(tmp_path):
    version = subprocess.run([k_blender, "--version"], capture_output=True, text=True, check=True).stdout
    if int(re.search(r"Blender (\d+)", version).group(1)) < 4:
        pytest.skip("light linking came with Blender 4.0")
    test_no_tile_differs_from_cycles_by_over_one_percent("light_linking", 112, 64, tmp_path)
