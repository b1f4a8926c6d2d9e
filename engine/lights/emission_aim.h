// Where light is wanted: spheres at which a share of all walks from lights is aimed.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "engine/base/vec.h"
#include "engine/lights/light.h"
#include "engine/lights/light_tree_lanes.h"
#include "engine/sampling/sampler.h"

namespace lambent {

/// A walk that was of use: from which light, where it first arrived, and how much it was worth.
struct EmissionArrival {
  LightIndex light = k_no_light;
  bool infinite = false;  ///< sun, environment
  Vec3 p_world{0.0f};
  float worth = 0.0f;
};

/// A sphere that rays are sent to.
struct EmissionTarget {
  Vec3 center_world{0.0f};
  float radius_m = 0.0f;

  /// A point on the disk across the unit vector `direction`, uniformly: where a ray of an infinite light passes.
  Vec3 sample_line(const Vec3& direction, const Vec2& u) const;
  /// Unit direction from p_world into the sphere's cone, uniformly; from within the sphere, anywhere.
  Vec3 sample_direction(const Vec3& p_world, const Vec2& u) const;
};

/// Targets with a probability for each and each light. Lights by whose arrivals much was won have a row of
/// probabilities of their own; all finite lights together have one for the rest. Immutable once built; threads share
/// it.
///
/// What LightSet does with it: with probability k_share it chooses a row and a target, and from infinite lights sends a
/// ray, its direction chosen as ever, through the target's disk; from finite ones, the position chosen as ever, into
/// the target's cone. Densities are those of the mixture, so any aim is right; a good one has less noise.
class EmissionAim {
 public:
  static constexpr float k_share = 0.5f;
  static constexpr int k_most_targets = 32, k_most_rows = 16;

  /// No targets.
  EmissionAim() = default;
  /// Targets around what was of use, more and smaller ones where that pays. Arrivals without worth are left out.
  /// @param least_radius_m of a target: what rounding stays below
  EmissionAim(std::span<const EmissionArrival> arrivals, float least_radius_m);

  bool empty() const { return targets_.empty(); }
  const std::vector<EmissionTarget>& targets() const { return targets_; }

  /// Row of a light; row_of_rest() for finite ones without their own, which is for all finite ones.
  static constexpr int k_no_row = -1;
  int row_of(LightIndex light) const;
  int row_of_rest() const { return rest_; }
  /// Light of a row; k_no_light: any finite one.
  LightIndex light_of(int row) const { return lights_[static_cast<size_t>(row)]; }
  /// Probability of a row.
  float prob(int row) const { return prob_rows_[static_cast<size_t>(row)]; }

  struct Choice {
    int row = 0;
    const EmissionTarget* target = nullptr;
  };
  Choice choose(ReusedNumber& u) const;

  /// Sums over a row's targets of probability times density: of the line through p_world (per area across it), and of
  /// the direction given the origin (per solid angle).
  float density_of_line(int row, const Vec3& p_world, const Vec3& direction) const;
  float density_of_direction(int row, const Vec3& origin_world, const Vec3& direction) const;

 private:
  /// Four targets at a time.
  struct Block {
    Lanes x, y, z, radius_squared;  ///< radius_squared -1: no target
  };
  /// What densities ask of a block: which of its targets a ray is sent to, and how far away squared their centres are.
  struct Aimed;
  static Aimed aimed(const Block& block, const Vec3& p, const Vec3& direction);

  std::vector<EmissionTarget> targets_;
  std::vector<Block> blocks_;
  std::vector<Lanes> prob_blocks_;  ///< of row x block
  std::vector<LightIndex> lights_;  ///< by row
  std::vector<float> prob_rows_;
  std::vector<double> cdf_;  ///< of row x target
  int rest_ = k_no_row;
};

}  // namespace lambent
