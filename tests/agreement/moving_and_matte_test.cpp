// Passes of motion, passes of shadows by light group, mattes: against what must come out, in every integrator.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "tests/agreement/integrator_scenes.h"
#include "tests/common/welch.h"

namespace lambent::test {
namespace {

/// Floats of every pixel of each channel, [height][width][components].
using Channels = std::map<std::string, std::vector<float>>;

Channels channels_of(const Picture& picture) {
  Channels result;
  size_t floats = 0, first = 0;
  for (const Channel& channel : picture.channels) floats += static_cast<size_t>(channel.components);
  for (const Channel& channel : picture.channels) {
    const size_t components = static_cast<size_t>(channel.components);
    for (size_t at = first; at < picture.pixels.size(); at += floats)
      for (size_t k = 0; k < components; ++k) result[channel.name].push_back(picture.pixels[at + k]);
    first += components;
  }
  return result;
}

double mean_of(const std::vector<float>& values) {
  double sum = 0.0;
  for (const float value : values) sum += static_cast<double>(value);
  return sum / static_cast<double>(values.size());
}

ArrayPointer rows_of(const std::vector<Transform>& transforms) {
  std::vector<float> rows;
  for (const Transform& transform : transforms)
    for (const auto& row : transform.m) rows.insert(rows.end(), row, row + 4);
  return make_array(ElementType::f32, {transforms.size(), 3, 4}, rows.data());
}

constexpr int k_side = 16;
/// Of the default lens (50 mm, 36 mm wide) at 2 m.
constexpr float k_px_per_m = static_cast<float>(k_side) / 0.72f / 2.0f;

/// A card 2 m away that fills the picture's left half but for the outermost column.
SceneMaker card(const std::string& integrator) {
  SceneMaker maker(k_side, k_side, 4);
  maker.settings.integrator = integrator;
  maker.settings.passes = {{"Vector", "vector", ""}};
  maker.material("gray", diffuse(Color(0.5f))).world(background(Color(1.0f)));
  maker.mesh("card", {{-0.63f, -1, -2}, {0, -1, -2}, {0, 1, -2}, {-0.63f, 1, -2}}, {{0, 1, 2}, {0, 2, 3}}, "gray");
  return maker;
}

/// Every pixel that the card covers in part has the vector, all others none.
void expect_vectors(const SceneMaker& maker, const Vec4& expected) {
  const std::vector<float> vectors = channels_of(render(maker.transaction())).at("Vector");
  for (int y = 0; y < k_side; ++y)
    for (int x = 0; x < k_side; ++x)
      for (int k = 0; k < 4; ++k) {
        const float value = vectors[static_cast<size_t>(4 * (y * k_side + x) + k)];
        if (x == 0) continue;  // a random part of it is covered
        ASSERT_NEAR(value, x < 8 ? expected[k] : 0.0f, 1e-4f)
            << maker.settings.integrator << " " << x << ", " << y << ", " << k;
      }
}

TEST(VectorPass, is_how_far_objects_move_in_pixels) {
  for (const std::string& integrator : available_integrators()) {
    SceneMaker maker = card(integrator);
    maker.object("card").motion = description::ObjectMotion{{rows_of({Transform::translation({-0.1f, 0.03f, 0})}), {}},
                                                            {rows_of({Transform::translation({0.2f, 0, 0})}), {}}};
    expect_vectors(maker, Vec4(-0.1f, 0.03f, -0.2f, 0.0f) * k_px_per_m);
  }
}

TEST(VectorPass, is_how_far_the_camera_makes_things_move) {
  SceneMaker maker = card("PT");
  description::CameraMotion motion;
  motion.previous.transform = Transform::translation({0.1f, 0, 0});
  motion.next.transform = Transform::translation({0, -0.2f, 0});
  maker.camera.motion = motion;
  expect_vectors(maker, Vec4(-0.1f, 0, 0, -0.2f) * k_px_per_m);
  // Far from the origin, where positions are shifted, too.
  maker.scale_and_move(1.0f, {5000, 0, 0});
  maker.camera.motion->previous.transform = Transform::translation({5000.125f, 0, 0});
  maker.camera.motion->next.transform = Transform::translation({5000, -0.25f, 0});
  expect_vectors(maker, Vec4(-0.125f, 0, 0, -0.25f) * k_px_per_m);
}

TEST(VectorPass, is_also_of_the_infinitely_far_world_where_that_is_asked_for) {
  for (const std::string& integrator : available_integrators())
    for (const bool asked : {false, true}) {
      SCOPED_TRACE(fmt::format("{} {}", integrator, asked));
      SceneMaker maker = card(integrator);
      maker.settings.passes = {{"Vector", "vector", asked ? "world" : ""}};
      maker.settings.film_transparent = asked;
      // Twice as far from the middle of the picture in the frame before; in the next one the camera has moved by any
      // amount.
      description::CameraMotion motion;
      motion.previous.focal_length_mm = 100.0f;
      motion.next.transform = Transform::translation({3, 0, 0});
      motion.next.focal_length_mm = 50.0f;
      maker.camera.motion = motion;
      const std::vector<float> vectors = channels_of(render(maker.transaction())).at("Vector");
      double sum[4] = {0, 0, 0, 0};
      for (int y = 0; y < k_side; ++y)
        for (size_t k = 0; k < 4; ++k)
          sum[k] += static_cast<double>(vectors[static_cast<size_t>(4 * (y * k_side + 12)) + k]) / k_side;
      EXPECT_NEAR(sum[0], asked ? 4.5 : 0.0, 0.2);
      EXPECT_NEAR(sum[1], 0.0, 0.2);
      EXPECT_NEAR(sum[2], 0.0, 1e-5) << "a camera that only moves leaves it where it is";
      EXPECT_NEAR(sum[3], 0.0, 1e-5);
    }
}

TEST(VectorPass, follows_zooms) {
  SceneMaker maker = card("PT");
  maker.camera.motion = description::CameraMotion{{Transform(), 100.0f}, {Transform(), 50.0f}};
  const std::vector<float> vectors = channels_of(render(maker.transaction())).at("Vector");
  // Twice as far from the middle of the picture.
  double x_sum = 0.0, y_sum = 0.0;
  for (int y = 0; y < k_side; ++y) {
    x_sum += static_cast<double>(vectors[static_cast<size_t>(4 * (y * k_side + 4))]);
    y_sum += static_cast<double>(vectors[static_cast<size_t>(4 * (y * k_side + 4) + 1)]);
    EXPECT_NEAR(vectors[static_cast<size_t>(4 * (y * k_side + 4))], -3.5f, 0.5f);
    EXPECT_NEAR(vectors[static_cast<size_t>(4 * (y * k_side + 4) + 1)], static_cast<float>(y) - 7.5f, 0.5f);
  }
  EXPECT_NEAR(x_sum / k_side, -3.5, 0.2);
  EXPECT_NEAR(y_sum / k_side, 0.0, 0.2);
}

TEST(VectorPass, follows_deformed_meshes_and_turned_instances) {
  SceneMaker maker = card("PT");
  const float moved[] = {-0.53f, -1, -2, 0.1f, -1, -2, 0.1f, 1, -2, -0.53f, 1, -2};
  const ArrayPointer positions = make_array(ElementType::f32, {4, 3}, moved);
  // The next frame's shape, and its half turn about the axis of view.
  Transform turned;
  turned.m[0][0] = turned.m[1][1] = -1.0f;
  maker.object("card").motion =
      description::ObjectMotion{{rows_of({Transform()}), positions}, {rows_of({turned}), positions}};
  const std::vector<float> vectors = channels_of(render(maker.transaction())).at("Vector");
  for (int y = 0; y < k_side; ++y)
    for (int x = 1; x < 8; ++x) {
      const float* v = &vectors[static_cast<size_t>(4 * (y * k_side + x))];
      ASSERT_NEAR(v[0], 0.1f * k_px_per_m, 1e-4f);
      ASSERT_NEAR(v[1], 0.0f, 1e-4f);
      // Where the sample is, is known to half a pixel.
      ASSERT_NEAR(v[2], 2.0f * (static_cast<float>(x) + 0.5f - 8.0f) + 0.1f * k_px_per_m, 1.0f);
      ASSERT_NEAR(v[3], 2.0f * (static_cast<float>(y) + 0.5f - 8.0f), 1.0f);
    }
}

TEST(VectorPass, takes_what_is_wrong_as_standing_still_and_says_so) {
  SceneMaker maker = card("PT");
  const ArrayPointer two = rows_of({Transform(), Transform()});
  const float moved[] = {1, 2, 3};
  maker.object("card").motion =
      description::ObjectMotion{{two, {}}, {rows_of({Transform()}), make_array(ElementType::f32, {1, 3}, moved)}};
  Transform flat;
  flat.m[0][0] = flat.m[1][1] = flat.m[2][2] = 0.0f;
  maker.camera.motion = description::CameraMotion{{flat, 50.0f}, {Transform(), 0.0f}};
  Report report;
  const std::vector<float> vectors = channels_of(render(maker.transaction(), 0, nullptr, &report)).at("Vector");
  for (const float value : vectors) ASSERT_EQ(value, 0.0f);
  ASSERT_EQ(report.messages().size(), 4u);
  for (const Message& message : report.messages()) EXPECT_EQ(message.code, "motion") << message.text;
  EXPECT_EQ(report.messages()[2].text,
            "Object 'card' has 1 instances and 2 in another frame: passes of motion take that as it is now");
}

// --- Passes of shadows by light group ------------------------------------------------------------------------------

/// A glass ball, chosen for passes of shadows, and lights in two groups.
SceneMaker grouped(const std::string& integrator) {
  for (const IntegratorCase& one : lobe_cases())
    if (one.name == "lobe_glass_05") {
      SceneMaker maker = one.maker;
      maker.settings.integrator = integrator;
      maker.settings.light_threshold = 0.0f;
      maker.settings.samples = 4;
      maker.object("ball").shadow_pass = true;
      std::vector<std::string> ids;
      for (const auto& [id, object] : maker.description().objects) ids.push_back(id);
      for (size_t i = 0; i < ids.size(); ++i) maker.object(ids[i]).light_group = i % 2 ? "odd" : "even";
      for (const std::string group : {"even", "odd", ""}) {
        maker.settings.passes.push_back({"light " + group, "light_group", group});
        if (group.empty()) continue;
        for (const std::string kind : {"without_shadow", "shadow_difference", "shadow_ratio"})
          maker.settings.passes.push_back({kind + " " + group, kind, group});
      }
      return maker;
    }
  ADD_FAILURE() << "no such case";
  return SceneMaker(1, 1, 1);
}

TEST(ShadowPassesOfGroups, give_back_the_groups_and_add_up) {
  for (const std::string& integrator : available_integrators()) {
    SceneMaker maker = grouped(integrator);
    maker.world(background(Color(0.0f)));
    maker.settings.passes.push_back({"without", "without_shadow", ""});
    const Channels channels = channels_of(render(maker.transaction()));
    std::vector<double> sum(channels.at("without").size(), 0.0);
    for (const std::string group : {"even", "odd"}) {
      const std::vector<float>& whole = channels.at("light " + group);
      const std::vector<float>& without = channels.at("without_shadow " + group);
      const std::vector<float>& difference = channels.at("shadow_difference " + group);
      const std::vector<float>& ratio = channels.at("shadow_ratio " + group);
      for (size_t i = 0; i < whole.size(); ++i) {
        ASSERT_NEAR(without[i] + difference[i], whole[i], 1e-6f * (without[i] + whole[i])) << integrator << " " << i;
        if (without[i] > 1e-3f) {
          ASSERT_NEAR(without[i] * ratio[i], whole[i], 1e-5f * whole[i]) << integrator << " " << i;
        }
        sum[i] += static_cast<double>(without[i]);
      }
    }
    for (size_t i = 0; i < sum.size(); ++i)
      ASSERT_NEAR(sum[i], channels.at("without")[i], 1e-5 * sum[i] + 1e-7) << integrator << " " << i;
    EXPECT_GT(mean_of(channels.at("without")), 0.01);
  }
}

TEST(ShadowPassesOfGroups, are_the_groups_of_the_scene_whose_chosen_objects_only_the_camera_sees) {
  SceneMaker direct = grouped("PT");
  description::Visibility& visibility = direct.object("ball").visibility;
  visibility.diffuse = visibility.glossy = visibility.transmission = visibility.shadow = false;
  const Channels expected = channels_of(render(direct.transaction()));
  const Channels found = channels_of(render(grouped("PT").transaction()));
  // The path tracer's random numbers are the same.
  for (const std::string group : {"even", "odd"})
    EXPECT_EQ(found.at("without_shadow " + group), expected.at("light " + group)) << group;
  EXPECT_GT(mean_of(found.at("without_shadow even")) + mean_of(found.at("without_shadow odd")), 0.0);
}

TEST(ShadowPassesOfGroups, are_nothing_where_only_the_chosen_objects_send_light) {
  for (const char* integrator : {"PT", "BPT", "VCM"}) {
    SceneMaker maker(k_side, k_side, 8);
    maker.settings.integrator = integrator;
    maker.material("gray", diffuse(Color(0.5f))).material("light", emission(Color(1.0f), 20.0f));
    maker.mesh("floor", {{-99, -99, -2}, {99, -99, -2}, {99, 99, -2}, {-99, 99, -2}}, {{0, 1, 2}, {0, 2, 3}}, "gray");
    maker.mesh("panel", {{-1, -1, 1}, {-1, 1, 1}, {1, 1, 1}, {1, -1, 1}}, {{0, 1, 2}, {0, 2, 3}}, "light");
    maker.object("panel").shadow_pass = true;
    maker.object("panel").light_group = "keys";
    for (const std::string group : {"", "keys"})
      for (const std::string kind : {"without_shadow", "shadow_difference", "shadow_ratio"})
        maker.settings.passes.push_back({kind + group, kind, group});
    const Channels channels = channels_of(render(maker.transaction()));
    EXPECT_GT(mean_of(channels.at("combined")), 0.1);
    for (const std::string group : {"", "keys"})
      for (size_t i = 0; i < k_side * k_side; ++i)
        for (size_t k = 0; k < 3; ++k) {
          ASSERT_EQ(channels.at("without_shadow" + group)[3 * i + k], 0.0f) << integrator;
          ASSERT_EQ(channels.at("shadow_ratio" + group)[3 * i + k], 0.0f) << integrator;
          ASSERT_FLOAT_EQ(channels.at("shadow_difference" + group)[3 * i + k], channels.at("combined")[4 * i + k])
              << integrator;
        }
  }
}

// --- Mattes ---------------------------------------------------------------------------------------------------------

/// A floor that is a matte, z = -2, seen from above, before a vertical mirror at x = 0.2 (just out of the picture's
/// right half); a sun shines onto both at 45 degrees.
SceneMaker before_a_mirror(const std::string& integrator) {
  SceneMaker maker(k_side, k_side, 512);
  maker.settings.integrator = integrator;
  maker.settings.film_transparent = true;
  maker.settings.light_threshold = 0.0f;
  maker.settings.passes = {{"catcher", "shadow_catcher", ""}, {"brought", "matte_light", ""}};
  maker.material("gray", diffuse(Color(0.5f)));
  maker.material("mirror",
                 single("BsdfGlossy", {{"Color", description::Numbers{0.8f, 0.4f, 0.2f, 1.0f}}, {"Roughness", 0.0f}}));
  maker.mesh("floor", {{-99, -99, -2}, {99, -99, -2}, {99, 99, -2}, {-99, 99, -2}}, {{0, 1, 2}, {0, 2, 3}}, "gray");
  maker.mesh("mirror", {{2, -99, -9}, {2, 99, -9}, {2, 99, 99}, {2, -99, 99}}, {{0, 1, 2}, {0, 2, 3}}, "mirror");
  maker.object("floor").shadow_catcher = maker.object("floor").matte = true;
  description::Light sun;
  sun.type = description::LightType::sun;
  sun.energy = 2.0f;
  sun.angle_rad = 1.0f;
  maker.light("sun", sun, aimed({-5, 0, 5}, {0, 0, 0}));
  return maker;
}

TEST(Matte, shows_the_caustic_of_a_mirror_and_no_shadow_where_there_is_none) {
  // The floor's radiance by the sun alone.
  SceneMaker bare = before_a_mirror("PT");
  bare.object("floor").shadow_catcher = false;
  bare.object("mirror").visibility = {false, false, false, false, false, false};
  bare.settings.passes.clear();
  const double direct = static_cast<double>(channels_of(render(bare.transaction())).at("combined")[0]);
  ASSERT_NEAR(direct, 0.5 / std::numbers::pi * 2.0 * std::sqrt(0.5), 0.1 * direct);
  const double mirror[3] = {0.8, 0.4, 0.2};
  for (const char* integrator : {"PT", "BPT", "VCM"}) {
    const Channels channels = channels_of(render(before_a_mirror(integrator).transaction()));
    double sum[3] = {0, 0, 0};
    for (size_t i = 0; i < channels.at("brought").size(); ++i) {
      // Pixel by pixel the same light with and without the mirror, but for rounding.
      ASSERT_NEAR(channels.at("catcher")[i], 1.0, 1e-4) << integrator;
      sum[i % 3] += static_cast<double>(channels.at("brought")[i]);
    }
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(sum[k] / (k_side * k_side), direct * mirror[k], 0.03 * direct * mirror[k]) << integrator << " " << k;
    const std::vector<float>& picture = channels.at("combined");
    for (size_t i = 0; i < k_side * k_side; ++i) {
      for (size_t k = 0; k < 3; ++k) ASSERT_EQ(picture[4 * i + k], channels.at("brought")[3 * i + k]);
      ASSERT_NEAR(picture[4 * i + 3], 0.0, 1e-4) << integrator;
    }
  }
}

/// A matte floor under a glass ball and a red wall: shadows, a caustic and bounced light.
SceneMaker laid(const std::string& integrator) {
  SceneMaker maker(32, 24, 16);
  maker.settings.integrator = integrator;
  maker.settings.film_transparent = true;
  maker.settings.light_threshold = 0.0f;
  maker.camera.transform = aimed({0, -4, 2.2f}, {0, 0, 0.3f});
  maker.material("floor",
                 single("BsdfGlossy", {{"Color", description::Numbers{0.6f, 0.6f, 0.6f, 1.0f}}, {"Roughness", 0.5f}},
                        {{"distribution", std::string("GGX")}}));
  maker.material("red", diffuse(Color(0.8f, 0.1f, 0.05f)));
  maker.material("glass", single("BsdfGlass", {{"IOR", 1.5f}, {"Roughness", 0.0f}}));
  maker.mesh("floor", {{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}}, {{0, 1, 2}, {0, 2, 3}}, "floor");
  maker.mesh("wall", {{0.8f, -1, 0}, {0.8f, 1, 0}, {0.8f, 1, 1.2f}, {0.8f, -1, 1.2f}}, {{0, 1, 2}, {0, 2, 3}}, "red");
  maker.sphere("ball", {-0.3f, 0, 0.4f}, 0.4f, 24, "glass", true);
  maker.object("floor").shadow_catcher = true;
  description::Light lamp;
  lamp.type = description::LightType::area;
  lamp.size_m = {0.5f, 0.5f};
  lamp.energy = 150.0f;
  maker.light("lamp", lamp, aimed({-1.5f, -1, 3}, {0, 0, 0}));
  maker.world(background(Color(0.2f, 0.25f, 0.3f)));
  return maker;
}

TEST(Matte, laid_over_the_empty_place_is_the_place_with_the_things_in_it) {
  for (const char* integrator : {"PT", "BPT"}) {
    SceneMaker maker = laid(integrator);
    maker.object("floor").matte = true;
    maker.settings.passes = {{"catcher", "shadow_catcher", ""}, {"brought", "matte_light", ""}};
    const Channels matte = channels_of(render(maker.transaction()));

    SceneMaker full = laid(integrator);
    full.object("floor").shadow_catcher = false;
    for (const char* hole : {"wall", "ball"}) full.object(hole).holdout = true;
    const std::vector<float> place = channels_of(render(full.transaction())).at("combined");
    SceneMaker empty = laid(integrator);
    empty.object("floor").shadow_catcher = false;
    for (const char* hole : {"wall", "ball"}) {
      empty.object(hole).holdout = true;
      description::Visibility& sees = empty.object(hole).visibility;
      sees.diffuse = sees.glossy = sees.transmission = sees.shadow = false;
    }
    const std::vector<float> plate = channels_of(render(empty.transaction())).at("combined");
    double largest = 0.0, darkest = 1.0, brightest = 0.0;
    std::vector<double> composed_sum(3, 0.0), place_sum(3, 0.0);
    for (size_t pixel = 0; pixel < place.size() / 4; ++pixel) {
      if (place[4 * pixel + 3] < 1.0f) continue;  // the things are in it, or the horizon
      for (size_t k = 0; k < 3; ++k) {
        const double shadow = static_cast<double>(matte.at("catcher")[3 * pixel + k]);
        const double composed = shadow * static_cast<double>(plate[4 * pixel + k]) +
                                static_cast<double>(matte.at("brought")[3 * pixel + k]);
        const double expected = static_cast<double>(place[4 * pixel + k]);
        // The path tracer's random numbers are the same; light walks are aimed by what is there.
        if (std::string(integrator) == "PT") {
          ASSERT_NEAR(composed, expected, 1e-4 * (1.0 + expected)) << pixel;
          brightest = std::max(brightest, shadow);
        }
        composed_sum[k] += composed;
        place_sum[k] += expected;
        darkest = std::min(darkest, shadow);
        largest = std::max(largest, static_cast<double>(matte.at("brought")[3 * pixel + k]));
      }
    }
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(composed_sum[k], place_sum[k], 0.03 * place_sum[k]) << integrator << k;
    EXPECT_LT(darkest, 0.6) << integrator;
    EXPECT_GT(largest, 0.1) << integrator;
    // A shadow takes light away and brings none: what is reflected is told apart.
    EXPECT_LT(brightest, 1.0 + 1e-4) << integrator;
  }
}

TEST(Matte, has_the_path_tracers_expectation_in_every_integrator) {
  constexpr uint32_t k_batches = 12;
  const auto batches = [](const std::string& integrator, uint32_t first) {
    std::map<std::string, std::vector<double>> means;
    SceneMaker maker = laid(integrator);
    maker.object("floor").matte = true;
    // Rough glass, so that the path tracer finds its caustic by more than chance.
    maker.material("glass",
                   single("BsdfGlass", {{"IOR", 1.5f}, {"Roughness", 0.4f}}, {{"distribution", std::string("GGX")}}));
    maker.settings.passes = {{"catcher", "shadow_catcher", ""}, {"brought", "matte_light", ""}};
    for (uint32_t batch = 0; batch < k_batches; ++batch) {
      maker.settings.seed = first + batch;
      for (const auto& [name, values] : channels_of(render(maker.transaction())))
        means[name].push_back(mean_of(values));
    }
    return means;
  };
  const auto expected = batches("PT", 100);
  EXPECT_GT(expected.at("brought")[0], 0.005);
  for (const char* integrator : {"LT", "BPT", "VCM"})
    for (const auto& [name, values] : batches(integrator, 1000)) {
      const WelchResult test = welch_test(values, expected.at(name), 1e-6);
      EXPECT_GT(test.p_value, 0.01 / 9) << integrator << " " << name << ": " << test.difference << " +- "
                                        << test.standard_error;
    }
}

TEST(Matte, without_other_things_is_the_place_itself) {
  SceneMaker maker(k_side, k_side, 4);
  maker.material("gray", diffuse(Color(0.5f))).world(background(Color(0.25f)));
  maker.mesh("floor", {{-99, -99, -2}, {99, -99, -2}, {99, 99, -2}, {-99, 99, -2}}, {{0, 1, 2}, {0, 2, 3}}, "gray");
  maker.object("floor").shadow_catcher = maker.object("floor").matte = true;
  maker.settings.passes = {{"brought", "matte_light", ""}};
  const Channels channels = channels_of(render(maker.transaction()));
  for (const float value : channels.at("brought")) ASSERT_EQ(value, 0.0f);
  for (size_t i = 0; i < channels.at("combined").size(); ++i)
    ASSERT_NEAR(channels.at("combined")[i], i % 4 == 3 ? 1.0 : 0.25, 1e-5);
}

TEST(MattePass, is_the_cover_of_the_objects_that_name_it) {
  SceneMaker maker = laid("PT");
  maker.object("floor").shadow_catcher = false;
  maker.object("wall").mattes = {"red", "both"};
  maker.object("ball").mattes = {"both", "unasked"};
  maker.settings.passes = {{"red", "matte", "red"}, {"both", "matte", "both"}, {"none", "matte", "none"}};
  const Channels with_floor = channels_of(render(maker.transaction()));
  // The cover is the picture's alpha where nothing else is.
  const auto alone = [&](const std::vector<std::string>& hidden) {
    SceneMaker other = laid("PT");
    other.settings.passes.clear();
    for (const std::string& id : hidden) other.object(id).visibility.camera = false;
    return channels_of(render(other.transaction())).at("combined");
  };
  const std::vector<float> both = alone({"floor"});
  for (size_t i = 0; i < both.size() / 4; ++i) {
    ASSERT_EQ(with_floor.at("none")[i], 0.0f);
    ASSERT_LE(with_floor.at("red")[i], with_floor.at("both")[i]);
    // The ball stands on the floor and both before it: nothing of it is hidden but by each other.
    ASSERT_NEAR(with_floor.at("both")[i], both[4 * i + 3], 1e-6f) << i;
  }
  EXPECT_GT(mean_of(with_floor.at("red")), 0.01);
}

TEST(MattePass, beyond_sixty_four_are_left_out_by_name) {
  SceneMaker maker = laid("PT");
  maker.settings.samples = 1;
  for (int i = 0; i < 66; ++i) {
    const std::string name = fmt::format("matte {}", i);
    maker.settings.passes.push_back({name, "matte", name});
    maker.object("wall").mattes.push_back(name);
  }
  Report report;
  const Channels channels = channels_of(render(maker.transaction(), 0, nullptr, &report));
  EXPECT_EQ(channels.size(), 65u);
  EXPECT_GT(mean_of(channels.at("matte 63")), 0.0);
  ASSERT_EQ(report.messages().size(), 2u);
  EXPECT_EQ(report.messages()[1].text, "Pass 'matte 65' is left out: there are more than 64 mattes");
}

}  // namespace
}  // namespace lambent::test
