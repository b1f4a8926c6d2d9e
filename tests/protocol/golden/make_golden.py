#!/usr/bin/python3
# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the golden frames that C++ and Python both must read and write, byte for byte.

Each NAME.bin holds one or more frames; NAME.json says what is in them:
  {"frames": [{"header": {..}, "header_text": "the JSON as it travels", "payload_bytes": n, "flags": n,
               "arrays": [{"hash", "dtype", "shape", "offset", "values": [..]}]}],
   "error": "why a reader must refuse it" (malformed ones only; then "frames" is what precedes the malformed frame),
   "token": .., "proofs": .. (handshake only)}
Written with struct and hashlib alone, without the add-on, so that it checks the add-on too. Run it again after a change
of PROTOCOL.md: make_golden.py (writes beside itself).
"""

import hashlib
import hmac
import json
import pathlib
import struct

k_here = pathlib.Path(__file__).resolve().parent
k_formats = {"u8": "B", "u16": "<H", "u32": "<I", "i32": "<i", "f32": "<f"}


def header_text(header):
    return json.dumps(header, separators=(",", ":"), ensure_ascii=False)


def frame(text, payload=b"", flags=0, magic=b"LMBT", version=1, reserved=0, header_bytes=None, payload_bytes=None):
    encoded = text.encode("utf-8")
    prelude = struct.pack(
        "<4sHHIIQ",
        magic,
        version,
        flags,
        len(encoded) if header_bytes is None else header_bytes,
        reserved,
        len(payload) if payload_bytes is None else payload_bytes,
    )
    return prelude + encoded + payload


def array_bytes(dtype, values):
    return b"".join(struct.pack(k_formats[dtype], value) for value in values)


def array_hash(dtype, shape, values):
    text = f"{dtype}:{'x'.join(str(size) for size in shape)}:".encode("ascii")
    return hashlib.sha256(text + array_bytes(dtype, values)).hexdigest()[:32]


def arrays_frame(arrays):
    """(bytes, description) of an `arrays` frame of [(dtype, shape, values)]."""
    payload, descriptors = b"", []
    for dtype, shape, values in arrays:
        payload += b"\0" * (-len(payload) % 16)
        described = {"hash": array_hash(dtype, shape, values), "dtype": dtype, "shape": shape, "offset": len(payload)}
        descriptors.append(described)
        payload += array_bytes(dtype, values)
    header = {"type": "arrays", "arrays": descriptors}
    text = header_text(header)
    described = [{**descriptor, "values": list(values)} for descriptor, (_, _, values) in zip(descriptors, arrays)]
    return frame(text, payload), {
        "header": header,
        "header_text": text,
        "payload_bytes": len(payload),
        "flags": 0,
        "arrays": described,
    }


def plain(header):
    text = header_text(header)
    return frame(text), {"header": header, "header_text": text, "payload_bytes": 0, "flags": 0, "arrays": []}


def write(name, parts, extra=None, raw=b""):
    (k_here / f"{name}.bin").write_bytes(b"".join(content for content, _ in parts) + raw)
    description = {"frames": [described for _, described in parts], **(extra or {})}
    (k_here / f"{name}.json").write_text(json.dumps(description, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def handshake():
    token, theirs, ours = "0123456789abcdef" * 4, "11" * 32, "22" * 32
    proofs = {
        role: hmac.new(token.encode(), f"{role}:{first}:{second}".encode(), hashlib.sha256).hexdigest()
        for role, first, second in (("client", theirs, ours), ("daemon", ours, theirs))
    }
    challenge = {"type": "challenge", "protocol": 1, "nonce": theirs}
    hello = {"type": "hello", "protocol": 1, "client": "golden", "nonce": ours, "proof": proofs["client"]}
    welcome = {
        "type": "welcome",
        "protocol": 1,
        "version": "0.1.0",
        "session": 7,
        "proof": proofs["daemon"],
        "capabilities": {"integrators": ["PT"], "shared_memory": True},
    }
    parts = [plain(header) for header in (challenge, hello, welcome)]
    write("handshake", parts, {"token": token, "daemon_nonce": theirs, "client_nonce": ours, "proofs": proofs})


def good_frames():
    write("ping", [plain({"type": "ping", "cookie": 42})])
    write("unicode", [plain({"type": "save_scene", "path": "/tmp/Würfel_立方体.lambent"})])
    write(
        "arrays",
        [
            arrays_frame(
                [
                    ("f32", [2, 3], [0.0, -1.5, 3.25, 1e30, -0.0, 2.0**-149]),
                    ("u32", [1, 3], [0, 1, 4294967295]),
                    ("u16", [5], [0, 1, 2, 3, 65535]),
                    ("u8", [3], [137, 80, 255]),
                    ("i32", [2], [-2147483648, 2147483647]),
                    ("f32", [0, 3], []),
                    ("f32", [1, 3, 4], [1, 0, 0, 5, 0, 1, 0, 6, 0, 0, 1, 7]),
                ]
            )
        ],
    )
    quad = [("f32", [3, 3], [0, 0, 0, 1, 0, 0, 0, 1, 0]), ("u32", [1, 3], [0, 1, 2])]
    positions, triangles = (array_hash(*array) for array in quad)
    edits = [
        {
            "op": "upsert",
            "kind": "mesh",
            "id": "mesh:tri",
            "value": {"name": "tri", "positions": {"array": positions}, "triangles": {"array": triangles}},
        },
        {
            "op": "upsert",
            "kind": "object",
            "id": "tri",
            "value": {"name": "tri", "mesh": "mesh:tri", "transform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]},
        },
        {"op": "remove", "kind": "light", "id": "gone"},
    ]
    parts = [
        plain({"type": "arrays_query", "hashes": [positions, triangles]}),
        arrays_frame(quad),
        plain({"type": "transaction", "epoch": 1, "edits": edits}),
        plain({"type": "render_start", "epoch": 1}),
        plain({"type": "tile_credit", "tiles": 8}),
        plain({"type": "render_cancel", "epoch": 1}),
        plain({"type": "bye"}),
    ]
    write("session", parts)
    pixels = [x / 8 for x in range(2 * 3 * 4)]
    tile = {
        "type": "tile",
        "epoch": 1,
        "rect": [64, 128, 3, 2],
        "samples": 16,
        "final": True,
        "channels": [{"name": "combined", "components": 4}],
    }
    text = header_text(tile)
    payload = array_bytes("f32", pixels)
    described = {"header": tile, "header_text": text, "payload_bytes": len(payload), "flags": 0, "arrays": [], "pixels": pixels}
    write("tile", [(frame(text, payload), described)])


def malformed_frames():
    ping = header_text({"type": "ping", "cookie": 1})
    cases = {
        "bad_magic": (frame(ping, magic=b"LMBX"), "the magic is not LMBT"),
        "bad_version": (frame(ping, version=2), "framing version 2"),
        "bad_flags": (frame(ping, flags=4), "a flag that does not exist"),
        "bad_reserved": (frame(ping, reserved=1), "the reserved field is not 0"),
        "header_too_short": (frame("{", header_bytes=1), "a header of 1 byte"),
        "header_too_long": (frame(ping, header_bytes=(64 << 20) + 1), "a header of over 64 MiB"),
        "payload_too_long": (frame(ping, payload_bytes=1 << 62), "a payload of 2^62 bytes"),
        "not_json": (frame("{not json}"), "the header is not JSON"),
        "not_object": (frame("[1,2]"), "the header is not an object"),
        "no_type": (frame('{"cookie":1}'), "the header has no type"),
        "type_not_text": (frame('{"type":7}'), "the type is not a string"),
        "truncated": (frame(ping)[:-3], "the stream ends inside the frame"),
        "not_utf8": (frame('{"type":"??"}').replace(b"??", b"\xff\xfe"), "the header is not UTF-8"),
        "too_deep": (frame('{"type":"ping","cookie":' + "[" * 100 + "]" * 100 + "}"), "JSON deeper than 64"),
    }
    for name, (content, reason) in cases.items():
        write(f"malformed_{name}", [plain({"type": "ping", "cookie": 0})], {"error": reason}, raw=content)


if __name__ == "__main__":
    handshake()
    good_frames()
    malformed_frames()
