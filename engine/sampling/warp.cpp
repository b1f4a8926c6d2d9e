#include "engine/sampling/warp.h"

#include <algorithm>
#include <cmath>

namespace lambent {

namespace {

constexpr float k_two_pi = 2.0f * k_pi;

float clamp_unit(float x) { return std::clamp(x, 0.0f, k_one_minus_epsilon); }

/// Angle of (x, y) as a fraction of a turn, in [0, 1).
float turn(float x, float y) {
  const float t = std::atan2(y, x) / k_two_pi;
  return clamp_unit(t < 0.0f ? t + 1.0f : t);
}

Vec3 on_circle(float turn_fraction, float sin_theta, float cos_theta) {
  const SinCos phi = sin_cos_turn(turn_fraction);
  return {sin_theta * phi.cos, sin_theta * phi.sin, cos_theta};
}

}  // namespace

Vec2 invert_disk(const Vec2& p) {
  // Quadrants of the concentric map, by which of |x| and |y| is larger.
  const float r = std::hypot(p.x, p.y);
  if (r == 0.0f) return {0.5f, 0.5f};
  float a, b;
  if (std::fabs(p.x) > std::fabs(p.y)) {
    a = std::copysign(r, p.x);
    b = a * std::atan(p.y / p.x) / (k_pi / 4);
  } else {
    b = std::copysign(r, p.y);
    a = b * std::atan(p.x / p.y) / (k_pi / 4);
  }
  return {clamp_unit(0.5f * (a + 1.0f)), clamp_unit(0.5f * (b + 1.0f))};
}

Vec3 sample_uniform_hemisphere(const Vec2& u) {
  const float z = 1.0f - u.x;
  return on_circle(u.y, safe_sqrt(u.x * (2.0f - u.x)), z);
}
Vec2 invert_uniform_hemisphere(const Vec3& w) { return {clamp_unit(1.0f - w.z), turn(w.x, w.y)}; }

Vec3 sample_uniform_sphere(const Vec2& u) {
  return on_circle(u.y, 2.0f * safe_sqrt(u.x * (1.0f - u.x)), 1.0f - 2.0f * u.x);
}
Vec2 invert_uniform_sphere(const Vec3& w) { return {clamp_unit(0.5f * (1.0f - w.z)), turn(w.x, w.y)}; }

Vec3 sample_cone(const Vec2& u, float one_minus_cos) {
  // h = 1 - cos(theta) is uniform in [0, one_minus_cos); sin² = h (2 - h) needs no difference of nearly equal numbers.
  const float h = u.x * one_minus_cos;
  return on_circle(u.y, safe_sqrt(h * (2.0f - h)), 1.0f - h);
}
Vec2 invert_cone(const Vec3& w, float one_minus_cos) {
  const float sin_squared = w.x * w.x + w.y * w.y;
  const float h = w.z > 0.0f ? sin_squared / (1.0f + w.z) : 1.0f - w.z;
  return {clamp_unit(h / one_minus_cos), turn(w.x, w.y)};
}

// --- Spherical triangle

namespace {

double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// Unit vector along v; zero if v is zero.
Vec3d unit(const Vec3d& v) {
  const double squared = dot(v, v);
  return squared > 0.0 ? v * (1.0 / std::sqrt(squared)) : Vec3d(0.0);
}
/// Unit vector along the part of v orthogonal to the unit vector n.
Vec3d orthogonal_part(const Vec3d& v, const Vec3d& n) { return unit(v - n * dot(v, n)); }

/// Solid angle of the triangle of unit vectors (Van Oosterom & Strackee 1983, eq. 8).
double solid_angle_of(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const double volume = std::fabs(dot(a, cross(b, c)));
  return 2.0 * std::atan2(volume, 1.0 + dot(a, b) + dot(b, c) + dot(c, a));
}

/// Sine and cosine of an angle to the relative precision of float for the sine and of its square for 1 - cosine: by the
/// half angle.
struct SinCosDouble {
  double sin, cos;
};
SinCosDouble sin_cos_double(float angle) {
  const SinCos half = sin_cos_turn(angle * (0.5f / k_two_pi));
  return {2.0 * static_cast<double>(half.sin) * half.cos, 1.0 - 2.0 * static_cast<double>(half.sin) * half.sin};
}

// Outside these, construction by angles is inaccurate (small) or ill-defined (a whole hemisphere).
constexpr double k_smallest_solid_angle = 1e-5, k_largest_solid_angle = 6.2;
// A triangle whose longest edge is below this share of its distance looks the same from everywhere on it: area will do.
constexpr float k_near_edge_over_distance = 0.2f;

}  // namespace

SphericalTriangle::SphericalTriangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c)
    : pa_(a - p), pb_(b - p), pc_(c - p) {
  const Vec3 centroid = (pa_ + pb_ + pc_) * (1.0f / 3.0f);
  const float longest_edge_squared =
      std::max({length_squared(pb_ - pa_), length_squared(pc_ - pa_), length_squared(pc_ - pb_)});
  if (!(longest_edge_squared > sqr(k_near_edge_over_distance) * length_squared(centroid))) return;
  a_ = unit(Vec3d(pa_));
  b_ = unit(Vec3d(pb_));
  c_ = unit(Vec3d(pc_));
  // As solid_angle_of; neither argument can overflow a float.
  const float volume = static_cast<float>(std::fabs(dot(a_, cross(b_, c_))));
  const double solid_angle =
      2.0f * std::atan2(volume, static_cast<float>(1.0 + dot(a_, b_) + dot(b_, c_) + dot(c_, a_)));
  solid_angle_ = static_cast<float>(solid_angle);
  by_solid_angle_ = solid_angle >= k_smallest_solid_angle && solid_angle <= k_largest_solid_angle;
}

float SphericalTriangle::solid_angle() const {
  if (by_solid_angle_) return solid_angle_;
  return static_cast<float>(solid_angle_of(unit(Vec3d(pa_)), unit(Vec3d(pb_)), unit(Vec3d(pc_))));
}

Vec2 SphericalTriangle::barycentric_of(const Vec3& direction) const {
  // Möller & Trumbore 1997, from the origin.
  const Vec3d edge_b = Vec3d(pb_) - Vec3d(pa_), edge_c = Vec3d(pc_) - Vec3d(pa_), d(direction), to_p = -Vec3d(pa_);
  const Vec3d s = cross(d, edge_c);
  const double determinant = dot(s, edge_b);
  if (determinant == 0.0) return {1.0f / 3.0f, 1.0f / 3.0f};
  const double weight_b = std::clamp(dot(to_p, s) / determinant, 0.0, 1.0);
  const double weight_c = std::clamp(dot(d, cross(to_p, edge_b)) / determinant, 0.0, 1.0 - weight_b);
  return {static_cast<float>(1.0 - weight_b - weight_c), static_cast<float>(weight_b)};
}

Vec2 SphericalTriangle::sample(const Vec2& u) const {
  if (!by_solid_angle_) return sample_triangle(u);
  const Vec3d &a = a_, &b = b_, &c = c_;
  // Angle at a, between the planes (a, b) and (a, c).
  const Vec3d toward_b = orthogonal_part(b, a), toward_c = orthogonal_part(c, a);
  const double cos_alpha = std::clamp(dot(toward_b, toward_c), -1.0, 1.0);
  const double sin_alpha = std::sqrt(std::max(1.0 - cos_alpha * cos_alpha, 0.0));
  // Arvo 1995, section 3: choose the area of the sub-triangle (a, b, c'), c' on the edge from a to c...
  const SinCosDouble area = sin_cos_double(u.x * solid_angle_);
  const double s = area.sin * cos_alpha - area.cos * sin_alpha;  // sin(area - alpha)
  const double t = area.cos * cos_alpha + area.sin * sin_alpha;  // cos(area - alpha)
  const double cos_ab = dot(a, b);
  const double k_u = t - cos_alpha, k_v = s + sin_alpha * cos_ab;
  const double denominator = (k_v * s + k_u * t) * sin_alpha;
  const double q =
      denominator != 0.0 ? std::clamp(((k_v * t - k_u * s) * cos_alpha - k_v) / denominator, -1.0, 1.0) : 1.0;
  const Vec3d c_prime = a * q + toward_c * std::sqrt(std::max(1.0 - q * q, 0.0));
  // ...then the height along the arc from b to c'. 1 - cos(theta) is uniform; written without cancellation.
  const Vec3d chord = c_prime - b;
  const double h = 0.5 * static_cast<double>(u.y) * dot(chord, chord);
  const Vec3d w = b * (1.0 - h) + orthogonal_part(c_prime, b) * std::sqrt(std::max(h * (2.0 - h), 0.0));
  return barycentric_of(Vec3(w));
}

float SphericalTriangle::pdf_solid_angle(const Vec2& barycentric) const {
  if (by_solid_angle_) return 1.0f / solid_angle_;
  const Vec3 point = pa_ * barycentric.x + pb_ * barycentric.y + pc_ * (1.0f - barycentric.x - barycentric.y);
  // d² / (cos · area) = d³ / |d · n area|, with n area = cross / 2.
  const Vec3 normal = cross(pb_ - pa_, pc_ - pa_);
  const double projected = 0.5 * std::fabs(dot(Vec3d(point), Vec3d(normal)));
  const double squared = dot(Vec3d(point), Vec3d(point));
  const double pdf = squared * std::sqrt(squared) / projected;
  return projected > 0.0 && pdf <= static_cast<double>(std::numeric_limits<float>::max()) ? static_cast<float>(pdf)
                                                                                          : 0.0f;
}

Vec2 SphericalTriangle::invert(const Vec2& barycentric) const {
  if (!by_solid_angle_) return invert_triangle(barycentric);
  const Vec3d &a = a_, &b = b_, &c = c_;
  const double b0 = barycentric.x, b1 = barycentric.y;
  const Vec3d w = unit(Vec3d(pa_) * b0 + Vec3d(pb_) * b1 + Vec3d(pc_) * (1.0 - b0 - b1));
  const Vec3d chord = w - b;
  if (dot(chord, chord) < 1e-14) return {0.5f, 0.0f};  // every u.x leads to b
  // c' is where the great circle through b and w crosses that through a and c.
  Vec3d c_prime = unit(cross(cross(b, w), cross(c, a)));
  if (dot(c_prime, a + c) < 0.0) c_prime = -c_prime;
  const Vec3d whole = c_prime - b;
  return {clamp_unit(static_cast<float>(solid_angle_of(a, b, c_prime) / solid_angle_of(a, b, c))),
          clamp_unit(static_cast<float>(dot(chord, chord) / dot(whole, whole)))};
}

// --- Spherical rectangle

namespace {

/// x / |(x, z)|. In double no float can overflow or underflow here.
double sine_beside(double x, double z) { return x / std::sqrt(x * x + z * z); }

}  // namespace

SphericalRectangle::SphericalRectangle(const Vec3& p, const Vec3& corner, const Vec3& u, const Vec3& v, float width,
                                       float height) {
  if (!(width > 0.0f) || !(height > 0.0f)) return;
  const Vec3 to_corner = corner - p;
  x0_ = dot(to_corner, u);
  y0_ = dot(to_corner, v);
  z0_ = -std::fabs(dot(to_corner, cross(u, v)));
  x1_ = x0_ + width;
  y1_ = y0_ + height;
  if (z0_ == 0.0f) return;
  // The rectangle from p's foot to (x, y) has the solid angle atan(xy / (|z| r)), the argument of (|z| r, xy) as a
  // complex number; that of the whole is the sum over corners with alternating signs, the argument of a product.
  struct Complex {
    double re, im;
  };
  const double z2 = static_cast<double>(z0_) * z0_;
  const auto corner_at = [&](double x, double y) {
    return Complex{-static_cast<double>(z0_) * std::sqrt(x * x + y * y + z2), x * y};
  };
  const auto product = [](const Complex& a, const Complex& b) {
    return Complex{a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
  };
  const auto quotient = [](const Complex& a, const Complex& b) {  // up to the magnitude
    return Complex{a.re * b.re + a.im * b.im, a.im * b.re - a.re * b.im};
  };
  const Complex whole =
      product(quotient(corner_at(x1_, y1_), corner_at(x0_, y1_)), quotient(corner_at(x0_, y0_), corner_at(x1_, y0_)));
  const double scale = 1.0 / std::max(std::fabs(whole.re), std::fabs(whole.im));
  float angle = std::atan2(static_cast<float>(whole.im * scale), static_cast<float>(whole.re * scale));
  // More than pi: seen so from a foot within the rectangle only.
  if (angle < 0.0f) angle = x0_ < 0.0f && x1_ > 0.0f && y0_ < 0.0f && y1_ > 0.0f ? angle + k_two_pi : 0.0f;
  solid_angle_ = angle;
  by_solid_angle_ = solid_angle_ >= k_small_solid_angle;
}

Vec2 SphericalRectangle::sample(const Vec2& u) const {
  if (!by_solid_angle_) return u;
  const double x0 = x0_, x1 = x1_, y0 = y0_, y1 = y1_, z = z0_, z2 = z * z;
  // Ureña et al. 2013, section 4, with the angles g2 and g3 between side planes as cosine and sine.
  const double b0_scale = 1.0 / (y0 * y0 + z2);
  const double b0 = -y0 * std::sqrt(b0_scale), b1 = sine_beside(y1, z), n3 = -sine_beside(x0, z);
  const double cos_2 = -b1 * n3, cos_3 = -n3 * b0;
  const double sin_2 = std::sqrt(std::max(1.0 - cos_2 * cos_2, 0.0));
  const double sin_3 = std::sqrt(std::max(1.0 - cos_3 * cos_3, 0.0));
  // k = 2 pi - g2 - g3; the angle is k + u.x · solid angle.
  const double cos_k = cos_2 * cos_3 - sin_2 * sin_3, sin_k = -(sin_2 * cos_3 + cos_2 * sin_3);
  const SinCosDouble part = sin_cos_double(u.x * solid_angle_);
  const double sin_angle = sin_k * part.cos + cos_k * part.sin, cos_angle = cos_k * part.cos - sin_k * part.sin;
  // Their c_u and f_u multiplied out, so that nothing is divided by sin_angle: 1 - b0² = z² / (y0² + z²).
  const double numerator = cos_angle * b0 - b1;
  const double under = numerator * numerator - z2 * b0_scale * sin_angle * sin_angle;
  const double x =
      std::clamp(-z * std::copysign(sin_angle, sin_angle * numerator) / std::sqrt(std::max(under, 1e-30)), x0, x1);
  // h = y / sqrt(x² + y² + z²) is uniform between its ends; y over the distance to the line is h / sqrt(1 - h²).
  const float d_inverse = 1.0f / static_cast<float>(std::sqrt(x * x + z2));
  const float t0 = y0_ * d_inverse, t1 = y1_ * d_inverse;
  const float h0 = t0 / std::sqrt(1.0f + t0 * t0), h1 = t1 / std::sqrt(1.0f + t1 * t1);
  const float h = lerp(h0, h1, u.y);
  const float t = h / std::sqrt(std::max((1.0f - h) * (1.0f + h), 1e-12f));
  return {std::clamp(static_cast<float>((x - x0) / (x1 - x0)), 0.0f, 1.0f),
          std::clamp((t - t0) / (t1 - t0), 0.0f, 1.0f)};
}

float SphericalRectangle::pdf_solid_angle(const Vec2& st) const {
  if (by_solid_angle_) return 1.0f / solid_angle_;
  if (z0_ == 0.0f) return 0.0f;
  const double x = lerp(x0_, x1_, st.x), y = lerp(y0_, y1_, st.y), z = z0_;
  const double squared = x * x + y * y + z * z;
  const double area = (static_cast<double>(x1_) - x0_) * (static_cast<double>(y1_) - y0_);
  const double pdf = squared * std::sqrt(squared) / (-z * area);
  return pdf <= static_cast<double>(std::numeric_limits<float>::max()) ? static_cast<float>(pdf) : 0.0f;
}

Vec2 SphericalRectangle::invert(const Vec2& st) const {
  if (!by_solid_angle_) return {clamp_unit(st.x), clamp_unit(st.y)};
  const double z = z0_, x0 = x0_, y0 = y0_, y1 = y1_;
  const double x = lerp(x0_, x1_, st.x), y = lerp(y0_, y1_, st.y);
  // Solid angle of the part of the rectangle left of x: the same construction with x1 = x.
  const double n0 = -sine_beside(y0, z), n1 = sine_beside(x, z), n2 = sine_beside(y1, z), n3 = -sine_beside(x0, z);
  const double part =
      std::acos(-n0 * n1) + std::acos(-n1 * n2) + std::acos(-n2 * n3) + std::acos(-n3 * n0) - 2.0 * std::numbers::pi;
  const double d_squared = x * x + z * z;
  const double h0 = y0 / std::sqrt(d_squared + y0 * y0), h1 = y1 / std::sqrt(d_squared + y1 * y1);
  const double h = y / std::sqrt(d_squared + y * y);
  return {clamp_unit(static_cast<float>(part / static_cast<double>(solid_angle_))),
          clamp_unit(static_cast<float>((h - h0) / (h1 - h0)))};
}

// --- Aperture

namespace {

/// Half the angle that one edge of the polygon spans.
float half_slice(int blades) { return k_pi / static_cast<float>(blades); }

}  // namespace

Vec2 Aperture::sample(const Vec2& u) const {
  Vec2 p;
  if (blades < 3) {
    p = sample_disk(u);
  } else {
    const float scaled = u.x * static_cast<float>(blades);
    const float slice = std::min(std::floor(scaled), static_cast<float>(blades - 1));
    const Vec2 b = sample_triangle({std::min(scaled - slice, k_one_minus_epsilon), u.y});
    // Triangle of the centre and the ends of one edge, at plus and minus half the slice.
    const float half = half_slice(blades);
    const float x = (b.x + b.y) * std::cos(half), y = (b.x - b.y) * std::sin(half);
    const float angle = rotation_rad + slice * 2.0f * half;
    const float c = std::cos(angle), s = std::sin(angle);
    p = {c * x - s * y, s * x + c * y};
  }
  p.x /= ratio;
  return p;
}

float Aperture::area() const {
  const float unit = blades < 3 ? k_pi : 0.5f * static_cast<float>(blades) * std::sin(2.0f * half_slice(blades));
  return unit / ratio;
}

float Aperture::pdf_area(const Vec2& p) const {
  const Vec2 q(p.x * ratio, p.y);
  bool inside;
  if (blades < 3) {
    inside = q.x * q.x + q.y * q.y <= 1.0f + 1e-6f;
  } else {
    const float half = half_slice(blades);
    const float t = turn(q.x, q.y) * k_two_pi - rotation_rad;
    const float from_middle = t - 2.0f * half * std::round(t / (2.0f * half));
    inside = std::hypot(q.x, q.y) * std::cos(from_middle) <= std::cos(half) * (1.0f + 1e-6f);
  }
  return inside ? 1.0f / area() : 0.0f;
}

Vec2 Aperture::invert(const Vec2& p) const {
  const Vec2 q(p.x * ratio, p.y);
  if (blades < 3) return invert_disk(q);
  const float half = half_slice(blades), n = static_cast<float>(blades);
  const float t = std::atan2(q.y, q.x) - rotation_rad;
  float slice = std::round(t / (2.0f * half));
  const float angle = rotation_rad + slice * 2.0f * half;
  const float c = std::cos(angle), s = std::sin(angle);
  const float x = (c * q.x + s * q.y) / std::cos(half), y = (-s * q.x + c * q.y) / std::sin(half);
  slice -= n * std::floor(slice / n);
  const Vec2 in_slice = invert_triangle({0.5f * (x + y), 0.5f * (x - y)});
  return {clamp_unit((slice + clamp_unit(in_slice.x)) / n), clamp_unit(in_slice.y)};
}

}  // namespace lambent
