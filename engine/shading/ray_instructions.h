// Nodes that look around with rays of their own: Ambient Occlusion, Bevel and Raycast.
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

/// What the Raycast node (Blender from 5.1 on) tells; positions are the user's.
struct Raycast {
  bool hit = false, own_object = false;
  float distance = 0.0f;  ///< in lengths of the direction
  Vec3 position{0.0f}, normal{0.0f};
  SurfacePlace place;  ///< if something was hit
};
/// @param direction of any length, which `distance` is counted in. Nothing is hit where there are no rays.
Raycast cast_ray(const ShadingPoint& point, const Vec3& position, const Vec3& direction, float distance,
                 bool own_object);

}  // namespace lambent
