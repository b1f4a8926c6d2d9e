# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""F12, animations, background renders and material previews: one view layer of one frame from depsgraph to pixels."""

import contextlib
import time
import traceback

import bpy
import numpy as np

from ..sync import camera as cameras, motion, passes, settings
from ..sync.objects import Interrupted
from ..sync.scene import NothingToRender, View, export_scene, wanted_passes
from ..wire.client import DaemonError, Stopped
from ..wire.connection import ConnectionLost
from ..wire.daemon_process import DaemonUnavailable
from ..wire.messages import ProtocolError
from . import cryptomatte, report, session as sessions
from .status import progress_fraction, status_line
from .tiles import ResultWriter, decode_tile

# Tiles that the daemon may send, and how often that is topped up: enough to see buckets appear without spending the
# machine on showing them. In the background nobody looks, so almost only final tiles travel.
_SHOWN_CREDITS, _SHOWN_SECONDS = 48, 0.1
_BACKGROUND_CREDITS, _BACKGROUND_SECONDS = 1, 0.1
_FINAL_CREDITS = 64
# Of the time, tiles that only show how far it is take at most this part to be written: Blender allocates and merges every
# pass for each of them, which many passes make slow.
_SHOWING_SHARE = 0.25
# After Esc: how long the daemon may say nothing. Passes of a large picture take longer than that to arrive.
_CANCEL_SECONDS = 3.0
_POLL_SECONDS = 0.02
_BACKGROUND_STATUS_SECONDS = 1.0
_MAX_REPORTED = 50
_PREVIEW_SAMPLES = 32


# While saving_to() holds: where renders save their scene instead of rendering it, and what the daemon answered.
_saving = None


@contextlib.contextmanager
def saving_to(path):
    """Until it ends, final renders have the daemon save their scene to path (absolute) and render nothing.

    Gives a dict that is empty until the file is written, then what the daemon answered: "path" and "bytes".
    """
    global _saving
    _saving = (path, {})
    try:
        yield _saving[1]
    finally:
        _saving = None


class RenderFailed(Exception):
    """The picture cannot be finished. The text is complete and fit for a user."""


def render(engine, depsgraph, changes):
    """Renders one view layer into engine's result. Failures become an ERROR report, which is what makes Blender fail.

    changes: sync.changes.GeometryChanges since the last render of the scene that returned True.
    """
    try:
        return _render(engine, depsgraph, changes)
    except (NothingToRender, RenderFailed, DaemonUnavailable, DaemonError) as error:
        _fail(engine, str(error))
    except ConnectionLost as error:
        _fail(engine, sessions.describe_lost(error))
    except Exception as error:  # Blender would save the frame as if it were good (see README).
        traceback.print_exc()
        _fail(engine, f"rendering failed by a fault of the add-on: {error!r}")
    return False


def _fail(engine, text):
    if engine.is_preview:
        # An error report would cover the interface for a thumbnail.
        print(f"Lambent preview: {text}")
    else:
        engine.report({"ERROR"}, f"Lambent: {text}")


def _render(engine, depsgraph, changes):
    session = sessions.acquire("preview" if engine.is_preview else ("final", depsgraph.scene.name_full))
    try:
        for index, view_name in enumerate(_view_names(engine, depsgraph.scene)):
            if engine.test_break():
                return False
            layer = _LayerRender(engine, depsgraph, session, view_name, changes.keeps(session.state))
            if not layer.run(first=index == 0):
                return False
        return True
    finally:
        sessions.release(session)


def _view_names(engine, scene):
    """Names of the stereo views to render; [""] where there is only one."""
    if not scene.render.use_multiview or engine.is_preview:
        return [""]
    return [view.name for view in engine.get_result().views] or [""]


class _LayerRender:
    """One view of one layer of one frame."""

    def __init__(self, engine, depsgraph, session, view_name, keep_mesh):
        self._engine = engine
        self._depsgraph = depsgraph
        self._session = session
        self._client = session.client
        self._view_name = view_name
        self._keep_mesh = keep_mesh
        self._scene = depsgraph.scene_eval
        self._layer_name = depsgraph.view_layer.name
        self._width, self._height = engine.resolution_x, engine.resolution_y
        self._region = _region(engine, self._scene.render, self._width, self._height)
        self._shown = not bpy.app.background
        self._messages = []
        self._passes = []
        self._mattes = {}
        self._status_time = 0.0
        self._status_stage = None
        self._progress = {}

    def run(self, first):
        """Exports, renders and receives until done or cancelled; what is done by then stays in the result.

        Returns whether the daemon has the scene as it is.
        """
        engine = self._engine
        engine.update_stats("", f"{self._scene.name}, {self._layer_name} | Exporting Scene")
        epoch = self._session.next_epoch()
        try:
            self._send_scene(epoch)
        except (Interrupted, Stopped):
            self._session.state.forget()
            return False
        except Exception:
            # Whether the daemon got it is uncertain.
            self._session.state.forget()
            raise
        finally:
            self._store_messages(first and self._layer_name == _first_layer(self._depsgraph.scene))
        if _saving is not None and not engine.is_preview:
            self._save_scene(*_saving)
            return True
        writer = ResultWriter(engine, self._layer_name, self._view_name, self._region, self._make_passes())
        try:
            self._receive(epoch, writer)
        except ProtocolError as error:
            self._client.close()
            raise ConnectionLost(f"the Lambent daemon sent something that is not the protocol: {error}") from None
        finally:
            writer.finish()
            self._store_messages(False)
            self._report_messages()
        return True

    def _send_scene(self, epoch):
        stop = self._engine.test_break
        view = self._view()
        if self._shows_motion(view):
            view = self._view_with_motion(stop)
        edits = export_scene(self._depsgraph, self._session.state, view, stop, self._keep_mesh)
        self._passes = wanted_passes(self._scene, self._depsgraph.view_layer_eval, view)
        self._mattes = edits.mattes
        self._messages += edits.messages
        # View layers take turns in the session, so each keeps the data of the others.
        layers = sum(layer.use for layer in self._depsgraph.scene.view_layers)
        encoded = edits.edits(keep_unused_syncs=max(layers - 1, 0))
        self._client.send_arrays(edits.arrays, stop)
        if encoded:
            self._messages += self._client.commit(epoch, encoded, stop)
        edits.confirm()

    def _shows_motion(self, view):
        wanted = wanted_passes(self._scene, self._depsgraph.view_layer_eval, view)
        return any(entry.kind == "vector" for entry in wanted) and not self._scene.render.use_motion_blur and view.camera is not None

    def _view_with_motion(self, stop):
        """The view, once the frames before and after have been looked at."""
        camera = (self._engine.camera_override or self._scene.camera).original

        def camera_step():
            evaluated = camera.evaluated_get(self._depsgraph)
            if self._view_name:
                self._engine.active_view_set(self._view_name)
            return cameras.step(evaluated, self._engine.camera_model_matrix(evaluated))

        neighbours = motion.visit(self._engine, self._depsgraph, camera_step, stop)
        if neighbours is None:
            raise Interrupted()
        # Evaluated anew.
        self._scene = self._depsgraph.scene_eval
        view = self._view()
        view.motion = neighbours
        return view

    def _save_scene(self, path, saved):
        if not self._session.local:
            raise RenderFailed(f"'{path}' cannot be saved: the daemon runs on another machine, whose files are its own")
        saved.update(self._client.ask({"type": "save_scene", "path": path}, "scene_saved", self._engine.test_break))

    def _view(self):
        engine, scene, render_settings = self._engine, self._scene, self._scene.render
        camera = engine.camera_override or scene.camera
        view = View(self._width, self._height, preview=engine.is_preview, local_daemon=self._session.local)
        view.pass_kinds = self._session.pass_kinds
        # Blender's scene for previews asks for very many, which Cycles' noise threshold then cuts short.
        view.sample_limit = _PREVIEW_SAMPLES if engine.is_preview else 0
        view.pixel_aspect = (render_settings.pixel_aspect_x, render_settings.pixel_aspect_y)
        if self._region != (0, 0, self._width, self._height):
            view.region = self._region
        if camera is not None and camera.type == "CAMERA":
            if self._view_name:
                engine.active_view_set(self._view_name)
            camera = camera.evaluated_get(self._depsgraph)
            view.camera = camera
            view.matrix_world = engine.camera_model_matrix(camera)
            view.shift_x = engine.camera_shift_x(camera)
        return view

    def _make_passes(self):
        """Adds to the result the passes that it has not yet; {channel name on the wire: pass name}."""
        for entry in self._passes[1:]:
            for name in entry.names:
                self._engine.add_pass(name, len(entry.channels), entry.channels, layer=self._layer_name)
        names = {name: name for entry in self._passes[1:] for name in entry.names}
        return {passes.COMBINED_CHANNEL: passes.COMBINED, **names}

    def _receive(self, epoch, writer):
        client, engine = self._client, self._engine
        start = {"type": "render_start", "epoch": epoch, "repeat_tiles": False}
        if len(self._passes) > 1:
            # Which pass an image editor shows is the interface's, and a render has no right to look there from its thread. What
            # is watched while it renders is Combined; the others come with the final tiles.
            start["stream"] = [passes.COMBINED_CHANNEL]
        client.post(start)
        credits, interval = (_SHOWN_CREDITS, _SHOWN_SECONDS) if self._shown else (_BACKGROUND_CREDITS, _BACKGROUND_SECONDS)
        client.allow_tiles(credits)
        allowed_at = time.monotonic()
        time_limit = settings.effective(self._scene, "time_limit")
        cancelled, waiting_since, writing = False, 0.0, 0.0
        while True:
            now = time.monotonic()
            if not cancelled and engine.test_break():
                cancelled, waiting_since = True, now
                client.post({"type": "render_cancel", "epoch": epoch})
                client.allow_tiles(_FINAL_CREDITS)
            if cancelled and now - waiting_since > _CANCEL_SECONDS:
                # The picture stays as it is; the session is given up, so that nothing late gets into the next render.
                client.close()
                return
            if now - allowed_at > max(interval, writing / _SHOWING_SHARE):
                client.allow_tiles(credits)
                allowed_at, writing = now, 0.0
            event = client.next_event(_POLL_SECONDS)
            if event is None:
                continue
            header, payload = event
            kind = header["type"]
            if header.get("epoch", epoch) != epoch:
                continue
            if kind == "tile":
                if header.get("final") and client.tiles_allowed < _FINAL_CREDITS // 2:
                    # The last round: as fast as they come.
                    client.allow_tiles(_FINAL_CREDITS)
                begun = time.monotonic()
                writer.write(*decode_tile(header, payload, self._width, self._height))
                if header.get("final"):
                    waiting_since = time.monotonic()
                else:
                    writing += time.monotonic() - begun
            elif kind == "progress":
                self._show_progress(header, writer, time_limit)
            elif kind == "render_report":
                self._messages += [message for message in header.get("messages") or () if isinstance(message, dict)]
                self._store_messages(False)
            elif kind == "render_stopped":
                waiting_since = now
                writer.highlight(())
                if cancelled:
                    engine.update_stats("", f"{self._scene.name}, {self._layer_name} | Cancelled, Receiving What Is Done")
            elif kind == "render_done":
                self._finish(header, cancelled)
                return
            elif kind == "error":
                raise RenderFailed(str(header.get("message", "the Lambent daemon reported an error without a text")))

    def _stamp(self, done):
        """What image files say of this layer: Cryptomatte's names and how it was rendered."""
        fields = {}
        for entry in self._passes:
            if entry.kind.startswith("cryptomatte_"):
                names = self._mattes[entry.kind[len("cryptomatte_") :]]
                fields.update(cryptomatte.metadata(f"{self._layer_name}.{entry.name}", names))
        prefix = f"lambent.{self._layer_name}"
        fields[f"{prefix}.samples"] = str(done.get("samples", 0))
        fields[f"{prefix}.render_time"] = f"{(done.get('statistics') or {}).get('render_s', 0.0):.2f}"
        fields[f"{prefix}.version"] = self._client.version
        fields[f"{prefix}.integrator"] = settings.effective(self._scene, "integrator")
        fields[f"{prefix}.seed"] = str(settings.seed(self._scene))
        result = self._engine.get_result()
        for field, value in fields.items():
            result.stamp_data_add_field(field, value)

    def _show_progress(self, progress, writer, time_limit):
        if self._shown:
            writer.highlight(rect for rect in progress.get("active_tiles") or () if len(rect) == 4)
        now = time.monotonic()
        self._progress = progress
        stage = progress.get("stage")
        if not self._shown and stage == self._status_stage and now - self._status_time < _BACKGROUND_STATUS_SECONDS:
            return
        self._status_time, self._status_stage = now, stage
        self._engine.update_stats("", status_line(self._scene.name, self._layer_name, progress))
        self._engine.update_progress(progress_fraction(progress, time_limit))
        self._engine.update_memory_stats(
            memory_used=progress.get("memory_bytes", 0) / 2**20, memory_peak=progress.get("memory_peak_bytes", 0) / 2**20
        )

    def _finish(self, done, cancelled):
        status = done.get("status")
        if status == "failed":
            raise RenderFailed(str(done.get("message") or "the Lambent daemon could not finish and gave no reason"))
        if status == "cancelled" and not cancelled:
            raise RenderFailed("the render was cancelled by the daemon")
        if not self._engine.is_preview:
            self._stamp(done)
        last = self._progress
        if status == "finished":
            samples = done.get("samples", 0)
            everything = {"stage": "rendering", "samples": samples, "samples_total": samples, "remaining_s": 0.0}
            last = {**last, **everything, "tiles": last.get("tiles_total", 0)}
            self._engine.update_progress(1.0)
        self._engine.update_stats("", status_line(self._scene.name, self._layer_name, last))

    def _store_messages(self, first):
        if self._engine.is_preview:
            return
        if first:
            report.store(self._depsgraph.scene.name, [])
        report.add(self._depsgraph.scene.name, self._messages)

    def _report_messages(self):
        """Lists what was found as INFO: "Warning:" in the output fails jobs on some farms (README)."""
        if self._engine.is_preview:
            return
        texts = list(dict.fromkeys(str(message.get("text", "")) for message in self._messages))
        for text in texts[:_MAX_REPORTED]:
            self._engine.report({"INFO"}, f"Lambent: {text}")
        if len(texts) > _MAX_REPORTED:
            self._engine.report({"INFO"}, f"Lambent: and {len(texts) - _MAX_REPORTED} more, listed in the Lambent Report panel")


def _first_layer(scene):
    return next((layer.name for layer in scene.view_layers if layer.use), "")


def _region(engine, render_settings, width, height):
    """(x0, y0, x1, y1) of what Blender keeps of the full frame, by its own single-precision truncation."""
    if not render_settings.use_border or engine.is_preview:
        return 0, 0, width, height
    sides = (
        np.float32(render_settings.border_min_x) * np.float32(width),
        np.float32(render_settings.border_min_y) * np.float32(height),
    )
    result = engine.get_result()
    x0, y0 = int(sides[0]), int(sides[1])
    return x0, y0, min(x0 + result.resolution_x, width), min(y0 + result.resolution_y, height)
