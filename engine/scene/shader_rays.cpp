#include "engine/scene/shader_rays.h"

#include "engine/geometry/geometry.h"
#include "engine/scene/mesh_attributes.h"

namespace lambent {

bool SceneShaderRays::occluded(const ShadingPoint& point, const Vec3& direction, float distance,
                               bool own_object) const {
  Ray ray = ray_from_surface(point.p_world, point.p_error, point.ng_world, direction, k_visible_shadow);
  ray.t_max = distance;
  if (!own_object) return geometry_->occluded(ray);
  ray.mask = k_visible_all;
  Hit hit;
  return geometry_->intersect_instance(ray, point.instance, hit);
}

int SceneShaderRays::crossings(const ShadingPoint& point, const Vec3& origin, const Vec3& direction, float distance,
                               std::span<Crossing> found) const {
  Ray ray{origin, 0.0f, direction, distance, k_visible_all};
  Hit hit;
  int count = 0;
  while (count < static_cast<int>(found.size()) && geometry_->intersect_instance(ray, point.instance, hit)) {
    const SurfaceHit surface = geometry_->surface(hit);
    found[static_cast<size_t>(count++)] = {surface.p_world, surface.ng_world, surface.ns_world};
  }
  return count;
}

bool SceneShaderRays::meets(const ShadingPoint& point, const Vec3& origin, const Vec3& direction, float distance,
                            bool from_surface, bool own_object, Meeting& met) const {
  Ray ray{origin, 0.0f, direction, distance, k_visible_all};
  if (from_surface) {
    ray = ray_from_surface(point.p_world, point.p_error, point.ng_world, direction, k_visible_all);
    ray.t_max = distance;
  }
  Hit hit;
  if (own_object ? !geometry_->intersect_instance(ray, point.instance, hit) : !geometry_->intersect(ray, hit))
    return false;
  const SurfaceHit surface = geometry_->surface(hit);
  met.distance_m = hit.t;
  met.ns_world = dot(surface.ng_world, direction) > 0.0f ? -surface.ns_world : surface.ns_world;
  met.own_object = hit.instance == point.instance;
  met.place = {hit.instance, hit.primitive, hit.barycentric};
  return true;
}

ShaderRays::MetAttribute SceneShaderRays::attribute(const SurfacePlace& place, const std::string& name) const {
  const TriangleMesh& mesh = *geometry_->instance(place.instance).mesh;
  const int index = mesh.find_attribute(name);
  if (index < 0) return {};
  const Vec4 value = mesh.attribute(index, place.primitive, place.barycentric);
  return {value, as_number(value, mesh.attributes()[static_cast<size_t>(index)].components)};
}

}  // namespace lambent
