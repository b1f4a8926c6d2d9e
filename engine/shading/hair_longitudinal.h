// How hair scatters along itself: d'Eon et al. 2011 and 2013, shared by the models of hair. Angles are from the plane
// across the fibre; light that comes from an elevation mostly goes to the opposite one.
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/base/trig.h"
#include "engine/base/vec.h"

namespace lambent {

/// I0(z)·exp(−z), z >= 0
inline float scaled_bessel(float z) {
  if (z > 12.0f) return (1.0f + 1.0f / (8.0f * z) + 9.0f / (128.0f * z * z)) / std::sqrt(2.0f * k_pi * z);
  const float quarter = 0.25f * z * z;
  float sum = 1.0f, term = 1.0f;
  for (int i = 1; i < 40; ++i) {
    term *= quarter / static_cast<float>(i * i);
    sum += term;
    if (term < 1e-7f * sum) break;
  }
  return sum * std::exp(-z);
}

/// Density per solid angle times 2π (d'Eon et al. 2011, eq. 7), written so that neither narrow lobes cancel nor wide
/// ones overflow. @param v variance, above 0
inline float longitudinal_density(float sin_from, float cos_from, float theta_to, float cos_to, float v) {
  const float half_sine = std::sin(0.5f * (std::asin(std::clamp(sin_from, -1.0f, 1.0f)) + theta_to));
  return std::exp(-2.0f * sqr(half_sine) / v) * scaled_bessel(cos_from * cos_to / v) / (v * -std::expm1(-2.0f / v));
}

/// Sine of the elevation that light goes to (d'Eon et al. 2013, eq. 6 and 7). @param u in [0, 1)²
inline float sample_longitudinal(float sin_from, float cos_from, float v, const Vec2& u) {
  // One minus the cosine of the angle to the mirrored elevation: exact where the lobe is narrow
  const float first = std::clamp(u.x, 1e-9f, 1.0f);
  const float fall = std::clamp(-v * std::log(first + (1.0f - first) * std::exp(-2.0f / v)), 0.0f, 2.0f);
  return std::clamp(-(1.0f - fall) * sin_from + safe_sqrt(fall * (2.0f - fall)) * sin_cos_turn(u.y).cos * cos_from,
                    -1.0f, 1.0f);
}

}  // namespace lambent
