# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""What an evaluated scene says of its instances."""

import numpy as np

from . import compat

# What Blender fills an instance's persistent_id up with.
_NO_ID = 0x7FFFFFFF


def instance_key(instance):
    """What an instance of depsgraph.object_instances is known by in every frame."""
    if not instance.is_instance:
        return instance.object.original.as_pointer()
    numbers = (number for number in instance.persistent_id if number != _NO_ID)
    return instance.parent.original.as_pointer(), instance.instance_object.original.as_pointer(), *numbers


def instance_arrays(depsgraph, count, with_random_ids, first_is_instancer):
    """(float32[count][3][4] world_from_object, uint32[count] or None), in the order of object_instances."""
    matrices = np.empty((count, 4, 4), np.float32)
    random_ids = np.empty(count if with_random_ids else 0, np.int32)
    if first_is_instancer and compat.FOREACH_LEAKS_INSTANCES:
        for index, instance in enumerate(depsgraph.object_instances):
            matrices[index] = instance.matrix_world.transposed()
            if with_random_ids:
                random_ids[index] = instance.random_id
    else:
        depsgraph.object_instances.foreach_get("matrix_world", matrices.reshape(-1))
        if with_random_ids:
            depsgraph.object_instances.foreach_get("random_id", random_ids)
    # Blender stores columns; the wire wants the upper three rows.
    matrices = np.ascontiguousarray(matrices.transpose(0, 2, 1)[:, :3])
    return matrices, random_ids.view(np.uint32) if with_random_ids else None
