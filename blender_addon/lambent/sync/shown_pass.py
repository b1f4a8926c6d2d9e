# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Which passes a viewport can show, and under which keys it remembers the one that is chosen.

As with Cycles, these need not be switched on in the view layer. A key is a kind of the protocol's, or a sort and a name of
the layer's own: "normal", "aov:tint", "light_group:keys". Keys last where names do: files keep them.
"""

from dataclasses import replace

from . import passes

COMBINED_KEY = passes.COMBINED_CHANNEL
# The channel of the shown pass on the wire. Its own name might be Combined's.
SHOWN_CHANNEL = "shown"
_LIGHT = [f"{lobe}_{part}" for lobe in ("diffuse", "glossy") for part in ("direct", "indirect", "color")]
_MORE_LIGHT = [f"transmission_{part}" for part in ("direct", "indirect", "color")]
_MORE_LIGHT += [f"volume_{part}" for part in ("direct", "indirect", "scatter", "transmit", "majorant")]
# Columns of the menu: (heading, kinds in order).
_COLUMNS = (
    ("General", (COMBINED_KEY, "emission", "environment", "ambient_occlusion", "shadow", "shadow_catcher")),
    ("Light", _LIGHT),
    ("", _MORE_LIGHT),
    (
        "Data",
        ("depth", "position", "normal", "uv", "mist", "object_index", "material_index")
        + ("cryptomatte_object", "cryptomatte_material", "cryptomatte_asset", "sample_count", "render_time")
        + ("denoising_albedo", "denoising_specular_albedo", "denoising_normal", "denoising_roughness", "denoising_depth"),
    ),
    (
        "Lambent",
        ("caustics_direct", "caustics_indirect", "technique_unidirectional", "technique_connection", "technique_merging")
        + ("without_shadow", "shadow_difference", "shadow_ratio", "matte_light", "error", "time"),
    ),
)
_OF_LAYER = "View Layer"
_LABELS = {"uv": "UV", "time": "Sample Time"}
# Vector needs other frames, which a viewport has no time to evaluate; the others are Combined again.
_NOT_SHOWN = ("vector", "noisy", "noisy_shadow_catcher")
_SORTS = {"aov_color": "aov", "aov_value": "aov"}
# A pixel's two largest shares are what is drawn.
_CRYPTOMATTE_LEVELS = 2


def choices(layer, kinds=None):
    """[(heading, [(key, label)])] of the columns of a menu. kinds: those of the daemon, None where they are not known yet."""
    found = _by_key(layer, kinds)
    columns = [(heading, [(kind, _label(kind)) for kind in listed if kind in found]) for heading, listed in _COLUMNS]
    plain = {kind for _, listed in _COLUMNS for kind in listed}
    columns.append((_OF_LAYER, [(key, entry.name) for key, entry in found.items() if key not in plain]))
    return [column for column in columns if column[1]]


def find(layer, key):
    """The passes.RenderPass of a key as a viewport asks for it, None where the layer has none such (any more)."""
    entry = _by_key(layer).get(key)
    if entry is None:
        return None
    if entry.count:
        return replace(entry, name=SHOWN_CHANNEL, argument=_CRYPTOMATTE_LEVELS, count=1)
    return replace(entry, name=SHOWN_CHANNEL)


def name(key):
    """What a user calls the pass of a key, be it there or not."""
    return key.partition(":")[2] or _label(key)


def _by_key(layer, kinds=None):
    found = {}
    for entry in passes.possible(layer):
        if entry.kind not in _NOT_SHOWN and (kinds is None or entry.kind in kinds):
            found.setdefault(_key(entry), entry)
    return found


def _key(entry):
    if entry.kind == "light_path":
        return f"light_path:{entry.name}"
    # A denoising pass's argument is a rule, not one of several of its kind.
    if isinstance(entry.argument, str) and not entry.kind.startswith("denoising_"):
        return f"{_SORTS.get(entry.kind, entry.kind)}:{entry.argument}"
    return entry.kind


def _label(kind):
    return _LABELS.get(kind) or kind.replace("_", " ").title()
