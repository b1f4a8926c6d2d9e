"""What is composed from passes equals the render of the same change."""

import os
import pathlib
import shutil
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blender_runs
import image_statistics
import numpy

pytestmark = pytest.mark.skipif(shutil.which(os.environ.get("BLENDER", "blender")) is None, reason="no Blender")

k_balance = {"keys": 0.25, "rim": 4.0, "signs": 2.0, "sky": 0.5}


@pytest.mark.parametrize("integrator", ["PT", "VCM"])
def test_light_groups_rebalanced_equal_the_render_with_other_lamps(tmp_path, integrator):
    scene = blender_runs.own_scene("passes", tmp_path)
    runs = []
    for first, balance in ((1, {}), (1001, k_balance)):
        folder = tmp_path / str(first)
        arguments = (scene, "LAMBENT", range(first, first + 8), 64, 96, folder)
        runs.append(blender_runs.render_layers(*arguments, settings={"integrator": integrator}, balance=balance)[0]["ViewLayer"])
    passes, direct = runs
    # The film is transparent: what the camera sees of the world is in its group and not in Combined.
    composed = sum(factor * passes[f"Combined_{group}"] for group, factor in k_balance.items()) - k_balance["sky"] * passes["Environment"]
    found = image_statistics.compare(composed, direct["Combined"][..., :3])
    assert found.failing_beyond_margin == 0.0, found
    assert numpy.abs(found.mean_ratio - 1.0) <= 0.01 + 4 * found.mean_ratio_error, found
    # And they are another picture than before.
    assert image_statistics.compare(passes["Combined"][..., :3], direct["Combined"][..., :3]).failing_beyond_margin > 0.2
