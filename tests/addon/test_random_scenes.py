# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that nobody would make, rendered with the built lambentd: every one is finished, and with finite pixels.

$LAMBENT_RANDOM_SCENES: "FIRST-LAST", the seeds to render in place of the few that always are."""

import os
import re

import pytest

from harness import HERE, SAVE
from test_with_lambentd import LAMBENTD

SECONDS_A_SCENE = 20


def test_random_scenes_are_rendered(run_blender):
    if not os.access(LAMBENTD, os.X_OK):
        pytest.skip(f"no lambentd at {LAMBENTD}: build it or set LAMBENT_BUILD_DIR")
    first, last = map(int, os.environ.get("LAMBENT_RANDOM_SCENES", "1-16").split("-"))
    run = run_blender(
        SAVE
        + f"""
sys.path.insert(0, {HERE!r})
from random_scenes import RandomScene
nodes, lit = set(), 0
for seed in range({first}, {last} + 1):
    print('SEED', seed, flush=True)
    nodes |= RandomScene(seed).nodes
    scene = bpy.context.scene
    if render() != {{'FINISHED'}}: print('NOT FINISHED', seed)
    save('picture')
    pixels = np.load(os.path.join(os.environ['LAMBENT_TEST_DIR'], 'picture.npy'))
    if not np.isfinite(pixels).all(): print('NOT FINITE', seed)
    lit += bool(pixels[..., :3].max() > 0)
print('RENDERED', seed, 'LIT', lit, 'NODES', len(nodes))
""",
        daemon=LAMBENTD,
        timeout=SECONDS_A_SCENE * (last - first + 1),
    )
    assert f"RENDERED {last}" in run.output, run.output[-3000:]
    for bad in ("NOT FINISHED", "NOT FINITE", "Traceback", "a fault of the add-on", "could not be exported"):
        assert bad not in run.output, run.output
    lit, nodes = map(int, re.search(r"LIT (\d+) NODES (\d+)", run.output).groups())
    assert lit * 3 > last - first + 1 and nodes > 50, f"of the scenes {lit} show something, of {nodes} types of nodes"
