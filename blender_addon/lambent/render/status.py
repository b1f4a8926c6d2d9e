# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The status line that Blender shows and farm managers parse."""


def status_line(scene_name, layer_name, progress):
    """The second argument of update_stats for a `progress` message of the protocol.

    Form: "Remaining:00:12.34 | Mem:512.00M, Peak:900.00M | Scene, ViewLayer | Rendered 12/64 Tiles, Sample 128/1024".
    Flamenco, SheepIt and Deadline Cloud each find what they look for in it. While the scene is being prepared the last
    part is what is being done.
    """
    parts = []
    remaining = progress.get("remaining_s")
    if isinstance(remaining, (int, float)) and remaining >= 0:
        parts.append(f"Remaining:{_clock(remaining)}")
    memory, peak = _number(progress, "memory_bytes"), _number(progress, "memory_peak_bytes")
    parts.append(f"Mem:{memory / 2**20:.2f}M, Peak:{max(memory, peak) / 2**20:.2f}M")
    parts.append(f"{scene_name}, {layer_name}")
    if progress.get("stage") != "rendering":
        parts.append({"updating": "Updating Scene", "building": "Building Scene"}.get(progress.get("stage"), "Waiting"))
    else:
        tiles = f"Rendered {_number(progress, 'tiles')}/{_number(progress, 'tiles_total')} Tiles"
        samples, total = _number(progress, "samples"), _number(progress, "samples_total")
        # Without a limit there is no total to print.
        parts.append(f"{tiles}, Sample {samples}/{total}" if total else f"{tiles}, Sample {samples}")
    return " | ".join(parts)


def progress_fraction(progress, time_limit_s):
    """How much of a render is done, 0 to 1: by samples and tiles, or by time where that ends it earlier."""
    fraction = 0.0
    total = _number(progress, "samples_total")
    if total:
        tiles_total = _number(progress, "tiles_total")
        partial = _number(progress, "tiles") / tiles_total if tiles_total else 0.0
        fraction = (_number(progress, "samples") + min(partial, 1.0)) / total
    if time_limit_s > 0:
        fraction = max(fraction, _number(progress, "elapsed_s") / time_limit_s)
    return min(max(fraction, 0.0), 1.0)


def _clock(seconds):
    hundredths = int(round(seconds * 100))
    minutes, hundredths = divmod(hundredths, 6000)
    hours, minutes = divmod(minutes, 60)
    clock = f"{minutes:02d}:{hundredths // 100:02d}.{hundredths % 100:02d}"
    return f"{hours:02d}:{clock}" if hours else clock


def _number(progress, name):
    value = progress.get(name)
    return value if isinstance(value, (int, float)) and not isinstance(value, bool) else 0
