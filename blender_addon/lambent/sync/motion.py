# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Where the camera and the objects are in the frames before and after: what the Vector pass shows.

As for Cycles, Blender evaluates both frames and comes back to the one that is rendered. Only renders with that pass do so, and
none with motion blur, where Cycles' pass is empty. Objects are found again by Blender's ids of instances; shapes are those of
meshes that modifiers or shape keys deform, and of those that geometry nodes, curves and texts make.
"""

import numpy as np

from . import compat, instances


class Step:
    """One other frame. camera: the protocol's step of the camera. number_of: {instance_key: number}, matrices:
    float32[number][3][4], shapes: {instance_key: float32[vertices][3]} of those whose mesh may have changed."""

    def __init__(self, depsgraph, camera, should_stop):
        self.camera = camera
        self.number_of = {}
        self.shapes = {}
        shape_of_data = {}
        count, first_is_instancer, stopped = 0, False, False
        modifiers_of = "RENDER" if depsgraph.mode == "RENDER" else "PREVIEW"
        for index, instance in enumerate(depsgraph.object_instances):
            # Blender leaks the instances of an object that iteration stops inside of: to the end, if it stops.
            stopped = stopped or should_stop(index)
            if stopped:
                continue
            count = index + 1
            first_is_instancer |= index < 2 and instance.is_instance
            found = instance.object
            key = instances.instance_key(instance)
            self.number_of[key] = index
            if found.type != "MESH":
                continue
            pointer = found.data.as_pointer()
            if pointer not in shape_of_data:
                owner = (instance.instance_object if instance.is_instance else found).original
                # As in Cycles: what nodes, curves and texts make anew in each frame may always have changed.
                changes = not _is_own(found, owner, depsgraph) or owner.is_deform_modified(depsgraph.scene, modifiers_of)
                shape_of_data[pointer] = compat.positions(found.data) if changes else None
            if shape_of_data[pointer] is not None:
                self.shapes[key] = shape_of_data[pointer]
        if not stopped:
            self.matrices, _ = instances.instance_arrays(depsgraph, count, False, first_is_instancer)

    def placed(self, keys, transforms):
        """Where the instances are that now stand at transforms; those that are not there in this frame, as now."""
        numbers = np.array([self.number_of.get(key, -1) for key in keys])
        if not len(self.matrices):
            return transforms
        return np.where((numbers >= 0)[:, None, None], self.matrices[numbers], transforms)


class Motion:
    """The frames before and after: steps, two of Step."""

    def __init__(self, steps):
        self.steps = steps

    def camera(self):
        """The protocol's "motion" of the camera."""
        return {name: step.camera for name, step in zip(("previous", "next"), self.steps)}

    def object(self, edits, keys, transforms):
        """The protocol's "motion" of an object whose instances, of one mesh, are keys and stand at float32[n][3][4], or None where
        it stands still."""
        found, moves = {}, False
        for name, step in zip(("previous", "next"), self.steps):
            placed = step.placed(keys, transforms)
            moves |= bool((placed != transforms).any())
            found[name] = {"transforms": edits.array(placed)}
            shape = step.shapes.get(keys[0])
            if shape is not None:
                moves = True
                found[name]["positions"] = edits.array(shape)
        return found if moves else None


def visit(engine, depsgraph, camera_step, should_stop):
    """The Motion of a final render, None if should_stop said so. Evaluates the frames before and after, and then the render's
    own again.

    camera_step: callable that gives the protocol's step of the camera in the frame that is evaluated.
    """
    scene = depsgraph.scene
    frame, subframe = scene.frame_current, scene.frame_subframe
    stopped = False

    def stops(index):
        nonlocal stopped
        stopped = stopped or index % 256 == 0 and should_stop()
        return stopped

    steps = []
    try:
        for offset in (-1, 1):
            engine.frame_set(frame + offset, subframe)
            steps.append(Step(depsgraph, camera_step(), stops))
    finally:
        engine.frame_set(frame, subframe)
    return None if stopped else Motion(steps)


def rows(matrix):
    """The protocol's 12 numbers of a 4x4 matrix."""
    return [component for row in matrix[:3] for component in row]


def _is_own(found, owner, depsgraph):
    data = owner.evaluated_get(depsgraph).data
    return data is not None and data.as_pointer() == found.data.as_pointer()
