// Value, densities, sampling and albedo of one lobe, for Bsdf and for tests.
//
// All in the lobe's local frame (z = n). `wi` is where the walk came from, `wo` where it goes; either may be on either
// side, so that a walk can be evaluated reversed. `camera` and `light` are the same two directions by their part in
// light transport (lobe.h).
#pragma once

#include "engine/base/frame.h"
#include "engine/sampling/warp.h"
#include "engine/shading/albedo_table.h"
#include "engine/shading/fresnel.h"
#include "engine/shading/hair_fibre.h"
#include "engine/shading/hair_microfacet.h"
#include "engine/shading/lobe.h"
#include "engine/shading/microfacet.h"
#include "engine/shading/sheen.h"
#include "engine/shading/stylized_lobes.h"
#include "engine/shading/thin_film.h"

namespace lambent {

struct LobeSample {
  Vec3 wo{0.0f};
  Color delta_f{0.0f};  ///< delta lobes: f·cos/prob given that the lobe was picked, before the adjoint's factor
  float prob = 1.0f;    ///< delta lobes: of the direction given the lobe (glass: reflection or refraction)
  float prob_reverse = 1.0f;
  float eta = 1.0f;  ///< transmitted over incident if transmitted
  bool valid = false;
  bool transmitted = false;
};

inline bool is_microfacet(LobeKind kind) { return kind >= LobeKind::reflection; }
inline bool is_delta(const Lobe& lobe) {
  return goes_straight(lobe.kind) || lobe.kind == LobeKind::subsurface ||
         (is_microfacet(lobe.kind) && lobe.alpha_x * lobe.alpha_y <= k_delta_alpha * k_delta_alpha);
}
/// LobeWidth::narrow.
inline bool is_narrow(const Lobe& lobe) {
  const float alpha2 = lobe.alpha_x * lobe.alpha_y;
  return is_microfacet(lobe.kind) && alpha2 <= k_narrow_alpha * k_narrow_alpha &&
         alpha2 > k_delta_alpha * k_delta_alpha;
}
inline bool is_diffuse(LobeKind kind) { return kind <= LobeKind::translucent; }
/// Lobes that are no diffuse ones and send light through the surface only.
inline bool transmits_alone(LobeKind kind) {
  return kind == LobeKind::refraction || kind == LobeKind::hair_transmission || kind == LobeKind::thin_transmission;
}
/// Whether a lobe transmits between two directions, `apart` by its normal. Seen from a light, one that only reflects
/// may have them so at silhouettes, where interpolated normals and the surface disagree.
inline bool goes_through(LobeKind kind, bool apart) {
  return sends_through(kind) && (apart || !(kind == LobeKind::glass || is_fibre(kind)));
}
/// The class that passes count a lobe in, for a pair of directions that it transmits or reflects. Velvet scatters as a
/// diffuse lobe does, but counts as glossy here, as in Cycles.
inline LobeClass class_of(LobeKind kind, bool apart) {
  if (kind == LobeKind::velvet) return LobeClass::glossy;
  if (is_diffuse(kind)) return LobeClass::diffuse;
  return goes_through(kind, apart) ? LobeClass::transmission : LobeClass::glossy;
}
/// Directional albedo of the qualitative Oren–Nayar model of Fujii (mimosa-pudica.net/improved-oren-nayar.html, whose G
/// is an integral in closed form) with scale and sigma as eval_lobe has them.
inline float oren_nayar_albedo(float sigma, float scale, float cosine) {
  const float c = std::clamp(cosine, 1e-4f, 1.0f), s = std::sqrt(1.0f - c * c);
  const float g = s * (std::acos(c) - 2.0f / 3.0f - s * c) + 2.0f / 3.0f * (s / c) * (1.0f - s * s * s);
  return scale * (k_pi + sigma * g);
}

/// What single scattering loses comes back by further scattering, as in OpenPBR (and Cycles since 4.3): a reciprocal
/// lobe with which a white surface returns all light.
inline Color oren_nayar_multiple(const Color& albedo, float sigma, float scale, float cos_view, float cos_light) {
  const float mean = scale * (k_pi + sigma * (2.0f * k_pi - 5.6f) / 3.0f);
  if (!(mean < 1.0f - 1e-6f)) return Color(0.0f);  // a smooth surface loses nothing
  const float lost =
      (1.0f - oren_nayar_albedo(sigma, scale, cos_view)) * (1.0f - oren_nayar_albedo(sigma, scale, cos_light));
  const Color a(std::clamp(albedo.x, 0.0f, 1.0f), std::clamp(albedo.y, 0.0f, 1.0f), std::clamp(albedo.z, 0.0f, 1.0f));
  return a * a * (k_inv_pi * lost * mean / (1.0f - mean)) / (Color(1.0f) - a * (1.0f - mean));
}

/// The model's value for two directions above the surface: the qualitative one with the full normalisation of Fujii, as
/// Cycles.
inline Color oren_nayar(const Lobe& lobe, const Vec3& a, const Vec3& b) {
  const float sigma = lobe.param;
  const float scale = 1.0f / (k_pi + (3.0f * k_pi - 4.0f) / 6.0f * sigma);
  float t = dot(a, b) - a.z * b.z;
  if (t > 0.0f) t /= std::max(a.z, b.z);
  const Color single(std::max(0.0f, scale * (1.0f + sigma * t)));
  return lobe.energy_compensation ? single + oren_nayar_multiple(lobe.f0, sigma, scale, a.z, b.z) : single;
}

inline Frame lobe_frame(const Lobe& lobe) {
  return length_squared(lobe.tangent) > 0.0f ? Frame::from_normal_and_tangent(lobe.n, lobe.tangent)
                                             : Frame::from_normal(lobe.n);
}
/// Index ratio as seen by a direction on the given side.
inline float eta_seen_from(const Lobe& lobe, float cos_side) { return cos_side >= 0.0f ? lobe.eta : 1.0f / lobe.eta; }

/// The film as it is seen from the side with that index ratio: the indices of either side are to that side's, as in
/// Cycles, which leaves the thickness as it is. So from within, colours are those of a film thinner by the index: what
/// passes is not quite the same both ways, and lobes take what the camera's side sees.
inline ThinFilm film_seen(const Lobe& lobe, float eta) {
  return {lobe.film_nm, eta == lobe.eta ? lobe.film_eta : lobe.film_eta * eta, lobe.fitted_film};
}
/// Reflectance of the lobe's dielectric under its film.
inline Color film_reflectance(const Lobe& lobe, float cos_facet, float eta) {
  return film_dielectric(std::fabs(cos_facet), eta, film_seen(lobe, eta));
}

/// Fresnel factor of reflection off a facet at `cos_facet`.
inline Color facet_reflectance(const Lobe& lobe, float cos_facet, float eta) {
  switch (lobe.fresnel) {
    case FresnelMode::none:
      return Color(1.0f);
    case FresnelMode::dielectric:
      return Color(fresnel_dielectric(cos_facet, eta));
    case FresnelMode::schlick:
      return lerp(lobe.f0, lobe.f90, fresnel_rise(cos_facet, eta));
    case FresnelMode::f82:
      return fresnel_f82(cos_facet, lobe.f0, lobe.f90);
    case FresnelMode::film_dielectric: {
      // Interference goes below what is reflected at normal incidence without it, so that f0 cannot be where the curve
      // begins, as in schlick: it scales, the less the more is reflected.
      const Color f = film_reflectance(lobe, cos_facet, eta);
      const float normal = fresnel_normal(eta);
      if (!(normal > 1e-5f && normal < 1.0f)) return f;
      Color tinted;
      for (int k = 0; k < 3; ++k)
        tinted[k] = std::min(
            f[k] * lerp(1.0f, lobe.f0[k] / normal, std::clamp((1.0f - f[k]) / (1.0f - normal), 0.0f, 1.0f)), 1.0f);
      return tinted;
    }
    case FresnelMode::film_f82:
      return film_f82(std::fabs(cos_facet), lobe.f0, lobe.f90, film_seen(lobe, eta));
    case FresnelMode::film_conductor:
      return film_conductor(std::fabs(cos_facet), lobe.f0, lobe.f90, film_seen(lobe, eta));
  }
  return Color(1.0f);
}

/// Its mean over all angles, weighted by their cosine; without the film if there is one, as Cycles.
inline Color mean_facet_reflectance(const Lobe& lobe, float eta) {
  switch (lobe.fresnel) {
    case FresnelMode::none:
      return lobe.f0;
    case FresnelMode::dielectric:
      return Color(fresnel_dielectric_mean(eta));
    case FresnelMode::film_dielectric:
    case FresnelMode::schlick: {
      const float f0 = fresnel_normal(eta);
      return lerp(lobe.f0, lobe.f90,
                  f0 < 1.0f ? std::clamp((fresnel_dielectric_mean(eta) - f0) / (1.0f - f0), 0.0f, 1.0f) : 0.0f);
    }
    case FresnelMode::film_f82:
    case FresnelMode::f82:
      return fresnel_f82_mean(lobe.f0, lobe.f90);
    case FresnelMode::film_conductor: {
      Color f0, tint;
      for (int k = 0; k < 3; ++k) fit_conductor(lobe.f0[k], lobe.f90[k], f0[k], tint[k]);
      return fresnel_f82_mean(f0, tint);
    }
  }
  return Color(1.0f);
}

/// Share of the light that leaves two sides' directions unmasked; g_a and g_b are Smith's factors of each.
inline float masking(const Lobe& lobe, float g_a, float g_b) {
  return lobe.correlated_masking ? correlated_masking(g_a, g_b) : g_a * g_b;
}

/// Factor at the macroscopic normal, and multiscatter compensation: functions of the camera's cosine alone, so the same
/// for both directions of transport.
inline Color camera_factor(const Lobe& lobe, float cos_camera) {
  Color factor(1.0f);
  if (lobe.macro_fresnel) {
    const float f = fresnel_dielectric(cos_camera, eta_seen_from(lobe, cos_camera));
    factor = Color(lobe.kind == LobeKind::refraction ? 1.0f - f : f);
  }
  if (lobe.energy_compensation) {
    const float alpha = std::sqrt(lobe.alpha_x * lobe.alpha_y), c = std::fabs(cos_camera);
    const float eta = eta_seen_from(lobe, cos_camera);
    if (lobe.kind == LobeKind::glass) {
      factor *= 1.0f / ggx_glass_albedo(c, alpha, eta, lobe.correlated_masking);
    } else if (lobe.correlated_masking) {
      factor *= ggx_compensation(c, alpha, mean_facet_reflectance(lobe, eta));
    } else {
      // Facets are met at all angles: of the rise towards grazing, the cosine-weighted mean of Schlick's is 1/21.
      const Color reflectance = lobe.fresnel == FresnelMode::none             ? lobe.f0
                                : lobe.fresnel == FresnelMode::film_conductor ? mean_facet_reflectance(lobe, eta)
                                                                              : lerp(lobe.f0, lobe.f90, 1.0f / 21.0f);
      factor *= ggx_multiscatter_factor(c, alpha, reflectance);
    }
  }
  return factor;
}

/// The principled diffuse lobe's Fresnel factor of light that enters, or leaves, at an angle (Burley 2015, eq. 3 and
/// 4).
inline float principled_factor(float cosine) { return 1.0f - 0.5f * schlick_weight(cosine); }
/// Its retro-reflection.
inline float principled_retro(const Lobe& lobe, const Vec3& wi, const Vec3& wo) {
  const float f_i = schlick_weight(wi.z), f_o = schlick_weight(wo.z);
  const float rr = lobe.param * (dot(wi, wo) + 1.0f);  // 2·roughness·cos²θ_d
  return k_inv_pi * (rr * (f_i + f_o + f_i * f_o * (rr - 1.0f)));
}

/// What glass does at one of its facets.
struct GlassFacet {
  Color reflected, transmitted;       ///< shares of the light
  float prob_reflect, prob_transmit;  ///< of the walk going either way: by the tinted Fresnel term

  GlassFacet(const Lobe& lobe, float cos_facet, float eta) {
    if (lobe.fresnel != FresnelMode::film_dielectric) {
      const float f = fresnel_dielectric(cos_facet, eta);
      reflected = lobe.f0 * f, transmitted = lobe.f90 * (1.0f - f);
    } else {
      const Color f = film_reflectance(lobe, cos_facet, eta);
      reflected = lobe.f0 * f, transmitted = lobe.f90 * (Color(1.0f) - f);
    }
    choose();
  }
  /// Of a pair of directions that refract into each other, without the cancellation that there is near the critical
  /// angle; with a film as seen from the first of them.
  GlassFacet(const Lobe& lobe, float cos_seen, float cos_other, float eta) {
    if (lobe.fresnel == FresnelMode::film_dielectric) {
      *this = GlassFacet(lobe, cos_seen, eta);
      return;
    }
    const float t = fresnel_transmitted(cos_seen, cos_other, eta);
    reflected = lobe.f0 * (1.0f - t), transmitted = lobe.f90 * t;
    choose();
  }

 private:
  void choose() {
    const float r = max_component(reflected), t = max_component(transmitted);
    const bool any = r + t > 0.0f;
    prob_reflect = any ? r / (r + t) : 1.0f;
    prob_transmit = any ? t / (r + t) : 0.0f;
  }
};

/// Share of light that the lobe sends on, seen from a direction with cosine `cos_view` to n: an estimate, exact for
/// Lambert and mirrors. Drives the choice of lobes, so both directions' densities use it.
inline Color lobe_albedo(const Lobe& lobe, float cos_view) {
  const float c = std::fabs(cos_view);
  switch (lobe.kind) {
    case LobeKind::diffuse:
    case LobeKind::oren_nayar:
    case LobeKind::principled_diffuse:
    case LobeKind::principled_exit:
    case LobeKind::subsurface:
    case LobeKind::toon:
    case LobeKind::rough_translucent:
    case LobeKind::translucent:
    case LobeKind::transparent:
    case LobeKind::portal:
    case LobeKind::glossy_toon:
    case LobeKind::hair_reflection:
    case LobeKind::hair_transmission:
    case LobeKind::ashikhmin_shirley:
    case LobeKind::thin_transmission:
      return Color(1.0f);
    case LobeKind::hair_fibre:
      return HairFibre::albedo(lobe, c);
    case LobeKind::hair_microfacets:
      return HairMicrofacets::albedo(lobe);
    case LobeKind::principled_retro:
      return Color(0.02f + 0.4f * lobe.param * schlick_weight(c));
    case LobeKind::principled_sheen:
      return Color(0.02f + 0.3f * schlick_weight(c));
    case LobeKind::velvet:
      return Color(0.1f + 0.6f * schlick_weight(c));
    case LobeKind::sheen:
      return Color(SheenFit(c, lobe.alpha_x).albedo);
    case LobeKind::reflection: {
      const Color f = facet_reflectance(lobe, c, eta_seen_from(lobe, cos_view));
      return lobe.macro_fresnel ? f * fresnel_dielectric(c, eta_seen_from(lobe, cos_view)) : f;
    }
    case LobeKind::refraction:
      return Color(lobe.macro_fresnel ? 1.0f - fresnel_dielectric(c, eta_seen_from(lobe, cos_view)) : 1.0f);
    case LobeKind::glass: {
      const GlassFacet facet(lobe, c, eta_seen_from(lobe, cos_view));
      return facet.reflected + facet.transmitted;
    }
  }
  return Color(1.0f);
}

// --- Rough reflection and refraction ---------------------------------------------------------------------------------

inline LobeValue eval_rough_reflection(const Lobe& lobe, const Vec3& wi, const Vec3& wo, bool camera_is_wi) {
  LobeValue value;
  if (wi.z * wo.z <= 0.0f) return value;
  // Below the surface (inside glass, walk reversed): mirror both directions to the upper side.
  const float side = wi.z > 0.0f ? 1.0f : -1.0f;
  const Vec3 a = wi * side, b = wo * side;
  const Vec3 m = normalize(a + b);
  const float cos_m = dot(a, m);
  if (!(m.z > 0.0f && cos_m > 0.0f)) return value;
  const Microfacets facets(lobe);
  const float d = facets.d(m);
  if (!(d > 0.0f)) return value;
  const float g_wi = facets.g1(a), g_wo = facets.g1(b);
  const float eta = eta_seen_from(lobe, wi.z);
  const float camera_cos = camera_is_wi ? a.z : b.z;

  Color reflectance;
  float prob_reflect = 1.0f;
  if (lobe.kind == LobeKind::glass) {
    const GlassFacet facet(lobe, cos_m, eta);
    reflectance = facet.reflected;
    prob_reflect = facet.prob_reflect;  // the same from both sides: a·m = b·m
  } else {
    reflectance = facet_reflectance(lobe, cos_m, eta);
  }
  value.f_cos =
      reflectance * camera_factor(lobe, camera_cos * side) * (d * masking(lobe, g_wi, g_wo) / (4.0f * camera_cos));
  if (facets.distribution == Distribution::gtr1) {
    value.pdf_solid_angle = value.pdf_reverse_solid_angle = d * m.z / (4.0f * cos_m);
  } else {
    value.pdf_solid_angle = prob_reflect * g_wi * d / (4.0f * a.z);
    value.pdf_reverse_solid_angle = prob_reflect * g_wo * d / (4.0f * b.z);
  }
  return value;
}

inline LobeValue eval_rough_refraction(const Lobe& lobe, const Vec3& wi, const Vec3& wo, bool camera_is_wi) {
  LobeValue value;
  if (wi.z * wo.z >= 0.0f) return value;
  const float eta = eta_seen_from(lobe, wi.z);
  // Walter et al. 2007, eq. 16, turned to wi's side
  Vec3 m = normalize(wi + wo * eta);
  if (m.z * wi.z < 0.0f) m = m * -1.0f;
  const float wi_m = dot(wi, m), wo_m = dot(wo, m);
  if (!(wi_m > 0.0f && wo_m < 0.0f)) return value;
  const float side = wi.z > 0.0f ? 1.0f : -1.0f;
  const Microfacets facets(lobe);
  const float d = facets.d(m * side);
  if (!(d > 0.0f)) return value;
  const float g_wi = facets.g1(wi), g_wo = facets.g1(wo);
  const float wi_density = wi_m + eta * wo_m;     // eq. 17: dω_m/dω_o = eta²|wo·m|/(wi·m + eta·wo·m)²
  const float wo_density = -(wo_m + wi_m / eta);  // seen from wo, with the index ratio inverted
  if (wi_density == 0.0f || wo_density == 0.0f) return value;
  const float jacobian_wo = eta * eta * -wo_m / sqr(wi_density);
  const float jacobian_wi = wi_m / (eta * eta) / sqr(wo_density);

  float prob_wi = 1.0f, prob_wo = 1.0f;
  Color transmitted(1.0f);
  if (lobe.kind == LobeKind::glass) {
    const GlassFacet facet(lobe, wi_m, -wo_m, eta);
    transmitted = facet.transmitted;
    prob_wi = prob_wo = facet.prob_transmit;
    if (lobe.fresnel == FresnelMode::film_dielectric) {  // Films differ by the side (film_seen)
      const GlassFacet other(lobe, -wo_m, 1.0f / eta);
      prob_wo = other.prob_transmit;
      if (!camera_is_wi) transmitted = other.transmitted;
    }
  }
  // Radiance is carried as L/n²: no division by eta² (lobe.h).
  const float camera_cos = camera_is_wi ? wi.z : wo.z;
  const float jacobian_light = camera_is_wi ? jacobian_wo : jacobian_wi;
  const float camera_m = camera_is_wi ? wi_m : -wo_m;
  value.f_cos = transmitted * camera_factor(lobe, camera_cos) *
                (d * masking(lobe, g_wi, g_wo) * camera_m * jacobian_light / std::fabs(camera_cos));
  value.pdf_solid_angle = prob_wi * g_wi * d * wi_m / std::fabs(wi.z) * jacobian_wo;
  value.pdf_reverse_solid_angle = prob_wo * g_wo * d * -wo_m / std::fabs(wo.z) * jacobian_wi;
  return value;
}

inline LobeValue eval_hair_fibre(const Lobe& lobe, const Vec3& wi, const Vec3& wo, bool camera_is_wi) {
  const HairFibre fibre(lobe);
  const HairFibre::Side from_wi = fibre.seen_from(wi), from_wo = fibre.seen_from(wo);
  LobeValue value;
  value.f_cos = camera_is_wi ? fibre.value(from_wi, wo) : fibre.value(from_wo, wi);
  value.pdf_solid_angle = fibre.pdf_solid_angle(from_wi, wo, camera_is_wi);
  value.pdf_reverse_solid_angle = fibre.pdf_solid_angle(from_wo, wi, !camera_is_wi);
  return value;
}

inline LobeValue eval_hair_microfacets(const Lobe& lobe, const Vec3& wi, const Vec3& wo, bool camera_is_wi) {
  const HairMicrofacets hair(lobe);
  LobeValue value;
  value.f_cos = camera_is_wi ? hair.value(wi, wo) : hair.value(wo, wi);
  value.pdf_solid_angle = hair.pdf_solid_angle(wi, wo);
  value.pdf_reverse_solid_angle = hair.pdf_solid_angle(wo, wi);
  return value;
}

// --- All kinds -----------------------------------------------------------------------------------------------------

/// f_cos and densities of a lobe that is not delta. Zero where the lobe does not connect the two directions.
inline LobeValue eval_lobe(const Lobe& lobe, const Vec3& wi, const Vec3& wo, bool camera_is_wi) {
  LobeValue value;
  const Vec3& camera = camera_is_wi ? wi : wo;
  const Vec3& light = camera_is_wi ? wo : wi;
  if (is_microfacet(lobe.kind)) {
    if (lobe.kind == LobeKind::reflection) {
      if (wi.z <= 0.0f) return value;
      return eval_rough_reflection(lobe, wi, wo, camera_is_wi);
    }
    if (lobe.kind == LobeKind::thin_transmission)
      return eval_rough_reflection(lobe, wi, {wo.x, wo.y, -wo.z}, camera_is_wi);
    if (lobe.kind == LobeKind::glass && wi.z * wo.z > 0.0f) return eval_rough_reflection(lobe, wi, wo, camera_is_wi);
    return eval_rough_refraction(lobe, wi, wo, camera_is_wi);
  }
  if (is_stylized(lobe.kind)) return eval_stylized(lobe, wi, wo, camera_is_wi);
  if (lobe.kind == LobeKind::hair_fibre) return eval_hair_fibre(lobe, wi, wo, camera_is_wi);
  if (lobe.kind == LobeKind::hair_microfacets) return eval_hair_microfacets(lobe, wi, wo, camera_is_wi);
  if (lobe.kind == LobeKind::translucent) {
    if (wi.z * wo.z >= 0.0f) return value;
    value.f_cos = Color(std::fabs(light.z) * k_inv_pi);
    value.pdf_solid_angle = std::fabs(wo.z) * k_inv_pi;
    value.pdf_reverse_solid_angle = std::fabs(wi.z) * k_inv_pi;
    return value;
  }
  if (lobe.kind == LobeKind::rough_translucent) {
    if (wi.z * wo.z >= 0.0f) return value;
    const float side = wi.z > 0.0f ? 1.0f : -1.0f;
    const Vec3 a{wi.x, wi.y, wi.z * side}, b{wo.x, wo.y, -wo.z * side};
    value.pdf_solid_angle = b.z * k_inv_pi;
    value.pdf_reverse_solid_angle = a.z * k_inv_pi;
    value.f_cos = oren_nayar(lobe, a, b) * std::fabs(light.z);
    return value;
  }
  if (wi.z <= 0.0f || wo.z <= 0.0f) return value;
  value.pdf_solid_angle = wo.z * k_inv_pi;
  value.pdf_reverse_solid_angle = wi.z * k_inv_pi;
  float f = 0.0f;
  switch (lobe.kind) {
    case LobeKind::diffuse:
      f = k_inv_pi;
      break;
    case LobeKind::oren_nayar:
      value.f_cos = oren_nayar(lobe, wi, wo) * light.z;
      return value;
    case LobeKind::principled_diffuse: {
      // Burley 2015, eq. 3 and 4: Lambert with entry and exit Fresnel, plus the retro-reflective lobe
      f = k_inv_pi * principled_factor(wi.z) * principled_factor(wo.z) + principled_retro(lobe, wi, wo);
      break;
    }
    case LobeKind::principled_retro:
      f = principled_retro(lobe, wi, wo);
      break;
    case LobeKind::principled_exit:
      f = k_inv_pi * principled_factor(light.z);
      break;
    case LobeKind::principled_sheen: {
      const float cos_d = std::sqrt(std::max(0.0f, 0.5f * (1.0f + dot(wi, wo))));
      f = schlick_weight(cos_d);  // no 1/π: as Cycles
      break;
    }
    case LobeKind::velvet: {
      value.pdf_solid_angle = value.pdf_reverse_solid_angle = 0.5f * k_inv_pi;
      const Vec3 h = normalize(wi + wo);
      const float cos_h = h.z, cos_d = dot(wi, h);
      if (!(cos_h < 1.0f - 1e-5f && cos_d > 1e-5f)) break;
      const float sin2 = 1.0f - cos_h * cos_h;
      const float inv_sigma2 = 1.0f / sqr(std::max(lobe.param, 0.01f));
      const float d = std::exp(-cos_h * cos_h / sin2 * inv_sigma2) * inv_sigma2 * k_inv_pi / sqr(sin2);
      const float ratio = 2.0f * std::max(cos_h / cos_d, 1e-5f);
      const float g = std::min(1.0f, ratio * std::min(wi.z, wo.z));
      f = 0.25f * d * g / (wi.z * wo.z);
      break;
    }
    case LobeKind::sheen: {
      // A function of the light's direction around the camera's: walks from lights sample it evenly.
      const SheenFit fit(camera.z, lobe.alpha_x);
      const float density = fit.density(camera, light);
      value.pdf_solid_angle = camera_is_wi ? density : 0.5f * k_inv_pi;
      value.pdf_reverse_solid_angle = camera_is_wi ? 0.5f * k_inv_pi : density;
      value.f_cos = Color(fit.albedo * density);
      return value;
    }
    default:
      break;
  }
  value.f_cos = Color(f * light.z);
  return value;
}

/// Probability of going back through smooth glass that a walk passes with `prob_transmit`, leaving at that cosine.
inline float prob_transmit_reversed(const Lobe& lobe, float prob_transmit, float cos_wo) {
  if (lobe.fresnel != FresnelMode::film_dielectric) return prob_transmit;
  return GlassFacet(lobe, std::fabs(cos_wo), 1.0f / lobe.eta).prob_transmit;
}

/// f·cos of a delta lobe (not transparent) for cosines of the pair that it connects, wi's above 0; without the lobe's
/// weight, and not divided by any probability.
inline Color delta_value(const Lobe& lobe, float cos_wi, float cos_wo, bool camera_is_wi) {
  const bool reflects = cos_wo > 0.0f;
  Color value = camera_factor(lobe, camera_is_wi ? cos_wi : cos_wo);
  if (lobe.kind == LobeKind::glass) {
    const GlassFacet facet = reflects || camera_is_wi ? GlassFacet(lobe, cos_wi, lobe.eta)
                                                      : GlassFacet(lobe, std::fabs(cos_wo), 1.0f / lobe.eta);
    value *= reflects ? facet.reflected : facet.transmitted;
  } else if (reflects) {
    value *= facet_reflectance(lobe, cos_wi, lobe.eta);
  }
  // With the camera at wo the delta is in wi: dω_wi/dω_wo turns it into one in wo (lobe.h; Veach 1997, ch. 5.2)
  if (!reflects && !camera_is_wi) value *= std::fabs(cos_wi / cos_wo) / sqr(lobe.eta);
  return value;
}

/// Samples wo given wi on n's side (wi.z > 0). @param u_choice in [0, 1): glass's choice.
inline LobeSample sample_lobe(const Lobe& lobe, const Vec3& wi, float u_choice, const Vec2& u, bool camera_is_wi) {
  LobeSample sample;
  if (lobe.kind == LobeKind::transparent) {
    sample.wo = wi * -1.0f;
    sample.delta_f = Color(1.0f);
    sample.valid = sample.transmitted = true;
    return sample;
  }
  if (wi.z <= 0.0f && lobe.kind != LobeKind::diffuse) return sample;
  if (is_stylized(lobe.kind)) {
    sample.valid = sample_stylized(lobe, wi, u, sample.wo);
    sample.transmitted = lobe.kind == LobeKind::hair_transmission;
    return sample;
  }
  switch (lobe.kind) {
    case LobeKind::hair_fibre: {
      const HairFibre fibre(lobe);
      sample.wo = fibre.sample(fibre.seen_from(wi), u_choice, u, camera_is_wi);
      sample.transmitted = sample.wo.z < 0.0f;
      break;
    }
    case LobeKind::hair_microfacets:
      sample.wo = HairMicrofacets(lobe).sample(wi, u_choice, u);
      sample.transmitted = sample.wo.z < 0.0f;
      break;
    case LobeKind::diffuse:
    case LobeKind::oren_nayar:
    case LobeKind::principled_diffuse:
    case LobeKind::principled_retro:
    case LobeKind::principled_exit:
    case LobeKind::principled_sheen:
      sample.wo = sample_cosine_hemisphere(u);
      break;
    case LobeKind::rough_translucent:
    case LobeKind::translucent:
      sample.wo = sample_cosine_hemisphere(u);
      sample.wo.z = -sample.wo.z;
      sample.transmitted = true;
      break;
    case LobeKind::velvet:
      sample.wo = sample_uniform_hemisphere(u);
      break;
    case LobeKind::sheen:
      sample.wo = camera_is_wi ? SheenFit(wi.z, lobe.alpha_x).sample(wi, u) : sample_uniform_hemisphere(u);
      break;
    default: {
      const bool delta = is_delta(lobe);
      const Vec3 m = delta ? Vec3(0, 0, 1) : Microfacets(lobe).sample_normal(wi, u);
      const float cos_m = dot(wi, m);
      if (!(cos_m > 0.0f)) return sample;
      bool reflects = lobe.kind == LobeKind::reflection || lobe.kind == LobeKind::thin_transmission;
      if (lobe.kind == LobeKind::glass) {
        const GlassFacet facet(lobe, cos_m, lobe.eta);
        sample.prob = facet.prob_reflect;
        reflects = u_choice < sample.prob;
        if (!reflects) sample.prob = facet.prob_transmit;
        sample.prob_reverse = sample.prob;
      }
      if (reflects) {
        sample.wo = m * (2.0f * cos_m) - wi;
        if (sample.wo.z <= 0.0f) return sample;
        if (lobe.kind == LobeKind::thin_transmission) {
          sample.wo.z = -sample.wo.z;
          sample.transmitted = true;
        }
      } else {
        if (!refract(wi, m, lobe.eta, sample.wo) || sample.wo.z >= 0.0f) return sample;
        sample.transmitted = true;
        sample.eta = lobe.eta;
        if (delta && lobe.kind == LobeKind::glass)
          sample.prob_reverse = prob_transmit_reversed(lobe, sample.prob, sample.wo.z);
      }
      if (delta) sample.delta_f = delta_value(lobe, wi.z, sample.wo.z, camera_is_wi) * (1.0f / sample.prob);
    }
  }
  sample.valid = true;
  return sample;
}

}  // namespace lambent
