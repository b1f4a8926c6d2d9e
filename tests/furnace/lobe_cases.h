// The lobes that the tests of this folder go through, and surfaces that carry them.
#pragma once

#include <string>
#include <vector>

#include "engine/sampling/sampler.h"
#include "engine/shading/bsdf_set.h"

namespace lambent {

struct LobeCase {
  std::string name;
  Lobe lobe;
  bool reciprocal = true;  ///< f(a, b) = f(b, a), for reflection
  bool transmits = false;
};

inline Lobe make_lobe(LobeKind kind, float alpha_x = 1.0f, float alpha_y = 1.0f,
                      Distribution distribution = Distribution::ggx) {
  Lobe lobe;
  lobe.kind = kind;
  lobe.alpha_x = alpha_x;
  lobe.alpha_y = alpha_y;
  lobe.distribution = distribution;
  if (alpha_x != alpha_y) lobe.tangent = {1, 0, 0};
  return lobe;
}

/// Lobes with a density, at the given roughness alpha where they have one.
inline std::vector<LobeCase> lobe_cases(float alpha) {
  std::vector<LobeCase> cases;
  const auto add = [&](const std::string& name, const Lobe& lobe, bool reciprocal = true, bool transmits = false) {
    cases.push_back({name + " alpha " + std::to_string(alpha), lobe, reciprocal, transmits});
  };
  add("diffuse", make_lobe(LobeKind::diffuse));
  for (const auto& [name, kind] : {std::pair{"oren_nayar", LobeKind::oren_nayar},
                                   {"principled_diffuse", LobeKind::principled_diffuse},
                                   {"principled_sheen", LobeKind::principled_sheen},
                                   {"velvet", LobeKind::velvet}}) {
    Lobe lobe = make_lobe(kind);
    lobe.param = std::sqrt(alpha);
    add(name, lobe);
  }
  add("sheen", make_lobe(LobeKind::sheen, alpha, alpha), false);
  for (const auto& [name, kind] : {std::pair{"toon", LobeKind::toon}, {"glossy_toon", LobeKind::glossy_toon}}) {
    Lobe lobe = make_lobe(kind, alpha, alpha);
    lobe.param = std::sqrt(alpha);
    add(name, lobe, false);
  }
  add("ashikhmin_shirley", make_lobe(LobeKind::ashikhmin_shirley, alpha, alpha));
  add("ashikhmin_shirley anisotropic", make_lobe(LobeKind::ashikhmin_shirley, alpha, 0.4f * alpha));
  for (const auto& [name, kind] :
       {std::pair{"hair_reflection", LobeKind::hair_reflection}, {"hair_transmission", LobeKind::hair_transmission}}) {
    Lobe lobe = make_lobe(kind, alpha, std::sqrt(alpha));
    lobe.tangent = {1, 0, 0};
    lobe.param = 0.1f;
    add(name, lobe, false, kind == LobeKind::hair_transmission);
  }
  for (const float absorption : {0.0f, 0.3f}) {
    Lobe lobe = make_lobe(LobeKind::hair_fibre, std::sqrt(alpha), alpha);
    lobe.tangent = {1, 0, 0};
    lobe.param = 0.05f;
    lobe.f0 = Color(absorption, 2.0f * absorption, 4.0f * absorption);
    lobe.f90 = Color(0.6f, 1.55f, 0.0f);
    add("hair_fibre absorbing " + std::to_string(absorption), lobe, false, true);
  }
  add("translucent", make_lobe(LobeKind::translucent), true, true);
  for (const auto& [name, distribution] :
       {std::pair{"ggx", Distribution::ggx}, {"beckmann", Distribution::beckmann}, {"gtr1", Distribution::gtr1}})
    add(std::string(name) + " reflection", make_lobe(LobeKind::reflection, alpha, alpha, distribution));
  for (const auto& [name, distribution] : {std::pair{"ggx", Distribution::ggx}, {"beckmann", Distribution::beckmann}}) {
    add(std::string(name) + " anisotropic", make_lobe(LobeKind::reflection, alpha, 0.4f * alpha, distribution));
    Lobe correlated = make_lobe(LobeKind::reflection, alpha, 0.4f * alpha, distribution);
    correlated.correlated_masking = true;
    add(std::string(name) + " anisotropic, correlated", correlated);
    for (const LobeKind kind : {LobeKind::refraction, LobeKind::glass}) {
      correlated = make_lobe(kind, alpha, alpha, distribution);
      correlated.eta = 1.45f;
      correlated.correlated_masking = true;
      add(std::string(name) + (kind == LobeKind::glass ? " glass" : " refraction") + " eta 1.45, correlated",
          correlated, false, true);
    }
    for (const float eta : {1.45f, 1.0f / 1.45f, 1.05f}) {
      const std::string suffix = " eta " + std::to_string(eta);
      Lobe refraction = make_lobe(LobeKind::refraction, alpha, alpha, distribution);
      refraction.eta = eta;
      add(std::string(name) + " refraction" + suffix, refraction, false, true);
      refraction.macro_fresnel = true;
      add(std::string(name) + " refraction, macro Fresnel" + suffix, refraction, false, true);
      Lobe glass = make_lobe(LobeKind::glass, alpha, alpha, distribution);
      glass.eta = eta;
      glass.f90 = Color(0.9f, 0.5f, 0.2f);
      add(std::string(name) + " glass" + suffix, glass, true, true);
    }
  }
  Lobe macro = make_lobe(LobeKind::reflection, alpha, alpha);
  macro.eta = 1.45f;
  macro.macro_fresnel = true;
  add("ggx reflection, macro Fresnel", macro, false);
  Lobe schlick = make_lobe(LobeKind::reflection, alpha, alpha);
  schlick.fresnel = FresnelMode::schlick;
  schlick.eta = 1.5f;
  schlick.f0 = Color(0.04f);
  add("ggx reflection, schlick", schlick);
  Lobe metal = make_lobe(LobeKind::reflection, alpha, alpha);
  metal.fresnel = FresnelMode::f82;
  metal.f0 = Color(0.9f, 0.7f, 0.3f);
  metal.f90 = Color(0.95f, 0.8f, 0.6f);
  add("ggx reflection, f82", metal);
  Lobe film = schlick;
  film.fresnel = FresnelMode::film_dielectric;
  film.film_nm = 400.0f;
  film.film_eta = 1.33f;
  add("ggx reflection, film", film);
  film = metal;
  film.fresnel = FresnelMode::film_f82;
  film.film_nm = 250.0f;
  film.film_eta = 1.8f;
  add("ggx reflection, film over f82", film);
  film.fresnel = FresnelMode::film_conductor;
  film.f0 = Color(0.2f, 0.9f, 1.3f);
  film.f90 = Color(3.9f, 2.4f, 2.2f);
  add("ggx reflection, film over conductor", film);
  for (const auto& [nm, film_eta, eta] :
       {std::tuple{400.0f, 1.33f, 1.5f}, {300.0f, 1.7f, 1.0f / 1.45f}, {0.5f, 2.0f, 1.45f}}) {
    film = make_lobe(LobeKind::glass, alpha, alpha);
    film.fresnel = FresnelMode::film_dielectric;
    film.film_nm = nm;
    film.film_eta = film_eta;
    film.eta = eta;
    film.f90 = Color(0.9f, 0.5f, 0.2f);
    add("ggx glass, film of " + std::to_string(nm) + " nm", film, true, true);
  }
  add("thin_transmission", make_lobe(LobeKind::thin_transmission, alpha, alpha), true, true);
  Lobe rough_translucent = make_lobe(LobeKind::rough_translucent);
  rough_translucent.param = std::sqrt(alpha);
  rough_translucent.energy_compensation = true;
  add("rough_translucent", rough_translucent, true, true);
  Lobe compensated = make_lobe(LobeKind::reflection, alpha, alpha);
  compensated.energy_compensation = true;
  add("ggx reflection, multiscatter", compensated, false);
  Lobe whole_diffuse = make_lobe(LobeKind::oren_nayar);
  whole_diffuse.param = std::sqrt(alpha);
  whole_diffuse.energy_compensation = true;
  add("oren_nayar compensated", whole_diffuse);
  return cases;
}

/// Point on the plane z = 0 with normal +z (or -z, on the side of wi).
inline ShadingPoint plane_point(const Vec3& wi) {
  ShadingPoint point;
  point.wi_world = wi;
  point.ng_world = point.ns_world = {0, 0, wi.z < 0.0f ? -1.0f : 1.0f};
  point.backfacing = wi.z < 0.0f;
  return point;
}

/// The lobes as they are seen from wi's side of the plane: normals face wi, indices of refraction are turned round.
inline Bsdf plane_bsdf(const std::vector<Lobe>& lobes, const Vec3& wi) {
  Bsdf bsdf;
  bsdf.begin(plane_point(wi));
  for (Lobe lobe : lobes) {
    if (wi.z < 0.0f) {
      lobe.n = lobe.n * -1.0f;
      lobe.eta = 1.0f / lobe.eta;
      lobe.film_eta *= lobe.eta;
    }
    bsdf.add(lobe);
  }
  return bsdf;
}

inline Vec3 direction(float theta_rad, float phi_rad) {
  return {std::sin(theta_rad) * std::cos(phi_rad), std::sin(theta_rad) * std::sin(phi_rad), std::cos(theta_rad)};
}

inline Vec3 uniform_direction(const Vec2& u) {
  const float z = 1.0f - 2.0f * u.x, r = safe_sqrt(1.0f - z * z);
  return {r * std::cos(2.0f * k_pi * u.y), r * std::sin(2.0f * k_pi * u.y), z};
}

}  // namespace lambent
