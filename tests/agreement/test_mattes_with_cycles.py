"""Holdouts, masks, layers, catchers and transparent glass: small pictures of tests/scenes/make_matte_cases.py against Cycles."""

import json
import os
import shutil

import known_pass_differences
import pytest
from test_passes_with_cycles import blender_runs, compare_passes

pytestmark = pytest.mark.skipif(shutil.which(os.environ.get("BLENDER", "blender").split()[0]) is None, reason="no Blender")

k_cases = (
    "transparent_glass", "holdout_shader", "holdout_shader_opaque", "holdout_objects", "indirect_only", "ray_kinds", "opaque_shadows", "layers",
    "catcher_area", "catcher_environment", "catcher_caustic",
)  # fmt: skip


def known_of(folder):
    """What is known to differ of the passes of glossy and transmissive things, by the Blender that rendered in a folder."""
    version = json.loads((folder / "cycles" / "cycles_result.json").read_text(encoding="utf-8"))["blender"]
    known = known_pass_differences.of_cycles(version)
    return {name: known[name] for name in known if name.startswith(("Glossy", "Transmission"))}


def rendered(case, folder, batches=6):
    """Returns Cycles' and PT's {layer: {pass: batches}} of a case, and what Blender said while PT rendered."""
    scene = blender_runs.own_scene("matte_cases", folder, case)
    cycles, _, _ = blender_runs.render_layers(scene, "CYCLES", range(1, 1 + batches), 32, 96, folder / "cycles")
    lambent, _, run = blender_runs.render_layers(scene, "LAMBENT", range(1001, 1001 + batches), 32, 96, folder / "lambent")
    return cycles, lambent, run.log


def with_scattered_light_as_one(pictures):
    """Returns {layer: {pass: batches}} with one pass "Scattered" in place of those of light by class: what scatters behind clear glass counts
    by what scatters it in Lambent, as behind transparent surfaces, and for Cycles as Transmission Indirect."""
    found = {}
    for layer, passes in pictures.items():
        of_class = [name for name in passes if name.endswith(("Direct", "Indirect"))]
        found[layer] = {name: values for name, values in passes.items() if name not in of_class}
        if of_class:
            found[layer]["Scattered"] = sum(passes[name] * passes[f"{name.split()[0]} Color"] for name in of_class)
    return found


@pytest.mark.parametrize("case", k_cases)
def test_each_case_is_the_picture_of_cycles(tmp_path, case):
    cycles, lambent, log = rendered(case, tmp_path)
    assert "not support" not in log, log
    if case == "transparent_glass":
        cycles, lambent = with_scattered_light_as_one(cycles), with_scattered_light_as_one(lambent)
    if case.startswith("catcher"):  # the light passes of Cycles have the catchers too, those of Lambent show a hole there
        cycles, lambent = ({"ViewLayer": {name: one["ViewLayer"][name] for name in ("Combined", "Shadow Catcher", "Environment")}} for one in (cycles, lambent))
    rows, bad = compare_passes.compare(cycles, lambent, 16, known_of(tmp_path))
    assert len(rows) >= 2 and not bad, "\n".join(" | ".join(row) for row in rows if row[-1])
    alpha = lambent["ViewLayer"]["Combined"][..., 3].mean(axis=0)
    if case.startswith("holdout") or case == "transparent_glass":
        assert 0.01 < (alpha < 0.5).mean() < 0.95, "there are holes"
    if case == "layers":
        assert set(lambent) == {"ViewLayer", "Override", "Bare", "Holes", "Nothing"}
        for empty in ("Bare", "Holes", "Nothing"):
            assert not lambent[empty]["Combined"].any(), empty
