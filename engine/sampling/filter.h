// Pixel filters, by importance sampling: a pixel sample is displaced by an offset drawn from the filter, with weight 1.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/base/vec.h"

namespace lambent {

enum class FilterKind : uint8_t { box, gaussian, blackman_harris };

/// A separable, normalised, non-negative pixel filter. Immutable; 6 KiB of tables. sample() and density() agree
/// exactly: both are those of the table (1024 cells of equal probability on each side of the centre).
///
/// Shapes are those of Cycles (scene/film.cpp): box is 1 px wide whatever `width_px`, as in Blender; Gaussian is
/// exp(-8 (x / width)²), that is sigma = width / 4, cut off at 1.5 widths; Blackman-Harris is the four-term window
/// (Harris 1978) of radius `width`.
class PixelFilter {
 public:
  /// `width_px` > 0; other values (or NaN) give the box.
  explicit PixelFilter(FilterKind kind = FilterKind::box, float width_px = 1.0f);

  /// Offset in pixels from the pixel's centre, distributed by density(); `u` in [0, 1)².
  Vec2 sample(const Vec2& u) const { return {sample_axis(u.x), sample_axis(u.y)}; }

  /// Value of the filter at an offset from the pixel's centre: the pdf of sample(), px⁻². Integrates to 1. For splats.
  float density(const Vec2& offset_px) const { return density_axis(offset_px.x) * density_axis(offset_px.y); }
  /// One axis' factor of density(), px⁻¹.
  float density_axis(float offset_px) const {
    const float x = std::fabs(offset_px);
    if (!(x < radius_px_)) return 0.0f;
    size_t cell = cell_near_[static_cast<size_t>(x * k_cells / radius_px_)];
    while (cell + 1 < k_cells && inverse_cdf_[cell + 1] <= x) ++cell;
    return 0.5f / (k_cells * (inverse_cdf_[cell + 1] - inverse_cdf_[cell]));
  }

  /// Half width of the support along an axis, px.
  float radius_px() const { return radius_px_; }
  FilterKind kind() const { return kind_; }

 private:
  static constexpr int k_cells = 1024;

  float sample_axis(float u) const {
    const float signed_u = 2.0f * u - 1.0f;
    const float position = std::fabs(signed_u) * k_cells;
    const int cell = std::min(static_cast<int>(position), k_cells - 1);
    const float offset = lerp(inverse_cdf_[cell], inverse_cdf_[cell + 1], position - static_cast<float>(cell));
    return std::copysign(offset, signed_u);
  }
  FilterKind kind_;
  float radius_px_;
  std::vector<float> inverse_cdf_;   ///< k_cells + 1 offsets in [0, radius_px] of the half x >= 0
  std::vector<uint16_t> cell_near_;  ///< for equal steps of the offset, a cell at it or shortly before
};

}  // namespace lambent
