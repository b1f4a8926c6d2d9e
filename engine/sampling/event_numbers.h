// The random numbers of one scattering event, drawn together.
#pragma once

#include "engine/sampling/dimension.h"
#include "engine/sampling/sampler.h"

namespace lambent {

/// What a path tracer decides at an event, by the numbers of bounce_dimension: the same as drawn one by one.
struct EventNumbers {
  float light_selection;
  Vec2 light_position;
  float lobe;
  Vec2 direction;
  float roulette, shadow_roulette;

  EventNumbers(const Sampler& sampler, uint32_t bounce) {
    constexpr uint32_t k_which[8] = {k_dimension_light_selection, k_dimension_light_position,
                                     k_dimension_light_position,  k_dimension_lobe,
                                     k_dimension_direction,       k_dimension_direction,
                                     k_dimension_roulette,        k_dimension_shadow_roulette};
    constexpr uint32_t k_second[8] = {0, 0, ~0u, 0, 0, ~0u, 0, 0};
    uint32_t dimensions[8];
    for (int i = 0; i < 8; ++i) dimensions[i] = k_camera_dimensions + bounce * k_bounce_stride + k_which[i];
    float u[8];
    sampler.get_8(dimensions, k_second, u);
    light_selection = u[0];
    light_position = {u[1], u[2]};
    lobe = u[3];
    direction = {u[4], u[5]};
    roulette = u[6];
    shadow_roulette = u[7];
  }
};

}  // namespace lambent
