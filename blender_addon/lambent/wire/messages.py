# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Frames, array descriptors and proofs exactly as server/protocol/PROTOCOL.md defines them; no I/O happens here."""

import hashlib
import hmac
import json
import struct

import numpy as np

MAGIC = b"LMBT"
FRAMING_VERSION = 1
PROTOCOL_VERSION = 1
FLAG_PAYLOAD_IN_FD = 1
FLAG_PAYLOAD_ZSTD = 2

PRELUDE = struct.Struct("<4sHHIIQ")
MAX_HEADER_BYTES = 64 << 20
MIN_HEADER_BYTES = 2
ARRAY_ALIGNMENT = 16

_DTYPE_NAMES = {"uint8": "u8", "uint16": "u16", "uint32": "u32", "int32": "i32", "float32": "f32"}
_DTYPES = {name: np.dtype(numpy_name).newbyteorder("<") for numpy_name, name in _DTYPE_NAMES.items()}


class ProtocolError(Exception):
    """What arrived is not the protocol: bad magic, size, header or payload."""


def encode_json(value):
    """UTF-8 bytes of value as compact JSON. Raises ValueError on a number that is not finite, which JSON cannot say."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode("utf-8", "replace")


def encode_prelude(header_bytes, payload_bytes=0, flags=0):
    """The 24 bytes before a header of header_bytes and a payload of payload_bytes (both counts in bytes)."""
    return PRELUDE.pack(MAGIC, FRAMING_VERSION, flags, header_bytes, 0, payload_bytes)


def encode_frame(header, payload=b"", flags=0):
    """A whole frame as bytes: header is a dict with a "type" member, or its encoded JSON."""
    encoded = header if isinstance(header, bytes) else encode_json(header)
    return encode_prelude(len(encoded), len(payload), flags) + encoded + bytes(payload)


def decode_prelude(prelude, max_payload_bytes):
    """(flags, header bytes, payload bytes) of a 24-byte prelude.

    Raises ProtocolError where magic, version, flags or the reserved field are wrong or a size is over its limit.
    """
    magic, version, flags, header_bytes, reserved, payload_bytes = PRELUDE.unpack(prelude)
    if magic != MAGIC:
        raise ProtocolError(f"not a Lambent frame: it starts with {magic!r}")
    if version != FRAMING_VERSION:
        raise ProtocolError(f"framing version {version} is not {FRAMING_VERSION}")
    if flags & ~(FLAG_PAYLOAD_IN_FD | FLAG_PAYLOAD_ZSTD) or reserved:
        raise ProtocolError(f"frame with unknown flags {flags} or reserved field {reserved}")
    if not MIN_HEADER_BYTES <= header_bytes <= MAX_HEADER_BYTES:
        raise ProtocolError(f"frame header of {header_bytes} bytes is outside {MIN_HEADER_BYTES} to {MAX_HEADER_BYTES}")
    if payload_bytes > max_payload_bytes:
        raise ProtocolError(f"frame payload of {payload_bytes} bytes is over the limit of {max_payload_bytes}")
    return flags, header_bytes, payload_bytes


def decode_header(encoded):
    """The header dict of a frame. Raises ProtocolError unless it is a JSON object with a string member "type"."""
    try:
        header = json.loads(bytes(encoded).decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise ProtocolError(f"frame header is not JSON: {error}") from None
    if not isinstance(header, dict) or not isinstance(header.get("type"), str):
        raise ProtocolError("frame header is not an object with a string member 'type'")
    return header


def wire_array(values):
    """values as the C-contiguous little-endian array that travels. Raises TypeError for a dtype that the wire has not."""
    array = np.ascontiguousarray(values)
    name = _DTYPE_NAMES.get(array.dtype.name)
    if name is None:
        raise TypeError(f"arrays of {array.dtype} do not travel")
    return array.astype(_DTYPES[name], copy=False)


def dtype_name(array):
    """The wire's name of an array's dtype: u8 u16 u32 i32 f32."""
    return _DTYPE_NAMES[array.dtype.name]


def array_hash(array):
    """32 hex digits: the first 16 bytes of SHA-256 over dtype, shape and bytes of a wire array."""
    shape = "x".join(str(size) for size in array.shape)
    digest = hashlib.sha256(f"{dtype_name(array)}:{shape}:".encode("ascii"))
    if array.size:
        digest.update(array.data.cast("B"))
    return digest.hexdigest()[:32]


def describe_arrays(arrays):
    """(descriptors, payload bytes) for a dict {hash: wire array}, laid out in order with 16-byte alignment."""
    descriptors = []
    offset = 0
    for key, array in arrays.items():
        offset = -(-offset // ARRAY_ALIGNMENT) * ARRAY_ALIGNMENT
        descriptors.append({"hash": key, "dtype": dtype_name(array), "shape": list(array.shape), "offset": offset})
        offset += array.nbytes
    return descriptors, offset


def fill_payload(payload, descriptors, arrays):
    """Copies arrays to where descriptors put them in payload, a writable buffer (a mapped memfd or a bytearray)."""
    target = np.frombuffer(payload, np.uint8)
    for descriptor in descriptors:
        array = arrays[descriptor["hash"]]
        if array.nbytes:
            start = descriptor["offset"]
            # Through a view of the array's own type, so that numpy copies once and without temporaries.
            target[start : start + array.nbytes].view(array.dtype).reshape(array.shape)[...] = array


def read_array(payload, descriptor):
    """The array that a descriptor names inside payload, as a view. Raises ProtocolError where it does not fit."""
    dtype = _DTYPES.get(descriptor.get("dtype"))
    shape = descriptor.get("shape")
    offset = descriptor.get("offset")
    sizes_valid = isinstance(shape, list) and all(isinstance(size, int) and size >= 0 for size in shape)
    if dtype is None or not sizes_valid or not isinstance(offset, int):
        raise ProtocolError(f"malformed array descriptor {descriptor}")
    count = int(np.prod(shape, dtype=np.int64))
    if offset < 0 or offset % ARRAY_ALIGNMENT or offset + count * dtype.itemsize > len(payload):
        raise ProtocolError(f"array descriptor {descriptor} does not fit its payload of {len(payload)} bytes")
    return np.frombuffer(payload, dtype, count, offset).reshape(shape)


def client_proof(token, daemon_nonce, client_nonce):
    """Hex HMAC-SHA256 by which a client shows that it holds token (ASCII text); PROTOCOL.md, handshake step 2."""
    return _proof(token, f"client:{daemon_nonce}:{client_nonce}")


def daemon_proof(token, daemon_nonce, client_nonce):
    """Hex HMAC-SHA256 by which the daemon shows that it holds token (ASCII text); PROTOCOL.md, handshake step 3."""
    return _proof(token, f"daemon:{client_nonce}:{daemon_nonce}")


def _proof(token, text):
    return hmac.new(token.encode("ascii"), text.encode("ascii"), hashlib.sha256).hexdigest()
