// How many samples a pass brings where passes may be of any length: a matter of what is seen when, of no pixel's value.
#pragma once

#include <algorithm>
#include <cstdint>

#include "engine/film/adaptive.h"

namespace lambent {

/// What a pass may take, about: whoever looks on wants to see all of the picture improve.
inline constexpr double k_longest_pass_s = 1.0;

/// Samples of each pixel after the pass that follows `samples`: 1, 2, 4, 8, 16, then 16 more each, which are something
/// to see at once and later long enough pieces; fewer where they would take longer than k_longest_pass_s. No pass goes
/// past a multiple of k_adaptive_step, where pixels may stop.
/// @param limit 0: none
/// @param sample_s seconds of a sample of all pixels, by the passes so far; 0: not known
inline int64_t next_pass_target(int64_t samples, int64_t limit, double sample_s) {
  int64_t more = samples < 1 ? 1 : std::min(samples, k_adaptive_step);
  if (sample_s > 0.0)
    more = std::min(more, std::max<int64_t>(1, static_cast<int64_t>(std::min(k_longest_pass_s / sample_s, 1e6))));
  const int64_t next = std::min(samples + more, (samples / k_adaptive_step + 1) * k_adaptive_step);
  return limit > 0 ? std::min(next, limit) : next;
}

}  // namespace lambent
