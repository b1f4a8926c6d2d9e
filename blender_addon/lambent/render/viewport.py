# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The rendered viewport: Blender's thread copies what changed and draws; a worker talks to the daemon.

Each viewport has a session of its own, so several may be open. The scene is exported once and then by difference;
moving the view or resizing it sends camera and settings only. Beside Combined the daemon renders the one pass that is shown,
and sends that one alone until the end. What was seen of other passes stays until the scene or the view is another.
"""

import json
import queue
import threading
import time
import weakref
from dataclasses import dataclass, replace

import gpu
from gpu_extras.presets import draw_texture_2d

from ..sync.changes import GeometryChanges
from ..sync.passes import COMBINED_CHANNEL, SETTINGS_OF_PASSES, RenderPass
from ..sync.scene import View, export_scene, export_view
from ..sync.shown_pass import COMBINED_KEY, find, name
from ..sync.view_camera import view_camera
from ..wire.client import DaemonError, Stopped
from ..wire.connection import ConnectionLost
from ..wire.daemon_process import DaemonUnavailable
from ..wire.messages import ProtocolError
from . import report, session as sessions
from .pass_pictures import PassPictures, displayed
from .tiles import decode_tile

_CREDITS = 64
_REDRAW_SECONDS = 0.05
_RETRY_SECONDS = 3.0
# With these Combined is another picture, or need not be the same to the last bit.
_CHANGE_COMBINED = ("shadow_catcher", "without_shadow", "shadow_difference", "shadow_ratio")

_open = weakref.WeakSet()


def close_all():
    """Ends the sessions of all viewports (the file is about to be closed, or the add-on to be disabled)."""
    for viewport in list(_open):
        viewport.close()


@dataclass
class _Job:
    """Edits for the daemon, and what to render afterwards. width, height: px. shown: the pass to show, None for Combined.
    start: whether to render at all; if not, its picture is finished. picture: number of the scene and view that it is of."""

    epoch: int
    encoded: list
    arrays: dict
    width: int
    height: int
    shown: RenderPass
    start: bool
    picture: int


class ViewportRender:
    """One rendered viewport. update and draw are called by Blender's thread; everything with a leading "_work" is the
    worker's. What both touch is guarded by _lock: the pictures, which of them is shown, and the status."""

    def __init__(self, engine):
        # Weak, because the engine owns this and its end is what closes it.
        self._engine = weakref.ref(engine)
        self._session = None
        self._worker = None
        self._jobs = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._pictures = PassPictures()
        self._picture_changed = False
        self._picture_number = 0
        self._shown = None
        self._status = ""
        self._notice = ""
        self._failed_at = None
        self._texture = None
        self._view = None
        self._settings = None
        self._changes = GeometryChanges()
        _open.add(self)

    def update(self, engine, context, depsgraph):
        """Something changed: exports the difference and starts over."""
        if self._connect():
            self._export(depsgraph, self._current_view(context, depsgraph))

    def _export(self, depsgraph, view):
        self._changes.add(depsgraph)
        state = self._session.state
        before, self._view = self._view, view
        try:
            edits = export_scene(depsgraph, state, self._view, lambda: False, self._changes.keeps(state))
        except Exception as error:  # A fault of the add-on must not come up at each redraw.
            self._fail(f"the scene could not be exported: {error!r}")
            return
        self._changes.sent()
        report.store(depsgraph.scene.name, edits.messages)
        # Blender also calls when nothing but the choice of the pass is another.
        self._submit(edits, only_pass=len(depsgraph.updates) == 0 and _differ_by_pass(before, view))

    def draw(self, engine, context, depsgraph):
        """Draws the newest picture; starts over where the view moved or changed its size."""
        works = self._session is not None and self._session.client.usable
        if not works and self._failed_at is not None and time.monotonic() - self._failed_at > _RETRY_SECONDS:
            self.update(engine, context, depsgraph)
        elif works and self._view is not None:
            view = self._current_view(context, depsgraph)
            if view.shown != self._view.shown:
                # The whole scene: materials output the AOVs that are asked for, objects the mattes that they are in.
                self._export(depsgraph, view)
            elif view != self._view:
                self._view = view
                self._submit(export_view(depsgraph, self._session.state, view), only_pass=False)
        with self._lock:
            changed, self._picture_changed = self._picture_changed, False
            picture = self._pictures.pixels(self._shown) if changed else None
            picture = None if picture is None else picture.copy()
            status = self._status
        engine.update_stats("Lambent", " | ".join(text for text in (status, self._notice) if text))
        if changed and picture is None:
            # Nothing yet of the pass that is shown now: better nothing than another one.
            self._texture = None
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
        self._view = None
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
        """What to show. A pass that was chosen and is not there is replaced by Combined, and that is said."""
        region, region_data, space = context.region, context.region_data, context.space_data
        width, height = max(region.width, 1), max(region.height, 1)
        camera = None
        if region_data.view_perspective == "CAMERA":
            camera = space.camera if space.use_local_camera else depsgraph.scene.camera
            camera = camera.evaluated_get(depsgraph) if camera is not None else None
        view = View(width, height, preview=True, local_daemon=self._session.local)
        view.camera_value = view_camera(region_data, space, width, height, camera)
        key, self._notice = space.shading.lambent.render_pass_key, ""
        if key != COMBINED_KEY:
            view.shown = find(depsgraph.view_layer, key)
            if view.shown is None:
                self._notice = f"The view layer has no pass '{name(key)}' any more: Combined is shown"
            elif view.shown.kind not in self._session.pass_kinds:
                view.shown = None
                self._notice = f"The daemon does not support the pass '{name(key)}': Combined is shown"
        return view

    def _submit(self, edits, only_pass):
        """Hands edits to the worker. They count as known from now on: if they fail to arrive, the session ends.

        only_pass: scene and view are thought to be those before, so that what is there of passes holds.
        """
        encoded = edits.edits()
        arrays = dict(edits.arrays)
        changed = edits.changed()
        before, self._settings = self._settings, _settings_beside_passes(changed, self._settings)
        same_picture = only_pass and self._settings == before and _may_be_for_a_pass(changed)
        edits.confirm()
        view = self._view
        with self._lock:
            if not same_picture:
                self._picture_number += 1
                self._pictures.forget(keep=view.shown)
            if view.shown != self._shown:
                self._shown, self._picture_changed = view.shown, True
            start = not self._pictures.is_finished(view.shown)
            number = self._picture_number
        epoch = self._session.next_epoch()
        self._jobs.put(_Job(epoch, encoded, arrays, view.width, view.height, view.shown, start, number))

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
        job = running = None
        redrawn_at = 0.0
        picture_waits = False
        while True:
            found = self._work_next_job(jobs, job is None)
            if found is None:
                return
            if found is not _NO_JOB:
                job = found
                client.send_arrays(job.arrays, lambda: self._session is not session)
                client.commit(job.epoch, job.encoded, lambda: self._session is not session)
                if jobs.empty():
                    running = self._work_begin(client, job, running)
                continue
            event = client.next_event(_REDRAW_SECONDS)
            # Also those of the render before take of what was allowed, and without more of that nothing would come any more.
            picture_waits |= event is not None and event[0]["type"] == "tile"
            if event is not None and event[0].get("epoch", job.epoch) == job.epoch:
                header, payload = event
                if header["type"] == "tile":
                    self._work_tile(job, header, payload)
                elif header["type"] == "progress":
                    self._work_show_samples(job, header.get("samples", 0), header.get("samples_total", 0))
                elif header["type"] == "render_done":
                    self._work_done(job, header)
                elif header["type"] == "error":
                    raise DaemonError(str(header.get("message")))
            now = time.monotonic()
            if picture_waits and now - redrawn_at > _REDRAW_SECONDS:
                redrawn_at, picture_waits = now, False
                client.allow_tiles(_CREDITS)
                self._work_redraw()

    def _work_begin(self, client, job, running):
        """Renders what a job asks for, or stops what is being rendered; the epoch that runs now, or None."""
        if job.start:
            start = {"type": "render_start", "epoch": job.epoch}
            if job.shown is not None:
                start["stream"] = job.shown.names
            client.post(start)
            client.allow_tiles(_CREDITS)
            return job.epoch
        if running is not None:
            client.post({"type": "render_cancel", "epoch": running})
        self._work_show_samples(job, 0, 0)
        return None

    def _work_next_job(self, jobs, wait):
        try:
            return jobs.get(block=wait)
        except queue.Empty:
            return _NO_JOB

    def _work_tile(self, job, header, payload):
        rect, channels = decode_tile(header, payload, job.width, job.height)
        found = self._work_pictures(job, channels)
        if job.shown not in found:
            raise ProtocolError(f"a tile without the pass that is shown: {sorted(channels)}")
        with self._lock:
            if job.picture != self._picture_number:
                return  # the next job is of another scene or view
            for shown, pixels in found.items():
                changed = self._pictures.add(shown, job.width, job.height, rect, header.get("samples", 0), pixels)
                self._picture_changed |= changed and shown == self._shown

    def _work_pictures(self, job, channels):
        """{pass, None for Combined: float32[height][width][4] to be shown} of what a tile has and its job may give."""
        found = {}
        combined = channels.get(COMBINED_CHANNEL)
        if combined is not None and combined.shape[2] == 4 and _gives_combined(job):
            found[None] = combined
        if job.shown is not None and job.shown.names[0] in channels:
            found[job.shown] = displayed(job.shown.kind, channels[job.shown.names[0]])
        return found

    def _work_done(self, job, header):
        if header.get("status") == "failed":
            self._work_show(str(header.get("message")))
        elif header.get("status") == "finished":
            with self._lock:
                if job.picture == self._picture_number:
                    # Combined came with the final tiles.
                    self._pictures.finish((job.shown, None) if _gives_combined(job) else (job.shown,))

    def _work_show_samples(self, job, samples, total):
        with self._lock:
            # The picture of a pass that was shown before may be further.
            samples = max(samples, self._pictures.samples(job.shown))
        self._work_show(f"Sample {samples}/{total}" if total else f"Sample {samples}")

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


def _differ_by_pass(before, view):
    """Whether two views (before may be None) are one but for the pass that is shown."""
    return before is not None and view == replace(before, shown=view.shown)


def _settings_beside_passes(changed, before):
    """The settings but for those of passes, after changes ({(kind, id): encoded value}) to what they were before."""
    settings = changed.get(("settings", "render"))
    if settings is None:
        return before
    return {name: value for name, value in json.loads(settings).items() if name not in SETTINGS_OF_PASSES}


def _may_be_for_a_pass(changed):
    """Whether changes are of no other kind than a pass needs: settings, what materials output, which objects a matte shows."""
    return all(kind in ("settings", "material", "object") for kind, _ in changed)


def _gives_combined(job):
    """Whether Combined, as rendered beside the pass that is shown, is the picture that there is without it."""
    return job.shown is None or job.shown.kind not in _CHANGE_COMBINED


_NO_JOB = object()
