// Each technique alone, unweighted, is an unbiased estimate of the path lengths that it can sample: all of them give
// the same mean, and so does their weighted sum.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>
#include <mutex>
#include <numeric>

#include "engine/sampling/chi_square.h"
#include "tests/agreement/integrator_scenes.h"
#include "tests/common/direct_render.h"
#include "tests/common/welch.h"

namespace lambent::test {
namespace {

constexpr int k_batches = 16, k_longest = 4;

/// Sums contributions by path length and technique; that called "weighted" is all of them with their weights.
class Sums final : public ContributionObserver {
 public:
  void on_contribution(const Contribution& c) override {
    // Light walks also reach the filter's rim around the frame.
    if (c.raster_px.x < 0.0f || c.raster_px.y < 0.0f || c.raster_px.x >= 16.0f || c.raster_px.y >= 16.0f) return;
    const std::lock_guard lock(mutex_);
    const double gray = (static_cast<double>(c.value.x) + c.value.y + c.value.z) / 3.0;
    weighted_[c.vertices] += gray * static_cast<double>(c.weight);
    alone_[{c.vertices, c.technique,
            c.technique == Technique::connection || c.technique == Technique::merging ? c.camera_vertices : 0}] += gray;
  }
  using Key = std::tuple<int, Technique, int>;
  std::map<int, double> weighted_;
  std::map<Key, double> alone_;

 private:
  std::mutex mutex_;
};

/// Batches of sums over the picture, a sample: by technique, and weighted.
struct Alone {
  std::map<int, std::vector<double>> weighted;
  std::map<Sums::Key, std::vector<double>> alone;
};

Alone observe(const std::string& integrator, const SceneMaker& maker, int64_t samples) {
  const std::shared_ptr<const Scene> scene = build_scene(maker);
  Alone result;
  for (int batch = 0; batch < k_batches; ++batch) {
    const auto sums = std::make_shared<Sums>();
    IntegratorSettings settings;
    settings.seed = 70 + static_cast<uint32_t>(batch);
    settings.bounces = {k_longest - 1, k_longest, k_longest, k_longest, 8};
    settings.observer = sums;
    settings.merge_radius_px = 1.0f;
    render_directly(integrator, scene, settings, samples);
    const double samples_in_all = static_cast<double>(samples) * maker.settings.width * maker.settings.height;
    for (const auto& [n, sum] : sums->weighted_) {
      result.weighted[n].resize(k_batches);
      result.weighted[n][static_cast<size_t>(batch)] = sum / samples_in_all;
    }
    for (const auto& [key, sum] : sums->alone_) {
      result.alone[key].resize(k_batches);
      result.alone[key][static_cast<size_t>(batch)] = sum / samples_in_all;
    }
  }
  return result;
}

/// Floor and ceiling that do not touch: connections have no corner where 1/d² is unbounded. The camera sees floor
/// alone.
SceneMaker two_sheets(description::Graph floor, description::Graph ceiling) {
  SceneMaker maker(16, 16, 1);
  maker.camera.transform = aimed({0, 0, 2}, {0, 0, 0});
  maker.material("floor", std::move(floor)).material("ceiling", std::move(ceiling));
  maker.mesh("floor", {{-1.5f, -1.5f, 0}, {1.5f, -1.5f, 0}, {1.5f, 1.5f, 0}, {-1.5f, 1.5f, 0}}, {{0, 1, 2}, {0, 2, 3}},
             "floor");
  maker.mesh("ceiling", {{-1.5f, -1.5f, 2.2f}, {-1.5f, 1.5f, 2.2f}, {1.5f, 1.5f, 2.2f}, {1.5f, -1.5f, 2.2f}},
             {{0, 1, 2}, {0, 2, 3}}, "ceiling");
  return maker;
}

class Techniques : public testing::TestWithParam<const char*> {
 public:
  SceneMaker scene() const {
    const std::string name = GetParam();
    const description::Graph gray = diffuse(Color(0.7f));
    const description::Graph gloss =
        single("BsdfGlossy", {{"Color", description::Numbers{0.8f, 0.8f, 0.8f, 1}}, {"Roughness", 0.7f}},
               {{"distribution", std::string("GGX")}});
    SceneMaker maker = two_sheets(name == "gloss" ? gloss : gray, gray);
    description::Light light;
    light.type = description::LightType::area;
    light.size_m = {1.0f, 1.0f};
    light.energy = 50.0f;
    const Transform down = aimed({0.2f, 0.3f, 2.1f}, {0.2f, 0.3f, 0});
    if (name == "environment") {
      maker.world(background(Color(0.5f)));
    } else if (name == "uneven_environment") {
      maker.world(uneven_world());
    } else if (name == "sun") {
      light.type = description::LightType::sun;
      light.angle_rad = 0.6f;
      light.energy = 2.0f;
      maker.light("l", light, aimed({2, 2, 1}, {0, 0, 0}));
    } else if (name == "point") {
      light.type = description::LightType::point;
      light.radius_m = 0.3f;
      maker.light("l", light, Transform::translation({0.9f, 0.9f, 1.4f}));
    } else if (name == "mesh") {
      maker.material("e", emission(Color(1.0f), 4.0f));
      maker.mesh("e", {{0, 0, 2.1f}, {1, 0.2f, 2.0f}, {0.8f, 1, 2.1f}}, {{0, 1, 2}}, "e");
    } else {
      maker.light("l", light, down);
    }
    return maker;
  }
};

TEST_P(Techniques, each_alone_is_unbiased_for_the_lengths_it_can_sample) {
  // Weights are each other's: that those of one family sum up right is seen from another.
  const Alone bpt = observe("BPT", scene(), 4);
  const Alone bpm = observe("BPM", scene(), 4);
  std::map<int, std::vector<double>> bpm_weighted = bpm.weighted;
  // Light that shines on the floor alone reaches the camera, which sees it alone, by odd numbers of vertices.
  const std::string name = GetParam();
  const int step = name == "area" || name == "gloss" || name == "sun" ? 2 : 1;
  int compared = 0;
  constexpr int k_comparisons = 7 * 2 * 4 * 8;
  const auto expect = [&](const std::vector<double>& found, int n, const std::string& what) {
    ++compared;
    if (found.empty() || !bpt.weighted.contains(n)) {
      ADD_FAILURE() << GetParam() << ", " << n << " vertices, " << what << ": nothing was found";
      return;
    }
    const std::vector<double>& reference = bpt.weighted.at(n);
    const WelchResult result = welch_test(found, reference);
    EXPECT_GE(result.p_value, sidak_significance(k_comparisons))
        << GetParam() << ", " << n << " vertices, " << what << ": "
        << std::accumulate(found.begin(), found.end(), 0.0) / k_batches << " instead of "
        << std::accumulate(reference.begin(), reference.end(), 0.0) / k_batches << ", t = " << result.t();
  };
  for (const Alone* family : {&bpt, &bpm}) {
    for (const auto& [key, found] : family->alone) {
      const auto& [n, technique, vertex] = key;
      if (n >= 1 && n <= k_longest)
        expect(found, n, fmt::format("technique {} at {}", static_cast<int>(technique), vertex));
    }
    if (family == &bpm)
      for (int n = 1; n <= k_longest; n += step) expect(bpm_weighted[n], n, "photons, weighted");
  }
  // By length an emission hit, a next event (an even world has none: EvenWorld), light tracing (but for direct light),
  // n - 1 connections, n mergings, and the weighted sum.
  int expected = 0;
  for (int n = 1; n <= k_longest; n += step) expected += (name == "environment" ? 2 : 3) - (n == 1) + (n - 1) + n + 1;
  EXPECT_GE(compared, expected);
}

INSTANTIATE_TEST_SUITE_P(, Techniques,
                         testing::Values("area", "gloss", "environment", "uneven_environment", "sun", "point", "mesh"),
                         [](const testing::TestParamInfo<const char*>& one) { return std::string(one.param); });

}  // namespace
}  // namespace lambent::test
