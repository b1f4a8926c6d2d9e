# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The passes of a view layer: one table of what each switch gives, under the running Blender's names, and on the wire.

Names, channels, types and order are those that Cycles registers in the same version of Blender, so that compositions go
on working. Lambent's own passes follow after.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

from . import compat

COMBINED = "Combined"
# The channel of the picture itself has one name on the wire, whatever Blender calls it.
COMBINED_CHANNEL = "combined"
# What a daemon that announces no passes has.
ONLY_COMBINED = frozenset({"combined"})
# What settings() gives.
SETTINGS_OF_PASSES = frozenset({"passes", "pass_alpha_threshold", "mist", "ambient_occlusion_distance_m"})
_MOST_LEVELS = 16
# Of the name of a pass in Blender's result.
_MOST_BYTES = 63


class _Row(NamedTuple):
    """kind: the protocol's. switch: on the view layer, or on view_layer.lambent where own; "" without one. before_5, since_5:
    Blender's name in those versions, None where it has no such pass. channels: a letter each. type: of the socket. cycles: the
    switch on view_layer.cycles that counts while ours is not set."""

    kind: str
    switch: str
    before_5: str
    since_5: str
    channels: str
    type: str
    own: bool = False
    cycles: str = ""


# Passes that may also be had of each light group.
_OF_SHADOWS = ("without_shadow", "shadow_difference", "shadow_ratio")
_DENOISING = {"switch": "use_pass_denoising_data", "own": True, "cycles": "denoising_store_passes"}
_CRYPTOMATTE = {"channels": "rgba", "type": "COLOR"}


def _own(kind, switch, name, channels, type_name):
    return _Row(kind, switch, name, name, channels, type_name, own=True)


# fmt: off
_BLENDER = (
    _Row("depth", "use_pass_z", "Depth", "Depth", "Z", "VALUE"),
    _Row("mist", "use_pass_mist", "Mist", "Mist", "Z", "VALUE"),
    _Row("position", "use_pass_position", "Position", "Position", "XYZ", "VECTOR"),
    _Row("normal", "use_pass_normal", "Normal", "Normal", "XYZ", "VECTOR"),
    _Row("vector", "use_pass_vector", "Vector", "Vector", "XYZW", "VECTOR"),
    _Row("uv", "use_pass_uv", "UV", "UV", "UVA", "VECTOR"),
    _Row("object_index", "use_pass_object_index", "IndexOB", "Object Index", "X", "VALUE"),
    _Row("material_index", "use_pass_material_index", "IndexMA", "Material Index", "X", "VALUE"),
    _Row("diffuse_direct", "use_pass_diffuse_direct", "DiffDir", "Diffuse Direct", "RGB", "COLOR"),
    _Row("diffuse_indirect", "use_pass_diffuse_indirect", "DiffInd", "Diffuse Indirect", "RGB", "COLOR"),
    _Row("diffuse_color", "use_pass_diffuse_color", "DiffCol", "Diffuse Color", "RGB", "COLOR"),
    _Row("glossy_direct", "use_pass_glossy_direct", "GlossDir", "Glossy Direct", "RGB", "COLOR"),
    _Row("glossy_indirect", "use_pass_glossy_indirect", "GlossInd", "Glossy Indirect", "RGB", "COLOR"),
    _Row("glossy_color", "use_pass_glossy_color", "GlossCol", "Glossy Color", "RGB", "COLOR"),
    _Row("transmission_direct", "use_pass_transmission_direct", "TransDir", "Transmission Direct", "RGB", "COLOR"),
    _Row("transmission_indirect", "use_pass_transmission_indirect", "TransInd", "Transmission Indirect", "RGB", "COLOR"),
    _Row("transmission_color", "use_pass_transmission_color", "TransCol", "Transmission Color", "RGB", "COLOR"),
    _Row("volume_direct", "use_pass_volume_direct", "VolumeDir", "Volume Direct", "RGB", "COLOR", True, "use_pass_volume_direct"),
    _Row("volume_indirect", "use_pass_volume_indirect", "VolumeInd", "Volume Indirect", "RGB", "COLOR", True, "use_pass_volume_indirect"),
    _Row("volume_scatter", "", None, "Volume Scatter", "RGB", "COLOR", True, "use_pass_volume_scatter"),
    _Row("volume_transmit", "", None, "Volume Transmit", "RGB", "COLOR", True, "use_pass_volume_transmit"),
    _Row("volume_majorant", "", None, "Volume Majorant", "Z", "VALUE", True, "use_pass_volume_majorant"),
    _Row("emission", "use_pass_emit", "Emit", "Emission", "RGB", "COLOR"),
    _Row("environment", "use_pass_environment", "Env", "Environment", "RGB", "COLOR"),
    _Row("shadow", "use_pass_shadow", "Shadow", "Shadow", "RGB", "COLOR"),
    _Row("ambient_occlusion", "use_pass_ambient_occlusion", "AO", "Ambient Occlusion", "RGB", "COLOR"),
    _Row("shadow_catcher", "use_pass_shadow_catcher", "Shadow Catcher", "Shadow Catcher", "RGB", "COLOR", True, "use_pass_shadow_catcher"),
    _Row("sample_count", "use_pass_sample_count", "Debug Sample Count", "Debug Sample Count", "X", "VALUE", True, "pass_debug_sample_count"),
    _Row("render_time", "", None, "Render Time", "X", "VALUE", True, "pass_render_time"),
    _Row("cryptomatte_object", "use_pass_cryptomatte_object", "CryptoObject", "CryptoObject", **_CRYPTOMATTE),
    _Row("cryptomatte_material", "use_pass_cryptomatte_material", "CryptoMaterial", "CryptoMaterial", **_CRYPTOMATTE),
    _Row("cryptomatte_asset", "use_pass_cryptomatte_asset", "CryptoAsset", "CryptoAsset", **_CRYPTOMATTE),
    _Row("noisy", "", "Noisy Image", "Noisy Image", "RGBA", "COLOR"),
    _Row("noisy_shadow_catcher", "", "Noisy Shadow Catcher", "Noisy Shadow Catcher", "RGB", "COLOR"),
    _Row("denoising_normal", before_5="Denoising Normal", since_5=None, channels="XYZ", type="VECTOR", **_DENOISING),
    _Row("denoising_albedo", before_5="Denoising Albedo", since_5="Denoising Albedo", channels="RGB", type="COLOR", **_DENOISING),
    _Row("denoising_specular_albedo", before_5=None, since_5="Denoising Specular Albedo", channels="RGB", type="COLOR", **_DENOISING),
    _Row("denoising_normal", before_5=None, since_5="Denoising Normal", channels="XYZ", type="VECTOR", **_DENOISING),
    _Row("denoising_roughness", before_5=None, since_5="Denoising Roughness", channels="X", type="VALUE", **_DENOISING),
    _Row("denoising_depth", before_5="Denoising Depth", since_5="Denoising Depth", channels="Z", type="VALUE", **_DENOISING),
)
_LAMBENT = (
    _own("caustics_direct", "use_pass_caustics_direct", "Caustics Direct", "RGB", "COLOR"),
    _own("caustics_indirect", "use_pass_caustics_indirect", "Caustics Indirect", "RGB", "COLOR"),
    _own("technique_unidirectional", "use_pass_technique_unidirectional", "Technique Unidirectional", "RGB", "COLOR"),
    _own("technique_connection", "use_pass_technique_connection", "Technique Connection", "RGB", "COLOR"),
    _own("technique_merging", "use_pass_technique_merging", "Technique Merging", "RGB", "COLOR"),
    _own("without_shadow", "use_pass_without_shadow", "Without Shadow", "RGB", "COLOR"),
    _own("shadow_difference", "use_pass_shadow_difference", "Shadow Difference", "RGB", "COLOR"),
    _own("shadow_ratio", "use_pass_shadow_ratio", "Shadow Ratio", "RGB", "COLOR"),
    _own("matte_light", "use_pass_matte_light", "Matte Light", "RGB", "COLOR"),
    _own("error", "use_pass_error", "Error", "RGB", "COLOR"),
    _own("time", "use_pass_time", "Sample Time", "X", "VALUE"),
)
# fmt: on


@dataclass(frozen=True)
class RenderPass:
    """One entry of the protocol's settings.passes, which is one pass of Blender's, or several numbered ones (Cryptomatte).

    name: Blender's in the running version, without the number. channels: a letter each, as Blender's channel ids.
    type: VALUE, VECTOR or COLOR. kind, argument: the protocol's. count: of numbered passes, 0 where it is one by its name.
    """

    name: str
    channels: str
    type: str
    kind: str
    argument: object = None
    count: int = 0

    @property
    def names(self):
        """Blender's names of its passes, which are also those of its channels on the wire (except Combined's)."""
        return [f"{self.name}{index:02d}" for index in range(self.count)] if self.count else [self.name]

    @property
    def on_wire(self):
        """The entry of settings.passes."""
        if self.kind == COMBINED_CHANNEL:
            return COMBINED_CHANNEL
        entry = {"name": self.name, "kind": self.kind}
        return entry if self.argument is None else {**entry, "argument": self.argument}


def asked(scene, layer):
    """What a view layer asks for, Combined first: a list of RenderPass, in which names may still occur twice."""
    return _of_layer(layer, lambda row: _is_on(row, scene, layer))


def possible(layer):
    """What a view layer could ask for in this Blender, whichever of its switches are on, and its own passes; as asked()."""
    return _of_layer(layer, lambda row: _name(row) is not None)


def _of_layer(layer, wanted):
    found = [RenderPass(COMBINED, "RGBA", "COLOR", "combined")]
    found += [_from_row(row, layer) for row in _BLENDER if wanted(row)]
    for aov in layer.aovs:
        channels = "X" if aov.type == "VALUE" else "RGBA"
        found.append(RenderPass(aov.name, channels, aov.type, f"aov_{aov.type.lower()}", aov.name))
    for group in layer.lightgroups:
        found.append(RenderPass(_cut(f"Combined_{group.name}"), "RGB", "COLOR", "light_group", group.name))
    found += [_from_row(row, layer) for row in _LAMBENT if wanted(row)]
    if layer.lambent.use_shadow_groups:
        for entry in [entry for entry in found if entry.kind in _OF_SHADOWS]:
            found += [replace(entry, name=_cut(f"{entry.name}_{group.name}"), argument=group.name) for group in layer.lightgroups]
    for matte in layer.lambent.mattes:
        if matte.name:
            found.append(RenderPass(matte.name, "X", "VALUE", "matte", matte.name))
    for path in layer.lambent.light_paths:
        if path.name:
            found.append(RenderPass(path.name, "RGB", "COLOR", "light_path", path.expression))
    return found


def _cut(name):
    """As much of a name as a pass may have."""
    return name.encode(errors="replace")[:_MOST_BYTES].decode(errors="ignore")


def unique(passes):
    """(those of passes whose names are their own, names of those that are left out because one before has their name)."""
    taken, kept, left_out = {COMBINED_CHANNEL}, [], []
    for entry in passes:
        if taken.isdisjoint(entry.names):
            taken.update(entry.names)
            kept.append(entry)
        else:
            left_out.append(entry.name)
    return kept, left_out


def rendered(scene, layer, kinds):
    """What a daemon that has kinds (a set of the protocol's) renders of what a view layer asks for."""
    return [entry for entry in unique(asked(scene, layer))[0] if entry.kind in kinds]


def report_left_out(edits, scene, layer, kinds):
    """Says by name what a view layer asks for and does not get."""
    kept, twice = unique(asked(scene, layer))
    missing = [entry.name for entry in kept if entry.kind not in kinds]
    if missing:
        names = ", ".join(missing)
        edits.unsupported(layer.name, f"{layer.name}: the daemon does not support these passes; they are left out: {names}")
    if twice:
        names = ", ".join(twice)
        text = f"{layer.name}: these passes have the name of another and are left out; rename them: {names}"
        edits.report("warning", "duplicate_pass", layer.name, text)


def settings(passes, layer, world):
    """The members of the protocol's settings that passes need. world: the one that is shown (evaluated), or None."""
    kinds = {entry.kind for entry in passes}
    value = {"passes": [entry.on_wire for entry in passes]}
    if kinds == ONLY_COMBINED:
        # As any daemon knows it.
        return value
    value["pass_alpha_threshold"] = layer.pass_alpha_threshold
    if world is not None and "mist" in kinds:
        mist = world.mist_settings
        value["mist"] = {"start_m": mist.start, "depth_m": mist.depth, "falloff": mist.falloff}
    if world is not None and "ambient_occlusion" in kinds:
        value["ambient_occlusion_distance_m"] = world.light_settings.distance
    return value


def mattes(passes, layer):
    """{original object: names of the mattes among passes that show it}."""
    asked_for = {entry.argument for entry in passes if entry.kind == "matte"}
    found = {}
    for matte in layer.lambent.mattes:
        if matte.name not in asked_for:
            continue
        shown = set() if matte.collection is None else {thing.original for thing in matte.collection.all_objects}
        if matte.object is not None:
            shown.add(matte.object.original)
        for thing in shown:
            found.setdefault(thing, []).append(matte.name)
    return found


def aov_names(passes):
    """The names of the shader AOVs among passes."""
    return frozenset(entry.argument for entry in passes if entry.kind in ("aov_color", "aov_value"))


def kinds():
    """The kinds that have a switch in this Blender."""
    return [row.kind for row in (*_BLENDER, *_LAMBENT) if row.switch and _name(row) is not None]


def switch(layer, kind):
    """(owner, name) of the property that switches a kind on, None where this Blender has none."""
    row = next(row for row in (*_BLENDER, *_LAMBENT) if row.kind == kind and _name(row) is not None)
    return _switch(row, layer)


def _switch(row, layer):
    if not row.own:
        return layer, row.switch
    cycles = getattr(layer, "cycles", None)
    if hasattr(cycles, row.cycles) and not (row.switch and layer.lambent.is_property_set(row.switch)):
        return cycles, row.cycles
    return (layer.lambent, row.switch) if row.switch else None


def _is_on(row, scene, layer):
    if _name(row) is None:
        return False
    if row.kind == "noisy":
        return _noisy_is_on(scene, layer)
    if row.kind == "noisy_shadow_catcher":
        return _noisy_is_on(scene, layer) and getattr(*switch(layer, "shadow_catcher"))
    found = _switch(row, layer)
    return found is not None and getattr(*found)


def _noisy_is_on(scene, layer):
    """Where Cycles has it, but not by its defaults alone: without a denoiser it is Combined once more."""
    denoising_data = getattr(*switch(layer, "denoising_albedo"))
    if not hasattr(layer, "cycles"):
        return denoising_data
    denoises = scene.cycles.use_denoising and layer.cycles.use_denoising
    return denoises and (denoising_data or scene.cycles.is_property_set("use_denoising"))


def _from_row(row, layer):
    if not row.kind.startswith("cryptomatte_"):
        argument = "world" if row.kind == "vector" and compat.WORLD_MOVES else None
        if row.kind in ("denoising_albedo", "denoising_normal", "denoising_depth") and compat.FEATURES_ARE_BLENDED:
            argument = "blended"
        return RenderPass(_name(row), row.channels, row.type, row.kind, argument)
    levels = min(layer.pass_cryptomatte_depth, _MOST_LEVELS)
    return RenderPass(_name(row), row.channels, row.type, row.kind, levels, count=(levels + 1) // 2)


def _name(row):
    return row.since_5 if compat.LONG_PASS_NAMES else row.before_5
