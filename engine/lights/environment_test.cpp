#include "engine/lights/environment.h"

#include <gtest/gtest.h>

#include "engine/sampling/chi_square.h"
#include "engine/sampling/warp.h"

namespace lambent {
namespace {

TEST(Environment, directions_and_image_coordinates_invert_and_follow_blender) {
  EXPECT_NEAR(length(direction_of_equirectangular({0.5f, 0.5f}) - Vec3(1, 0, 0)), 0.0f, 1e-6f);
  EXPECT_NEAR(length(direction_of_equirectangular({0.25f, 0.5f}) - Vec3(0, 1, 0)), 0.0f, 1e-6f);
  EXPECT_NEAR(direction_of_equirectangular({0.1f, 1.0f}).z, 1.0f, 1e-6f);
  RandomStream random(2);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 w = sample_uniform_sphere(random.next_2d());
    EXPECT_NEAR(length(direction_of_equirectangular(equirectangular_of_direction(w)) - w), 0.0f, 2e-6f);
  }
}

TEST(Environment, directions_follow_the_image) {
  EnvironmentLight sky;
  sky.width = 20;
  sky.height = 10;
  for (int i = 0; i < 200; ++i) sky.luminance.push_back(i % 7 == 0 ? 5.0f : (i % 3 ? 0.5f : 0.0f));
  const Environment environment(sky);
  // Domain: the image, where the density is the solid-angle density times 2 pi² sin(theta).
  const auto result = chi_square_test_2d(
      {0, 0}, {1, 1},
      [&](const Vec2& u) {
        float pdf = 0.0f;
        const Vec3 w = environment.sample(Vec3(0.0f), u, pdf);
        EXPECT_NEAR(environment.pdf_solid_angle(Vec3(0.0f), w) / pdf, 1.0f, 1e-3f);
        const Vec2 uv = equirectangular_of_direction(w);
        return Vec2(uv.y, uv.x);
      },
      [&](const Vec2& q) {
        const Vec3 w = direction_of_equirectangular({q.y, q.x});
        return environment.pdf_solid_angle(Vec3(0.0f), w) * 2 * k_pi * k_pi * std::sqrt(w.x * w.x + w.y * w.y);
      },
      20);
  EXPECT_GT(result.p_value, 0.01);
  EXPECT_NEAR(result.total_probability, 1.0, 1e-3);
}

}  // namespace
}  // namespace lambent
