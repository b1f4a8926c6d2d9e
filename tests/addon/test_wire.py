# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's wire code outside Blender: golden bytes, the client against a daemon, and daemons that misbehave."""

import json
import os
import pathlib
import socket
import subprocess
import tempfile
import threading
import time

import numpy as np
import pytest

from harness import FAKE_DAEMON, ROOT
from wire import client as wire_client
from wire import daemon_process, messages
from wire.client import Client, DaemonError, Stopped
from wire.connection import Connection, ConnectionLost, parse_address

GOLDEN = pathlib.Path(ROOT, "tests", "protocol", "golden")
NAMES = sorted(path.stem for path in GOLDEN.glob("*.json"))
DTYPES = {"u8": np.uint8, "u16": np.uint16, "u32": np.uint32, "i32": np.int32, "f32": np.float32}


def golden(name):
    return (GOLDEN / f"{name}.bin").read_bytes(), json.loads((GOLDEN / f"{name}.json").read_text(encoding="utf-8"))


def split_frame(data, offset):
    """(flags, header, payload, offset of the next frame)."""
    start = offset + messages.PRELUDE.size
    flags, header_bytes, payload_bytes = messages.decode_prelude(data[offset:start], 1 << 30)
    end = start + header_bytes + payload_bytes
    if end > len(data):
        raise messages.ProtocolError("the stream ends inside the frame")
    return flags, messages.decode_header(data[start : start + header_bytes]), data[start + header_bytes : end], end


@pytest.mark.parametrize("name", NAMES)
def test_golden_frames_are_read(name):
    data, description = golden(name)
    offset = 0
    for expected in description["frames"]:
        flags, header, payload, offset = split_frame(data, offset)
        assert (flags, header, len(payload)) == (expected["flags"], expected["header"], expected["payload_bytes"])
        for descriptor in expected["arrays"]:
            values = messages.read_array(payload, descriptor)
            assert values.dtype == DTYPES[descriptor["dtype"]]
            assert (values.reshape(-1) == np.array(descriptor["values"], values.dtype)).all()
            assert messages.array_hash(values) == descriptor["hash"]
    if "error" not in description:
        assert offset == len(data)
    elif name != "malformed_too_deep":
        # Depth is the daemon's limit: a client believes the daemon it has authenticated.
        with pytest.raises(messages.ProtocolError):
            split_frame(data, offset)


@pytest.mark.parametrize("name", [name for name in NAMES if not name.startswith("malformed")])
def test_golden_frames_are_written_byte_for_byte(name):
    data, description = golden(name)
    written = b""
    for expected in description["frames"]:
        header, payload = expected["header"], b""
        if "pixels" in expected:
            payload = np.array(expected["pixels"], np.float32).tobytes()
        if expected["arrays"]:
            made = [np.array(d["values"], DTYPES[d["dtype"]]).reshape(d["shape"]) for d in expected["arrays"]]
            arrays = {messages.array_hash(array): array for array in map(messages.wire_array, made)}
            descriptors, size = messages.describe_arrays(arrays)
            payload = bytearray(size)
            messages.fill_payload(payload, descriptors, arrays)
            header = {"type": "arrays", "arrays": descriptors}
        written += messages.encode_frame(header, payload)
    assert written == data


def test_golden_proofs_are_computed():
    _, description = golden("handshake")
    nonces = description["token"], description["daemon_nonce"], description["client_nonce"]
    assert messages.client_proof(*nonces) == description["proofs"]["client"]
    assert messages.daemon_proof(*nonces) == description["proofs"]["daemon"]


def test_the_golden_files_are_those_of_the_script(tmp_path):
    script = tmp_path / "make_golden.py"
    script.write_bytes((GOLDEN / "make_golden.py").read_bytes())
    subprocess.run(["/usr/bin/python3", str(script)], check=True)
    made = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    kept = {path.name: path.read_bytes() for path in GOLDEN.iterdir() if path.is_file()}
    assert made == kept


def test_descriptors_outside_the_payload_are_refused():
    for descriptor in (
        {"dtype": "f32", "shape": [2], "offset": 16},
        {"dtype": "f32", "shape": [1], "offset": 1},
        {"dtype": "f32", "shape": [-1], "offset": 0},
        {"dtype": "f64", "shape": [1], "offset": 0},
        {"dtype": "f32", "shape": "1", "offset": 0},
    ):
        with pytest.raises(messages.ProtocolError):
            messages.read_array(bytes(16), descriptor)


@pytest.mark.parametrize("text", ["", "host", "host:", ":1", "host:port"])
def test_addresses_that_make_no_sense_are_refused(text):
    with pytest.raises(ValueError):
        parse_address(text)


def test_addresses_are_understood():
    assert parse_address("unix:/a/b") == ("unix", "/a/b") and parse_address("/a/b") == ("unix", "/a/b")
    assert parse_address("farm:80") == ("tcp", ("farm", 80)) and parse_address("[::1]:80") == ("tcp", ("::1", 80))


@pytest.fixture
def daemon(monkeypatch, tmp_path):
    """A running fake daemon, as DaemonProcess; its mode is in the file mode, its record in the folder record."""
    record = tmp_path / "record"
    record.mkdir()
    monkeypatch.setenv("LAMBENT_FAKE_RECORD", str(record))
    monkeypatch.setenv("LAMBENT_FAKE_MODE_FILE", str(tmp_path / "mode"))
    process = daemon_process.DaemonProcess(FAKE_DAEMON)
    process.wait_until_ready()
    yield process
    process.stop()


def slow_daemon(folder, seconds, then):
    """A program that does nothing for some seconds and then is the command `then`, with lambentd's arguments."""
    path = folder / "slow_daemon"
    path.write_text(f'#!/bin/sh\nsleep {seconds}\nexec {then} "$@"\n')
    path.chmod(0o755)
    return str(path)


def test_a_daemon_that_takes_longer_than_fifteen_seconds_to_start_is_waited_for(tmp_path):
    process = daemon_process.DaemonProcess(slow_daemon(tmp_path, 16, FAKE_DAEMON))
    process.wait_until_ready()
    client = Client(process.address, process.token, "test")
    client.close()
    process.stop()


def test_a_daemon_that_never_listens_is_ended_and_named(tmp_path, monkeypatch):
    monkeypatch.setattr(daemon_process, "START_SECONDS", 1.0)
    with tempfile.TemporaryDirectory(prefix="lambent-test-") as runtime:
        monkeypatch.setenv("XDG_RUNTIME_DIR", runtime)
        program = slow_daemon(tmp_path, 0, "sleep 60 #")
        with pytest.raises(daemon_process.DaemonUnavailable, match="slow_daemon.* was not ready after 1 s, and was ended"):
            daemon_process.DaemonProcess(program).wait_until_ready()
        assert os.listdir(runtime) == []


def test_a_daemon_that_dies_while_it_starts_is_not_waited_for(tmp_path):
    started = time.monotonic()
    with pytest.raises(daemon_process.DaemonUnavailable, match="ended with code 3; its log ends: no such thing"):
        daemon_process.DaemonProcess(slow_daemon(tmp_path, 0.5, "sh -c 'echo no such thing >&2; exit 3' #")).wait_until_ready()
    assert time.monotonic() - started < daemon_process.START_SECONDS / 4


def never():
    return False


def test_arrays_travel_once_and_large_ones_in_batches(daemon, monkeypatch):
    monkeypatch.setattr(wire_client, "MAX_BATCH_BYTES", 1000)
    client = Client(daemon.address, daemon.token, "test")
    made = {}
    for index in range(5):
        array = np.full(100, index, np.float32)
        made[messages.array_hash(array)] = array
    assert client.send_arrays(dict(made), never) == 2000
    assert client.send_arrays(dict(made), never) == 0
    # Arrays are not answered: a question that is, behind them on the same stream, tells that they arrived.
    client.ask({"type": "arrays_query", "hashes": []}, "arrays_missing", never)
    client.close()
    import pickle

    folder = os.environ["LAMBENT_FAKE_RECORD"]
    names = [name for name in sorted(os.listdir(folder)) if name.endswith(".pickle")]  # not those being written
    recorded = [pickle.load(open(os.path.join(folder, name), "rb")) for name in names]
    batches = [message["arrays"] for message in recorded if message["header"]["type"] == "arrays"]
    assert [len(batch) for batch in batches] == [2, 2, 1]
    assert all(message["header"].get("in_fd") for message in recorded if message["header"]["type"] == "arrays")
    assert {key for batch in batches for key in batch} == set(made)


def test_a_transaction_over_the_header_limit_is_split(daemon, monkeypatch):
    monkeypatch.setattr(wire_client, "MAX_TRANSACTION_BYTES", 500)
    client = Client(daemon.address, daemon.token, "test")
    edits = [messages.encode_json({"op": "upsert", "kind": "light", "id": str(i), "value": {"name": "n" * 100}}) for i in range(10)]
    assert client.commit(1, edits, never) == []
    client.close()
    assert len([name for name in os.listdir(os.environ["LAMBENT_FAKE_RECORD"])]) > 3


def test_a_killed_daemon_is_noticed_and_how_it_ended_is_told(daemon):
    client = Client(daemon.address, daemon.token, "test")
    os.kill(daemon.pid, 9)
    with pytest.raises(ConnectionLost):
        while True:
            client.next_event(0.1)
    assert "SIGKILL" in daemon.describe_end(patience_seconds=5)
    client.close()


def test_an_end_that_comes_just_after_the_connection_broke_is_told(daemon):
    assert daemon.describe_end() == "" and daemon.describe_end(patience_seconds=0.05) == ""
    threading.Timer(0.2, os.kill, (daemon.pid, 9)).start()
    assert "SIGKILL" in daemon.describe_end(patience_seconds=5)


def test_a_stopped_daemon_is_noticed_by_ping(daemon):
    client = Client(daemon.address, daemon.token, "test")
    os.kill(daemon.pid, 19)
    started = time.monotonic()
    with pytest.raises(ConnectionLost, match="hangs"):
        while True:
            client.next_event(0.1)
    assert 5 < time.monotonic() - started < 12
    client.close()
    os.kill(daemon.pid, 18)


def test_a_quiet_daemon_that_answers_pings_is_not_called_hung(daemon, monkeypatch):
    monkeypatch.setattr(wire_client, "HANG_SECONDS", 1.5)
    client = Client(daemon.address, daemon.token, "test")
    started = time.monotonic()
    while time.monotonic() - started < 4:
        assert client.next_event(0.1) is None
    client.close()


def test_waiting_ends_when_the_owner_says_stop(daemon):
    client = Client(daemon.address, daemon.token, "test")
    with pytest.raises(Stopped):
        client.ask({"type": "ping", "cookie": 1}, "an answer that never comes", lambda: True)
    client.close()


def test_a_wrong_token_is_refused(daemon):
    with pytest.raises(ConnectionLost, match="the proof is wrong"):
        Client(daemon.address, "00" * 32, "test")


def test_an_array_over_the_limit_is_refused_before_it_is_sent(daemon):
    client = Client(daemon.address, daemon.token, "test")
    client.capabilities = {"limits": {"payload_bytes": 100}}
    with pytest.raises(DaemonError, match="limit"):
        client.send_arrays({"0" * 32: np.zeros(100, np.float32)}, never)
    client.close()


def test_a_daemon_that_does_not_know_the_token_is_not_trusted(tmp_path):
    path = str(tmp_path / "socket")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(path)
        listener.listen()

        def impostor():
            connected, _ = listener.accept()
            peer = Connection(connected)
            peer.send({"type": "challenge", "protocol": 1, "nonce": "00" * 32})
            peer.receive()
            peer.send({"type": "welcome", "protocol": 1, "version": "x", "session": 1, "proof": "00" * 32, "capabilities": {}})
            time.sleep(0.5)
            peer.close()

        thread = threading.Thread(target=impostor)
        thread.start()
        with pytest.raises(ConnectionLost, match="could not prove"):
            Client(path, "ab" * 32, "test")
        thread.join()


def test_bytes_that_leave_during_a_long_upload_are_a_sign_of_life(tmp_path, monkeypatch):
    monkeypatch.setattr(wire_client, "HANG_SECONDS", 1.0)
    monkeypatch.setattr(wire_client, "PING_AFTER_SECONDS", 0.2)
    path = str(tmp_path / "socket")
    token = "ab" * 32
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(path)
        listener.listen()

        def slow_reader():
            connected, _ = listener.accept()
            peer = Connection(connected)
            peer.send({"type": "challenge", "protocol": 1, "nonce": "00" * 32})
            hello, _ = peer.receive()
            proof = messages.daemon_proof(token, "00" * 32, hello["nonce"])
            peer.send({"type": "welcome", "protocol": 1, "version": "x", "session": 1, "proof": proof, "capabilities": {}})
            query, _ = peer.receive()
            peer.send({"type": "arrays_missing", "hashes": query["hashes"]})
            connected.settimeout(5)
            started = time.monotonic()
            while time.monotonic() - started < 3:
                connected.recv(200_000)
                time.sleep(0.05)
            peer.close()

        thread = threading.Thread(target=slow_reader)
        thread.start()
        client = Client(path, token, "test")
        array = np.zeros(20_000_000, np.uint8)
        client.send_arrays({messages.array_hash(array): array}, never)
        started = time.monotonic()
        with pytest.raises(ConnectionLost) as lost:
            while True:
                client.next_event(0.05)
        # It lasts until the peer closes, well after a daemon that reads nothing would have been given up.
        assert "hangs" not in str(lost.value) and time.monotonic() - started > 2
        client.close()
        thread.join()


def test_the_order_in_which_a_daemon_is_looked_for(tmp_path, monkeypatch):
    def program(folder):
        (tmp_path / folder).mkdir()
        path = tmp_path / folder / "lambentd"
        path.write_text("#!/bin/sh\n")
        path.chmod(0o755)
        return str(path)

    variable, preferred, bundled, on_path = (program(name) for name in ("a", "b", "c", "d"))
    monkeypatch.setenv("PATH", os.path.dirname(on_path))
    monkeypatch.setenv("LAMBENT_DAEMON", variable)
    assert daemon_process.find_program(preferred, os.path.dirname(bundled)) == variable
    monkeypatch.delenv("LAMBENT_DAEMON")
    assert daemon_process.find_program(preferred, os.path.dirname(bundled)) == preferred
    assert daemon_process.find_program("", os.path.dirname(bundled)) == bundled
    assert daemon_process.find_program() == on_path
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(daemon_process.DaemonUnavailable, match="LAMBENT_DAEMON"):
        daemon_process.find_program()
    with pytest.raises(daemon_process.DaemonUnavailable, match="/nowhere"):
        daemon_process.find_program("/nowhere/lambentd")


def test_socket_token_and_log_are_private_and_removed(daemon):
    folder = os.path.dirname(daemon.address[len("unix:") :])
    assert os.stat(folder).st_mode & 0o777 == 0o700
    assert os.stat(os.path.join(folder, "token")).st_mode & 0o777 == 0o600
    daemon.stop()
    assert not os.path.exists(folder)
