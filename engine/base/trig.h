// Sine and cosine where the angle is known to be within bounds: inlined, without the range reduction of the library's.
#pragma once

#include <cmath>

namespace lambent {

struct SinCos {
  float sin, cos;
};

/// Of an angle in [-pi/4, pi/4] rad. Relative error of the sine and absolute error of the cosine below 1.2e-7
/// (polynomials of Moshier's Cephes, sinf.c).
inline SinCos sin_cos_eighth(float x) {
  const float x2 = x * x;
  const float s = x + x * x2 * (-1.6666654611e-1f + x2 * (8.3321608736e-3f + x2 * -1.9515295891e-4f));
  const float c =
      1.0f - 0.5f * x2 + x2 * x2 * (4.166664568298827e-2f + x2 * (-1.388731625493765e-3f + x2 * 2.443315711809948e-5f));
  return {s, c};
}

/// Of `turns` full turns (2 pi rad), |turns| < 1e6; the errors are those of sin_cos_eighth, plus the rounding of
/// `turns`.
inline SinCos sin_cos_turn(float turns) {
  constexpr float k_half_pi = 1.57079632679489662f;
  const float quarters = 4.0f * turns, nearest = std::nearbyint(quarters);
  const SinCos r = sin_cos_eighth((quarters - nearest) * k_half_pi);
  const int quadrant = static_cast<int>(nearest);
  const float s = quadrant & 1 ? r.cos : r.sin, c = quadrant & 1 ? r.sin : r.cos;
  return {quadrant & 2 ? -s : s, (quadrant + 1) & 2 ? -c : c};
}

}  // namespace lambent
