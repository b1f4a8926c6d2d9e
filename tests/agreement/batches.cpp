#include "tests/agreement/batches.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numeric>

#include "engine/sampling/chi_square.h"
#include "tests/common/welch.h"

namespace lambent::test {

namespace {

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

void add_batch(const Picture& picture, BatchMeans& means) {
  const Rectangle& region = picture.rendered;
  size_t part = 0;
  const auto add = [&](const std::string& name, double value) {
    if (part == means.names.size()) {
      means.names.push_back(name);
      means.values.emplace_back();
    }
    means.values[part++].push_back(value);
  };
  const auto sum = [&](int x0, int y0, int x1, int y1, int first, int channels) {
    double total = 0.0;
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x)
        for (int c = first; c < first + channels; ++c)
          total += static_cast<double>(
              picture.pixels[4 * (static_cast<size_t>(y) * picture.width + static_cast<size_t>(x)) + c]);
    return total / ((x1 - x0) * (y1 - y0));
  };
  const int right = region.x + region.width, top = region.y + region.height;
  for (int y = region.y; y < top; y += BatchMeans::k_tile_px)
    for (int x = region.x; x < right; x += BatchMeans::k_tile_px)
      add(fmt::format("tile {},{}", x, y),
          sum(x, y, std::min(x + BatchMeans::k_tile_px, right), std::min(y + BatchMeans::k_tile_px, top), 0, 3));
  for (int c = 0; c < 4; ++c) add(std::string("channel ") + "RGBA"[c], sum(region.x, region.y, right, top, c, 1));
}

}  // namespace

BatchMeans render_batches(SceneMaker maker, const std::string& name, int batches, uint32_t first_seed) {
  EngineOptions options;
  options.threads = 1;
  RenderOutcome outcome;
  SessionEvents events;
  events.done = [&](const RenderOutcome& done) { outcome = done; };
  Session session(Engine::create(options), events);
  BatchMeans means;
  maker.settings.integrator = name;
  session.apply(maker.transaction());
  for (int batch = 0; batch < batches; ++batch) {
    maker.settings.seed = first_seed + static_cast<uint32_t>(batch);
    session.apply({batch + 1, {description::Upsert{"render", maker.settings}}});
    session.start(batch + 1);
    session.wait();
    EXPECT_EQ(outcome.status, RenderStatus::finished) << outcome.message;
    if (outcome.status != RenderStatus::finished) return means;
    means.non_finite += outcome.statistics.non_finite;
    add_batch(session.picture(), means);
  }
  return means;
}

void expect_same(const BatchMeans& found, const BatchMeans& reference, int comparisons, const std::string& what) {
  ASSERT_EQ(found.names, reference.names) << what;
  EXPECT_EQ(found.non_finite, 0u) << what;
  const double significance = sidak_significance(comparisons);
  const bool report = std::getenv("LAMBENT_AGREEMENT_REPORT") != nullptr;
  for (size_t part = 0; part < found.names.size(); ++part) {
    const double expected = mean_of(reference.values[part]);
    // Sums in float differ in the last digits where nothing is random.
    const WelchResult result = welch_test(found.values[part], reference.values[part], 1e-5 * std::fabs(expected));
    EXPECT_GE(result.p_value, significance) << what << ", " << found.names[part] << ": " << mean_of(found.values[part])
                                            << " instead of " << expected << ", t = " << result.t();
    if (report && found.names[part].starts_with("channel"))
      fmt::print("{:50} {} {:.5g} ratio {:.4f} +- {:.4f} t {:.2f}\n", what, found.names[part], expected,
                 mean_of(found.values[part]) / expected, result.standard_error / std::fabs(expected), result.t());
  }
}

}  // namespace lambent::test
