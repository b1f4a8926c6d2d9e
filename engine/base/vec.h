// Vectors, colours and bounds: Imath's types (the ecosystem's own) under the names used throughout.
#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace lambent {

using Vec2 = Imath::V2f;
using Vec3 = Imath::V3f;
using Vec3d = Imath::V3d;
using Vec4 = Imath::V4f;
using Color = Imath::Color3f;
using Bounds3 = Imath::Box3f;

inline constexpr float k_pi = std::numbers::pi_v<float>;
inline constexpr float k_inv_pi = std::numbers::inv_pi_v<float>;
inline constexpr float k_infinity = std::numeric_limits<float>::infinity();
/// Largest float below 1: the upper end of a half-open unit interval.
inline constexpr float k_one_minus_epsilon = 0x1.fffffep-1f;

inline float dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float length_squared(const Vec3& v) { return dot(v, v); }

/// Euclidean length that neither overflows nor underflows for components from 1e-38 to 1e38 in magnitude.
inline float length(const Vec3& v) {
  const float squared = dot(v, v);
  if (squared > 1e-30f && squared < 1e30f) return std::sqrt(squared);
  const double x = v.x, y = v.y, z = v.z;
  return static_cast<float>(std::sqrt(x * x + y * y + z * z));
}

/// Unit vector along v; the zero vector if v is zero or not finite.
inline Vec3 normalize(const Vec3& v) {
  const float squared = dot(v, v);
  if (squared > 1e-30f && squared < 1e30f) return v * (1.0f / std::sqrt(squared));
  const double x = v.x, y = v.y, z = v.z;
  const double l = std::sqrt(x * x + y * y + z * z);
  if (!(l > 0.0) || !std::isfinite(l)) return Vec3(0.0f);
  return {static_cast<float>(x / l), static_cast<float>(y / l), static_cast<float>(z / l)};
}

inline bool is_finite(const Vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
inline bool is_black(const Color& c) { return c.x == 0.0f && c.y == 0.0f && c.z == 0.0f; }
inline float max_component(const Vec3& v) { return std::max(v.x, std::max(v.y, v.z)); }
inline float min_component(const Vec3& v) { return std::min(v.x, std::min(v.y, v.z)); }
inline Vec3 abs(const Vec3& v) { return {std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}; }
inline float sqr(float x) { return x * x; }
inline float lerp(float a, float b, float t) { return a + (b - a) * t; }
inline Color lerp(const Color& a, const Color& b, float t) { return a + (b - a) * t; }

/// Relative luminance of linear Rec. 709 / sRGB primaries (ITU-R BT.709).
inline float luminance(const Color& c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }
inline float average(const Color& c) { return (c.x + c.y + c.z) * (1.0f / 3.0f); }

/// sqrt(max(x, 0)): for squares that rounding made slightly negative.
inline float safe_sqrt(float x) { return std::sqrt(std::max(x, 0.0f)); }

}  // namespace lambent
