// Multiple importance sampling weights as functions of pdf ratios.
#pragma once

#include "engine/base/vec.h"

namespace lambent {

/// Power heuristic with exponent 2 for one sample of each of two techniques (Veach 1997, eq. 9.13): the weight of the
/// technique whose density is `pdf` against one whose density of the same path, in the same measure, is `pdf_other`.
/// Scale-invariant: computed from the ratio, so that densities up to 1e38 neither overflow nor vanish. 0 if pdf is 0.
inline float power_heuristic(float pdf, float pdf_other) {
  if (!(pdf > 0.0f)) return 0.0f;
  const float ratio = pdf_other / pdf;  // may be infinite: the weight is then 0
  return 1.0f / (1.0f + ratio * ratio);
}

}  // namespace lambent
