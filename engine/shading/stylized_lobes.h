// Toon, hair on surfaces, and Ashikhmin and Shirley's lobe: in the local frame of lobe_functions.h, as Cycles 3.4.
#pragma once

#include "engine/base/frame.h"
#include "engine/base/trig.h"
#include "engine/sampling/warp.h"
#include "engine/shading/lobe.h"

namespace lambent {

/// f_cos: without the lobe's weight. pdf_solid_angle: of sampling wo given wi.
struct LobeValue {
  Color f_cos{0.0f};
  float pdf_solid_angle = 0.0f;
  float pdf_reverse_solid_angle = 0.0f;
};

inline bool is_stylized(LobeKind kind) {
  return kind == LobeKind::toon || (kind >= LobeKind::glossy_toon && kind <= LobeKind::ashikhmin_shirley);
}

/// Toon's cone: bright up to `inner`, fading out at `outer`, radians from its axis.
struct ToonCone {
  float inner, outer, density;  ///< density: 1 over the cone's solid angle

  explicit ToonCone(const Lobe& lobe) {
    inner = lobe.param * 0.5f * k_pi;
    outer = std::min(inner + lobe.alpha_x * 0.5f * k_pi, 0.5f * k_pi);
    // Narrower than a milliradian there is nothing.
    density = outer > 1e-3f ? 1.0f / (4.0f * k_pi * sqr(std::sin(0.5f * outer))) : 0.0f;
  }
  /// Brightness at an angle of cosine c from the axis, in [0, 1]; times the density it is f_cos.
  float brightness(const Lobe& lobe, float c) const {
    if (c < std::cos(outer)) return 0.0f;
    const float angle = std::acos(std::clamp(c, 0.0f, 1.0f)), fade = lobe.alpha_x * 0.5f * k_pi;
    if (angle < inner) return 1.0f;
    return angle < inner + fade && fade > 0.0f ? 1.0f - (angle - inner) / fade : 0.0f;
  }
  float pdf_solid_angle(float c) const { return c >= std::cos(outer) ? density : 0.0f; }
};

/// The longitudinal and azimuthal densities of hair lobes around the tangent, the local x axis.
struct HairCylinder {
  float roughness_along, roughness_around, tilt_rad;
  bool transmits;

  explicit HairCylinder(const Lobe& lobe)
      : roughness_along(std::max(lobe.alpha_x, 0.001f)),
        roughness_around(std::max(lobe.alpha_y, 0.001f)),
        tilt_rad(lobe.param),
        transmits(lobe.kind == LobeKind::hair_transmission) {}

  /// Angle of a unit direction from the plane across the tangent.
  static float elevation(const Vec3& w) { return std::asin(std::clamp(w.x, -1.0f, 1.0f)); }
  float low(float theta) const { return std::atan(((theta - 0.5f * k_pi) * 0.5f - tilt_rad) / roughness_along); }
  float high(float theta) const { return std::atan(((theta + 0.5f * k_pi) * 0.5f - tilt_rad) / roughness_along); }

  /// Density per solid angle with which sample(from) returns `to`.
  float pdf_solid_angle(const Vec3& from, const Vec3& to) const {
    const float theta_from = elevation(from), theta_to = elevation(to), cos_to = std::cos(theta_to);
    const float across_from = std::sqrt(sqr(from.y) + sqr(from.z)), across_to = std::sqrt(sqr(to.y) + sqr(to.z));
    if (0.5f * k_pi - std::fabs(theta_to) < 0.001f || !(across_from > 1e-6f && across_to > 1e-6f)) return 0.0f;
    const float cos_phi = (from.y * to.y + from.z * to.z) / (across_from * across_to);
    const float phi = std::acos(std::clamp(cos_phi, -1.0f, 1.0f));
    const float t = 0.5f * (theta_from + theta_to) - tilt_rad;
    const float along =
        roughness_along / (2.0f * (t * t + sqr(roughness_along)) * (high(theta_from) - low(theta_from)));
    float around;
    if (transmits) {
      const float p = k_pi - phi;
      if (p > 0.5f * k_pi) return 0.0f;
      around = roughness_around / (2.0f * std::atan(0.5f * k_pi / roughness_around) * (p * p + sqr(roughness_around)));
    } else {
      if (cos_phi < 0.0f) return 0.0f;
      around = std::cos(0.5f * std::min(phi / roughness_around, k_pi)) * 0.25f / roughness_around;
    }
    return std::max(along * around / cos_to, 0.0f);
  }

  /// Fails for directions along the tangent.
  bool sample(const Vec3& from, const Vec2& u, Vec3& to) const {
    const float across = std::sqrt(sqr(from.y) + sqr(from.z));
    if (!(across > 1e-6f)) return false;
    const float theta = elevation(from), a = low(theta), b = high(theta);
    const float half = roughness_along * std::tan(lerp(a, b, u.x)) + tilt_rad;
    const float theta_to = 2.0f * half - theta;
    if (!(std::fabs(theta_to) < 0.5f * k_pi)) return false;
    const float phi =
        transmits ? k_pi + roughness_around * std::tan(2.0f * std::atan(0.5f * k_pi / roughness_around) * (u.y - 0.5f))
                  : 2.0f * std::asin(std::clamp(1.0f - 2.0f * u.y, -1.0f, 1.0f)) * roughness_around;
    const float y = from.y / across, z = from.z / across, c = std::cos(theta_to), s = std::sin(phi), k = std::cos(phi);
    to = normalize(Vec3(std::sin(theta_to), c * (k * y - s * z), c * (k * z + s * y)));
    return true;
  }
};

/// Exponents of Ashikhmin and Shirley's half-vector density for slopes alpha.
inline float phong_exponent(float alpha) { return 2.0f / sqr(std::max(alpha, 1e-3f)) - 2.0f; }

/// Density of half vectors times 4: see the use.
inline float phong_density(const Lobe& lobe, const Vec3& m) {
  const float n_x = phong_exponent(lobe.alpha_x), n_y = phong_exponent(lobe.alpha_y);
  const float sin2 = 1.0f - m.z * m.z;
  const float exponent = sin2 > 1e-12f ? (n_x * sqr(m.x) + n_y * sqr(m.y)) / (sqr(m.x) + sqr(m.y)) : 0.0f;
  return std::sqrt((n_x + 1.0f) * (n_y + 1.0f)) / (8.0f * k_pi) * std::pow(std::max(m.z, 1e-6f), exponent);
}

inline LobeValue eval_stylized(const Lobe& lobe, const Vec3& wi, const Vec3& wo, bool camera_is_wi) {
  LobeValue value;
  const Vec3& camera = camera_is_wi ? wi : wo;
  const Vec3& light = camera_is_wi ? wo : wi;
  switch (lobe.kind) {
    case LobeKind::toon: {
      if (wi.z <= 0.0f || wo.z <= 0.0f) break;
      const ToonCone cone(lobe);
      value.f_cos = Color(cone.density * cone.brightness(lobe, light.z));
      value.pdf_solid_angle = cone.pdf_solid_angle(wo.z);
      value.pdf_reverse_solid_angle = cone.pdf_solid_angle(wi.z);
      break;
    }
    case LobeKind::glossy_toon: {
      if (wi.z <= 0.0f || wo.z <= 0.0f) break;
      const ToonCone cone(lobe);
      const float c = dot(Vec3(-wi.x, -wi.y, wi.z), wo);
      value.f_cos = Color(cone.density * cone.brightness(lobe, c));
      value.pdf_solid_angle = value.pdf_reverse_solid_angle = cone.pdf_solid_angle(c);
      break;
    }
    case LobeKind::hair_reflection:
    case LobeKind::hair_transmission: {
      const HairCylinder hair(lobe);
      if ((wi.z * wo.z > 0.0f) == hair.transmits) break;
      value.f_cos = Color(hair.pdf_solid_angle(camera, light));
      value.pdf_solid_angle = hair.pdf_solid_angle(wi, wo);
      value.pdf_reverse_solid_angle = hair.pdf_solid_angle(wo, wi);
      break;
    }
    case LobeKind::ashikhmin_shirley: {
      if (wi.z <= 0.0f || wo.z <= 0.0f) break;
      const Vec3 m = normalize(wi + wo);
      const float cos_m = std::max(dot(wi, m), 1e-6f);
      const float density = phong_density(lobe, m) / cos_m;
      value.pdf_solid_angle = value.pdf_reverse_solid_angle = density;
      value.f_cos = Color(density * light.z / std::max({wi.z, wo.z, 1e-6f}));
      break;
    }
    default:
      break;
  }
  return value;
}

/// Samples wo given wi on n's side, with the density that eval_stylized tells.
inline bool sample_stylized(const Lobe& lobe, const Vec3& wi, const Vec2& u, Vec3& wo) {
  switch (lobe.kind) {
    case LobeKind::toon:
    case LobeKind::glossy_toon: {
      const ToonCone cone(lobe);
      if (!(cone.density > 0.0f)) return false;
      const float z = 1.0f - u.x * (1.0f - std::cos(cone.outer)), r = safe_sqrt(1.0f - z * z);
      const SinCos phi = sin_cos_turn(u.y);
      const Vec3 around(r * phi.cos, r * phi.sin, z);
      wo = lobe.kind == LobeKind::toon ? around : Frame::from_normal(Vec3(-wi.x, -wi.y, wi.z)).to_world(around);
      return wo.z > 0.0f;
    }
    case LobeKind::hair_reflection:
    case LobeKind::hair_transmission:
      return HairCylinder(lobe).sample(wi, u, wo) && (wo.z < 0.0f) == (lobe.kind == LobeKind::hair_transmission);
    case LobeKind::ashikhmin_shirley: {
      // Eq. 9 and 10 of the paper, the azimuth of all four quadrants at once
      const float n_x = phong_exponent(lobe.alpha_x), n_y = phong_exponent(lobe.alpha_y);
      const float turn = 2.0f * k_pi * u.x;
      const float x = std::sqrt(n_y + 1.0f) * std::cos(turn), y = std::sqrt(n_x + 1.0f) * std::sin(turn);
      const float l = std::sqrt(x * x + y * y), c = x / l, s = y / l;
      const float z = std::pow(1.0f - u.y, 1.0f / (n_x * c * c + n_y * s * s + 1.0f)), r = safe_sqrt(1.0f - z * z);
      const Vec3 m(r * c, r * s, z);
      wo = m * (2.0f * dot(wi, m)) - wi;
      return dot(wi, m) > 0.0f && wo.z > 0.0f;
    }
    default:
      return false;
  }
}

}  // namespace lambent
