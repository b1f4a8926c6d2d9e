# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""What a 3D viewport sees, as a camera of the wire."""

from mathutils import Matrix

from .camera import depth_of_field


def view_camera(region_data, space, width, height, camera_object):
    """The value of a camera datablock that shows a viewport of width x height px, camera frame zoom and offset included.

    It is read from the projection that Blender itself draws with. camera_object: the evaluated camera that the viewport
    looks through, or None; it gives lens and depth of field.
    """
    projection = region_data.window_matrix
    transform = region_data.view_matrix.inverted()
    aspect = height / width
    data = camera_object.data if camera_object is not None and camera_object.type == "CAMERA" else None
    value = {"name": "viewport", "sensor_fit": "horizontal"}
    if region_data.is_perspective:
        # x_ndc = P00·x/-z - P02, and P00 = 2·lens/sensor width; near and far likewise from the third row.
        lens = data.lens if data is not None and data.type == "PERSP" else space.lens
        value["type"] = "perspective"
        value["focal_length_mm"] = lens
        value["sensor_width_mm"] = 2.0 * lens / projection[0][0]
        value["shift"] = [projection[0][2] / 2.0, projection[1][2] / 2.0 * aspect]
        near = projection[2][3] / (projection[2][2] - 1.0)
        far = projection[2][3] / (projection[2][2] + 1.0)
        if data is not None and data.dof.use_dof:
            value["depth_of_field"] = depth_of_field(data.dof, transform)
    else:
        value["type"] = "orthographic"
        value["ortho_scale"] = 2.0 / projection[0][0]
        value["shift"] = [-projection[0][3] / 2.0, -projection[1][3] / 2.0 * aspect]
        near = (projection[2][3] + 1.0) / projection[2][2]
        far = (projection[2][3] - 1.0) / projection[2][2]
        # Blender's orthographic views begin behind the eye: the eye goes there instead.
        transform = transform @ Matrix.Translation((0.0, 0.0, -near))
        near, far = 0.0, far - near
    value["clip_m"] = [near, far]
    value["transform"] = [component for row in transform[:3] for component in row]
    return value
