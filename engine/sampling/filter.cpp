#include "engine/sampling/filter.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lambent {

namespace {

/// Unnormalised filter value at x >= 0 px.
double shape(FilterKind kind, double width, double x) {
  switch (kind) {
    case FilterKind::gaussian:
      return std::exp(-8.0 * (x / width) * (x / width));
    case FilterKind::blackman_harris: {
      // The window spans 2 widths; its centre is at half a period.
      const double phase = 2.0 * std::numbers::pi * (x / (2.0 * width) + 0.5);
      return 0.35875 - 0.48829 * std::cos(phase) + 0.14128 * std::cos(2.0 * phase) - 0.01168 * std::cos(3.0 * phase);
    }
    case FilterKind::box:
      break;
  }
  return 1.0;
}

}  // namespace

PixelFilter::PixelFilter(FilterKind kind, float width_px)
    : kind_(width_px > 0.0f && std::isfinite(width_px) ? kind : FilterKind::box), inverse_cdf_(k_cells + 1) {
  switch (kind_) {
    case FilterKind::box:
      radius_px_ = 0.5f;
      break;
    case FilterKind::gaussian:
      radius_px_ = 1.5f * width_px;
      break;
    case FilterKind::blackman_harris:
      radius_px_ = width_px;
      break;
  }
  // CDF of the half x >= 0 by the midpoint rule, then inverted at equal steps.
  constexpr int k_steps = 1 << 16;
  std::vector<double> cdf(k_steps + 1, 0.0);
  const double step = static_cast<double>(radius_px_) / k_steps;
  for (int i = 0; i < k_steps; ++i)
    cdf[i + 1] = cdf[i] + std::max(shape(kind_, static_cast<double>(width_px), (i + 0.5) * step), 0.0);
  int i = 0;
  for (int cell = 0; cell < k_cells; ++cell) {
    const double target = cdf[k_steps] * cell / k_cells;
    while (cdf[i + 1] <= target) ++i;
    inverse_cdf_[cell] = static_cast<float>((i + (target - cdf[i]) / (cdf[i + 1] - cdf[i])) * step);
  }
  inverse_cdf_[k_cells] = radius_px_;
  for (int cell = 0, at = 0; at <= k_cells; ++at) {
    const float offset = radius_px_ * static_cast<float>(at) * (1.0f - 1e-6f) / k_cells;
    while (cell + 1 < k_cells && inverse_cdf_[cell + 1] <= offset) ++cell;
    cell_near_.push_back(static_cast<uint16_t>(cell));
  }
}

}  // namespace lambent
