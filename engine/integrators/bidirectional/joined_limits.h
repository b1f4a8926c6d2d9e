// Bounce limits by kind of event on paths that are joined of two walks, where the events at the joint were not sampled.
#pragma once

#include "engine/path/bounces.h"
#include "engine/path/event_counts.h"

namespace lambent::bidirectional {

/// Whether `more` events of some kind may be over a limit on a path of these two parts.
template <typename Limits>
bool limits_are_near(const Limits& limits, const EventCounts& before, const EventCounts& light_side, int more) {
  EventCounts most = before + light_side;
  most.diffuse += more;
  most.glossy += more;
  most.transmission += more;
  return !most.within(limits);
}

/// What part of a joined path's light keeps within the limits by kind of event.
/// @param at_camera, at_light kinds that the events at the two sides of the joint may be of; null: none that is counted
template <typename Limits>
float share_within_limits(const Limits& limits, const EventCounts& before, const EventCounts& light_side,
                          const EventShares* at_camera, const EventShares* at_light) {
  constexpr uint8_t k_events[3] = {k_scatter_diffuse, k_scatter_glossy, k_scatter_transmission};
  const auto share_of = [](const EventShares* shares, int kind) {
    if (!shares) return kind == 0 ? 1.0f : 0.0f;  // an event that no limit counts
    return kind == 0 ? shares->diffuse : kind == 1 ? shares->glossy : shares->transmission;
  };
  float sum = 0.0f;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      const float share = share_of(at_camera, a) * share_of(at_light, b);
      if (share == 0.0f) continue;
      EventCounts all = before + light_side;
      if (at_camera) all.add(k_events[a]);
      if (at_light) all.add(k_events[b]);
      if (all.within(limits)) sum += share;
    }
  return sum;
}

}  // namespace lambent::bidirectional
