// What lies between two points of a path.
#pragma once

#include "engine/scene/scene.h"

namespace lambent {

/// Transmittance of a segment for light that some objects alone block (shadow linking): from the closest hit to the
/// next, which costs more than segment_transmittance the more other objects lie on the way.
/// @param blockers LinkSets::blockers, not 0. Others as for segment_transmittance
Color linked_transmittance(const Scene& scene, const Ray& ray, uint8_t blockers, const PathCounts& counts, int limit,
                           bool* depended);

/// Transmittance of the segment that `ray` spans: 1 or 0, or with transparent surfaces the product of theirs.
/// @param transparency false: the scene has none, so that one occlusion query answers (KernelProfile::solid)
/// @param counts where the path stands, for surfaces that ask; ray_kind is what the surfaces take the ray for
/// @param limit transparent surfaces that a path may pass, those in counts.transparent included
/// @param depended set to true if a surface on the way let through what it did because of the camera's path (Light Path
///        node): no light walk passes there
/// @param blockers LinkSets::blockers of the light at its end
template <bool transparency>
Color segment_transmittance(const Scene& scene, const Ray& ray, const PathCounts& counts, int limit,
                            bool* depended = nullptr, uint8_t blockers = 0) {
  if (blockers != 0) return linked_transmittance(scene, ray, blockers, counts, limit, depended);
  if constexpr (!transparency) {
    return Color(scene.geometry().occluded(ray) ? 0.0f : 1.0f);
  } else {
    Color transmittance(1.0f);
    int surfaces = counts.transparent;
    const Vec3 wi = -normalize(ray.direction);
    const bool blocked = scene.geometry().occluded(ray, [&](const Hit& hit) {
      if (++surfaces > limit) return false;
      const SurfaceHit surface = scene.geometry().surface(hit);
      const SurfaceBinding& binding = scene.binding(hit.instance, surface.material_slot);
      if (!lets_through(binding.program->traits(), counts.ray_kind)) return false;
      ShadingPoint point;
      scene.fill_shading_point(surface, binding, wi, hit.t * length(ray.direction), {}, counts, point);
      transmittance *= binding.program->transparency(point, scene.textures());
      if (depended && binding.program->traits().path_dependent) *depended = true;
      return !is_black(transmittance);
    });
    return blocked ? Color(0.0f) : transmittance;
  }
}

}  // namespace lambent
