// Fresnel terms. `eta` is always the index beyond the surface over the index on the side of the cosine.
#pragma once

#include "engine/base/vec.h"

namespace lambent {

/// Indices and extinctions of metals above this are taken as this.
inline constexpr float k_most_conductor_index = 100.0f;

/// Unpolarised reflectance of a smooth dielectric; 1 beyond the critical angle. @param cos_incident in [-1, 1], its
/// sign is ignored. Continuous in both arguments; exactly 0 for eta = 1 off grazing. (Cook & Torrance 1982's form.)
inline float fresnel_dielectric(float cos_incident, float eta) {
  const float c = std::min(std::fabs(cos_incident), 1.0f);
  const float g_squared = (eta - 1.0f) * (eta + 1.0f) + c * c;
  if (!(g_squared > 0.0f)) return 1.0f;
  const float g = std::sqrt(g_squared);
  const float sum = g + c;
  if (sum <= 0.0f) return 1.0f;
  const float a = ((eta - 1.0f) * (eta + 1.0f) / sum) / sum;  // (g - c)/(g + c) without cancellation
  const float b = (c * sum - 1.0f) / (c * (g - c) + 1.0f);
  return std::min(0.5f * a * a * (1.0f + b * b), 1.0f);
}

/// Reflectance at normal incidence.
inline float fresnel_normal(float eta) { return sqr((eta - 1.0f) / (eta + 1.0f)); }

/// Index of refraction that reflects f0 at normal incidence; f0 in [0, 0.99].
inline float eta_from_f0(float f0) {
  const float root = std::sqrt(std::clamp(f0, 0.0f, 0.99f));
  return (1.0f + root) / (1.0f - root);
}

/// (1 − cos)^5 of Schlick 1994, with the cosine clamped to [0, 1].
inline float schlick_weight(float cosine) {
  const float m = std::clamp(1.0f - cosine, 0.0f, 1.0f);
  const float m2 = m * m;
  return m2 * m2 * m;
}

/// How far the dielectric curve of eta has risen from its value at normal incidence (0) to 1.
inline float fresnel_rise(float cosine, float eta) {
  const float f0 = fresnel_normal(eta);
  if (f0 >= 1.0f) return 0.0f;
  return std::clamp((fresnel_dielectric(cosine, eta) - f0) / (1.0f - f0), 0.0f, 1.0f);
}

/// What fresnel_f82 takes from Schlick's curve, times cos·(1 − cos)^6.
inline Color f82_dip(const Color& f0, const Color& f82) {
  constexpr float k_cos = 1.0f / 7.0f, k_w5 = 0.46266436f, k_w6 = 0.39656944f;  // (1 − 1/7)^5 and ^6
  return lerp(f0, Color(1.0f), k_w5) * (Color(1.0f) - f82) * (1.0f / (k_cos * k_w6));
}

/// Metal with colour f0 at normal incidence and f82·(Schlick) at arccos(1/7) (Kutz, Hašan & Edmondson 2021).
inline Color fresnel_f82(float cosine, const Color& f0, const Color& f82) {
  const float c = std::clamp(cosine, 0.0f, 1.0f);
  const float m = 1.0f - c, m5 = m * m * m * m * m;
  const Color f = lerp(f0, Color(1.0f), m5) - f82_dip(f0, f82) * (c * m5 * m);
  return Color(std::clamp(f.x, 0.0f, 1.0f), std::clamp(f.y, 0.0f, 1.0f), std::clamp(f.z, 0.0f, 1.0f));
}

/// The same of one channel, with the value at arccos(1/7) itself given.
inline float fresnel_f82_by_value(float cosine, float f0, float f82) {
  constexpr float k_cos = 1.0f / 7.0f, k_w5 = 0.46266436f, k_w6 = 0.39656944f;
  const float c = std::clamp(cosine, 0.0f, 1.0f);
  const float m = 1.0f - c, m5 = m * m * m * m * m;
  const float dip = (lerp(f0, 1.0f, k_w5) - f82) * (1.0f / (k_cos * k_w6));
  return std::clamp(lerp(f0, 1.0f, m5) - dip * (c * m5 * m), 0.0f, 1.0f);
}

/// Its mean over all angles, weighted by their cosine.
inline Color fresnel_f82_mean(const Color& f0, const Color& f82) {
  // Of Schlick's rise the mean is 1/21, of cos·(1 − cos)^6 1/126
  const Color f = lerp(f0, Color(1.0f), 1.0f / 21.0f) - f82_dip(f0, f82) * (1.0f / 126.0f);
  return Color(std::clamp(f.x, 0.0f, 1.0f), std::clamp(f.y, 0.0f, 1.0f), std::clamp(f.z, 0.0f, 1.0f));
}

/// Reflectance of a conductor of complex index n + ik, unpolarised (Born & Wolf, ch. 14).
inline float conductor_reflectance(float cosine, float n, float k) {
  const float c2 = cosine * cosine, s2 = 1.0f - c2;
  const float t = n * n - k * k - s2, ab = std::sqrt(t * t + 4.0f * n * n * k * k);
  const float a = safe_sqrt(0.5f * (ab + t));
  const float rs = (ab + c2 - 2.0f * a * cosine) / (ab + c2 + 2.0f * a * cosine);
  const float q = ab * c2 + s2 * s2, r = 2.0f * a * cosine * s2;
  return 0.5f * rs * (1.0f + (q - r) / (q + r));
}

/// The colours of FresnelMode::f82 for one channel of a conductor: exact at 0, at 82 and at 90 degrees.
inline void fit_conductor(float n_given, float k_given, float& f0, float& tint) {
  const float n = std::clamp(n_given, 1e-3f, k_most_conductor_index);
  const float k = std::clamp(k_given, 0.0f, k_most_conductor_index);
  constexpr float k_cosine = 1.0f / 7.0f;
  f0 = std::clamp(conductor_reflectance(1.0f, n, k), 0.0f, 1.0f);
  const float schlick = f0 + (1.0f - f0) * std::pow(1.0f - k_cosine, 5.0f);
  tint = std::clamp(conductor_reflectance(k_cosine, n, k) / std::max(schlick, 1e-4f), 0.0f, 1.0f);
}

/// Mean dielectric reflectance over all angles, weighted by their cosine (fit of Kulla & Conty 2017, "Revisiting
/// Physically Based Shading at Imageworks").
inline float fresnel_dielectric_mean(float eta) {
  const float f = eta < 1.0f ? 0.997118f + eta * (0.1014f - eta * (0.965241f + 0.130607f * eta))
                             : (eta - 1.0f) / (4.08567f + 1.00071f * eta);
  return std::clamp(f, 0.0f, 1.0f);
}

/// 1 − F of a pair of directions that refract into each other, from both their cosines to the facet (above 0): the same
/// from either side, and without the cancellation that 1 − F has near the critical angle.
inline float fresnel_transmitted(float cos_i, float cos_t, float eta) {
  const float s = cos_i + eta * cos_t, p = eta * cos_i + cos_t;
  return std::min(2.0f * eta * cos_i * cos_t * (1.0f / (s * s) + 1.0f / (p * p)), 1.0f);
}

/// Direction refracted at a facet with unit normal m (dot(w, m) > 0), away from the surface; false beyond the critical
/// angle.
inline bool refract(const Vec3& w, const Vec3& m, float eta, Vec3& refracted) {
  const float cos_w = dot(w, m);
  const float sin2_t = std::max(0.0f, 1.0f - cos_w * cos_w) / (eta * eta);
  if (sin2_t >= 1.0f) return false;
  refracted = normalize(w * (-1.0f / eta) + m * (cos_w / eta - std::sqrt(1.0f - sin2_t)));
  return true;
}

}  // namespace lambent
