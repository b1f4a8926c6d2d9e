#include "engine/shading/bsdf_set.h"

#include <algorithm>

#include "engine/sampling/sampler.h"
#include "engine/shading/lobe_functions.h"

namespace lambent {
namespace {

// Weights below this are dropped, as in Cycles (CLOSURE_WEIGHT_CUTOFF).
constexpr float k_weight_cutoff = 1e-5f;
// Strengths of the ways through a hair, which are factors of its weight.
constexpr float k_most_hair_strength = 1e3f;
// Glass whose index differs by less than this from 1, and that has a film, is given this difference.
constexpr float k_least_bend = 2e-4f;

// Finite and not negative; `changed` is set if it was not.
float sane(float x, float low, float high, float otherwise) {
  return std::isfinite(x) ? std::clamp(x, low, high) : otherwise;
}
Color sane_color(const Color& c, float high) {
  return Color(sane(c.x, 0.0f, high, 0.0f), sane(c.y, 0.0f, high, 0.0f), sane(c.z, 0.0f, high, 0.0f));
}

Color weighted_albedo(const Lobe& lobe, float cos_view) { return lobe.weight * lobe_albedo(lobe, cos_view); }

// How much of the mixture's samples the lobe gets, seen from a direction with cosine `cos_view` to its normal.
float selection(const Lobe& lobe, float cos_view) { return average(weighted_albedo(lobe, cos_view)); }

// Smooths what a bumped diffuse lobe would cut off hard at the smooth terminator.
float bump_shadowing(BumpShadowing rule, const Vec3& ns, const Vec3& n, const Vec3& light) {
  // A normal that points into the surface would let light through it.
  if (rule != BumpShadowing::cubic && dot(ns, light) * dot(ns, n) * dot(n, light) < 0.0f) return 0.0f;
  if (rule == BumpShadowing::none) return 1.0f;
  if (rule == BumpShadowing::masking) {
    // GGX's masking of a surface whose slopes are about as wide as the bump's
    const float cos_light = std::fabs(dot(ns, light)), cos_bump = std::fabs(dot(ns, n));
    if (cos_light >= 1.0f || cos_bump >= 1.0f) return 1.0f;
    if (cos_light < 1e-6f || cos_bump < 1e-6f) return 0.0f;
    const float alpha2 = std::min(0.125f * (1.0f / sqr(cos_bump) - 1.0f), 1.0f);
    const float tan2 = 1.0f / sqr(cos_light) - 1.0f;
    return 2.0f / (1.0f + std::sqrt(1.0f + alpha2 * tan2));
  }
  const float cos_light = dot(n, light);
  const Vec3 reference = cos_light < 0.0f ? ns * -1.0f : ns;
  const float denominator = cos_light * dot(reference, n);
  if (denominator == 0.0f) return 0.0f;
  const float g = dot(reference, light) / denominator;
  if (g >= 1.0f) return 1.0f;
  if (g < 0.0f) return 0.0f;
  return g + g * g - g * g * g;
}

// Importance is scaled by |wo·ng|/|wi·ng| (lobe.h); grazing arrival is cut where the factor means nothing any more.
float adjoint(const Vec3& ng, const Vec3& wi, const Vec3& wo, Transport transport) {
  if (transport == Transport::radiance) return 1.0f;
  const float cos_wi = std::fabs(dot(wi, ng));
  return cos_wi > 1e-6f ? std::fabs(dot(wo, ng)) / cos_wi : 0.0f;
}

/// Of a lobe that is no delta. @param apart the two directions, by the lobe's normal
uint8_t event_of(LobeKind kind, bool apart) {
  return static_cast<uint8_t>((is_diffuse(kind) ? k_scatter_diffuse : k_scatter_glossy) |
                              (goes_through(kind, apart) ? k_scatter_transmission : 0));
}

uint8_t event_of(const Lobe& lobe, bool apart) {
  if (lobe.kind == LobeKind::transparent) return k_scatter_transparent | k_scatter_delta;
  if (lobe.kind == LobeKind::portal) return k_scatter_portal | k_scatter_transparent | k_scatter_delta;
  if (lobe.kind == LobeKind::subsurface) return k_scatter_subsurface | k_scatter_delta;
  return static_cast<uint8_t>(event_of(lobe.kind, apart) | (is_delta(lobe) ? k_scatter_delta : 0));
}

// One lobe's share of the mixture for a pair of directions.
struct Term {
  Color f_cos{0.0f};
  float pdf = 0.0f, pdf_reverse = 0.0f;
};

Term eval_term(const Lobe& lobe, BumpShadowing rule, const Vec3& ng, const Vec3& ns, const Vec3& wi, const Vec3& wo,
               Transport transport, bool reverse) {
  Term term;
  const bool camera_is_wi = transport == Transport::radiance;
  LobeValue value;
  float cos_wi = dot(lobe.n, wi), cos_wo = dot(lobe.n, wo);
  bool reflected = cos_wi * cos_wo > 0.0f;
  if (lobe.kind == LobeKind::diffuse) {  // the commonest lobe needs no frame
    // A bumped one is seen from below its normal as well (Lobe::n).
    const float cos_light = camera_is_wi ? cos_wo : cos_wi;
    if (cos_light <= 0.0f) return term;
    reflected = true;
    value.f_cos = Color(k_inv_pi * cos_light);
    value.pdf_solid_angle = std::max(cos_wo, 0.0f) * k_inv_pi;
    value.pdf_reverse_solid_angle = std::max(cos_wi, 0.0f) * k_inv_pi;
  } else {
    const Frame frame = lobe_frame(lobe);
    value = eval_lobe(lobe, frame.to_local(wi), frame.to_local(wo), camera_is_wi);
  }
  // Reflection stays on the smooth surface's side. A direction below the facet is evaluated (the terminator of coarse
  // meshes is not cut), but sample() never makes it: no technique is there to share sharp highlights with, so they are
  // held down to what a lobe as wide as a steradian has. Cycles weighs them as if sample() made them.
  if ((dot(ns, wo) > 0.0f) != reflected && !is_fibre(lobe.kind)) return term;
  const bool sampled = (dot(ng, wi) * dot(ng, wo) > 0.0f) == reflected;
  term.f_cos = lobe.weight * value.f_cos;
  if (is_diffuse(lobe.kind) && lobe.n != ns) term.f_cos *= bump_shadowing(rule, ns, lobe.n, camera_is_wi ? wo : wi);
  if (sampled) {
    term.pdf = value.pdf_solid_angle;
    if (reverse) term.pdf_reverse = value.pdf_reverse_solid_angle;
  } else {
    const float pdf_of_light = camera_is_wi ? value.pdf_solid_angle : value.pdf_reverse_solid_angle;
    term.f_cos *= 1.0f / std::max(pdf_of_light, 1.0f);
  }
  return term;
}

bool is_of(const Lobe& lobe, LobeWidth width) {
  return width == LobeWidth::any || is_narrow(lobe) == (width == LobeWidth::narrow);
}

void add_event(EventShares& shares, LobeKind kind, bool apart, float pdf) {
  const bool transmitted = goes_through(kind, apart);
  (transmitted ? shares.transmission : is_diffuse(kind) ? shares.diffuse : shares.glossy) += pdf;
  if (transmitted && is_diffuse(kind)) shares.diffuse_transmission += pdf;
}

}  // namespace

const std::array<std::array<LobeFacts, 2>, static_cast<size_t>(LobeKind::thin_transmission) + 1> k_lobe_facts = [] {
  std::array<std::array<LobeFacts, 2>, static_cast<size_t>(LobeKind::thin_transmission) + 1> facts;
  for (size_t k = 0; k < facts.size(); ++k)
    for (const bool apart : {false, true}) {
      const LobeKind kind = static_cast<LobeKind>(k);
      facts[k][apart] = {class_of(kind, apart), event_of(kind, apart), kind == LobeKind::glass || is_fibre(kind)};
    }
  return facts;
}();

Bsdf& Bsdf::operator=(const Bsdf& other) {
  if (this == &other) return *this;
  count_ = other.count_;
  has_non_delta_ = other.has_non_delta_;
  least_share_ = other.least_share_;
  shares_wi_world_ = Vec3(0.0f);
  ng_world_ = other.ng_world_;
  ns_world_ = other.ns_world_;
  transparency_ = other.transparency_;
  emission_ = other.emission_;
  holdout_ = other.holdout_;
  bump_shadowing_ = other.bump_shadowing_;
  for (int i = 0; i < count_; ++i) lobes_[i] = other.lobes_[i];
  return *this;
}

void Bsdf::begin(const ShadingPoint& point) {
  count_ = 0;
  has_non_delta_ = false;
  least_share_ = 0.0f;
  bump_shadowing_ = BumpShadowing::cubic;
  shares_wi_world_ = Vec3(0.0f);
  ng_world_ = point.ng_world;
  ns_world_ = point.ns_world;
  transparency_ = emission_ = holdout_ = Color(0.0f);
}

Lobe Bsdf::sanitized(const Lobe& given) {
  Lobe lobe = given;
  lobe.weight = sane_color(lobe.weight, 1e30f);
  lobe.alpha_x = sane(lobe.alpha_x, 0.0f, 1.0f, 1.0f);
  lobe.alpha_y = sane(lobe.alpha_y, 0.0f, 1.0f, 1.0f);
  const bool fibre = is_fibre(lobe.kind);
  const bool hair = fibre || lobe.kind == LobeKind::hair_reflection || lobe.kind == LobeKind::hair_transmission;
  const bool subsurface = lobe.kind == LobeKind::subsurface;
  lobe.param = sane(lobe.param,
                    hair         ? -0.5f * k_pi
                    : subsurface ? -0.99f
                                 : 0.0f,
                    hair         ? 0.5f * k_pi
                    : subsurface ? 0.99f
                                 : 1.0f,
                    0.0f);
  lobe.eta = sane(lobe.eta, 1e-5f, 1e5f, 1.0f);
  const bool conductor = lobe.fresnel == FresnelMode::film_conductor;
  lobe.f0 = sane_color(lobe.f0, fibre ? 1e30f : conductor ? k_most_conductor_index : 1.0f);
  lobe.f90 = sane_color(lobe.f90, lobe.kind == LobeKind::hair_microfacets ? k_most_hair_strength
                                  : subsurface || fibre                   ? 1e30f
                                  : conductor                             ? k_most_conductor_index
                                                                          : 1.0f);
  lobe.film_nm = sane(lobe.film_nm, 0.0f, 1e9f, 0.0f);
  lobe.film_eta = sane(lobe.film_eta, k_least_film_eta, k_most_film_eta, 1.0f);
  if (!is_finite(lobe.n) || length_squared(lobe.n) < 0.25f)
    lobe.n = Vec3(0.0f);  // add_sanitized() puts ns in its place
  if (!is_finite(lobe.tangent)) lobe.tangent = Vec3(0.0f);
  if (is_microfacet(lobe.kind)) {
    // A film over what has the index of this side: the film reflects, so that this stays glass, with next to no bend.
    if (lobe.fresnel == FresnelMode::film_dielectric && lobe.kind == LobeKind::glass &&
        std::fabs(lobe.eta - 1.0f) < k_least_bend)
      lobe.eta = 1.0f + k_least_bend;
    // Transmission without a change of index goes straight on, whatever the roughness: the lobe narrows to a delta.
    if ((lobe.kind == LobeKind::refraction || lobe.kind == LobeKind::glass) && std::fabs(lobe.eta - 1.0f) < 1e-4f) {
      if (lobe.kind == LobeKind::glass) {
        lobe.weight *= lobe.f90;
        lobe.kind = LobeKind::refraction;
        lobe.energy_compensation = false;
      }
      lobe.alpha_x = lobe.alpha_y = 0.0f;
    }
    if (is_delta(lobe) && lobe.kind == LobeKind::thin_transmission) {
      lobe.kind = LobeKind::transparent;
      return lobe;
    }
    if (!is_delta(lobe)) {
      lobe.alpha_x = std::max(lobe.alpha_x, k_delta_alpha);
      lobe.alpha_y = std::max(lobe.alpha_y, k_delta_alpha);
    } else {
      lobe.energy_compensation = false;
    }
    if (lobe.alpha_x == lobe.alpha_y) lobe.tangent = Vec3(0.0f);
  }
  return lobe;
}

void Bsdf::drop_glossy(bool reflection, bool refraction) {
  if (!reflection && !refraction) return;
  const auto dropped = [&](const Lobe& lobe) {
    switch (lobe.kind) {
      case LobeKind::reflection:
        return reflection;
      case LobeKind::refraction:
      case LobeKind::thin_transmission:
        return refraction;
      case LobeKind::glass:
        return reflection && refraction;
      default:
        return false;
    }
  };
  int kept = 0;
  has_non_delta_ = false;
  for (int i = 0; i < count_; ++i) {
    if (dropped(lobes_[i])) continue;
    Lobe& lobe = lobes_[kept++];
    if (&lobe != &lobes_[i]) lobe = lobes_[i];
    if (lobe.kind == LobeKind::glass) {
      if (reflection) lobe.f0 = Color(0.0f);
      if (refraction) lobe.f90 = Color(0.0f);
    }
    has_non_delta_ |= !is_delta(lobe);
  }
  count_ = kept;
  shares_wi_world_ = Vec3(0.0f);
}

void Bsdf::drop_subsurface_after_diffuse() {
  for (int i = 0; i < count_; ++i)
    if (lobes_[i].diffuse_after_diffuse) {
      lobes_[i].kind = lobes_[i].macro_fresnel ? LobeKind::principled_diffuse : LobeKind::diffuse;
      lobes_[i].param = 0.0f;  // retro-reflection is a lobe of its own
      lobes_[i].diffuse_after_diffuse = false;
      has_non_delta_ = true;
      shares_wi_world_ = Vec3(0.0f);
    }
}

void Bsdf::add_sanitized(const Lobe& given) {
  if (!(average(given.weight) >= k_weight_cutoff)) return;
  shares_wi_world_ = Vec3(0.0f);
  if (given.kind == LobeKind::portal) transparency_ += given.weight;
  if (given.kind == LobeKind::transparent) {
    transparency_ += given.weight;
    for (int i = 0; i < count_; ++i)
      if (lobes_[i].kind == LobeKind::transparent) {
        lobes_[i].weight += given.weight;
        return;
      }
  }
  if (count_ == k_max_lobes) {
    // Full: the weight joins a diffuse lobe, which takes the place of the last one if there is none
    Lobe* diffuse = nullptr;
    for (int i = 0; i < count_ && !diffuse; ++i)
      if (lobes_[i].kind == LobeKind::diffuse) diffuse = &lobes_[i];
    if (!diffuse) {
      if (is_delta(lobes_[count_ - 1]) && !is_microfacet(lobes_[count_ - 1].kind))
        std::swap(lobes_[count_ - 2], lobes_[count_ - 1]);
      diffuse = &lobes_[count_ - 1];
      diffuse->kind = LobeKind::diffuse;
      has_non_delta_ = true;
    }
    diffuse->weight += given.weight;
    return;
  }
  Lobe& lobe = lobes_[count_++];
  lobe = given;
  if (length_squared(lobe.n) == 0.0f) lobe.n = ns_world_;
  has_non_delta_ |= !is_delta(lobe);
}

void Bsdf::add_emission(const Color& radiance) {
  if (is_finite(radiance)) emission_ += radiance;
}

void Bsdf::fill_shares(const Vec3& wi_world) const {
  shares_wi_world_ = wi_world;
  shares_.albedos_known = count_ != 1;
  if (count_ == 1) {
    shares_.total = shares_.of[0] = 1.0f;
    return;
  }
  for (int i = 0; i < count_; ++i) shares_.albedo[i] = weighted_albedo(lobes_[i], dot(lobes_[i].n, wi_world));
  share_out();
}

void Bsdf::share_out() const {
  if (count_ == 1) return;
  float* const share = shares_.of;
  float& total = shares_.total;
  total = 0.0f;
  for (int i = 0; i < count_; ++i) total += share[i] = average(shares_.albedo[i]);
  if (least_share_ == 0.0f) return;
  // As Cycles' defensive sampling; a lobe that gives nothing keeps nothing.
  const float least = least_share_ * total;
  total = 0.0f;
  for (int i = 0; i < count_; ++i) total += share[i] = share[i] > 0.0f ? std::max(share[i], least) : 0.0f;
}

void Bsdf::fill_albedo_of_only_lobe() const {
  shares_.albedo[0] = weighted_albedo(lobes_[0], dot(lobes_[0].n, shares_wi_world_));
  shares_.albedos_known = true;
}

template <bool wants_parts, bool by_width>
BsdfEval Bsdf::eval_lobes(const Vec3& wi_world, const Vec3& wo_world, Transport transport, ReversePdf reverse_pdf,
                          EvalParts* parts, LobeWidth width) const {
  BsdfEval result;
  if (!has_non_delta_) return result;
  if constexpr (wants_parts) {
    parts->known = true;
    parts->f_cos.fill(Color(0.0f));
    parts->pdf = {};
  }
  const bool reverse = reverse_pdf == ReversePdf::yes;
  const Shares& selected = shares(wi_world);
  float selected_reverse = 0.0f;
  for (int i = 0; i < count_; ++i) {
    const Lobe& lobe = lobes_[i];
    const float share_reverse = count_ > 1 && reverse ? selection(lobe, dot(lobe.n, wo_world)) : 1.0f;
    selected_reverse += share_reverse;
    if (is_delta(lobe) || (by_width && !is_of(lobe, width))) continue;
    const Term term = eval_term(lobe, bump_shadowing_, ng_world_, ns_world_, wi_world, wo_world, transport, reverse);
    result.f_cos += term.f_cos;
    result.pdf_solid_angle += selected.of[i] * term.pdf;
    if constexpr (wants_parts) {
      const std::array<LobeFacts, 2>& of_kind = k_lobe_facts[static_cast<size_t>(lobe.kind)];
      const bool apart = of_kind[0].by_side && dot(lobe.n, wi_world) * dot(lobe.n, wo_world) < 0.0f;
      parts->f_cos[static_cast<size_t>(of_kind[apart].one)] += term.f_cos;
      add_event(parts->pdf, lobe.kind, apart, selected.of[i] * term.pdf);
    }
    result.pdf_reverse_solid_angle += share_reverse * term.pdf_reverse;
  }
  if (transport == Transport::importance) result.f_cos *= adjoint(ng_world_, wi_world, wo_world, transport);
  result.pdf_solid_angle = selected.total > 0.0f ? result.pdf_solid_angle / selected.total : 0.0f;
  result.pdf_reverse_solid_angle =
      reverse && selected_reverse > 0.0f ? result.pdf_reverse_solid_angle / selected_reverse : 0.0f;
  return result;
}

BsdfEval Bsdf::eval(const Vec3& wi_world, const Vec3& wo_world, Transport transport, ReversePdf reverse_pdf) const {
  return eval_lobes<false>(wi_world, wo_world, transport, reverse_pdf, nullptr);
}

BsdfEval Bsdf::eval(const Vec3& wi_world, const Vec3& wo_world, Transport transport, ReversePdf reverse_pdf,
                    EvalParts& parts) const {
  return eval_lobes<true>(wi_world, wo_world, transport, reverse_pdf, &parts);
}

BsdfEval Bsdf::eval(const Vec3& wi_world, const Vec3& wo_world, Transport transport, LobeWidth width,
                    EvalParts* parts) const {
  if (parts) return eval_lobes<true, true>(wi_world, wo_world, transport, ReversePdf::yes, parts, width);
  return eval_lobes<false, true>(wi_world, wo_world, transport, ReversePdf::yes, nullptr, width);
}

bool Bsdf::has_narrow() const {
  return has_non_delta_ && std::ranges::any_of(lobes(), [](const Lobe& lobe) { return is_narrow(lobe); });
}

LobeWidth Bsdf::keep_width(const Vec3& wi_world, Transport transport, BsdfSample& sample, EvalParts* parts) const {
  const LobeWidth width = is_narrow(lobes_[sample.lobe]) ? LobeWidth::narrow : LobeWidth::wide;
  const bool alone =
      std::ranges::all_of(lobes(), [&](const Lobe& lobe) { return is_delta(lobe) || is_of(lobe, width); });
  if (alone) return width;
  const BsdfEval kept = eval(wi_world, sample.wo_world, transport, width, parts);
  sample.weight = kept.pdf_solid_angle > 0.0f ? kept.f_cos * (1.0f / kept.pdf_solid_angle) : Color(0.0f);
  if (!is_finite(sample.weight)) sample.weight = Color(0.0f);
  sample.pdf_solid_angle = kept.pdf_solid_angle;
  sample.pdf_reverse_solid_angle = kept.pdf_reverse_solid_angle;
  return width;
}

BsdfSample Bsdf::sample(const Vec3& wi_world, float u_choice, const Vec2& u, Transport transport,
                        ReversePdf reverse_pdf) const {
  return sample_lobes<false>(wi_world, u_choice, u, transport, reverse_pdf, nullptr);
}

BsdfSample Bsdf::sample(const Vec3& wi_world, float u_choice, const Vec2& u, Transport transport,
                        ReversePdf reverse_pdf, EvalParts& parts) const {
  return sample_lobes<true>(wi_world, u_choice, u, transport, reverse_pdf, &parts);
}

template <bool wants_parts>
BsdfSample Bsdf::sample_lobes(const Vec3& wi_world, float u_choice, const Vec2& u_all, Transport transport,
                              ReversePdf reverse_pdf, EvalParts* parts) const {
  BsdfSample result;
  if (count_ == 0) return result;
  const Shares& selected = shares(wi_world);
  const float* share = selected.of;
  const float total = selected.total;
  if (!(total > 0.0f)) return result;
  int picked = 0;
  Vec2 u = u_all;
  if (count_ > 1) {
    ReusedNumber u_first(u_all);
    const double target = u_first.value() * static_cast<double>(total);
    double before = 0.0;
    while (picked + 1 < count_ && target >= before + static_cast<double>(share[picked]))
      before += static_cast<double>(share[picked++]);
    while (picked > 0 && share[picked] <= 0.0f) --picked;  // rounding at u near 1
    if (!(share[picked] > 0.0f)) return result;
    u_first.set((target - before) / static_cast<double>(share[picked]));
    u.x = u_first.rest();
  }
  const float prob = share[picked] / total;
  if constexpr (wants_parts) parts->picked = picked;

  const Lobe& lobe = lobes_[picked];
  const bool camera_is_wi = transport == Transport::radiance;
  if (count_ == 1 && lobe.kind == LobeKind::diffuse && camera_is_wi && reverse_pdf == ReversePdf::no) {
    // The commonest surface: f cos / pdf is the weight.
    const Vec3 local = sample_cosine_hemisphere(u);
    const Vec3 wo = normalize(Frame::from_normal(lobe.n).to_world(local));
    if (!(local.z > 0.0f) || dot(ns_world_, wo) <= 0.0f || dot(ng_world_, wo) * dot(ng_world_, wi_world) <= 0.0f)
      return result;
    result.wo_world = wo;
    result.weight =
        lobe.n != ns_world_ ? lobe.weight * bump_shadowing(bump_shadowing_, ns_world_, lobe.n, wo) : lobe.weight;
    result.pdf_solid_angle = local.z * k_inv_pi;
    result.event = k_scatter_diffuse;
    result.lobe = picked;
    return result;
  }
  if (lobe.kind == LobeKind::subsurface) {
    const float cos_wi = dot(lobe.n, wi_world);
    if (cos_wi <= 0.0f) return result;
    result.weight = lobe.weight * (1.0f / prob);
    result.pdf_solid_angle = prob;
    result.event = event_of(lobe, false);
    result.lobe = picked;
    return result;
  }
  if (lobe.kind == LobeKind::portal) {
    result.wo_world = lobe.n;
    result.weight = lobe.weight * (1.0f / prob);
    result.pdf_solid_angle = prob;
    result.event = event_of(lobe, true);
    result.roughness = 0.0f;
    result.lobe = picked;
    return result;
  }
  const Frame frame = lobe_frame(lobe);
  const LobeSample sampled = sample_lobe(lobe, frame.to_local(wi_world), u_choice, u, camera_is_wi);
  if (!sampled.valid) return result;
  const bool transparent = lobe.kind == LobeKind::transparent;
  const Vec3 wo = transparent ? wi_world * -1.0f : normalize(frame.to_world(sampled.wo));
  // Reflection must leave on the geometric side it came from, transmission on the other: else the light is absorbed.
  if (!transparent && (dot(ng_world_, wo) * dot(ng_world_, wi_world) > 0.0f) == sampled.transmitted) return result;

  result.wo_world = wo;
  result.lobe = picked;
  result.event = event_of(lobe, sampled.transmitted);
  result.eta = transparent ? 1.0f : sampled.eta;
  result.roughness = is_microfacet(lobe.kind) ? std::sqrt(lobe.alpha_x * lobe.alpha_y) : transparent ? 0.0f : 1.0f;
  if (is_delta(lobe)) {
    const float factor = transparent ? 1.0f : adjoint(ng_world_, wi_world, wo, transport);
    result.weight = lobe.weight * sampled.delta_f * (factor / prob);
    result.pdf_solid_angle = prob * sampled.prob;
    if (reverse_pdf == ReversePdf::yes) {
      float total_reverse = 0.0f, share_reverse = 0.0f;
      for (int i = 0; i < count_; ++i) {
        const float reversed = count_ == 1 ? 1.0f : selection(lobes_[i], dot(lobes_[i].n, wo));
        total_reverse += reversed;
        if (i == picked) share_reverse = reversed;
      }
      result.pdf_reverse_solid_angle =
          total_reverse > 0.0f ? share_reverse / total_reverse * sampled.prob_reverse : 0.0f;
    }
    if (!is_finite(result.weight)) return BsdfSample{};
    return result;
  }
  const BsdfEval eval_all = eval_lobes<wants_parts>(wi_world, wo, transport, reverse_pdf, parts);
  if (!(eval_all.pdf_solid_angle > 0.0f) || !std::isfinite(eval_all.pdf_solid_angle)) return BsdfSample{};
  result.weight = eval_all.f_cos * (1.0f / eval_all.pdf_solid_angle);
  result.pdf_solid_angle = eval_all.pdf_solid_angle;
  result.pdf_reverse_solid_angle = eval_all.pdf_reverse_solid_angle;
  if (!is_finite(result.weight)) return BsdfSample{};
  return result;
}

BsdfEval Bsdf::eval_delta(int index, const Vec3& wi_world, const Vec3& wo_world, Transport transport) const {
  BsdfEval result;
  if (index < 0 || index >= count_ || !is_delta(lobes_[index]) || lobes_[index].kind == LobeKind::subsurface ||
      lobes_[index].kind == LobeKind::portal)
    return result;
  const Lobe& lobe = lobes_[index];
  const Shares& selected = shares(wi_world);
  float total_reverse = 0.0f, share_reverse = 0.0f;
  for (int i = 0; i < count_; ++i) {
    const float reversed = count_ == 1 ? 1.0f : selection(lobes_[i], dot(lobes_[i].n, wo_world));
    total_reverse += reversed;
    if (i == index) share_reverse = reversed;
  }
  const float prob = selected.total > 0.0f ? selected.of[index] / selected.total : 0.0f;
  const float prob_reverse = total_reverse > 0.0f ? share_reverse / total_reverse : 0.0f;
  if (lobe.kind == LobeKind::transparent) return {lobe.weight, prob, prob_reverse};
  const float cos_wi = dot(lobe.n, wi_world), cos_wo = dot(lobe.n, wo_world);
  const bool reflects = cos_wo > 0.0f;
  if (!(cos_wi > 0.0f) || (reflects ? lobe.kind == LobeKind::refraction : lobe.kind == LobeKind::reflection))
    return result;
  float prob_direction = 1.0f, prob_back = 1.0f;
  if (lobe.kind == LobeKind::glass) {
    const GlassFacet facet(lobe, cos_wi, lobe.eta);
    prob_direction = prob_back = reflects ? facet.prob_reflect : facet.prob_transmit;
    if (!reflects) prob_back = prob_transmit_reversed(lobe, prob_direction, cos_wo);
  }
  const float factor = adjoint(ng_world_, wi_world, wo_world, transport);
  result.f_cos = lobe.weight * delta_value(lobe, cos_wi, cos_wo, transport == Transport::radiance) * factor;
  result.pdf_solid_angle = prob * prob_direction;
  result.pdf_reverse_solid_angle = prob_reverse * prob_back;
  if (!is_finite(result.f_cos)) return BsdfEval{};
  return result;
}

/// What `kind_of(lobe, transmitted)` is for a pair of directions, if it is the same for all lobes but deltas.
template <typename KindOf>
auto Bsdf::only(const Vec3& wi_world, const Vec3& wo_world, KindOf&& kind_of) const {
  std::optional<decltype(kind_of(lobes_[0], true))> result;
  for (const Lobe& lobe : lobes()) {
    if (is_delta(lobe)) continue;
    const auto kind = kind_of(lobe, dot(lobe.n, wi_world) * dot(lobe.n, wo_world) < 0.0f);
    if (result && *result != kind) return decltype(result)();
    result = kind;
  }
  return result;
}

std::optional<LobeClass> Bsdf::only_class(const Vec3& wi_world, const Vec3& wo_world) const {
  return only(wi_world, wo_world, [](const Lobe& lobe, bool apart) { return class_of(lobe.kind, apart); });
}

std::optional<uint8_t> Bsdf::only_event(const Vec3& wi_world, const Vec3& wo_world) const {
  return only(wi_world, wo_world, [](const Lobe& lobe, bool apart) { return event_of(lobe, apart); });
}

EventShares Bsdf::event_shares(const Vec3& wi_world, const Vec3& wo_world, LobeWidth width) const {
  EventShares result;
  const Shares& selected = shares(wi_world);
  float total = 0.0f;
  for (int i = 0; i < count_; ++i) {
    const Lobe& lobe = lobes_[i];
    if (is_delta(lobe) || !is_of(lobe, width)) continue;
    const float pdf = selected.of[i] * eval_term(lobe, bump_shadowing_, ng_world_, ns_world_, wi_world, wo_world,
                                                 Transport::radiance, /*reverse=*/false)
                                           .pdf;
    add_event(result, lobe.kind, dot(lobe.n, wi_world) * dot(lobe.n, wo_world) < 0.0f, pdf);
    total += pdf;
  }
  if (!(total > 0.0f) || !std::isfinite(total)) return {};
  result.diffuse /= total;
  result.glossy /= total;
  result.transmission /= total;
  result.diffuse_transmission /= total;
  return result;
}

ClassShares EvalParts::class_shares() const {
  ClassShares result;
  const Color total = f_cos[0] + f_cos[1] + f_cos[2];
  for (int k = 0; k < 3; ++k) {
    const bool any = total[k] > 0.0f && std::isfinite(total[k]);
    for (size_t c = 0; c < f_cos.size(); ++c)
      result.of[c][k] = any ? f_cos[c][k] / total[k] : c == static_cast<size_t>(LobeClass::glossy) ? 1.0f : 0.0f;
  }
  return result;
}

ClassShares Bsdf::class_shares(const Vec3& wi_world, const Vec3& wo_world, Transport transport) const {
  if (!has_non_delta_) return ClassShares::all_of(LobeClass::glossy);
  if (const std::optional<LobeClass> only = only_class(wi_world, wo_world)) return ClassShares::all_of(*only);
  EvalParts parts;
  eval(wi_world, wo_world, transport, ReversePdf::no, parts);
  return parts.class_shares();
}

std::optional<LobeClass> Bsdf::class_of_uncommon_lobe() const {
  const LobeKind kind = lobes_[0].kind;
  if (goes_straight(kind) || kind == LobeKind::glass) return std::nullopt;
  return class_of(kind, transmits_alone(kind));
}

ClassAlbedos Bsdf::class_albedos(const Vec3& wi_world) const {
  ClassAlbedos result;
  const Color* const albedos = lobe_albedos(wi_world);
  for (int i = 0; i < count_; ++i) {
    const Lobe& lobe = lobes_[i];
    if (goes_straight(lobe.kind)) continue;
    if (lobe.kind == LobeKind::glass) {
      const float cos_view = dot(lobe.n, wi_world);
      const GlassFacet facet(lobe, std::fabs(cos_view), cos_view > 0.0f ? lobe.eta : 1.0f / lobe.eta);
      result.of[static_cast<int>(LobeClass::glossy)] += lobe.weight * facet.reflected;
      result.of[static_cast<int>(LobeClass::transmission)] += lobe.weight * facet.transmitted;
    } else {
      result.of[static_cast<int>(class_of(lobe.kind, transmits_alone(lobe.kind)))] += albedos[i];
    }
  }
  return result;
}

Color Bsdf::albedo_of_several(const Vec3& wi_world) const {
  const Color* const albedos = lobe_albedos(wi_world);
  Color sum(0.0f);
  for (int i = 0; i < count_; ++i) sum += albedos[i];
  return sum;
}

}  // namespace lambent
