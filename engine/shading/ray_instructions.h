// Nodes that look around with rays of their own: Ambient Occlusion and Bevel.
#pragma once

#include "engine/shading/shading_point.h"

namespace lambent {

/// Share of cosine-distributed directions around `n` (unit, world) that meet nothing within `distance_m`: 1 for no
/// distance, and where there are no rays (worlds, lights).
float ambient_occlusion(const ShadingPoint& point, const Vec3& n_world, float distance_m, int samples, bool inside,
                        bool own_object);
/// Mean of the object's normals within `radius_m`, unit: Cycles' estimate (King et al. 2013, "BSSRDF Importance
/// Sampling"), which counts surfaces by a cubic falloff. The point's own for no radius, and for rays that a diffuse
/// surface scattered.
Vec3 bevelled_normal(const ShadingPoint& point, float radius_m, int samples);

}  // namespace lambent
