#include "engine/path/linked_light.h"

namespace lambent {

Color linked_transmittance(const Scene& scene, const Ray& ray, uint8_t blockers, const PathCounts& counts, int limit,
                           bool* depended) {
  const Vec3 target = ray.origin + ray.direction;  // of segments, which end short of t = 1
  const bool endless = ray.t_max == k_infinity;
  const Vec3 wi = -normalize(ray.direction);
  Color transmittance(1.0f);
  int transparent = counts.transparent;
  Ray rest = ray;
  Hit hit;
  for (int passed = 0; scene.geometry().intersect(rest, hit); ++passed) {
    if (passed >= linked_light::k_most_surfaces) return Color(0.0f);
    const SurfaceHit surface = scene.geometry().surface(hit);
    if (scene.blocks(blockers, surface.instance)) {
      const SurfaceBinding& binding = scene.binding(surface.instance, surface.material_slot);
      if (!lets_through(binding.program->traits(), counts.ray_kind) || ++transparent > limit) return Color(0.0f);
      ShadingPoint point;
      scene.fill_shading_point(surface, binding, wi, hit.t * length(rest.direction), {}, counts, point);
      transmittance *= binding.program->transparency(point, scene.textures());
      if (depended && binding.program->traits().path_dependent) *depended = true;
      if (is_black(transmittance)) return Color(0.0f);
    }
    const Vec3 origin = offset_origin(surface.p_world, surface.p_error, surface.ng_world, ray.direction);
    if (endless) {
      rest.origin = origin;
    } else {
      rest = segment(origin, target, ray.mask);
      if (!(dot(rest.direction, ray.direction) > 0.0f)) break;
    }
  }
  return transmittance;
}

bool linked_light::next_surface(const Scene& scene, const PathCounts& counts, uint32_t receiver, const Vec3& origin,
                                Ray& ray, float& distance, uint64_t& open, LinkedLightPoint& point) {
  Hit hit;
  for (int passed = 0; open != 0 && passed < k_most_surfaces; ++passed) {
    if (!scene.geometry().intersect(ray, hit)) return false;
    const SurfaceHit surface = scene.geometry().surface(hit);
    const SurfaceBinding& binding = scene.binding(surface.instance, surface.material_slot);
    const ProgramTraits& traits = binding.program->traits();
    distance += hit.t;
    bool found = false;
    const LinkSets linked = scene.emission_links(surface.instance);
    if (traits.emits && linked.blockers != 0 && (open >> (linked.blockers - 1) & 1u) &&
        scene.reaches(linked.receivers, receiver)) {
      ShadingPoint shading;
      scene.fill_shading_point(surface, binding, -ray.direction, distance, {}, counts, shading);
      point = {};
      point.radiance = binding.program->emission(shading, scene.textures());
      found = !is_black(point.radiance);
      if (found && binding.samples_emission) {
        point.light = scene.light_at(surface);
        if (point.light != k_no_light) point.traits = &scene.lights().traits(point.light);
      }
      point.linked = linked;
      point.distance_m = distance;
      point.n_light_world = dot(surface.ng_world, ray.direction) > 0.0f ? -surface.ng_world : surface.ng_world;
      point.uv = surface.barycentric;
      point.source = LightSource::surface;
      point.group = scene.instance(surface.instance).light_group;
      point.shadow = segment(origin, offset_origin(surface.p_world, surface.p_error, surface.ng_world, -ray.direction),
                             k_visible_shadow);
    }
    if (!lets_through(traits, k_ray_shadow) &&
        (scene.geometry().instance(surface.instance).visibility & k_visible_shadow))
      open &= ~scene.blocked_sets(surface.instance);
    ray = ray_from_surface(surface.p_world, surface.p_error, surface.ng_world, ray.direction, ray.mask);
    if (found) return true;
  }
  return false;
}

}  // namespace lambent
