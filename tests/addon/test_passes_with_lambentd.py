# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes with the built lambentd: what must add up, Cryptomatte through Blender's own keyer, the same numbers without Blender."""

import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import harness

sys.path.insert(0, os.path.join(harness.ROOT, "tests", "common"))
import multilayer  # noqa: E402

BIN = pathlib.Path(os.environ.get("LAMBENT_BUILD_DIR") or os.path.join(harness.ROOT, "build", "release")) / "bin"
LAMBENTD, LAMBENT = BIN / "lambentd", BIN / "lambent"

# The scene of tests/scenes/make_passes.py in small; multilayer(name) has renders write all passes.
SCENE = f"""
import os, sys, runpy
FOLDER = os.environ['LAMBENT_TEST_DIR']
sys.argv = [sys.argv[0], '--', os.path.join(FOLDER, 'passes.blend')]
runpy.run_path({os.path.join(harness.ROOT, "tests", "scenes", "make_passes.py")!r})
scene = bpy.context.scene
layer = scene.view_layers['ViewLayer']
scene.render.engine = 'LAMBENT'
scene.render.resolution_x, scene.render.resolution_y = 80, 48
scene.lambent.samples = 16
def multilayer(name):
    settings = scene.render.image_settings
    if hasattr(settings, 'media_type'): settings.media_type = 'MULTI_LAYER_IMAGE'
    settings.file_format, settings.color_depth, settings.exr_codec = 'OPEN_EXR_MULTILAYER', '32', 'ZIP'
    scene.render.filepath = os.path.join(FOLDER, name)
def paths():
    for name, expression in (('Seen', 'CL'), ('Reflected', 'C<R.>.*L'), ('Transmitted', 'C<T.>.*L')):
        path = layer.lambent.light_paths.add(); path.name, path.expression = name, expression
def techniques():
    for name in ('unidirectional', 'connection', 'merging'): setattr(layer.lambent, 'use_pass_technique_' + name, True)
"""
# Relative error of sums of a dozen 24-bit numbers.
ROUNDING = 1e-5


@pytest.fixture
def run_passes(run_blender):
    """run_blender with the built lambentd and the scene."""
    for program in (LAMBENTD, LAMBENT):
        if not os.access(program, os.X_OK):
            pytest.skip(f"no {program}: build it or set LAMBENT_BUILD_DIR")
    return lambda script, **options: run_blender(SCENE + script, daemon=LAMBENTD, **options)


def left_out(run):
    """The names, as Blender 5 has them, of the passes that a run of Blender said its daemon does not support."""
    line = next((line for line in run.output.splitlines() if "does not support these passes" in line), ": ")
    names = line.rpartition(": ")[2].split(", ")
    return {multilayer.k_long_names.get(name, name) for name in names if name}


def assert_adds_up(total, passes, what, film_transparent=True):
    """That a sum of passes, float[height][width][3], is Combined but for rounding."""
    error = multilayer.sum_error(total, passes, film_transparent)
    assert error.max() <= ROUNDING, f"{what}: off by {error.max():.2g} of Combined at {np.unravel_index(error.argmax(), error.shape)}"


@pytest.mark.parametrize("integrator", ["PT", "LT", "VPL", "BPT", "PPM", "BPM", "VCM"])
@pytest.mark.parametrize("film_transparent", [False, True])
def test_light_passes_and_light_groups_add_up_to_combined(run_passes, tmp_path, integrator, film_transparent):
    run = run_passes(f"scene.render.film_transparent = {film_transparent}\nscene.lambent.integrator = {integrator!r}\ntechniques()\npaths()\nmultilayer('sums')\nrender(write_still=True)\n")
    assert run.code == 0, run.output
    passes = multilayer.read(tmp_path / "sums.exr")[0]["ViewLayer"]
    assert passes["Combined"][..., :3].mean() > 0.05
    assert_adds_up(multilayer.light_sum(passes), passes, "light passes", film_transparent)
    assert_adds_up(multilayer.group_sum(passes), passes, "light groups", film_transparent)
    # What is seen of the world through a transparent film is in no expression, as it is not in the picture.
    kinds = [passes[name].astype(np.float64) for name in ("Seen", "Reflected", "Transmitted")]
    assert_adds_up(sum(kinds), passes, "light path expressions", film_transparent=False)
    assert kinds[1].max() > 0.1 and (integrator == "VPL" or kinds[2].max() > 0.01)
    if integrator in ("BPT", "VCM"):
        parts = [passes[f"Technique {name}"].astype(np.float64) for name in ("Unidirectional", "Connection", "Merging")]
        # What is seen of the world through a transparent film is in no technique, as it is not in the picture.
        assert_adds_up(sum(parts), passes, "techniques", film_transparent=False)
        assert (parts[2].max() > 0) == (integrator == "VCM")


def test_data_passes_hold_what_is_in_front_of_the_camera(run_passes, tmp_path):
    run = run_passes(
        """
multilayer('data')
render(write_still=True)
from bpy_extras.object_utils import world_to_camera_view
for name in ('Diffuse', 'Glossy', 'Coated', 'Glass'):
    ob = bpy.data.objects[name]
    toward = (scene.camera.matrix_world.translation - ob.matrix_world.translation).normalized()
    point = ob.matrix_world.translation + 0.5 * toward
    x, y, z = world_to_camera_view(scene, scene.camera, point)
    print('POINT', name, ob.pass_index, ob.active_material.pass_index, x, y, z, *point, *toward)
"""
    )
    assert run.code == 0, run.output
    passes = multilayer.read(tmp_path / "data.exr")[0]["ViewLayer"]
    height, width = passes["Combined"].shape[:2]
    lines = [line.split()[1:] for line in run.output.splitlines() if line.startswith("POINT")]
    assert len(lines) == 4
    for name, object_index, material_index, *numbers in lines:
        x, y, depth, *point_and_normal = map(float, numbers)
        place = int(y * height), int(x * width)
        assert passes["Object Index"][place][0] == float(object_index), name
        assert passes["Material Index"][place][0] == float(material_index), name
        # A pixel is 0.04 m wide where the balls are, and their fronts bulge by less.
        assert passes["Depth"][place][0] == pytest.approx(depth, abs=0.05)
        assert np.allclose(passes["Position"][place], point_and_normal[:3], atol=0.1)
        assert np.allclose(passes["Normal"][place], point_and_normal[3:], atol=0.2)


def test_blenders_cryptomatte_node_extracts_what_an_object_covers(run_passes, tmp_path):
    run = run_passes(
        """
scene.view_layers['Masked'].use = False
multilayer('mattes')
five = hasattr(scene, 'compositing_node_group')
if five:
    scene.compositing_node_group = bpy.data.node_groups.new('comp', 'CompositorNodeTree')
    tree = scene.compositing_node_group
else:
    scene.use_nodes = True
    tree = scene.node_tree
    tree.nodes.clear()
scene.render.use_compositing = True
output = tree.nodes.new('CompositorNodeOutputFile')
names = ('Glossy', 'Veil', 'Floor')
if five:
    output.directory = FOLDER
    output.file_name = 'matte_'
    output.format.media_type = 'IMAGE'
else:
    output.base_path = FOLDER
    output.file_slots.clear()
output.format.file_format, output.format.color_depth = 'OPEN_EXR', '32'
layers = tree.nodes.new('CompositorNodeRLayers')
layers.scene, layers.layer = scene, 'ViewLayer'
if not five: tree.links.new(layers.outputs['Image'], tree.nodes.new('CompositorNodeComposite').inputs[0])
render()  # Cryptomatte nodes list the mattes of the last render.
for name in names:
    node = tree.nodes.new('CompositorNodeCryptomatteV2')
    node.source, node.scene = 'RENDER', scene
    node.layer_name = 'ViewLayer.CryptoObject'
    node.matte_id = name
    if five:
        output.file_output_items.new('FLOAT', name)
        tree.links.new(node.outputs['Matte'], output.inputs[name])
    else:
        output.file_slots.new(name)
        tree.links.new(node.outputs['Matte'], output.inputs[-1])
render(write_still=True)
print('FILES', sorted(os.listdir(FOLDER)))
"""
    )
    assert run.code == 0, run.output
    layers, attributes = multilayer.read(tmp_path / "mattes.exr")
    ids = multilayer.manifest(attributes, "ViewLayer", "CryptoObject")
    for name in ("Glossy", "Veil", "Floor"):
        file = next(path for path in tmp_path.iterdir() if path.name.endswith(".exr") and name in path.name)
        matte = next(iter(multilayer.read(file)[0].values()))
        matte = next(iter(matte.values()))[..., 0]
        covered = multilayer.coverage(layers["ViewLayer"], "CryptoObject", ids[name])
        assert covered.max() > 0.3 and 0.01 < covered.mean() < 0.9
        assert np.allclose(matte, covered, atol=1e-6), name


def test_mattes_cover_what_alpha_says(run_passes, tmp_path):
    run = run_passes("multilayer('alpha')\nrender(write_still=True)\n")
    assert run.code == 0, run.output
    layers, attributes = multilayer.read(tmp_path / "alpha.exr")
    passes = layers["ViewLayer"]
    for kind in ("CryptoObject", "CryptoMaterial", "CryptoAsset"):
        ids = multilayer.manifest(attributes, "ViewLayer", kind)
        total = sum(multilayer.coverage(passes, kind, identity) for identity in set(ids.values()))
        # What is half transparent covers by chance, alpha without.
        opaque = multilayer.coverage(passes, "CryptoMaterial", multilayer.manifest(attributes, "ViewLayer", "CryptoMaterial")["Veil"]) == 0
        assert opaque.mean() > 0.9 and np.allclose(total[opaque], passes["Combined"][opaque][..., 3], atol=1e-5), kind
    # The hole of the second layer is as large as the object, and neither light nor alpha is in it.
    hole = multilayer.coverage(passes, "CryptoObject", multilayer.manifest(attributes, "ViewLayer", "CryptoObject")["Coated"])
    assert not layers["Masked"]["Combined"][hole >= 1.0 - 1e-6].any() and (hole >= 1.0 - 1e-6).sum() > 20
    # What the camera does not see there lights the rest all the same.
    assert not layers["Masked"]["Emission"].any() and passes["Emission"].max() > 1


def test_mattes_of_objects_and_collections_are_what_cryptomatte_says(run_passes, tmp_path):
    run = run_passes(
        """
scene.view_layers['Masked'].use = False
for name, thing, collection in (('ball', 'Glossy', None), ('both', 'Veil', 'Hole'), ('nobody', None, None)):
    matte = layer.lambent.mattes.add(); matte.name = name
    if thing: matte.object = bpy.data.objects[thing]
    if collection: matte.collection = bpy.data.collections[collection]
multilayer('covers')
render(write_still=True)
"""
    )
    assert run.code == 0, run.output
    layers, attributes = multilayer.read(tmp_path / "covers.exr")
    passes, ids = layers["ViewLayer"], multilayer.manifest(attributes, "ViewLayer", "CryptoObject")
    for name, things in (("ball", ["Glossy"]), ("both", ["Veil", "Coated"]), ("nobody", [])):
        expected = sum((multilayer.coverage(passes, "CryptoObject", ids[thing]) for thing in things), np.zeros(passes["ball"].shape[:2]))
        assert np.allclose(passes[name][..., 0], expected, atol=1e-5), name
        assert not things or expected.mean() > 0.01


def test_the_exported_scene_has_the_same_numbers_without_blender(run_passes, tmp_path):
    run = run_passes(
        """
scene.view_layers['Masked'].use = False
# Blender sums smooth normals in an order that differs from evaluation to evaluation, and with it their last bits.
for mesh in bpy.data.meshes: mesh.polygons.foreach_set('use_smooth', [False] * len(mesh.polygons))
for name in ('caustics_direct', 'caustics_indirect', 'error'): setattr(layer.lambent, 'use_pass_' + name, True)
path = layer.lambent.light_paths.add(); path.name, path.expression = 'Mirrors', 'C<RS>.*L'
multilayer('blender')
render(write_still=True)
multilayer('half')
scene.render.image_settings.color_depth = '16'
render(write_still=True)
bpy.context.window.view_layer = layer
print('EXPORTED', bpy.ops.lambent.scene_export(filepath=os.path.join(FOLDER, 'saved.lambent')))
"""
    )
    assert "EXPORTED {'FINISHED'}" in run.output, run.output
    picture = tmp_path / "saved.exr"
    subprocess.run([LAMBENT, "render", tmp_path / "saved.lambent", "-o", picture, "--quiet"], check=True, timeout=120)
    in_blender, attributes = multilayer.read(tmp_path / "blender.exr")
    without, own_attributes = multilayer.read(picture)
    (without,) = without.values()
    in_blender = in_blender["ViewLayer"]
    assert set(in_blender) - set(without) == left_out(run) and len(without) > 40
    for name, pixels in without.items():
        assert np.array_equal(pixels, in_blender[name], equal_nan=True), name
    # In half too, which leaves what is no colour as it was.
    subprocess.run([LAMBENT, "render", tmp_path / "saved.lambent", "-o", tmp_path / "half_saved.exr", "--half", "--quiet"], check=True, timeout=120)
    blenders_half = multilayer.read(tmp_path / "half.exr")[0]["ViewLayer"]
    (own_half,) = multilayer.read(tmp_path / "half_saved.exr")[0].values()
    for name, pixels in own_half.items():
        assert np.array_equal(pixels, blenders_half[name], equal_nan=True), name
        data = name in ("Depth", "Position", "Vector", "Normal", "UV", "Mist") or "Index" in name or name.startswith("Crypto")
        assert not data or np.array_equal(pixels, without[name], equal_nan=True), name
    assert not np.array_equal(own_half["Combined"], without["Combined"])
    assert not np.array_equal(own_half["Diffuse Direct"], without["Diffuse Direct"])
    for kind in ("CryptoObject", "CryptoMaterial", "CryptoAsset"):
        expected = multilayer.manifest(attributes, "ViewLayer", kind)
        layer = "ViewLayer" if any(value == f"ViewLayer.{kind}" for value in own_attributes.values()) else ""
        assert multilayer.manifest(own_attributes, layer, kind) == expected


def test_an_expression_that_is_none_is_named_and_the_other_passes_are_right(run_passes, tmp_path):
    run = run_passes(
        """
scene.view_layers['Masked'].use = False
for name, expression in (('Everything', 'C.*L'), ('Broken', 'C<<L'), ('Nothing', '')):
    path = layer.lambent.light_paths.add(); path.name, path.expression = name, expression
multilayer('broken')
scene.render.film_transparent = False
print('RESULT', render(write_still=True))
"""
    )
    assert "RESULT {'FINISHED'}" in run.output, run.output
    assert any("Broken" in line and "Lambent" in line for line in run.output.splitlines()), run.output
    passes = multilayer.read(tmp_path / "broken.exr")[0]["ViewLayer"]
    assert passes["Combined"][..., :3].max() > 0
    assert_adds_up(passes["Everything"].astype(np.float64), passes, "C.*L", film_transparent=False)


def test_a_layer_with_nothing_in_it_has_all_its_passes_empty(run_passes, tmp_path):
    run = run_passes(
        """
scene.view_layers['Masked'].use = False
for ob in list(bpy.data.objects):
    if ob.type != 'CAMERA': bpy.data.objects.remove(ob)
multilayer('empty')
print('RESULT', render(write_still=True))
"""
    )
    assert "RESULT {'FINISHED'}" in run.output, run.output
    passes = multilayer.read(tmp_path / "empty.exr")[0]["ViewLayer"]
    for name in set(passes) - left_out(run):
        pixels = passes[name]
        assert np.isfinite(pixels).all(), name
        if name not in ("Depth", "Denoising Depth", "Mist", "Debug Sample Count", "Environment", "Combined_sky", "Shadow Catcher", "Noisy Shadow Catcher", "Denoising Albedo"):
            # From Blender 5.2 on the world moves too: by rounding alone where the camera does not.
            assert abs(pixels).max() <= (1e-4 if name == "Vector" else 0.0), name
    # As Cycles has it where nothing was hit.
    assert (passes["Depth"] > 1e9).all() and (passes["Mist"] == 1).all()


def test_seventy_aovs_beside_all_other_passes_are_right(run_passes, tmp_path):
    run = run_passes(
        """
scene.view_layers['Masked'].use = False
nodes = bpy.data.materials['Floor'].node_tree.nodes
for index in range(70):
    aov = layer.aovs.add(); aov.name, aov.type = f'number {index}', 'VALUE'
    node = nodes.new('ShaderNodeOutputAOV')
    if hasattr(node, 'aov_name'): node.aov_name = f'number {index}'
    else: node.name = f'number {index}'
    node.inputs['Value'].default_value = index + 1
multilayer('many')
print('RESULT', render(write_still=True))
"""
    )
    assert "RESULT {'FINISHED'}" in run.output, run.output
    layers, attributes = multilayer.read(tmp_path / "many.exr")
    passes = layers["ViewLayer"]
    floor = multilayer.coverage(passes, "CryptoObject", multilayer.manifest(attributes, "ViewLayer", "CryptoObject")["Floor"])
    whole = floor >= 1.0 - 1e-6
    assert whole.sum() > 50
    for index in range(70):
        assert np.allclose(passes[f"number {index}"][whole], index + 1, rtol=1e-5), index
