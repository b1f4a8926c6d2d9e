// Adaptive sampling (noise_threshold) through whole renders: it stops where the noise is what was asked for, and the
// picture stays right.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/film/adaptive.h"
#include "tests/common/scene_maker.h"

namespace lambent::test {
namespace {

constexpr int k_seeds = 8;

/// A room corner under a sheet of light: noise that differs from place to place, without caustics, whose rare bright
/// samples make every measure of noise unreliable.
SceneMaker corner(int64_t samples) {
  SceneMaker maker(32, 24, samples);
  maker.material("white", diffuse(Color(0.7f)))
      .material("red", diffuse(Color(0.7f, 0.1f, 0.1f)))
      .material("lamp", emission(Color(1.0f, 0.9f, 0.8f), 5.0f));
  maker.mesh("floor", {{-3, -1, 0}, {3, -1, 0}, {3, -1, -6}, {-3, -1, -6}}, {{0, 1, 2}, {0, 2, 3}}, "white");
  maker.mesh("back", {{-3, -1, -6}, {3, -1, -6}, {3, 3, -6}, {-3, 3, -6}}, {{0, 1, 2}, {0, 2, 3}}, "red");
  maker.mesh("sheet", {{-1, 2.5f, -3}, {1, 2.5f, -3}, {1, 2.5f, -5}, {-1, 2.5f, -5}}, {{0, 1, 2}, {0, 2, 3}}, "lamp");
  maker.sphere("ball", Vec3(-0.7f, -0.4f, -3.5f), 0.6f, 16, "white");
  return maker;
}

/// R+G+B of each pixel, for each of k_seeds seeds; and how many samples they took on average.
struct Batch {
  std::vector<std::vector<double>> pixels;
  double samples_a_pixel = 0.0;
};
Batch render_batch(SceneMaker maker, uint32_t first_seed) {
  Batch batch;
  for (uint32_t seed = 0; seed < k_seeds; ++seed) {
    maker.settings.seed = first_seed + seed;
    RenderOutcome outcome;
    const Picture picture = render(maker.transaction(), 0, &outcome);
    EXPECT_EQ(outcome.status, RenderStatus::finished) << outcome.message;
    std::vector<double>& pixels = batch.pixels.emplace_back(static_cast<size_t>(picture.width) * picture.height);
    for (size_t i = 0; i < pixels.size(); ++i)
      pixels[i] = double(picture.pixels[4 * i]) + picture.pixels[4 * i + 1] + picture.pixels[4 * i + 2];
    batch.samples_a_pixel += double(outcome.statistics.paths) / double(pixels.size()) / k_seeds;
  }
  return batch;
}

/// Root mean square over the pixels of the noise measure of adaptive.h, from the scatter between seeds.
double true_noise(const Batch& batch) {
  const size_t count = batch.pixels[0].size();
  double sum = 0.0;
  for (size_t i = 0; i < count; ++i) {
    double mean = 0.0, squares = 0.0;
    for (const auto& pixels : batch.pixels) mean += pixels[i] / k_seeds;
    for (const auto& pixels : batch.pixels) squares += (pixels[i] - mean) * (pixels[i] - mean);
    sum += squares / (k_seeds - 1) / ((1e-4 + std::sqrt(mean)) * (1e-4 + std::sqrt(mean)));
  }
  return std::sqrt(sum / double(count));
}

/// Mean of all pixels, and its standard error from the scatter between seeds.
std::pair<double, double> level(const Batch& batch) {
  double sum = 0.0, squares = 0.0;
  for (const auto& pixels : batch.pixels) {
    double mean = 0.0;
    for (const double value : pixels) mean += value / double(pixels.size());
    sum += mean / k_seeds;
    squares += mean * mean / k_seeds;
  }
  return {sum, std::sqrt(std::max(0.0, squares - sum * sum) / (k_seeds - 1))};
}

TEST(AdaptiveSampling, ends_with_no_more_noise_than_was_asked_for_and_the_right_brightness) {
  const Batch fixed = render_batch(corner(512), 100);
  const auto [expected, expected_error] = level(fixed);
  double samples_before = 0.0;
  for (const float threshold : {0.1f, 0.05f, 0.025f}) {
    SCOPED_TRACE(threshold);
    SceneMaker maker = corner(1 << 16);
    maker.settings.noise_threshold = threshold;
    const Batch batch = render_batch(maker, 1);
    EXPECT_LT(true_noise(batch), threshold);
    EXPECT_GT(batch.samples_a_pixel, samples_before) << "a stricter threshold takes more samples";
    EXPECT_LT(batch.samples_a_pixel, 1 << 12) << "it stopped by the threshold, far from the limit";
    samples_before = batch.samples_a_pixel;
    const auto [brightness, error] = level(batch);
    EXPECT_NEAR(brightness, expected, 4.5 * std::hypot(error, expected_error));
  }
}

/// The corner with its lamp behind a lens of glass: most of its light comes by splats alone.
SceneMaker corner_with_caustic(int64_t samples) {
  SceneMaker maker = corner(samples);
  maker.material("glass", single("BsdfGlass", {{"Color", description::Numbers{1, 1, 1, 1}}, {"Roughness", 0.0f}}));
  maker.sphere("lens", Vec3(0.8f, 0.2f, -3.5f), 0.5f, 16, "glass", /*smooth=*/true);
  return maker;
}

TEST(AdaptiveSampling, knows_the_noise_of_splats) {
  // All that LT finds is splats, and most of what BPT finds of the lens's caustic.
  struct Case {
    const char* integrator;
    bool caustic;
    float threshold;
  };
  for (const Case& one : {Case{"LT", false, 0.4f}, {"BPT", true, 0.1f}, {"VCM", true, 0.2f}}) {
    SCOPED_TRACE(one.integrator + std::string(one.caustic ? ", caustic" : ""));
    const auto scene = [&](int64_t samples) {
      SceneMaker maker = one.caustic ? corner_with_caustic(samples) : corner(samples);
      maker.settings.integrator = one.integrator;
      return maker;
    };
    const auto [expected, expected_error] = level(render_batch(scene(256), 100));
    SceneMaker maker = scene(1 << 13);
    maker.settings.noise_threshold = one.threshold;
    const Batch batch = render_batch(maker, 1);
    EXPECT_LT(true_noise(batch), one.threshold);
    EXPECT_LT(batch.samples_a_pixel, 1 << 12) << "it stopped by the threshold, far from the limit";
    const auto [brightness, error] = level(batch);
    EXPECT_NEAR(brightness, expected, 4.5 * std::hypot(error, expected_error));
  }
}

TEST(AdaptiveSampling, leaves_photon_mapping_as_bright_as_it_is) {
  // Pixels that stop must not take their photons out of the map that the others merge with.
  SceneMaker maker = corner(256);
  maker.settings.integrator = "PPM";
  maker.settings.merge_alpha = 1.0f;
  const auto [expected, expected_error] = level(render_batch(maker, 50));
  maker.settings.noise_threshold = 0.1f;
  const Batch batch = render_batch(maker, 70);
  EXPECT_LT(batch.samples_a_pixel, 230) << "some pixels stopped";
  const auto [brightness, error] = level(batch);
  EXPECT_NEAR(brightness, expected, 4.5 * std::hypot(error, expected_error));
}

}  // namespace
}  // namespace lambent::test
