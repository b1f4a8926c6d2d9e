// Bad input for the bidirectional family: the picture is right or a message says what is not.
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <optional>

#include "tests/agreement/batches.h"

namespace lambent::test {
namespace {

using description::LightType;
using description::Numbers;

class FamilyBadInput : public testing::TestWithParam<const char*> {
 public:
  /// Renders and expects it to finish with finite pixels.
  Picture picture_of(SceneMaker maker) const {
    maker.settings.integrator = GetParam();
    RenderOutcome outcome;
    Picture picture = render(maker.transaction(), 0, &outcome);
    EXPECT_EQ(outcome.status, RenderStatus::finished) << outcome.message;
    EXPECT_EQ(outcome.statistics.non_finite, 0u);
    for (const float value : picture.pixels) EXPECT_TRUE(std::isfinite(value));
    return picture;
  }
};

/// A grey floor of 4 x 4 m under a sun of irradiance pi; the picture sees its middle, 0.5 everywhere.
SceneMaker floor_under_sun() {
  SceneMaker maker(8, 8, 16);
  maker.material("grey", diffuse(Color(0.5f)));
  maker.mesh("floor", {{-2, -2, -2}, {2, -2, -2}, {2, 2, -2}, {-2, 2, -2}}, {{0, 1, 2}, {0, 2, 3}}, "grey");
  description::Light sun;
  sun.type = LightType::sun;
  sun.energy = k_pi;
  maker.light("sun", sun, Transform());
  maker.settings.max_bounces = 2;
  return maker;
}

TEST_P(FamilyBadInput, light_that_the_integrator_cannot_find_is_named) {
  SceneMaker maker = floor_under_sun();
  maker.settings.integrator = GetParam();
  description::Light light;
  light.shadows = false;
  light.energy = 10.0f;
  maker.light("without shadows", light, Transform());
  Report report;
  render(maker.transaction(), 0, nullptr, &report);
  bool named = false;
  for (const Message& message : report.messages())
    named |= message.code == "lost_light" && message.text.find("without shadows") != std::string::npos;
  const std::string name = GetParam();
  EXPECT_EQ(named, name == "LT" || name == "PPM" || name == "BPM");
}

TEST_P(FamilyBadInput, a_scene_so_large_that_walks_of_suns_hardly_arrive_is_reported) {
  SceneMaker maker = floor_under_sun();
  maker.settings.integrator = GetParam();
  for (const float size : {1e3f, 1e6f}) {
    SceneMaker large = maker;
    large.mesh("ground", {{-size, -size, -3}, {size, -size, -3}, {size, size, -3}}, {{0, 1, 2}}, "grey");
    Report report;
    render(large.transaction(), 0, nullptr, &report);
    bool said = false;
    for (const Message& message : report.messages()) said |= message.text.find("hardly finds") != std::string::npos;
    const std::string name = GetParam();
    EXPECT_EQ(said, size > 1e4f && (name == "LT" || name == "PPM" || name == "BPM")) << size;
  }
}

TEST_P(FamilyBadInput, an_empty_scene_shows_the_world) {
  SceneMaker maker(8, 8, 2);
  EXPECT_EQ(mean(picture_of(maker)).value, Color(0.0f));
  maker.world(background(Color(0.25f)));
  EXPECT_NEAR(mean(picture_of(maker)).value.x, 0.25f, 1e-6f);
}

TEST_P(FamilyBadInput, without_lights_the_picture_is_black) {
  SceneMaker maker(8, 8, 2);
  maker.material("grey", diffuse(Color(0.5f))).sphere("ball", {0, 0, -3}, 1.0f, 8, "grey");
  EXPECT_EQ(mean(picture_of(maker)).value, Color(0.0f));
}

TEST_P(FamilyBadInput, a_scene_of_one_point_or_of_points_far_apart_is_no_trouble) {
  SceneMaker point(8, 8, 2);
  point.material("grey", diffuse(Color(0.5f))).mesh("point", {{0, 0, -1}, {0, 0, -1}, {0, 0, -1}}, {{0, 1, 2}}, "grey");
  point.world(background(Color(0.25f)));
  EXPECT_NEAR(mean(picture_of(point)).value.x, 0.25f, 1e-6f);
  SceneMaker far = floor_under_sun();
  far.mesh("far", {{1e30f, 0, 0}, {1e30f, 1e29f, 0}, {1e30f, 0, 1e29f}}, {{0, 1, 2}}, "grey");
  picture_of(far);
}

TEST_P(FamilyBadInput, merge_radii_of_zero_and_of_1e9_are_harmless_and_named_where_light_is_lost) {
  SceneMaker maker = floor_under_sun();
  maker.settings.integrator = GetParam();
  const std::string_view name = GetParam();
  for (const float radius_px : {0.0f, 2.0f, 1e9f}) {
    maker.settings.merge_radius_px = radius_px;
    picture_of(maker);
    Report report;
    render(maker.transaction(), 0, nullptr, &report);
    bool named = false;
    for (const Message& message : report.messages()) named |= message.code == "merge_radius";
    const bool merges_alone = name == "PPM" || name == "BPM";
    EXPECT_EQ(named, radius_px == 0.0f ? merges_alone : radius_px > 8.0f && (merges_alone || name == "VCM"))
        << radius_px;
  }
}

TEST_P(FamilyBadInput, settings_that_are_not_numbers_are_harmless) {
  SceneMaker maker = floor_under_sun();
  maker.settings.samples = 2;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const float bad : {nan, k_infinity, -1.0f}) {
    maker.settings.merge_radius_px = bad;
    maker.settings.merge_alpha = bad;
    maker.settings.clamp_connection = bad;
    maker.settings.light_threshold = bad;
    picture_of(maker);
  }
}

TEST_P(FamilyBadInput, lights_seen_only_through_mirrors_and_glass_are_finite) {
  // A point lamp inside a ball of clear glass: no camera walk finds it, light walks do.
  SceneMaker maker = floor_under_sun();
  maker.material("glass", single("BsdfGlass", {{"Color", Numbers{1, 1, 1, 1}}, {"Roughness", 0.0f}, {"IOR", 1.5f}}));
  maker.sphere("jar", {0.5f, 0, -1.6f}, 0.2f, 16, "glass");
  description::Light lamp;
  lamp.energy = 10.0f;
  maker.light("inside", lamp, Transform::translation({0.5f, 0, -1.6f}));
  picture_of(maker);
}

/// All light falls within a hundredth of a millimetre.
SceneMaker floor_under_a_point_of_light(int size_px, int64_t samples, float energy_w) {
  SceneMaker maker(size_px, size_px, samples);
  maker.material("grey", diffuse(Color(0.5f)));
  maker.mesh("floor", {{-2, -2, -2}, {2, -2, -2}, {2, 2, -2}, {-2, 2, -2}}, {{0, 1, 2}, {0, 2, 3}}, "grey");
  description::Light spot;
  spot.type = LightType::spot;
  spot.spot_size_rad = 0.02f;
  spot.energy = energy_w;
  maker.light("spot", spot, Transform::translation({0.3f, 0.2f, -1.999f}));
  return maker;
}

TEST_P(FamilyBadInput, photons_on_one_point_alone_end_in_time) {
  SceneMaker maker = floor_under_a_point_of_light(64, 4, 100.0f);
  maker.mesh("roof", {{-2, -2, 1}, {2, -2, 1}, {2, 2, 1}, {-2, 2, 1}}, {{0, 1, 2}, {0, 2, 3}}, "grey");
  maker.settings.max_bounces = 3;
  const auto start = std::chrono::steady_clock::now();
  const Picture picture = picture_of(maker);
  // No camera walk of the path tracer comes to a place so small.
  if (std::string_view(GetParam()) != "PT") {
    EXPECT_GT(mean(picture).value.x, 0.0f);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(60));
}

TEST_P(FamilyBadInput, a_mesh_of_places_that_are_none_is_named_and_the_rest_is_as_it_was) {
  SceneMaker maker = floor_under_sun();
  const float expected = mean(picture_of(maker)).value.x;
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), k_infinity, -k_infinity}) {
    SceneMaker broken = maker;
    broken.mesh("broken", {{bad, 0, 0}, {bad, 1, 0}, {0, bad, 1}}, {{0, 1, 2}}, "grey");
    EXPECT_EQ(mean(picture_of(broken)).value.x, expected) << bad;
    Report report;
    broken.settings.integrator = GetParam();
    render(broken.transaction(), 0, nullptr, &report);
    bool named = false;
    for (const Message& message : report.messages()) named |= message.text.find("broken") != std::string::npos;
    EXPECT_TRUE(named) << bad;
  }
}

TEST_P(FamilyBadInput, millions_of_photons_on_one_point_are_as_bright_as_what_lies_there) {
  const std::string_view name = GetParam();
  if (name != "PPM" && name != "BPM") return;  // VCM leaves direct light to next events
  const auto lit = [](const char* integrator, int size_px, int64_t samples) {
    SceneMaker maker = floor_under_a_point_of_light(size_px, samples, 1e4f);
    maker.settings.max_bounces = 1;
    maker.settings.integrator = integrator;
    return mean(render(maker.transaction())).value.x;
  };
  // Every light walk ends within a hundredth of a millimetre, a hundredth of a pixel, and each query there meets all of
  // them: over a million. Some dozen camera walks a sample come so near that they do: over seeds the standard deviation
  // is 8%.
  const float expected = lit("LT", 64, 16);
  ASSERT_GT(expected, 0.0f);
  EXPECT_NEAR(lit(GetParam(), 1100, 2), expected, 4.0f * 0.08f * expected);
}

TEST_P(FamilyBadInput, path_lengths_of_a_thousand_end_and_stay_finite) {
  SceneMaker maker(4, 4, 1);
  maker.material("m", diffuse(Color(0.999f))).sphere("s", Vec3(0.0f), 1.0f, 12, "m");
  description::Light light;
  light.energy = 10.0f;
  light.radius_m = 0.1f;
  maker.light("l", light, Transform::translation({0.3f, 0.3f, 0.3f}));
  maker.settings.max_bounces = maker.settings.diffuse_bounces = 1000;
  picture_of(maker);
}

TEST_P(FamilyBadInput, a_thousand_bounces_bring_the_sum_of_the_series) {
  const std::string_view name = GetParam();
  SceneMaker maker(16, 16, 64);
  constexpr float albedo = 0.9f, energy = 10.0f;
  maker.material("m", diffuse(Color(albedo))).sphere("s", Vec3(0.0f), 1.0f, 64, "m");
  description::Light light;
  light.energy = energy;
  maker.light("l", light, Transform::translation({0.0f, 0.0f, 0.01f}));
  maker.settings.max_bounces = maker.settings.diffuse_bounces = 1000;
  // What a sphere's wall sends to itself is the same everywhere, and so is what the lamp in the middle sends.
  const double expected = albedo / k_pi * energy / (4.0 * k_pi) / (1.0 - albedo);
  const Mean found = mean(picture_of(maker));
  // All pixels of VPL's picture share light walks, whose number of bounces spreads by as much as its mean.
  const double shared = name == "VPL" ? expected / std::sqrt(64.0 * maker.settings.shared_light_paths) : 0.0;
  // Of flat faces, and merging over curved ones: 1%.
  EXPECT_NEAR(found.value.x, expected, 0.01 * expected + 4.0 * std::hypot(found.standard_error, shared)) << name;
  EXPECT_LT(found.standard_error, 0.05 * expected);
}

TEST_P(FamilyBadInput, a_lamp_of_1e30_watts_is_in_proportion) {
  const auto lit = [&](float energy) {
    SceneMaker maker = floor_under_sun();
    description::Light light;
    light.energy = energy;
    light.radius_m = 0.2f;
    maker.light("strong", light, Transform::translation({1, 0, 1}));
    maker.settings.samples = 8;
    return static_cast<double>(mean(picture_of(maker)).value.x);
  };
  // With the sun's 0.5 beside it, which 1e30 W drowns; the same seeds follow the same paths.
  const double strong = lit(1e30f), stronger = lit(1e33f);
  EXPECT_GT(strong, 1e25);
  EXPECT_NEAR(stronger / strong, 1000.0, 1.0);
}

TEST_P(FamilyBadInput, emission_inside_glass_agrees_with_the_path_tracer) {
  const std::string_view name = GetParam();
  if (name == "LT" || name == "VPL" || name == "PPM") return;  // LT: seen through glass; VPL: caustics
  SceneMaker maker(24, 24, 8);
  maker.material("grey", diffuse(Color(0.5f))).material("e", emission(Color(1.0f), 5.0f));
  maker.material("glass", single("BsdfGlass", {{"Color", Numbers{1, 1, 1, 1}}, {"Roughness", 0.0f}, {"IOR", 1.5f}}));
  maker.mesh("floor", {{-2, -1, -1}, {2, -1, -1}, {2, -1, -5}, {-2, -1, -5}}, {{0, 1, 2}, {0, 2, 3}}, "grey");
  maker.sphere("jar", {0, -0.3f, -3}, 0.6f, 16, "glass").sphere("wick", {0, -0.3f, -3}, 0.3f, 8, "e");
  maker.settings.max_bounces = 5;
  expect_same(render_batches(maker, GetParam(), 16, 10), render_batches(maker, "PT", 16, 900), 60,
              std::string("emission inside glass ") + GetParam());
}

TEST_P(FamilyBadInput, something_far_away_leaves_what_lamps_light_as_it_is) {
  SceneMaker maker(8, 8, 64);
  maker.material("grey", diffuse(Color(0.5f)));
  maker.mesh("floor", {{-2, -2, -2}, {2, -2, -2}, {2, 2, -2}, {-2, 2, -2}}, {{0, 1, 2}, {0, 2, 3}}, "grey");
  description::Light lamp;
  lamp.energy = 10.0f;
  maker.light("lamp", lamp, Transform::translation({0, 0, -1}));
  maker.settings.max_bounces = 2;
  const float expected = mean(picture_of(maker)).value.x;
  for (const float distance : {1e7f, 1e12f, 1e30f}) {
    SceneMaker far = maker;
    far.mesh("far", {{distance, 0, 0}, {distance, 1, 0}, {distance, 0, 1}}, {{0, 1, 2}}, "grey");
    EXPECT_NEAR(mean(picture_of(far)).value.x, expected, 0.05f * expected) << distance;
  }
}

/// R, G, B and alpha alone.
BatchMeans whole(BatchMeans means) {
  means.names.erase(means.names.begin(), means.names.end() - 4);
  means.values.erase(means.values.begin(), means.values.end() - 4);
  return means;
}

TEST_P(FamilyBadInput, pictures_of_one_pixel_thin_strips_and_regions_of_a_few_pixels_are_right) {
  const std::string_view name = GetParam();
  struct Shape {
    const char* text;
    int width, height;
    int64_t samples;
    std::optional<std::array<int, 4>> region;
  };
  const Shape shapes[] = {
      {"1 x 1", 1, 1, 1024, {}}, {"3 x 10000", 3, 10000, 2, {}}, {"3 x 2 of 48 x 40", 48, 40, 512, {{20, 5, 23, 7}}}};
  for (const Shape& shape : shapes) {
    SceneMaker maker(shape.width, shape.height, shape.samples);
    maker.material("grey", diffuse(Color(0.6f)));
    maker.mesh("floor", {{-2, -1, -1}, {2, -1, -1}, {2, -1, -4}, {-2, -1, -4}}, {{0, 1, 2}, {0, 2, 3}}, "grey");
    maker.mesh("wall", {{-2, -1, -4}, {2, -1, -4}, {2, 3, -4}, {-2, 3, -4}}, {{0, 1, 2}, {0, 2, 3}}, "grey");
    description::Light lamp;
    lamp.energy = 100.0f;
    lamp.radius_m = 0.3f;
    maker.light("lamp", lamp, Transform::translation({0.5f, 0.8f, -2}));
    maker.settings.max_bounces = 3;
    maker.settings.region = shape.region;
    if (name == "PPM" || name == "BPM") {  // a pixel of these is metres wide, and merging blurs by its width
      maker.settings.samples = 8;
      picture_of(maker);
      continue;
    }
    SceneMaker other = maker;
    other.settings.merge_radius_px = 0.02f;
    // Over the whole: hardly a light walk of LT comes to a few pixels of a strip.
    expect_same(whole(render_batches(other, GetParam(), 8, 10)), whole(render_batches(maker, "PT", 8, 900)),
                5 * 4 * static_cast<int>(std::size(shapes)), std::string(shape.text) + " " + GetParam());
  }
}

INSTANTIATE_TEST_SUITE_P(, FamilyBadInput, testing::Values("PT", "LT", "VPL", "BPT", "PPM", "BPM", "VCM"),
                         [](const testing::TestParamInfo<const char*>& one) { return std::string(one.param); });

}  // namespace
}  // namespace lambent::test
