# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Random scenes with random layers, passes, light groups, mattes and integrators through the built lambentd: all that was asked for
is there, with its channels and finite, and what must add up does.

$LAMBENT_RANDOM_PASSES: "FIRST-LAST", the seeds to render in place of the few that always are."""

import ast
import os
import re
import sys

import numpy as np
import pytest

import harness
from test_with_lambentd import LAMBENTD

sys.path.insert(0, os.path.join(harness.ROOT, "tests", "common"))
import multilayer  # noqa: E402

SECONDS_A_SCENE = 60
# Of the sum of the parts' absolute values: a dozen 24-bit numbers, divided and multiplied again.
ROUNDING = 1e-5

SCRIPT = f"""
import os
sys.path.insert(0, {harness.HERE!r})
from lambent.render import session
from random_scenes import RandomScene
from random_passes import RandomPasses
for seed in range(FIRST, LAST + 1):
    print('SEED', seed, flush=True)
    made, asked = RandomScene(seed), RandomPasses(seed)
    scene = bpy.context.scene
    settings = scene.render.image_settings
    if hasattr(settings, 'media_type'): settings.media_type = 'MULTI_LAYER_IMAGE'
    settings.file_format, settings.color_depth, settings.exr_codec = 'OPEN_EXR_MULTILAYER', '32', 'ZIP'
    scene.render.filepath = os.path.join(os.environ['LAMBENT_TEST_DIR'], f'{{seed}}.exr')
    if render(write_still=True) != {{'FINISHED'}}: print('NOT FINISHED', seed)
    print('ASKED', repr((seed, scene.render.film_transparent, asked.sums, asked.asked)), flush=True)
print('RENDERED', seed)
"""


def seeds():
    """The first and the last of the scenes to render."""
    return tuple(map(int, os.environ.get("LAMBENT_RANDOM_PASSES", "1-8").split("-")))


def parts_of(whole, passes):
    """[float64[height][width][3]] of the passes that add up to Combined, or None where an AOV has the name of one."""
    get = lambda name: passes[name][..., :3].astype(np.float64)
    if whole == "light":
        found = [get(f"{kind} {part}") * get(f"{kind} Color") for kind in ("Diffuse", "Glossy", "Transmission") for part in ("Direct", "Indirect")]
        return [*found, get("Emission"), get("Environment")]
    if whole == "techniques":
        return [get(f"Technique {name}") for name in ("Unidirectional", "Connection", "Merging")]
    if whole == "groups":
        groups = [name for name in passes if name.startswith("Combined_")]
        return [get(name) for name in groups] if all(passes[name].shape[-1] == 3 for name in groups) else None
    if whole == "shadow":
        return [get("Without Shadow"), get("Shadow Difference")]
    return [get("everything")]


def faults(path, film_transparent, sums, asked):
    """Sentences about what is not as it must be in a file."""
    layers, _ = multilayer.read(path)
    for layer, expected in asked.items():
        for name, count in expected:
            found = layers.get(layer, {}).get(multilayer.k_long_names.get(name, name))
            if found is None or found.shape[-1] != count:
                yield f"{layer}.{name}: {None if found is None else found.shape[-1]} channels, not {count}"
            elif not np.isfinite(found).all():
                yield f"{layer}.{name}: {np.count_nonzero(~np.isfinite(found))} values are not finite"
    for layer, wholes in sums.items():
        passes = layers[layer]
        for whole in wholes:
            parts = parts_of(whole, passes)
            if parts is None:
                continue
            expected = passes["Combined"][..., :3].astype(np.float64)
            if film_transparent and whole in ("light", "groups"):
                if "Environment" not in passes:
                    continue
                expected = expected + passes["Environment"]
            error = np.abs(sum(parts) - expected) / np.maximum(sum(np.abs(part) for part in parts) + np.abs(expected), 1e-3)
            if not error.max() <= ROUNDING:
                y, x, _ = np.unravel_index(error.argmax(), error.shape)
                yield f"{layer}: {whole} differ from Combined by {error.max():.2g} at {x}, {y}: {[part[y, x] for part in parts]}, {expected[y, x]}"


def test_random_passes_are_there_and_add_up(run_blender, tmp_path):
    if not os.access(LAMBENTD, os.X_OK):
        pytest.skip(f"no lambentd at {LAMBENTD}: build it or set LAMBENT_BUILD_DIR")
    first, last = seeds()
    script = f"FIRST, LAST = {first}, {last}\n" + SCRIPT
    run = run_blender(script, daemon=LAMBENTD, timeout=SECONDS_A_SCENE * (last - first + 1))
    assert f"RENDERED {last}" in run.output, run.output[-3000:]
    for bad in ("NOT FINISHED", "Traceback", "a fault of the add-on", "could not be exported"):
        assert bad not in run.output, run.output
    found, checked = [], 0
    for line in re.findall(r"^ASKED (.*)$", run.output, re.MULTILINE):
        seed, film_transparent, sums, asked = ast.literal_eval(line)
        found += [f"seed {seed}: {fault}" for fault in faults(tmp_path / f"{seed}.exr", film_transparent, sums, asked)]
        checked += sum(map(len, sums.values()))
    assert not found, "\n".join(found)
    assert checked >= last - first, f"{checked} sums were checked"
