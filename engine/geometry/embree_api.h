// The only header that includes Embree: hides what differs between versions 3.13 and 4.x. Internal to geometry/.
#pragma once

#if LAMBENT_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "engine/geometry/ray.h"

namespace lambent::embree {

/// Sets whether an occlusion query of the scene may run a filter given with the query.
inline constexpr RTCSceneFlags k_scene_flag_query_filter =
#if LAMBENT_EMBREE_MAJOR >= 4
    RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;
#else
    RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
#endif

inline RTCRay make_ray(const Ray& ray, uint32_t mask) {
  RTCRay result;
  result.org_x = ray.origin.x;
  result.org_y = ray.origin.y;
  result.org_z = ray.origin.z;
  result.tnear = ray.t_min;
  result.dir_x = ray.direction.x;
  result.dir_y = ray.direction.y;
  result.dir_z = ray.direction.z;
  result.time = 0.0f;
  result.tfar = ray.t_max;
  result.mask = mask;
  result.id = 0;
  result.flags = 0;
  return result;
}

/// Embree asserts this, in Debian's build too, and would abort.
inline bool traceable(const Ray& ray) {
  constexpr float k_largest = 1.8e18f;
  const auto fits = [](const Vec3& v) {  // false for NaN
    return std::fabs(v.x) <= k_largest && std::fabs(v.y) <= k_largest && std::fabs(v.z) <= k_largest;
  };
  return fits(ray.origin) && fits(ray.direction) && !std::isnan(ray.t_min) && !std::isnan(ray.t_max);
}

/// Top-level geometry numbers are instance numbers, whether the instance is flattened or not.
inline uint32_t instance_number(uint32_t outer, uint32_t geometry) {
  return outer == RTC_INVALID_GEOMETRY_ID ? geometry : outer;
}

inline bool closest_hit(RTCScene scene, const Ray& ray, Hit& hit) {
  if (!traceable(ray)) [[unlikely]]
    return false;
  RTCRayHit query;
  query.ray = make_ray(ray, ray.mask & k_visible_all);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if LAMBENT_EMBREE_MAJOR >= 4
  rtcIntersect1(scene, &query);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &query);
#endif
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
  hit.t = query.ray.tfar;
  hit.barycentric = {query.hit.u, query.hit.v};
  hit.instance = instance_number(query.hit.instID[0], query.hit.geomID);
  hit.primitive = query.hit.primID;
  return true;
}

inline bool any_hit(RTCScene scene, const Ray& ray, uint32_t mask) {
  if (!traceable(ray)) [[unlikely]]
    return false;
  RTCRay query = make_ray(ray, mask);
#if LAMBENT_EMBREE_MAJOR >= 4
  rtcOccluded1(scene, &query);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &query);
#endif
  return query.tfar < 0.0f;
}

/// Calls visit(context, hit) for hits in any order; visit returns true to let the ray go on.
using Visit = bool (*)(void* context, const Hit& hit);

#if LAMBENT_EMBREE_MAJOR >= 4
struct VisitContext : RTCRayQueryContext {
#else
struct VisitContext : RTCIntersectContext {
#endif
  Visit visit;
  void* visitor;
};

inline void visit_filter(const RTCFilterFunctionNArguments* arguments) {
  const auto* context = static_cast<const VisitContext*>(arguments->context);
  const auto* query_hit = reinterpret_cast<const RTCHit*>(arguments->hit);
  Hit hit;
  hit.t = reinterpret_cast<const RTCRay*>(arguments->ray)->tfar;
  hit.barycentric = {query_hit->u, query_hit->v};
  hit.instance = instance_number(query_hit->instID[0], query_hit->geomID);
  hit.primitive = query_hit->primID;
  if (context->visit(context->visitor, hit)) arguments->valid[0] = 0;
}

/// Whether a visit blocked the ray.
inline bool any_hit_visiting(RTCScene scene, const Ray& ray, uint32_t mask, Visit visit, void* visitor) {
  if (!traceable(ray)) [[unlikely]]
    return false;
  RTCRay query = make_ray(ray, mask);
  VisitContext context;
  context.visit = visit;
  context.visitor = visitor;
#if LAMBENT_EMBREE_MAJOR >= 4
  rtcInitRayQueryContext(&context);
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.context = &context;
  arguments.filter = visit_filter;
  arguments.flags = RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
  rtcOccluded1(scene, &query, &arguments);
#else
  rtcInitIntersectContext(&context);
  context.filter = visit_filter;
  rtcOccluded1(scene, &context, &query);
#endif
  return query.tfar < 0.0f;
}

}  // namespace lambent::embree
