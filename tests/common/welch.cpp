#include "tests/common/welch.h"

#include <cmath>

namespace lambent::test {

namespace {

/// Regularised incomplete beta function for x < (a + 1) / (a + b + 2), by Lentz's method.
double beta_fraction(double a, double b, double x) {
  constexpr double k_tiny = 1e-300;
  double c = 1.0, d = 1.0 - (a + b) * x / (a + 1.0);
  d = 1.0 / (std::fabs(d) < k_tiny ? k_tiny : d);
  double fraction = d;
  for (int m = 1; m < 500; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    double step = 1.0;
    for (const double term : {even, odd}) {
      d = 1.0 + term * d;
      d = 1.0 / (std::fabs(d) < k_tiny ? k_tiny : d);
      c = 1.0 + term / c;
      if (std::fabs(c) < k_tiny) c = k_tiny;
      step = c * d;
      fraction *= step;
    }
    if (std::fabs(step - 1.0) < 1e-14) break;
  }
  const double front =
      std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log1p(-x));
  return front * fraction / a;
}

struct Moments {
  double mean = 0.0, variance_of_mean = 0.0;
};

Moments moments(std::span<const double> values) {
  const double n = static_cast<double>(values.size());
  Moments result;
  for (const double v : values) result.mean += v / n;
  double squares = 0.0;
  for (const double v : values) squares += (v - result.mean) * (v - result.mean);
  result.variance_of_mean = squares / (n * (n - 1.0));
  return result;
}

}  // namespace

double student_p_value(double t, double degrees) {
  if (!std::isfinite(t)) return 0.0;
  const double x = degrees / (degrees + t * t);  // p = I_x(degrees / 2, 1 / 2)
  if (x >= 1.0) return 1.0;
  const double a = 0.5 * degrees, b = 0.5;
  if (x < (a + 1.0) / (a + b + 2.0)) return beta_fraction(a, b, x);
  return 1.0 - beta_fraction(b, a, 1.0 - x);
}

WelchResult welch_test(std::span<const double> a, std::span<const double> b, double rounding) {
  const Moments first = moments(a), second = moments(b);
  WelchResult result;
  result.difference = first.mean - second.mean;
  const double variance = first.variance_of_mean + second.variance_of_mean;
  result.standard_error = std::sqrt(variance);
  if (std::fabs(result.difference) <= rounding) return result;
  if (!(variance > 0.0)) {
    result.p_value = 0.0;
    return result;
  }
  const double degrees = variance * variance /
                         (first.variance_of_mean * first.variance_of_mean / (static_cast<double>(a.size()) - 1.0) +
                          second.variance_of_mean * second.variance_of_mean / (static_cast<double>(b.size()) - 1.0));
  result.p_value = student_p_value(result.t(), degrees);
  return result;
}

}  // namespace lambent::test
