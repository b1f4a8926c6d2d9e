# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""One session with a daemon: handshake, arrays, transactions, render control and the events that come back.

Two threads serve a client: a reader that queues events and a writer that sends, so that its owner never blocks on the
socket. The owner calls it from one thread at a time.
"""

import hmac
import queue
import secrets
import threading
import time

from . import messages
from .connection import Connection, ConnectionLost, DaemonHangs, open_socket

HANDSHAKE_SECONDS = 5.0
HANG_SECONDS = 6.0
PING_AFTER_SECONDS = 1.0
MAX_BATCH_BYTES = 256 << 20
MAX_TRANSACTION_BYTES = 32 << 20


class DaemonError(Exception):
    """The daemon refused a request. The text is the daemon's, fit for a user."""


class Stopped(Exception):
    """The owner's should_stop said so while the client waited for an answer."""


class Client:
    """A session. After ConnectionLost it is of no more use; close it and connect anew.

    capabilities: the object of the daemon's welcome. version: the daemon's. session: its number for this session.
    """

    def __init__(self, address, token, name):
        """Connects and shakes hands; address as for parse_address, token as hex text, name for the daemon's log.

        Raises ConnectionLost within seconds whatever is at the other end.
        """
        try:
            connected = open_socket(address, HANDSHAKE_SECONDS)
        except (OSError, ValueError) as error:
            raise ConnectionLost(f"cannot reach the Lambent daemon at {address}: {error}") from None
        self._connection = Connection(connected)
        try:
            welcome = _shake_hands(self._connection, token, name)
        except messages.ProtocolError as error:
            self._connection.close()
            raise ConnectionLost(f"what answers at {address} is not a Lambent daemon of this protocol: {error}") from None
        except ConnectionLost:
            self._connection.close()
            raise
        self.capabilities = welcome.get("capabilities") or {}
        self.version = str(welcome.get("version", ""))
        self.session = welcome.get("session")
        if not self.capabilities.get("shared_memory", False):
            self._connection.shared_memory = False
        self._events = queue.SimpleQueue()
        self._outgoing = queue.SimpleQueue()
        self._lost = None
        self._ping_queued_at = None
        self._ping_written_at = None
        self._tiles_lock = threading.Lock()
        self._tiles_allowed = 0
        self._threads = [
            threading.Thread(target=self._read, name="lambent-reader", daemon=True),
            threading.Thread(target=self._write, name="lambent-writer", daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    @property
    def usable(self):
        """False once the connection is known to be lost or closed."""
        return self._lost is None

    @property
    def hung(self):
        """Whether the connection was given up because the daemon did not answer."""
        return isinstance(self._lost, DaemonHangs)

    def limit(self, name, default):
        """An announced limit, or default where the daemon announces none."""
        value = (self.capabilities.get("limits") or {}).get(name)
        return value if isinstance(value, int) and value > 0 else default

    def post(self, header):
        """Queues a message without payload: a dict with "type", or its encoded JSON. Never blocks."""
        self._outgoing.put(header)

    def allow_tiles(self, tiles):
        """Lets the daemon send that many tiles from now on; those it was allowed before and has not sent count."""
        with self._tiles_lock:
            more = tiles - self._tiles_allowed
            if more > 0:
                self._tiles_allowed += more
                self.post({"type": "tile_credit", "tiles": more})

    @property
    def tiles_allowed(self):
        """How many tiles the daemon may still send."""
        return self._tiles_allowed

    def next_event(self, timeout_seconds):
        """(header, payload) of the next message, or None after timeout_seconds.

        Raises ConnectionLost when the connection broke, or when the daemon has answered nothing, not even a ping, for
        HANG_SECONDS.
        """
        try:
            event = self._events.get(timeout=timeout_seconds)
        except queue.Empty:
            self._check_alive()
            return None
        if isinstance(event, Exception):
            raise event
        return event

    def ask(self, header, answer_type, should_stop):
        """Posts header and returns the first message of answer_type, dropping others (they belong to superseded renders).

        Raises DaemonError for an `error` message, Stopped once should_stop() is true, ConnectionLost.
        """
        self.post(header)
        return self._wait_for(answer_type, should_stop)

    def send_arrays(self, arrays, should_stop):
        """Makes {hash: wire array} known to the session; what the daemon already has is not sent. Empties the dict.

        Returns the bytes sent. Raises as ask, and DaemonError for an array over the daemon's limits.
        """
        if not arrays:
            return 0
        largest_payload = self.limit("payload_bytes", MAX_BATCH_BYTES)
        for array in arrays.values():
            if array.nbytes > largest_payload:
                raise DaemonError(f"an array of {array.nbytes} bytes is over the daemon's limit of {largest_payload}")
        answer = self.ask({"type": "arrays_query", "hashes": list(arrays)}, "arrays_missing", should_stop)
        missing = [key for key in answer.get("hashes", ()) if key in arrays]
        sent = batch_bytes = 0
        batch = {}
        for key in missing:
            array = arrays.pop(key)
            padded = array.nbytes + messages.ARRAY_ALIGNMENT
            if batch and batch_bytes + padded > min(largest_payload, MAX_BATCH_BYTES):
                self._outgoing.put(_Arrays(batch))
                batch, batch_bytes = {}, 0
            batch[key] = array
            batch_bytes += padded
            sent += array.nbytes
        if batch:
            self._outgoing.put(_Arrays(batch))
        arrays.clear()
        return sent

    def commit(self, epoch, edits, should_stop):
        """Sends edits (encoded JSON objects) as one transaction, or as several where one would be over the header limit.

        Returns the daemon's messages about them. Raises DaemonError where a transaction was not accepted, else as ask.
        """
        reports = []
        for part in _parts(edits, min(MAX_TRANSACTION_BYTES, self.limit("header_bytes", MAX_TRANSACTION_BYTES) - 1024)):
            head = b'{"type":"transaction","epoch":%d,"edits":[' % epoch
            result = self.ask(head + b",".join(part) + b"]}", "transaction_result", should_stop)
            found = [message for message in result.get("messages") or () if isinstance(message, dict)]
            if not result.get("accepted"):
                reasons = "; ".join(str(message.get("text", "")) for message in found) or "no reason given"
                raise DaemonError(f"the Lambent daemon did not accept the scene: {reasons}")
            reports += found
        return reports

    def close(self):
        """Says goodbye, ends the session and its threads. Takes at most about a second."""
        if self._lost is None:
            self._lost = ConnectionLost("the session was closed")
            self._outgoing.put({"type": "bye"})
            self._outgoing.put(None)
            self._threads[1].join(0.5)
        self._connection.close()
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(1.0)

    def _wait_for(self, answer_type, should_stop):
        while True:
            event = self.next_event(0.05)
            if event is None:
                if should_stop():
                    raise Stopped()
                continue
            header = event[0]
            if header["type"] == answer_type:
                return header
            if header["type"] == "error":
                raise DaemonError(str(header.get("message", "the Lambent daemon reported an error without a text")))

    def _check_alive(self):
        if self._lost is not None:
            raise self._lost
        now = time.monotonic()
        connection = self._connection
        if self._ping_queued_at is None:
            if now - connection.received_at > PING_AFTER_SECONDS:
                self._ping_queued_at = now
                self._ping_written_at = None
                self._outgoing.put({"type": "ping", "cookie": int(now * 1000)})
        elif connection.received_at > self._ping_queued_at:
            self._ping_queued_at = None
        else:
            # Before the ping is on the wire, bytes that leave are a sign of life (a long upload); after it, only answers are.
            if self._ping_written_at is None:
                quiet_since = max(self._ping_queued_at, connection.sent_at)
            else:
                quiet_since = self._ping_written_at
            if now - quiet_since > HANG_SECONDS:
                self._fail(DaemonHangs(f"the Lambent daemon hangs: no answer for {now - quiet_since:.0f} seconds"))
                raise self._lost

    def _fail(self, error):
        if self._lost is None:
            self._lost = error
            self._events.put(error)
            self._connection.close()

    def _read(self):
        try:
            while True:
                header, payload = self._connection.receive()
                if header["type"] == "tile":
                    with self._tiles_lock:
                        self._tiles_allowed -= 1
                if header["type"] != "pong":
                    self._events.put((header, payload))
        except messages.ProtocolError as error:
            self._fail(ConnectionLost(f"the Lambent daemon sent something that is not the protocol: {error}"))
        except ConnectionLost as error:
            self._fail(error)

    def _write(self):
        try:
            while True:
                item = self._outgoing.get()
                if item is None:
                    return
                if isinstance(item, _Arrays):
                    self._connection.send_arrays(item.arrays)
                    continue
                self._connection.send(item)
                if isinstance(item, dict) and item["type"] == "ping":
                    self._ping_written_at = time.monotonic()
        except ConnectionLost as error:
            self._fail(error)
        except OSError as error:
            self._fail(ConnectionLost(f"arrays could not be sent to the Lambent daemon: {error}"))


class _Arrays:
    """A batch of arrays on its way; freed as soon as it is sent."""

    def __init__(self, arrays):
        self.arrays = arrays


def _parts(edits, largest_bytes):
    """Lists of edits whose encoded size together stays under largest_bytes (a single larger one is alone)."""
    part, size = [], 0
    for edit in edits:
        if part and size + len(edit) + 1 > largest_bytes:
            yield part
            part, size = [], 0
        part.append(edit)
        size += len(edit) + 1
    if part:
        yield part


def _shake_hands(connection, token, name):
    """The daemon's welcome, after each side has proved that it holds token. Raises ConnectionLost or ProtocolError."""
    deadline = time.monotonic() + HANDSHAKE_SECONDS
    challenge, _ = connection.receive(deadline)
    _raise_on_error(challenge)
    if challenge["type"] != "challenge" or not isinstance(challenge.get("nonce"), str):
        raise messages.ProtocolError(f"expected a challenge, got '{challenge['type']}'")
    if challenge.get("protocol") != messages.PROTOCOL_VERSION:
        raise ConnectionLost(
            f"the Lambent daemon speaks protocol {challenge.get('protocol')}, this add-on {messages.PROTOCOL_VERSION}: "
            "install matching versions"
        )
    nonce = secrets.token_hex(32)
    connection.send(
        {
            "type": "hello",
            "protocol": messages.PROTOCOL_VERSION,
            "client": name,
            "nonce": nonce,
            "proof": messages.client_proof(token, challenge["nonce"], nonce),
        }
    )
    welcome, _ = connection.receive(deadline)
    _raise_on_error(welcome)
    if welcome["type"] != "welcome":
        raise messages.ProtocolError(f"expected a welcome, got '{welcome['type']}'")
    expected = messages.daemon_proof(token, challenge["nonce"], nonce)
    if not hmac.compare_digest(expected.encode(), str(welcome.get("proof", "")).encode()):
        raise ConnectionLost("the Lambent daemon could not prove that it holds the token")
    return welcome


def _raise_on_error(header):
    if header["type"] == "error":
        raise ConnectionLost(f"the Lambent daemon refused the connection: {header.get('message', header.get('code'))}")
