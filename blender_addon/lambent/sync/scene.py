# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The whole of an evaluated scene as edits."""

from dataclasses import dataclass

from . import camera, objects, settings, world
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
    sample_limit: samples at most, 0 for no limit. local_daemon: it sees our files.
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


def export_scene(depsgraph, state, view, should_stop, keep_mesh=lambda identifier, original, data: False):
    """SceneEdits of the depsgraph seen through view, against what state knows.

    should_stop: callable, asked now and then; True raises objects.Interrupted. keep_mesh: as for ObjectExporter. Raises
    NothingToRender without a camera. All of Blender's data is read here and none is kept.
    """
    scene, view_layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    if view.camera_value is None and (view.camera is None or view.camera.type != "CAMERA"):
        raise NothingToRender(f"scene '{scene.name}' has no camera: add one, or choose one in the scene properties")
    edits = SceneEdits(state)
    _report_unsupported(edits, scene, view_layer, view)
    camera_id = _export_camera(edits, view)
    objects.ObjectExporter(edits, depsgraph, keep_mesh).export(should_stop)
    shown_world = getattr(view_layer, "world_override", None) or scene.world
    world_id = None
    if shown_world is not None and view_layer.use_sky:
        try:
            world_id = world.export_world(edits, shown_world)
        except Exception as error:  # The rest can be rendered; what fails is reported.
            name = shown_world.name_full
            edits.report("error", "export_failed", name, f"{name}: could not be exported; there is no world light: {error!r}")
    settings.export_settings(edits, scene, view_layer, view, camera_id, world_id)
    return edits


def export_view(depsgraph, state, view):
    """SceneEdits for the same scene seen through another view: camera and settings only."""
    edits = SceneEdits(state)
    edits.keep_all()
    world = next((identifier for kind, identifier in state.known() if kind == "world"), None)
    camera_id = _export_camera(edits, view)
    settings.export_settings(edits, depsgraph.scene_eval, depsgraph.view_layer_eval, view, camera_id, world)
    return edits


def _export_camera(edits, view):
    if view.camera_value is None:
        return camera.export_camera(edits, view.camera, view.matrix_world, view.shift_x)
    edits.put("camera", VIEW_CAMERA, view.camera_value)
    return VIEW_CAMERA


def _report_unsupported(edits, scene, view_layer, view):
    if scene.render.use_motion_blur and not view.preview:
        edits.unsupported(scene.name, f"{scene.name}: motion blur is not supported; everything stands still")
    # use_pass_combined is always written; names of the others as Blender's interface has them.
    wanted = [
        definition.name
        for definition in view_layer.bl_rna.properties
        if definition.identifier.startswith("use_pass_")
        and definition.identifier not in ("use_pass_combined", "use_pass_z", "use_pass_cryptomatte_accurate")
        and getattr(view_layer, definition.identifier)
    ]
    if wanted and not view.preview:
        passes = ", ".join(wanted)
        edits.unsupported(view_layer.name, f"{view_layer.name}: these passes are not supported and left out: {passes}")
