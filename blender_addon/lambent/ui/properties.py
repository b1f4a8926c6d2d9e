# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""scene.lambent: the settings that other programs rely on by name (ARCHITECTURE.md)."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty

# Files keep the number. What a daemon does not have is not offered (integrator_menus.py), but stays a valid value.
INTEGRATORS = (
    ("PT", "Path Tracing", "From the camera, with next event estimation and multiple importance sampling", 0),
    ("LT", "Light Tracing", "From the lamps, connected to the lens: caustics seen directly, but nothing through glass", 1),
    ("VPL", "Virtual Point Lights", "Light paths that all pixels share: smooth early, splotchy in corners", 2),
    ("BPT", "Bidirectional Path Tracing", "From both ends: rooms lit indirectly, caustics", 3),
    ("PPM", "Progressive Photon Mapping", "Photons gathered near what the camera sees: caustics through glass", 4),
    ("BPM", "Bidirectional Photon Mapping", "Photons gathered along the whole camera path, weighted", 5),
    ("VCM", "Vertex Connection and Merging", "Bidirectional path tracing and photon mapping in one: all light", 6),
)
MERGING = ("PPM", "BPM", "VCM")
_FILTERS = (
    ("BOX", "Box", "A pixel's own samples only"),
    ("GAUSSIAN", "Gaussian", "Soft"),
    ("BLACKMAN_HARRIS", "Blackman-Harris", "Smooth and sharp"),
)


def _samples(default, where):
    return IntProperty(
        name="Samples", description=f"Samples a pixel {where}; 0 is unlimited", default=default, min=0, max=1 << 24
    )


def _time_limit(where):
    return FloatProperty(
        name="Time Limit",
        description=f"Seconds after which {where} stops; 0 is no limit",
        default=0.0,
        min=0.0,
        step=100,
        unit="TIME_ABSOLUTE",
    )


def _noise_threshold(where):
    return FloatProperty(
        name="Noise Threshold",
        description=f"Relative noise at which a pixel is done {where}; 0 is off",
        default=0.0,
        min=0.0,
        max=1.0,
        precision=4,
    )


def _bounces(name, default):
    return IntProperty(name=name, description="Largest number of bounces of that kind", default=default, min=0, max=1024)


def _clamp(name):
    return FloatProperty(
        name=name, description="Largest value of a sample; loses light. 0 is off", default=0.0, min=0.0, max=1e8
    )


class LambentSettings(bpy.types.PropertyGroup):
    """Settings of a scene. What was never set follows the scene's settings for Cycles (sync/settings.py)."""

    integrator: EnumProperty(name="Integrator", description="How light is found", items=INTEGRATORS, default="PT")
    preview_integrator: EnumProperty(
        name="Viewport Integrator", description="How light is found in the viewport", items=INTEGRATORS, default="PT"
    )
    samples: _samples(128, "of a render")
    preview_samples: _samples(32, "in the viewport")
    time_limit: _time_limit("a render")
    preview_time_limit: _time_limit("the viewport")
    noise_threshold: _noise_threshold("in a render")
    preview_noise_threshold: _noise_threshold("in the viewport")
    seed: IntProperty(name="Seed", description="Chooses the noise pattern", default=0, min=0, max=(1 << 31) - 1)
    animated_seed: BoolProperty(name="Animate Seed", description="Another noise pattern in each frame", default=False)
    max_bounces: _bounces("Total", 12)
    diffuse_bounces: _bounces("Diffuse", 4)
    glossy_bounces: _bounces("Glossy", 4)
    transmission_bounces: _bounces("Transmission", 12)
    volume_bounces: _bounces("Volume", 0)
    transparent_bounces: _bounces("Transparent", 8)
    clamp_direct: _clamp("Clamp Direct")
    clamp_indirect: _clamp("Clamp Indirect")
    light_threshold: FloatProperty(
        name="Light Threshold",
        description="Light that would add less than this to the picture is looked for by chance only, without changing "
        "the result: faster, a little more noise. 0 looks for all of it",
        default=0.01,
        min=0.0,
        soft_max=0.1,
        precision=3,
    )
    caustics_reflective: BoolProperty(
        name="Reflective Caustics", description="Light that glossy surfaces cast on diffuse ones", default=True
    )
    caustics_refractive: BoolProperty(
        name="Refractive Caustics", description="Light that transmissive surfaces cast on diffuse ones", default=True
    )
    merge_radius: FloatProperty(
        name="Merge Radius",
        description="How far photons are gathered from at first, in pixels where the camera sees first; 0 gathers none",
        default=2.0,
        min=0.0,
        soft_max=10.0,
    )
    merge_alpha: FloatProperty(
        name="Radius Reduction",
        description="How slowly the radius shrinks from pass to pass: 1 keeps it, less makes pictures sharper and noisier",
        default=0.75,
        min=0.0,
        max=1.0,
    )
    shared_light_paths: IntProperty(
        name="Light Paths", description="Light paths of a pass that all pixels share", default=16, min=1, soft_max=1024, max=1 << 20
    )
    clamp_connection: FloatProperty(
        name="Clamp Connections",
        description="Largest value that one virtual light adds; hides splotches and loses light. 0 is off",
        default=0.0,
        min=0.0,
        soft_max=100.0,
    )
    pixel_filter: EnumProperty(
        name="Pixel Filter", description="How samples are weighted into pixels", items=_FILTERS, default="BLACKMAN_HARRIS"
    )
    filter_width: FloatProperty(
        name="Filter Width", description="Width of the pixel filter in pixels", default=1.5, min=0.01, max=10.0
    )
    film_exposure: FloatProperty(
        name="Exposure", description="Factor for the brightness of the picture", default=1.0, min=0.0, soft_max=10.0
    )
    film_transparent_glass: BoolProperty(
        name="Transparent Glass",
        description="With a transparent film, what is seen of the world through clear glass is transparent too, so that glass can be "
        "laid over another background",
        default=False,
    )
    film_transparent_roughness: FloatProperty(
        name="Roughness Threshold", description="Glass up to this roughness counts as clear", default=0.1, min=0.0, max=1.0
    )
    tile_size: IntProperty(name="Tile Size", description="Pixels along a side of a tile", default=64, min=16, max=1024)


def register():
    """Adds scene.lambent."""
    bpy.utils.register_class(LambentSettings)
    bpy.types.Scene.lambent = PointerProperty(type=LambentSettings)


def unregister():
    """Removes scene.lambent."""
    del bpy.types.Scene.lambent
    bpy.utils.unregister_class(LambentSettings)
