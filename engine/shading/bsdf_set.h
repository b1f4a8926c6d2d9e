// The lobes of one shading point as a set: mixture sampling and evaluation. Contract: bsdf.h; lobes: lobe.h.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "engine/shading/bsdf.h"
#include "engine/shading/lobe.h"
#include "engine/shading/shading_point.h"

namespace lambent {

/// Whether pdf_reverse_solid_angle is wanted: a path tracer's loop says no and saves its cost (the value is then 0).
enum class ReversePdf : uint8_t { no, yes };

/// What light counts as that a lobe, not a delta, sends from one direction to another.
struct LobeFacts {
  LobeClass one;
  uint8_t event;
  bool by_side;  ///< they depend on whether the two are apart, by the lobe's normal
};
/// By LobeKind and whether they are apart.
extern const std::array<std::array<LobeFacts, 2>, static_cast<size_t>(LobeKind::thin_transmission) + 1> k_lobe_facts;

/// What evaluating several lobes for a pair of directions tells besides: what each class of lobes has of f_cos, and
/// each kind of event of pdf_solid_angle (not normalised). For passes. (One lobe alone: Bsdf::facts_of_only_lobe.)
struct EvalParts {
  std::array<Color, k_lobe_classes> f_cos;  ///< set where known
  EventShares pdf;                          ///< likewise
  bool known = false;                       ///< false: nothing had to be evaluated
  int picked = -1;  ///< sample(): number of the lobe chosen, also where the sample fails; -1: none

  EvalParts() {}  // leaves f_cos and pdf uninitialised on purpose
  void clear() {
    known = false;
    picked = -1;
  }
  /// As Bsdf::class_shares(). Requires known.
  ClassShares class_shares() const;
};

/// Filled by Program::evaluate on the stack; no virtual calls, no allocation. Reusable after begin().
class Bsdf {
 public:
  Bsdf() {}  // leaves the lobes uninitialised on purpose: they are written before they are read

  Bsdf(const Bsdf& other) { *this = other; }
  Bsdf& operator=(const Bsdf& other);  ///< copies the lobes in use only

  /// Empties the set and takes over the point's normals and `wi`.
  void begin(const ShadingPoint& point);
  /// Adds a lobe. Drops one whose weight is zero; makes non-finite or out-of-range parameters harmless. At most
  /// k_max_lobes: beyond that the weight joins a diffuse lobe, so no energy appears or vanishes unseen by albedo().
  void add(const Lobe& lobe) { add_sanitized(sanitized(lobe)); }
  /// The lobe with finite parameters in their ranges; what is a delta becomes one. Idempotent.
  static Lobe sanitized(const Lobe& lobe);
  /// Adds a lobe that sanitized() returned, its weight scaled and its unit normal and tangent replaced at most.
  void add_sanitized(const Lobe& lobe);
  void add_emission(const Color& radiance);
  void add_holdout(const Color& weight) { holdout_ += weight; }

  /// Gives each lobe at least this share of the samples (before normalising; 0 after begin()), however little of the
  /// albedo it has: a mirror over glass that reflects a lamp is dim in the mean and bright where it counts. Holds for
  /// sampling from wi and its pdf; reverse pdfs are those without.
  void set_least_share(float share) {
    least_share_ = share;
    if (shares_wi_world_ != Vec3(0.0f)) share_out();
  }

  void set_bump_shadowing(BumpShadowing rule) { bump_shadowing_ = rule; }
  /// Takes the place of the point's interpolated normal: a displacement's bump is not darkened as bump maps are.
  void set_shading_normal(const Vec3& n_world) { ns_world_ = n_world; }

  /// The class that albedo() is of where there is one lobe and class_albedos() has it in one class; else none.
  std::optional<LobeClass> class_of_only_lobe() const {
    if (count_ != 1) return std::nullopt;
    if (lobes_[0].kind == LobeKind::diffuse) return LobeClass::diffuse;
    return class_of_uncommon_lobe();
  }

  /// Drops the lobes that reflect, that refract or both, mirrors included: what a walk meets after a diffuse surface
  /// where caustics are switched off (Cycles drops closures, not paths; so the rest is sampled as if they were not
  /// there).
  void drop_glossy(bool reflection, bool refraction);

  /// Some lobe is one that paths see as diffuse after a diffuse event (Lobe::diffuse_after_diffuse).
  bool has_subsurface_after_diffuse() const {
    for (const Lobe& lobe : lobes())
      if (lobe.diffuse_after_diffuse) return true;
    return false;
  }
  /// Makes those lobes diffuse.
  void drop_subsurface_after_diffuse();

  /// All non-delta lobes for one pair of unit world directions; zero for pairs that no lobe connects.
  BsdfEval eval(const Vec3& wi_world, const Vec3& wo_world, Transport transport,
                ReversePdf reverse = ReversePdf::yes) const;
  /// ... and its parts.
  BsdfEval eval(const Vec3& wi_world, const Vec3& wo_world, Transport transport, ReversePdf reverse,
                EvalParts& parts) const;
  /// ... of the lobes of one width alone; the densities are their part of those of all.
  BsdfEval eval(const Vec3& wi_world, const Vec3& wo_world, Transport transport, LobeWidth width,
                EvalParts* parts) const;
  /// Some lobe is narrow.
  bool has_narrow() const;
  /// Makes of a sample of a non-delta lobe one of the lobes of that one's width alone, which with that of the others is
  /// worth what it was.
  /// @param parts null, or takes the parts of what is evaluated, `picked` kept
  LobeWidth keep_width(const Vec3& wi_world, Transport transport, BsdfSample& sample, EvalParts* parts) const;
  /// Picks a lobe by its share of the albedo and samples it; the weight covers all lobes that share wo.
  /// @param u_choice in [0, 1): what the lobe chooses by itself (glass, between its sides)  @param u in [0, 1)²: which
  /// lobe and where to. Fails (event k_scatter_none) if there are no lobes or the sample is absorbed.
  BsdfSample sample(const Vec3& wi_world, float u_choice, const Vec2& u, Transport transport,
                    ReversePdf reverse = ReversePdf::yes) const;
  /// ... and the parts of what it evaluated.
  BsdfSample sample(const Vec3& wi_world, float u_choice, const Vec2& u, Transport transport, ReversePdf reverse,
                    EvalParts& parts) const;

  /// Value and probabilities of delta lobe number `lobe` (of BsdfSample::lobe, perhaps of the same surface seen from
  /// another direction) for the pair of directions that it connects: f·cos of both ends' delta as sample() weighs it
  /// (f_cos = weight · probability), probabilities instead of densities. Zero if that lobe is not there or not delta.
  BsdfEval eval_delta(int lobe, const Vec3& wi_world, const Vec3& wo_world, Transport transport) const;

  /// Of eval()'s pdf_solid_angle for a pair: what part diffuse, glossy and transmitting lobes have. For limits by kind.
  EventShares event_shares(const Vec3& wi_world, const Vec3& wo_world, LobeWidth width = LobeWidth::any) const;

  /// Of eval()'s f_cos for a pair: what part each class of lobes has, all to glossy where f is 0. For passes.
  ClassShares class_shares(const Vec3& wi_world, const Vec3& wo_world, Transport transport) const;
  /// Estimates of the directional albedo of each class of lobes towards wi, without what is transparent.
  ClassAlbedos class_albedos(const Vec3& wi_world) const;
  /// The class, and the event, that all lobes but deltas have for a pair, told without evaluating them; none if they
  /// have different ones or there are none.
  std::optional<LobeClass> only_class(const Vec3& wi_world, const Vec3& wo_world) const;
  std::optional<uint8_t> only_event(const Vec3& wi_world, const Vec3& wo_world) const;

  /// Of one lobe alone, told without evaluating it.
  const LobeFacts& facts_of_only_lobe(const Vec3& wi_world, const Vec3& wo_world) const {
    const std::array<LobeFacts, 2>& facts = k_lobe_facts[static_cast<size_t>(lobes_[0].kind)];
    return facts[facts[0].by_side && dot(lobes_[0].n, wi_world) * dot(lobes_[0].n, wo_world) < 0.0f];
  }

  /// A lobe has a density, so that next-event estimation is worth a ray.
  bool has_non_delta() const { return has_non_delta_; }
  /// Some lobe scatters or transmits.
  bool empty() const { return count_ == 0; }
  /// Weight of going straight on, unscattered.
  Color transparency() const { return transparency_; }
  /// Share that is a hole in the picture where the camera sees it, and black to other rays.
  Color holdout() const { return holdout_; }
  /// Radiance emitted towards wi.
  Color emission() const { return emission_; }
  /// Estimate of the directional albedo towards wi, transparency included: for roulette and passes.
  Color albedo(const Vec3& wi_world) const {
    // The commonest surface.
    if (count_ == 1 && lobes_[0].kind == LobeKind::diffuse) return lobes_[0].weight;
    return albedo_of_several(wi_world);
  }
  /// ... that of each of lobes(). Valid until the next call with another wi.
  const Color* lobe_albedos(const Vec3& wi_world) const {
    const Shares& known = shares(wi_world);
    if (!known.albedos_known) fill_albedo_of_only_lobe();
    return known.albedo;
  }

  std::span<const Lobe> lobes() const { return {lobes_, static_cast<size_t>(count_)}; }

 private:
  template <bool wants_parts, bool by_width = false>
  BsdfEval eval_lobes(const Vec3& wi_world, const Vec3& wo_world, Transport transport, ReversePdf reverse,
                      EvalParts* parts, LobeWidth width = LobeWidth::any) const;
  template <bool wants_parts>
  BsdfSample sample_lobes(const Vec3& wi_world, float u_choice, const Vec2& u, Transport transport, ReversePdf reverse,
                          EvalParts* parts) const;
  template <typename KindOf>
  auto only(const Vec3& wi_world, const Vec3& wo_world, KindOf&& kind_of) const;
  /// What each lobe gets of the samples seen from wi, not normalised. A walk asks for one wi several times: that of the
  /// last call is kept.
  struct Shares {
    float of[k_max_lobes];
    float total;
    Color albedo[k_max_lobes];  ///< weight included
    bool albedos_known;         ///< one lobe alone needs none to be picked
  };
  const Shares& shares(const Vec3& wi_world) const {
    if (wi_world != shares_wi_world_) fill_shares(wi_world);
    return shares_;
  }
  void fill_shares(const Vec3& wi_world) const;
  void share_out() const;
  void fill_albedo_of_only_lobe() const;
  Color albedo_of_several(const Vec3& wi_world) const;
  std::optional<LobeClass> class_of_uncommon_lobe() const;

  union {  // suppresses construction of the array
    Lobe lobes_[k_max_lobes];
  };
  int count_ = 0;
  bool has_non_delta_ = false;
  float least_share_ = 0.0f;
  Vec3 ng_world_{0, 0, 1}, ns_world_{0, 0, 1};
  BumpShadowing bump_shadowing_ = BumpShadowing::cubic;
  Color transparency_{0.0f}, emission_{0.0f}, holdout_{0.0f};
  mutable Shares shares_;
  mutable Vec3 shares_wi_world_{0.0f};  ///< that shares_ belong to; zero: none
};

}  // namespace lambent
