# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Sessions with the daemon that outlive a render, so that the next frame sends only what changed."""

import os
import threading

import bpy

from ..sync.edits import SyncState
from ..sync.passes import ONLY_COMBINED
from ..ui.preferences import preferences
from ..wire import daemon_process
from ..wire.client import Client
from ..wire.connection import ConnectionLost, parse_address

VERSION = "0.1.0"

_lock = threading.RLock()
_owned_daemon = None
_owned_daemon_answered = False
_sessions = {}
_offered_integrators = None
_offered_passes = None


class RenderSession:
    """A client, what it has told the daemon, and the last epoch used. One render uses it at a time (busy).

    pass_kinds: the protocol's kinds of passes that the daemon has.
    """

    def __init__(self, client, local):
        self.client = client
        self.local = local
        self.state = SyncState()
        self.pass_kinds = ONLY_COMBINED | frozenset(client.capabilities.get("passes") or ())
        self.epoch = 0
        self.busy = False

    def next_epoch(self):
        """A number above all before."""
        self.epoch += 1
        return self.epoch


def acquire(role):
    """A session for role (any hashable), which keeps it for its next use, marked busy until release().

    Raises ConnectionLost or daemon_process.DaemonUnavailable.
    """
    with _lock:
        session = _sessions.get(role)
        if session is not None and session.busy:
            # Two at once in the same role (previews are): the second gets one that is not kept.
            role, session = None, None
        if session is not None and not session.client.usable:
            session.client.close()
            del _sessions[role]
            session = None
        if session is None:
            session = _connect()
            if role is not None:
                _sessions[role] = session
        session.busy = True
        return session


def release(session):
    """Ends one use of a session; it is closed if its connection broke or no role keeps it."""
    with _lock:
        session.busy = False
        kept = [role for role, other in _sessions.items() if other is session]
        if kept and session.client.usable:
            return
        for role in kept:
            del _sessions[role]
        if session.client.hung:
            _end_daemon()
    session.client.close()


def close_sessions():
    """Ends all sessions; the daemon stays."""
    with _lock:
        for session in _sessions.values():
            session.client.close()
        _sessions.clear()


def close_all():
    """Ends all sessions, and the daemon if it is ours."""
    global _owned_daemon
    close_sessions()
    with _lock:
        if _owned_daemon is not None:
            _owned_daemon.stop()
            _owned_daemon = None


def offered_integrators():
    """The names of the integrators of the daemon that was connected last, or None before there was one."""
    return _offered_integrators


def offered_passes():
    """The kinds of passes of the daemon that was connected last, or None before there was one."""
    return _offered_passes


def describe_lost(error):
    """The text for a user of a ConnectionLost, with how our own daemon ended where it did."""
    with _lock:
        daemon = _owned_daemon
    # A connection breaks before its process can be asked how it ended.
    end = "" if daemon is None else daemon.describe_end(patience_seconds=0.5)
    return f"{error} ({end})" if end else str(error)


def _connect():
    """A new session; if our own daemon, which answered before, does not, with another one in its place."""
    global _owned_daemon_answered, _offered_integrators, _offered_passes
    name = f"lambent-addon {VERSION} / Blender {bpy.app.version_string}"
    address, token, local = _daemon()
    try:
        client = Client(address, token, name)
    except ConnectionLost:
        if not _owned_daemon_answered:
            raise
        _end_daemon()
        address, token, local = _daemon()
        client = Client(address, token, name)
    _owned_daemon_answered = _owned_daemon is not None
    _offered_integrators = tuple(client.capabilities.get("integrators") or ()) or None
    session = RenderSession(client, local)
    _offered_passes = session.pass_kinds
    return session


def expect_render():
    """Starts our own daemon, if renders will need it, and does not wait for it: it is ready by the time something renders.

    Where it cannot be started nothing is said: the render will say it.
    """
    with _lock:
        if _configured_address():
            return
        try:
            _start_daemon()
        except daemon_process.DaemonUnavailable:
            pass


def _configured_address():
    """The address that is configured, or "": then a daemon of our own is used."""
    chosen = preferences()
    return os.environ.get("LAMBENT_ADDRESS") or (chosen.address if chosen else "")


def _start_daemon():
    """Starts our own daemon unless it runs, and does not wait for it."""
    global _owned_daemon
    if _owned_daemon is not None and not _owned_daemon.running:
        _end_daemon()
    if _owned_daemon is None:
        chosen = preferences()
        bundled = os.path.join(os.path.dirname(os.path.dirname(__file__)), "bin")
        program = daemon_process.find_program(bpy.path.abspath(chosen.daemon_path) if chosen else "", bundled)
        _owned_daemon = daemon_process.DaemonProcess(program, chosen.threads if chosen else 0)


def _end_daemon():
    """Ends our own daemon, if there is one, by force if need be; the next session starts another."""
    global _owned_daemon, _owned_daemon_answered
    if _owned_daemon is not None:
        _owned_daemon.stop(0.2)
    _owned_daemon, _owned_daemon_answered = None, False


def _daemon():
    """(address, token, whether it shares our file system) of the daemon to use, started if need be."""
    global _owned_daemon
    chosen = preferences()
    address = _configured_address()
    if address:
        token_file = os.environ.get("LAMBENT_TOKEN_FILE") or (chosen.token_file if chosen else "")
        token = daemon_process.read_token(bpy.path.abspath(token_file) or daemon_process.default_token_file())
        try:
            kind, target = parse_address(address)
        except ValueError as error:
            raise ConnectionLost(str(error)) from None
        return address, token, kind == "unix" or target[0] in ("127.0.0.1", "::1", "localhost")
    _start_daemon()
    try:
        _owned_daemon.wait_until_ready()
    except daemon_process.DaemonUnavailable:
        _owned_daemon = None
        raise
    return _owned_daemon.address, _owned_daemon.token, True
