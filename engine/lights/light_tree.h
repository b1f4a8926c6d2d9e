// A light tree (Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting"; the
// importance of a cluster after pbrt-v4, LightBounds): chooses one of many finite lights with a probability that
// follows its estimated irradiance at the receiver. Four-wide, so that one pass over a node weighs four clusters.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/base/vec.h"
#include "engine/sampling/sampler.h"

namespace lambent {

/// Bounds of some emitters: where they are, where they shine, how strongly.
struct LightCluster {
  Vec3 center{0.0f};  ///< of a sphere around all of them
  float radius = 0.0f;
  Vec3 axis{0, 0, 1};      ///< of a cone around all normals
  float cos_normals = 1;   ///< of that cone's half angle (-1: all directions)
  float cos_emission = 0;  ///< of the angle from a normal beyond which nothing is emitted, in [0, pi/2]: >= 0
  bool two_sided = false;  ///< shines along normals and against them
  double intensity = 0;    ///< sum of the largest intensities, W/sr (luminance, absolute)
};

/// Immutable. About 55 bytes an emitter (nodes of 128 bytes for four children, and a path of 4 bytes an emitter).
///
/// Invariant: a light whose importance is not provably zero at a receiver has a positive probability there. A single
/// light is chosen without being weighed.
class LightTree {
 public:
  LightTree() = default;
  /// Of emitters 0..n-1; those without positive intensity are left out. Fewer than 2^30. Parallel; the same tree
  /// whatever the number of threads.
  explicit LightTree(std::span<const LightCluster> emitters);

  bool empty() const { return nodes_.empty(); }
  size_t size() const { return size_; }
  size_t bytes() const;
  /// What importances are divided by: the largest intensity of a cluster. Importances are irradiances over this.
  double intensity_unit() const { return unit_; }
  /// Depth of the deepest emitter, in nodes.
  int depth() const { return depth_; }
  /// Emitters in the order of the tree's leaves: neighbours are close.
  std::vector<uint32_t> leaf_order() const;

  /// Multiplies the importance of every emitter that has a factor (> 0, by its number); what sample_by_intensity
  /// chooses stays as it is.
  void scale_importance(std::span<const float> factors);

  /// Gives emitters new numbers below `count`: emitter i becomes new_number[i].
  void renumber(std::span<const uint32_t> new_number, uint32_t count);

  struct Choice {
    uint32_t emitter = 0;
    float prob = 0.0f;  ///< 0: nothing contributes
  };
  /// Estimated irradiance of all emitters on a receiver with normal n (zero: facing every light), in intensity units /
  /// m².
  float importance(const Vec3& p, const Vec3& n) const;
  /// Chooses an emitter by `u`, of which it leaves what serves again.
  Choice sample(const Vec3& p, const Vec3& n, ReusedNumber& u) const;
  /// Probability of sample(p, n) choosing `emitter`. Equal to the probability that sample() returned.
  float prob(const Vec3& p, const Vec3& n, uint32_t emitter) const;
  /// Chooses an emitter by intensity, whatever the receiver.
  Choice sample_by_intensity(ReusedNumber& u) const;
  float prob_by_intensity(uint32_t emitter) const;

 private:
  static constexpr uint32_t k_leaf = 0x80000000u;
  static constexpr uint32_t k_none = 0xffffffffu;
  static constexpr int k_width = 4;

  /// Four children, structure of arrays. Unused children have intensity 0.
  struct alignas(64) Node {
    float x[k_width] = {}, y[k_width] = {}, z[k_width] = {};
    uint32_t child[k_width] = {k_none, k_none, k_none, k_none};  ///< node, or emitter | k_leaf
    uint16_t radius[k_width] = {};                               ///< upper half of a float, rounded up
    uint16_t intensity[k_width] = {};                            ///< upper half of a float, in units
    uint16_t importance[k_width] = {};                           ///< intensity times scale_importance's factors
    int16_t axis[3][k_width] = {};                               ///< times 32767
    int16_t cos_normals[k_width] = {};                           ///< times 32767, rounded down
    int16_t cos_emission[k_width] = {};  ///< times 32767, rounded down; two-sided: -1 minus that
  };
  friend class LightTreeBuilder;

  void weigh(const Node& node, const Vec3& p, const Vec3& n, float out[k_width]) const;

  std::vector<Node> nodes_;
  std::vector<uint32_t> path_;  ///< by emitter: two bits a level, the root's lowest
  double unit_ = 1.0;
  float min_distance_squared_ = 0.0f;
  size_t size_ = 0;
  int depth_ = 0;
};

}  // namespace lambent
