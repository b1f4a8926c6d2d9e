# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pass that a rendered viewport shows: which there are, what is asked of the daemon, what is seen and what is kept."""

import os
import pathlib

import numpy as np
import pytest
from render.pass_pictures import PassPictures, displayed
from screenshots import gradient_pixels, read_screenshot
from test_passes import printed

import harness

LAMBENTD = pathlib.Path(os.environ.get("LAMBENT_BUILD_DIR") or os.path.join(harness.ROOT, "build", "release")) / "bin" / "lambentd"

# view() is the viewport's area, choose(key) shows a pass in it, states() prints what viewports say of passes.
VIEWPORT = """
from lambent.render import viewport
from lambent.sync import shown_pass
layer = bpy.context.view_layer
def view(): return next(area for area in window().screen.areas if area.type == 'VIEW_3D')
def shade():
    space = view().spaces.active
    space.shading.type, space.overlay.show_overlays, space.show_gizmo = 'RENDERED', False, False
def choose(key): view().spaces.active.shading.lambent.render_pass = key
def turn(): view().spaces.active.region_3d.view_rotation = (1, 0, 0, 0)
def states():
    for each in list(viewport._open): print('NOTICE', repr(each._notice), flush=True)
def finished(steps):
    # A step that waits until the daemon has said that what is shown is done.
    begun = []
    def look():
        begun.append(time.monotonic())
        done = [each._pictures.is_finished(each._shown) for each in list(viewport._open)]
        if not (done and all(done)) and time.monotonic() < begun[0] + 60: steps.insert(0, (0.1, look))
    return look
def gradient(pixels): return gradient_pixels(pixels) > 50_000
def white(pixels): return (pixels.min(axis=2) > 0.99).sum() > 50_000
"""


def white_pixels(pixels):
    """How many pixels of a screenshot are white, as the fake daemon's second channel is."""
    return int((pixels.min(axis=2) > 0.99).sum())


def asked_of_viewport(run):
    """settings.passes of each change of the settings, in order."""
    return [
        edit["value"]["passes"] for edits in run.transactions for edit in edits if edit["op"] == "upsert" and edit["kind"] == "settings"
    ]


def shown(kind, argument=None):
    """The entry of settings.passes of a pass that is shown."""
    return {"name": "shown", "kind": kind, **({} if argument is None else {"argument": argument})}


def test_the_menu_lists_the_passes_of_this_blender_and_of_the_layer(run_blender):
    run = run_blender(
        """
from lambent.sync import passes, shown_pass
layer = bpy.context.view_layer
for name, kind in (('tint', 'COLOR'), ('amount', 'VALUE'), ('combined', 'COLOR')):
    aov = layer.aovs.add(); aov.name, aov.type = name, kind
layer.lightgroups.add(name='keys')
bpy.ops.lambent.light_path_add(); bpy.ops.lambent.matte_add()
print('COLUMNS', repr([(heading, [key for key, _ in column]) for heading, column in shown_pass.choices(layer)]))
found = {key: shown_pass.find(layer, key) for _, column in shown_pass.choices(layer) for key, _ in column}
print('WIRE', repr({key: entry.on_wire for key, entry in found.items()}))
print('KINDS', repr([kind for kind in passes.kinds()]))
print('FEW', repr([key for _, column in shown_pass.choices(layer, {'combined', 'mist'}) for key, _ in column]))
print('NONE', shown_pass.find(layer, 'aov:gone'), shown_pass.find(layer, ''), shown_pass.name('aov:gone'), shown_pass.name('uv'))
"""
    )
    columns = dict(printed(run, "COLUMNS"))
    assert columns["General"][:2] == ["combined", "emission"] and "normal" in columns["Data"] and "error" in columns["Lambent"]
    assert columns["View Layer"] == ["aov:tint", "aov:amount", "aov:combined", "light_group:keys", "matte:Matte 1", "light_path:Light Path 1"]
    keys = {key for column in columns.values() for key in column}
    # All that a layer has switches for, whether on or not, but for those that a viewport cannot show or that are Combined.
    assert set(printed(run, "KINDS")) - keys <= {"vector", "noisy", "noisy_shadow_catcher"}
    wire = printed(run, "WIRE")
    assert wire["normal"] == shown("normal") and wire["light_group:keys"] == shown("light_group", "keys")
    assert wire["aov:combined"] == shown("aov_color", "combined") and wire["aov:amount"] == shown("aov_value", "amount")
    assert wire["cryptomatte_object"] == shown("cryptomatte_object", 2)
    assert wire["light_path:Light Path 1"] == shown("light_path", "C.*L")
    assert printed(run, "FEW") == ["combined", "mist"]
    assert "NONE None None gone UV" in run.output


def test_the_chosen_pass_is_rendered_alone_streamed_alone_and_seen(run_window, tmp_path):
    run = run_window(
        VIEWPORT
        + """
quad()
steps = []
steps += [(1.0, shade), (1.0, screenshot_when(steps, 'before', gradient)), (0.1, lambda: choose('mist')),
          (0.1, screenshot_when(steps, 'mist', white)), (0.1, turn), (1.0, screenshot_when(steps, 'turned', white)),
          (0.1, lambda: choose('combined')), (0.3, screenshot_when(steps, 'after', gradient))]
run(steps)
""",
        mode="endless",
    )
    assert "Traceback" not in run.output
    for name, count in (("before", gradient_pixels), ("mist", white_pixels), ("turned", white_pixels), ("after", gradient_pixels)):
        assert count(read_screenshot(tmp_path / name)) > 50_000, name
    # Not a mixture of the two at any time after the first tile.
    assert gradient_pixels(read_screenshot(tmp_path / "mist")) < 1000
    asked = asked_of_viewport(run)
    assert [passes for at, passes in enumerate(asked) if at == 0 or passes != asked[at - 1]] == [
        ["combined"],
        ["combined", shown("mist")],
        ["combined"],
    ]
    starts = [message["header"].get("stream") for message in run.of_type("render_start")]
    assert starts[0] is None and starts[-1] is None and ["shown"] in starts and set(map(str, starts)) == {"None", "['shown']"}
    with_mist = [
        edit["value"] for edits in run.transactions for edit in edits if edit["kind"] == "settings" and len(edit["value"]["passes"]) > 1
    ]
    # Where only the view moved, they stay as they are.
    assert all("mist" in value for value in with_mist)
    assert any(edit["kind"] == "camera" for edit in run.transactions[-2])
    # The mesh never travels again for it.
    assert sum(("mesh", "mesh:quad") == (edit["kind"], edit["id"]) for edits in run.transactions for edit in edits) == 1


def test_what_was_finished_is_there_again_at_once_and_is_not_rendered_again(run_window, tmp_path):
    run = run_window(
        VIEWPORT
        + """
quad()
steps = []
steps += [(1.0, shade), (1.0, screenshot_when(steps, 'before', gradient)), (0.1, finished(steps)), (0.1, lambda: choose('depth')),
          (0.1, screenshot_when(steps, 'depth', white)), (0.1, finished(steps)), (0.1, lambda: choose('combined')),
          (0.1, screenshot_when(steps, 'after', gradient)), (0.1, lambda: choose('depth')),
          (0.1, screenshot_when(steps, 'again', white))]
run(steps)
"""
    )
    assert "Traceback" not in run.output
    for name, count in (("before", gradient_pixels), ("depth", white_pixels), ("after", gradient_pixels), ("again", white_pixels)):
        assert count(read_screenshot(tmp_path / name)) > 50_000, name
    # The daemon knows what is shown each time, and has rendered each pass once.
    asked = asked_of_viewport(run)
    assert [len(passes) for passes in asked[-4:]] == [1, 2, 1, 2]
    streams = [message["header"].get("stream") for message in run.of_type("render_start")]
    assert streams.count(["shown"]) == 1 and streams[-1] == ["shown"], streams


def test_a_pass_that_vanished_or_that_the_daemon_has_not_is_replaced_by_combined_and_named(run_window, tmp_path):
    run = run_window(
        VIEWPORT
        + """
material, nodes, links = node_material('m')
output = nodes.new('ShaderNodeOutputAOV')
if hasattr(output, 'aov_name'): output.aov_name = 'tint'
else: output.name = 'tint'
ob = quad()
ob.data.materials.append(material)
layer.aovs.add().name = 'tint'
def remove(): layer.aovs.remove(layer.aovs['tint']) if hasattr(layer.aovs, 'remove') else bpy.ops.scene.view_layer_remove_aov()
def rename(): layer.aovs[0].name = 'other'
def back(): layer.aovs[0].name = 'tint'
def shown_in_menu(): print('MENU', view().spaces.active.shading.lambent.render_pass, flush=True)
steps = []
steps += [(1.0, shade), (1.0, screenshot_when(steps, 'before', gradient)), (0.1, lambda: choose('aov:tint')),
          (0.1, screenshot_when(steps, 'tint', white)), (0.1, states), (0.1, rename),
          (0.1, screenshot_when(steps, 'gone', gradient)), (0.1, states), (0.1, shown_in_menu), (0.1, back),
          (0.1, screenshot_when(steps, 'back', white)), (0.1, states), (0.1, shown_in_menu)]
run(steps)
""",
        mode="endless",
    )
    assert "Traceback" not in run.output
    for name, count in (("tint", white_pixels), ("gone", gradient_pixels), ("back", white_pixels)):
        assert count(read_screenshot(tmp_path / name)) > 50_000, name
    notices = [line for line in run.output.splitlines() if line.startswith("NOTICE")]
    assert notices == ["NOTICE ''", "NOTICE \"The view layer has no pass 'tint' any more: Combined is shown\"", "NOTICE ''"]
    assert [line for line in run.output.splitlines() if line.startswith("MENU")] == ["MENU combined", "MENU aov:tint"]
    asked = asked_of_viewport(run)
    assert asked[0] == ["combined"] and ["combined", shown("aov_color", "tint")] in asked
    # Materials output the AOV while it is shown, and only then.
    outputs = ["aovs" in edit["value"]["graph"]["outputs"] for edits in run.transactions for edit in edits if edit["kind"] == "material" and edit["id"] == "m"]
    assert outputs[:2] == [False, True] and False in outputs[2:] and outputs[-1]


def test_a_daemon_of_few_passes_is_named(run_window, tmp_path):
    run = run_window(
        VIEWPORT
        + """
quad()
steps = []
def by_key(): view().spaces.active.shading.lambent.render_pass_key = 'mist'
steps += [(1.0, shade), (1.0, screenshot_when(steps, 'before', gradient)), (0.1, by_key), (0.3, turn),
          (1.0, screenshot_when(steps, 'after', gradient)), (0.1, states)]
run(steps)
""",
        mode="few_passes",
    )
    assert gradient_pixels(read_screenshot(tmp_path / "after")) > 50_000
    assert "NOTICE \"The daemon does not support the pass 'Mist': Combined is shown\"" in run.output
    assert all(passes == ["combined"] for passes in asked_of_viewport(run))


def test_passes_look_as_they_do_with_cycles(run_window, tmp_path):
    """A wall that faces nowhere in particular fills the view: its normal, place and mist are one colour or a slow gradient."""
    if not os.access(LAMBENTD, os.X_OK):
        pytest.skip(f"no {LAMBENTD}: build it or set LAMBENT_BUILD_DIR")
    run = run_window(
        VIEWPORT
        + """
names = [item.name for item in bpy.types.ColorManagedViewSettings.bl_rna.properties['view_transform'].enum_items]
scene.view_settings.view_transform = 'AgX' if 'AgX' in names else 'Filmic'
wall = add_mesh('wall', [(-99, -99, 0), (99, -99, 0), (99, 99, 0), (-99, 99, 0)], [(0, 1, 2, 3)])
wall.location, wall.rotation_euler = (0.2, 0.6, 0.3), (0.3, 0.2, 0)
material, nodes, links = node_material('m')
glow, wall_color, both_of = nodes.new('ShaderNodeEmission'), nodes.new('ShaderNodeBsdfDiffuse'), nodes.new('ShaderNodeAddShader')
glow.inputs['Color'].default_value, wall_color.inputs['Color'].default_value = (0.6, 0.3, 0.1, 1), (0.1, 0.5, 0.9, 1)
for number, shader in enumerate((glow, wall_color)): links.new(shader.outputs[0], both_of.inputs[number])
links.new(both_of.outputs[0], nodes.new('ShaderNodeOutputMaterial').inputs['Surface'])
scene.world.use_nodes = True
next(node for node in scene.world.node_tree.nodes if node.type == 'BACKGROUND').inputs['Strength'].default_value = 0
wall.data.materials.append(material)
scene.world.mist_settings.start, scene.world.mist_settings.depth = 0, 40
scene.cycles.preview_samples = scene.lambent.preview_samples = 4
scene.cycles.use_preview_denoising = False
PASSES = ('normal', 'NORMAL'), ('position', 'POSITION'), ('mist', 'MIST'), ('diffuse_color', 'DIFFUSE_COLOR')
import numpy as np
def middle(pixels): return pixels[200:500, 250:800]
def look_ahead():
    space = view().spaces.active
    space.region_3d.view_rotation, space.region_3d.view_perspective = (0.95, 0.2, 0.1, 0.05), 'PERSP'
    space.shading.type, space.overlay.show_overlays, space.show_gizmo = 'SOLID', False, False
def both(ours, theirs):
    space = view().spaces.active
    space.shading.lambent.render_pass, space.shading.cycles.render_pass = ours, theirs
    view().tag_redraw()
def switch(engine): scene.render.engine = engine
def as_ours(ours):
    # What Cycles has drawn so far: coarse at first.
    return lambda pixels: np.abs(middle(pixels) - middle(read_screenshot(os.path.join(FOLDER, 'LAMBENT' + ours)))).max() < 2.5 / 255
steps = []
steps += [(1.0, look_ahead), (0.5, shade)]
for ours, theirs in PASSES:
    steps += [(0.1, lambda ours=ours, theirs=theirs: both(ours, theirs)), (0.5, finished(steps)),
              (1.0, lambda ours=ours: screenshot('LAMBENT' + ours))]
steps.append((0.2, lambda: switch('CYCLES')))
for ours, theirs in PASSES:
    steps += [(0.2, lambda ours=ours, theirs=theirs: both(ours, theirs)), (0.5, screenshot_when(steps, 'CYCLES' + ours, as_ours(ours)))]
run(steps)
""",
        daemon=LAMBENTD,
        timeout=400,
    )
    assert "Traceback" not in run.output
    seen = []
    for name in ("normal", "position", "mist", "diffuse_color"):
        ours, theirs = (read_screenshot(tmp_path / (engine + name))[200:500, 250:800] for engine in ("LAMBENT", "CYCLES"))
        # A screen's colours have 255 steps; dithering moves them by one.
        assert np.abs(ours - theirs).max() < 2.5 / 255, name
        seen.append(ours)
    # And each is another picture.
    for at, one in enumerate(seen):
        assert all(np.abs(one - other).max() > 0.1 for other in seen[at + 1 :])


def test_values_of_passes_become_pixels():
    grey = displayed("depth", np.full((2, 3, 1), 0.25, np.float32))
    assert grey.shape == (2, 3, 4) and (grey[..., :3] == 0.25).all() and (grey[..., 3] == 1).all()
    values = np.array([[[-0.5, 1e10, np.nan]]], np.float32)
    assert (displayed("normal", values)[0, 0] == [0, 65504, 0, 1]).all()
    # Four numbers: the fourth is no transparency.
    assert (displayed("aov_color", np.array([[[0.1, 0.2, 0.3, 0]]], np.float32))[0, 0] == np.float32([0.1, 0.2, 0.3, 1])).all()
    ids = np.array([[[3e38, 1, 0, 0], [-1e-30, 1, 0, 0], [3e38, 0.5, -1e-30, 0.5], [0, 0, 0, 0]]], np.float32)
    first, second, mixed, nothing = displayed("cryptomatte_object", ids)[0, :, :3]
    assert np.abs(first - second).max() > 0.1 and np.allclose(mixed, (first + second) / 2) and (nothing == 0).all()


def test_a_picture_stays_until_a_new_render_of_it_is_as_far():
    pictures = PassPictures()
    tile = (2, 1, 2, 2)
    assert pictures.pixels("normal") is None and not pictures.is_finished("normal") and pictures.samples(None) == 0
    assert pictures.add(None, 6, 4, tile, 8, 1.0)
    assert pictures.add("normal", 6, 4, tile, 1, 0.5)
    assert not pictures.add(None, 6, 4, tile, 7, 2.0) and pictures.pixels(None)[1, 2, 0] == 1.0
    assert pictures.add(None, 6, 4, tile, 8, 3.0) and pictures.pixels(None)[1, 2, 0] == 3.0
    pictures.finish((None, "never shown"))
    assert pictures.is_finished(None) and not pictures.is_finished("never shown")
    pictures.forget(keep=None)
    # What is seen of the old view stays until it is painted over, by whatever comes.
    assert pictures.pixels(None)[1, 2, 0] == 3.0 and not pictures.is_finished(None) and pictures.pixels("normal") is None
    assert pictures.add(None, 6, 4, tile, 1, 4.0) and pictures.pixels(None)[1, 2, 0] == 4.0
    # Another size is another picture.
    assert pictures.add(None, 8, 4, tile, 1, 5.0) and pictures.pixels(None).shape == (4, 8, 4)


def test_few_pictures_are_kept():
    pictures = PassPictures()
    for shown_pass in (None, "a", "b", "c", "d"):
        pictures.add(shown_pass, 4, 4, (0, 0, 4, 4), 1, 1.0)
    assert [name for name in (None, "a", "b", "c", "d") if pictures.pixels(name) is not None] == [None, "c", "d"]
