#!/usr/bin/python3
# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""A daemon that speaks the protocol, records what it is told and answers renders with a gradient. For tests of the add-on.

Takes lambentd's command line. Environment: LAMBENT_FAKE_RECORD, a directory in which each message is kept as
NNNNN.pickle ({"header", "arrays": {hash: (dtype, shape, bytes)}, "session"}); LAMBENT_FAKE_MODE, what to do when a render starts:
  normal   progress, all tiles, done
  endless  tiles and progress until cancelled
  slow_end  as endless; then says that it has stopped, and sends every tile in full, in five seconds
  hang     nothing, not even a pong (connection stays open)
  crash    the process kills itself
  garbage  random bytes
  fail     render_done with status failed
  bad_tile a tile outside the frame
  reject   transactions are not accepted
  extra_channel  as normal, with a channel in the tiles that nobody asked for
  few_passes, no_passes  as normal, but the welcome announces depth and error only, or says nothing of passes
or, before any render: mute (accepts and says nothing), old (speaks protocol 99), no_start (exits at once).
The mode may be changed while running by writing its name to LAMBENT_FAKE_MODE_FILE.
"""

import argparse
import array
import itertools
import mmap
import os
import pickle
import secrets
import signal
import socket
import sys
import threading
import time

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "blender_addon", "lambent"))
from wire import messages  # noqa: E402

TILE = 64
# Components of a channel by its kind; the values are pass_value's.
COMPONENTS = {
    **dict.fromkeys(("depth", "mist", "object_index", "material_index", "sample_count", "denoising_depth", "aov_value", "time"), 1),
    **dict.fromkeys(("combined", "vector", "noisy", "aov_color"), 4),
    **dict.fromkeys(("cryptomatte_object", "cryptomatte_material", "cryptomatte_asset"), 4),
    **dict.fromkeys(("position", "normal", "uv", "emission", "environment", "ambient_occlusion", "shadow", "shadow_catcher"), 3),
    **dict.fromkeys(("denoising_albedo", "denoising_normal", "light_group", "light_path", "error"), 3),
    **{f"{lobe}_{part}": 3 for lobe in ("diffuse", "glossy", "transmission") for part in ("direct", "indirect", "color")},
    **{f"{where}_{part}": 3 for where in ("volume", "caustics") for part in ("direct", "indirect")},
    **dict.fromkeys(("without_shadow", "shadow_difference", "shadow_ratio", "matte_light"), 3),
    "matte": 1,
    **{f"technique_{name}": 3 for name in ("unidirectional", "connection", "merging")},
}
_record_numbers = itertools.count()
_session_numbers = itertools.count(1)


def mode():
    path = os.environ.get("LAMBENT_FAKE_MODE_FILE", "")
    if path and os.path.exists(path):
        with open(path) as file:
            return file.read().strip()
    return os.environ.get("LAMBENT_FAKE_MODE", "normal")


def gradient(rect, width, height):
    """float32[h][w][4] of a tile: red is x/width, green y/height at pixel centres of the full frame, blue 0.5, alpha 1."""
    x, y, w, h = rect
    pixels = np.empty((h, w, 4), np.float32)
    pixels[..., 0] = (np.arange(x, x + w) + 0.5) / width
    pixels[..., 1] = ((np.arange(y, y + h) + 0.5) / height)[:, None]
    pixels[..., 2] = 0.5
    pixels[..., 3] = 1.0
    return pixels


def channels_of(passes):
    """[(name, components)] of what settings.passes asks for."""
    found = []
    for entry in passes:
        entry = {"name": entry, "kind": entry} if isinstance(entry, str) else entry
        components = COMPONENTS[entry["kind"]]
        if entry["kind"].startswith("cryptomatte_"):
            found += [(f"{entry['name']}{index:02d}", components) for index in range((entry["argument"] + 1) // 2)]
        else:
            found.append((entry["name"], components))
    return found


def pass_value(channel, component):
    """What a channel that is not the first holds all over: its place among the channels, and the component as tenths."""
    return channel + component / 10


class Session(threading.Thread):
    """One connection."""

    def __init__(self, connected, token):
        super().__init__(daemon=True)
        self.socket = connected
        self.token = token
        self.number = next(_session_numbers)
        self.arrays = {}
        self.values = {}
        self.credits = 0
        self.sending = threading.Lock()
        self.changed = threading.Condition()
        self.render = None

    def run(self):
        try:
            self.serve()
        except (ConnectionError, OSError):
            pass

    def send(self, header, payload=b""):
        with self.sending:
            self.socket.sendall(messages.encode_frame(header, payload))

    def receive(self):
        """(header, payload bytes) of the next frame, the payload from its file descriptor where it came in one."""
        data, ancillary, _, _ = self.socket.recvmsg(messages.PRELUDE.size, socket.CMSG_SPACE(4))
        if not data:
            raise ConnectionError()
        descriptors = array.array("i")
        for level, kind, content in ancillary:
            if level == socket.SOL_SOCKET and kind == socket.SCM_RIGHTS:
                descriptors.frombytes(content[:4])
        data += self.exactly(messages.PRELUDE.size - len(data))
        flags, header_bytes, payload_bytes = messages.decode_prelude(data, 1 << 40)
        header = messages.decode_header(self.exactly(header_bytes))
        if not flags & messages.FLAG_PAYLOAD_IN_FD:
            return header, self.exactly(payload_bytes)
        descriptor = descriptors[0]
        import fcntl

        seals = fcntl.fcntl(descriptor, fcntl.F_GET_SEALS)
        wanted = fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_WRITE
        assert seals & wanted == wanted, "the payload's memory is not sealed"
        with mmap.mmap(descriptor, payload_bytes, prot=mmap.PROT_READ) as memory:
            payload = memory[:]
        os.close(descriptor)
        header["in_fd"] = True
        return header, payload

    def exactly(self, count):
        parts = []
        while count:
            part = self.socket.recv(min(count, 1 << 20))
            if not part:
                raise ConnectionError()
            parts.append(part)
            count -= len(part)
        return b"".join(parts)

    def serve(self):
        if mode() == "mute":
            time.sleep(3600)
        nonce = secrets.token_hex(32)
        protocol = 99 if mode() == "old" else 1
        self.send({"type": "challenge", "protocol": protocol, "nonce": nonce})
        hello, _ = self.receive()
        if hello["proof"] != messages.client_proof(self.token, nonce, hello["nonce"]):
            self.send({"type": "error", "code": "authentication", "message": "the proof is wrong", "fatal": True})
            return
        self.send(
            {
                "type": "welcome",
                "protocol": 1,
                "version": "fake",
                "session": self.number,
                "proof": messages.daemon_proof(self.token, nonce, hello["nonce"]),
                "capabilities": {"integrators": ["PT", "VCM"], "shared_memory": True, "limits": {}, **self.announced_passes()},
            }
        )
        while True:
            header, payload = self.receive()
            arrays = {
                descriptor["hash"]: messages.read_array(payload, descriptor).copy()
                for descriptor in header.get("arrays", ())
            }
            self.record(header, arrays)
            self.handle(header, arrays)

    def announced_passes(self):
        if mode() == "no_passes":
            return {}
        return {"passes": ["depth", "error"] if mode() == "few_passes" else [kind for kind in COMPONENTS if kind != "combined"]}

    def record(self, header, arrays):
        directory = os.environ.get("LAMBENT_FAKE_RECORD")
        if directory:
            path = os.path.join(directory, f"{next(_record_numbers):05d}.pickle")
            # As bytes: the numpy that reads may be another version.
            plain = {key: (values.dtype.str, values.shape, values.tobytes()) for key, values in arrays.items()}
            with open(path + ".part", "wb") as file:
                pickle.dump({"header": header, "arrays": plain, "session": self.number}, file)
            os.rename(path + ".part", path)

    def handle(self, header, arrays):
        kind = header["type"]
        if self.render is not None and mode() == "hang":
            return
        if kind == "ping":
            self.send({"type": "pong", "cookie": header["cookie"]})
        elif kind == "arrays_query":
            self.send({"type": "arrays_missing", "hashes": [key for key in header["hashes"] if key not in self.arrays]})
        elif kind == "arrays":
            for key, values in arrays.items():
                assert messages.array_hash(values) == key, "an array's hash is wrong"
            self.arrays.update(arrays)
        elif kind == "transaction":
            self.apply(header)
        elif kind == "tile_credit":
            with self.changed:
                self.credits += header["tiles"]
                self.changed.notify_all()
        elif kind == "render_start":
            self.start_render(header["epoch"], header.get("stream"))
        elif kind == "render_cancel" and self.render is not None:
            with self.changed:
                self.render["cancelled"] = True
                self.changed.notify_all()

    def apply(self, header):
        if mode() == "reject":
            found = [{"severity": "error", "code": "malformed", "object": "Cube", "text": "Cube: rejected on purpose"}]
            self.send({"type": "transaction_result", "epoch": header["epoch"], "accepted": False, "messages": found})
            return
        for edit in header["edits"]:
            if edit["op"] == "clear":
                self.values.clear()
            elif edit["op"] == "remove":
                del self.values[edit["kind"], edit["id"]]
            else:
                for key in array_references(edit["value"]):
                    assert key in self.arrays, f"{edit['kind']} {edit['id']} uses an array that never came"
                self.values[edit["kind"], edit["id"]] = edit["value"]
        self.send({"type": "transaction_result", "epoch": header["epoch"], "accepted": True, "messages": []})

    def start_render(self, epoch, stream):
        chosen = mode()
        self.render = {"epoch": epoch, "cancelled": False, "stream": stream}
        if chosen == "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        elif chosen == "garbage":
            with self.sending:
                self.socket.sendall(secrets.token_bytes(4096))
        elif chosen == "fail":
            done = {"status": "failed", "samples": 0, "statistics": {}, "message": "out of memory on purpose"}
            self.send({"type": "render_done", "epoch": epoch, **done})
        elif chosen == "bad_tile":
            self.send_tile(epoch, (1 << 20, 0, 64, 64), gradient((0, 0, 64, 64), 64, 64), False)
        elif chosen != "hang":
            threading.Thread(target=self.paint, args=(self.render, chosen in ("endless", "slow_end")), daemon=True).start()

    def send_tile(self, epoch, rect, pixels, final, channels=(("combined", 4),)):
        channels = [{"name": name, "components": components} for name, components in channels]
        header = {"type": "tile", "epoch": epoch, "rect": list(rect), "samples": 1, "final": final, "channels": channels}
        self.send(header, pixels.tobytes())

    def paint(self, render, endless):
        settings = self.values["settings", "render"]
        width, height = settings["width"], settings["height"]
        x0, y0, x1, y1 = settings.get("region", (0, 0, width, height))
        rects = [
            (x, y, min(TILE, x1 - x), min(TILE, y1 - y)) for y in range(y0, y1, TILE) for x in range(x0, x1, TILE)
        ]
        total = settings["samples"]
        everything = channels_of(settings["passes"]) + ([("uninvited", 2)] if mode() == "extra_channel" else [])
        streamed = [channel for channel in everything if render["stream"] is None or channel[0] in render["stream"]]
        done = 0
        try:
            for sweep in itertools.count():
                for rect in rects:
                    final = not endless
                    with self.changed:
                        while self.credits == 0 and not render["cancelled"]:
                            self.changed.wait()
                        self.credits -= 1
                    if render["cancelled"]:
                        break
                    done += 1
                    progress = {
                        "stage": "rendering",
                        "samples": min(sweep, total - 1),
                        "samples_total": total,
                        "tiles": done % len(rects),
                        "tiles_total": len(rects),
                        "elapsed_s": 0.1,
                        "remaining_s": 12.34,
                        "memory_bytes": 512 << 20,
                        "memory_peak_bytes": 900 << 20,
                        "active_tiles": [list(rects[done % len(rects)])],
                    }
                    self.send({"type": "progress", "epoch": render["epoch"], **progress})
                    channels = everything if final else streamed
                    self.send_tile(render["epoch"], rect, painted(rect, width, height, everything, channels), final, channels)
                    if endless:
                        time.sleep(0.05)
                if render["cancelled"] or not endless:
                    break
            if render["cancelled"] and mode() == "slow_end":
                self.send({"type": "render_stopped", "epoch": render["epoch"]})
                for rect in rects:
                    time.sleep(5.0 / len(rects))
                    self.send_tile(render["epoch"], rect, painted(rect, width, height, everything, everything), True, everything)
            status = "cancelled" if render["cancelled"] else "finished"
            done_message = {"type": "render_done", "status": status, "samples": total, "statistics": {}, "message": ""}
            self.send({"epoch": render["epoch"], **done_message})
        except OSError:
            pass


def painted(rect, width, height, everything, channels):
    """float32[h][w][all components] of a tile: the gradient in the first of everything, pass_value in the others."""
    parts = []
    for name, components in channels:
        place = everything.index((name, components))
        if place == 0:
            parts.append(gradient(rect, width, height))
        else:
            values = [pass_value(place, component) for component in range(components)]
            parts.append(np.broadcast_to(np.array(values, np.float32), (rect[3], rect[2], components)))
    return np.ascontiguousarray(np.concatenate(parts, axis=2))


def array_references(value):
    if isinstance(value, dict):
        if set(value) == {"array"}:
            yield value["array"]
        else:
            for item in value.values():
                yield from array_references(item)
    elif isinstance(value, list):
        for item in value:
            yield from array_references(item)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--socket", required=True)
    parser.add_argument("--token-file", required=True)
    parser.add_argument("--log-file")
    parser.add_argument("--owner-pid", type=int)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--listen")
    arguments = parser.parse_args()
    if mode() == "no_start":
        print("no_start was asked for", file=sys.stderr)
        sys.exit(3)
    with open(arguments.token_file) as file:
        token = file.read().strip()
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(arguments.socket)
    listener.listen()
    listeners = [listener]
    if arguments.listen:
        host, port = arguments.listen.rsplit(":", 1)
        listeners.append(socket.create_server((host, int(port))))
    print(f"lambentd listening on {arguments.socket}", flush=True)
    for each in listeners:
        threading.Thread(target=accept, args=(each, token), daemon=True).start()
    while arguments.owner_pid is None or os.path.exists(f"/proc/{arguments.owner_pid}"):
        time.sleep(0.2)


def accept(listener, token):
    while True:
        connected, _ = listener.accept()
        Session(connected, token).start()


if __name__ == "__main__":
    main()
