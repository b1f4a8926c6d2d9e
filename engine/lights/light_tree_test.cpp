#include "engine/lights/light_tree.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "engine/sampling/chi_square.h"
#include "engine/sampling/sampler.h"
#include "engine/sampling/warp.h"

namespace lambent {
namespace {

std::vector<LightCluster> scattered(int n, float scale, uint64_t seed = 1) {
  std::vector<LightCluster> lights(static_cast<size_t>(n));
  RandomStream random(seed);
  for (int i = 0; i < n; ++i) {
    LightCluster& light = lights[static_cast<size_t>(i)];
    light.center = Vec3(random.next_1d(), random.next_1d(), random.next_1d()) * scale;
    light.axis = sample_uniform_sphere(random.next_2d());
    light.intensity = std::exp(4.0 * static_cast<double>(random.next_1d()));
    light.radius = i % 3 ? 0.01f * scale * random.next_1d() : 0.0f;
    light.two_sided = i % 4 == 1;
    if (i % 4 == 2) light.cos_normals = -1.0f;  // a point
    if (i % 4 == 3) light.cos_emission = 0.8f;  // a spot
  }
  return lights;
}

/// Largest irradiance that any point of the emitter's sphere could give: 0 means it certainly gives none.
double upper_bound(const LightCluster& light, const Vec3& p, const Vec3& n) {
  const Vec3 to_light = light.center - p;
  const float d = length(to_light);
  if (d <= light.radius) return 1.0;
  const float below = -light.radius;
  if (length_squared(n) > 0 && dot(to_light, n) <= below) return 0.0;
  if (light.cos_normals == -1.0f) return 1.0;
  float cos_axis = -dot(to_light, light.axis) / d;
  if (light.two_sided) cos_axis = std::fabs(cos_axis);
  const float angle = std::acos(std::clamp(cos_axis, -1.0f, 1.0f)) - std::asin(light.radius / d);
  return std::cos(std::max(angle, 0.0f)) > light.cos_emission ? 1.0 : 0.0;
}

TEST(LightTree, probabilities_sum_to_one_and_are_those_of_sampling) {
  for (const int n : {1, 2, 4, 5, 17, 1000}) {
    const LightTree tree(scattered(n, 1.0f));
    EXPECT_EQ(tree.size(), static_cast<size_t>(n));
    RandomStream random(2);
    for (int trial = 0; trial < 50; ++trial) {
      const Vec3 p(random.next_1d() * 2 - 0.5f, random.next_1d() * 2 - 0.5f, random.next_1d() * 2 - 0.5f);
      const Vec3 normal = trial % 2 ? sample_uniform_sphere(random.next_2d()) : Vec3(0.0f);
      double sum = 0.0;
      for (int i = 0; i < n; ++i) sum += static_cast<double>(tree.prob(p, normal, static_cast<uint32_t>(i)));
      // A branch whose clusters cannot be ruled out as a whole may have no light that can: what goes there is lost,
      // unnoticed.
      EXPECT_LT(sum, 1.0 + 1e-4);
      if (n == 1000 && length_squared(normal) == 0.0f) {
        EXPECT_GT(sum, 0.9);
      }
      int chosen = 0;
      for (int k = 0; k < 200; ++k) {
        ReusedNumber u(random.next_2d());
        const auto choice = tree.sample(p, normal, u);
        if (!(choice.prob > 0)) continue;
        ++chosen;
        ASSERT_EQ(choice.prob, tree.prob(p, normal, choice.emitter));
      }
      EXPECT_NEAR(chosen / 200.0, sum, 0.2);
    }
  }
}

TEST(LightTree, choices_follow_the_probabilities) {
  const int n = 200;
  const LightTree tree(scattered(n, 1.0f));
  const Vec3 p(0.3f, 0.4f, 0.2f);
  for (const Vec3& normal : {Vec3(0.0f), Vec3(0, 0, 1)}) {
    std::vector<double> observed(n + 1, 0.0), expected(n + 1, 0.0);
    const int count = 1'000'000;
    RandomStream random(4);
    for (int i = 0; i < count; ++i) {
      ReusedNumber u(random.next_2d());
      const auto choice = tree.sample(p, normal, u);
      observed[choice.prob > 0 ? choice.emitter : n] += 1.0;
    }
    double sum = 0.0;
    for (int i = 0; i < n; ++i)
      sum += expected[i] = static_cast<double>(tree.prob(p, normal, static_cast<uint32_t>(i)));
    expected[n] = std::max(1.0 - sum, 0.0);
    for (double& e : expected) e *= count;
    if (expected[n] < 1.0) {
      observed.pop_back();
      expected.pop_back();
    }
    EXPECT_GT(chi_square_test(observed, expected).p_value, sidak_significance(4));
  }
  std::vector<double> observed(n, 0.0), expected(n, 0.0);
  for (int i = 0; i < 1'000'000; ++i) {
    ReusedNumber u(Vec2((static_cast<float>(i) + 0.5f) * 1e-6f, 0.5f));
    observed[tree.sample_by_intensity(u).emitter] += 1.0;
  }
  for (int i = 0; i < n; ++i) {
    expected[i] = 1e6 * static_cast<double>(tree.prob_by_intensity(static_cast<uint32_t>(i)));
    EXPECT_NEAR(observed[i], expected[i], 2.0 + 1e-4 * expected[i]);
  }
}

TEST(LightTree, scaled_importance_changes_what_receivers_choose_and_not_what_emission_does) {
  auto lights = scattered(40, 1.0f);
  for (LightCluster& light : lights) {  // shining everywhere, so that every choice finds one
    light.cos_normals = -1.0f;
    light.cos_emission = 0.0f;
  }
  LightTree tree(lights);
  const LightTree before = tree;
  const std::vector<float> factors(20, 0.25f);  // the first half; the others keep theirs
  tree.scale_importance(factors);
  RandomStream random(5);
  for (int trial = 0; trial < 20; ++trial) {
    const Vec3 p(random.next_1d(), random.next_1d(), 2.0f + random.next_1d());
    double scaled = 0.0, all = 0.0, sampled = 0.0;
    for (uint32_t i = 0; i < 40; ++i) {
      EXPECT_EQ(tree.prob_by_intensity(i), before.prob_by_intensity(i));
      const double prob = static_cast<double>(tree.prob(p, Vec3(0.0f), i));
      all += prob;
      if (i < 20) scaled += prob;
    }
    EXPECT_NEAR(all, 1.0, 1e-4);
    double expected = 0.0;
    for (uint32_t i = 0; i < 20; ++i) expected += static_cast<double>(before.prob(p, Vec3(0.0f), i));
    // A quarter of the odds, but for clusters that hold lights of both halves.
    EXPECT_LT(scaled / (1.0 - scaled), 0.5 * expected / (1.0 - expected));
    EXPECT_GT(scaled, 0.0);
    for (int k = 0; k < 1000; ++k) {
      ReusedNumber u(random.next_2d());
      sampled += tree.sample(p, Vec3(0.0f), u).emitter < 20 ? 1e-3 : 0.0;
    }
    EXPECT_NEAR(sampled, scaled, 0.08);
  }
}

TEST(LightTree, every_light_that_may_contribute_can_be_chosen) {
  for (const float scale : {1e-6f, 1.0f, 1e6f}) {
    const auto lights = scattered(300, scale);
    const LightTree tree(lights);
    RandomStream random(6);
    int contributing = 0, chosen = 0;
    for (int trial = 0; trial < 300; ++trial) {
      const Vec3 p =
          Vec3(random.next_1d() * 2 - 0.5f, random.next_1d() * 2 - 0.5f, random.next_1d() * 2 - 0.5f) * scale;
      const Vec3 normal = trial % 2 ? sample_uniform_sphere(random.next_2d()) : Vec3(0.0f);
      for (uint32_t i = 0; i < lights.size(); ++i) {
        const float prob = tree.prob(p, normal, i);
        ASSERT_TRUE(prob >= 0.0f && prob <= 1.0f);
        chosen += prob > 0;
        if (upper_bound(lights[i], p, normal) > 0.0) {
          ++contributing;
          ASSERT_GT(prob, 0.0f) << "light " << i << " trial " << trial << " scale " << scale;
        }
      }
    }
    EXPECT_GT(contributing, 10000);
    EXPECT_LT(chosen, contributing * 1.3);  // and most of those that cannot are ruled out
  }
}

TEST(LightTree, choices_do_not_depend_on_the_scale) {
  const LightTree reference(scattered(500, 1.0f));
  for (const float scale : {0x1p-20f, 0x1p20f}) {
    const LightTree tree(scattered(500, scale));
    RandomStream random(8);
    for (int trial = 0; trial < 200; ++trial) {
      const Vec3 p(random.next_1d(), random.next_1d(), random.next_1d());
      const uint32_t light = random.next_u32() % 500;
      // Scaled by a power of two, so that everything rounds alike.
      EXPECT_EQ(reference.prob(p, Vec3(0, 0, 1), light), tree.prob(p * scale, Vec3(0, 0, 1), light));
    }
  }
}

TEST(LightTree, is_the_same_whatever_the_number_of_threads) {
  const auto lights = scattered(50000, 1.0f);
  const LightTree parallel(lights);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const LightTree serial(lights);
  EXPECT_EQ(parallel.leaf_order(), serial.leaf_order());
  RandomStream random(8);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 p(random.next_1d(), random.next_1d(), random.next_1d());
    const uint32_t light = random.next_u32() % 50000;
    EXPECT_EQ(parallel.prob(p, Vec3(0.0f), light), serial.prob(p, Vec3(0.0f), light));
  }
}

TEST(LightTree, probabilities_follow_the_irradiance_of_lights_in_a_row) {
  std::vector<LightCluster> lights(1000);
  RandomStream random(3);
  for (int i = 0; i < 1000; ++i) {
    lights[i].center = {static_cast<float>(i), 0, 0};
    lights[i].cos_normals = -1.0f;
    lights[i].intensity = 1.0 + 3.0 * static_cast<double>(random.next_1d());
  }
  const LightTree tree(lights);
  // Relative variance of estimating all light by one light: sum of share² / prob, minus 1. Choosing evenly gives
  // hundreds.
  double mean = 0.0;
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3 p(random.next_1d() * 1000, 0.3f + random.next_1d(), 0);
    double sum = 0.0, sum_of_squares = 0.0;
    for (uint32_t i = 0; i < 1000; ++i) {
      const double irradiance = lights[i].intensity / static_cast<double>(length_squared(lights[i].center - p));
      sum += irradiance;
      sum_of_squares += irradiance * irradiance / static_cast<double>(tree.prob(p, Vec3(0.0f), i));
    }
    mean += (sum_of_squares / (sum * sum) - 1.0) / 200;
  }
  EXPECT_LT(mean, 1.0);
}

TEST(LightTree, lights_in_one_place_and_extreme_powers_build_and_sample) {
  std::vector<LightCluster> lights(1000);
  for (int i = 0; i < 1000; ++i) {
    lights[i].center = Vec3(1.0f, 2.0f, 3.0f);
    lights[i].cos_normals = -1.0f;
    lights[i].intensity = i % 10 == 0 ? 0.0 : (i == 7 ? 1e30 : 1e-30);
  }
  const LightTree tree(lights);
  EXPECT_EQ(tree.size(), 900u);
  EXPECT_LE(tree.depth(), 16);
  for (const Vec3& p : {Vec3(1, 2, 3), Vec3(0.0f), Vec3(1e6f)}) {
    EXPECT_NEAR(tree.prob(p, Vec3(0.0f), 7), 1.0f, 1e-5f);
    EXPECT_EQ(tree.prob(p, Vec3(0.0f), 10), 0.0f);
    ReusedNumber u(Vec2(0.3f, 0.5f));
    EXPECT_EQ(tree.sample(p, Vec3(0.0f), u).emitter, 7u);
  }
  ReusedNumber u(Vec2(0.5f));
  EXPECT_EQ(tree.sample(Vec3(0.0f), Vec3(0, 0, -1), u).prob, 0.0f);
  EXPECT_TRUE(LightTree(std::vector<LightCluster>(3)).empty());
  EXPECT_TRUE(LightTree().empty());
}

TEST(LightTree, lights_at_ever_shorter_distances_stay_within_the_depth_of_a_path) {
  std::vector<LightCluster> lights(4000);
  for (size_t i = 0; i < lights.size(); ++i) {
    lights[i].center = Vec3(std::pow(2.0f, -static_cast<float>(i % 120)), static_cast<float>(i / 120) * 1e-6f, 0);
    lights[i].intensity = std::pow(1.5, static_cast<double>(i % 120));
    lights[i].cos_normals = -1.0f;
  }
  const LightTree tree(lights);
  EXPECT_LE(tree.depth(), 16);
  double sum = 0.0;
  for (uint32_t i = 0; i < lights.size(); ++i) {
    const float prob = tree.prob({0, 0, 1}, Vec3(0.0f), i);
    EXPECT_GT(prob, 0.0f);
    sum += static_cast<double>(prob);
  }
  EXPECT_NEAR(sum, 1.0, 1e-4);
}

TEST(LightTree, takes_about_fifty_bytes_a_light) {
  const LightTree tree(scattered(100000, 1.0f));
  EXPECT_LT(tree.bytes(), 100000u * 64u);
}

}  // namespace
}  // namespace lambent
