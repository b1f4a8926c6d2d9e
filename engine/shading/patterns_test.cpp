#include "engine/shading/patterns.h"

#include <gtest/gtest.h>

#include <limits>

#include "engine/base/hash.h"
#include "engine/shading/color_math.h"
#include "engine/shading/noise.h"
#include "engine/shading/standard_observer.h"
#include "engine/shading/voronoi.h"

namespace lambent {
namespace {

constexpr float k_bad_values[] = {0.0f,   -0.0f, 1e-30f, 1e30f,
                                  -1e30f, 3e38f, 1e9f,   std::numeric_limits<float>::infinity(),
                                  -3e38f, 0.5f,  -2.5f,  std::numeric_limits<float>::quiet_NaN()};
float bad(uint32_t i, uint32_t k) { return k_bad_values[hash_combine(hash_u32(i), k) % std::size(k_bad_values)]; }
float uniform(uint32_t i, uint32_t k) { return unit_float(hash_combine(hash_u32(i), k)) * 10.0f - 5.0f; }
bool finite(const Vec4& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z) && std::isfinite(v.w);
}

template <typename Visit>
void for_each_voronoi(Visit&& visit) {
  for (int dimensions = 1; dimensions <= 4; ++dimensions)
    for (int feature = 0; feature < 5; ++feature)
      for (int metric = 0; metric < 4; ++metric)
        for (int form = 0; form < 3; ++form) {
          VoronoiParameters parameters;
          parameters.dimensions = dimensions;
          parameters.feature = static_cast<VoronoiFeature>(feature);
          parameters.metric = static_cast<VoronoiMetric>(metric);
          parameters.octaves = form > 0;
          parameters.cell_hashes = form == 2;
          parameters.normalize = form == 1;
          visit(parameters);
        }
}

TEST(Voronoi, adversarial_parameters_give_finite_values) {
  uint32_t i = 0;
  for_each_voronoi([&](VoronoiParameters parameters) {
    for (int round = 0; round < 20; ++round, ++i) {
      parameters.scale = bad(i, 0), parameters.detail = bad(i, 1), parameters.roughness = bad(i, 2);
      parameters.lacunarity = bad(i, 3), parameters.smoothness = bad(i, 4), parameters.exponent = bad(i, 5);
      parameters.randomness = bad(i, 6);
      const VoronoiResult result = voronoi_texture({bad(i, 7), bad(i, 8), bad(i, 9), bad(i, 10)}, parameters);
      ASSERT_TRUE(std::isfinite(result.distance) && is_finite(result.color) && finite(result.position)) << i;
    }
  });
}

TEST(Voronoi, the_first_point_is_never_further_than_the_second) {
  uint32_t i = 0;
  for_each_voronoi([&](VoronoiParameters parameters) {
    const Vec4 p(uniform(i, 0), uniform(i, 1), uniform(i, 2), uniform(i, 3));
    ++i;
    parameters.normalize = false;
    parameters.feature = VoronoiFeature::f1;
    const float first = voronoi_texture(p, parameters).distance;
    parameters.feature = VoronoiFeature::f2;
    EXPECT_LE(first, voronoi_texture(p, parameters).distance);
  });
}

TEST(Voronoi, without_randomness_the_points_are_the_corners_of_a_grid) {
  VoronoiParameters parameters;
  parameters.randomness = 0.0f;
  EXPECT_FLOAT_EQ(voronoi_texture({3.0f, -2.0f, 0.25f, 0}, parameters).distance, 0.25f);
  EXPECT_EQ(voronoi_texture({3.1f, -2.1f, 0.2f, 0}, parameters).position, Vec4(3.0f, -2.0f, 0.0f, 0.0f));
}

TEST(Voronoi, the_position_is_that_of_the_nearest_point) {
  VoronoiParameters parameters;
  for (uint32_t i = 0; i < 200; ++i) {
    const Vec4 p(uniform(i, 0), uniform(i, 1), uniform(i, 2), 0.0f);
    const VoronoiResult result = voronoi_texture(p, parameters);
    EXPECT_NEAR((p - result.position).length(), result.distance, 1e-5f);
  }
}

TEST(Noise, adversarial_parameters_give_finite_values) {
  for (uint32_t i = 0; i < 4000; ++i) {
    NoiseParameters parameters;
    parameters.dimensions = 1 + static_cast<int>(i % 4);
    parameters.type = static_cast<FractalType>(i / 4 % 5);
    parameters.normalize = i / 20 % 2;
    parameters.detail = bad(i, 0), parameters.roughness = bad(i, 1), parameters.lacunarity = bad(i, 2);
    parameters.offset = bad(i, 3), parameters.gain = bad(i, 4), parameters.distortion = bad(i, 5);
    const Vec4 p(bad(i, 6), bad(i, 7), bad(i, 8), bad(i, 9));
    Color color;
    ASSERT_TRUE(std::isfinite(noise_texture(p, parameters, &color)) && is_finite(color)) << i;
    ASSERT_TRUE(std::isfinite(musgrave_texture(p, parameters, bad(i, 10), bad(i, 11)))) << i;
  }
}

TEST(Noise, normalised_noise_stays_between_0_and_1) {
  NoiseParameters parameters;
  for (uint32_t i = 0; i < 2000; ++i) {
    parameters.dimensions = 1 + static_cast<int>(i % 4);
    const float x = noise_texture({uniform(i, 0), uniform(i, 1), uniform(i, 2), uniform(i, 3)}, parameters, nullptr);
    EXPECT_GE(x, 0.0f);
    EXPECT_LE(x, 1.0f);
  }
}

TEST(Noise, from_blender_4_2_on_repeats_every_100000_units) {
  for (int dimensions = 1; dimensions <= 4; ++dimensions)
    for (uint32_t i = 0; i < 200; ++i) {
      // Halves and quarters, which floats have this far out
      const auto coordinate = [&](uint32_t k) { return std::round(40.0f * uniform(i, k)) * 0.25f; };
      const Vec4 p(coordinate(0), coordinate(1), coordinate(2), coordinate(3));
      const Vec4 positive(std::fabs(p.x), std::fabs(p.y), std::fabs(p.z), std::fabs(p.w));
      const Vec4 far(positive.x + 3e5f, positive.y + 3e5f, positive.z + 3e5f, positive.w + 3e5f);
      EXPECT_EQ(signed_noise(far, dimensions, true), signed_noise(positive, dimensions, true)) << dimensions;
      EXPECT_EQ(signed_noise(p, dimensions, true), signed_noise(p, dimensions, false));
      // Where floats are whole numbers, it is that of halves.
      const float whole = 1e7f + static_cast<float>(4 * i), half = std::fmod(whole, 1e5f) + 0.5f;
      EXPECT_EQ(signed_noise({whole, whole, whole, whole}, dimensions, true),
                signed_noise({half, half, half, half}, dimensions, true));
      EXPECT_EQ(signed_noise({whole, whole, whole, whole}, dimensions, false), 0.0f);
    }
}

TEST(Noise, musgrave_is_noise_with_one_octave_less) {
  // As Blender 4.1 converts it: detail one less, roughness lacunarity to the power of minus the dimension.
  NoiseParameters parameters;
  parameters.normalize = false;
  parameters.lacunarity = 2.2f;
  parameters.offset = 0.4f;
  parameters.gain = 1.6f;
  for (uint32_t i = 0; i < 500; ++i) {
    parameters.type = static_cast<FractalType>(i % 5);
    parameters.detail = 2.4f;
    parameters.roughness = std::pow(2.2f, -0.8f);
    const Vec4 p(uniform(i, 0), uniform(i, 1), uniform(i, 2), 0.0f);
    EXPECT_FLOAT_EQ(musgrave_texture(p, parameters, 3.4f, 0.8f), noise_texture(p, parameters, nullptr)) << i;
  }
}

TEST(Colours, blackbodies_are_as_plancks_law_and_the_standard_observer_have_them) {
  for (const float kelvin :
       {800.0f, 964.9f, 965.1f, 1167.0f, 1448.0f, 1900.0f, 2700.0f, 3315.0f, 5000.0f, 6500.0f, 11999.0f}) {
    double xyz[3] = {0, 0, 0};
    for (int i = 0; i < k_observer_count; ++i) {
      const double metres = (k_observer_start_nm + k_observer_step_nm * i) * 1e-9;
      const double radiance = std::pow(metres, -5.0) / std::expm1(0.014387769 / (metres * kelvin));
      for (int k = 0; k < 3; ++k) xyz[k] += radiance * k_observer_xyz[i][k];
    }
    const Color expected =
        rec709_from_xyz(static_cast<float>(xyz[0] / xyz[1]), 1.0f, static_cast<float>(xyz[2] / xyz[1]));
    const Color found = blackbody_color(kelvin);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(found[k], std::max(expected[k], 0.0f), 2e-3f * max_component(expected))
          << kelvin << " K, channel " << k;
  }
  for (const float below : {0.0f, -1e30f, std::numeric_limits<float>::quiet_NaN()})
    EXPECT_EQ(blackbody_color(below), blackbody_color(799.0f));
  EXPECT_NEAR(blackbody_color(799.0f).x, blackbody_color(800.0f).x, 1e-2f);
  EXPECT_EQ(blackbody_color(1e30f), blackbody_color(12000.0f));
}

TEST(Patterns, adversarial_parameters_give_finite_values) {
  for (uint32_t i = 0; i < 4000; ++i) {
    const Vec3 p(bad(i, 0), bad(i, 1), bad(i, 2));
    ASSERT_TRUE(std::isfinite(wave_texture(static_cast<WaveShape>(i % 8), static_cast<WaveProfile>(i / 8 % 3), p,
                                           bad(i, 3), bad(i, 4), bad(i, 5), bad(i, 6), bad(i, 7))));
    ASSERT_TRUE(is_finite(magic_texture(p, bad(i, 3), static_cast<int>(i % 11), bad(i, 4))));
    BrickParameters bricks;
    bricks.mortar_size = bad(i, 3), bricks.mortar_smooth = bad(i, 4), bricks.bias = bad(i, 5);
    bricks.brick_width = bad(i, 6), bricks.row_height = bad(i, 7), bricks.offset = bad(i, 8);
    bricks.squash = bad(i, 9), bricks.offset_frequency = static_cast<int>(i % 5);
    const Brick brick = brick_texture(p, bricks);
    ASSERT_TRUE(brick.tint >= 0.0f && brick.tint <= 1.0f && brick.mortar >= 0.0f && brick.mortar <= 1.0f) << i;
    const Gabor gabor = gabor_texture(p, i % 2, bad(i, 3), bad(i, 4), bad(i, 5), Vec3(bad(i, 6), bad(i, 7), bad(i, 8)));
    ASSERT_TRUE(std::isfinite(gabor.value) && std::isfinite(gabor.phase) && std::isfinite(gabor.intensity)) << i;
  }
}

TEST(Patterns, gabor_noise_has_mean_one_half) {
  for (const bool three_dimensions : {false, true}) {
    double sum = 0.0, squares = 0.0;
    constexpr int k_count = 20000;
    for (uint32_t i = 0; i < k_count; ++i) {
      const Vec3 p = Vec3(uniform(i, 0), uniform(i, 1), uniform(i, 2)) * 50.0f;
      const float x = gabor_texture(p, three_dimensions, 2.0f, 0.0f, 0.0f, Vec3(1, 0, 0)).value;
      sum += x, squares += x * x;
    }
    const double mean = sum / k_count, deviation = std::sqrt(squares / k_count - mean * mean);
    EXPECT_NEAR(mean, 0.5, 4.0 * deviation / std::sqrt(k_count));
  }
}

TEST(RadialTiling, corners_of_a_square_are_where_they_belong) {
  const RadialTile tile = radial_tiling({1.0f, 1.0f}, 4.0f, 0.0f, false);
  EXPECT_NEAR(tile.along, 0.0f, 1e-6f);
  EXPECT_NEAR(tile.outwards, std::sqrt(2.0f) - 1.0f, 1e-6f);
  EXPECT_NEAR(tile.width, 1.0f, 1e-6f);
  EXPECT_NEAR(tile.rotation_rad, 0.25f * k_pi, 1e-6f);
  EXPECT_EQ(radial_tiling({-1.0f, 0.5f}, 4.0f, 0.0f, false).segment, 1.0f);
  EXPECT_EQ(radial_tiling({-1.0f, -0.5f}, 4.0f, 0.0f, false).segment, 2.0f);
}

TEST(RadialTiling, distances_are_continuous_and_normalized_coordinates_fill_each_segment) {
  constexpr int k_steps = 20000;
  for (const float sides : {3.0f, 5.0f, 4.5f, 6.3f, 2.7f})
    for (const float roundness : {0.0f, 0.2f, 0.7f, 1.0f})
      for (const float distance : {0.4f, 1.0f, 2.5f}) {
        float before = 0.0f;
        for (int i = 0; i <= k_steps; ++i) {
          const float angle = 2.0f * k_pi * (static_cast<float>(i) + 0.5f) / k_steps;
          const Vec2 p{distance * std::cos(angle), distance * std::sin(angle)};
          const RadialTile tile = radial_tiling(p, sides, roundness, true);
          if (i == 0) before = tile.outwards;
          ASSERT_NEAR(tile.outwards, before, 0.01f) << sides << " " << roundness << " " << angle;
          before = tile.outwards;
          ASSERT_GE(tile.along, -1e-2f) << sides << " " << roundness << " " << distance << " " << angle;
          ASSERT_LE(tile.along, 1.0f + 1e-2f) << sides << " " << roundness << " " << distance << " " << angle;
        }
      }
}

TEST(RadialTiling, nothing_makes_it_non_finite) {
  constexpr float k_nan = std::numeric_limits<float>::quiet_NaN();
  const float values[] = {0.0f, -1.0f, 1e-30f, 1.0f, 2.0f, 2.5f, 1e30f, k_infinity, k_nan};
  for (const float x : values)
    for (const float y : values)
      for (const float sides : values)
        for (const float roundness : values)
          for (const bool normalize : {false, true}) {
            const RadialTile tile = radial_tiling({x, y}, sides, roundness, normalize);
            for (const float v : {tile.along, tile.outwards, tile.segment, tile.width, tile.rotation_rad})
              ASSERT_TRUE(std::isfinite(v)) << x << " " << y << " " << sides << " " << roundness;
          }
}

}  // namespace
}  // namespace lambent
