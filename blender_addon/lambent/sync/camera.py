# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Cameras: lens, sensor, shift and depth of field."""

from mathutils import Matrix, Vector

from . import motion

# Of the protocol; more are round in any picture. Blender has no bounds, below 3 is round too.
_MAX_BLADES = 1000


def export_camera(edits, camera_object, matrix_world, shift_x, neighbours=None):
    """Puts the camera of an evaluated object seen from matrix_world (mathutils 4x4) and returns its id.

    matrix_world and shift_x differ from the object's own where several views are rendered. neighbours: the protocol's "motion",
    or None.
    """
    data = camera_object.data
    name = camera_object.name_full
    if data.type not in ("PERSP", "ORTHO"):
        kind = {"PANO": "panoramic"}.get(data.type, data.type.lower())
        edits.unsupported(name, f"{name}: a {kind} camera is not supported; a perspective camera of its lens stands in for it")
    value = {
        "name": name,
        "type": "orthographic" if data.type == "ORTHO" else "perspective",
        "transform": motion.rows(matrix_world),
        "focal_length_mm": data.lens,
        "sensor_width_mm": data.sensor_width,
        "sensor_height_mm": data.sensor_height,
        "sensor_fit": data.sensor_fit.lower(),
        "ortho_scale": data.ortho_scale,
        "shift": [shift_x, data.shift_y],
        "clip_m": [data.clip_start, data.clip_end],
    }
    if data.dof.use_dof:
        value["depth_of_field"] = depth_of_field(data.dof, matrix_world)
    if neighbours is not None:
        value["motion"] = neighbours
    edits.put("camera", name, value)
    return name


def step(camera_object, matrix_world):
    """The protocol's step of an evaluated camera object seen from matrix_world in another frame."""
    return {"transform": motion.rows(matrix_world), "focal_length_mm": camera_object.data.lens}


def depth_of_field(dof, matrix_world):
    """The protocol's depth_of_field of a camera's settings, seen from matrix_world."""
    return {
        "focus_distance_m": _focus_distance(dof, matrix_world),
        "fstop": dof.aperture_fstop,
        "blades": min(max(dof.aperture_blades, 0), _MAX_BLADES),
        "rotation_rad": dof.aperture_rotation,
        "ratio": dof.aperture_ratio,
    }


def _focus_distance(dof, matrix_world):
    """Metres along the view axis to the focus object (or its bone), else the distance that is set."""
    target = dof.focus_object
    if target is None:
        return dof.focus_distance
    focus = target.matrix_world
    bone = target.pose.bones.get(getattr(dof, "focus_subtarget", "")) if target.pose else None
    if bone is not None:
        focus = focus @ bone.matrix
    view_axis = Vector(matrix_world.col[2][:3]).normalized()
    return abs(view_axis.dot(Matrix(matrix_world).translation - focus.translation))
