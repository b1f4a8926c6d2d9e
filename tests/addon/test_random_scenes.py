# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that nobody would make, rendered with the built lambentd: every one is finished, and with finite pixels.

$LAMBENT_RANDOM_SCENES: "FIRST-LAST", the seeds to render in place of the few that always are."""

import os
import re

import pytest

from harness import HERE, SAVE
from test_with_lambentd import LAMBENTD

SECONDS_A_SCENE = 30


def seeds():
    """The first and the last of the scenes to render."""
    return tuple(map(int, os.environ.get("LAMBENT_RANDOM_SCENES", "1-16").split("-")))


def run_random(run_blender, script):
    """Renders the scenes; then runs script, indented once, with the scene `made` and its pixels `before`, with picture() and session."""
    if not os.access(LAMBENTD, os.X_OK):
        pytest.skip(f"no lambentd at {LAMBENTD}: build it or set LAMBENT_BUILD_DIR")
    first, last = seeds()
    run = run_blender(
        SAVE
        + f"""
sys.path.insert(0, {HERE!r})
from lambent.render import session
from random_scenes import RandomScene
nodes, lit, changed = set(), 0, 0
def picture():
    global scene
    scene = bpy.context.scene
    if render() != {{'FINISHED'}}: print('NOT FINISHED', seed)
    save('picture')
    # Or the scene could come to show it.
    for image in [image for image in bpy.data.images if image.filepath.endswith('picture.exr')]: bpy.data.images.remove(image)
    return np.load(os.path.join(os.environ['LAMBENT_TEST_DIR'], 'picture.npy'))
for seed in range({first}, {last} + 1):
    print('SEED', seed, flush=True)
    made = RandomScene(seed)
    nodes |= made.nodes
    before = picture()
    if not np.isfinite(before).all(): print('NOT FINITE', seed)
    lit += bool(before[..., :3].max() > 0)
{script}
print('RENDERED', seed, 'LIT', lit, 'NODES', len(nodes), 'CHANGED', changed)
""",
        daemon=LAMBENTD,
        timeout=SECONDS_A_SCENE * (last - first + 1),
    )
    assert f"RENDERED {last}" in run.output, run.output[-3000:]
    for bad in ("NOT FINISHED", "Traceback", "a fault of the add-on", "could not be exported"):
        assert bad not in run.output, run.output
    return run


def test_random_scenes_are_rendered(run_blender):
    first, last = seeds()
    run = run_random(run_blender, "")
    assert "NOT FINITE" not in run.output, run.output
    lit, nodes = map(int, re.search(r"LIT (\d+) NODES (\d+)", run.output).groups())
    assert lit * 8 > last - first + 1 and nodes > 50, f"of the scenes {lit} show something, of {nodes} types of nodes"


def test_edited_scenes_are_rendered_as_if_they_were_new(run_blender):
    """What travels between two renders is only what changed: the picture must be that of a session that knew nothing before."""
    first, last = seeds()
    run = run_random(
        run_blender,
        """
    for number in range(3):
        edits = [made.edit() for _ in range(4)]
        kept = picture()
        session.close_sessions()
        fresh = picture()
        changed += not np.array_equal(before, fresh, equal_nan=True)
        if not np.array_equal(kept, fresh, equal_nan=True):
            print('DIFFERS', seed, number, edits, np.count_nonzero(kept != fresh))
        before = fresh
""",
    )
    assert "DIFFERS" not in run.output, run.output
    changed = int(re.search(r"CHANGED (\d+)", run.output).group(1))
    assert changed > last - first, f"{changed} of the changes are seen"
