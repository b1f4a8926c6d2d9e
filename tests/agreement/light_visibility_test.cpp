// Lights that what the camera sees does not see are chosen less, without being given up.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/common/direct_render.h"
#include "tests/common/scene_maker.h"

namespace lambent::test {
namespace {

constexpr float k_depth = -4.0f;
const Vec3 k_floor_point(0.1f, 0.2f, k_depth);

/// A floor, and two equal lamps above it; the first, the nearer, in a box of a material.
SceneMaker boxed_lamp(const description::Graph& box, bool first = true) {
  SceneMaker maker(32, 32, 4);
  maker.settings.light_threshold = 0.0f;
  maker.material("floor", diffuse(Color(0.8f))).material("box", box);
  maker.mesh("floor", {{-3, -3, k_depth}, {3, -3, k_depth}, {3, 3, k_depth}, {-3, 3, k_depth}}, {{0, 1, 2}, {0, 2, 3}},
             "floor");
  maker.sphere("box", Vec3(-1, 0, -3), 0.3f, 16, "box");
  description::Light lamp;
  lamp.type = description::LightType::point;
  lamp.energy = 50.0f;
  if (first) maker.light("a", lamp, aimed({-1, 0, -3}, {0, 0, k_depth}));
  maker.light("b", lamp, aimed({1.5f, 0, -1}, {0, 0, k_depth}));
  return maker;
}

float prob_of_first(const Scene& scene) { return scene.lights().prob_selection(k_floor_point, {0, 0, 1}, 0); }

TEST(LightVisibility, a_lamp_that_nothing_sees_is_rarely_chosen_and_one_behind_a_clear_surface_is) {
  const float open = prob_of_first(*build_scene(boxed_lamp(transparent(Color(1.0f)))));
  const float hidden = prob_of_first(*build_scene(boxed_lamp(diffuse(Color(0.8f)))));
  EXPECT_GT(open, 0.5f);
  EXPECT_LT(hidden / (1.0f - hidden), 0.12f * open / (1.0f - open));
  EXPECT_GT(hidden, 0.0f);
}

TEST(LightVisibility, is_learned_alike_by_any_number_of_threads) {
  const SceneMaker maker = boxed_lamp(diffuse(Color(0.8f)));
  const float prob = prob_of_first(*build_scene(maker));
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(prob_of_first(*build_scene(maker)), prob);
}

TEST(LightVisibility, neither_adds_light_nor_loses_any) {
  const description::Graph box = diffuse(Color(0.8f));
  const Mean both = mean(render(boxed_lamp(box).transaction()));
  const Mean one = mean(render(boxed_lamp(box, false).transaction()));
  EXPECT_NEAR(both.value.x, one.value.x, 5.0 * (both.standard_error + one.standard_error));
  EXPECT_GT(one.value.x, 0.0f);
}

}  // namespace
}  // namespace lambent::test
