// When to stop sampling a pixel (noise_threshold). Pure functions of a pixel's sums, so that the decision depends on
// neither threads nor tiles nor pauses.
//
// The measure is that of Cycles, so that thresholds mean the same: the standard error of the mean of R+G+B over the
// square root of that mean (Dammertz et al. 2010, "A Hierarchical Automatic Stopping Condition for Monte Carlo Global
// Illumination", sec. 2.1, estimates the same quantity from half the samples). A pixel stops for good when the root
// mean square of the measure over the (2 k_adaptive_radius + 1)² pixels around it is below the threshold: single pixels
// that have not met their rare bright samples yet are held by neighbours that have.
// Splats (light tracing) are part of a pixel and of its noise: light walks of all pixels are the samples, and most
// bring it nothing. Pixels that stop take their light walks with them. So where splats are what is noisy, no pixel
// stops: the others would wait for as many walks, each with a camera walk that they do not need. Limits: stopping on an
// estimate biases the picture slightly towards dark, more so the lower the first check is (0.1% measured at a threshold
// of 0.05); pixels at the border of a render region see fewer neighbours than in the full frame; the standard error is
// that of independent samples, while low-discrepancy ones do better: where light is diffuse the noise that remains was
// measured to be half the threshold.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace lambent {

inline constexpr int k_adaptive_radius = 2;
inline constexpr int64_t k_adaptive_step = 16;
/// No pixel stops while in more than this part of them splats alone are too noisy.
inline constexpr double k_adaptive_splat_share = 0.01;

/// Standard error of the mean of n values with sum `sum` and sum of squares `squares`; infinity for n < 2.
inline double standard_error_of_mean(double sum, double squares, int64_t n) {
  if (n < 2) return std::numeric_limits<double>::infinity();
  const double count = static_cast<double>(n);
  return std::sqrt(std::max(squares - sum * sum / count, 0.0) / (count * (count - 1.0)));
}

/// The noise measure of a pixel from the mean of its R+G+B and that mean's standard error.
inline double adaptive_noise(double mean, double standard_error) {
  // The constant keeps black pixels from dividing by zero; as in Cycles.
  return standard_error / (1e-4 + std::sqrt(std::max(mean, 0.0)));
}

/// Samples before the first check: 64 at a threshold of 0.01, more below it.
inline int64_t first_adaptive_check(float threshold) {
  const double samples = 16.0 / std::pow(std::max(double(threshold), 1e-4), 0.3);
  return k_adaptive_step * std::max<int64_t>(1, std::llround(samples / double(k_adaptive_step)));
}

/// Whether to call Film::stop_converged when every active pixel has `samples` samples.
inline bool is_adaptive_check(float threshold, int64_t samples) {
  return threshold > 0.0f && samples >= first_adaptive_check(threshold) && samples % k_adaptive_step == 0;
}

}  // namespace lambent
