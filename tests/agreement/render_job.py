# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside Blender: renders the open scene with one engine, several times, with the settings that make engines
comparable.

    blender -b --factory-startup SCENE.blend --python-exit-code 1 --python render_job.py -- JOB.json

JOB.json: {"engine": "CYCLES" | "LAMBENT", "daemon": path, "width": px, "height": px or null (as the scene's aspect),
"samples": n, "seeds": [n..], "out": prefix, "variant": "" | a name in k_variants, "settings": {name: value of the engine's},
"layers": false, "layer_settings": {name: value of the first view layer's lambent}, "passes": null | [the protocol's kinds of
passes that the first view layer asks for, "aovs" and "light_groups"], "balance": {light group: factor for all its lights},
"shadow_objects": [names of objects whose shadows passes take away], "mattes": [names of objects that are mattes], "removed": [names
of objects that are not there], "camera_only": [names of objects that nothing but the camera sees], "export": null | path of a saved
scene to write before rendering}. Writes PREFIX<seed>.exr (float32, scene-linear; RGBA of
the first view layer, or with "layers" every pass of every layer) for each seed and PREFIXresult.json: {"blender": version, "size": [w, h], "seconds": [wall time of each render],
"statistics": [what lambentd said of each render]}. Prints `render_job: start SEED` and `render_job: end SEED` around each
render, and `render_job: pixels` when the first tile of Lambent's is in Blender.

Nothing here makes one engine better than the other: adaptive sampling, denoising, clamping, glossy filtering, light
thresholds and roulette-free shortcuts are off, bounces equal, and Cycles' terminator offsets, which move shadows, zero.
"""

import json
import sys
import time

import addon_utils
import bpy

k_bounces = {
    # Cycles' name: (Lambent's name, value)
    "max_bounces": ("max_bounces", 12),
    "diffuse_bounces": ("diffuse_bounces", 4),
    "glossy_bounces": ("glossy_bounces", 4),
    "transmission_bounces": ("transmission_bounces", 12),
    "transparent_max_bounces": ("transparent_bounces", 8),
    "volume_bounces": ("volume_bounces", 0),
}
k_cycles = {
    "device": "CPU",
    "feature_set": "SUPPORTED",
    "use_adaptive_sampling": False,
    "use_denoising": False,
    "sample_clamp_direct": 0.0,
    "sample_clamp_indirect": 0.0,
    "blur_glossy": 0.0,
    "light_sampling_threshold": 0.01,
    "caustics_reflective": True,
    "caustics_refractive": True,
    "use_fast_gi": False,
    "use_light_tree": True,  # from 3.5 on
    "use_guiding": False,
    "min_light_bounces": 0,
    "min_transparent_bounces": 0,
    "time_limit": 0.0,
    "use_auto_tile": False,
    "film_exposure": 1.0,
    "pixel_filter_type": "BLACKMAN_HARRIS",
    "filter_width": 1.5,
    "sample_offset": 0,
    "use_animated_seed": False,
    "debug_use_spatial_splits": False,
}
k_lambent = {
    "integrator": "PT",
    "time_limit": 0.0,
    "noise_threshold": 0.0,
    "clamp_direct": 0.0,
    "clamp_indirect": 0.0,
    "light_threshold": 0.01,
    "caustics_reflective": True,
    "caustics_refractive": True,
    "pixel_filter": "BLACKMAN_HARRIS",
    "filter_width": 1.5,
    "film_exposure": 1.0,
    "animated_seed": False,
}


def assign(group, values):
    """Sets those of the values that this version of Blender has."""
    for name, value in values.items():
        if hasattr(group, name):
            setattr(group, name, value)


def relight(scene):
    """Gives a scene made for another engine, black in Cycles, matte materials, a sky and a sun, so that its camera and
    its objects can be compared."""
    for index, material in enumerate(bpy.data.materials):
        material.use_nodes = True
        nodes = material.node_tree.nodes
        nodes.clear()
        diffuse = nodes.new("ShaderNodeBsdfDiffuse")
        diffuse.inputs["Color"].default_value = (0.3 + 0.1 * (index % 5), 0.5, 0.7 - 0.1 * (index % 5), 1.0)
        material.node_tree.links.new(diffuse.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    world = bpy.data.worlds.new("Relit")
    world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (0.3, 0.4, 0.6, 1.0)
    scene.world = world
    sun = bpy.data.lights.new("Relit", "SUN")
    sun.energy, sun.angle = 2.0, 0.1
    placed = bpy.data.objects.new("Relit", sun)
    placed.rotation_euler = (0.7, 0.3, 0.4)
    scene.collection.objects.link(placed)


def node_trees():
    """All shader node trees of the file."""
    yield from (material.node_tree for material in bpy.data.materials if material.node_tree)
    yield from (group for group in bpy.data.node_groups if group.bl_idname == "ShaderNodeTree")


def plain_ggx(scene):
    """Has every microfacet node scatter once, where Cycles' default walks within the microsurface."""
    for tree in node_trees():
        for node in tree.nodes:
            if getattr(node, "distribution", "") == "MULTI_GGX":
                node.distribution = "GGX"


def rebalance(scene, factors):
    """Multiplies what the lamps, emissive materials and the world of each light group give by the group's factor."""
    for thing in scene.objects:
        factor = factors.get(thing.lightgroup, 1.0)
        if thing.type == "LIGHT":
            thing.data.energy *= factor
        elif thing.lightgroup in factors:
            for slot in thing.material_slots:
                scale_strengths(slot.material.node_tree, "ShaderNodeEmission", factor)
    scale_strengths(scene.world.node_tree, "ShaderNodeBackground", factors.get(scene.world.lightgroup, 1.0))


def scale_strengths(tree, node_type, factor):
    for node in tree.nodes:
        if node.bl_idname == node_type:
            node.inputs["Strength"].default_value *= factor


k_variants = {"relit": relight, "plain_ggx": plain_ggx}


def prepare(scene, job):
    """Gives the scene the job's size, engine and sampling, for either engine alike."""
    render = scene.render
    height = job["height"] or round(job["width"] * render.resolution_y / render.resolution_x)
    render.resolution_x, render.resolution_y, render.resolution_percentage = job["width"], height, 100
    render.use_border = render.use_compositing = render.use_sequencer = render.use_motion_blur = False
    render.use_simplify = render.use_persistent_data = render.use_multiview = False
    render.use_file_extension = True
    for layer in scene.view_layers[1:]:
        layer.use = bool(job.get("layers"))
    scene.view_layers[0].use = True

    if job["variant"]:
        k_variants[job["variant"]](scene)
    if job.get("balance"):
        rebalance(scene, job["balance"])
    for name in job.get("removed", ()):
        scene.objects[name].hide_render = True
    for name in job.get("camera_only", ()):
        for kind in ("diffuse", "glossy", "transmission", "shadow"):
            setattr(scene.objects[name], f"visible_{kind}", False)
    assign(scene.cycles, k_cycles)
    if scene.world:
        if hasattr(scene.world.light_settings, "use_ambient_occlusion"):  # before Blender 5
            scene.world.light_settings.use_ambient_occlusion = False
    for thing in bpy.data.objects:
        assign(thing.cycles, {"shadow_terminator_offset": 0.0, "shadow_terminator_geometry_offset": 0.0})
        assign(thing, {"shadow_terminator_shading_offset": 0.0, "shadow_terminator_geometry_offset": 0.0})
    scene.cycles.samples = job["samples"]
    for cycles_name, (_, value) in k_bounces.items():
        setattr(scene.cycles, cycles_name, value)

    if job["engine"] == "LAMBENT":
        addon_utils.enable("lambent", default_set=True)
        if not hasattr(scene, "lambent"):
            raise RuntimeError("the add-on 'lambent' could not be enabled: see above")
        bpy.context.preferences.addons["lambent"].preferences.daemon_path = job["daemon"]
        assign(scene.lambent, k_lambent)
        scene.lambent.samples = job["samples"]
        for lambent_name, value in k_bounces.values():
            setattr(scene.lambent, lambent_name, value)
        assign(scene.lambent, job.get("settings", {}))
        assign(scene.view_layers[0].lambent, job.get("layer_settings", {}))
        for name in job.get("shadow_objects", ()):
            if name in scene.objects:
                scene.objects[name].lambent.shadow_pass = True
        for name in job.get("mattes", ()):
            scene.objects[name].is_shadow_catcher = scene.objects[name].lambent.matte = True
    else:
        assign(scene.cycles, job.get("settings", {}))
    render.engine = job["engine"]


def ask_for(layer, kinds):
    """Has a view layer ask for passes of some kinds and for no other; Lambent's add-on must be enabled."""
    from lambent.sync import passes

    for kind in passes.kinds():
        setattr(*passes.switch(layer, kind), False)
    for kind in kinds:
        if kind not in ("aovs", "light_groups"):
            setattr(*passes.switch(layer, kind), True)
    # Blender removes these by operators alone, which act on the window's layer.
    bpy.context.window.view_layer = layer
    while "aovs" not in kinds and len(layer.aovs):
        bpy.ops.scene.view_layer_remove_aov()
    while "light_groups" not in kinds and len(layer.lightgroups):
        bpy.ops.scene.view_layer_remove_lightgroup()


def watch_lambent(statistics):
    """Has the add-on tell when pixels arrive, and keeps the daemon's statistics of each render in a list, with the "components"
    of a pixel in the last tile."""
    from lambent.render import final

    write, finish = final.ResultWriter.write, final._LayerRender._finish
    latest = {}

    def tell_and_write(self, rect, channels):
        latest["components"] = sum(pixels.shape[2] for pixels in channels.values())
        if not getattr(self, "told", False):
            self.told = True
            print("render_job: pixels", flush=True)
        return write(self, rect, channels)

    def keep_and_finish(self, done, *arguments):
        statistics.append({**done.get("statistics", {}), **latest})
        return finish(self, done, *arguments)

    final.ResultWriter.write, final._LayerRender._finish = tell_and_write, keep_and_finish


def choose_format(scene, layers):
    """Whole numbers of 32 bits: a picture, or all passes of all layers."""
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):  # from Blender 5.0 on, and before the format
        settings.media_type = "MULTI_LAYER_IMAGE" if layers else "IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER" if layers else "OPEN_EXR"
    settings.color_depth, settings.exr_codec = "32", "ZIP"
    if not layers:
        settings.color_mode = "RGBA"


def save(scene, path):
    """Writes what was rendered last as a picture."""
    choose_format(scene, layers=False)
    bpy.data.images["Render Result"].save_render(path, scene=scene)


def main():
    with open(sys.argv[sys.argv.index("--") + 1], encoding="utf-8") as file:
        job = json.load(file)
    scene = bpy.context.scene
    prepare(scene, job)
    if job.get("passes") is not None:
        ask_for(scene.view_layers[0], job["passes"])
    if job.get("export"):
        bpy.ops.lambent.scene_export(filepath=job["export"])
    layers = bool(job.get("layers"))
    choose_format(scene, layers)
    seconds, statistics = [], []
    if job["engine"] == "LAMBENT":
        watch_lambent(statistics)
    for seed in job["seeds"]:
        (scene.lambent if job["engine"] == "LAMBENT" else scene.cycles).seed = seed
        print(f"render_job: start {seed}", flush=True)
        start = time.monotonic()
        # Only a render itself writes all layers; else saving is no part of the time.
        scene.render.filepath = f"{job['out']}{seed}.exr"
        bpy.ops.render.render(write_still=layers)  # raises when the engine reports an error
        seconds.append(time.monotonic() - start)
        print(f"render_job: end {seed}", flush=True)
        if not layers:
            save(scene, scene.render.filepath)
    size = [scene.render.resolution_x, scene.render.resolution_y]
    result = {"blender": bpy.app.version_string, "size": size, "seconds": seconds, "statistics": statistics}
    with open(f"{job['out']}result.json", "w", encoding="utf-8") as file:
        json.dump(result, file)


if __name__ == "__main__":
    main()
