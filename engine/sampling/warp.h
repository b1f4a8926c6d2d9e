// Maps from the unit square to shapes, as sample / pdf / invert triples. `u` is in [0, 1)²; invert_x(sample_x(u)) == u
// up to rounding. Local frames have z up. Directions are unit.
#pragma once

#include <array>

#include "engine/base/trig.h"
#include "engine/base/vec.h"

namespace lambent {

// --- Unit disk

/// Uniform point in the unit disk (Shirley & Chiu 1997, concentric map).
inline Vec2 sample_disk(const Vec2& u) {
  const float a = 2.0f * u.x - 1.0f, b = 2.0f * u.y - 1.0f;
  if (a == 0.0f && b == 0.0f) return {0.0f, 0.0f};
  if (std::fabs(a) > std::fabs(b)) {
    const SinCos phi = sin_cos_eighth((k_pi / 4) * (b / a));
    return {a * phi.cos, a * phi.sin};
  }
  const SinCos phi = sin_cos_eighth((k_pi / 4) * (a / b));
  return {b * phi.sin, b * phi.cos};
}
/// Density of sample_disk per unit area inside the disk.
inline constexpr float k_pdf_area_disk = k_inv_pi;
/// The u that sample_disk maps to p. `p` in the unit disk.
Vec2 invert_disk(const Vec2& p);

// --- Hemispheres, sphere, cone (local z is the axis)

/// Direction in the upper hemisphere with density cos / pi.
inline Vec3 sample_cosine_hemisphere(const Vec2& u) {
  const Vec2 d = sample_disk(u);
  return {d.x, d.y, safe_sqrt(1.0f - d.x * d.x - d.y * d.y)};
}
inline float pdf_solid_angle_cosine_hemisphere(float cos_theta) { return std::max(cos_theta, 0.0f) * k_inv_pi; }
inline Vec2 invert_cosine_hemisphere(const Vec3& w) { return invert_disk({w.x, w.y}); }

/// Uniform direction in the upper hemisphere.
Vec3 sample_uniform_hemisphere(const Vec2& u);
inline constexpr float k_pdf_solid_angle_uniform_hemisphere = 0.5f * k_inv_pi;
Vec2 invert_uniform_hemisphere(const Vec3& w);

/// Uniform direction on the sphere.
Vec3 sample_uniform_sphere(const Vec2& u);
inline constexpr float k_pdf_solid_angle_uniform_sphere = 0.25f * k_inv_pi;
Vec2 invert_uniform_sphere(const Vec3& w);

/// Uniform direction in the cone around z whose half angle alpha is given by one_minus_cos = 1 - cos(alpha), in (0, 2].
/// Precise for cones as narrow as 1e-18: derive one_minus_cos without cancellation (2 sin²(alpha/2)).
Vec3 sample_cone(const Vec2& u, float one_minus_cos);
/// 1 / (2 pi (1 - cos alpha)), per steradian, inside the cone.
inline float pdf_solid_angle_cone(float one_minus_cos) { return 0.5f * k_inv_pi / one_minus_cos; }
/// `w` inside the cone.
Vec2 invert_cone(const Vec3& w, float one_minus_cos);
/// 1 - cos(alpha) without cancellation.
inline float one_minus_cos_of_angle(float alpha_rad) { return 2.0f * sqr(std::sin(0.5f * alpha_rad)); }
/// 1 - cos(alpha) for tan(alpha) = opposite / adjacent (both >= 0, not both 0), without cancellation.
/// The same by the sine's square, at most 1; of the half angle under which a sphere is seen.
inline float one_minus_cos_of_sine_squared(float sin_squared) {
  return sin_squared / (1.0f + std::sqrt(1.0f - sin_squared));
}
inline float one_minus_cos_of_tangent(float opposite, float adjacent) {
  const float hypotenuse = std::hypot(opposite, adjacent);
  return (opposite / hypotenuse) * (opposite / (hypotenuse + adjacent));
}

// --- Triangles

/// Barycentrics (b0, b1) of a uniform point in a triangle; b2 = 1 - b0 - b1 >= 0 (Heitz 2019, low-distortion map).
inline Vec2 sample_triangle(const Vec2& u) {
  if (u.x < u.y) {
    const float b0 = 0.5f * u.x;
    return {b0, u.y - b0};
  }
  const float b1 = 0.5f * u.y;
  return {u.x - b1, b1};
}
/// The u that sample_triangle maps to barycentrics (b0, b1).
inline Vec2 invert_triangle(const Vec2& b) {
  return b.x > b.y ? Vec2(b.x + b.y, 2.0f * b.y) : Vec2(2.0f * b.x, b.x + b.y);
}

/// The triangle (a, b, c) as seen from p, for uniform sampling of solid angle (Arvo 1995; guards against rounding as in
/// pbrt-v4, sampling.h). Where the solid angle is too small or too close to the hemisphere for the construction to be
/// accurate in float, points are sampled uniformly by area instead; sample and pdf take the same decision, from (p,
/// triangle) alone.
class SphericalTriangle {
 public:
  /// Any three points; a degenerate triangle, or p in its plane, gives solid_angle() == 0 and pdf 0.
  SphericalTriangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

  /// Solid angle seen from p, sr (Van Oosterom & Strackee 1983).
  float solid_angle() const;
  /// Barycentrics (b0, b1) of the sampled point, weights of a and b.
  Vec2 sample(const Vec2& u) const;
  /// Density of sample() per steradian at the point with barycentrics (b0, b1).
  float pdf_solid_angle(const Vec2& barycentric) const;
  /// The u that sample() maps to the point.
  Vec2 invert(const Vec2& barycentric) const;
  /// True if sampling is uniform in solid angle, false if it is uniform by area.
  bool by_solid_angle() const { return by_solid_angle_; }

 private:
  Vec2 barycentric_of(const Vec3& direction) const;

  Vec3 pa_, pb_, pc_;  ///< vertices relative to p
  Vec3d a_, b_, c_;    ///< their directions; unset where the triangle is seen as small
  float solid_angle_ = 0.0f;
  bool by_solid_angle_ = false;
};

/// The rectangle corner + [0, width] u + [0, height] v (u, v unit and orthogonal) as seen from p, for uniform sampling
/// of solid angle (Ureña, Fajardo & King 2013). Seen under less than k_small_solid_angle, points are sampled uniformly
/// by area.
class SphericalRectangle {
 public:
  static constexpr float k_small_solid_angle = 1e-5f;

  /// A rectangle without area, or p in its plane, gives solid_angle() == 0 and pdf 0.
  SphericalRectangle(const Vec3& p, const Vec3& corner, const Vec3& u, const Vec3& v, float width, float height);

  /// Solid angle seen from p, sr.
  float solid_angle() const { return solid_angle_; }
  /// Fractions of width and height, [0, 1]².
  Vec2 sample(const Vec2& u) const;
  /// Density of sample() per steradian at the point with fractions `st`.
  float pdf_solid_angle(const Vec2& st) const;
  /// The u that sample() maps to the point with fractions `st`.
  Vec2 invert(const Vec2& st) const;
  bool by_solid_angle() const { return by_solid_angle_; }

 private:
  float x0_ = 0, y0_ = 0, z0_ = 0, x1_ = 0, y1_ = 0;  ///< in the frame of u and v, p at the origin; z0 < 0
  float solid_angle_ = 0.0f;
  bool by_solid_angle_ = false;
};

// --- Aperture

/// Lens opening in units of the aperture radius: a disk (blades < 3) or a regular polygon inscribed in the unit circle
/// with the middle of an edge at `rotation_rad`, then scaled in x by 1 / ratio (Blender's aperture_ratio). As Cycles
/// (kernel/camera/camera.h).
struct Aperture {
  int blades = 0;
  float rotation_rad = 0.0f;
  float ratio = 1.0f;

  /// Uniform point in the opening.
  Vec2 sample(const Vec2& u) const;
  /// Area in units of radius².
  float area() const;
  /// 1 / area() inside the opening, 0 outside.
  float pdf_area(const Vec2& p) const;
  /// The u that sample() maps to p. `p` inside the opening.
  Vec2 invert(const Vec2& p) const;
};

}  // namespace lambent
