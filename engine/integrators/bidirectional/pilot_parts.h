// What is shared by all that is learned before the first sample.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/integrators/bidirectional/kernel.h"

namespace lambent::bidirectional {

/// The render's settings for the picture alone, whole, and with nobody looking.
inline IntegratorSettings settings_of_pilots(IntegratorSettings settings) {
  settings.observer = nullptr;
  settings.passes = nullptr;
  settings.others = {};
  settings.clamp_direct = settings.clamp_indirect = 0.0f;
  return settings;
}

/// The i-th of any number of pixels {x, y} that cover the region evenly: two irrational steps (Roberts 2018, "The
/// Unreasonable Effectiveness of Quasirandom Sequences").
inline std::pair<int, int> spread_pixel(const Rectangle& region, int i) {
  const auto step = [&](double by, int extent) {
    return std::min(static_cast<int>((i * by - std::floor(i * by)) * extent), extent - 1);
  };
  return {region.x + step(0.7548776662466927, region.width), region.y + step(0.5698402909980532, region.height)};
}

/// A camera walk through the middle of a pixel.
template <KernelProfile profile>
PathEstimate see_pixel(Kernel<profile>& kernel, const Scene& scene, const Sampler& sampler, int x, int y) {
  const Vec2 raster(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
  const Vec2 lens = scene.profile().depth_of_field ? sampler.get_2d(k_dimension_lens) : Vec2(0.0f);
  return kernel.camera_sample(sampler, scene.camera().sample_ray(raster, lens), x, y);
}

}  // namespace lambent::bidirectional
