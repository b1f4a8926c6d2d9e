// The ray that asks whether a sampled light is seen.
#pragma once

#include "engine/scene/scene.h"

namespace lambent {

/// From a surface to a point that LightSet::sample chose for it; neither end meets its own surface.
inline Ray shadow_ray(const Geometry& geometry, const LightSet& lights, const SurfaceHit& from,
                      const LightSample& light) {
  const Vec3 origin = offset_origin(from.p_world, from.p_error, from.ng_world, light.direction_world);
  if (light.is_infinite) return {origin, 0.0f, light.direction_world, k_infinity, k_visible_shadow};
  Vec3 target = light.p_light_world;
  if (lights.kind(light.light) == LightKind::triangle) {
    const SurfaceHit on_light = geometry.surface(light.instance, light.triangle, light.uv);
    target = offset_origin(on_light.p_world, on_light.p_error, on_light.ng_world, -light.direction_world);
  }
  return segment(origin, target, k_visible_shadow);
}
inline Ray shadow_ray(const Scene& scene, const SurfaceHit& from, const LightSample& light) {
  return shadow_ray(scene.geometry(), scene.lights(), from, light);
}

}  // namespace lambent
