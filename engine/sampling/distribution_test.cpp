#include "engine/sampling/distribution.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/sampling/chi_square.h"
#include "engine/sampling/filter.h"

namespace lambent {
namespace {

constexpr int k_tests = 8;

std::vector<float> bumpy(int n) {
  std::vector<float> weights(static_cast<size_t>(n));
  for (int i = 0; i < n; ++i)
    weights[static_cast<size_t>(i)] = i % 7 == 3 ? 0.0f : 1.0f + 5.0f * std::sin(0.3f * static_cast<float>(i * i));
  for (float& w : weights) w = std::fabs(w);
  return weights;
}

TEST(Distribution1D, samples_follow_the_weights_and_invert) {
  const auto weights = bumpy(100);
  const Distribution1D distribution(weights);
  const auto result = chi_square_test_2d(
      {0, 0}, {1, 1}, [&](const Vec2& u) { return Vec2(distribution.sample(u.x).x, u.y); },
      [&](const Vec2& p) { return distribution.pdf(p.x); }, 100);
  EXPECT_GT(result.p_value, sidak_significance(k_tests));
  EXPECT_NEAR(result.total_probability, 1.0, 1e-4);
  double sum = 0;
  for (const float w : weights) sum += static_cast<double>(w);
  EXPECT_NEAR(distribution.integral(), sum / 100, 1e-6);
  RandomStream random(1);
  for (int i = 0; i < 1000; ++i) {
    const float u = random.next_1d();
    const auto sample = distribution.sample(u);
    ASSERT_NEAR(distribution.invert(sample.x), u, 1e-5f);
    ASSERT_NEAR(distribution.pdf(sample.x), sample.pdf, 1e-6f);
    ASSERT_NEAR(sample.pdf, static_cast<double>(weights[static_cast<size_t>(sample.cell)]) * 100 / sum, 1e-4);
    ASSERT_GT(sample.pdf, 0.0f);
  }
}

TEST(Distribution1D, cells_without_weight_are_never_sampled) {
  const float weights[] = {0, 0, 1, 0, 2, 0, 0};
  const Distribution1D distribution(weights);
  for (const float u : {0.0f, 0.1f, 1.0f / 3, 0.33333f, 0.33334f, 0.9f, k_one_minus_epsilon}) {
    const auto sample = distribution.sample(u);
    EXPECT_TRUE(sample.cell == 2 || sample.cell == 4) << u;
    EXPECT_GT(sample.pdf, 0.0f);
    EXPECT_GE(sample.x * 7, static_cast<float>(sample.cell) - 1e-5f);
    EXPECT_LT(sample.x * 7, static_cast<float>(sample.cell + 1));
  }
}

TEST(Distribution1D, bad_weights_count_as_zero_and_none_at_all_mean_uniform) {
  const float bad[] = {NAN, -1.0f, INFINITY, 1e38f, 1e38f};
  const Distribution1D distribution(bad);
  EXPECT_EQ(distribution.prob(0), 0.0f);
  EXPECT_NEAR(distribution.prob(3), 0.5f, 1e-6f);
  const float zeros[] = {0, 0};
  EXPECT_EQ(Distribution1D(zeros).pdf(0.7f), 1.0f);
  EXPECT_EQ(Distribution1D().sample(0.25f).x, 0.25f);
  EXPECT_EQ(Distribution1D(zeros).integral(), 0.0);
}

TEST(Distribution2D, samples_follow_the_weights_and_invert_at_any_scale) {
  for (const float scale : {1e-30f, 1.0f, 1e30f}) {
    auto weights = bumpy(40 * 25);
    for (float& w : weights) w *= scale;
    for (int x = 0; x < 40; ++x) weights[static_cast<size_t>(40 * 6 + x)] = 0.0f;  // a row without weight
    const Distribution2D distribution(weights, 40, 25);
    const auto result = chi_square_test_2d(
        {0, 0}, {1, 1}, [&](const Vec2& u) { return distribution.sample(u, nullptr); },
        [&](const Vec2& p) { return distribution.pdf(p); }, 40);
    EXPECT_GT(result.p_value, sidak_significance(k_tests));
    EXPECT_NEAR(result.total_probability, 1.0, 1e-4);
    RandomStream random(1);
    for (int i = 0; i < 1000; ++i) {
      const Vec2 u = random.next_2d();
      float pdf = 0.0f;
      const Vec2 p = distribution.sample(u, &pdf);
      const Vec2 back = distribution.invert(p);
      ASSERT_NEAR(back.x, u.x, 1e-4f);
      ASSERT_NEAR(back.y, u.y, 1e-4f);
      ASSERT_FLOAT_EQ(distribution.pdf(p), pdf);
    }
  }
}

TEST(Distribution2D, nonsense_sizes_mean_uniform) {
  EXPECT_EQ(Distribution2D({}, 10, 10).pdf({0.5f, 0.5f}), 1.0f);
  EXPECT_EQ(Distribution2D().pdf({0.5f, 1.5f}), 0.0f);
}

TEST(PixelFilter, offsets_follow_the_density) {
  for (const auto kind : {FilterKind::box, FilterKind::gaussian, FilterKind::blackman_harris}) {
    const PixelFilter filter(kind, 1.5f);
    const float r = filter.radius_px();
    const auto result = chi_square_test_2d(
        {-r, -r}, {r, r}, [&](const Vec2& u) { return filter.sample(u); },
        [&](const Vec2& p) { return filter.density(p); }, 60);
    EXPECT_GT(result.p_value, sidak_significance(k_tests)) << static_cast<int>(kind);
    EXPECT_NEAR(result.total_probability, 1.0, 2e-3);
  }
}

TEST(PixelFilter, shapes_are_those_of_cycles) {
  EXPECT_EQ(PixelFilter(FilterKind::box, 3.0f).radius_px(), 0.5f);
  EXPECT_EQ(PixelFilter(FilterKind::gaussian, 2.0f).radius_px(), 3.0f);
  EXPECT_EQ(PixelFilter(FilterKind::blackman_harris, 1.5f).radius_px(), 1.5f);
  EXPECT_EQ(PixelFilter(FilterKind::gaussian, NAN).radius_px(), 0.5f);
  // Gaussian of sigma = width / 4 = 0.5, Blackman-Harris relative to its centre. The tables are exact to their cells.
  const PixelFilter gaussian(FilterKind::gaussian, 2.0f), harris(FilterKind::blackman_harris, 1.5f);
  const double peak = 1.0 / (2.0 * std::numbers::pi * 0.25);
  EXPECT_NEAR(static_cast<double>(gaussian.density({0, 0})) / peak, 1.0, 2e-3);
  EXPECT_NEAR(static_cast<double>(gaussian.density({0.5f, 0})) / peak, std::exp(-0.5), 2e-3);
  EXPECT_NEAR(harris.density({0.75f, 0}) / harris.density({0, 0}), 0.35875f - 0.14128f, 3e-3f);  // phase 3/2 pi
  EXPECT_EQ(gaussian.density({3.1f, 0}), 0.0f);
}

}  // namespace
}  // namespace lambent
