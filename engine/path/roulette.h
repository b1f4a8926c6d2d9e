// Russian roulette of camera walks.
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/base/vec.h"

namespace lambent {

/// Played when a walk has chosen where to go on, by its throughput as in Cycles: by the square root, which keeps more
/// of what is dim but still matters. A walk that lost still looks: the light that its ray meets counts in full for
/// every walk, and only what the surface there scatters waits for the outcome (times 1/survival). So light that
/// scattered rays find, a world's above all, gets no noise from the game, for the price of a ray.
struct Roulette {
  float survival = 1.0f;  ///< in (0, 1]: divides the throughput once the ray has met what it meets
  bool lost = false;

  Roulette() = default;
  /// @param u in [0, 1)  @param safe_throughput walks of this throughput and more go on
  Roulette(const Color& throughput, float u, float safe_throughput = 1.0f)
      : survival(std::min(1.0f, std::sqrt(max_component(abs(throughput)) / safe_throughput))), lost(u >= survival) {}
};

}  // namespace lambent
