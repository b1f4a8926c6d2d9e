#include "engine/scene/world_map.h"

#include <tbb/parallel_for.h>

#include <cmath>

namespace lambent {

EnvironmentLight world_importance_map(const Program& world, const TextureSystem* textures, int height,
                                      const CancelFlag& cancel) {
  EnvironmentLight light;
  light.width = 2 * height;
  light.height = height;
  light.luminance.assign(static_cast<size_t>(light.width) * light.height, 0.0f);
  std::vector<Imath::V3d> row_sums(height, Imath::V3d(0.0));
  tbb::parallel_for(0, height, [&](int y) {
    if (cancel.cancelled()) return;
    ShadingPoint point;
    point.ray_kind = k_ray_diffuse;
    for (int x = 0; x < light.width; ++x) {
      const Vec3 direction = direction_of_equirectangular(
          {(static_cast<float>(x) + 0.5f) / light.width, (static_cast<float>(y) + 0.5f) / light.height});
      point.p_world = direction;
      point.wi_world = point.ng_world = point.ns_world = -direction;
      const Color radiance = world.emission(point, textures);
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
  light.radiance = Color(Vec3(sum / weight));
  return light;
}

}  // namespace lambent
