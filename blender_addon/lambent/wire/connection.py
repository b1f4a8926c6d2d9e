# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""A socket that carries frames. One thread may receive while another sends; both notice close() within half a second.

On a Unix socket a payload can travel as a sealed memfd, so that the daemon maps the memory instead of copying it.
"""

import fcntl
import mmap
import os
import socket
import time

from . import messages

POLL_SECONDS = 0.25
MAX_PAYLOAD_BYTES = 1 << 30
_SEND_CHUNK_BYTES = 1 << 20


class ConnectionLost(Exception):
    """The daemon went away, hung or spoke nonsense. The text is complete and fit for a user."""


class DaemonHangs(ConnectionLost):
    """The daemon is there and does not answer."""


def parse_address(address):
    """("unix", path) or ("tcp", (host, port)) of "unix:/path", "/path", "host:port" or "[v6]:port". Raises ValueError."""
    if address.startswith("unix:"):
        return "unix", address[len("unix:") :]
    if address.startswith("/"):
        return "unix", address
    host, separator, port = address.rpartition(":")
    if not separator or not port.isdigit() or not host:
        raise ValueError(f"'{address}' is neither unix:/path nor host:port")
    return "tcp", (host.strip("[]"), int(port))


def open_socket(address, timeout_seconds):
    """A connected socket. Raises OSError or ValueError."""
    kind, target = parse_address(address)
    if kind == "tcp":
        connected = socket.create_connection(target, timeout_seconds)
        connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return connected
    connected = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        connected.settimeout(timeout_seconds)
        connected.connect(target)
    except OSError:
        connected.close()
        raise
    return connected


class Connection:
    """Frames over a connected socket, which it owns.

    received_at and sent_at (time.monotonic, s) say when bytes last moved in each direction.
    """

    def __init__(self, connected):
        connected.settimeout(POLL_SECONDS)
        self._socket = connected
        self._closed = False
        self.shared_memory = connected.family == socket.AF_UNIX and hasattr(os, "memfd_create")
        self.received_at = self.sent_at = time.monotonic()

    def close(self):
        """Ends the connection; a thread inside receive or send gets ConnectionLost."""
        self._closed = True
        try:
            self._socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        self._socket.close()

    def receive(self, deadline=None):
        """(header dict, payload memoryview) of the next frame; waits until it is there or deadline (time.monotonic, s).

        Raises ConnectionLost, or messages.ProtocolError for what is not a frame.
        """
        prelude = self._receive_exactly(messages.PRELUDE.size, deadline)
        flags, header_bytes, payload_bytes = messages.decode_prelude(prelude, MAX_PAYLOAD_BYTES)
        if flags:
            raise messages.ProtocolError("the daemon sent a payload by a way that only clients use")
        header = messages.decode_header(self._receive_exactly(header_bytes, deadline))
        return header, self._receive_exactly(payload_bytes, deadline)

    def send(self, header, payload=b""):
        """Sends one frame with an inline payload (any bytes-like). header: dict or encoded JSON. Raises ConnectionLost."""
        encoded = header if isinstance(header, bytes) else messages.encode_json(header)
        self._send_all(messages.encode_prelude(len(encoded), len(payload)) + encoded)
        if len(payload):
            self._send_all(payload)

    def send_arrays(self, arrays):
        """Sends an `arrays` frame for {hash: wire array}: through a sealed memfd where the peer can map it, else inline."""
        descriptors, payload_bytes = messages.describe_arrays(arrays)
        header = messages.encode_json({"type": "arrays", "arrays": descriptors})
        if self.shared_memory and payload_bytes:
            descriptor = _sealed_memory(payload_bytes, lambda memory: messages.fill_payload(memory, descriptors, arrays))
            try:
                prelude = messages.encode_prelude(len(header), payload_bytes, messages.FLAG_PAYLOAD_IN_FD)
                self._send_all(prelude + header, descriptor)
            finally:
                os.close(descriptor)
        else:
            payload = bytearray(payload_bytes)
            messages.fill_payload(payload, descriptors, arrays)
            self.send(header, payload)

    def _receive_exactly(self, count, deadline):
        buffer = memoryview(bytearray(count))
        done = 0
        while done < count:
            try:
                received = self._socket.recv_into(buffer[done:])
            except TimeoutError:
                if self._closed:
                    raise ConnectionLost("the connection to the Lambent daemon was closed") from None
                if deadline is not None and time.monotonic() > deadline:
                    raise DaemonHangs("the Lambent daemon does not answer") from None
                continue
            except OSError as error:
                raise ConnectionLost(f"the connection to the Lambent daemon broke: {error}") from None
            if received == 0:
                raise ConnectionLost("the Lambent daemon closed the connection")
            self.received_at = time.monotonic()
            done += received
        return buffer

    def _send_all(self, data, descriptor=None):
        view = memoryview(data)
        while len(view):
            try:
                chunk = view[:_SEND_CHUNK_BYTES]
                if descriptor is None:
                    sent = self._socket.send(chunk)
                else:
                    # The descriptor rides with the first bytes only.
                    sent = socket.send_fds(self._socket, [chunk], [descriptor])
                    descriptor = None
            except TimeoutError:
                if self._closed:
                    raise ConnectionLost("the connection to the Lambent daemon was closed") from None
                continue
            except OSError as error:
                raise ConnectionLost(f"the connection to the Lambent daemon broke: {error}") from None
            self.sent_at = time.monotonic()
            view = view[sent:]


def _sealed_memory(size, fill):
    """A file descriptor of size bytes of memory that fill(writable buffer) wrote and that can never change again."""
    descriptor = os.memfd_create("lambent-arrays", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    try:
        os.ftruncate(descriptor, size)
        # The write seal is refused while a writable mapping exists, so the mapping must be gone before it.
        with mmap.mmap(descriptor, size) as memory:
            fill(memory)
        fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_WRITE)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor
