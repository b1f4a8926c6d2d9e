// Scattering by a hair whose surface is rough, seen from afar: Huang, Hullin & Hanika 2022, "A Microfacet-based Hair
// Scattering Model", as Cycles' Principled Hair has it (its "Huang" model, from 4.0 on) where a hair is thinner than a
// pixel, and on meshes always.
//
// The whole width of the fibre is seen at once, so that only the angles to its axis and the angle around it count.
// Light is reflected (R) or goes through by a facet on either side (TT) or by three (TRT); what goes on inside is
// estimated (TRRT+). Of TT and TRT the facets are summed over by a few points, moved at random by a hash of the two
// directions: values have noise whose mean is right, and are the same whenever they are asked for.
//
// In the fibre's frame: x = sin φ cos θ, y = sin θ along the fibre, z = cos φ cos θ; φ is 0 at the camera. Points on
// the elliptic cross-section and their normals are told by γ: (sin γ, b cos γ).
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/base/frame.h"
#include "engine/base/hash.h"
#include "engine/sampling/sampler.h"
#include "engine/sampling/warp.h"
#include "engine/shading/albedo_table.h"
#include "engine/shading/fresnel.h"
#include "engine/shading/hair_longitudinal.h"
#include "engine/shading/lobe.h"
#include "engine/shading/microfacet.h"

namespace lambent {

class HairMicrofacets {
 public:
  explicit HairMicrofacets(const Lobe& lobe)
      : absorption_(lobe.f0),
        strength_(lobe.f90),
        eta_(std::clamp(lobe.eta, k_least_index, k_most_index)),
        alpha_(std::clamp(lobe.alpha_x, k_least_alpha, 1.0f)),
        tilt_rad_(-lobe.param),
        aspect_(std::clamp(lobe.alpha_y, 0.05f, 1.0f)),
        facets_(Distribution::ggx, alpha_, alpha_) {
    // Samples: one part for each way of light, by what it has of it on the average, and one that goes anywhere.
    const float a2 = sqr(alpha_);
    ways_[0] = {4.0f * a2, 2.0f * tilt_rad_, 0.0f};
    ways_[1] = {2.0f * a2, -tilt_rad_, 0.0f};
    ways_[2] = {6.0f * a2, -4.0f * tilt_rad_, 0.0f};
    ways_[3] = {4.0f * alpha_, 0.0f, 0.0f};
    const Energy energy = mean_energy();
    ways_[0].share = average(energy.reflected), ways_[1].share = average(energy.through);
    ways_[2].share = average(energy.returned), ways_[3].share = average(energy.rest);
    float sum = 0.0f;
    for (Way& way : ways_) sum += way.share;
    ways_[3].share += k_wide * sum, sum *= 1.0f + k_wide;
    anywhere_ = sum > 0.0f ? k_anywhere : 1.0f;
    for (Way& way : ways_) way.share = sum > 0.0f ? way.share * (1.0f - k_anywhere) / sum : 0.0f;
  }

  /// f_cos (lobe.h). Directions in the lobe's frame: x along the fibre.
  Color value(const Vec3& camera, const Vec3& light) const {
    const float sin_view = std::clamp(camera.x, -1.0f, 1.0f), cos_view = safe_sqrt(1.0f - sqr(sin_view));
    const float sin_light = std::clamp(light.x, -1.0f, 1.0f), cos_light = safe_sqrt(1.0f - sqr(sin_light));
    if (!(cos_view > 1e-4f && cos_light > 1e-4f)) return Color(0.0f);
    const float turn = std::atan2(light.y, light.z) - std::atan2(camera.y, camera.z);
    const Vec3 wi(0.0f, sin_view, cos_view), wo(std::sin(turn) * cos_light, sin_light, std::cos(turn) * cos_light);
    // No facet's mean normal sees the light, or how far around the fibre they see the camera
    const float tan_tilt = std::tan(tilt_rad_);
    if (tan_tilt * sin_light < -cos_light) return Color(0.0f);
    const float edge = -tan_tilt * sin_view / cos_view;
    if (!(edge < 1.0f)) return Color(0.0f);
    const float span = std::min(gamma_at(std::acos(std::max(edge, 0.0f))), k_most_gamma);
    RandomStream numbers = numbers_for(wi, wo);
    const Color sum = reflected(wi, wo, span, numbers) + inner(wi, wo, span, numbers);
    return is_finite(sum) ? sum : Color(0.0f);
  }

  /// Density per solid angle with which sample(from) returns `to`.
  float pdf_solid_angle(const Vec3& from, const Vec3& to) const {
    const float theta = std::asin(std::clamp(to.x, -1.0f, 1.0f)), cos_to = std::cos(theta);
    const float turn = std::atan2(to.y, to.z) - std::atan2(from.y, from.z);
    float sum = anywhere_ * 0.25f * k_inv_pi;
    for (int p = 0; p < k_ways; ++p) {
      if (!(ways_[p].share > 0.0f)) continue;
      const Elevation seen = tilted(from, ways_[p]);
      sum += ways_[p].share * longitudinal_density(seen.sine, seen.cosine, theta, cos_to, ways_[p].variance) *
             around(p, turn);
    }
    return sum;
  }

  /// @param u_choice, u in [0, 1)
  Vec3 sample(const Vec3& from, float u_choice, const Vec2& u) const {
    if (u_choice < anywhere_) return sample_uniform_sphere(Vec2(u_choice / anywhere_, u.y));
    u_choice -= anywhere_;
    int p = 0;
    while (p + 1 < k_ways && u_choice >= ways_[p].share) u_choice -= ways_[p++].share;
    while (p > 0 && !(ways_[p].share > 0.0f)) --p;  // rounding
    const Elevation seen = tilted(from, ways_[p]);
    const float rest = std::clamp(u_choice / std::max(ways_[p].share, 1e-9f), 0.0f, 1.0f);
    const float sin_to = sample_longitudinal(seen.sine, seen.cosine, ways_[p].variance, Vec2(rest, u.y));
    const float cos_to = safe_sqrt(1.0f - sqr(sin_to));
    const float phi = std::atan2(from.y, from.z) + sample_around(p, u.x);
    return {sin_to, cos_to * std::sin(phi), cos_to * std::cos(phi)};
  }

  /// Directional albedo, about: of a smooth fibre that is seen from straight across.
  static Color albedo(const Lobe& lobe) {
    const Energy energy = HairMicrofacets(lobe).mean_energy();
    return energy.reflected + energy.through + energy.returned + energy.rest;
  }

 private:
  static constexpr int k_ways = 4;
  static constexpr int k_numbers = 6;  // of random numbers for three facets
  static constexpr float k_least_alpha = 0.001f, k_least_index = 0.2f, k_most_index = 10.0f;
  // Samples that bound the weights where facets' densities fall off more slowly than the narrow parts': anywhere, and
  // the wide part over what it has of the light.
  static constexpr float k_anywhere = 0.1f, k_wide = 0.15f;
  static constexpr float k_most_gamma = 1.5260f;  // where the fibre's edge is cut off, as in Cycles (h = 0.999)
  static constexpr int k_reflection_points = 12, k_least_points = 12, k_most_points = 64;

  struct Way {
    float variance, tilt, share;
  };
  struct Elevation {
    float sine, cosine;
  };
  struct Energy {
    Color reflected{0.0f}, through{0.0f}, returned{0.0f}, rest{0.0f};
  };

  /// Numbers that are the same for the same directions.
  static RandomStream numbers_for(const Vec3& wi, const Vec3& wo) {
    const uint64_t a = std::bit_cast<uint32_t>(wi.y) | uint64_t(std::bit_cast<uint32_t>(wo.y)) << 32;
    const uint64_t b = std::bit_cast<uint32_t>(wo.z) | uint64_t(std::bit_cast<uint32_t>(wo.x)) << 32;
    return RandomStream(hash_u64(a) ^ b);
  }

  Elevation tilted(const Vec3& w, const Way& way) const {
    const float sine = std::clamp(w.x, -1.0f, 1.0f), cosine = safe_sqrt(1.0f - sqr(sine));
    const float s = std::sin(way.tilt), c = std::cos(way.tilt);
    const float turned = std::clamp(sine * c - cosine * s, -1.0f, 1.0f);
    return {turned, safe_sqrt(1.0f - sqr(turned))};
  }

  /// Density per angle around the fibre: what a smooth one reflects, seen from afar (both halves of the circle), for R;
  /// forward, with a floor, for TT; evenly for the rest.
  static float around(int p, float turn) {
    if (p == 0) return 0.25f * std::fabs(std::cos(0.5f * turn));
    if (p == 1) return k_inv_pi * 0.5f * (0.25f + 0.75f * k_pi * 0.5f * std::fabs(std::sin(0.5f * turn)));
    return 0.5f * k_inv_pi;
  }
  static float sample_around(int p, float u) {
    if (p == 0) return 2.0f * std::asin(std::clamp(2.0f * u - 1.0f, -1.0f, 1.0f));
    if (p == 1) {
      if (u < 0.25f) return 2.0f * k_pi * u * 4.0f;
      return k_pi + 2.0f * std::asin(std::clamp(2.0f * (u - 0.25f) / 0.75f - 1.0f, -1.0f, 1.0f));
    }
    return 2.0f * k_pi * u;
  }

  float gamma_at(float phi) const { return aspect_ == 1.0f ? phi : std::atan2(std::sin(phi), aspect_ * std::cos(phi)); }
  /// Of the normal at γ.
  float phi_at(float gamma) const {
    return aspect_ == 1.0f ? gamma : std::atan2(aspect_ * std::sin(gamma), std::cos(gamma));
  }
  /// Mean normal of the facets at γ, with scales tilted by `tilt`.
  Vec3 mean_normal(float tilt, float gamma) const {
    const float s = std::sin(tilt), c = std::cos(tilt), phi = phi_at(gamma);
    return {std::sin(phi) * c, s, std::cos(phi) * c};
  }
  float arc_length(float gamma) const { return std::sqrt(1.0f - (1.0f - sqr(aspect_)) * sqr(std::sin(gamma))); }
  /// Distance across the cross-section between two of its points.
  float chord(float gamma_a, float gamma_b) const {
    const float x = std::sin(gamma_a) - std::sin(gamma_b), z = aspect_ * (std::cos(gamma_a) - std::cos(gamma_b));
    return std::sqrt(x * x + z * z);
  }
  Color transmittance(float distance) const {
    return {std::exp(-absorption_.x * distance), std::exp(-absorption_.y * distance),
            std::exp(-absorption_.z * distance)};
  }

  static bool sees(const Vec3& w, const Vec3& normal, const Vec3& facet) {
    return dot(w, facet) > 0.0f && dot(w, normal) > 0.0f;
  }
  static Vec3 at_cosine(float cosine) { return {safe_sqrt(1.0f - sqr(cosine)), 0.0f, cosine}; }
  float density(float cosine) const { return facets_.d(at_cosine(std::min(cosine, 1.0f))); }
  float lambda(float cosine) const { return facets_.lambda(at_cosine(cosine)); }
  float masking(float cos_a, float cos_b) const { return 1.0f / (1.0f + lambda(cos_a) + lambda(cos_b)); }
  /// Given that the direction of cos_a is not masked.
  float masking_after(float cos_a, float cos_b) const {
    const float a = lambda(cos_a);
    return (1.0f + a) / (1.0f + a + lambda(cos_b));
  }
  /// Restores what facets lose by scattering only once, as for glass.
  float energy_scale(float cosine, float eta) const {
    return 1.0f / std::max(ggx_glass_albedo(std::fabs(cosine), alpha_, eta, true), 1e-2f);
  }
  Vec3 sample_facet(const Vec3& w, const Vec3& normal, const Vec2& u) const {
    const Frame frame = Frame::from_normal(normal);
    return frame.to_world(facets_.sample_normal(frame.to_local(w), u));
  }
  Color reflected(const Vec3& wi, const Vec3& wo, float span, RandomStream& numbers) const {
    if (!(strength_.x > 0.0f)) return Color(0.0f);
    const Vec3 wh = normalize(wi + wo);
    if (length_squared(wh) == 0.0f || dot(wi, wh) <= 0.0f || dot(wo, wh) <= 0.0f) return Color(0.0f);
    // Facets like wh are densest at one γ, and fall off about as the square of a Cauchy density around it.
    const float middle = gamma_at(std::atan2(wh.x, wh.z)), cos_wh = safe_sqrt(1.0f - sqr(wh.y));
    const float off = 2.0f * std::sin(0.5f * (std::asin(std::clamp(wh.y, -1.0f, 1.0f)) - tilt_rad_));
    const float width = std::sqrt((sqr(alpha_) + sqr(off)) / std::max(cos_wh * std::cos(tilt_rad_), 0.02f)) + 1e-4f;
    const float low = std::atan((-span - middle) / width), high = std::atan((span - middle) / width);
    const float step = (high - low) / static_cast<float>(k_reflection_points), shift = numbers.next_1d();
    float sum = 0.0f;
    for (int i = 0; i < k_reflection_points; ++i) {
      const float tangent = std::tan(low + step * (static_cast<float>(i) + shift));
      const float gamma = middle + width * tangent;
      const Vec3 m = mean_normal(tilt_rad_, gamma), flat(m.x, 0.0f, m.z);
      if (!sees(wi, flat, wh) || !sees(wo, flat, wh)) continue;
      const float cos_mi = dot(m, wi);
      if (!(cos_mi > 0.0f)) continue;
      sum += density(dot(m, wh)) * masking(cos_mi, dot(m, wo)) * arc_length(gamma) * energy_scale(cos_mi, eta_) *
             (1.0f + sqr(tangent));
    }
    const float f = fresnel_dielectric(dot(wi, wh), eta_);
    return Color(strength_.x * 0.25f * f * sum * step * width / (2.0f * wi.z));
  }

  /// TT, TRT and beyond.
  Color inner(const Vec3& wi, const Vec3& wo, float span, RandomStream& numbers) const {
    if (!(strength_.y > 0.0f || strength_.z > 0.0f)) return Color(0.0f);
    const int points = std::clamp(static_cast<int>(2.5f / alpha_), k_least_points, k_most_points);
    const float step = 2.0f * span / static_cast<float>(points);
    // Points of the lattice R6 (Roberts 2018), moved at random
    const float shift = numbers.next_1d();
    float u[k_numbers];
    for (float& number : u) number = numbers.next_1d();
    static constexpr float k_step[k_numbers] = {0.8986537f, 0.8075784f, 0.7257333f, 0.6521830f, 0.5860868f, 0.5266890f};
    Color sum(0.0f), rest(0.0f);
    for (int i = 0; i < points; ++i) {
      add_inner(wi, wo, -span + step * (static_cast<float>(i) + shift), u, sum, rest);
      for (int k = 0; k < k_numbers; ++k) u[k] += k_step[k] - (u[k] + k_step[k] >= 1.0f ? 1.0f : 0.0f);
    }
    const float cos_to = safe_sqrt(1.0f - sqr(wo.y)), theta_to = std::asin(std::clamp(wo.y, -1.0f, 1.0f));
    const float spread = longitudinal_density(wi.y, wi.z, theta_to, cos_to, ways_[3].variance) * 0.5f * k_inv_pi;
    return sum * (step / (sqr(eta_) * 2.0f * wi.z)) + rest * (0.5f * step * spread);
  }

  /// Light that enters at γ by one facet: what leaves to wo by a second (TT) or a third one (TRT) goes to `sum`, the
  /// share of what stays inside to `rest`.
  void add_inner(const Vec3& wi, const Vec3& wo, float gamma_1, const float (&u)[k_numbers], Color& sum,
                 Color& rest) const {
    const float inverse = 1.0f / eta_;
    const Vec3 m1 = mean_normal(tilt_rad_, gamma_1), flat1 = mean_normal(0.0f, gamma_1);
    const float cos_mi1 = dot(wi, m1);
    if (!(cos_mi1 > 0.0f)) return;
    const Vec3 h1 = sample_facet(wi, m1, {u[0], u[1]});
    const float cos_hi1 = dot(wi, h1);
    if (!(cos_hi1 > 0.0f)) return;
    Vec3 wt;
    if (!refract(wi, h1, eta_, wt)) return;
    // Cycles asks whether the facet and its mean normal see both directions as if light came back along wt
    if (!sees(wi, flat1, h1) || dot(wt, m1) >= 0.0f || dot(wt, flat1) >= 0.0f) return;
    const float t1 = (1.0f - fresnel_dielectric(cos_hi1, eta_)) * energy_scale(cos_mi1, eta_);
    const float phi_t = std::atan2(wt.x, wt.z), cos_theta_t = safe_sqrt(1.0f - sqr(wt.y));
    const float gamma_2 = 2.0f * gamma_of_chord(phi_t) - gamma_1;
    const Vec3 m2 = mean_normal(-tilt_rad_, gamma_2), flat2 = mean_normal(0.0f, gamma_2);
    const float cos_mo1 = -dot(wt, m1), cos_mi2 = -dot(wt, m2);
    if (!(cos_mi2 > 0.0f) || !(cos_theta_t > 1e-4f)) return;
    const float entered = t1 * masking_after(cos_mi1, cos_mo1);
    const Color passed = transmittance(chord(gamma_1, gamma_2 + k_pi) / cos_theta_t);
    const float scale2 = energy_scale(cos_mi2, inverse);
    if (strength_.y > 0.0f) {
      const float out = leaves(wt * -1.0f, wo, m2, flat2);
      if (out > 0.0f)
        sum += passed * (strength_.y * entered * scale2 * out * masking(cos_mi2, -dot(wo, m2)) * cos_mi1 / cos_mo1 *
                         arc_length(gamma_2));
    }
    if (!(strength_.z > 0.0f)) return;
    const Vec3 back = wt * -1.0f, h2 = sample_facet(back, m2, {u[2], u[3]});
    const float cos_hi2 = dot(back, h2);
    if (!(cos_hi2 > 0.0f)) return;
    const float r2 = fresnel_dielectric(cos_hi2, inverse);
    const Vec3 wtr = wt - h2 * (2.0f * dot(h2, wt));  // on its way, after the reflection
    if (!sees(back, flat2, h2) || dot(wtr, m2) <= 0.0f || dot(wtr, flat2) <= 0.0f) return;
    const float cos_mo2 = dot(m2, wtr), reflected_2 = entered * r2 * scale2 * masking_after(cos_mi2, cos_mo2);
    const Vec3 from3 = wtr * -1.0f;
    const float phi_tr = std::atan2(from3.x, from3.z), cos_theta_tr = safe_sqrt(1.0f - sqr(wtr.y));
    if (!(cos_theta_tr > 1e-4f)) return;
    const float gamma_3 = gamma_1 - 2.0f * (gamma_of_chord(phi_t) - gamma_of_chord(phi_tr)) + k_pi;
    const Vec3 m3 = mean_normal(-tilt_rad_, gamma_3), flat3 = mean_normal(0.0f, gamma_3);
    const float cos_mi3 = dot(from3, m3);
    if (!(cos_mi3 > 0.0f)) return;
    const Color again = transmittance(chord(gamma_2, gamma_3) / cos_theta_tr);
    const float reflected_3 = energy_scale(cos_mi3, inverse) * reflected_2;
    // What a third facet reflects stays inside: a geometric series of the average of the two times before.
    const Vec3 h3 = sample_facet(from3, m3, {u[4], u[5]});
    const float cos_hi3 = dot(from3, h3), cos_mo3 = dot(m3, h3) * 2.0f * cos_hi3 - cos_mi3;
    if (cos_hi3 > 0.0f && cos_mo3 > 0.0f) {
      const float r3 = fresnel_dielectric(cos_hi3, inverse), t_mean = std::max(1.0f - 0.5f * (r2 + r3), 1e-5f);
      rest += passed * again * passed *
              (std::cos(gamma_1) * reflected_3 * masking_after(cos_mi3, cos_mo3) * r3 * t_mean) /
              (Color(1.0f) - passed * (1.0f - t_mean));
    }
    const float out = leaves(from3, wo, m3, flat3);
    if (out > 0.0f)
      sum += passed * again *
             (strength_.z * reflected_3 * out * masking(cos_mi3, -dot(wo, m3)) * cos_mi1 / cos_mo1 * cos_mi2 / cos_mo2 *
              arc_length(gamma_3));
  }

  /// Half the sum of the γ of a chord's ends (the far one's less π) that goes at angle φ.
  float gamma_of_chord(float phi) const { return phi_at(phi); }

  /// Refraction out of the fibre by the facet that takes `from` (where light inside comes from, seen back) to wo, but
  /// masking and 1/cos: (1 − F)·D·|from·h|·|wo·h| / |from + wo/η|² (Walter et al. 2007, eq. 21).
  float leaves(const Vec3& from, const Vec3& wo, const Vec3& m, const Vec3& flat) const {
    const float inverse = 1.0f / eta_;
    const Vec3 sum = from + wo * inverse;
    const float size = length(sum);
    if (!(size > 1e-6f)) return 0.0f;
    const Vec3 h = sum * (1.0f / size);
    const float cos_from = dot(from, h), cos_to = -dot(wo, h), cos_m = dot(m, h);
    if (!(cos_from > 0.0f && cos_to > 0.0f && cos_m > 0.0f)) return 0.0f;
    if (dot(from, flat) <= 0.0f || dot(wo, flat) >= 0.0f || dot(wo, m) >= 0.0f) return 0.0f;
    return (1.0f - fresnel_dielectric(cos_from, inverse)) * density(cos_m) * cos_from * cos_to / sqr(size);
  }

  /// Of a smooth, round fibre, averaged over four places across it.
  Energy mean_energy() const {
    Energy mean;
    for (const float h : {0.125f, 0.375f, 0.625f, 0.875f}) {
      const float f = fresnel_dielectric(std::sqrt(1.0f - h * h), eta_);
      const Color t = transmittance(2.0f * safe_sqrt(1.0f - sqr(h / eta_)));
      mean.reflected += Color(0.25f * strength_.x * f);
      mean.through += t * (0.25f * strength_.y * sqr(1.0f - f));
      mean.returned += t * t * (0.25f * strength_.z * sqr(1.0f - f) * f);
      if (strength_.z > 0.0f)
        for (int k = 0; k < 3; ++k)
          if (t[k] * f < 1.0f) mean.rest[k] += 0.25f * sqr(1.0f - f) * sqr(t[k] * f) * t[k] / (1.0f - t[k] * f);
    }
    return mean;
  }

  Color absorption_;
  Color strength_;  ///< of R, TT and TRT
  float eta_, alpha_, tilt_rad_, aspect_;
  Microfacets facets_;
  Way ways_[k_ways];
  float anywhere_;
};

}  // namespace lambent
