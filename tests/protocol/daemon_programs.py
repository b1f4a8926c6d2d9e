"""Starts real daemon processes for the tests; the fixtures that do.

`lambentd` is the real one; `lambentd_stand_in` has a stand-in for its session, with known timing.

The programs are looked for in $LAMBENT_BUILD_DIR/bin (default: build/release); a test skips where one is absent.
"""

import itertools
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("LAMBENT_BUILD_DIR", ROOT / "build" / "release")) / "bin"
sys.path.insert(0, str(ROOT / "blender_addon" / "lambent"))

from wire import client as wire_client  # noqa: E402
from wire import connection as wire_connection  # noqa: E402


_process_numbers = itertools.count()


class Daemon:
    """A daemon process in a folder of its own; `arguments` come after --socket and --token-file."""

    def __init__(self, program, folder, *arguments, wait=True):
        self.program = BIN / program
        if not self.program.exists():
            pytest.skip(f"{self.program} is not built")
        self.folder = pathlib.Path(folder)
        self.socket_path = str(self.folder / "socket")
        self.token_path = self.folder / "token"
        self.log_path = self.folder / "log"
        command = [str(self.program), "--socket", self.socket_path, "--token-file", str(self.token_path)]
        # A file for each process, opened to append: the daemon writes at its end wherever errors() has read.
        self.stderr = open(self.folder / f"stderr-{next(_process_numbers)}", "a+b")
        self.process = subprocess.Popen(
            [*command, "--log-file", str(self.log_path), *arguments],
            stdout=subprocess.PIPE,
            stderr=self.stderr,
            # In a sanitizer's build: give freed memory back, since tests measure it.
            env={**os.environ, "ASAN_OPTIONS": "quarantine_size_mb=1:allocator_release_to_os_interval_ms=0"},
        )
        if wait:
            line = self.process.stdout.readline().decode()
            assert line.startswith("lambentd listening on " + self.socket_path), (line, self.errors())
            self.ready_line = line.strip()
        # Read on, so that the daemon never blocks on its output.
        threading.Thread(target=self.process.stdout.read, daemon=True).start()

    @property
    def token(self):
        return self.token_path.read_text().strip()

    def errors(self):
        self.stderr.seek(0)
        return self.stderr.read().decode("utf-8", "replace")

    def log(self):
        return self.log_path.read_text()

    def connect(self):
        """A connection before its handshake."""
        return wire_connection.Connection(wire_connection.open_socket("unix:" + self.socket_path, 5))

    def client(self, name="test"):
        return wire_client.Client("unix:" + self.socket_path, self.token, name)

    @property
    def sanitized(self):
        """Whether the program was built with the address sanitizer, whose books take an eighth of what is allocated."""
        return b"__asan_init" in self.program.read_bytes()

    def memory_bytes(self):
        with open(f"/proc/{self.process.pid}/statm") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")

    def thread_count(self):
        return len(os.listdir(f"/proc/{self.process.pid}/task"))

    def descriptor_count(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    def stop(self):
        """Ends the daemon in order; fails if it does not end well, or a sanitizer found something."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            code = self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise AssertionError("the daemon did not end: " + self.errors()[-2000:]) from None
        assert "Sanitizer" not in self.errors() and "runtime error" not in self.errors(), self.errors()
        return code


def wait_until(condition, seconds=10.0):
    """Waits for condition() to be true; its last value."""
    deadline = time.monotonic() + seconds
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.02)
    return condition()


@pytest.fixture
def folder():
    # Socket paths are short; pytest's own folders may not be.
    with tempfile.TemporaryDirectory(prefix="lambent-test-") as name:
        yield name


def _served(program, folder):
    """A running daemon, ended in order after the test."""
    started = Daemon(program, folder)
    yield started
    if started.process.poll() is None:
        assert started.stop() == 0
    started.stderr.close()


@pytest.fixture(params=["lambentd_stand_in", "lambentd"])
def daemon(request, folder):
    """Either program."""
    yield from _served(request.param, folder)


@pytest.fixture
def stand_in(folder):
    yield from _served("lambentd_stand_in", folder)


@pytest.fixture
def real(folder):
    yield from _served("lambentd", folder)
