// All lights of a scene: choosing one for a receiver, sampling it, hitting it, and the densities of all that, in both
// transport directions.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/report.h"
#include "engine/base/vec.h"
#include "engine/lights/emission_aim.h"
#include "engine/lights/environment.h"
#include "engine/lights/lamp.h"
#include "engine/lights/lamp_bvh.h"
#include "engine/lights/light.h"
#include "engine/lights/light_tree.h"
#include "engine/sampling/sampler.h"

namespace lambent {

/// What becomes of a world that looks alike from all sides, in the choice of lights.
enum class EvenWorld : uint8_t {
  sampled,            ///< it is a light among the others
  left_to_scattering  ///< it is never chosen: for receivers whose scattered rays count it when they meet it
};

/// What a receiver chooses among.
struct LightChoices {
  EvenWorld even_world = EvenWorld::sampled;
  uint8_t linked = 0;  ///< number that LightSetBuilder::add_receivers returned; 0: all lights

  LightChoices(EvenWorld world = EvenWorld::sampled, uint8_t receivers = 0) : even_world(world), linked(receivers) {}
};

/// Immutable once threads share it.
///
/// Selection. Finite lights hang in a light tree; each infinite light (sun, environment) stands beside it. A receiver
/// first chooses between these groups, half uniformly and half by estimated irradiance, then within the tree by
/// importance. Every light that can contribute to the receiver has a positive probability, and it can be asked for any
/// light and receiver (pdf_solid_angle, prob_selection). All of it is invariant under scaling of scene and powers.
///
/// An even world (Environment::is_even) is met by scattered rays as well as anything could choose a direction to it.
/// Receivers whose scattered rays count what they meet leave it to them: every choice then goes to the other lights.
///
/// Light linking. Receivers that some lights do not reach may choose among the others alone, by a tree of theirs
/// (LightSetBuilder::add_receivers). Whoever chooses among all lights finds those that do not reach it by itself.
///
/// Receivers. `n` is the surface normal on the side that is lit; pass zero if light from every side matters (volumes,
/// transmitting surfaces). The same (p, n) must be given for a sample and for the pdf it is weighed against.
class LightSet {
 public:
  /// No lights at all.
  LightSet();
  ~LightSet();

  /// True if sample() never finds anything.
  bool empty(EvenWorld even_world = EvenWorld::sampled) const {
    return tree_.empty() && infinite_count(even_world) == 0;
  }
  /// Number of lights that can be sampled (power not zero, not degenerate).
  size_t sampled_lights() const { return sampled_; }
  size_t triangle_count() const { return triangles_.size(); }
  bool has_infinite_lights() const { return !infinite_.empty(); }
  /// Whether sample_emission() may choose an infinite light.
  bool emits_from_afar() const { return !emission_cdf_.empty() && emission_cdf_.back() > emission_cdf_.front(); }
  /// The world is a light that EvenWorld::left_to_scattering leaves out.
  bool has_even_world() const { return has_even_world_; }
  /// True if intersect() can ever find anything: lamps with a size.
  bool has_visible_lamps() const { return !lamp_bvh_.empty(); }
  size_t bytes() const;

  // --- Light as seen from a receiver

  /// Chooses a light and a point on it by `u` in [0, 1)². O(log lights).
  LightSample sample(const Vec3& p_world, const Vec3& n_world, const Vec2& u, LightChoices choices = {}) const;

  /// Density of sample(p, n) (selection included, sr⁻¹) at the point of `light` that a ray from p along `direction`
  /// (unit) meets at `distance_m` with parameters `uv` (LightSample's; triangles need them). 0 for delta lights, for
  /// k_no_light, and where sample() cannot get.
  float pdf_solid_angle(const Vec3& p_world, const Vec3& n_world, LightIndex light, const Vec3& direction_world,
                        float distance_m, const Vec2& uv, LightChoices choices = {}) const;
  float pdf_solid_angle(const Vec3& p_world, const Vec3& n_world, const LightHit& hit) const {
    return pdf_solid_angle(p_world, n_world, hit.light, hit.direction_world, hit.distance_m, hit.uv);
  }
  /// Probability that sample(p, n) chooses `light`.
  float prob_selection(const Vec3& p_world, const Vec3& n_world, LightIndex light, LightChoices choices = {}) const;

  // --- Lights as things that rays hit

  /// Calls visit(const LightHit&) for every lamp with a size that the ray meets in (t_min, t_max) on its emitting side,
  /// in no particular order. As in Cycles, lamps do not block light: a ray that ends on a surface (or leaves the scene)
  /// collects all lamps before it. Arguments as for intersect().
  template <typename Visit>
  void for_each_lamp(const Vec3& origin_world, const Vec3& direction_world, float t_min, float t_max,
                     uint32_t ray_kinds, Visit&& visit) const {
    lamp_bvh_.traverse(lamps_, origin_world, direction_world, t_min, t_max, ray_kinds, [&](const LightHit& hit) {
      visit(hit);
      return t_max;
    });
  }

  /// Nearest lamp with a size that the ray meets in (t_min, t_max) on its emitting side. `ray_kinds`: the ray's bits,
  /// see LightTraits::hidden_from. Point and spot lamps are disks that face `origin` (as in Cycles 3.4), so pass the
  /// path vertex as origin also when going on behind a transparent surface. O(log lamps).
  LightHit intersect(const Vec3& origin_world, const Vec3& direction_world, float t_min, float t_max,
                     uint32_t ray_kinds) const;

  /// Calls visit(const LightHit&) for the environment and for every sun disk that a ray which leaves the scene along
  /// `direction` meets; their radiances add. An environment with traits.program leaves its radiance to the caller.
  template <typename Visit>
  void for_each_infinite(const Vec3& direction_world, uint32_t ray_kinds, Visit&& visit) const {
    for (const LightIndex light : infinite_) {
      const LightHit hit = infinite_hit(light, direction_world, ray_kinds);
      if (hit) visit(hit);
    }
  }

  /// Light of an emissive triangle given the caller's numbers; k_no_light if it is not sampled (unknown, no area,
  /// black).
  LightIndex find_triangle(uint32_t instance, uint32_t triangle) const;

  // --- Light as seen from the lights

  /// Chooses a light by power and a position on it by `u_emitter`, and a direction by `u_direction`, both in [0, 1)²;
  /// with an aim, a share of them as EmissionAim says.
  EmissionSample sample_emission(const Vec2& u_emitter, const Vec2& u_direction,
                                 const EmissionAim* aim = nullptr) const;

  /// Densities of sample_emission for the ray that leaves `light` along `direction_from_light` (unit). For triangles
  /// and area lamps `n_light` is the normal of the side that emits. `p_ray`: where the ray leaves finite lights, any
  /// point of it for infinite ones.
  EmissionPdf pdf_emission(LightIndex light, const Vec3& n_light_world, const Vec3& direction_from_light_world,
                           const Vec3& p_ray_world, const EmissionAim* aim = nullptr) const;

  // --- Facts about a light

  LightKind kind(LightIndex light) const;
  /// Sun or environment.
  bool is_infinite(LightIndex light) const;
  /// Cannot be hit: point and spot without radius, sun without angle.
  bool is_delta(LightIndex light) const;
  const LightTraits& traits(LightIndex light) const;
  /// Centre and radius of the sphere around the scene, as given to the builder.
  const Vec3& scene_center() const { return scene_center_; }
  float scene_radius() const { return scene_radius_; }
  /// Estimate of all light's flux into the scene, W, by magnitude of luminance; 0 without lights.
  double flux() const { return flux_; }
  const LightTree& tree() const { return tree_; }

  /// Multiplies how strongly receivers choose each finite light (by its number; factors > 0), emission apart. Before
  /// threads share the set.
  void scale_importance(std::span<const float> factors);

 private:
  friend class LightSetBuilder;

  /// 48 bytes.
  struct Triangle {
    Vec3 a{0.0f}, edge_b{0.0f}, edge_c{0.0f};
    uint32_t emission = 0, instance = 0, triangle = 0;
  };
  /// Where an instance's triangles are found: table_[offset + triangle - first], for `count` numbers.
  struct InstanceRange {
    uint32_t first = 0, count = 0;
    size_t offset = 0;
  };
  struct Selection {
    LightIndex light = k_no_light;
    float prob = 0.0f;
  };
  struct Groups;
  static constexpr float k_largest_importance = 1e30f;

  /// The world is a light that is never chosen.
  bool leaves_world(EvenWorld even_world) const {
    return has_even_world_ && even_world == EvenWorld::left_to_scattering;
  }
  /// Infinite lights that may be chosen.
  size_t infinite_count(EvenWorld even_world) const {
    return infinite_sampled_.size() - (leaves_world(even_world) ? 1 : 0);
  }
  /// The lights that reach some receivers, as tree_, infinite_sampled_ and infinite_irradiance_ are all lights.
  struct Pool {
    LightTree tree;
    std::vector<LightIndex> infinite;
    std::vector<float> irradiance;
  };
  struct PoolView {
    const LightTree& tree;
    const std::vector<LightIndex>& infinite;
    const std::vector<float>& irradiance;
  };
  PoolView pool_of(LightChoices choices) const {
    if (choices.linked == 0) return {tree_, infinite_sampled_, infinite_irradiance_};
    const Pool& pool = pools_[choices.linked - 1];
    return {pool.tree, pool.infinite, pool.irradiance};
  }
  bool is_triangle(LightIndex light) const { return light >= first_triangle_ && light < environment_; }
  // The tree's emitters have the lights' own numbers.
  static LightIndex light_of_emitter(uint32_t emitter) { return emitter; }
  static uint32_t emitter_of_light(LightIndex light) { return light; }
  Groups weigh_groups(const PoolView& pool, const Vec3& p, const Vec3& n, EvenWorld even_world) const;
  Selection select(const Vec3& p, const Vec3& n, ReusedNumber& u, LightChoices choices) const;
  float infinite_importance(const PoolView& pool, size_t i, const Vec3& n, EvenWorld even_world) const;
  float prob_emission(LightIndex light) const;
  EmissionPdf pdf_on_light(LightIndex light, const Vec3& n_light, const Vec3& direction) const;
  struct Emitter {
    LightIndex light = k_no_light;
    float prob = 0.0f;                       ///< by power
    const EmissionTarget* target = nullptr;  ///< null: not aimed
  };
  Emitter select_emitter(ReusedNumber& u, const EmissionAim* aim) const;
  void add_aimed(LightIndex light, const Vec3& direction, const Vec3& p_ray, const EmissionAim& aim,
                 EmissionPdf& pdf) const;
  LightHit infinite_hit(LightIndex light, const Vec3& direction, uint32_t ray_kinds) const;
  bool sample_triangle_light(const Vec3& p, const Vec2& u, LightSample& sample) const;
  float pdf_solid_angle_on_light(const Vec3& p, const Vec3& n, LightIndex light, const Vec3& direction, float distance,
                                 const Vec2& uv) const;

  std::vector<Lamp> lamps_;
  std::vector<Triangle> triangles_;
  std::vector<SurfaceEmission> emissions_;
  std::vector<InstanceRange> instances_;
  std::vector<uint32_t> table_;
  std::unique_ptr<Environment> environment_light_;
  LightTree tree_;
  LampBvh lamp_bvh_;
  LightIndex first_triangle_ = 0, environment_ = 0;
  std::vector<LightIndex> infinite_;          ///< that rays can meet
  std::vector<LightIndex> infinite_sampled_;  ///< that sample() can choose
  std::vector<float> infinite_irradiance_;    ///< relative to the tree's intensities, by infinite_sampled_
  std::vector<Pool> pools_;                   ///< by LightChoices::linked - 1
  std::vector<float> emission_cdf_;           ///< by group: the tree, then infinite_sampled_
  double flux_ = 0.0;
  Vec3 scene_center_{0.0f};
  float scene_radius_ = 0.0f;
  size_t sampled_ = 0;
  bool has_even_world_ = false;
};

/// Collects lights; build() makes the set. Not thread-safe.
class LightSetBuilder {
 public:
  LightSetBuilder();
  ~LightSetBuilder();

  /// Box around everything that light can reach: needed by infinite lights for emission. Empty: a unit sphere at 0.
  void set_scene_bounds(const Bounds3& bounds);
  /// Adds a lamp and returns its LightIndex. Lamps with values that define no light are kept out of sampling and
  /// reported by build().
  LightIndex add(AnalyticLight light);
  /// Adds an emission that triangles refer to, and returns its number.
  uint32_t add_emission(SurfaceEmission emission);
  /// Adds the emissive triangles of an instance (once an instance; the caller's instance numbers should be dense).
  /// `name` is for messages.
  void add_mesh(uint32_t instance, std::string name, std::vector<EmissiveTriangle> triangles);
  /// Receivers that are in these sets of receivers (bit number - 1 of LinkSets) and in no other: makes a tree of the
  /// lights that reach them, and returns the number for LightChoices::linked; 0 where there are too many such.
  uint8_t add_receivers(uint64_t sets);
  /// The world; at most one (the last).
  void set_environment(EnvironmentLight environment);

  /// Builds in parallel (1,000,000 triangles in under a second on two cores). Reports, by name, lamps that are not
  /// valid and how many triangles were left out for having no area or no finite vertices. Empties the builder.
  std::shared_ptr<LightSet> build(Report& report);

 private:
  struct Mesh {
    uint32_t instance;
    std::string name;
    std::vector<EmissiveTriangle> triangles;
  };
  std::vector<AnalyticLight> lamps_;
  std::vector<SurfaceEmission> emissions_;
  std::vector<Mesh> meshes_;
  std::vector<uint64_t> receivers_;
  std::unique_ptr<EnvironmentLight> environment_;
  Bounds3 bounds_;
};

}  // namespace lambent
