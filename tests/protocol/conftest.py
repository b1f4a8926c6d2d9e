"""Fixtures: running daemons. See daemon_programs.py."""

import pathlib
import sys
import tempfile

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parent))

from daemon_programs import Daemon  # noqa: E402


@pytest.fixture
def folder():
    # Socket paths are short; pytest's own folders may not be.
    with tempfile.TemporaryDirectory(prefix="lambent-test-") as name:
        yield name


@pytest.fixture(params=["lambentd_stand_in", "lambentd"])
def daemon(request, folder):
    """Either program, ended in order after the test."""
    started = Daemon(request.param, folder)
    yield started
    if started.process.poll() is None:
        assert started.stop() == 0
    started.stderr.close()


@pytest.fixture
def stand_in(folder):
    started = Daemon("lambentd_stand_in", folder)
    yield started
    if started.process.poll() is None:
        assert started.stop() == 0
    started.stderr.close()


@pytest.fixture
def real(folder):
    started = Daemon("lambentd", folder)
    yield started
    if started.process.poll() is None:
        assert started.stop() == 0
    started.stderr.close()
