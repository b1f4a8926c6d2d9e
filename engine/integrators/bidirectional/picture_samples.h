// Pixels for what is learned before the first sample.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/film/film.h"

namespace lambent::bidirectional {

/// The i-th of any number of pixels {x, y} that cover the region evenly: two irrational steps (Roberts 2018, "The
/// Unreasonable Effectiveness of Quasirandom Sequences").
inline std::pair<int, int> spread_pixel(const Rectangle& region, int i) {
  const auto step = [&](double by, int extent) {
    return std::min(static_cast<int>((i * by - std::floor(i * by)) * extent), extent - 1);
  };
  return {region.x + step(0.7548776662466927, region.width), region.y + step(0.5698402909980532, region.height)};
}

}  // namespace lambent::bidirectional
