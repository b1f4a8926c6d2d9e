// Scattering by a hair: Chiang et al. 2016, "A Practical and Controllable Hair and Fur Model for Production Path
// Tracing", as Cycles' Principled Hair has it (its "Chiang" model).
//
// In the lobe's local frame: x along the fibre, z its normal where it is hit (of a ribbon: the cylinder's that it
// stands for), so that the offset h of the hit from the middle follows from the direction of view alone. Light may come
// and go on all sides. On meshes the fibre lies along the triangle's first edge, as in Cycles.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/trig.h"
#include "engine/base/vec.h"
#include "engine/shading/fresnel.h"
#include "engine/shading/hair_longitudinal.h"
#include "engine/shading/lobe.h"

namespace lambent {

/// The four ways of light through a fibre: reflected, through, through with one reflection inside, all the rest.
class HairFibre {
 public:
  static constexpr int k_ways = 4;

  explicit HairFibre(const Lobe& lobe) : absorption_(lobe.f0), index_(index_of(lobe)), tilt_rad_(lobe.param) {
    const float along = std::clamp(lobe.alpha_x, k_least_roughness, 1.0f);
    const float around = std::clamp(lobe.alpha_y, k_least_roughness, 1.0f);
    const float primary = std::clamp(lobe.f90.x * along, k_least_roughness, 1.0f);
    const float v = variance(along);
    variances_ = {variance(primary), 0.25f * v, 4.0f * v, 4.0f * v};
    const float a22 = power_of_20(around) * sqr(around);
    scale_ = (0.265f * around + 1.194f * sqr(around) + 5.372f * a22) * 0.62665707f;  // sqrt(π/8)
  }

  /// Where a direction comes from or goes to. h = sin γ: offset of the hit from the fibre's middle seen from there.
  struct Side {
    float sin_theta, cos_theta, phi, gamma, gamma_inside;
    Color attenuation[k_ways];
    float share[k_ways];  ///< of the samples; their sum is 1, or all are 0
  };

  Side seen_from(const Vec3& w) const {
    Side side;
    side.sin_theta = std::clamp(w.x, -1.0f, 1.0f);
    side.cos_theta = cosine_of(side.sin_theta);
    side.phi = std::atan2(w.z, w.y);
    const float across = std::sqrt(sqr(w.y) + sqr(w.z));
    const float h = across > 1e-9f ? std::clamp((w.z < 0.0f ? w.y : -w.y) / across, -1.0f, 1.0f) : 0.0f;
    const float cos_gamma = cosine_of(h);
    side.gamma = std::asin(h);
    // Inside: Snell's law along, and around with Bravais' index (Marschner et al. 2003, eq. 2)
    const float cos_theta_inside = std::max(cosine_of(std::clamp(side.sin_theta / index_, -1.0f, 1.0f)), 1e-4f);
    const float bravais = std::sqrt(std::max(sqr(index_) - sqr(side.sin_theta), 1e-8f));
    const float sin_gamma_inside = std::clamp(h * side.cos_theta / bravais, -1.0f, 1.0f);
    side.gamma_inside = std::asin(sin_gamma_inside);

    const float reflected = fresnel_dielectric(side.cos_theta * cos_gamma, index_);
    const Color through = transmittance(absorption_, 2.0f * cosine_of(sin_gamma_inside) / cos_theta_inside);
    Color* a = side.attenuation;
    a[0] = Color(reflected);
    a[1] = through * sqr(1.0f - reflected);
    a[2] = a[1] * through * reflected;
    for (int k = 0; k < 3; ++k) {
      const float again = through[k] * reflected;
      a[3][k] = again < 1.0f ? a[2][k] * again / (1.0f - again) : 0.0f;
    }
    float sum = 0.0f;
    for (int p = 0; p < k_ways; ++p) sum += side.share[p] = average(a[p]);
    for (float& share : side.share) share = sum > 0.0f ? share / sum : 0.0f;
    return side;
  }

  /// f_cos (lobe.h) for light from `light` to the side that the camera is on.
  Color value(const Side& camera, const Vec3& light) const {
    Color sum(0.0f);
    const Target target(light);
    for (int p = 0; p < k_ways; ++p)
      sum += camera.attenuation[p] * (along(camera, target, p) * around(camera, target, p, true));
    return sum;
  }

  /// Density per solid angle with which sample(from, `exact`) returns `to`. @param exact walks from the camera follow
  /// value(); from lights, whose offset h is not the camera's, all that passes the fibre goes evenly around it.
  float pdf_solid_angle(const Side& from, const Vec3& to, bool exact) const {
    float sum = 0.0f;
    const Target target(to);
    for (int p = 0; p < k_ways; ++p)
      if (from.share[p] > 0.0f) sum += from.share[p] * along(from, target, p) * around(from, target, p, exact);
    return sum;
  }

  /// @param u_choice, u in [0, 1)
  Vec3 sample(const Side& from, float u_choice, const Vec2& u, bool exact) const {
    int p = 0;
    while (p + 1 < k_ways && u_choice >= from.share[p]) u_choice -= from.share[p++];
    while (p > 0 && from.share[p] <= 0.0f) --p;  // rounding
    const float u_along = std::clamp(u_choice / std::max(from.share[p], 1e-9f), 1e-9f, 1.0f);
    const float sin_from = tilted_sine(from, p);
    const float sin_to =
        sample_longitudinal(sin_from, cosine_of(sin_from), variances_[static_cast<size_t>(p)], Vec2(u_along, u.y));
    const float cos_to = cosine_of(sin_to);
    float phi = 2.0f * k_pi * u.x;
    if (follows_azimuth(p, exact)) phi = turn(from, p) + sample_logistic(u.x);
    phi += from.phi;
    return {sin_to, cos_to * std::cos(phi), cos_to * std::sin(phi)};
  }

  /// Directional albedo, exact for directions across the fibre. @param cos_view of the angle to the lobe's normal
  static Color albedo(const Lobe& lobe, float cos_view) {
    const float index = index_of(lobe);
    const float f = fresnel_dielectric(cos_view, index);
    const float sin_inside2 = std::min((1.0f - sqr(cos_view)) / sqr(index), 1.0f);
    const Color t = transmittance(lobe.f0, 2.0f * safe_sqrt(1.0f - sin_inside2));
    Color sum(f);
    for (int k = 0; k < 3; ++k)
      if (t[k] * f < 1.0f) sum[k] += sqr(1.0f - f) * t[k] / (1.0f - t[k] * f);
    return sum;
  }

 private:
  static constexpr float k_least_roughness = 0.001f;

  struct Target {
    float theta, cos_theta, phi;
    explicit Target(const Vec3& w) {
      const float sin_theta = std::clamp(w.x, -1.0f, 1.0f);
      theta = std::asin(sin_theta), cos_theta = cosine_of(sin_theta), phi = std::atan2(w.z, w.y);
    }
  };

  static float index_of(const Lobe& lobe) { return std::clamp(lobe.f90.y, 1e-3f, 1e3f); }
  static float cosine_of(float sine) { return safe_sqrt(1.0f - sine * sine); }
  static float power_of_20(float x) {
    const float x4 = sqr(sqr(x)), x16 = sqr(sqr(x4));
    return x16 * x4;
  }
  static float variance(float roughness) {  // Chiang et al., eq. 7
    return sqr(0.726f * roughness + 0.812f * sqr(roughness) + 3.7f * power_of_20(roughness));
  }
  static Color transmittance(const Color& absorption, float distance) {
    return {std::exp(-absorption.x * distance), std::exp(-absorption.y * distance), std::exp(-absorption.z * distance)};
  }

  /// The cuticle's scales turn what is seen: by twice their tilt, the other way and half as far for what goes through.
  float tilted_sine(const Side& side, int p) const {
    constexpr float k_tilts[k_ways] = {2.0f, -1.0f, -4.0f, 0.0f};
    const SinCos tilt{std::sin(k_tilts[p] * tilt_rad_), std::cos(k_tilts[p] * tilt_rad_)};
    return std::clamp(side.sin_theta * tilt.cos + side.cos_theta * tilt.sin, -1.0f, 1.0f);
  }

  /// Density of the angle from the plane across the fibre.
  float along(const Side& from, const Target& to, int p) const {
    const float sin_from = tilted_sine(from, p);
    return longitudinal_density(sin_from, cosine_of(sin_from), to.theta, to.cos_theta,
                                variances_[static_cast<size_t>(p)]);
  }

  /// Net turn around the fibre of light that takes way p.
  static float turn(const Side& from, int p) {
    return 2.0f * static_cast<float>(p) * from.gamma_inside - 2.0f * from.gamma + static_cast<float>(p) * k_pi;
  }
  static bool follows_azimuth(int p, bool exact) { return p == 0 || (exact && p < 3); }
  float logistic_tail() const { return 1.0f / (1.0f + std::exp(std::min(k_pi / scale_, 80.0f))); }
  /// Density per angle around the fibre.
  float around(const Side& from, const Target& to, int p, bool exact) const {
    if (!follows_azimuth(p, exact)) return 0.5f * k_inv_pi;
    const float off = to.phi - from.phi - turn(from, p);
    const float wrapped = off - 2.0f * k_pi * std::floor((off + k_pi) / (2.0f * k_pi));
    const float e = std::exp(-std::fabs(wrapped) / scale_);
    return e / (scale_ * sqr(1.0f + e)) / (1.0f - 2.0f * logistic_tail());
  }
  float sample_logistic(float u) const {
    const float tail = logistic_tail();
    const float c = std::clamp(u * (1.0f - 2.0f * tail) + tail, 1e-9f, 1.0f - 1e-7f);
    return std::clamp(-scale_ * std::log(1.0f / c - 1.0f), -k_pi, k_pi);
  }

  Color absorption_;
  float index_, tilt_rad_, scale_;
  std::array<float, k_ways> variances_;
};

}  // namespace lambent
