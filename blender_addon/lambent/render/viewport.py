# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The rendered viewport: Blender's thread copies what changed and draws; a worker talks to the daemon.

Each viewport has a session of its own, so several may be open. The scene is exported once and then by difference;
moving the view or resizing it sends camera and settings only.
"""

import queue
import threading
import time
import weakref

import gpu
import numpy as np
from gpu_extras.presets import draw_texture_2d

from ..sync.changes import GeometryChanges
from ..sync.passes import COMBINED_CHANNEL
from ..sync.scene import View, export_scene, export_view
from ..sync.view_camera import view_camera
from ..wire.client import DaemonError, Stopped
from ..wire.connection import ConnectionLost
from ..wire.daemon_process import DaemonUnavailable
from ..wire.messages import ProtocolError
from . import report, session as sessions
from .tiles import decode_tile

_CREDITS = 64
_REDRAW_SECONDS = 0.05
_RETRY_SECONDS = 3.0

_open = weakref.WeakSet()


def close_all():
    """Ends the sessions of all viewports (the file is about to be closed, or the add-on to be disabled)."""
    for viewport in list(_open):
        viewport.close()


class ViewportRender:
    """One rendered viewport. update and draw are called by Blender's thread; everything with a leading "_work" is the
    worker's. What both touch is guarded by _lock: the picture and the status."""

    def __init__(self, engine):
        # Weak, because the engine owns this and its end is what closes it.
        self._engine = weakref.ref(engine)
        self._session = None
        self._worker = None
        self._jobs = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._picture = None
        self._picture_changed = False
        self._status = ""
        self._failed_at = None
        self._texture = None
        self._view = None
        self._changes = GeometryChanges()
        _open.add(self)

    def update(self, engine, context, depsgraph):
        """Something changed: exports the difference and starts over."""
        if not self._connect():
            return
        self._changes.add(depsgraph)
        state = self._session.state
        self._view = self._current_view(context, depsgraph)
        try:
            edits = export_scene(depsgraph, state, self._view, lambda: False, self._changes.keeps(state))
        except Exception as error:  # A fault of the add-on must not come up at each redraw.
            self._fail(f"the scene could not be exported: {error!r}")
            return
        self._changes.sent()
        report.store(depsgraph.scene.name, edits.messages)
        self._submit(edits)

    def draw(self, engine, context, depsgraph):
        """Draws the newest picture; starts over where the view moved or changed its size."""
        works = self._session is not None and self._session.client.usable
        if not works and self._failed_at is not None and time.monotonic() - self._failed_at > _RETRY_SECONDS:
            self.update(engine, context, depsgraph)
        elif works and self._view is not None:
            view = self._current_view(context, depsgraph)
            if view != self._view:
                self._view = view
                self._submit(export_view(depsgraph, self._session.state, view))
        with self._lock:
            changed, self._picture_changed = self._picture_changed, False
            picture = self._picture.copy() if changed else None
            status = self._status
        engine.update_stats("Lambent", status)
        if picture is not None:
            height, width = picture.shape[:2]
            pixels = gpu.types.Buffer("FLOAT", width * height * 4, picture.reshape(-1))
            self._texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=pixels)
        if self._texture is not None:
            scene = depsgraph.scene
            gpu.state.blend_set("ALPHA_PREMULT")
            engine.bind_display_space_shader(scene)
            # Stretched for the moment between a resize and the first new pixels.
            draw_texture_2d(self._texture, (0, 0), context.region.width, context.region.height)
            engine.unbind_display_space_shader()
            gpu.state.blend_set("NONE")

    def close(self):
        """Ends the session and its worker."""
        worker, session = self._worker, self._session
        self._worker = self._session = None
        if worker is not None:
            self._jobs.put(None)
        if session is not None:
            sessions.release(session)

    def _connect(self):
        """Whether there is a session that works; a failed one is tried again after a while."""
        if self._session is not None and self._session.client.usable:
            return True
        if self._failed_at is not None and time.monotonic() - self._failed_at < _RETRY_SECONDS:
            return False
        self.close()
        try:
            self._session = sessions.acquire(None)
        except (ConnectionLost, DaemonUnavailable) as error:
            self._fail(str(error))
            return False
        self._failed_at = None
        self._changes = GeometryChanges()
        self._jobs = queue.SimpleQueue()
        self._worker = threading.Thread(
            target=self._work, args=(self._session, self._jobs), name="lambent-viewport", daemon=True
        )
        self._worker.start()
        return True

    def _fail(self, text):
        self._failed_at = time.monotonic()
        with self._lock:
            self._status = text
        self.close()

    def _current_view(self, context, depsgraph):
        region, region_data, space = context.region, context.region_data, context.space_data
        width, height = max(region.width, 1), max(region.height, 1)
        camera = None
        if region_data.view_perspective == "CAMERA":
            camera = space.camera if space.use_local_camera else depsgraph.scene.camera
            camera = camera.evaluated_get(depsgraph) if camera is not None else None
        view = View(width, height, preview=True, local_daemon=self._session.local)
        view.camera_value = view_camera(region_data, space, width, height, camera)
        return view

    def _submit(self, edits):
        """Hands edits to the worker. They count as known from now on: if they fail to arrive, the session ends."""
        encoded = edits.edits()
        arrays = dict(edits.arrays)
        edits.confirm()
        self._jobs.put((self._session.next_epoch(), encoded, arrays, self._view.width, self._view.height))

    def _work(self, session, jobs):
        try:
            self._work_until_closed(session, jobs)
        except (ConnectionLost, DaemonError, ProtocolError) as error:
            if session.client.usable or self._session is session:
                session.client.close()
                self._work_show(sessions.describe_lost(error))
                self._failed_at = time.monotonic()
        except Stopped:
            pass

    def _work_until_closed(self, session, jobs):
        client = session.client
        epoch, width, height = None, 0, 0
        redrawn_at = 0.0
        picture_waits = False
        while True:
            job = self._work_next_job(jobs, epoch is None)
            if job is None:
                return
            if job is not _NO_JOB:
                epoch, encoded, arrays, width, height = job
                client.send_arrays(arrays, lambda: self._session is not session)
                client.commit(epoch, encoded, lambda: self._session is not session)
                if jobs.empty():
                    client.post({"type": "render_start", "epoch": epoch})
                    client.allow_tiles(_CREDITS)
                continue
            event = client.next_event(_REDRAW_SECONDS)
            if event is not None and event[0].get("epoch", epoch) == epoch:
                header, payload = event
                if header["type"] == "tile":
                    picture_waits |= self._work_tile(header, payload, width, height)
                elif header["type"] == "progress":
                    samples, total = header.get("samples", 0), header.get("samples_total", 0)
                    self._work_show(f"Sample {samples}/{total}" if total else f"Sample {samples}")
                elif header["type"] == "render_done":
                    if header.get("status") == "failed":
                        self._work_show(str(header.get("message")))
                elif header["type"] == "error":
                    raise DaemonError(str(header.get("message")))
            now = time.monotonic()
            if picture_waits and now - redrawn_at > _REDRAW_SECONDS:
                redrawn_at, picture_waits = now, False
                client.allow_tiles(_CREDITS)
                self._work_redraw()

    def _work_next_job(self, jobs, wait):
        try:
            return jobs.get(block=wait)
        except queue.Empty:
            return _NO_JOB

    def _work_tile(self, header, payload, width, height):
        (x, y, tile_width, tile_height), channels = decode_tile(header, payload, width, height)
        pixels = channels.get(COMBINED_CHANNEL)
        if pixels is None or pixels.shape[2] != 4:
            raise ProtocolError(f"a tile without the combined channel: {sorted(channels)}")
        with self._lock:
            if self._picture is None or self._picture.shape[:2] != (height, width):
                self._picture = np.zeros((height, width, 4), np.float32)
            self._picture[y : y + tile_height, x : x + tile_width] = pixels
            self._picture_changed = True
        return True

    def _work_show(self, status):
        with self._lock:
            self._status = status
        self._work_redraw()

    def _work_redraw(self):
        engine = self._engine()
        try:
            if engine is not None:
                engine.tag_redraw()
        except ReferenceError:
            # Blender has freed the engine; close() follows.
            pass


_NO_JOB = object()
