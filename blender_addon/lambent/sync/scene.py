# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The whole of an evaluated scene as edits."""

from dataclasses import dataclass

from . import camera, objects, passes, settings, world
from .edits import SceneEdits

VIEW_CAMERA = "lambent:view"


class NothingToRender(Exception):
    """The scene cannot be rendered at all. The text is complete and fit for a user."""


@dataclass
class View:
    """What the picture is taken with.

    width, height: px of the full frame. region: (x0, y0, x1, y1) px with exclusive end, row 0 at the bottom, or None.
    camera: the evaluated camera object, or None. matrix_world: mathutils 4x4. camera_value: a whole camera datablock in place
    of camera, for views that no camera object stands for. preview: viewport settings count.
    motion: motion.Motion where a pass shows it, or None. sample_limit: samples at most, 0 for no limit. local_daemon: it sees our files. pass_kinds: the protocol's kinds of passes
    that the daemon has. shown: the passes.RenderPass that a viewport shows, None for Combined.
    """

    width: int
    height: int
    region: tuple = None
    pixel_aspect: tuple = (1.0, 1.0)
    camera: object = None
    matrix_world: object = None
    shift_x: float = 0.0
    camera_value: dict = None
    preview: bool = False
    sample_limit: int = 0
    local_daemon: bool = True
    pass_kinds: frozenset = passes.ONLY_COMBINED
    motion: object = None
    shown: passes.RenderPass = None


def export_scene(depsgraph, state, view, should_stop, keep_mesh=lambda identifier, original, data: False):
    """SceneEdits of the depsgraph seen through view, against what state knows.

    should_stop: callable, asked now and then; True raises objects.Interrupted. keep_mesh: as for ObjectExporter. Raises
    NothingToRender without a camera. All of Blender's data is read here and none is kept.
    """
    scene, view_layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    if view.camera_value is None and (view.camera is None or view.camera.type != "CAMERA"):
        raise NothingToRender(f"scene '{scene.name}' has no camera: add one, or choose one in the scene properties")
    wanted = wanted_passes(scene, view_layer, view)
    edits = SceneEdits(state, passes.aov_names(wanted))
    edits.depsgraph = depsgraph
    _report_unsupported(edits, scene, view_layer, view)
    camera_id = _export_camera(edits, view)
    mattes = passes.mattes(wanted, view_layer)
    objects.ObjectExporter(edits, depsgraph, keep_mesh, view.motion, mattes).export(should_stop)
    shown_world = _shown_world(scene, view_layer)
    world_id = None
    if shown_world is not None and view_layer.use_sky:
        try:
            world_id = world.export_world(edits, shown_world)
        except Exception as error:  # The rest can be rendered; what fails is reported.
            name = shown_world.name_full
            edits.report("error", "export_failed", name, f"{name}: could not be exported; there is no world light: {error!r}")
    settings.export_settings(edits, scene, view_layer, view, camera_id, world_id, wanted, shown_world)
    edits.depsgraph = None
    return edits


def wanted_passes(scene, view_layer, view):
    """The passes that a render through view delivers, Combined first; a viewport has one other at most, previews none."""
    if not view.preview:
        return passes.rendered(scene, view_layer, view.pass_kinds)
    combined = passes.rendered(scene, view_layer, passes.ONLY_COMBINED)
    return combined if view.shown is None else [*combined, view.shown]


def export_view(depsgraph, state, view):
    """SceneEdits for the same scene seen through another view: camera and settings only."""
    edits = SceneEdits(state)
    edits.keep_all()
    world = next((identifier for kind, identifier in state.known() if kind == "world"), None)
    camera_id = _export_camera(edits, view)
    scene, view_layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    wanted = wanted_passes(scene, view_layer, view)
    settings.export_settings(edits, scene, view_layer, view, camera_id, world, wanted, _shown_world(scene, view_layer))
    return edits


def _shown_world(scene, view_layer):
    return getattr(view_layer, "world_override", None) or scene.world


def _export_camera(edits, view):
    if view.camera_value is None:
        neighbours = None if view.motion is None else view.motion.camera()
        return camera.export_camera(edits, view.camera, view.matrix_world, view.shift_x, neighbours)
    edits.put("camera", VIEW_CAMERA, view.camera_value)
    return VIEW_CAMERA


def _report_unsupported(edits, scene, view_layer, view):
    if scene.render.use_motion_blur and not view.preview:
        edits.unsupported(scene.name, f"{scene.name}: motion blur is not supported; everything stands still")
    if not view.preview:
        passes.report_left_out(edits, scene, view_layer, view.pass_kinds)
