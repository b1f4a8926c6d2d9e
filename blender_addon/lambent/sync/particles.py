# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""What the Particle Info node tells of the particles that instances stand for."""

import numpy as np

# Of a row on the wire (PROTOCOL.md, object, particles): index, age, lifetime, size, location, velocity, angular velocity.
_COLUMNS = 13
# index below 0: no particle
_NONE = np.array([-1.0] + [0.0] * (_COLUMNS - 1), np.float32)


class Particles:
    """Collects rows for instances, in their order; systems are read once each, whole."""

    def __init__(self, scene):
        self._frame = scene.frame_current_final
        self._systems = {}
        self._rows = {}

    def add(self, index, instance):
        """Remembers the particle of instance number `index`, if it stands for one. Children of particles have none, as in Cycles."""
        system = instance.particle_system if instance.is_instance else None
        if system is None:
            return
        key = (instance.parent.as_pointer(), system.name)
        rows = self._systems.get(key)
        if rows is None:
            rows = self._systems[key] = _system_rows(system, self._frame)
        number = instance.persistent_id[0]
        if 0 <= number < len(rows):
            self._rows[index] = rows[number]

    def of(self, instances):
        """float32[N][13] for these instance numbers, or None where none of them is a particle."""
        if not any(index in self._rows for index in instances):
            return None
        return np.array([self._rows.get(index, _NONE) for index in instances], np.float32)


def _system_rows(system, frame):
    """float32[N][13] of all particles of a system (children not among them)."""
    count = len(system.particles)
    rows = np.zeros((count, _COLUMNS), np.float32)
    rows[:, 0] = np.arange(count)
    for column, name, width in (
        (1, "birth_time", 1),
        (2, "lifetime", 1),
        (3, "size", 1),
        (4, "location", 3),
        (7, "velocity", 3),
        (10, "angular_velocity", 3),
    ):
        values = np.zeros(count * width, np.float32)
        system.particles.foreach_get(name, values)
        rows[:, column : column + width] = values.reshape(count, width)
    rows[:, 1] = frame - rows[:, 1]
    return rows
