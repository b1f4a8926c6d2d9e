// Every integrator gives the path tracer's picture (Jung, Hanika & Dachsbacher 2020, "Detecting Bias in Monte Carlo
// Renderers using Welch's t-test").
//
// LAMBENT_AGREEMENT_SAMPLES: samples a pixel and batch, for a longer look (default 1). LAMBENT_AGREEMENT_REPORT: prints
// the means' ratios with their standard errors.
#include <gtest/gtest.h>

#include "tests/agreement/batches.h"
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

INSTANTIATE_TEST_SUITE_P(, Integrators, testing::Range(size_t{0}, cases().size()),
                         [](const testing::TestParamInfo<size_t>& one) { return cases()[one.param].name; });

}  // namespace
}  // namespace lambent::test
