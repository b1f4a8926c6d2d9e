// Light and shadow linking where the answer is known. That all integrators agree on it: integrators_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/common/scene_maker.h"

namespace lambent::test {
namespace {

using description::LightLinking;
using description::LightType;

constexpr const char* k_integrators[] = {"PT", "LT", "VPL", "BPT", "PPM", "BPM", "VCM"};

description::Light lamp(LightType type) {
  description::Light light;
  light.type = type;
  light.energy = type == LightType::sun ? 3.0f : 80.0f;
  light.size_m = Vec2(0.5f);
  light.angle_rad = 0.1f;
  return light;
}

/// A floor under a lamp, with or without a screen between them that the camera does not see; direct light alone.
SceneMaker floor_and_screen(LightType type, bool screen) {
  SceneMaker maker(16, 16, 4);
  maker.settings.max_bounces = 0;
  maker.settings.light_threshold = 0.0f;
  maker.material("m", diffuse(Color(0.8f)));
  maker.mesh("floor", {{-3, -3, -4}, {3, -3, -4}, {3, 3, -4}, {-3, 3, -4}}, {{0, 1, 2}, {0, 2, 3}}, "m");
  if (screen) {
    maker.mesh("screen", {{-3, 0, -2}, {3, 0, -2}, {3, 3, -2}, {-3, 3, -2}}, {{0, 1, 2}, {0, 2, 3}}, "m");
    maker.object("screen").visibility.camera = false;
  }
  maker.light("l", lamp(type), aimed({0.2f, 2.5f, 0}, {0, 0, -4}));
  return maker;
}

void expect_equal(const Picture& found, const Picture& expected, float relative, const std::string& what) {
  ASSERT_EQ(found.pixels.size(), expected.pixels.size());
  for (size_t i = 0; i < found.pixels.size(); ++i)
    ASSERT_NEAR(found.pixels[i], expected.pixels[i], relative * std::fabs(expected.pixels[i]))
        << what << ", value " << i;
}

TEST(Linking, objects_that_do_not_block_a_light_throw_no_shadow) {
  for (const LightType type : {LightType::point, LightType::area, LightType::sun}) {
    SceneMaker linked = floor_and_screen(type, true);
    linked.object("l").light_linking.blockers = "b";
    linked.object("floor").light_linking.blocks = {"b"};
    const Picture open = render(floor_and_screen(type, false).transaction());
    expect_equal(render(linked.transaction()), open, 1e-4f, "linked");
    EXPECT_GT(mean(open).value.x, 1.1f * mean(render(floor_and_screen(type, true).transaction())).value.x);
  }
}

TEST(Linking, a_light_reaches_its_receivers_alone_whatever_the_integrator) {
  for (const LightType type : {LightType::point, LightType::area, LightType::sun})
    for (const char* integrator : k_integrators) {
      SceneMaker maker = floor_and_screen(type, true);
      maker.settings.integrator = integrator;
      const Picture plain = render(maker.transaction());
      maker.object("l").light_linking.receivers = "r";
      EXPECT_EQ(mean(render(maker.transaction())).value, Color(0.0f)) << integrator;
      maker.object("floor").light_linking.receives = {"r"};
      // Not the same samples: a light walk may end elsewhere, and ends where the light does not reach.
      const Mean expected = mean(plain), found = mean(render(maker.transaction()));
      EXPECT_NEAR(found.value.x, expected.value.x, 6.0 * (found.standard_error + expected.standard_error))
          << integrator;
    }
}

TEST(Linking, sets_that_no_light_names_change_nothing) {
  SceneMaker maker = room(4);
  const Picture plain = render(maker.transaction());
  for (const auto& [id, object] : maker.description().objects) {
    maker.object(id).light_linking.receives = {"r"};
    maker.object(id).light_linking.blocks = {"b", "c"};
  }
  expect_equal(render(maker.transaction()), plain, 0.0f, "room");
}

TEST(Linking, lights_beyond_64_sets_are_reported_and_reach_everything) {
  SceneMaker maker = floor_and_screen(LightType::point, false);
  for (int i = 0; i < 65; ++i) {
    const std::string id = (i < 10 ? "l0" : "l") + std::to_string(i);
    maker.light(id, lamp(LightType::point), aimed({0, 0, 0}, {0, 0, -4}));
    maker.object(id).light_linking.receivers = id;
  }
  maker.object("l").light_linking.receivers = "l00";
  Report report;
  const Picture all = render(maker.transaction(), 0, nullptr, &report);
  EXPECT_THAT(report.messages().at(0).text, testing::HasSubstr("more than 64"));
  EXPECT_GT(mean(all).value.x, 0.0);
}

}  // namespace
}  // namespace lambent::test
