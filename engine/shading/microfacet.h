// Microfacet distributions in a local frame (z: the lobe's normal): density, masking, sampling.
//
// GGX and Beckmann sample visible normals (Heitz & d'Eon 2014): GGX by spherical caps (Dupuy & Benyoub 2023), Beckmann
// by inverting its slope distribution (Jakob 2014). GTR1 (Burley 2012's clearcoat) samples D·cos and masks with the GGX
// term of alpha 0.25, as Cycles before 4.0 evaluates it.
#pragma once

#include "engine/base/trig.h"
#include "engine/base/vec.h"
#include "engine/shading/lobe.h"

namespace lambent {

/// Inverse error function for x in (-1, 1); relative error below 3e-7 (Giles 2010, single precision).
inline float erf_inverse(float x) {
  float w = -std::log(std::max((1.0f - x) * (1.0f + x), 1e-30f));
  float p;
  if (w < 5.0f) {
    w -= 2.5f;
    p = 2.81022636e-08f;
    p = 3.43273939e-07f + p * w;
    p = -3.5233877e-06f + p * w;
    p = -4.39150654e-06f + p * w;
    p = 0.00021858087f + p * w;
    p = -0.00125372503f + p * w;
    p = -0.00417768164f + p * w;
    p = 0.246640727f + p * w;
    p = 1.50140941f + p * w;
  } else {
    w = std::sqrt(w) - 3.0f;
    p = -0.000200214257f;
    p = 0.000100950558f + p * w;
    p = 0.00134934322f + p * w;
    p = -0.00367342844f + p * w;
    p = 0.00573950773f + p * w;
    p = -0.0076224613f + p * w;
    p = 0.00943887047f + p * w;
    p = 1.00167406f + p * w;
    p = 2.83297682f + p * w;
  }
  return p * x;
}

/// Share of facets that two directions both see where masking and shadowing are correlated by height (Heitz 2014, eq.
/// 99), from Smith's factors of each: 1 / (1 + Λ_a + Λ_b). 0 if either is.
inline float correlated_masking(float g_a, float g_b) { return 1.0f / (1.0f / g_a + 1.0f / g_b - 1.0f); }

/// One distribution with its two scales of slope.
struct Microfacets {
  Distribution distribution;
  float alpha_x, alpha_y;

  explicit Microfacets(const Lobe& lobe)
      : distribution(lobe.distribution), alpha_x(lobe.alpha_x), alpha_y(lobe.alpha_y) {}
  Microfacets(Distribution kind, float ax, float ay) : distribution(kind), alpha_x(ax), alpha_y(ay) {}

  /// Density of facets with unit normal m per area and solid angle: ∫ D cos = 1. Zero below the horizon.
  float d(const Vec3& m) const {
    if (m.z <= 0.0f) return 0.0f;
    const float x = m.x / alpha_x, y = m.y / alpha_y;
    switch (distribution) {
      case Distribution::ggx: {
        const float t = x * x + y * y + m.z * m.z;
        return 1.0f / (k_pi * alpha_x * alpha_y * t * t);
      }
      case Distribution::beckmann: {
        const float z2 = m.z * m.z;
        const float exponent = (x * x + y * y) / z2;
        if (exponent > 80.0f) return 0.0f;
        return std::exp(-exponent) / (k_pi * alpha_x * alpha_y * z2 * z2);
      }
      case Distribution::gtr1: {
        if (alpha_x >= 0.999f) return k_inv_pi;  // the limit: uniform in projected solid angle
        const float a2 = alpha_x * alpha_x;
        // 1 + (a2 − 1)·z² written with the sine: no cancellation near the normal
        return (1.0f - a2) / (-k_pi * std::log(a2) * (a2 * m.z * m.z + m.x * m.x + m.y * m.y));
      }
    }
    return 0.0f;
  }

  /// Smith's Λ of a direction on either side.
  float lambda(const Vec3& w) const {
    const float z2 = w.z * w.z;
    if (!(z2 > 1e-30f)) return 1e15f;
    float slope2 = sqr(alpha_x * w.x) + sqr(alpha_y * w.y);
    if (distribution == Distribution::gtr1) slope2 = 0.0625f * (w.x * w.x + w.y * w.y);
    if (distribution == Distribution::beckmann) {
      if (slope2 <= 0.0f) return 0.0f;
      const float a = std::sqrt(z2 / slope2);
      if (a > 4.0f) return 0.0f;
      return std::max(0.0f, 0.5f * ((std::exp(-a * a) * 0.56418958f) / a - std::erfc(a)));
    }
    return 0.5f * (std::sqrt(1.0f + slope2 / z2) - 1.0f);
  }
  float g1(const Vec3& w) const { return 1.0f / (1.0f + lambda(w)); }

  /// Density per solid angle with which sample_normal(w) returns m; w.z > 0.
  float pdf_normal_solid_angle(const Vec3& w, const Vec3& m) const {
    if (distribution == Distribution::gtr1) return d(m) * std::max(m.z, 0.0f);
    const float w_m = dot(w, m);
    if (w_m <= 0.0f) return 0.0f;
    return g1(w) * d(m) * w_m / w.z;
  }

  /// A normal for direction w (w.z > 0). u in [0, 1)².
  Vec3 sample_normal(const Vec3& w, const Vec2& u) const {
    switch (distribution) {
      case Distribution::ggx:
        return sample_ggx(w, u);
      case Distribution::beckmann:
        return sample_beckmann(w, u);
      case Distribution::gtr1: {
        const float a2 = std::min(alpha_x * alpha_x, 0.998f);
        // Burley 2012, appendix B: cos² = (1 − a2^(1−u)) / (1 − a2); the sine from expm1 keeps precision
        const float sin2 = std::clamp((std::exp(std::log(a2) * (1.0f - u.x)) - a2) / (1.0f - a2), 0.0f, 1.0f);
        const float s = std::sqrt(sin2), phi = 2.0f * k_pi * u.y;
        return {s * std::cos(phi), s * std::sin(phi), std::sqrt(1.0f - sin2)};
      }
    }
    return {0, 0, 1};
  }

 private:
  Vec3 sample_ggx(const Vec3& w, const Vec2& u) const {
    const Vec3 w_std = normalize(Vec3(w.x * alpha_x, w.y * alpha_y, w.z));
    const SinCos phi = sin_cos_turn(u.x);
    const float z = (1.0f - u.y) * (1.0f + w_std.z) - w_std.z;
    const float s = safe_sqrt(1.0f - z * z);
    const Vec3 h = Vec3(s * phi.cos, s * phi.sin, z) + w_std;
    const Vec3 m = normalize(Vec3(h.x * alpha_x, h.y * alpha_y, std::max(h.z, 1e-9f)));
    return m;
  }

  Vec3 sample_beckmann(const Vec3& w, const Vec2& u) const {
    const Vec3 w_std = normalize(Vec3(w.x * alpha_x, w.y * alpha_y, w.z));
    const float cos_theta = std::clamp(w_std.z, 1e-6f, 1.0f);
    const float sin_theta = safe_sqrt(1.0f - cos_theta * cos_theta);
    const float ux = std::clamp(u.x, 1e-6f, 1.0f - 1e-6f), uy = std::clamp(u.y, 1e-6f, 1.0f - 1e-6f);
    float slope_x, slope_y;
    if (sin_theta < 1e-4f) {
      const float r = std::sqrt(-std::log(1.0f - ux)), phi = 2.0f * k_pi * uy;
      slope_x = r * std::cos(phi);
      slope_y = r * std::sin(phi);
    } else {
      // Invert P(b) = (1 + b + K·exp(−erf⁻¹(b)²)) / (1 + erf(cot) + K·exp(−cot²)) = ux on b in (−1, erf(cot)): P is
      // increasing there. Newton's steps, bisection where they leave the bracket.
      const float tan_theta = sin_theta / cos_theta, cot_theta = cos_theta / sin_theta;
      const float k = tan_theta * 0.56418958f;
      const float b_max = std::erf(cot_theta);
      const float total = 1.0f + b_max + k * std::exp(-std::min(cot_theta * cot_theta, 80.0f));
      float low = -1.0f, high = b_max, b = lerp(low, high, ux), x = 0.0f;
      for (int step = 0; step < 24; ++step) {
        if (!(b > low && b < high)) b = 0.5f * (low + high);
        x = erf_inverse(b);
        const float excess = 1.0f + b + k * std::exp(-x * x) - ux * total;
        if (std::fabs(excess) < 2e-7f * total || high - low < 1e-7f) break;
        (excess > 0.0f ? high : low) = b;
        b -= excess / (1.0f - x * tan_theta);
      }
      slope_x = x;
      slope_y = erf_inverse(2.0f * uy - 1.0f);
    }
    const float length_xy = std::sqrt(w_std.x * w_std.x + w_std.y * w_std.y);
    const float cos_phi = length_xy > 0.0f ? w_std.x / length_xy : 1.0f;
    const float sin_phi = length_xy > 0.0f ? w_std.y / length_xy : 0.0f;
    const float sx = (cos_phi * slope_x - sin_phi * slope_y) * alpha_x;
    const float sy = (sin_phi * slope_x + cos_phi * slope_y) * alpha_y;
    return normalize(Vec3(-sx, -sy, 1.0f));
  }
};

}  // namespace lambent
