// Welch's test: do two renderers give the same mean? For pictures rendered in independent batches.
#pragma once

#include <span>

namespace lambent::test {

/// Two-sided probability that a variable with Student's t distribution of `degrees` (> 0) degrees of freedom is further
/// from 0 than `t` (regularised incomplete beta function by continued fraction; Abramowitz & Stegun 26.5.8, 26.7.1).
double student_p_value(double t, double degrees);

/// Welch's t-test (Welch 1947) with the degrees of freedom of Satterthwaite 1946.
struct WelchResult {
  double p_value = 1.0;     ///< probability of means so far apart if the expectations are equal
  double difference = 0.0;  ///< mean of a minus mean of b
  double standard_error = 0.0;
  double t() const { return standard_error > 0.0 ? difference / standard_error : 0.0; }
};

/// Each at least two values, independent and of one distribution within a and within b. `rounding`: differences up to
/// that are none, for values that do not vary.
WelchResult welch_test(std::span<const double> a, std::span<const double> b, double rounding = 0.0);

}  // namespace lambent::test
