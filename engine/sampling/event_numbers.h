// The random numbers of one scattering event, drawn together.
#pragma once

#include "engine/sampling/dimension.h"
#include "engine/sampling/sampler.h"

namespace lambent {

/// What a path tracer decides at an event, by the numbers of bounce_dimension: the same as drawn one by one. Eight cost
/// no more than the seven that are used.
struct EventNumbers {
  Vec2 light;
  float lobe;
  Vec2 direction;
  float roulette, shadow_roulette;

  EventNumbers(const Sampler& sampler, uint32_t bounce) {
    constexpr uint32_t k_which[8] = {k_dimension_light,           k_dimension_light,          k_dimension_lobe,
                                     k_dimension_direction,       k_dimension_direction,      k_dimension_roulette,
                                     k_dimension_shadow_roulette, k_dimension_shadow_roulette};
    constexpr uint32_t k_second[8] = {0, ~0u, 0, 0, ~0u, 0, 0, ~0u};
    uint32_t dimensions[8];
    for (int i = 0; i < 8; ++i) dimensions[i] = k_camera_dimensions + bounce * k_bounce_stride + k_which[i];
    float u[8];
    sampler.get_8(dimensions, k_second, u);
    light = {u[0], u[1]};
    lobe = u[2];
    direction = {u[3], u[4]};
    roulette = u[5];
    shadow_roulette = u[6];
  }
};

}  // namespace lambent
