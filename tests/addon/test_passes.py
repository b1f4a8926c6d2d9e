# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes from the view layer's switches to Blender's result and its files, against the daemon in Python."""

import ast
import json
import os
import struct
import sys

import numpy as np
import pytest

import harness  # makes the add-on's modules that know no bpy importable
from fake_daemon import channels_of, pass_value
from render import cryptomatte

sys.path.insert(0, os.path.join(harness.ROOT, "tests", "common"))
import multilayer  # noqa: E402

# everything(layer) switches on all that Cycles offers, own_passes(layer) what Lambent alone does; multilayer(name) saves the result with all its passes.
PASSES = """
import os
def everything(layer):
    for name in layer.bl_rna.properties.keys():
        if name.startswith('use_pass_') and name not in ('use_pass_cryptomatte_accurate', 'use_pass_grease_pencil'):
            setattr(layer, name, True)
    for name in layer.cycles.bl_rna.properties.keys():
        if name.startswith('use_pass_') or name in ('pass_debug_sample_count', 'denoising_store_passes', 'pass_render_time'):
            setattr(layer.cycles, name, True)
    layer.pass_cryptomatte_depth = 6
    for name, kind in (('tint', 'COLOR'), ('amount', 'VALUE')):
        aov = layer.aovs.add(); aov.name, aov.type = name, kind
    for name in ('keys', 'rim'): layer.lightgroups.add(name=name)
def own_passes(layer):
    for name in layer.lambent.bl_rna.properties.keys():
        if name.startswith('use_pass_') and name[9:].startswith(('caustics', 'technique', 'error', 'time', 'without', 'shadow_difference', 'shadow_ratio')):
            setattr(layer.lambent, name, True)
    path = layer.lambent.light_paths.add(); path.name, path.expression = 'Mirrors', 'C<RS>.*L'
def multilayer(name):
    settings = scene.render.image_settings
    if hasattr(settings, 'media_type'): settings.media_type = 'MULTI_LAYER_IMAGE'
    settings.file_format, settings.color_depth, settings.exr_codec = 'OPEN_EXR_MULTILAYER', '32', 'ZIP'
    scene.render.filepath = os.path.join(os.environ['LAMBENT_TEST_DIR'], name)
def sockets():
    if hasattr(scene, 'compositing_node_group'):
        scene.compositing_node_group = scene.compositing_node_group or bpy.data.node_groups.new('comp', 'CompositorNodeTree')
        tree = scene.compositing_node_group
    else:
        scene.use_nodes = True
        tree = scene.node_tree
    for node in list(tree.nodes): tree.nodes.remove(node)
    node = tree.nodes.new('CompositorNodeRLayers')
    node.scene = scene
    bpy.context.view_layer.update()
    return [(socket.name, socket.type) for socket in node.outputs if socket.enabled and not socket.is_unavailable]
"""


def printed(run, name):
    """What a script printed as the repr of a value after name."""
    return ast.literal_eval(run.output.split(f"{name} ", 1)[1].splitlines()[0])


def test_the_compositor_offers_what_it_offers_for_cycles_and_lambents_own_passes_after(run_blender):
    run = run_blender(
        PASSES
        + """
everything(bpy.context.view_layer)
scene.cycles.use_denoising = True
scene.render.engine = 'CYCLES'
print('CYCLES', repr(sockets()))
scene.render.engine = 'LAMBENT'
print('LAMBENT', repr(sockets()))
own_passes(bpy.context.view_layer)
print('OWN', repr(sockets()))
"""
    )
    cycles, lambent, own = (printed(run, name) for name in ("CYCLES", "LAMBENT", "OWN"))
    # Cycles 5 has no shadow pass, which Blender still has a switch for.
    assert [socket for socket in lambent if socket[0] != "Shadow"] == [socket for socket in cycles if socket[0] != "Shadow"]
    assert len(cycles) > 40
    names = [name for name, _ in own]
    for name in ("Caustics Direct", "Caustics Indirect", "Technique Merging", "Error", "Sample Time", "Mirrors"):
        assert name in names
    assert names[: len(lambent)] == [name for name, _ in lambent]


def test_every_channel_lands_in_its_pass_of_its_layer(run_blender, tmp_path):
    run = run_blender(
        PASSES
        + """
everything(bpy.context.view_layer); own_passes(bpy.context.view_layer)
second = scene.view_layers.new('Second')
second.use_pass_normal = True
multilayer('all')
quad()
render(write_still=True)
"""
    )
    assert run.code == 0
    layers, _ = multilayer.read(tmp_path / "all.exr", long_names=False)
    starts = [message["header"] for message in run.of_type("render_start")]
    assert len(starts) == 2 and all(start["stream"] == ["combined"] for start in starts)
    for index, (layer, least) in enumerate((("ViewLayer", 50), ("Second", 2)), start=1):
        channels = channels_of(run.values("settings", index)["render"]["passes"])
        assert len(channels) >= least
        for place, (name, components) in enumerate(channels):
            found = layers[layer][name if place else "Combined"]
            assert found.shape == (96, 160, components)
            if place:
                expected = [pass_value(place, component) for component in range(components)]
                assert (found == np.array(expected, np.float32)).all(), name
        assert np.allclose(layers[layer]["Combined"][10, 20, :2], [20.5 / 160, 10.5 / 96])
        if layer == "Second":
            # Passes of the other layer are not made here, not even black.
            assert set(layers[layer]) == {"Combined", *(name for name, _ in channels[1:])}


def test_passes_are_cut_to_the_region_as_the_picture_is(run_blender, tmp_path):
    run = run_blender(
        PASSES
        + """
bpy.context.view_layer.use_pass_normal = True
scene.render.use_border = scene.render.use_crop_to_border = True
scene.render.border_min_x, scene.render.border_max_x = 0.3, 0.7
scene.render.border_min_y, scene.render.border_max_y = 0.1, 0.47
multilayer('cut')
quad()
render(write_still=True)
"""
    )
    x0, y0, x1, y1 = run.values("settings")["render"]["region"]
    layers, _ = multilayer.read(tmp_path / "cut.exr", long_names=False)
    place = [name for name, _ in channels_of(run.values("settings")["render"]["passes"])].index("Normal")
    normal = layers["ViewLayer"]["Normal"]
    assert normal.shape == (y1 - y0, x1 - x0, 3)
    assert (normal == np.array([pass_value(place, c) for c in range(3)], np.float32)).all()


def test_what_passes_need_of_world_and_layer_travels_with_them_only(run_blender):
    run = run_blender(
        """
world, layer = scene.world, bpy.context.view_layer
world.mist_settings.start, world.mist_settings.depth, world.mist_settings.falloff = 2, 9, 'INVERSE_QUADRATIC'
world.light_settings.distance, layer.pass_alpha_threshold, world.lightgroup = 3, 0.25, 'sky'
render()
layer.use_pass_mist = layer.use_pass_ambient_occlusion = True
render()
"""
    )
    without, with_them = (run.values("settings", count)["render"] for count in (1, 2))
    assert "mist" not in without and "ambient_occlusion_distance_m" not in without
    assert with_them["mist"] == {"start_m": 2, "depth_m": 9, "falloff": "INVERSE_QUADRATIC"}
    assert with_them["ambient_occlusion_distance_m"] == 3 and with_them["pass_alpha_threshold"] == 0.25
    assert with_them["passes"][0] == "combined"
    assert [entry["kind"] for entry in with_them["passes"][1:]] == ["mist", "ambient_occlusion"]
    assert next(iter(run.values("world").values()))["light_group"] == "sky"


def test_denoising_passes_follow_mirrors_by_the_rule_of_the_running_version(run_blender):
    run = run_blender("bpy.context.view_layer.lambent.use_pass_denoising_data = True\nquad()\nrender()\nprint('BLENDED', bpy.app.version >= (5, 1, 0))\n")
    sent = {entry["kind"]: entry for entry in run.values("settings")["render"]["passes"] if isinstance(entry, dict)}
    rule = "blended" if "BLENDED True" in run.output else None
    for kind in ("denoising_albedo", "denoising_normal", "denoising_depth"):
        assert sent[kind].get("argument") == rule, kind


def test_a_layer_that_asks_for_nothing_else_is_sent_as_any_daemon_knows_it(run_blender):
    run = run_blender("bpy.context.view_layer.use_pass_z = False\nquad()\nprint(render())\n", mode="no_passes")
    assert run.values("settings")["render"]["passes"] == ["combined"]
    assert "stream" not in run.of_type("render_start")[0]["header"] and "not support" not in run.output


@pytest.mark.parametrize("mode, kept", [("few_passes", {"combined", "Depth", "Error"}), ("no_passes", {"combined"})])
def test_passes_that_the_daemon_has_not_are_reported_by_name(run_blender, mode, kept):
    run = run_blender(PASSES + "everything(bpy.context.view_layer)\nown_passes(bpy.context.view_layer)\nquad()\nprint(render())\n", mode=mode)
    assert "{'FINISHED'}" in run.output
    line = next(line for line in run.output.splitlines() if "does not support these passes" in line)
    for name in ("Mist", "Emi", "Combined_keys", "Combined_rim", "tint", "amount", "Mirrors", "CryptoObject", "Technique Merging"):
        assert name in line, line
    assert {name for name, _ in channels_of(run.values("settings")["render"]["passes"])} == kept
    assert ("Error" in line) == (mode == "no_passes")


def test_passes_of_a_name_that_is_taken_are_left_out_by_name(run_blender, tmp_path):
    run = run_blender(
        PASSES
        + """
layer = bpy.context.view_layer
layer.use_pass_mist = True
for name in ('Mist', 'good', 'fine'):
    aov = layer.aovs.add(); aov.name = name
layer.lightgroups.add(name='keys')
for name in ('Combined', 'combined', 'Combined_keys', 'good', 'better', 'better', ''):
    path = layer.lambent.light_paths.add(); path.name = name
print('VALID', [aov.is_valid for aov in layer.aovs])
layer.use_pass_position = True
print('STILL', [aov.is_valid for aov in layer.aovs])
multilayer('names')
quad()
print(render(write_still=True))
"""
    )
    assert "{'FINISHED'}" in run.output, run.output
    assert "VALID [False, False, True]" in run.output and "STILL [False, False, True]" in run.output
    line = next(line for line in run.output.splitlines() if "have the name of another" in line)
    assert line.endswith("Mist, Combined, combined, Combined_keys, good, better")
    entries = run.values("settings")["render"]["passes"]
    names = ["Combined", *(entry["name"] for entry in entries[1:])]
    assert len(names) == len(set(names)) and {"Mist", "good", "Combined_keys", "better"} <= set(names)
    assert next(entry for entry in entries[1:] if entry["name"] == "Mist")["kind"] == "mist"
    layers, _ = multilayer.read(tmp_path / "names.exr", long_names=False)
    # Blender makes each pass that is registered; the one called as the wire calls the picture is reported and stays black.
    assert set(layers["ViewLayer"]) == {*names, "combined"} and not layers["ViewLayer"]["combined"].any()


def test_a_hundred_passes_arrive(run_blender, tmp_path):
    run = run_blender(
        PASSES
        + """
everything(bpy.context.view_layer); own_passes(bpy.context.view_layer)
for index in range(100):
    aov = bpy.context.view_layer.aovs.add(); aov.name, aov.type = f'number {index}', 'VALUE'
multilayer('many')
quad()
print(render(write_still=True))
"""
    )
    assert "{'FINISHED'}" in run.output, run.output
    places = [name for name, _ in channels_of(run.values("settings")["render"]["passes"])]
    layers, _ = multilayer.read(tmp_path / "many.exr", long_names=False)
    for index in range(100):
        assert (layers["ViewLayer"][f"number {index}"] == places.index(f"number {index}")).all()


def test_a_channel_that_nobody_asked_for_is_an_error_and_not_a_crash(run_blender):
    run = run_blender(
        """
quad()
try:
    render()
except RuntimeError as error:
    print('REFUSED', error)
""",
        mode="extra_channel",
    )
    assert "uninvited" in run.output.split("REFUSED ")[1], run.output


def test_vectors_are_also_of_the_world_where_blender_has_it_so(run_blender):
    run = run_blender("bpy.context.view_layer.use_pass_vector = True\nquad()\nrender()\nprint('WORLD', bpy.app.version >= (5, 2, 0))\n")
    vector = next(entry for entry in run.values("settings")["render"]["passes"][1:] if entry["kind"] == "vector")
    assert (vector.get("argument") == "world") == ("WORLD True" in run.output)


def test_viewports_and_previews_ask_for_combined_alone(run_blender):
    run = run_blender(
        """
from lambent.sync import passes, scene as scenes
layer = bpy.context.view_layer
layer.use_pass_mist = True
kinds = frozenset(('combined', 'mist'))
for preview in (True, False):
    view = scenes.View(8, 8, preview=preview, pass_kinds=kinds)
    print('PASSES', [entry.name for entry in scenes.wanted_passes(scene, layer, view)])
"""
    )
    assert "PASSES ['Combined']" in run.output and "PASSES ['Combined', 'Mist']" in run.output


def test_light_path_passes_are_added_and_removed_by_their_buttons(run_blender):
    run = run_blender(
        PASSES
        + """
for _ in range(3): bpy.ops.lambent.light_path_add()
chosen = bpy.context.view_layer.lambent
chosen.active_light_path = 1
bpy.ops.lambent.light_path_remove()
print('NAMES', [path.name for path in chosen.light_paths], chosen.active_light_path)
print('SOCKETS', [name for name, _ in sockets() if name.startswith('Light')])
bpy.ops.lambent.light_path_add()
print('AGAIN', [path.name for path in chosen.light_paths])
"""
    )
    assert "NAMES ['Light Path 1', 'Light Path 3'] 0" in run.output
    assert "SOCKETS ['Light Path 1', 'Light Path 3']" in run.output
    assert "AGAIN ['Light Path 1', 'Light Path 3', 'Light Path 2']" in run.output


def test_own_switches_count_where_they_are_set_and_cycles_where_not(run_blender):
    run = run_blender(
        """
layer = bpy.context.view_layer
layer.use_pass_z = False
render()
layer.cycles.pass_debug_sample_count = True
render()
layer.lambent.use_pass_sample_count = False
render()
layer.cycles.pass_debug_sample_count = False
layer.lambent.use_pass_sample_count = True
render()
"""
    )
    kinds = [["sample_count" in str(run.values("settings", count)["render"]["passes"])][0] for count in (1, 2, 3, 4)]
    assert kinds == [False, True, False, True]


def test_without_cycles_lambents_switches_stand_for_its(run_blender):
    run = run_blender(
        PASSES
        + """
import addon_utils
addon_utils.disable('cycles')
layer = bpy.context.view_layer
assert not hasattr(layer, 'cycles')
for name in ('volume_direct', 'volume_indirect', 'shadow_catcher', 'sample_count', 'denoising_data'):
    setattr(layer.lambent, 'use_pass_' + name, True)
quad()
print(render())
print('SOCKETS', repr(sockets()))
"""
    )
    assert "{'FINISHED'}" in run.output, run.output
    kinds = {entry["kind"] for entry in run.values("settings")["render"]["passes"][1:]}
    assert {"volume_direct", "volume_indirect", "shadow_catcher", "sample_count", "noisy", "denoising_normal"} <= kinds
    assert {"Shadow Catcher", "Debug Sample Count", "Noisy Image"} <= {name for name, _ in printed(run, "SOCKETS")}


def float_of(bits):
    return struct.unpack("<f", struct.pack("<I", bits))[0]


def test_cryptomatte_ids_are_the_specifications():
    # The values of the specification's own tests.
    expected = {"hello": 6.0705627102400005616e-17, "cube": -4.08461912519e15, "sphere": 2.79018604383e15, "plane": 3.66557617593e-11}
    for name, value in expected.items():
        assert float_of(cryptomatte.id_bits(name)) == pytest.approx(value, rel=1e-6)
    assert cryptomatte.murmur3(b"hello") == 0x248BFA47 and cryptomatte.murmur3(b"\xff\xff\xff\xff") == 0x76293B50
    assert cryptomatte.id_bits("") == 1 << 23  # a hash of 0 would be a denormal number


def test_cryptomattes_names_are_in_the_file_as_keyers_read_them(run_blender, tmp_path):
    run = run_blender(
        PASSES
        + """
layer = bpy.context.view_layer
layer.use_pass_cryptomatte_object = layer.use_pass_cryptomatte_material = layer.use_pass_cryptomatte_asset = True
parent = quad('Wagen "7"'); child = quad('Rad'); child.parent = parent
material, nodes, links = node_material('Läck')
child.data.materials.append(material)
lamp = add('lamp', bpy.data.lights.new('lamp', 'POINT'))
other = scene.view_layers.new('Nur Rad'); other.use_pass_cryptomatte_object = True
hidden = bpy.data.collections.new('hidden'); scene.collection.children.link(hidden)
scene.collection.objects.unlink(parent); hidden.objects.link(parent)
other.layer_collection.children['hidden'].exclude = True
multilayer('mattes')
render(write_still=True)
"""
    )
    assert run.code == 0, run.output
    _, attributes = multilayer.read(tmp_path / "mattes.exr")
    found = {}
    for name, value in attributes.items():
        if name.startswith("cryptomatte/"):
            _, key, field = name.split("/")
            found.setdefault(key, {})[field] = value
    expected = {
        "ViewLayer.CryptoObject": {'Wagen "7"', "Rad"},
        "ViewLayer.CryptoMaterial": {"default_surface", "Läck"},
        "ViewLayer.CryptoAsset": {'Wagen "7"'},
        "Nur Rad.CryptoObject": {"Rad"},
    }
    assert {fields["name"] for fields in found.values()} == set(expected)
    for key, fields in found.items():
        assert key == f"{cryptomatte.murmur3(fields['name'].encode()):08x}"[:7]
        assert (fields["hash"], fields["conversion"]) == ("MurmurHash3_32", "uint32_to_float32")
        names = json.loads(fields["manifest"])
        assert set(names) == expected[fields["name"]]
        assert all(bits == f"{cryptomatte.id_bits(name):08x}" for name, bits in names.items())
    objects = run.values("object", 1)
    assert objects["Rad"]["asset"] == 'Wagen "7"' and "asset" not in objects['Wagen "7"']


def test_files_say_how_a_layer_was_rendered(run_blender, tmp_path):
    run_blender(PASSES + "scene.lambent.seed, scene.lambent.samples = 5, 3\nquad()\nmultilayer('how')\nrender(write_still=True)\n")
    _, told = multilayer.read(tmp_path / "how.exr")
    assert told["lambent.ViewLayer.samples"] == "3" and told["lambent.ViewLayer.seed"] == "5"
    assert told["lambent.ViewLayer.version"] == "fake" and told["lambent.ViewLayer.integrator"] == "PT"
    assert float(told["lambent.ViewLayer.render_time"]) >= 0


def test_names_that_are_too_long_for_blenders_passes_are_cut_as_blender_cuts_them(run_blender, tmp_path):
    run = run_blender(
        PASSES
        + """
layer = bpy.context.view_layer
for index in range(3): layer.lightgroups.add(name='gruppe ' + 'ä' * 27 + str(index))
layer.lambent.use_pass_shadow_difference = layer.lambent.use_shadow_groups = True
quad()
print(render())
print('SOCKETS', repr(sockets()))
"""
    )
    assert "{'FINISHED'}" in run.output, run.output
    names = [entry["name"] for entry in run.values("settings")["render"]["passes"][1:]]
    assert all(len(name.encode()) <= 63 for name in names) and len(names) == len(set(names))
    # Of three groups whose passes have the same name once they are cut, one is left.
    assert sum(name.startswith("Shadow Difference_") for name in names) == 1
    assert set(names) <= {name for name, _ in printed(run, "SOCKETS")}
    assert "have the name of another" in run.output


def test_after_a_cancel_all_passes_are_waited_for_as_long_as_they_come(run_blender, tmp_path):
    run = run_blender(
        PASSES
        + """
import pathlib, threading, signal, time
quad()
scene.render.resolution_x, scene.render.resolution_y = 640, 400
scene.view_layers[0].use_pass_normal = True
def interrupt():
    record = pathlib.Path(os.environ["LAMBENT_FAKE_RECORD"])
    while not any(b"render_start" in path.read_bytes() for path in record.iterdir()):
        time.sleep(0.05)
    time.sleep(1.0)
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=interrupt, daemon=True).start()
render()
multilayer('kept')
bpy.data.images['Render Result'].save_render(scene.render.filepath + '.exr')
""",
        mode="slow_end",
        timeout=120,
    )
    (start,) = run.of_type("render_start")
    assert start["header"]["repeat_tiles"] is False
    layers, _ = multilayer.read(tmp_path / "kept.exr", long_names=False)
    for name in ("Combined", "Normal"):
        assert np.all(layers["ViewLayer"][name][..., 0] != 0), name
