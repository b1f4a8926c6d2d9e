"""The real daemon process, from outside: handshakes, hostile and vanishing clients, cancel latency, orderly and other ends."""

import json
import os
import pathlib
import random
import secrets
import signal
import socket
import stat
import struct
import subprocess
import threading
import time

import numpy as np
import pytest
from daemon_programs import Daemon, daemon, folder, real, stand_in, wait_until  # noqa: F401 (fixtures)
from wire import client as wire_client
from wire import messages
from wire.connection import ConnectionLost


def never():
    return False


def settings(width=160, height=96, samples=4, metadata=None, **more):
    value = {"width": width, "height": height, "samples": samples, "camera": "camera", "tile_size_px": 32, **more}
    value["metadata"] = metadata or {}
    return {"op": "upsert", "kind": "settings", "id": "render", "value": value}


def scene(arrays, triangle_count=2, **options):
    """Edits for a plane (of many triangles, if asked) under a point light; fills arrays with {hash: array}."""
    side = max(1, int((triangle_count / 2) ** 0.5))
    x, y = np.meshgrid(np.linspace(-2, 2, side + 1), np.linspace(-2, 2, side + 1))
    positions = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1).astype(np.float32)
    corner = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    quads = np.stack([corner, corner + 1, corner + side + 2, corner, corner + side + 2, corner + side + 1], 1)
    triangles = quads.reshape(-1, 3).astype(np.uint32)
    references = []
    for array in (positions, triangles):
        array = messages.wire_array(array)
        key = messages.array_hash(array)
        arrays[key] = array
        references.append({"array": key})
    identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]
    material = {"name": "White", "graph": {"nodes": [{"name": "D", "type": "BsdfDiffuse", "inputs": {"Color": [0.8, 0.8, 0.8, 1]}}],
                                           "outputs": {"surface": [0, "BSDF"]}}}  # fmt: skip
    upserts = [
        ("mesh", "plane", {"name": "Plane", "positions": references[0], "triangles": references[1]}),
        ("material", "white", material),
        ("object", "plane", {"name": "Plane", "mesh": "plane", "transform": identity, "materials": ["white"]}),
        ("light", "lamp", {"name": "Lamp", "type": "point", "energy": 100.0, "radius_m": 0.1}),
        ("object", "lamp", {"name": "Lamp", "light": "lamp", "transform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 2]}),
        ("camera", "camera", {"name": "Camera", "transform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 4]}),
    ]
    edits = [{"op": "upsert", "kind": kind, "id": key, "value": value} for kind, key, value in upserts]
    return edits + [settings(**options)]


def prepare(client, epoch, **options):
    """Sends the scene."""
    arrays = {}
    edits = scene(arrays, **options)
    client.send_arrays(arrays, never)
    client.commit(epoch, [messages.encode_json(edit) for edit in edits], never)


def next_of(client, kind, seconds=20.0):
    """The next message of a kind as (header, payload)."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        event = client.next_event(0.05)
        if event and event[0]["type"] == kind:
            return event
    raise AssertionError(f"no {kind} within {seconds} s")


def render(client, epoch, credit=1000):
    """Renders; (image of the final tiles or None, render_done's header)."""
    client.post({"type": "tile_credit", "tiles": credit})
    client.post({"type": "render_start", "epoch": epoch})
    pixels = {}
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        event = client.next_event(0.05)
        if not event:
            continue
        header, payload = event
        assert header["type"] != "error", header
        if header["type"] == "tile":
            client.post({"type": "tile_credit", "tiles": 1})
            if header["final"]:
                x, y, width, height = header["rect"]
                pixels[x, y] = np.frombuffer(payload, np.float32).reshape(height, width, -1)
        if header["type"] == "render_done":
            return pixels, header
    raise AssertionError("the render did not end")


def receive_error(connection):
    """The error that the daemon sends before it closes, or None."""
    try:
        while True:
            header, _ = connection.receive(time.monotonic() + 20)
            if header["type"] == "error":
                return header
    except ConnectionLost:
        return None


def assert_serves(daemon):
    """The daemon still answers a new client."""
    client = daemon.client()
    client.ask({"type": "arrays_query", "hashes": []}, "arrays_missing", never)
    client.close()


# --- The handshake ---------------------------------------------------------------------------------------------------


def test_a_client_with_the_token_is_welcome_and_renders(daemon):
    client = daemon.client()
    assert "PT" in client.capabilities["integrators"]
    prepare(client, 1)
    pixels, done = render(client, 1)
    assert done["status"] == "finished" and done["samples"] == 4
    assert sum(tile.shape[0] * tile.shape[1] for tile in pixels.values()) == 160 * 96
    client.close()


def test_a_wrong_token_is_refused(daemon):
    with pytest.raises(ConnectionLost, match="token"):
        wire_client.Client("unix:" + daemon.socket_path, "0" * 64, "stranger")
    assert "authentication" in daemon.log()
    assert_serves(daemon)


def test_a_wrong_version_is_refused_with_both_versions_named(daemon):
    connection = daemon.connect()
    connection.receive(time.monotonic() + 5)
    connection.send({"type": "hello", "protocol": 7, "client": "future", "nonce": "0", "proof": "0"})
    error = receive_error(connection)
    assert error["code"] == "protocol_version" and "7" in error["message"] and "1" in error["message"]


def test_socket_and_token_are_for_their_owner_alone(daemon):
    assert stat.S_IMODE(os.stat(daemon.socket_path).st_mode) == 0o600
    assert stat.S_IMODE(os.stat(daemon.token_path).st_mode) == 0o600
    assert len(daemon.token) == 64


def test_a_token_file_that_others_can_read_is_refused(folder):
    token = pathlib.Path(folder, "token")
    token.write_text(secrets.token_hex(32))
    token.chmod(0o644)
    daemon = Daemon("lambentd_stand_in", folder, wait=False)
    assert daemon.process.wait(10) == 1
    assert "chmod 600" in daemon.errors() and str(token) in daemon.errors()


def test_addresses_of_the_network_need_an_explicit_word_and_a_token(folder):
    daemon = Daemon("lambentd_stand_in", folder, "--listen", "0.0.0.0:0", wait=False)
    assert daemon.process.wait(10) == 1 and "--allow-remote" in daemon.errors()
    os.unlink(daemon.token_path)
    daemon = Daemon("lambentd_stand_in", folder, "--listen", "0.0.0.0:0", "--allow-remote", wait=False)
    assert daemon.process.wait(10) == 1 and "token" in daemon.errors()
    daemon.token_path.write_text(secrets.token_hex(32))
    daemon.token_path.chmod(0o600)
    daemon = Daemon("lambentd_stand_in", folder, "--listen", "0.0.0.0:0", "--allow-remote")
    assert daemon.stop() == 0


def test_tcp_on_the_loopback_serves_like_the_unix_socket(folder):
    daemon = Daemon("lambentd_stand_in", folder, "--listen", "127.0.0.1:0")
    address = daemon.ready_line.split(" and ")[1]
    client = wire_client.Client(address, daemon.token, "tcp")
    assert not client.capabilities["shared_memory"]
    prepare(client, 1)
    pixels, done = render(client, 1)
    assert done["status"] == "finished" and len(pixels) == 15
    client.close()
    assert daemon.stop() == 0


def test_a_second_daemon_leaves_the_first_its_socket_and_a_dead_one_s_is_taken_over(folder):
    first = Daemon("lambentd_stand_in", folder)
    second = Daemon("lambentd_stand_in", folder, wait=False)
    assert second.process.wait(10) == 1 and "another lambentd" in second.errors()
    assert_serves(first)
    first.process.kill()
    first.process.wait()
    third = Daemon("lambentd_stand_in", folder)
    assert_serves(third)
    assert third.stop() == 0
    assert not os.path.exists(third.socket_path)


# --- Hostile and clumsy clients --------------------------------------------------------------------------------------


def test_truncated_and_random_frames_harm_nobody_else(daemon):
    bystander = daemon.client()
    choice = random.Random(5)
    frame = messages.encode_frame({"type": "transaction", "epoch": 1, "edits": [settings()]})
    for round_number in range(150):
        raw = socket.socket(socket.AF_UNIX)
        raw.connect(daemon.socket_path)
        if round_number % 3 == 0:
            raw.sendall(frame[: choice.randrange(len(frame))])
        elif round_number % 3 == 1:
            raw.sendall(choice.randbytes(choice.randrange(1, 2000)))
        else:
            damaged = bytearray(frame)
            damaged[choice.randrange(len(frame))] = choice.randrange(256)
            raw.sendall(damaged)
        raw.close()
    bystander.ask({"type": "arrays_query", "hashes": []}, "arrays_missing", never)
    bystander.close()


def test_truncated_and_random_frames_of_an_authenticated_client_harm_nobody_else(daemon):
    choice = random.Random(6)
    frame = messages.encode_frame({"type": "transaction", "epoch": 1, "edits": [settings()]})
    for round_number in range(60):
        client = daemon.client()
        raw = client._connection._socket
        if round_number % 2:
            raw.sendall(frame[: choice.randrange(1, len(frame))])
        else:
            raw.sendall(choice.randbytes(choice.randrange(24, 500)))
        client.close()
    assert_serves(daemon)


@pytest.mark.parametrize(
    "prelude",
    [
        messages.encode_prelude(0xFFFFFFFF),
        messages.encode_prelude(20, 1 << 62),
        struct.pack("<4sHHIIQ", b"LMBT", 2, 0, 20, 0, 0),
        struct.pack("<4sHHIIQ", b"LMBT", 1, 0xFF, 20, 0, 0),
        struct.pack("<4sHHIIQ", b"LMBT", 1, 2, 20, 0, 5),
    ],
)
def test_oversized_counts_and_wrong_preludes_are_answered_before_memory_is_taken(daemon, prelude):
    client = daemon.client()
    before = daemon.memory_bytes()
    client._connection._socket.sendall(prelude)
    header, _ = next_of(client, "error")
    assert header["fatal"] and header["code"] in ("limit", "malformed")
    with pytest.raises(ConnectionLost):
        while True:
            client.next_event(1.0)
    assert daemon.memory_bytes() < before + (64 << 20)
    client.close()


def test_announced_payloads_take_memory_only_as_they_arrive(stand_in):
    before = stand_in.memory_bytes()
    clients = [stand_in.client() for _ in range(4)]
    header = messages.encode_json({"type": "arrays", "arrays": []})
    for client in clients:
        client._connection._socket.sendall(messages.encode_prelude(len(header), 1 << 30) + header + b"x" * 1000)
    time.sleep(0.5)
    assert stand_in.memory_bytes() < before + (64 << 20) + (len(clients) << 27 if stand_in.sanitized else 0)
    for client in clients:
        client.close()
    assert_serves(stand_in)


def test_a_slow_writer_does_not_hold_others_up(stand_in):
    """Slowloris: a frame that arrives byte by byte, before and after the handshake."""
    slow = [socket.socket(socket.AF_UNIX) for _ in range(20)]
    for raw in slow:
        raw.connect(stand_in.socket_path)
    authenticated = stand_in.client()
    frame = messages.encode_frame({"type": "ping", "cookie": 1})
    for byte in frame[:30]:
        for raw in slow:
            raw.send(bytes([byte]))
        authenticated._connection._socket.send(bytes([byte]))
        before = time.monotonic()
        assert_serves(stand_in)
        assert time.monotonic() - before < 1.0
    for raw in slow:
        raw.close()
    authenticated.close()


def test_a_handshake_that_takes_too_long_is_ended(stand_in):
    raw = stand_in.connect()
    before = time.monotonic()
    error = receive_error(raw)
    assert error["code"] == "authentication" and 9 < time.monotonic() - before < 12


def test_a_slow_reader_gets_the_newest_tiles_and_memory_stays_bounded(stand_in):
    reader = stand_in.connect()
    challenge, _ = reader.receive(time.monotonic() + 5)
    nonce = secrets.token_hex(32)
    proof = messages.client_proof(stand_in.token, challenge["nonce"], nonce)
    reader.send({"type": "hello", "protocol": 1, "client": "slow", "nonce": nonce, "proof": proof})
    before = stand_in.memory_bytes()
    edit = settings(width=1920, height=1080, samples=100)
    reader.send({"type": "transaction", "epoch": 1, "edits": [edit]})
    reader.send({"type": "tile_credit", "tiles": 4000})
    reader.send({"type": "render_start", "epoch": 1})
    time.sleep(2)  # reads nothing; the render makes 100 passes of 33 MB
    assert stand_in.memory_bytes() < before + (100 << 20)
    assert_serves(stand_in)
    seen = set()
    samples = []
    while True:
        header, _ = reader.receive(time.monotonic() + 20)
        if header["type"] == "tile":
            samples.append(header["samples"])
            if header["final"]:
                seen.add(tuple(header["rect"]))
        if header["type"] == "render_done":
            break
    assert len(seen) == 60 * 34
    # What was in the socket and the queue before is old; then come only final ones.
    assert sum(count < 100 for count in samples) < 1500
    reader.close()


def test_many_connections_come_and_go_without_leaving_anything(stand_in):
    assert_serves(stand_in)
    wait_until(lambda: "0 remain" in stand_in.log())
    threads, descriptors = stand_in.thread_count(), stand_in.descriptor_count()
    silent = []
    for _ in range(200):
        raw = socket.socket(socket.AF_UNIX)
        raw.connect(stand_in.socket_path)
        silent.append(raw)
    clients = [stand_in.client(f"client {i}") for i in range(40)]
    for client in clients:
        client.ask({"type": "arrays_query", "hashes": []}, "arrays_missing", never)
    for client in clients:
        client.close()
    for raw in silent:
        raw.close()
    assert wait_until(lambda: stand_in.thread_count() <= threads and stand_in.descriptor_count() <= descriptors)


def test_several_clients_render_at_once(daemon):
    results = {}

    def work(number):
        client = daemon.client(f"client {number}")
        prepare(client, 1, samples=8)
        results[number] = render(client, 1)
        client.close()

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert len(results) == 4
    for pixels, done in results.values():
        assert done["status"] == "finished"
        for key, tile in results[0][0].items():
            assert np.array_equal(tile, pixels[key])


# --- What the build reports ------------------------------------------------------------------------------------------


def test_an_object_without_faces_is_named_if_it_is_visible(real):
    client = real.client()
    prepare(client, 1)
    arrays = {messages.array_hash(array): array for array in (np.zeros((2, 3), np.float32), np.zeros((0, 3), np.uint32))}
    keys = list(arrays)
    client.send_arrays(arrays, never)
    identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]
    nowhere = dict.fromkeys(("camera", "diffuse", "glossy", "transmission", "shadow", "volume_scatter"), False)
    edits = [
        ("mesh", "wire", {"name": "Wire", "positions": {"array": keys[0]}, "triangles": {"array": keys[1]}}),
        ("object", "ghost", {"name": "Ghost", "mesh": "wire", "transform": identity}),
        ("object", "hidden", {"name": "Hidden", "mesh": "wire", "transform": identity, "visibility": nowhere}),
    ]
    edits = [{"op": "upsert", "kind": kind, "id": key, "value": value} for kind, key, value in edits]
    client.commit(2, [messages.encode_json(edit) for edit in edits], never)
    client.post({"type": "tile_credit", "tiles": 1000})
    client.post({"type": "render_start", "epoch": 2})
    report, _ = next_of(client, "render_report")
    named = [(m["severity"], m["object"]) for m in report["messages"] if m["code"] == "empty_mesh"]
    assert named == [("info", "Ghost")]
    assert next_of(client, "render_done")[0]["status"] == "finished"
    client.close()


def test_a_client_without_credit_is_told_of_the_end_and_then_has_its_tiles(daemon):
    client = daemon.client()
    prepare(client, 1)
    client.post({"type": "render_start", "epoch": 1})
    done, _ = next_of(client, "render_done", 60)
    assert done["status"] == "finished" and done["tiles_waiting"]
    client.post({"type": "tile_credit", "tiles": 1000})
    rectangles, area = set(), 0
    while area < 160 * 96:  # how many there are is a matter of how many threads the daemon has
        tile = next_of(client, "tile")[0]
        assert tile["final"] and tile["epoch"] == 1
        rectangles.add(tuple(tile["rect"]))
        area = sum(width * height for _, _, width, height in rectangles)
    assert area == 160 * 96
    client.close()


# --- Clients that vanish ---------------------------------------------------------------------------------------------


def test_memory_is_freed_when_a_client_vanishes(daemon):
    assert_serves(daemon)
    before = daemon.memory_bytes()
    client = daemon.client()
    arrays = {}
    values = messages.wire_array(np.arange(100_000_000 // 4, dtype=np.float32).reshape(-1, 1))
    key = messages.array_hash(values)
    arrays[key] = values
    client._connection.shared_memory = False  # so that it is the daemon's own memory
    client.send_arrays(arrays, never)
    client.ask({"type": "arrays_query", "hashes": []}, "arrays_missing", never)
    assert daemon.memory_bytes() > before + 90_000_000
    client._connection.close()
    assert wait_until(lambda: daemon.memory_bytes() < before + 20_000_000)
    client.close()


def test_vanishing_in_the_middle_of_a_transaction_or_a_render_frees_the_session(daemon):
    for middle in ("transaction", "render"):
        client = daemon.client()
        prepare(client, 1, samples=0, metadata={"tile_ms": "5"})
        if middle == "render":
            client.post({"type": "tile_credit", "tiles": 10})
            client.post({"type": "render_start", "epoch": 1})
            next_of(client, "tile")
        else:
            frame = messages.encode_frame({"type": "transaction", "epoch": 2, "edits": [settings()] * 100})
            client._connection._socket.sendall(frame[: len(frame) // 2])
        ended = daemon.log().count("A session was freed")
        client._connection.close()
        assert wait_until(lambda count=ended: daemon.log().count("A session was freed") > count, 5), middle
        client.close()
    assert_serves(daemon)


def test_a_killed_client_process_frees_its_session(daemon, folder):
    script = f"""
import sys
sys.path.insert(0, {str(pathlib.Path(__file__).resolve().parents[2] / "blender_addon" / "lambent")!r})
sys.path.insert(0, {str(pathlib.Path(__file__).parent)!r})
from wire import client
import test_lambentd
session = client.Client("unix:{daemon.socket_path}", "{daemon.token}", "victim")
test_lambentd.prepare(session, 1, samples=0, metadata={{"tile_ms": "5"}})
session.post({{"type": "render_start", "epoch": 1}})
session.ask({{"type": "arrays_query", "hashes": []}}, "arrays_missing", lambda: False)
print("rendering", flush=True)
import time
time.sleep(60)
"""
    victim = subprocess.Popen(["/usr/bin/python3", "-c", script], stdout=subprocess.PIPE)
    assert victim.stdout.readline() == b"rendering\n"
    victim.kill()
    victim.wait()
    assert wait_until(lambda: "A session was freed" in daemon.log(), 5)
    assert_serves(daemon)


# --- Cancel ----------------------------------------------------------------------------------------------------------


def latency_limit():
    """100 ms; on a machine that is given more work than it has processors, its share of them."""
    return 0.1 * max(1.0, os.getloadavg()[0] / os.cpu_count())


def cancel_latency(client, epoch):
    """Seconds from sending render_cancel to render_done."""
    before = time.monotonic()
    client.post({"type": "render_cancel", "epoch": epoch})
    header, _ = next_of(client, "render_done", 10)
    latency = time.monotonic() - before
    assert header["status"] == "cancelled" and header["epoch"] == epoch
    return latency


def test_cancel_takes_under_100_ms_while_rendering(daemon):
    client = daemon.client()
    prepare(client, 1, width=640, height=480, samples=0, metadata={"tile_ms": "5"})
    client.post({"type": "tile_credit", "tiles": 4000})
    for epoch in range(1, 6):
        client.post({"type": "render_start", "epoch": epoch})
        next_of(client, "tile")
        assert cancel_latency(client, epoch) < latency_limit()
    client.close()


def test_a_cancel_is_answered_before_the_passes_that_nobody_has_yet_and_all_of_them_come(real):
    client = real.client()
    prepare(client, 1, width=512, height=512, samples=0, passes=["combined", "depth", "normal"])
    client.post({"type": "tile_credit", "tiles": 4000})
    client.post({"type": "render_start", "epoch": 1, "stream": ["combined"], "repeat_tiles": False})
    while next_of(client, "progress")[0]["samples"] < 1:
        pass
    client.post({"type": "render_cancel", "epoch": 1})
    stopped, corners = False, []
    while (event := client.next_event(20.0))[0]["type"] != "render_done":
        header, payload = event
        stopped |= header["type"] == "render_stopped"
        if header["type"] == "tile":
            assert header["final"] == stopped
        if header["type"] == "tile" and stopped:
            assert [channel["name"] for channel in header["channels"]] == ["combined", "depth", "normal"]
            x, y, width, height = header["rect"]
            pixels = np.frombuffer(payload, np.float32).reshape(height, width, 8)
            assert np.all(pixels[..., 3] > 0) and np.all(pixels[..., 4] > 0)
            corners.append((x, y))
    assert event[0]["status"] == "cancelled"
    assert sorted(corners) == [(x, y) for x in range(0, 512, 32) for y in range(0, 512, 32)]
    client.close()


def test_cancel_takes_under_100_ms_while_building(real):
    client = real.client()
    prepare(client, 1, triangle_count=2_000_000, samples=0)
    client.post({"type": "tile_credit", "tiles": 4000})
    for epoch, delay in enumerate((0.0, 0.05, 0.2, 0.4), 1):
        client.post({"type": "render_start", "epoch": epoch})
        time.sleep(delay)
        assert cancel_latency(client, epoch) < latency_limit(), delay
    client.close()


@pytest.mark.parametrize("integrator", ["VPL", "BPT", "BPM", "VCM"])
def test_cancel_takes_under_100_ms_while_light_walks_are_learned_and_photons_of_one_point_sorted(real, integrator):
    client = real.client()
    arrays = {}
    edits = scene(arrays, width=1024, height=1024, samples=0, integrator=integrator, tile_size_px=64)
    for edit in edits:
        if edit["kind"] == "light":  # all of its light arrives in one point of the plane
            edit["value"].update(type="spot", radius_m=0.0, spot_size_rad=0.001, spot_blend=0.0)
    client.send_arrays(arrays, never)
    client.commit(1, [messages.encode_json(edit) for edit in edits], never)
    for epoch, delay in enumerate((0.0, 0.05, 0.1, 0.3, 0.6, 1.0, 1.5), 1):
        client.post({"type": "tile_credit", "tiles": 4000})
        client.post({"type": "render_start", "epoch": epoch})
        time.sleep(delay)
        assert cancel_latency(client, epoch) < latency_limit(), delay
    client.close()


def test_cancel_takes_under_100_ms_while_an_export_is_decoded(daemon):
    client = daemon.client()
    light = {"op": "upsert", "kind": "light", "value": {"name": "L", "type": "point", "energy": 1.0}}
    edits = [messages.encode_json({**light, "id": f"light {i}"}) for i in range(100_000)]
    client.post(b'{"type":"transaction","epoch":1,"edits":[' + b",".join(edits) + b"]}")
    client.post({"type": "render_start", "epoch": 1})
    # The time counts from when the transaction has left us.
    wait_until(client._outgoing.empty)
    assert cancel_latency(client, 1) < latency_limit()
    client.close()


# --- How it ends -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_in_order_even_while_rendering(daemon, how):
    client = daemon.client()
    prepare(client, 1, samples=0, metadata={"tile_ms": "5"})
    client.post({"type": "render_start", "epoch": 1})
    time.sleep(0.3)
    before = time.monotonic()
    daemon.process.send_signal(how)
    assert daemon.process.wait(10) == 0
    assert time.monotonic() - before < 2
    assert not os.path.exists(daemon.socket_path)
    with pytest.raises(ConnectionLost):
        while True:
            client.next_event(1.0)
    client.close()


def test_it_ends_when_its_owner_is_gone(folder):
    owner = subprocess.Popen(["sleep", "60"])
    daemon = Daemon("lambentd_stand_in", folder, "--owner-pid", str(owner.pid))
    client = daemon.client()
    owner.kill()
    owner.wait()
    assert daemon.process.wait(5) == 0
    assert "owner" in daemon.log()
    client.close()


def test_a_killed_daemon_is_noticed_by_its_client_at_once(daemon):
    client = daemon.client()
    prepare(client, 1, samples=0, metadata={"tile_ms": "5"})
    client.post({"type": "render_start", "epoch": 1})
    daemon.process.kill()
    before = time.monotonic()
    with pytest.raises(ConnectionLost):
        while True:
            client.next_event(1.0)
    assert time.monotonic() - before < 2
    client.close()


# --- Saved scenes ----------------------------------------------------------------------------------------------------


def test_a_saved_scene_is_a_file_of_frames(daemon, folder):
    client = daemon.client()
    prepare(client, 1)
    path = os.path.join(folder, "scene.lambent")
    saved = client.ask({"type": "save_scene", "path": path}, "scene_saved", never)
    assert saved["path"] == path and saved["bytes"] == os.path.getsize(path)
    data = pathlib.Path(path).read_bytes()
    kinds = []
    while data:
        _, header_bytes, payload_bytes = messages.decode_prelude(data[:24], 1 << 30)
        header = json.loads(data[24 : 24 + header_bytes])
        kinds.append(header["type"])
        data = data[24 + header_bytes + payload_bytes :]
    assert kinds == ["scene_file", "arrays", "transaction"]
    with pytest.raises(wire_client.DaemonError, match="no/such"):
        client.ask({"type": "save_scene", "path": folder + "/no/such/scene.lambent"}, "scene_saved", never)
    client.close()


def test_the_log_says_what_happened(daemon):
    client = daemon.client("a name with\nlines")
    prepare(client, 1)
    render(client, 1)
    client.close()
    assert wait_until(lambda: "A session was freed" in daemon.log())
    log = daemon.log()
    for text in ("connected", "a name with?lines", "2 arrays", "transaction of epoch 1: 7 edits", "render 1 starts", "render 1 finished", "disconnected"):
        assert text in log, text
