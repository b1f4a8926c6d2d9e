// Piecewise-constant distributions in one and two dimensions.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/base/vec.h"

namespace lambent {

/// Discrete and piecewise-constant distribution over [0, 1) with n equal cells, by inverted CDF (monotonic: keeps
/// stratification and can be inverted). Weights that are negative or not finite count as 0; if all are 0, or there are
/// none, the distribution is uniform. Weights of any scale from 0 to 1e38. 4 bytes a cell. Densities are those of the
/// stored float CDF, so that sample and pdf agree exactly; a cell below about 6e-8 of the sum may have none.
class Distribution1D {
 public:
  Distribution1D() : Distribution1D(std::span<const float>()) {}
  explicit Distribution1D(std::span<const float> weights);

  /// Sum of the valid weights divided by their number (the integral over [0, 1)); 0 if the distribution fell back to
  /// uniform.
  double integral() const { return integral_; }
  int size() const { return static_cast<int>(cdf_.size()) - 1; }

  struct Sample {
    float x = 0.0f;         ///< in [0, 1)
    int cell = 0;           ///< in [0, size)
    float remapped = 0.0f;  ///< position within the cell, [0, 1): a fresh uniform number
    float pdf = 0.0f;       ///< density over [0, 1)
  };
  /// O(log n).
  Sample sample(float u) const;
  /// Density over [0, 1) at x; 0 outside.
  float pdf(float x) const;
  /// Discrete probability of a cell.
  float prob(int cell) const { return cdf_[cell + 1] - cdf_[cell]; }
  /// The u for which sample(u).x == x (up to rounding).
  float invert(float x) const;

 private:
  std::vector<float> cdf_;  ///< n + 1, from 0 to 1
  double integral_ = 0.0;
};

/// Piecewise-constant distribution over [0, 1)² with width x height equal cells: marginal in v, conditional in u.
/// Weights as for Distribution1D. 4 bytes a cell.
class Distribution2D {
 public:
  Distribution2D() : Distribution2D({}, 0, 0) {}
  /// `weights`: float[height][width]. Fewer values than width x height, or a size below 1: uniform.
  Distribution2D(std::span<const float> weights, int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }
  /// Integral of the weights over [0, 1)²; 0 if it fell back to uniform.
  double integral() const { return integral_; }
  size_t bytes() const;

  /// Point in [0, 1)² for a uniform `u`; `pdf` (density over the unit square) if not null. O(log width + log height).
  Vec2 sample(const Vec2& u, float* pdf) const;
  /// Density over the unit square at `uv`; 0 outside.
  float pdf(const Vec2& uv) const;
  /// The u for which sample(u) == uv (up to rounding).
  Vec2 invert(const Vec2& uv) const;

 private:
  int width_ = 1, height_ = 1;
  double integral_ = 0.0;
  Distribution1D marginal_;
  std::vector<float> rows_;  ///< float[height][width + 1], CDF of each row
};

}  // namespace lambent
