#include "engine/shading/ray_instructions.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/base/frame.h"
#include "engine/base/hash.h"
#include "engine/sampling/warp.h"

namespace lambent {
namespace {

constexpr int k_most_samples = 1024;

/// Uniform numbers in [0, 1): no sampler reaches programs. Each evaluation of a point has its own, since hits differ.
class Numbers {
 public:
  explicit Numbers(const ShadingPoint& point) {
    for (const Vec3& v : {point.p_world, point.wi_world})
      for (int k = 0; k < 3; ++k) state_ = hash_combine(state_, std::bit_cast<uint32_t>(v[k]));
  }
  float next() { return unit_float(state_ = hash_u32(state_ + 0x9e3779b9u)); }

 private:
  uint32_t state_ = 0;
};

/// 10 (R − r)³ / (π R⁵): integrates to 1 over the disk.
float cubic_falloff(float radius, float r) {
  const float x = 1.0f - r / radius;
  return x > 0.0f ? 10.0f * k_inv_pi * x * x * x / (radius * radius) : 0.0f;
}
/// r / R with that density: the root of 10 x² − 20 x³ + 15 x⁴ − 4 x⁵ = u, by Newton's method.
float sample_cubic_falloff(float u) {
  float x = 0.25f;
  for (int i = 0; i < 10; ++i) {
    const float value = x * x * (10.0f - x * (20.0f - x * (15.0f - 4.0f * x))) - u;
    const float slope = 20.0f * x * (1.0f - x) * (1.0f - x) * (1.0f - x);
    if (std::fabs(value) < 1e-6f || !(slope > 0.0f)) break;
    x = std::clamp(x - value / slope, 0.0f, 1.0f);
  }
  return x;
}

}  // namespace

float ambient_occlusion(const ShadingPoint& point, const Vec3& n, float distance, int samples, bool inside,
                        bool own_object) {
  if (!point.rays || !(distance > 0.0f) || samples < 1 || !is_finite(n)) return 1.0f;
  const Frame frame = Frame::from_normal(inside ? -n : n);
  Numbers numbers(point);
  const int count = std::min(samples, k_most_samples);
  int open = 0;
  for (int i = 0; i < count; ++i) {
    const float u = numbers.next();
    const Vec3 direction = frame.to_world(sample_cosine_hemisphere({u, numbers.next()}));
    open += !point.rays->occluded(point, direction, distance, own_object);
  }
  return static_cast<float>(open) / static_cast<float>(count);
}

Vec3 bevelled_normal(const ShadingPoint& point, float radius, int samples) {
  if (!point.rays || !(radius > 0.0f) || samples < 1 || point.diffuse_depth > 0) return point.ns_world;
  const Frame frame = Frame::from_normal(point.ng_world);
  const Vec3 axes[3] = {frame.n, frame.s, frame.t};
  constexpr float k_prob[3] = {0.5f, 0.25f, 0.25f};
  Numbers numbers(point);
  Vec3 sum(0.0f);
  for (int i = 0; i < std::min(samples, k_most_samples); ++i) {
    // A probe along one of three axes, through a disk around the point.
    const float u_axis = numbers.next();
    const int axis = u_axis < 0.5f ? 0 : u_axis < 0.75f ? 1 : 2;
    const float r = radius * sample_cubic_falloff(numbers.next()), angle = 2.0f * k_pi * numbers.next();
    const float height = safe_sqrt(radius * radius - r * r);
    const Vec3 across = axes[(axis + 1) % 3] * (r * std::cos(angle)) + axes[(axis + 2) % 3] * (r * std::sin(angle));
    ShaderRays::Crossing crossings[4];
    const int found = point.rays->crossings(point, point.p_world + axes[axis] * height + across, -axes[axis],
                                            2.0f * height, crossings);
    const float probed = cubic_falloff(radius, r);
    for (int k = 0; k < found; ++k) {
      float own = 0.0f, all = 0.0f;
      for (int a = 0; a < 3; ++a) {
        const float density = k_prob[a] * std::fabs(dot(axes[a], crossings[k].ng_world));
        all += density * density;
        if (a == axis) own = density;
      }
      const float falloff = cubic_falloff(radius, length(crossings[k].p_world - point.p_world));
      if (all > 0.0f && probed > 0.0f) sum = sum + crossings[k].ns_world * (own / all * falloff / probed);
    }
  }
  const Vec3 n = normalize(sum);
  if (!is_finite(n) || length_squared(n) == 0.0f) return point.ns_world;
  return point.backfacing ? -n : n;
}

Raycast cast_ray(const ShadingPoint& point, const Vec3& position, const Vec3& direction, float distance,
                 bool own_object) {
  Raycast result;
  result.distance = distance;
  const float unit = length(direction);
  if (!point.rays || !(distance > 0.0f) || !(unit > 0.0f) || !std::isfinite(unit) || !is_finite(position))
    return result;
  const bool from_surface = position == point.p_world + point.origin_shift;
  ShaderRays::Meeting met;
  if (!point.rays->meets(point, position - point.origin_shift, direction * (1.0f / unit), distance * unit, from_surface,
                         own_object, met))
    return result;
  result.hit = true;
  result.own_object = met.own_object;
  result.distance = met.distance_m / unit;
  result.position = position + direction * result.distance;
  result.normal = met.ns_world;
  result.place = met.place;
  return result;
}

}  // namespace lambent
