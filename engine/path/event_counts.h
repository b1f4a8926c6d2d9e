// How scattering events along a path are counted against Blender's limits, and remembered.
#pragma once

#include <cstdint>

#include "engine/path/bounces.h"
#include "engine/shading/bsdf.h"

namespace lambent {

/// Events along a part of a path. A path x_1 ... x_n is within its limits if the events at x_1 ... x_(n-1), in any
/// order, are (bounces.h: light is gathered at the last bounce that the limits allow, whatever kind that one is).
struct EventCounts {
  int total = 0, diffuse = 0, glossy = 0, transmission = 0;
  int transparent = 0;  ///< surfaces passed straight on

  void add(uint8_t event) {
    if (event & k_scatter_transparent) {
      ++transparent;
      return;
    }
    ++total;
    ++(event & k_scatter_transmission ? transmission : event & k_scatter_diffuse ? diffuse : glossy);
  }
  EventCounts operator+(const EventCounts& other) const {
    return {total + other.total, diffuse + other.diffuse, glossy + other.glossy, transmission + other.transmission,
            transparent + other.transparent};
  }
  template <typename Limits>
  bool within(const Limits& limits) const {
    return total <= limits.total && diffuse <= limits.diffuse && glossy <= limits.glossy &&
           transmission <= limits.transmission && transparent <= limits.transparent;
  }
};

/// The events of a path in order from the camera, four bits each (ScatterEvent's lowest four): what passes and
/// light-path expressions ask for. Events beyond the sixteenth are not kept.
struct EventSequence {
  uint64_t bits = 0;
  int count = 0;

  void append(uint8_t event) {
    if (event & k_scatter_transparent) return;
    if (count < 16) bits |= static_cast<uint64_t>(event & 15u) << (4 * count);
    ++count;
  }
  /// Appends `events` of a light walk (LightVertex::events), `more` of them.
  void append_packed(uint64_t events, int more) {
    if (count < 16) bits |= events << (4 * count);
    count += more;
  }
  /// Event number i from the camera, 0 the first.
  uint8_t operator[](int i) const { return i < 16 ? (bits >> (4 * i)) & 15u : 0; }
};

}  // namespace lambent
