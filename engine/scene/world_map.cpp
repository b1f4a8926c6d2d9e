#include "engine/scene/world_map.h"

#include <tbb/parallel_for.h>

#include <cmath>

#include "engine/base/frame.h"
#include "engine/sampling/warp.h"

namespace lambent {

EnvironmentLight world_importance_map(const Program& world, const TextureSystem* textures, int height,
                                      const CancelFlag& cancel) {
  EnvironmentLight light;
  light.width = 2 * height;
  light.height = height;
  light.luminance.assign(static_cast<size_t>(light.width) * light.height, 0.0f);
  constexpr int k_sun_samples = 16;
  const Vec3 sun = world.traits().sun_direction_world;
  const float half_sun = 0.5f * std::clamp(world.traits().sun_angle_rad, 0.0f, k_pi);
  const float cos_near_sun = half_sun > 0.0f ? std::cos(std::min(half_sun + 2.0f * k_pi / height, 0.5f * k_pi)) : 2.0f;
  const float sun_one_minus_cos = one_minus_cos_of_angle(half_sun);
  std::vector<Imath::V3d> row_sums(height, Imath::V3d(0.0));
  tbb::parallel_for(0, height, [&](int y) {
    if (cancel.cancelled()) return;
    ShadingPoint point;
    point.ray_kind = k_ray_diffuse;
    const auto radiance_at = [&](float column, float row) {
      const Vec3 direction = direction_of_equirectangular({column / light.width, row / light.height});
      point.p_world = direction;
      point.wi_world = point.ng_world = point.ns_world = -direction;
      return world.emission(point, textures);
    };
    for (int x = 0; x < light.width; ++x) {
      Color radiance = radiance_at(x + 0.5f, y + 0.5f);
      const Vec3 direction = point.p_world;
      if (dot(direction, sun) > cos_near_sun) {  // the sky beside the disc, which is smaller than a texel
        radiance = Color(0.0f);
        int beside = 0;
        for (int i = 0; i < k_sun_samples * k_sun_samples; ++i) {
          const Color here = radiance_at(x + (i % k_sun_samples + 0.5f) / k_sun_samples,
                                         y + (i / k_sun_samples + 0.5f) / k_sun_samples);
          if (length_squared(point.p_world - sun) <= 2.0f * sun_one_minus_cos) continue;
          radiance += here;
          ++beside;
        }
        radiance *= 1.0f / static_cast<float>(std::max(beside, 1));
      }
      if (!is_finite(radiance)) continue;
      light.luminance[static_cast<size_t>(y) * light.width + x] = std::fabs(luminance(radiance));
      row_sums[y] += Imath::V3d(radiance);
    }
  });
  Imath::V3d sum(0.0);
  double weight = 0.0;
  for (int y = 0; y < height; ++y) {
    const double sine = std::sin((y + 0.5) / height * std::numbers::pi);
    sum += row_sums[y] * sine;
    weight += sine * light.width;
  }
  if (half_sun > 0.0f && !cancel.cancelled()) {
    ShadingPoint point;
    point.ray_kind = k_ray_diffuse;
    const Frame around = Frame::from_normal(sun);
    Color disc(0.0f);
    for (int i = 0; i < k_sun_samples * k_sun_samples; ++i) {
      const Vec2 u((i % k_sun_samples + 0.5f) / k_sun_samples, (i / k_sun_samples + 0.5f) / k_sun_samples);
      point.p_world = around.to_world(sample_cone(u, sun_one_minus_cos));
      point.wi_world = point.ng_world = point.ns_world = -point.p_world;
      disc += world.emission(point, textures) * (1.0f / (k_sun_samples * k_sun_samples));
    }
    if (is_finite(disc) && max_component(disc) > 0.0f) {
      light.sun_direction_world = sun;
      light.sun_angle_rad = 2.0f * half_sun;
      light.sun_luminance = std::fabs(luminance(disc));
      sum += Imath::V3d(disc) * (0.5 * static_cast<double>(sun_one_minus_cos) * weight);
    }
  }
  light.radiance = Color(Vec3(sum / weight));
  return light;
}

}  // namespace lambent
