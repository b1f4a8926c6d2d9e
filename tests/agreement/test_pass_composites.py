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


k_things = ("Mirror", "Glass", "Box")


@pytest.mark.parametrize("integrator", ["PT", "VCM"])
def test_things_laid_over_a_backplate_by_passes_equal_the_render_of_them_in_the_place(tmp_path, integrator):
    """The plate is what a camera would have taken of the place without them. The place is matte in the render of the passes."""
    scene = blender_runs.own_scene("backplate", tmp_path)

    def rendered(number, samples, objects, layer_settings=None):
        arguments = (scene, "LAMBENT", range(1 + 1000 * number, 9 + 1000 * number), samples, 96, tmp_path / str(number))
        chosen = {"settings": {"integrator": integrator}, "objects": objects, "layer_settings": layer_settings}
        return blender_runs.render_layers(*arguments, **chosen)[0]["ViewLayer"]

    passes = rendered(1, 96, {"mattes": ["Floor", "Wall"]}, {"use_pass_shadow_catcher": True, "use_pass_matte_light": True})
    plate = rendered(2, 96, {"removed": k_things})["Combined"]
    direct = rendered(3, 96, {})["Combined"]
    things, alpha = passes["Combined"][..., :3], passes["Combined"][..., 3:]
    composed = things + (1.0 - alpha) * passes["Shadow Catcher"] * plate[..., :3]
    found = image_statistics.compare(direct[..., :3], composed)
    assert found.failing_beyond_margin == 0.0, found
    assert numpy.abs(found.mean_ratio - 1.0) <= 0.01 + 4 * found.mean_ratio_error, found
    # Neither the shadows nor what the things bring can be left out.
    for without in (things + (1.0 - alpha) * plate[..., :3], composed - passes["Matte Light"]):
        assert image_statistics.compare(direct[..., :3], without).failing_beyond_margin > 0.1


@pytest.mark.parametrize("integrator", ["PT", "VCM"])
def test_shadows_lifted_of_rebalanced_light_groups_equal_the_render_of_that(tmp_path, integrator):
    scene = blender_runs.own_scene("passes", tmp_path)
    shown = {"use_pass_without_shadow": True, "use_pass_shadow_difference": True, "use_shadow_groups": True}
    arguments = (scene, "LAMBENT", range(1, 9), 64, 96, tmp_path / "passes")
    passes = blender_runs.render_layers(*arguments, settings={"integrator": integrator}, layer_settings=shown)[0]["ViewLayer"]
    for group in k_balance:
        whole = passes[f"Without Shadow_{group}"] + passes[f"Shadow Difference_{group}"]
        assert numpy.allclose(whole, passes[f"Combined_{group}"], rtol=1e-5, atol=1e-6)
    # The film is transparent: what the camera sees of the world is in its group and not in the picture.
    composed = sum(factor * passes[f"Without Shadow_{group}"] for group, factor in k_balance.items()) - k_balance["sky"] * passes["Environment"]
    arguments = (scene, "LAMBENT", range(1001, 1009), 64, 96, tmp_path / "direct")
    changed = {"balance": k_balance, "objects": {"camera_only": blender_runs.k_shadow_objects}}
    direct = blender_runs.render_layers(*arguments, settings={"integrator": integrator}, **changed)[0]["ViewLayer"]
    found = image_statistics.compare(direct["Combined"][..., :3], composed)
    assert found.failing_beyond_margin == 0.0, found
    assert numpy.abs(found.mean_ratio - 1.0) <= 0.01 + 4 * found.mean_ratio_error, found
    assert image_statistics.compare(passes["Combined"][..., :3], composed).failing_beyond_margin > 0.2
