// Light linking: what scattered rays meet of lights that not everything blocks (shadow linking).
//
// Receiver of a path is where it scatters last before the light. A light reaches receivers of its set alone, and
// between the two its blockers alone stand in the way. What the camera sees of lights directly is not linked. A ray
// that goes on from a receiver ends where light with other blockers may pass, so lights with shadow linking are left
// out of what the ray itself meets and looked for apart, with shadow rays, as in Cycles.
#pragma once

#include "engine/path/transmittance.h"

namespace lambent {

/// Whether a ray counts light that it meets by itself.
/// @param from_camera nothing but transparent surfaces lies between the camera and the light
inline bool meets_linked(const Scene& scene, LinkSets linked, bool from_camera, uint32_t receiver) {
  return !linked.any() || from_camera || (linked.blockers == 0 && scene.reaches(linked.receivers, receiver));
}

/// A point of a light with shadow linking on a scattered ray.
struct LinkedLightPoint {
  LightIndex light = k_no_light;        ///< k_no_light: next event does not find it
  const LightTraits* traits = nullptr;  ///< of `light`, or null
  LinkSets linked;
  float distance_m = 0.0f;
  Vec3 n_light_world{0.0f};  ///< on the emitting side
  Vec2 uv{0.0f, 0.0f};
  Color radiance{0.0f};
  LightSource source = LightSource::lamp;
  uint16_t group = 0;
  Ray shadow;  ///< what must not be blocked
};

namespace linked_light {
/// Surfaces that a ray is followed through in search of emissive ones.
inline constexpr int k_most_surfaces = 1024;
/// The next emissive surface with shadow linking that reaches `receiver`; false: there is no more. Moves `ray` and
/// `distance` there. `open`: sets of blockers that nothing opaque on the way was in.
bool next_surface(const Scene& scene, const PathCounts& counts, uint32_t receiver, const Vec3& origin, Ray& ray,
                  float& distance, uint64_t& open, LinkedLightPoint& point);
}  // namespace linked_light

/// Calls visit(const LinkedLightPoint&) for the lights with shadow linking on the ray that reach the receiver, blocked
/// or not.
/// @param ray as it leaves the receiver
template <typename Visit>
void for_each_shadow_linked(const Scene& scene, const Ray& ray, uint32_t receiver, const PathCounts& counts,
                            Visit&& visit) {
  const auto visit_lamp = [&](const LightHit& hit) {
    const LinkSets linked = hit.traits->linked;
    if (linked.blockers == 0 || !scene.reaches(linked.receivers, receiver)) return;
    LinkedLightPoint point;
    point.light = hit.light;
    point.traits = hit.traits;
    point.linked = linked;
    point.distance_m = hit.distance_m;
    point.n_light_world = hit.n_light_world;
    point.uv = hit.uv;
    point.source = scene.source_of(hit.light);
    point.radiance = scene.light_radiance(hit, counts);
    point.group = hit.traits->group;
    point.shadow = hit.distance_m < k_infinity ? segment(ray.origin, hit.p_light_world, k_visible_shadow)
                                               : Ray{ray.origin, 0.0f, ray.direction, k_infinity, k_visible_shadow};
    visit(point);
  };
  scene.lights().for_each_lamp(ray.origin, ray.direction, ray.t_min, k_infinity, counts.ray_kind, visit_lamp);
  scene.lights().for_each_infinite(ray.direction, counts.ray_kind, visit_lamp);
  if (uint64_t open = scene.shadow_linked_meshes()) {
    Ray further = ray;
    float distance = 0.0f;
    LinkedLightPoint point;
    while (linked_light::next_surface(scene, counts, receiver, ray.origin, further, distance, open, point))
      visit(point);
  }
}

}  // namespace lambent
