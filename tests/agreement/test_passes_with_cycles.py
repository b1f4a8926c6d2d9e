"""Each pass of a small picture of tests/scenes/make_passes.py against Cycles' pass of that name. The whole is compare_passes."""

import importlib.machinery
import importlib.util
import json
import os
import pathlib
import shutil
import sys

import numpy as np
import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blender_runs
import known_pass_differences

k_script = pathlib.Path(__file__).resolve().parent / "compare_passes"
loader = importlib.machinery.SourceFileLoader("compare_passes", str(k_script))
compare_passes = importlib.util.module_from_spec(importlib.util.spec_from_loader("compare_passes", loader))
loader.exec_module(compare_passes)

pytestmark = pytest.mark.skipif(shutil.which(os.environ.get("BLENDER", "blender").split()[0]) is None, reason="no Blender")


def test_no_tile_of_any_pass_of_the_same_meaning_differs_from_cycles_by_over_one_percent(tmp_path):
    scene = blender_runs.own_scene("passes", tmp_path)
    found = []
    for first, engine in ((1, "CYCLES"), (1001, "LAMBENT")):
        pictures, attributes, _ = blender_runs.render_layers(scene, engine, range(first, first + 8), 32, 96, tmp_path / engine)
        for what, error in compare_passes.sums(pictures).items():
            assert error <= compare_passes.k_rounding, f"{engine}: {what} differ from Combined by {error}"
        found.append(compare_passes.with_coverages(pictures, attributes))
    version = json.loads((tmp_path / "CYCLES" / "cycles_result.json").read_text(encoding="utf-8"))["blender"]
    rows, bad = compare_passes.compare(*found, 16, known_pass_differences.of_cycles(version))
    assert len(rows) > 60 and not bad, "\n".join(" | ".join(row) for row in rows)


@pytest.mark.parametrize("shown_by", ["pass", "alpha", "world"])
def test_shadow_catchers_catch_what_those_of_cycles_do(tmp_path, shown_by):
    """By the pass; without it, by the picture's alpha; on an opaque film, by the world that they show."""
    scene = blender_runs.own_scene("shadow_catcher", tmp_path)
    change = (
        "import bpy; scene = bpy.context.scene; scene.render.film_transparent = {}; "
        "bpy.context.view_layer.cycles.use_pass_shadow_catcher = {}; "
        "scene.world.node_tree.nodes['Background'].inputs['Color'].default_value = (0.6, 0.6, 0.6, 1); bpy.ops.wm.save_mainfile()"
    ).format(shown_by != "world", shown_by == "pass")
    blender_runs.run_blender(["-b", str(scene), "--python-expr", change], dict(os.environ))
    found = []
    for first, engine in ((1, "CYCLES"), (1001, "LAMBENT")):
        pictures, _, run = blender_runs.render_layers(scene, engine, range(first, first + 6), 32, 96, tmp_path / engine)
        assert "not supported" not in run.log
        found.append(pictures)
    alpha = found[0]["ViewLayer"]["Combined"][..., 3]
    assert ("Shadow Catcher" in found[0]["ViewLayer"]) == (shown_by == "pass")
    if shown_by == "alpha":
        assert ((alpha > 0.05) & (alpha < 0.95)).mean() > 0.05, "the shadows are in the picture"
        # Alpha is cut off at 0, so where there is hardly a shadow its mean is noise: the more of it, the noisier the engine.
        seen = np.maximum(*(one["ViewLayer"]["Combined"][..., 3].mean(axis=0) for one in found)) > 0.02
        assert seen.mean() > 0.2
        for one in found:
            one["ViewLayer"]["Combined"] = one["ViewLayer"]["Combined"] * seen[..., None]
    if shown_by == "world":
        # Cycles darkens the world by the shadow's mean over the colours, where Lambent shows its colour too. Where a thing
        # covers a part of a pixel, Cycles has the world's share of it squared: a dark fringe.
        change = change.replace("film_transparent = False", "film_transparent = True")
        blender_runs.run_blender(["-b", str(scene), "--python-expr", change], dict(os.environ))
        pictures, _, _ = blender_runs.render_layers(scene, "LAMBENT", [1], 32, 96, tmp_path / "things")
        # Without the pass a shadow is alpha too: things are what has colour, and the pixels around it.
        dark = np.pad((pictures["ViewLayer"]["Combined"][0, ..., :3] == 0).all(axis=-1), 1, constant_values=True)
        clear = np.logical_and.reduce([dark[y : y + dark.shape[0] - 2, x : x + dark.shape[1] - 2] for y in range(3) for x in range(3)])
        assert clear.mean() > 0.5
        for one in found:
            one["ViewLayer"]["Combined"] = (one["ViewLayer"]["Combined"][..., :3].mean(axis=-1) * clear)[..., None]
    rows, bad = compare_passes.compare(*found, 12)
    assert rows and not bad, "\n".join(" | ".join(row) for row in rows)


def version_of(result):
    """Returns the (major, minor) of the Blender that wrote a file of results."""
    return tuple(map(int, json.loads(result.read_text(encoding="utf-8"))["blender"].split(".")[:2]))


def inside(covered):
    """Returns bool[height][width]: where all neighbours are covered too."""
    wide = np.pad(covered, 1, constant_values=True)
    return np.logical_and.reduce([wide[y : y + covered.shape[0], x : x + covered.shape[1]] for y in range(3) for x in range(3)])


def test_what_moves_has_the_vectors_of_cycles(tmp_path):
    """Camera, objects, instances and deformed meshes that move. A world has none before Blender 5.2; there Cycles forgets to divide by the
    distance along the view, so that its worlds slide wrongly off the middle of the picture when the camera turns: left out."""
    scene = blender_runs.own_scene("motion", tmp_path)
    found, covered = [], True
    for first, engine in ((1, "CYCLES"), (1001, "LAMBENT")):
        pictures, _, _ = blender_runs.render_layers(scene, engine, range(first, first + 6), 16, 192, tmp_path / engine)
        covered = covered & inside((pictures["ViewLayer"]["Depth"][..., 0] < 1e9).all(axis=0))
        found.append({"ViewLayer": {"Vector": pictures["ViewLayer"]["Vector"]}})
    assert 0.2 < covered.mean() < 0.9
    if version_of(tmp_path / "CYCLES" / "cycles_result.json") >= (5, 2):
        for one in found:
            one["ViewLayer"]["Vector"] = one["ViewLayer"]["Vector"] * covered[..., None]
    cycles, lambent = (one["ViewLayer"]["Vector"] for one in found)
    assert cycles.shape[-1] == 4 and np.abs(cycles).max() > 10
    rows, bad = compare_passes.compare(*found, 12)
    assert rows and not bad, "\n".join(" | ".join(row) for row in rows)
    # Where every sample meets one flat surface the pass has no noise: there it is the same number.
    still = (cycles.std(axis=0) < 0.02).all(axis=-1) & (lambent.std(axis=0) < 0.02).all(axis=-1)
    assert still.mean() > 0.3
    assert np.abs(cycles.mean(axis=0) - lambent.mean(axis=0))[still].max() < 0.05
