// How bounces are counted and limited: as Cycles does (kernel/integrator/path_state.h), so that scenes made for it
// match.
#pragma once

#include "engine/shading/bsdf.h"
#include "engine/shading/shading_point.h"

namespace lambent {

/// Where a walk stands. A limit of N lets N bounces of that kind happen and gathers light at the last of them; what the
/// walk meets one bounce later only adds its own emission.
struct BounceState {
  int total = 0, diffuse = 0, glossy = 0, transmission = 0, transparent = 0;
  uint32_t ray_kind = k_ray_camera;
  bool last = false;  ///< a limit is used up: the next scattering surface only emits

  /// Counts a scattering event (ScatterEvent bits). Returns false if the walk ends at once: only after too many
  /// transparent surfaces. @param limits anything with members total, diffuse, glossy, transmission, transparent
  template <typename Limits>
  bool advance(uint8_t event, const Limits& limits) {
    if (event & k_scatter_transparent) return ++transparent <= limits.transparent;  // kind of ray stays
    if (++total > limits.total) last = true;
    if (event & k_scatter_transmission) {
      if (++transmission > limits.transmission) last = true;
    } else if (event & k_scatter_diffuse) {
      if (++diffuse > limits.diffuse) last = true;
    } else {
      if (++glossy > limits.glossy) last = true;
    }
    ray_kind = (event & k_scatter_transmission ? k_ray_transmission : 0u) |
               (event & k_scatter_diffuse ? k_ray_diffuse : k_ray_glossy) |
               (event & k_scatter_delta ? k_ray_singular : 0u);
    return true;
  }
};

}  // namespace lambent
