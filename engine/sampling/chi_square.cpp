#include "engine/sampling/chi_square.h"

#include <cmath>

namespace lambent {

double chi_square_p_value(double statistic, int degrees) {
  const double a = 0.5 * degrees, x = 0.5 * statistic;
  if (degrees <= 0 || !(x > 0.0)) return 1.0;
  const double scale = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1.0) {
    double term = 1.0 / a, sum = term;
    for (int n = 1; n < 10000 && term > sum * 1e-15; ++n) {
      term *= x / (a + n);
      sum += term;
    }
    return std::max(1.0 - sum * scale, 0.0);
  }
  // Lentz's evaluation of the continued fraction.
  double b = x + 1.0 - a, c = 1e300, d = 1.0 / b, fraction = d;
  for (int n = 1; n < 10000; ++n) {
    const double numerator = -n * (n - a);
    b += 2.0;
    d = 1.0 / (numerator * d + b);
    c = b + numerator / c;
    fraction *= c * d;
    if (std::fabs(c * d - 1.0) < 1e-14) break;
  }
  return fraction * scale;
}

ChiSquareResult chi_square_test(const std::vector<double>& observed, const std::vector<double>& expected) {
  ChiSquareResult result;
  double pooled_observed = 0.0, pooled_expected = 0.0;
  int cells = 0;
  for (size_t i = 0; i < expected.size(); ++i) {
    if (expected[i] < 5.0) {
      pooled_observed += observed[i];
      pooled_expected += expected[i];
      continue;
    }
    result.statistic += (observed[i] - expected[i]) * (observed[i] - expected[i]) / expected[i];
    ++cells;
  }
  if (pooled_expected > 0.0 || pooled_observed > 0.0) {
    // A pool that expects next to nothing must not divide by it; even so ten samples where none belong are rejected.
    const double divisor = std::max(pooled_expected, 1.0);
    result.statistic += (pooled_observed - pooled_expected) * (pooled_observed - pooled_expected) / divisor;
    ++cells;
  }
  result.degrees = std::max(cells - 1, 1);
  result.p_value = chi_square_p_value(result.statistic, result.degrees);
  return result;
}

double sidak_significance(int tests) { return 1.0 - std::pow(0.99, 1.0 / tests); }

}  // namespace lambent
