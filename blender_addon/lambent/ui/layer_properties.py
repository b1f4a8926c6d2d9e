# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""view_layer.lambent and object.lambent: the passes that Blender has no switches for."""

import bpy
from bpy.props import BoolProperty, CollectionProperty, IntProperty, PointerProperty, StringProperty


def _refresh_passes(self, _context):
    """The compositor's sockets and the checks for names that occur twice follow what a layer asks for."""
    for layer in self.id_data.view_layers:
        layer.update_render_passes()


def _switch(name, description):
    return BoolProperty(name=name, description=description, default=False, update=_refresh_passes)


class LambentLightPath(bpy.types.PropertyGroup):
    """A pass of the light that came by certain paths."""

    name: StringProperty(name="Name", description="Name of the pass", maxlen=63, update=_refresh_passes)
    expression: StringProperty(
        name="Expression",
        description="Which paths, from the camera to the light, as a light path expression of Open Shading Language: "
        "C<RD>L is direct light on diffuse surfaces, CD+<RS>+L reflective caustics",
        default="C.*L",
    )


class LambentMatte(bpy.types.PropertyGroup):
    """A pass of the cover of some objects."""

    name: StringProperty(name="Name", description="Name of the pass", maxlen=63, update=_refresh_passes)
    object: PointerProperty(type=bpy.types.Object, name="Object", description="An object that the matte shows, with its instances")
    collection: PointerProperty(
        type=bpy.types.Collection, name="Collection", description="A collection whose objects, and those of collections in it, the matte shows"
    )


class LambentLayerSettings(bpy.types.PropertyGroup):
    """Passes of a view layer. Those that Cycles has too follow its switches until they are set (sync/passes.py)."""

    use_pass_volume_direct: _switch("Volume Direct", "Light that volumes scatter at once")
    use_pass_volume_indirect: _switch("Volume Indirect", "Light that volumes scatter after bounces")
    use_pass_shadow_catcher: _switch("Shadow Catcher", "What to multiply a backdrop with for shadows and light on shadow catchers")
    use_pass_sample_count: _switch("Sample Count", "Samples of each pixel")
    use_pass_denoising_data: _switch("Denoising Data", "Albedo, normal and depth for denoisers")
    use_pass_caustics_direct: _switch("Direct", "Light that glossy or transmissive surfaces cast on what the camera sees")
    use_pass_caustics_indirect: _switch("Indirect", "Caustics that the camera sees after further bounces")
    use_pass_technique_unidirectional: _switch("Unidirectional", "What paths from the camera found by themselves or by lamps")
    use_pass_technique_connection: _switch("Connection", "What connecting paths from lamps and from the camera found")
    use_pass_technique_merging: _switch("Merging", "What photons found that were gathered")
    use_pass_without_shadow: _switch("Without", "The picture as if the objects chosen for shadow passes were there for the camera alone: "
                                     "without their shadows, reflections and caustics")  # fmt: skip
    use_pass_shadow_difference: _switch("Difference", "What the picture has and the one without these shadows has not; adds to it")
    use_pass_shadow_ratio: _switch("Ratio", "The picture over the one without these shadows; multiplies it")
    use_shadow_groups: _switch("By Light Group", "Each of these passes also of every light group by itself")
    use_pass_matte_light: _switch("Matte Light", "Reflections, caustics and bounced light on mattes: a part of the picture")
    use_pass_error: _switch("Error", "Standard error of each pixel's mean: how far noise may have moved it")
    use_pass_time: _switch("Sample Time", "Microseconds that a sample of each pixel took")
    light_paths: CollectionProperty(type=LambentLightPath, name="Light Paths")
    active_light_path: IntProperty(name="Active Light Path", default=0, min=0)
    mattes: CollectionProperty(type=LambentMatte, name="Mattes")
    active_matte: IntProperty(name="Active Matte", default=0, min=0)


class LambentObjectSettings(bpy.types.PropertyGroup):
    """What passes ask of an object that Blender has no property for."""

    shadow_pass: BoolProperty(
        name="Shadow Passes",
        description="The passes Without Shadow, Shadow Difference and Shadow Ratio take away what this object does to the light "
        "of others: its shadows, reflections and caustics, and its own light",
        default=False,
    )
    matte: BoolProperty(
        name="Matte",
        description="A shadow catcher that also shows what reflections, caustics and bounced light other objects bring to it: what "
        "stands in for a place on a photograph",
        default=False,
    )


_CLASSES = (LambentLightPath, LambentMatte, LambentLayerSettings, LambentObjectSettings)


def register():
    """Adds view_layer.lambent and object.lambent."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.ViewLayer.lambent = PointerProperty(type=LambentLayerSettings)
    bpy.types.Object.lambent = PointerProperty(type=LambentObjectSettings)


def unregister():
    """Removes them."""
    del bpy.types.Object.lambent
    del bpy.types.ViewLayer.lambent
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
