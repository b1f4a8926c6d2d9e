#include "engine/scene/scene.h"

#include <unordered_set>

#include "engine/scene/mesh_attributes.h"

namespace lambent {

namespace {

/// Solves v = du * dpdu + dv * dpdv for a tangential v (least squares).
Vec2 barycentric_change(const Vec3& v, const Vec3& dpdu, const Vec3& dpdv) {
  const double uu = dot(dpdu, dpdu), uv = dot(dpdu, dpdv), vv = dot(dpdv, dpdv);
  const double determinant = uu * vv - uv * uv;
  if (!(determinant > 0.0)) return {0.0f, 0.0f};
  const double a = dot(v, dpdu), b = dot(v, dpdv);
  return {static_cast<float>((a * vv - b * uv) / determinant), static_cast<float>((b * uu - a * uv) / determinant)};
}

void set_counts(const PathCounts& counts, ShadingPoint& point) {
  point.ray_kind = counts.ray_kind;
  point.ray_depth = counts.depth;
  point.diffuse_depth = counts.diffuse;
  point.glossy_depth = counts.glossy;
  point.transmission_depth = counts.transmission;
  point.transparent_depth = counts.transparent;
}

}  // namespace

void Scene::fill_shading_point(const SurfaceHit& hit, const SurfaceBinding& binding, const Vec3& wi_world,
                               float ray_length, const RayCone& cone, const PathCounts& counts,
                               ShadingPoint& point) const {
  const Instance& instance = geometry_->instance(hit.instance);
  const InstanceShading& shading = instances_[hit.instance];
  const bool back = dot(hit.ng_world, wi_world) < 0.0f;
  point.p_world = hit.p_world;
  point.backfacing = back;
  point.ng_world = back ? -hit.ng_world : hit.ng_world;
  point.ns_world = back ? -hit.ns_world : hit.ns_world;
  point.wi_world = wi_world;
  point.dpdu_world = hit.dpdu_world;
  point.dpdv_world = hit.dpdv_world;
  point.barycentric = hit.barycentric;
  set_counts(counts, point);
  point.ray_length = ray_length;
  point.random_id = shading.random_id;
  point.object_index = shading.object_index;
  point.object_pass_index = shading.object_pass_index;
  point.material_pass_index = binding.material_pass_index;
  point.world_from_object = &instance.world_from_object;
  point.object_from_world = &instance.object_from_world;
  point.origin_shift = Vec3(origin_shift_);
  point.view = &view_;
  point.rays = binding.program->traits().casts_rays ? &rays_ : nullptr;
  point.instance = hit.instance;
  point.p_error = hit.p_error;
  point.object_color = &object_colors_[shading.object_index];
  point.particle = particles_.empty() ? nullptr : &particles_[hit.instance];

  const bool differentials = binding.program->traits().needs_differentials;
  if (differentials)
    footprint(point.ng_world, cone.width_m + cone.spread * ray_length, point.dpdx_world, point.dpdy_world);
  const std::span<const AttributeRequest> requests = binding.program->attribute_requests();
  if (requests.empty()) return;

  MeshPoint at{*hit.mesh, hit.primitive, hit.barycentric, instance.mirrored, cone.width_m + cone.spread * ray_length};
  if (differentials) {
    at.dx = barycentric_change(point.dpdx_world, hit.dpdu_world, hit.dpdv_world);
    at.dy = barycentric_change(point.dpdy_world, hit.dpdu_world, hit.dpdv_world);
  }
  const std::span<const Vec4> object_values = std::span(object_values_).subspan(binding.first_object_value);
  fill_attributes(at, requests, binding.attributes, object_values, differentials, point);
}

Color Scene::environment(const Vec3& direction_world, const PathCounts& counts) const {
  if (!world_) return Color(0.0f);
  if (world_->traits().constant_emission) return world_->traits().emission;
  ShadingPoint point;
  point.wi_world = -direction_world;
  point.ng_world = point.ns_world = -direction_world;
  point.p_world = direction_world;
  point.view = &view_;
  set_counts(counts, point);
  return world_->emission(point, textures_.get());
}

Color Scene::programmed_radiance(LightIndex light, const Vec3& direction, float distance, const Vec3& p_light,
                                 const Vec3& n_light, const Vec2& uv, const Color& radiance, const LightTraits& traits,
                                 const PathCounts& counts) const {
  if (lights_->kind(light) == LightKind::environment) return environment(direction, counts);
  const LampProgram& lamp = lamp_programs_[traits.user];
  ShadingPoint point;
  point.p_world = distance < k_infinity ? p_light : -direction;
  point.wi_world = -direction;
  point.ng_world = point.ns_world = dot(n_light, direction) > 0.0f ? -n_light : n_light;
  point.ray_length = distance;
  set_counts(counts, point);
  point.world_from_object = &lamp.world_from_light;
  point.object_from_world = &lamp.light_from_world;
  point.origin_shift = Vec3(origin_shift_);
  point.barycentric = uv;
  point.view = &view_;
  return radiance * lamp.program->emission(point, textures_.get());
}

Color Scene::triangle_radiance(uint32_t instance, uint32_t primitive, const Vec2& barycentric, const Vec3& wi_world,
                               float distance, const PathCounts& counts) const {
  const SurfaceHit hit = geometry_->surface(instance, primitive, barycentric);
  const SurfaceBinding& material = binding(instance, hit.material_slot);
  ShadingPoint point;
  fill_shading_point(hit, material, wi_world, distance, {}, counts, point);
  return material.program->emission(point, textures_.get());
}

Color Scene::emitted_radiance(const EmissionSample& emission) const {
  if (!emission.traits->program) return emission.radiance;
  // Walks start only where emission does not depend on the path (LightTraits::starts_walks): any will do.
  const PathCounts counts{k_ray_diffuse, 1, 1, 0, 0, 0};
  if (lights_->kind(emission.light) == LightKind::triangle)
    return triangle_radiance(emission.instance, emission.triangle, emission.uv, emission.direction_world, k_infinity,
                             counts);
  return programmed_radiance(emission.light, -emission.direction_world,
                             emission.is_infinite ? k_infinity : lights_->scene_radius(), emission.p_light_world,
                             emission.n_light_world, emission.uv, emission.radiance, *emission.traits, counts);
}

SceneStatistics Scene::statistics() const {
  SceneStatistics result;
  result.triangles = geometry_->triangle_count();
  result.unique_triangles = geometry_->unique_triangle_count();
  result.instances = geometry_->instance_count();
  result.emitters = lights_->sampled_lights();
  result.geometry_bytes = geometry_->mesh_bytes();
  result.bvh_bytes = geometry_->bvh_bytes();
  result.texture_bytes = textures_ ? textures_->bytes() : 0;
  result.light_bytes = lights_->bytes();
  std::unordered_set<const Program*> programs;
  for (const SurfaceBinding& surface : bindings_)
    if (programs.insert(surface.program.get()).second) result.shading_bytes += surface.program->bytes();
  result.shading_bytes += bindings_.size() * sizeof(SurfaceBinding) + instances_.size() * sizeof(InstanceShading);
  return result;
}

}  // namespace lambent
