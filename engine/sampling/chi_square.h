// Pearson's chi-square test of samplers against their densities: for unit tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/base/vec.h"
#include "engine/sampling/sampler.h"

namespace lambent {

/// Probability that a chi-square variable with `degrees` degrees of freedom exceeds `statistic` (regularised upper
/// incomplete gamma function by series or continued fraction; Abramowitz & Stegun 6.5.29, 6.5.31).
double chi_square_p_value(double statistic, int degrees);

/// Result of a test. A correct sampler gives p_value < x with probability x.
struct ChiSquareResult {
  double p_value = 0.0;
  double statistic = 0.0;
  int degrees = 0;
  double total_probability = 0.0;  ///< integral of the density over the domain
};

/// Compares counts with expected counts, cell by cell. Cells that expect fewer than 5 are pooled, those where
/// nothing is expected included.
ChiSquareResult chi_square_test(const std::vector<double>& observed, const std::vector<double>& expected);

/// Significance for each of `tests` tests so that all of them together reject wrongly with probability 0.01 (Šidák
/// 1967).
double sidak_significance(int tests);

/// Integral of `density(Vec2 position)` over the rectangle [low, low + size) by the midpoint rule: of 32² points, then
/// of four times as many until that changes it by less than `tolerance(integral)`, or there are `most_steps`².
template <typename Density, typename Tolerance>
double midpoint_integral(const Imath::V2d& low, const Imath::V2d& size, Density&& density, int most_steps,
                         Tolerance&& tolerance) {
  double before = std::numeric_limits<double>::infinity();
  for (int steps = std::min(32, most_steps);; steps = std::min(2 * steps, most_steps)) {
    double sum = 0.0;
    for (int i = 0; i < steps; ++i)
      for (int j = 0; j < steps; ++j)
        sum += static_cast<double>(density(Vec2(static_cast<float>(low.x + (i + 0.5) / steps * size.x),
                                                static_cast<float>(low.y + (j + 0.5) / steps * size.y))));
    const double integral = sum * size.x * size.y / (static_cast<double>(steps) * steps);
    if (steps == most_steps || std::fabs(integral - before) <= tolerance(integral)) return integral;
    before = integral;
  }
}

/// Tests a sampler over the rectangle [low, high): draws `count` samples with `sample(Vec2 u) -> Vec2 position`
/// (positions outside count as failures to sample and are ignored) and compares them in 10 x 20 cells with
/// `density(Vec2 position)`, integrated with at most `steps`² points a cell and no more than until four times as many
/// change a cell by less than a twentieth of its standard error. The density need not integrate to 1: it must integrate
/// to the probability of sampling anything.
template <typename Sample, typename Density>
ChiSquareResult chi_square_test_2d(const Vec2& low, const Vec2& high, Sample&& sample, Density&& density,
                                   int steps = 32, int count = 1'000'000, uint64_t seed = 1) {
  constexpr int k_rows = 10, k_columns = 20;
  std::vector<double> observed(k_rows * k_columns, 0.0), expected(k_rows * k_columns, 0.0);
  RandomStream random(seed);
  const Vec2 size = high - low;
  for (int i = 0; i < count; ++i) {
    const Vec2 p = sample(random.next_2d());
    const float x = (p.x - low.x) / size.x, y = (p.y - low.y) / size.y;
    if (!(x >= 0.0f && x <= 1.0f && y >= 0.0f && y <= 1.0f)) continue;
    const int row = std::min(static_cast<int>(x * k_rows), k_rows - 1);
    const int column = std::min(static_cast<int>(y * k_columns), k_columns - 1);
    observed[static_cast<size_t>(row * k_columns + column)] += 1.0;
  }
  double total = 0.0;
  const Imath::V2d cell(static_cast<double>(size.x) / k_rows, static_cast<double>(size.y) / k_columns);
  const auto twentieth_of_standard_error = [&](double probability) { return 0.05 * std::sqrt(probability / count); };
  for (int row = 0; row < k_rows; ++row)
    for (int column = 0; column < k_columns; ++column) {
      const Imath::V2d corner(static_cast<double>(low.x) + row * cell.x, static_cast<double>(low.y) + column * cell.y);
      const double probability = midpoint_integral(corner, cell, density, steps, twentieth_of_standard_error);
      total += probability;
      expected[static_cast<size_t>(row * k_columns + column)] = probability * count;
    }
  ChiSquareResult result = chi_square_test(observed, expected);
  result.total_probability = total;
  return result;
}

/// Position of a unit direction in (z, phi) with phi in [-pi, pi): a domain where solid angle is area, for
/// chi_square_test_2d over [(-1, -pi), (1, pi)).
inline Vec2 cylinder_of_direction(const Vec3& w) { return {w.z, std::atan2(w.y, w.x)}; }
inline Vec3 direction_of_cylinder(const Vec2& p) {
  const float r = safe_sqrt(1.0f - p.x * p.x);
  return {r * std::cos(p.y), r * std::sin(p.y), p.x};
}

}  // namespace lambent
