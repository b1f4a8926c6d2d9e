# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Cryptomatte's ids and metadata (specification 1.2.0, J. Friedman and A. Jones, 2015), by which keyers find names."""

import json

_MASK = 0xFFFFFFFF


def murmur3(content):
    """MurmurHash3_x86_32 of bytes with seed 0 (A. Appleby), as an unsigned number."""
    state = 0
    whole = len(content) & ~3
    for start in range(0, whole, 4):
        state ^= _mixed(int.from_bytes(content[start : start + 4], "little"))
        state = (_rotated(state, 13) * 5 + 0xE6546B64) & _MASK
    if len(content) > whole:
        state ^= _mixed(int.from_bytes(content[whole:], "little"))
    state ^= len(content)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35)):
        state = ((state ^ state >> shift) * factor) & _MASK
    return state ^ state >> 16


def id_bits(name):
    """The bits of the float32 that stands for a name: its hash, with the lowest bit of the exponent turned where it would
    be a denormal number, an infinity or no number."""
    hashed = murmur3(name.encode("utf-8", "replace"))
    return hashed ^ 1 << 23 if hashed >> 23 & 255 in (0, 255) else hashed


def manifest(names):
    """JSON text {name: the id's bits as 8 hex digits}, sorted by name."""
    return json.dumps({name: f"{id_bits(name):08x}" for name in sorted(names)}, ensure_ascii=False, separators=(",", ":"))


def metadata(layer_name, names):
    """{field: value} of one Cryptomatte for an image file. layer_name: as "ViewLayer.CryptoObject"."""
    prefix = f"cryptomatte/{murmur3(layer_name.encode('utf-8', 'replace')):08x}"[: len("cryptomatte/") + 7]
    return {
        f"{prefix}/name": layer_name,
        f"{prefix}/hash": "MurmurHash3_32",
        f"{prefix}/conversion": "uint32_to_float32",
        f"{prefix}/manifest": manifest(names),
    }


def _mixed(block):
    return _rotated(block * 0xCC9E2D51 & _MASK, 15) * 0x1B873593 & _MASK


def _rotated(value, count):
    return (value << count | value >> 32 - count) & _MASK
