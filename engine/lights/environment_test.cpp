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

TEST(Environment, samples_a_sun_by_its_share_and_the_sky_beside_it) {
  for (const float angle : {1e-4f, 0.0095f, 0.5f}) {
    EnvironmentLight sky;
    sky.width = 64;
    sky.height = 32;
    for (int i = 0; i < 64 * 32; ++i) sky.luminance.push_back(0.5f + 0.4f * static_cast<float>(i % 5));
    const double disc = 2.0 * std::numbers::pi * 2.0 * std::pow(std::sin(0.25 * static_cast<double>(angle)), 2.0);
    sky.sun_angle_rad = angle;
    sky.sun_direction_world = normalize(Vec3(0.3f, -0.5f, 0.4f));
    sky.sun_luminance = static_cast<float>(4.0 * std::numbers::pi * 2.6 / disc);  // two thirds of all light
    const Environment environment(sky);
    EXPECT_FALSE(environment.is_even());
    EXPECT_NEAR(environment.mean_luminance(), 3.9, 0.05) << angle;
    RandomStream random(4);
    const int count = 40000;
    int in_sun = 0;
    double ones = 0.0, squares = 0.0, disc_estimate = 0.0;
    for (int i = 0; i < count; ++i) {
      float pdf = 0.0f;
      const Vec3 d = environment.sample(Vec3(0.0f), random.next_2d(), pdf);
      ASSERT_GT(pdf, 0.0f);
      ASSERT_EQ(pdf, environment.pdf_solid_angle(Vec3(0.0f), d));
      const bool here = std::acos(std::clamp(dot(d, sky.sun_direction_world), -1.0f, 1.0f)) < 0.5f * angle + 3e-4f;
      in_sun += here;
      if (length_squared(d - sky.sun_direction_world) * std::numbers::pi_v<float> <= static_cast<float>(disc))
        disc_estimate += 1.0 / static_cast<double>(pdf) / count;
      const double value = here ? 0.0 : 1.0 / static_cast<double>(pdf);  // the solid angle of the rest
      ones += value, squares += value * value;
    }
    EXPECT_NEAR(in_sun / double(count), 2.0 / 3.0, 0.02) << angle;
    // Of n(2/3) samples of nearly one value: 4.5 standard errors, and what rounding moves over the narrowest rim
    EXPECT_NEAR(disc_estimate, disc, disc * (4.5 * std::sqrt(0.5 / count) + 1e-2)) << angle;
    const double mean = ones / count, error = std::sqrt((squares / count - mean * mean) / count);
    EXPECT_NEAR(mean, 4.0 * std::numbers::pi - disc, 4.5 * error + 0.01) << angle;
  }
}

TEST(Environment, density_on_the_rim_of_the_sun_is_that_of_its_disc) {
  for (const float angle : {1e-4f, 0.0095f, 0.05f}) {
    EnvironmentLight sky;
    sky.width = 64;
    sky.height = 32;
    sky.luminance.assign(64 * 32, 1.0f);
    sky.sun_angle_rad = angle;
    sky.sun_direction_world = normalize(Vec3(0.3f, -0.5f, 0.4f));
    sky.sun_luminance = 1e25f;  // all samples are the sun's
    const Environment environment(sky);
    const float disc = pdf_solid_angle_cone(one_minus_cos_of_angle(0.5f * angle));
    RandomStream random(6);
    for (int i = 0; i < 20000; ++i) {
      float pdf = 0.0f;
      // Numbers for the outermost ten thousandth of the disc, among others
      const Vec2 u(k_one_minus_epsilon * (1.0f - 1e-8f * static_cast<float>(i)), random.next_1d());
      for (const Vec2& at : {u, Vec2(u.y, u.x)}) {
        environment.sample(Vec3(0.0f), at, pdf);
        ASSERT_GT(pdf, 0.5f * disc) << angle << " " << at.x << " " << at.y;
      }
    }
  }
}

}  // namespace
}  // namespace lambent
