// Facts of both generations follow Cycles: 3.4 for the simple nodes and generation 1, 5.1 for generation 2.
#include "engine/shading/closures.h"

#include "engine/shading/albedo_table.h"
#include "engine/shading/bsdf_set.h"
#include "engine/shading/fresnel.h"
#include "engine/shading/lobe_functions.h"
#include "engine/shading/sheen.h"
#include "engine/shading/subsurface.h"
#include "engine/shading/thin_film.h"

namespace lambent {
namespace {

constexpr float k_cutoff = 1e-5f;

float clamp01(float x) { return std::clamp(x, 0.0f, 1.0f); }
Color clamp_color(const Color& c, float high) {
  return Color(std::clamp(c.x, 0.0f, high), std::clamp(c.y, 0.0f, high), std::clamp(c.z, 0.0f, high));
}
Color sqrt_color(const Color& c) { return Color(safe_sqrt(c.x), safe_sqrt(c.y), safe_sqrt(c.z)); }

void set_gloss(Lobe& lobe, GlossModel model, float alpha) {
  if (model == GlossModel::ashikhmin_shirley) {
    // Narrower than this it is a mirror.
    if (alpha > 1e-3f)
      lobe.kind = LobeKind::ashikhmin_shirley;
    else
      model = GlossModel::sharp;
  }
  lobe.alpha_x = lobe.alpha_y = model == GlossModel::sharp ? 0.0f : clamp01(alpha);
  lobe.distribution = model == GlossModel::beckmann ? Distribution::beckmann : Distribution::ggx;
  lobe.energy_compensation = model == GlossModel::multiscatter_ggx;
}

// @param compensated Cycles from 4.3 on  @param through the surface instead of off it
void add_rough_diffuse(LobeTemplates& templates, const Color& weight, const Color& albedo, float roughness,
                       bool compensated, bool through = false) {
  if (roughness < (compensated ? k_cutoff : 1e-30f)) {
    templates.add(through ? LobeKind::translucent : LobeKind::diffuse, weight);
    return;
  }
  Lobe& lobe = templates.add(through ? LobeKind::rough_translucent : LobeKind::oren_nayar, weight);
  lobe.param = clamp01(roughness);
  lobe.energy_compensation = compensated;
  if (compensated) lobe.f0 = clamp_color(albedo, 1.0f);
}

// Glossy's anisotropy in (−1, 1).
void set_anisotropy(LobeTemplates& templates, float anisotropy, float rotation) {
  const float a = std::clamp(anisotropy, -0.99f, 0.99f);
  if (a == 0.0f) return;
  LobeTemplates::Entry& entry = templates.last();
  const float alpha = entry.lobe.alpha_x;
  entry.lobe.alpha_x = clamp01(a < 0.0f ? alpha / (1.0f + a) : alpha * (1.0f - a));
  entry.lobe.alpha_y = clamp01(a < 0.0f ? alpha * (1.0f + a) : alpha / (1.0f - a));
  entry.anisotropic = true;
  entry.rotation = rotation;
}
// Principled's anisotropy in [0, 1] (Burley 2012).
void set_aspect(LobeTemplates& templates, float anisotropic, float rotation) {
  if (!(anisotropic > 0.0f)) return;
  LobeTemplates::Entry& entry = templates.last();
  const float aspect = safe_sqrt(1.0f - std::min(anisotropic, 1.0f) * 0.9f);
  entry.lobe.alpha_x = clamp01(entry.lobe.alpha_x / aspect);
  entry.lobe.alpha_y = clamp01(entry.lobe.alpha_y * aspect);
  entry.anisotropic = true;
  entry.rotation = rotation;
}

// Hue and saturation of the base colour, for tints; `luminance` weighs the channels.
Color tint_of(const Color& base, float luminance) { return luminance > 0.0f ? base * (1.0f / luminance) : Color(1.0f); }

// Gives a lobe a thin film; nothing if it is too thin to be one. @param eta of the film, from the lobe's side
void set_film(Lobe& lobe, FresnelMode mode, float thickness_nm, float eta) {
  if (!(thickness_nm > k_least_film_thickness_nm)) return;
  lobe.fresnel = mode;
  lobe.film_nm = thickness_nm;
  lobe.film_eta = eta;
}

float seen_eta(float ior, bool backfacing) {
  const float eta = std::max(ior, 1e-5f);
  return backfacing ? 1.0f / eta : eta;
}

struct SubsurfaceInput {
  Color radius_m;
  float anisotropy, ior, roughness;
  SubsurfaceRules rules;
};

// A subsurface lobe of that colour, and a diffuse one in the channels whose radius is nothing.
void add_subsurface(const Color& color, float weight, const SubsurfaceInput& input, LobeTemplates& templates) {
  Color inside = color * weight, outside(0.0f);
  for (int k = 0; k < 3; ++k)
    if (!(input.radius_m[k] >= k_least_subsurface_radius_m)) std::swap(inside[k], outside[k]);
  if (!is_black(outside)) templates.add(LobeKind::diffuse, outside);
  if (is_black(inside)) return;
  const SubsurfaceMethod method = input.rules.method;
  Lobe& lobe = templates.add(LobeKind::subsurface, inside);
  lobe.f0 = clamp_color(color, 1.0f);
  lobe.f90 = subsurface_mean_free_path(method, input.radius_m, lobe.f0, input.ior);
  lobe.param = std::clamp(input.anisotropy, -0.99f, method == SubsurfaceMethod::van_de_hulst ? 0.99f : 0.9f);
  lobe.eta = std::clamp(input.ior, 1.01f, 3.8f);
  lobe.alpha_x = lobe.alpha_y = method == SubsurfaceMethod::skin ? 1.0f : sqr(clamp01(input.roughness));
  lobe.subsurface = method;
  lobe.diffuse_after_diffuse = input.rules.diffuse_after_diffuse;
}

void make_principled_1(const Principled1& p, GlossModel model, bool backfacing, LobeTemplates& templates) {
  const float metallic = clamp01(p.metallic), transmission = clamp01(p.transmission);
  const float diffuse_weight = (1.0f - metallic) * (1.0f - transmission);
  const float glass_weight = transmission * (1.0f - metallic);
  const float specular_weight = 1.0f - glass_weight;
  const bool multiscatter = model == GlossModel::multiscatter_ggx;

  if (diffuse_weight > k_cutoff) {
    if (p.subsurface > k_cutoff) {
      const Color color = lerp(p.base, p.subsurface_color, p.subsurface);
      const int before = templates.count;
      add_subsurface(color, diffuse_weight,
                     {p.subsurface_radius * p.subsurface, p.subsurface_anisotropy, p.subsurface_ior, 1.0f,
                      SubsurfaceRules::unpack(p.subsurface_rules)},
                     templates);
      for (int i = before; i < templates.count; ++i) {
        Lobe& lobe = templates.entries[i].lobe;
        lobe.macro_fresnel = lobe.kind == LobeKind::subsurface;
        if (lobe.kind == LobeKind::diffuse) lobe.kind = LobeKind::principled_diffuse, lobe.param = p.roughness;
      }
      if (templates.last().lobe.kind == LobeKind::subsurface) {
        const Color inside = templates.last().lobe.weight;
        templates.add(LobeKind::principled_retro, inside).param = p.roughness;
      }
    } else {
      templates.add(LobeKind::principled_diffuse, p.base * diffuse_weight).param = p.roughness;
    }
    if (p.sheen > k_cutoff) {
      const Color tint = lerp(Color(1.0f), tint_of(p.base, luminance(p.base)), p.sheen_tint);
      templates.add(LobeKind::principled_sheen, tint * (p.sheen * diffuse_weight));
    }
  }
  if (specular_weight > k_cutoff && (p.specular > k_cutoff || metallic > k_cutoff)) {
    Lobe& lobe = templates.add(LobeKind::reflection, Color(specular_weight));
    const float gray = 0.3f * p.base.x + 0.6f * p.base.y + 0.1f * p.base.z;
    const Color tint = lerp(Color(1.0f), tint_of(p.base, gray), p.specular_tint);
    lobe.eta = 2.0f / std::max(1.0f - safe_sqrt(0.08f * p.specular), 1e-4f) - 1.0f;
    lobe.f0 = clamp_color(tint * (0.08f * p.specular * (1.0f - metallic)) + p.base * metallic, 1.0f);
    lobe.fresnel = FresnelMode::schlick;
    set_gloss(lobe, multiscatter && p.roughness > 0.075f ? model : GlossModel::ggx, sqr(p.roughness));
    set_aspect(templates, p.anisotropic, p.rotation);
  }
  if (glass_weight > k_cutoff) {
    const Color tint = lerp(Color(1.0f), p.base, p.specular_tint);
    const float eta = seen_eta(p.ior, backfacing);
    if (!multiscatter || p.roughness <= 0.05f) {
      Lobe& reflection = templates.add(LobeKind::reflection, Color(glass_weight));
      reflection.eta = eta;
      reflection.macro_fresnel = true;
      if (p.specular_tint != 0.0f) {
        reflection.fresnel = FresnelMode::schlick;
        reflection.f0 = clamp_color(tint, 1.0f);
      }
      set_gloss(reflection, GlossModel::ggx, sqr(p.roughness));
      Lobe& refraction = templates.add(LobeKind::refraction, p.base * glass_weight);
      refraction.eta = eta;
      refraction.macro_fresnel = true;
      const float roughness =
          multiscatter ? p.roughness : 1.0f - (1.0f - p.roughness) * (1.0f - p.transmission_roughness);
      set_gloss(refraction, GlossModel::ggx, sqr(roughness));
    } else {
      Lobe& lobe = templates.add(LobeKind::glass, Color(glass_weight));
      lobe.eta = eta;
      lobe.f0 = clamp_color(tint, 1.0f);
      lobe.f90 = clamp_color(p.base, 1.0f);
      set_gloss(lobe, model, sqr(p.roughness));
    }
  }
  if (p.clearcoat > k_cutoff) {
    Lobe& lobe = templates.add(LobeKind::reflection, Color(0.25f * p.clearcoat));
    lobe.distribution = Distribution::gtr1;
    lobe.alpha_x = lobe.alpha_y = clamp01(sqr(p.clearcoat_roughness));
    lobe.eta = 1.5f;
    lobe.f0 = Color(0.04f);
    lobe.fresnel = FresnelMode::schlick;
    templates.last().coat = true;
  }
}

// What a rough dielectric layer reflects, were nothing lost between its facets.
Color layer_albedo(const Color& f0, float eta, float cos_view, float roughness) {
  return clamp_color(lerp(f0, Color(1.0f), ggx_fresnel_rise(cos_view, sqr(roughness), eta)), 1.0f);
}
Color layered(const Color& weight, const Color& albedo) { return weight * (1.0f - clamp01(max_component(albedo))); }

// Of light that refracts into a pane and out of it again, blurred by both sides (Kulla & Conty 2017).
float pane_alpha(float alpha, float eta) {
  return clamp01(alpha * safe_sqrt(3.4f * (eta - 1.0f) * sqr(eta - 0.5f) / (eta * eta * eta)));
}

// A pane with parallel sides too near to each other to tell where light leaves (OpenPBR's thin-walled glass): what is
// reflected to and fro inside is summed for the view, and given to one lobe on either side.
void add_pane(const Principled2& p, const Color& weight, float ior, float cos_view, LobeTemplates& templates) {
  Lobe outer;
  outer.kind = LobeKind::reflection;
  outer.eta = ior;
  outer.fresnel = FresnelMode::schlick;
  const Color tint = clamp_color(p.specular_tint, 1e30f);
  outer.f0 = clamp_color(tint * fresnel_normal(ior), 1e30f);
  set_film(outer, FresnelMode::film_dielectric, p.film_nm, p.film_ior);
  outer = Bsdf::sanitized(outer);
  const float cosine = std::clamp(cos_view, 0.0f, 1.0f);
  const float cos2_inside = 1.0f - (1.0f - sqr(cosine)) / sqr(ior);
  const Color r1 = facet_reflectance(outer, cosine, ior);
  Color reflected = r1, transmitted(0.0f);
  if (cos2_inside > 0.0f) {
    const float inside = std::sqrt(cos2_inside);
    Color r2 = r1;
    if (outer.fresnel == FresnelMode::film_dielectric) {
      Lobe inner = outer;
      inner.eta = 1.0f / ior;
      inner.film_eta = outer.film_eta / ior;
      r2 = facet_reflectance(inner, inside, inner.eta);
    }
    // Beer's law along the way through, which base is for at normal incidence
    const Color base = clamp_color(p.base, 1.0f);
    for (int k = 0; k < 3; ++k) {
      const float passed = std::pow(base[k], 1.0f / inside), again = r2[k] * passed;
      const float rest = 1.0f - sqr(again);
      if (!(rest > 0.0f)) continue;
      transmitted[k] = passed * (1.0f - r1[k]) * (1.0f - r2[k]) / rest;
      reflected[k] += transmitted[k] * again;
    }
  }
  const float alpha = sqr(clamp01(p.roughness));
  Lobe& mirror = templates.add(LobeKind::reflection, weight * reflected);
  mirror.f0 = clamp_color(tint, 1.0f);
  set_gloss(mirror, GlossModel::multiscatter_ggx, alpha);
  Lobe& pane = templates.add(LobeKind::thin_transmission, weight * transmitted);
  set_gloss(pane, GlossModel::multiscatter_ggx, pane_alpha(alpha, ior));
}

void make_principled_2(const Principled2& p, GlossModel model, bool backfacing, float cos_view,
                       LobeTemplates& templates) {
  const Color base = clamp_color(p.base, 1.0f);
  const float roughness = clamp01(p.roughness), metallic = clamp01(p.metallic), transmission = clamp01(p.transmission);
  const float ior = std::max(p.ior, 1e-5f), film_ior = std::max(p.film_ior, 1e-5f);
  const bool thin_wall = p.thin_wall != 0.0f;
  Color weight(1.0f);

  if (p.sheen > k_cutoff) {
    const Color tint = clamp_color(p.sheen_tint, 1e30f) * p.sheen;
    templates.add(LobeKind::sheen, tint).alpha_x = clamp01(p.sheen_roughness);
    weight = layered(weight, clamp_color(tint * SheenFit(cos_view, p.sheen_roughness).albedo, 1.0f));
  }
  if (p.coat > k_cutoff) {
    Lobe& lobe = templates.add(LobeKind::reflection, weight * p.coat);
    lobe.eta = std::max(p.coat_ior, 1.0f);
    lobe.fresnel = FresnelMode::dielectric;
    set_gloss(lobe, GlossModel::ggx, sqr(clamp01(p.coat_roughness)));
    templates.last().coat = true;
    const Color albedo = layer_albedo(Color(fresnel_normal(lobe.eta)), lobe.eta, cos_view, clamp01(p.coat_roughness));
    weight = layered(weight, albedo * clamp01(p.coat));
    // Beer's law along the path refracted into the coat, normalised to normal incidence
    const float depth = 1.0f / safe_sqrt(1.0f - (1.0f - sqr(cos_view)) / sqr(lobe.eta) + 1e-6f);
    const Color tint = clamp_color(p.coat_tint, 1e30f);
    weight *= lerp(Color(1.0f), Color(std::pow(tint.x, depth), std::pow(tint.y, depth), std::pow(tint.z, depth)),
                   clamp01(p.coat));
  }
  templates.emission = p.emission * weight;
  if (metallic > k_cutoff) {
    Lobe& lobe = templates.add(LobeKind::reflection, weight * metallic);
    lobe.fresnel = FresnelMode::f82;
    lobe.f0 = base;
    lobe.f90 = clamp_color(p.specular_tint, 1.0f);
    set_film(lobe, FresnelMode::film_f82, p.film_nm, film_ior);
    set_gloss(lobe, model, sqr(roughness));
    set_aspect(templates, p.anisotropic, p.rotation);
    weight *= 1.0f - metallic;
  }
  if (transmission > k_cutoff) {
    if (thin_wall) {
      add_pane(p, weight * transmission, ior, cos_view, templates);
    } else {
      Lobe& lobe = templates.add(LobeKind::glass, weight * transmission);
      lobe.eta = seen_eta(ior, backfacing);
      lobe.f0 = clamp_color(p.specular_tint, 1.0f);
      lobe.f90 = sqrt_color(base);
      set_film(lobe, FresnelMode::film_dielectric, p.film_nm, backfacing ? film_ior / ior : film_ior);
      set_gloss(lobe, model, sqr(roughness));
    }
    weight *= 1.0f - transmission;
  }
  float f0 = fresnel_normal(ior), eta = ior;
  if (p.specular_level != 0.5f) {
    f0 = clamp01(f0 * 2.0f * std::max(p.specular_level, 0.0f));
    eta = eta_from_f0(f0);
    if (ior < 1.0f) eta = 1.0f / eta;
  }
  if ((eta != 1.0f || p.film_nm > k_least_film_thickness_nm) && max_component(weight) > k_cutoff) {
    Lobe& lobe = templates.add(LobeKind::reflection, weight);
    lobe.eta = eta;
    lobe.fresnel = FresnelMode::schlick;
    lobe.f0 = clamp_color(p.specular_tint * f0, 1.0f);
    set_film(lobe, FresnelMode::film_dielectric, p.film_nm, film_ior);
    set_gloss(lobe, model, sqr(roughness));
    set_aspect(templates, p.anisotropic, p.rotation);
    Color albedo = lobe.fresnel == FresnelMode::schlick ? layer_albedo(lobe.f0, eta, cos_view, roughness)
                                                        : facet_reflectance(lobe, cos_view, eta);
    // What comes back from between the facets is darker than what they reflect at once.
    if (lobe.energy_compensation)
      albedo *= ggx_compensation(cos_view, sqr(roughness), mean_facet_reflectance(lobe, eta)) *
                ggx_correlated_albedo(cos_view, sqr(roughness));
    weight = layered(weight, albedo);
  }
  if (max_component(weight) > k_cutoff && p.subsurface > k_cutoff) {
    const float share = clamp01(p.subsurface);
    const SubsurfaceRules rules = SubsurfaceRules::unpack(p.subsurface_rules);
    if (thin_wall) {
      // Anisotropy says how much of what is scattered goes on (OpenPBR's thin-walled subsurface).
      const Color scattered = base * weight * share;
      const float through = clamp01(0.5f * (1.0f + p.subsurface_anisotropy));
      add_rough_diffuse(templates, scattered * (1.0f - through), base, p.diffuse_roughness, true);
      add_rough_diffuse(templates, scattered * through, base, p.diffuse_roughness, true, /*through=*/true);
    } else {
      const int before = templates.count;
      add_subsurface(base, share,
                     {p.subsurface_radius * p.subsurface_scale, p.subsurface_anisotropy,
                      rules.method == SubsurfaceMethod::skin ? p.subsurface_ior : ior, roughness, rules},
                     templates);
      for (int i = before; i < templates.count; ++i) templates.entries[i].lobe.weight *= weight;
    }
    weight *= 1.0f - share;
  }
  if (max_component(weight) > k_cutoff) {
    add_rough_diffuse(templates, clamp_color(p.base, 1e30f) * weight, p.base, p.diffuse_roughness, true);
  }
}

// Absorption per radius of a fibre that reflects such a colour in all, many fibres together (Chiang et al. 2016, eq.
// 9).
Color absorption_from_reflectance(const Color& reflectance, float around) {
  const float x = around;
  const float scale = 5.969f + x * (-0.215f + x * (2.532f + x * (-10.73f + x * (5.574f + x * 0.245f))));
  Color result;
  for (int k = 0; k < 3; ++k) result[k] = sqr(std::log(std::max(reflectance[k], 1e-20f)) / scale);
  return result;
}

// @param section of Huang's model; null: Chiang's
void add_principled_hair(const PrincipledHair& p, const HairSection* section, LobeTemplates& templates) {
  // A hair's number spreads values around their own, by as much as is asked for.
  const float spread = 2.0f * (p.random - 0.5f);
  const float roughness = p.roughness * (1.0f + spread * p.random_roughness);
  const float around = p.radial_roughness * (1.0f + spread * p.random_roughness);
  Lobe& lobe = templates.add(LobeKind::hair_fibre, Color(1.0f));
  lobe.alpha_x = std::clamp(roughness, 0.001f, 1.0f);
  lobe.alpha_y = std::clamp(around, 0.001f, 1.0f);
  lobe.param = p.tilt_rad;
  lobe.f90 = Color(1.0f - clamp01(p.coat), p.ior, 0.0f);
  if (section) {
    lobe.kind = LobeKind::hair_microfacets;
    lobe.alpha_y = section->aspect;
    lobe.eta = p.ior;
    lobe.f90 = Color(section->reflected, section->through, section->returned);
  }
  switch (static_cast<HairColor>(static_cast<int>(std::clamp(p.meaning, 0.0f, 2.0f)))) {
    case HairColor::absorption:
      lobe.f0 = p.color;
      break;
    case HairColor::reflectance:
      lobe.f0 = absorption_from_reflectance(p.color, around);
      break;
    case HairColor::melanin: {
      // Cycles' scale of melanin, and what either sort of it absorbs
      const float amount = p.melanin * (1.0f + spread * clamp01(p.random_color));
      const float density = -std::log(std::max(1.0f - amount, 1e-4f));
      const Color eumelanin(0.506f, 0.841f, 1.653f), pheomelanin(0.343f, 0.733f, 1.924f);
      lobe.f0 = eumelanin * (density * (1.0f - p.redness)) + pheomelanin * (density * p.redness) +
                absorption_from_reflectance(p.color, around);
      break;
    }
  }
}

// Takes parameters in the order in which they are stored.
struct Reader {
  const float* next;
  float number() { return *next++; }
  Color color() {
    next += 3;
    return Color(next[-3], next[-2], next[-1]);
  }
};
// Members of a braced list are evaluated in their order.
Principled1 read_principled_1(const float* p) {
  Reader r{p};
  return {r.color(),  r.number(), r.color(),  r.number(), r.number(), r.number(), r.number(),
          r.number(), r.number(), r.number(), r.number(), r.number(), r.number(), r.number(),
          r.number(), r.number(), r.color(),  r.number(), r.number(), r.number()};
}
PrincipledHair read_principled_hair(const float* p) {
  Reader r{p};
  return {r.color(),  r.number(), r.number(), r.number(), r.number(), r.number(),
          r.number(), r.number(), r.number(), r.number(), r.number(), r.number()};
}
Principled2 read_principled_2(const float* p) {
  Reader r{p};
  return {r.color(),  r.number(), r.number(), r.number(), r.number(), r.number(), r.number(), r.color(),  r.number(),
          r.number(), r.number(), r.number(), r.number(), r.number(), r.color(),  r.number(), r.number(), r.color(),
          r.color(),  r.number(), r.number(), r.number(), r.number(), r.number(), r.number(), r.number(), r.color()};
}

}  // namespace

int closure_parameter_count(ClosureKind kind) {
  switch (kind) {
    case ClosureKind::translucent:
    case ClosureKind::transparent:
    case ClosureKind::emission:
    case ClosureKind::holdout:
      return 3;
    case ClosureKind::velvet:
    case ClosureKind::sheen:
      return 4;
    case ClosureKind::diffuse:
    case ClosureKind::refraction:
    case ClosureKind::toon:
    case ClosureKind::glossy_toon:
      return 5;
    case ClosureKind::glossy:
    case ClosureKind::hair_reflection:
    case ClosureKind::hair_transmission:
      return 6;
    case ClosureKind::hair_fibre:
      return sizeof(PrincipledHair) / sizeof(float);
    case ClosureKind::hair_microfacets:
      return (sizeof(PrincipledHair) + sizeof(HairSection)) / sizeof(float);
    case ClosureKind::glass:
      return closure_parameter::k_glass_film + 2;
    case ClosureKind::portal:
      return closure_parameter::k_direction + 3;
    case ClosureKind::metallic:
    case ClosureKind::conductor:
      return closure_parameter::k_metal_film + 2;
    case ClosureKind::subsurface:
      return closure_parameter::k_scatter + 4;
    case ClosureKind::principled_1:
      return sizeof(Principled1) / sizeof(float);
    case ClosureKind::principled_2:
      return sizeof(Principled2) / sizeof(float);
  }
  return 0;
}

void make_lobes(ClosureKind kind, GlossModel model, const float* raw, bool backfacing, float cos_view,
                LobeTemplates& templates) {
  using namespace closure_parameter;
  templates.count = 0;
  templates.emission = templates.holdout = Color(0.0f);
  float p[k_max_closure_parameters];
  const int count = closure_parameter_count(kind);
  for (int i = 0; i < count; ++i) p[i] = std::isfinite(raw[i]) ? raw[i] : 0.0f;
  const Color color(p[0], p[1], p[2]);
  switch (kind) {
    case ClosureKind::diffuse:
      add_rough_diffuse(templates, color, color, p[k_roughness], p[k_diffuse_generation] >= 2.0f);
      break;
    case ClosureKind::glossy: {
      Lobe& lobe = templates.add(LobeKind::reflection, color);
      set_gloss(lobe, model, sqr(p[k_roughness]));
      lobe.f0 = clamp_color(color, 1.0f);
      if (model != GlossModel::sharp) set_anisotropy(templates, p[k_anisotropy], p[k_rotation]);
      break;
    }
    case ClosureKind::glass: {
      const float eta = seen_eta(p[k_ior], backfacing);
      if (model == GlossModel::multiscatter_ggx || p[k_glass_generation] >= 2.0f) {
        Lobe& lobe = templates.add(LobeKind::glass, color);
        lobe.eta = eta;
        const float film_eta = std::max(p[k_glass_film + 1], 1e-5f);
        set_film(lobe, FresnelMode::film_dielectric, p[k_glass_film],
                 backfacing ? film_eta / std::max(p[k_ior], 1e-5f) : film_eta);
        set_gloss(lobe, model, sqr(p[k_roughness]));
        break;
      }
      for (const LobeKind part : {LobeKind::reflection, LobeKind::refraction}) {
        Lobe& lobe = templates.add(part, color);
        lobe.eta = eta;
        lobe.macro_fresnel = true;
        set_gloss(lobe, model, sqr(p[k_roughness]));
      }
      break;
    }
    case ClosureKind::refraction: {
      Lobe& lobe = templates.add(LobeKind::refraction, color);
      lobe.eta = seen_eta(p[k_ior], backfacing);
      set_gloss(lobe, model == GlossModel::multiscatter_ggx ? GlossModel::ggx : model, sqr(p[k_roughness]));
      break;
    }
    case ClosureKind::translucent:
      templates.add(LobeKind::translucent, color);
      break;
    case ClosureKind::transparent:
      templates.add(LobeKind::transparent, color);
      break;
    case ClosureKind::portal: {
      Lobe& lobe = templates.add(LobeKind::portal, color);
      lobe.param = p[k_place + 3] != 0.0f;
      lobe.tangent = Vec3(p[k_place], p[k_place + 1], p[k_place + 2]);
      lobe.n = normalize(Vec3(p[k_direction], p[k_direction + 1], p[k_direction + 2]));
      break;
    }
    case ClosureKind::velvet:
      templates.add(LobeKind::velvet, color).param = clamp01(p[k_roughness]);
      break;
    case ClosureKind::sheen:
      templates.add(LobeKind::sheen, color).alpha_x = clamp01(p[k_roughness]);
      break;
    case ClosureKind::toon:
    case ClosureKind::glossy_toon: {
      Lobe& lobe = templates.add(kind == ClosureKind::toon ? LobeKind::toon : LobeKind::glossy_toon, color);
      lobe.param = clamp01(p[k_size]);
      lobe.alpha_x = clamp01(p[k_smooth]);
      break;
    }
    case ClosureKind::hair_reflection:
    case ClosureKind::hair_transmission: {
      Lobe& lobe = templates.add(
          kind == ClosureKind::hair_reflection ? LobeKind::hair_reflection : LobeKind::hair_transmission, color);
      lobe.alpha_x = std::clamp(p[k_roughness], 0.001f, 1.0f);
      lobe.alpha_y = std::clamp(p[k_around], 0.001f, 1.0f);
      lobe.param = p[k_tilt];
      templates.last().anisotropic = true;
      break;
    }
    case ClosureKind::hair_fibre:
      add_principled_hair(read_principled_hair(p), nullptr, templates);
      break;
    case ClosureKind::hair_microfacets: {
      Reader r{p + sizeof(PrincipledHair) / sizeof(float)};
      const HairSection section{r.number(), r.number(), r.number(), r.number()};
      if (section.reflected > 0.0f || section.through > 0.0f || section.returned > 0.0f)
        add_principled_hair(read_principled_hair(p), &section, templates);
      break;
    }
    case ClosureKind::conductor: {
      Lobe& lobe = templates.add(LobeKind::reflection, Color(1.0f));
      lobe.fresnel = FresnelMode::f82;
      set_film(lobe, FresnelMode::film_conductor, p[k_metal_film], p[k_metal_film + 1]);
      for (int k = 0; k < 3; ++k)
        if (lobe.fresnel == FresnelMode::f82)
          fit_conductor(p[k], p[k_extinction + k], lobe.f0[k], lobe.f90[k]);
        else
          lobe.f0[k] = p[k], lobe.f90[k] = p[k_extinction + k];
      set_gloss(lobe, model, sqr(p[k_roughness]));
      set_anisotropy(templates, p[k_anisotropy], p[k_rotation]);
      break;
    }
    case ClosureKind::metallic: {
      Lobe& lobe = templates.add(LobeKind::reflection, Color(1.0f));
      lobe.fresnel = FresnelMode::f82;
      lobe.f0 = clamp_color(color, 1.0f);
      lobe.f90 = clamp_color(Color(p[k_edge_tint], p[k_edge_tint + 1], p[k_edge_tint + 2]), 1.0f);
      set_film(lobe, FresnelMode::film_f82, p[k_metal_film], p[k_metal_film + 1]);
      set_gloss(lobe, model, sqr(p[k_roughness]));
      set_anisotropy(templates, p[k_anisotropy], p[k_rotation]);
      break;
    }
    case ClosureKind::subsurface:
      add_subsurface(color, 1.0f,
                     {Color(p[k_radius], p[k_radius + 1], p[k_radius + 2]), p[k_scatter], p[k_scatter + 1],
                      p[k_scatter + 2], SubsurfaceRules::unpack(p[k_scatter + 3])},
                     templates);
      break;
    case ClosureKind::principled_1:
      make_principled_1(read_principled_1(p), model, backfacing, templates);
      break;
    case ClosureKind::principled_2:
      make_principled_2(read_principled_2(p), model, backfacing, cos_view, templates);
      break;
    case ClosureKind::holdout:
      templates.holdout = color;
      break;
    case ClosureKind::emission:
      break;
  }
}

Vec3 bent_reflection_normal(const Vec3& ng, const Vec3& wi, const Vec3& n) {
  const float cos_view = dot(ng, wi);
  const Vec3 mirrored = n * (2.0f * dot(n, wi)) - wi;
  const float threshold = std::min(0.9f * cos_view, 0.01f);
  if (dot(ng, mirrored) >= threshold) return n;

  // In the plane of ng (z) and n: find the normal whose mirrored view has height `threshold`. With n' = (sin, cos),
  // 2·(n'·wi)·cos − wi.z = threshold is quadratic in cos².
  const Vec3 x_axis = normalize(n - ng * dot(n, ng));
  const float x = dot(wi, x_axis), z = cos_view;
  const float a = x * x + z * z;
  if (!(a > 1e-12f)) return ng;
  const float root = safe_sqrt(x * x * (a - threshold * threshold));
  const float b = z * threshold + a;
  const float candidates[2] = {0.5f * (b + root) / a, 0.5f * (b - root) / a};
  float best_height = k_infinity;
  Vec3 best = ng;
  float fallback_height = -k_infinity;
  for (const float cos2 : candidates) {
    if (!(cos2 > 1e-5f && cos2 <= 1.0f + 1e-5f)) continue;
    const float s = safe_sqrt(1.0f - cos2), c = safe_sqrt(cos2);
    const float height = 2.0f * (s * x + c * z) * c - z;
    const Vec3 candidate = x_axis * s + ng * c;
    // The shallower of two reflections above the surface is nearer to the one asked for
    if (height >= 1e-5f) {
      if (height < best_height) best_height = height, best = candidate;
    } else if (best_height == k_infinity && height > fallback_height) {
      fallback_height = height, best = candidate;
    }
  }
  const Vec3 result = normalize(best);
  return length_squared(result) > 0.0f ? result : ng;
}

}  // namespace lambent
