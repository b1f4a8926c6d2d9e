#include "engine/cli/image_comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lambent {
namespace {

ImageLayer noise(int side, double mean, double deviation, unsigned seed) {
  ImageLayer image{side, side, {"R", "G", "B"}, {}};
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(mean, deviation);
  for (size_t i = 0; i < image.pixel_count() * 3; ++i) image.pixels.push_back(static_cast<float>(normal(random)));
  return image;
}

ImageLayer constant(int side, float value) {
  return {side, side, {"R", "G", "B"}, std::vector<float>(size_t(side) * side * 3, value)};
}

TEST(ImageComparison, an_image_is_the_same_as_itself) {
  const ImageLayer image = noise(64, 0.5, 0.2, 1);
  const ImageComparison found = compare_images(image, image, {});
  EXPECT_EQ(found.rel_mse, 0.0);
  EXPECT_EQ(found.max_error, 0.0);
  EXPECT_EQ(found.mean_ratio, 1.0);
  EXPECT_EQ(found.failed_tiles, 0u);
  EXPECT_EQ(found.tiles, 16u);
}

TEST(ImageComparison, measures_have_their_definitions) {
  const ImageComparison found = compare_images(constant(16, 0.6f), constant(16, 0.5f), {});
  EXPECT_NEAR(found.rel_mse, 0.01 / 0.26, 1e-6);
  EXPECT_NEAR(found.smape, 0.1 / 1.1, 1e-6);
  EXPECT_NEAR(found.mean_ratio, 1.2, 1e-6);
  EXPECT_NEAR(found.max_error, 0.1, 1e-6);
  EXPECT_EQ(found.failed_tiles, 1u);  // different without noise
}

TEST(ImageComparison, the_trimmed_error_is_that_without_the_worst_thousandth) {
  ImageLayer image = constant(100, 0.6f);  // 10,000 pixels, 10 of them left out
  for (size_t i = 0; i < 11; ++i) image.pixels[i * 3] = 1e4f;
  const ImageComparison found = compare_images(image, constant(100, 0.5f), {});
  const double one = (1e4 - 0.5) * (1e4 - 0.5) / 0.26, usual = 0.01 / 0.26;
  EXPECT_NEAR(found.rel_mse / ((11 * one + (30000 - 11) * usual) / 30000), 1.0, 1e-6);
  EXPECT_NEAR(found.rel_mse_trimmed / ((one + (9990 * 3 - 1) * usual) / (9990 * 3)), 1.0, 1e-6);
}

TEST(ImageComparison, smape_is_1_where_only_one_picture_has_light_and_0_where_neither_has) {
  ImageLayer half = constant(16, 0.0f);
  for (size_t i = 0; i < half.pixels.size() / 2; ++i) half.pixels[i] = 3.0f;
  EXPECT_NEAR(compare_images(half, constant(16, 0.0f), {}).smape, 0.5, 1e-12);
  EXPECT_EQ(compare_images(constant(16, 0.0f), constant(16, 0.0f), {}).smape, 0.0);
}

TEST(ImageComparison, independent_noise_of_one_mean_passes_at_its_significance) {
  // With 1% for the whole test, 100 comparisons fail about once; 8 or more have a probability below 1e-6.
  int failed = 0;
  for (unsigned i = 0; i < 100; ++i)
    failed += compare_images(noise(64, 0.5, 0.2, 2 * i + 1), noise(64, 0.5, 0.2, 2 * i + 2), {}).failed_tiles > 0;
  EXPECT_LT(failed, 8);
}

TEST(ImageComparison, a_small_bias_in_one_tile_is_found_there) {
  ImageLayer biased = noise(64, 0.5, 0.05, 3);
  for (int y = 16; y < 32; ++y)
    for (int x = 48; x < 64; ++x)
      for (int c = 0; c < 3; ++c) biased.pixels[(y * 64 + x) * 3 + c] += 0.03f;
  const ImageComparison found = compare_images(biased, noise(64, 0.5, 0.05, 4), {});
  ASSERT_EQ(found.failed_tiles, 1u);
  EXPECT_EQ(found.worst_tiles[0].x, 48);
  EXPECT_EQ(found.worst_tiles[0].y, 16);
  EXPECT_NEAR(found.worst_tiles[0].difference, 0.03, 0.01);
}

TEST(ImageComparison, given_variances_decide_instead_of_the_spread) {
  const ImageLayer a = noise(64, 0.5, 0.05, 5), b = noise(64, 0.51, 0.05, 6);
  const ImageLayer true_variance = constant(64, 0.0025f), large_variance = constant(64, 1.0f);
  EXPECT_GT(compare_images(a, b, {}, &true_variance, &true_variance).failed_tiles, 0u);
  EXPECT_EQ(compare_images(a, b, {}, &large_variance, &large_variance).failed_tiles, 0u);
}

TEST(ImageComparison, pixels_that_are_not_finite_are_counted_and_left_out) {
  ImageLayer a = constant(16, 0.5f);
  a.pixels[3] = NAN;
  a.pixels[30] = INFINITY;
  const ImageComparison found = compare_images(a, constant(16, 0.5f), {});
  EXPECT_EQ(found.non_finite, 2u);
  EXPECT_EQ(found.rel_mse, 0.0);
}

}  // namespace
}  // namespace lambent
