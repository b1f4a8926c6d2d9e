// Rays, hits, and origins that neither hit their own surface again nor slip through their neighbours.
#pragma once

#include <cstdint>

#include "engine/base/vec.h"

namespace lambent {

/// Bits of visibility masks. The numbers are those of RayKind in engine/shading/shading_point.h.
inline constexpr uint32_t k_visible_camera = 1u << 0, k_visible_diffuse = 1u << 1, k_visible_glossy = 1u << 2,
                          k_visible_transmission = 1u << 3, k_visible_shadow = 1u << 4,
                          k_visible_volume_scatter = 1u << 5, k_visible_all = (1u << 6) - 1;
/// What a surface scatters.
inline constexpr uint32_t k_visible_scattered = k_visible_diffuse | k_visible_glossy | k_visible_transmission;

/// Points origin + t·direction with t_min <= t <= t_max. World space; direction need not be unit, t counts its lengths.
struct Ray {
  Vec3 origin{0.0f};
  float t_min = 0.0f;
  Vec3 direction{0, 0, 1};
  float t_max = k_infinity;
  uint32_t mask = k_visible_all;  ///< kinds of ray that this one is: an instance is hit if it shares a bit
};

inline constexpr uint32_t k_no_index = 0xffffffffu;

/// Where a ray met a triangle. Positions come from Geometry::surface(), never from origin + t·direction.
struct Hit {
  float t = k_infinity;
  Vec2 barycentric{0.0f, 0.0f};     ///< weights of the triangle's second and third vertex
  uint32_t instance = k_no_index;   ///< Geometry::instance()
  uint32_t primitive = k_no_index;  ///< triangle of the instance's mesh
  bool valid() const { return instance != k_no_index; }
};

/// p moved by p_error along ng_world to the side that `direction` leaves by: a ray from there in `direction` does not
/// meet p's own triangle, at any scale and distance from the origin, nor does it start behind a neighbouring one (the
/// idea of bounding errors: Pharr et al., pbrt 4th ed. 2023, sec. 6.8; the bound: Geometry::surface). `p_error` in
/// metres: SurfaceHit::p_error, which includes the rounding here; ng_world unit.
inline Vec3 offset_origin(const Vec3& p_world, float p_error, const Vec3& ng_world, const Vec3& direction) {
  return p_world + ng_world * (dot(direction, ng_world) < 0.0f ? -p_error : p_error);
}

/// A ray from a surface point (see offset_origin).
inline Ray ray_from_surface(const Vec3& p_world, float p_error, const Vec3& ng_world, const Vec3& direction,
                            uint32_t mask) {
  return {offset_origin(p_world, p_error, ng_world, direction), 0.0f, direction, k_infinity, mask};
}

/// The open segment between two points, for visibility: it ends short of `target` by more than rounding can add. For a
/// target on a surface give its offset_origin(target, error, ng, origin - target). `origin` is already offset.
/// direction = target - origin, so t = 1 at the target.
inline Ray segment(const Vec3& origin, const Vec3& target, uint32_t mask) {
  return {origin, 0.0f, target - origin, 1.0f - 0x1p-20f, mask};
}

}  // namespace lambent
