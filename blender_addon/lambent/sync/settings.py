# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Render settings: scene.lambent, and for what was never set there, what the scene says for Cycles."""

from . import compat, passes

# Our settings that follow one of Cycles while they are not set: {ours: Cycles'}.
_CYCLES_NAMES = {
    "samples": "samples",
    "time_limit": "time_limit",
    "seed": "seed",
    "animated_seed": "use_animated_seed",
    "max_bounces": "max_bounces",
    "diffuse_bounces": "diffuse_bounces",
    "glossy_bounces": "glossy_bounces",
    "transmission_bounces": "transmission_bounces",
    "transparent_bounces": "transparent_max_bounces",
    "volume_bounces": "volume_bounces",
    "pixel_filter": "pixel_filter_type",
    "filter_width": "filter_width",
    "film_exposure": "film_exposure",
    "film_transparent_glass": "film_transparent_glass",
    "film_transparent_roughness": "film_transparent_roughness",
    "light_threshold": "light_sampling_threshold",
    "caustics_reflective": "caustics_reflective",
    "caustics_refractive": "caustics_refractive",
    "preview_samples": "preview_samples",
}
# Settings that the wire calls as scene.lambent does.
_SAME_NAMES = (
    "clamp_direct",
    "clamp_indirect",
    "light_threshold",
    "caustics_reflective",
    "caustics_refractive",
    "merge_alpha",
    "shared_light_paths",
    "clamp_connection",
)
# Cycles' box filter is one pixel wide whatever its width says.
_BOX_WIDTH_PX = 1.0
# Added to the seed for each frame where the seed is animated; odd and large, so that frames share no sequence.
_SEED_STEP = 0x9E3779B1


def followed(scene, name):
    """The name of Cycles' setting that stands for scene.lambent.<name>, or None where the scene's own value counts."""
    if scene.lambent.is_property_set(name) or not could_follow(scene, name):
        return None
    return _CYCLES_NAMES[name]


def could_follow(scene, name):
    """Whether scene.lambent.<name> would follow a setting that the scene has for Cycles, were it not set."""
    cycles_name = _CYCLES_NAMES.get(name)
    cycles = getattr(scene, "cycles", None)
    return cycles_name is not None and hasattr(cycles, cycles_name) and cycles.is_property_set(cycles_name)


def effective(scene, name):
    """The value of a setting: set in scene.lambent, else set for Cycles, else Lambent's default."""
    if name == "filter_width" and not scene.lambent.is_property_set(name) and effective(scene, "pixel_filter") == "BOX":
        return _BOX_WIDTH_PX
    cycles_name = followed(scene, name)
    return getattr(scene.lambent, name) if cycles_name is None else getattr(scene.cycles, cycles_name)


def seed(scene):
    """The seed of the frame that a scene is at."""
    chosen = effective(scene, "seed")
    return (chosen + scene.frame_current * _SEED_STEP) & 0x7FFFFFFF if effective(scene, "animated_seed") else chosen


def export_settings(edits, scene, view_layer, view, camera, world, wanted_passes, shown_world):
    """Puts the settings of an evaluated scene seen through view (scene.View).

    camera, world: ids, or None. wanted_passes: [passes.RenderPass]. shown_world: the world (evaluated) or None.
    """
    prefix = "preview_" if view.preview else ""
    value = {
        "width": view.width,
        "height": view.height,
        "pixel_aspect": view.pixel_aspect,
        "camera": camera,
        "world": world,
        "integrator": effective(scene, prefix + "integrator"),
        "samples": _samples(scene, view_layer, prefix),
        "time_limit_s": effective(scene, prefix + "time_limit"),
        "noise_threshold": effective(scene, prefix + "noise_threshold"),
        "seed": seed(scene),
        "merge_radius_px": effective(scene, "merge_radius"),
        "film_transparent": scene.render.film_transparent,
        "exposure": effective(scene, "film_exposure"),
        "pixel_filter": effective(scene, "pixel_filter"),
        "filter_width_px": effective(scene, "filter_width"),
        "tile_size_px": scene.lambent.tile_size,
        "threads": scene.render.threads if scene.render.threads_mode == "FIXED" else 0,
        "frame": scene.frame_current,
        **passes.settings(wanted_passes, view_layer, shown_world),
        "metadata": {"Scene": scene.name, "ViewLayer": view_layer.name, "Frame": str(scene.frame_current)},
    }
    for name in ("max", "diffuse", "glossy", "transmission", "transparent", "volume"):
        value[f"{name}_bounces"] = effective(scene, f"{name}_bounces")
    for name in _SAME_NAMES:
        value[name] = effective(scene, name)
    if scene.render.film_transparent and effective(scene, "film_transparent_glass"):
        # Else nothing, so that older daemons have nothing to report.
        value["film_transparent_glass"] = True
        value["film_transparent_roughness"] = effective(scene, "film_transparent_roughness")
    if view.region is not None:
        value["region"] = list(view.region)
    if view.sample_limit and (value["samples"] == 0 or value["samples"] > view.sample_limit):
        value["samples"] = view.sample_limit
    color_management = compat.color_management_path()
    if color_management and view.local_daemon:
        value["ocio_config"] = color_management
        if compat.working_space():
            value["working_space"] = compat.working_space()
    edits.put("settings", "render", value)


def _samples(scene, view_layer, prefix):
    if not prefix and view_layer.samples > 0:
        # Cycles' meaning of a view layer's own sample count, by its switch where Cycles is there to have one.
        use = getattr(getattr(scene, "cycles", None), "use_layer_samples", "USE")
        samples = effective(scene, "samples")
        if use == "USE" or use == "BOUNDED" and (samples == 0 or view_layer.samples < samples):
            return view_layer.samples
    return effective(scene, prefix + "samples")
