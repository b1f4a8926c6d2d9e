"""Saved scenes (`*.lambent`, PROTOCOL.md) read and changed from outside: to send one over the wire, or to render it with other settings.

Payloads are decompressed by the program zstd.
"""

import pathlib
import subprocess

import daemon_programs  # noqa: F401  (finds the package wire)
import numpy as np
from wire import messages

_DTYPES = {"u8": "<u1", "u16": "<u2", "u32": "<u4", "i32": "<i4", "f32": "<f4"}


def frames(path):
    """Yields (flags, header, payload as it is in the file) of a saved scene. Raises messages.ProtocolError."""
    content, at = memoryview(pathlib.Path(path).read_bytes()), 0
    while at < len(content):
        flags, header_bytes, payload_bytes = messages.decode_prelude(content[at : at + messages.PRELUDE.size], len(content))
        begin = at + messages.PRELUDE.size + header_bytes
        yield flags, messages.decode_header(content[begin - header_bytes : begin]), content[begin : begin + payload_bytes]
        at = begin + payload_bytes


def read(path):
    """Returns (arrays by hash, edits) of a saved scene."""
    arrays, edits = {}, []
    for flags, header, payload in frames(path):
        if flags & messages.FLAG_PAYLOAD_ZSTD:
            payload = subprocess.run(["zstd", "-dc"], input=payload, stdout=subprocess.PIPE, check=True).stdout
        for of in header.get("arrays", ()):
            values = np.frombuffer(payload, _DTYPES[of["dtype"]], int(np.prod(of["shape"])), of["offset"])
            arrays[of["hash"]] = values.reshape(of["shape"])
        edits += header.get("edits", ())
    return arrays, edits


def write_changed(path, out, **settings):
    """Writes a saved scene with other values in its settings."""
    with open(out, "wb") as file:
        for flags, header, payload in frames(path):
            for edit in header.get("edits", ()):
                if edit["kind"] == "settings":
                    edit["value"].update(settings)
            file.write(messages.encode_frame(header, payload, flags))
