// Every integrator gives the path tracer's picture (Jung, Hanika & Dachsbacher 2020, "Detecting Bias in Monte Carlo
// Renderers using Welch's t-test").
//
// LAMBENT_AGREEMENT_SAMPLES: samples a pixel and batch, for a longer look (default 1). LAMBENT_AGREEMENT_REPORT: prints
// the means' ratios with their standard errors.
#include <gtest/gtest.h>

#include <numeric>

#include "tests/agreement/batches.h"
#include "tests/agreement/integrator_scene_parts.h"
#include "tests/agreement/integrator_scenes.h"

namespace lambent::test {
namespace {

constexpr int k_batches = 16;
/// Light tracing finds much of its light by rare and bright walks: batches of one sample are too far from normal for a
/// t-test (most hold none of them, and a tile's mean then looks sure and is wrong).
constexpr int k_light_tracing_factor = 8;
constexpr int k_parts = 20;  ///< of a picture: 16 tiles and 4 channels

const std::vector<IntegratorCase>& cases() {
  static const std::vector<IntegratorCase> all = integrator_cases();
  return all;
}

int comparisons() {
  int count = 0;
  for (const IntegratorCase& one : cases()) count += static_cast<int>(one.integrators.size()) * k_parts;
  return count;
}

class Integrators : public testing::TestWithParam<size_t> {};

TEST_P(Integrators, agree_with_the_path_tracer) {
  const IntegratorCase& one = cases()[GetParam()];
  SceneMaker maker = one.maker;
  const char* samples = std::getenv("LAMBENT_AGREEMENT_SAMPLES");
  const int64_t asked = samples ? std::max(1, std::atoi(samples)) : 1;
  maker.settings.samples = asked;
  const BatchMeans reference = render_batches(maker, "PT", k_batches, 1000);
  for (size_t i = 0; i < one.integrators.size(); ++i) {
    maker.settings.samples = one.integrators[i] == std::string("LT") ? k_light_tracing_factor * asked : asked;
    expect_same(render_batches(maker, one.integrators[i], k_batches, 2000 + 100 * static_cast<uint32_t>(i)), reference,
                comparisons(), one.name + " " + one.integrators[i]);
  }
}

// What no ray from the camera meets, and next events do not find either: photons that came by deltas alone bring it to
// narrow lobes.
TEST(Gloss, shows_photon_mapping_a_point_lamp_in_mirrors) {
  SceneMaker maker = corridor(glossy(0.3f), glossy(0.0f));
  maker.light("p", lamp(LightType::point, 60.0f), k_above);
  maker.settings.samples = 8;
  const BatchMeans reference = render_batches(maker, "BPT", k_batches, 1000);
  expect_same(render_batches(maker, "PPM", k_batches, 2000), reference, k_parts, "PPM");
  // The path tracer has less: the test sees the mirrors.
  const BatchMeans direct = render_batches(maker, "PT", k_batches, 3000);
  const auto mean_of = [](const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  };
  int darker = 0;
  for (size_t part = 0; part < 16; ++part)
    darker += mean_of(direct.values[part]) < 0.8 * mean_of(reference.values[part]);
  EXPECT_GE(darker, 4);
}

// Where all light walks are joined with narrow lobes, noise is some hundred times that of a ray (PPM 758, VPL 578
// here).
TEST(Gloss, is_about_as_noisy_as_in_the_path_tracer) {
  SceneMaker maker = lit_corridor(glossy(0.1f));
  maker.settings.samples = 4;
  const auto noise = [&](const char* integrator) {
    const BatchMeans found = render_batches(maker, integrator, k_batches, 1000);
    double sum = 0.0;
    for (size_t part = 0; part < 16; ++part) {
      const std::vector<double>& values = found.values[part];
      const double mean = std::accumulate(values.begin(), values.end(), 0.0) / k_batches;
      for (const double value : values) sum += (value - mean) * (value - mean);
    }
    return sum;
  };
  const double reference = noise("PT");
  EXPECT_LT(noise("PPM"), 10.0 * reference);
  EXPECT_LT(noise("VPL"), 10.0 * reference);
}

INSTANTIATE_TEST_SUITE_P(, Integrators, testing::Range(size_t{0}, cases().size()),
                         [](const testing::TestParamInfo<size_t>& one) { return cases()[one.param].name; });

}  // namespace
}  // namespace lambent::test
