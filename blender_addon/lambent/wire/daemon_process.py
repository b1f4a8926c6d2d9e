# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Finding lambentd, and running one as an owned child with a private socket and token."""

import os
import secrets
import shutil
import signal
import subprocess
import tempfile
import threading
import time

PROGRAM = "lambentd"
# A daemon that lives is waited for: on a machine with much other work its start can take a minute. One that died is not.
START_SECONDS = 120.0
STOP_SECONDS = 2.0
_LOG_TAIL_BYTES = 2000


class DaemonUnavailable(Exception):
    """No daemon could be found or started. The text is complete and fit for a user."""


def find_program(preferred="", bundled_directory=""):
    """The path of lambentd: $LAMBENT_DAEMON, else preferred, else in bundled_directory, else on PATH.

    Raises DaemonUnavailable, naming what was looked at; a place that names a file which cannot be run is an error, not
    a reason to look further.
    """
    for source, path in (("LAMBENT_DAEMON", os.environ.get("LAMBENT_DAEMON", "")), ("the add-on's preferences", preferred)):
        if path:
            path = os.path.expanduser(path)
            if not os.access(path, os.X_OK) or os.path.isdir(path):
                raise DaemonUnavailable(f"'{path}', set in {source} as the Lambent daemon, is not a program")
            return path
    bundled = os.path.join(bundled_directory, PROGRAM) if bundled_directory else ""
    if bundled and os.access(bundled, os.X_OK):
        return bundled
    found = shutil.which(PROGRAM)
    if found:
        return found
    raise DaemonUnavailable(
        f"no Lambent daemon was found: set its path in the add-on's preferences or in LAMBENT_DAEMON, or put {PROGRAM} on PATH"
    )


def default_token_file():
    """Where a daemon that nobody told otherwise keeps its token (PROTOCOL.md, handshake)."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    directory = os.path.join(runtime, "lambent") if runtime else os.path.join("/tmp", f"lambent-{os.getuid()}")
    return os.path.join(directory, "token")


def read_token(path):
    """The token in a token file, as hex text. Raises DaemonUnavailable."""
    try:
        with open(path, encoding="ascii") as file:
            return file.read().strip()
    except (OSError, UnicodeDecodeError) as error:
        raise DaemonUnavailable(f"the Lambent daemon's token cannot be read from '{path}': {error}") from None


class DaemonProcess:
    """A lambentd of our own, for connections at address with token once wait_until_ready() has returned.

    Its socket, token and log lie in a directory that only this user can read and that stop() removes.
    """

    def __init__(self, program, threads=0):
        """Starts program and does not wait until it listens. threads: 0 for all. Raises DaemonUnavailable."""
        self._program = program
        runtime = os.environ.get("XDG_RUNTIME_DIR")
        # Socket paths hold about 100 bytes, so the directory must be near the root.
        parent = runtime if runtime and os.access(runtime, os.W_OK) and len(runtime) < 60 else "/tmp"
        self._directory = tempfile.mkdtemp(prefix="lambent-", dir=parent)
        self._socket_path = os.path.join(self._directory, "socket")
        self._log_path = os.path.join(self._directory, "log")
        token_path = os.path.join(self._directory, "token")
        self.token = secrets.token_hex(32)
        self.address = f"unix:{self._socket_path}"
        with open(os.open(token_path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="ascii") as file:
            file.write(self.token + "\n")
        command = [program, "--socket", self._socket_path, "--token-file", token_path, "--log-file", self._log_path]
        command += ["--owner-pid", str(os.getpid())]
        if threads > 0:
            command += ["--threads", str(threads)]
        try:
            with open(self._log_path, "ab") as log:
                # A session of its own: Ctrl-C in the terminal is for Blender, which then cancels in good order.
                self._process = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log, start_new_session=True
                )
        except OSError as error:
            shutil.rmtree(self._directory, ignore_errors=True)
            raise DaemonUnavailable(f"the Lambent daemon '{program}' cannot be started: {error}") from None
        self._ready = threading.Event()
        threading.Thread(target=self._watch_output, name="lambent-daemon-output", daemon=True).start()

    @property
    def pid(self):
        """The process id of the daemon."""
        return self._process.pid

    @property
    def running(self):
        """Whether the process still lives."""
        return self._process.poll() is None

    def describe_end(self, patience_seconds=0.0):
        """How the process ended and the last lines of its log, or "" if it still runs after patience_seconds."""
        try:
            self._process.wait(patience_seconds)
        except subprocess.TimeoutExpired:
            return ""
        code = self._process.returncode
        how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"
        log = self._log_tail()
        return f"the daemon {how}" + (f"; its log ends: {log}" if log else "")

    def stop(self, patience_seconds=STOP_SECONDS):
        """Ends the process, by force after patience_seconds, and removes its files."""
        if self.running:
            self._process.terminate()
            try:
                self._process.wait(patience_seconds)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        shutil.rmtree(self._directory, ignore_errors=True)

    def wait_until_ready(self):
        """Returns once the daemon listens, at once if it does. Raises DaemonUnavailable, and the process is gone, if it ended or
        takes too long."""
        program = self._program
        deadline = time.monotonic() + START_SECONDS
        while not self._ready.wait(0.02):
            if not self.running:
                reason = self.describe_end()
                self.stop()
                raise DaemonUnavailable(f"the Lambent daemon '{program}' did not start: {reason}")
            if time.monotonic() > deadline:
                self._process.kill()
                self._process.wait()
                log = self._log_tail()
                self.stop()
                raise DaemonUnavailable(
                    f"the Lambent daemon '{program}' runs but was not ready after {START_SECONDS:.0f} s, and was ended"
                    + (f"; its log ends: {log}" if log else "; it wrote no log")
                )

    def _watch_output(self):
        with self._process.stdout as output:
            for line in output:
                if line.startswith(b"lambentd listening on "):
                    self._ready.set()

    def _log_tail(self):
        try:
            with open(self._log_path, "rb") as log:
                log.seek(0, os.SEEK_END)
                log.seek(max(0, log.tell() - _LOG_TAIL_BYTES))
                lines = log.read().decode("utf-8", "replace").strip().splitlines()
        except OSError:
            return ""
        return " / ".join(lines[-3:])
