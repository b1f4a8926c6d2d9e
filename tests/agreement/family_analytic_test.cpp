// Renders whose answer is known in closed form, by every integrator. Batches give the noise: pixels that share photons
// are not independent.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "engine/sampling/chi_square.h"
#include "tests/agreement/batches.h"
#include "tests/common/welch.h"

namespace lambent::test {
namespace {

constexpr int k_batches = 8;
constexpr int k_comparisons = 60;  ///< of this file

/// Mean of the picture's channels against `expected`; `model_error` is what the scene's polygons differ from its ideal.
void expect_answer(const SceneMaker& maker, const std::string& integrator, double expected, double model_error = 1e-5) {
  const BatchMeans means = render_batches(maker, integrator, k_batches, 300);
  EXPECT_EQ(means.non_finite, 0u);
  const size_t red = means.names.size() - 4;
  ASSERT_EQ(means.names[red], "channel R");
  const std::vector<double>& values = means.values[red];
  const double exact[2] = {expected, expected};
  const WelchResult result = welch_test(values, exact, model_error * expected);
  EXPECT_GE(result.p_value, sidak_significance(k_comparisons))
      << integrator << ": " << std::accumulate(values.begin(), values.end(), 0.0) / k_batches << " +- "
      << result.standard_error << " instead of " << expected;
  EXPECT_LT(result.standard_error, 0.05 * expected) << integrator << ": too noisy to say anything";
}

class EveryIntegrator : public testing::TestWithParam<const char*> {
 public:
  std::string name() const { return GetParam(); }
  bool merges() const { return name() == "PPM" || name() == "BPM" || name() == "VCM"; }
};

TEST_P(EveryIntegrator, finds_the_geometric_series_in_a_closed_emitting_sphere) {
  // Every point emits 1 and reflects half: after k bounces the sum of k + 2 terms of 1/2^i.
  for (const int bounces : {0, 1, 3}) {
    SceneMaker maker(16, 16, 4);
    maker.material("m", diffuse_emitter(Color(0.5f), Color(1.0f))).sphere("s", Vec3(0.0f), 1.0f, 16, "m");
    maker.settings.max_bounces = maker.settings.diffuse_bounces = bounces;
    maker.settings.merge_radius_px = 1.0f;
    maker.settings.shared_light_paths = 4;
    // Merging takes photons for those of a flat disk: around the polyhedron's edges (11 degrees) there are a few more.
    expect_answer(maker, name(), 2.0 * (1.0 - std::pow(0.5, bounces + 2)), merges() ? 5e-3 : 1e-5);
  }
}

TEST_P(EveryIntegrator, finds_radiance_1_around_a_point_light_in_a_sphere) {
  // Intensity pi in a unit sphere of albedo 1/2: irradiance pi, first radiance 1/2, and 1/2 + 1/4 + ... = 1.
  SceneMaker maker(16, 16, 8);
  maker.material("m", diffuse(Color(0.5f))).sphere("s", Vec3(0.0f), 1.0f, 64, "m");
  maker.settings.merge_radius_px = 1.0f;
  description::Light light;
  light.energy = 4.0f * k_pi * k_pi;
  maker.light("l", light, Transform());
  // The polyhedron of 64 rings is 2e-3 smaller than the sphere.
  expect_answer(maker, name(), 1.0, 3e-3);
}

/// Mean over the floor's patch [-1, 1]² of an irradiance given by floor position.
template <typename Irradiance>
double mean_over_patch(Irradiance&& irradiance) {
  constexpr int k_steps = 200;
  double sum = 0.0;
  for (int i = 0; i < k_steps; ++i)
    for (int j = 0; j < k_steps; ++j)
      sum += irradiance(Vec3d(2.0 * (i + 0.5) / k_steps - 1.0, 2.0 * (j + 0.5) / k_steps - 1.0, 0.0));
  return sum / (k_steps * k_steps);
}

/// A white floor of 4 x 4 m whose middle [-1, 1]² is seen from above, at z = 0.
SceneMaker floor_patch() {
  SceneMaker maker(16, 16, 8);
  maker.camera.type = description::CameraType::orthographic;
  maker.camera.ortho_scale = 2.0f;
  maker.camera.transform = Transform::translation({0, 0, 0.5f});
  maker.material("floor", diffuse(Color(1.0f)));
  maker.mesh("floor", {{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}}, {{0, 1, 2}, {0, 2, 3}}, "floor");
  maker.settings.max_bounces = 0;
  maker.settings.merge_radius_px = 0.5f;
  return maker;
}

TEST_P(EveryIntegrator, finds_lamberts_irradiance_of_a_polygon) {
  // E = (L/2) sum gamma_i (n · Gamma_i) for a square of side 2 at height 1.5 (Lambert; Arvo 1995).
  const Vec3d corner[4] = {{-1, -1, 1.5}, {1, -1, 1.5}, {1, 1, 1.5}, {-1, 1, 1.5}};
  const double expected = mean_over_patch([&](const Vec3d& p) {
    double sum = 0.0;
    for (int i = 0; i < 4; ++i) {
      const Vec3d a = (corner[i] - p).normalized(), b = (corner[(i + 1) % 4] - p).normalized();
      sum += 0.5 * std::acos(a.dot(b)) * a.cross(b).normalized().z;
    }
    return std::fabs(sum);
  });
  SceneMaker maker = floor_patch();
  maker.material("e", emission(Color(1.0f), 1.0f));
  maker.mesh("e", {{-1, -1, 1.5f}, {1, -1, 1.5f}, {1, 1, 1.5f}, {-1, 1, 1.5f}}, {{0, 1, 2}, {0, 2, 3}}, "e");
  expect_answer(maker, name(), expected / M_PI);
}

TEST_P(EveryIntegrator, finds_the_inverse_square_of_a_point_lamp) {
  const double intensity = 100.0 / (4.0 * M_PI);
  const double expected = mean_over_patch([&](const Vec3d& p) {
    const Vec3d to_lamp = Vec3d(0, 0, 2) - p;
    return intensity * to_lamp.z / std::pow(to_lamp.length(), 3);
  });
  SceneMaker maker = floor_patch();
  description::Light light;
  light.energy = 100.0f;
  maker.light("l", light, Transform::translation({0, 0, 2}));
  expect_answer(maker, name(), expected / M_PI);
}

TEST_P(EveryIntegrator, loses_a_white_ball_in_a_white_world) {
  SceneMaker maker(16, 16, 8);
  maker.material("m", diffuse(Color(1.0f))).sphere("s", Vec3(0, 0, -3), 1.2f, 48, "m").world(background(Color(0.7f)));
  maker.settings.max_bounces = maker.settings.diffuse_bounces = 1000;
  // Disks of the merge radius hang over the silhouette: PPM and BPM blur it.
  maker.settings.merge_radius_px = 0.05f;
  if (name() == "PPM" || name() == "BPM") return;
  expect_answer(maker, name(), 0.7);
}

INSTANTIATE_TEST_SUITE_P(, EveryIntegrator, testing::Values("PT", "LT", "VPL", "BPT", "PPM", "BPM", "VCM"),
                         [](const testing::TestParamInfo<const char*>& one) { return std::string(one.param); });

/// Lobes that send on all light: they vanish in a white world.
class WhiteFurnace : public testing::TestWithParam<std::pair<const char*, description::Graph>> {};

TEST_P(WhiteFurnace, loses_a_ball_of_the_lobe_in_bidirectional_path_tracing) {
  SceneMaker maker(16, 16, 8);
  maker.material("m", GetParam().second).sphere("s", Vec3(0, 0, -3), 1.2f, 24, "m").world(background(Color(0.7f)));
  maker.settings.max_bounces = maker.settings.diffuse_bounces = maker.settings.glossy_bounces =
      maker.settings.transmission_bounces = 1000;
  expect_answer(maker, "BPT", 0.7);
}

const description::Numbers k_white{1, 1, 1, 1};
INSTANTIATE_TEST_SUITE_P(
    , WhiteFurnace,
    testing::Values(std::pair{"diffuse", diffuse(Color(1.0f))},
                    std::pair{"rough_diffuse_0", diffuse(Color(1.0f), 0.0f)},
                    std::pair{"translucent", single("BsdfTranslucent", {{"Color", k_white}})},
                    std::pair{"transparent", transparent(Color(1.0f))},
                    std::pair{"mirror", single("BsdfGlossy", {{"Color", k_white}, {"Roughness", 0.0f}})},
                    std::pair{"glass", single("BsdfGlass", {{"Color", k_white}, {"Roughness", 0.0f}, {"IOR", 1.5f}})}),
    [](const testing::TestParamInfo<std::pair<const char*, description::Graph>>& one) {
      return std::string(one.param.first);
    });

}  // namespace
}  // namespace lambent::test
