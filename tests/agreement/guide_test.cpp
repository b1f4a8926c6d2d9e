// What connections choose by: learned where they are of use, the same whatever the threads.
#include <gtest/gtest.h>

#include "engine/integrators/bidirectional/guide_pilot.h"
#include "tests/agreement/integrator_scene_parts.h"
#include "tests/agreement/integrator_scenes.h"
#include "tests/common/direct_render.h"

namespace lambent::test {
namespace {

using bidirectional::LearnedGuide;

LearnedGuide guide_of(const Scene& scene, int threads, const CancelFlag& cancel = CancelFlag{}) {
  const std::shared_ptr<Film> film = *Film::create({.width = 96, .height = 96});
  IntegratorSettings settings;
  settings.threads = threads;
  bidirectional::Pass pass;
  pass.set = k_techniques_bpt;
  pass.counts = {96.0f * 96.0f, 96.0f * 96.0f, 13};
  RayCounts counts;
  return bidirectional::learn_guide<KernelProfile::surfaces>(scene, settings, pass, *film, cancel, counts);
}

/// The camera in a lit room, and another room as large and as bright that it does not see.
SceneMaker two_rooms() {
  SceneMaker maker(96, 96, 1);
  maker.settings.max_bounces = 6;
  maker.material("white", diffuse(Color(0.7f))).material("e", emission(Color(1.0f), 5.0f));
  for (const float x : {0.0f, 20.0f}) {
    const std::string name = x > 0.0f ? "other" : "here";
    maker.sphere(name, Vec3(x, 0, -3), 3.5f, 16, "white");
    maker.mesh(name + " lamp", {{x - 0.5f, 1.5f, -3}, {x + 0.5f, 1.5f, -3}, {x, 1.5f, -4}}, {{0, 1, 2}}, "e");
  }
  return maker;
}

TEST(Guide, gives_least_to_what_the_camera_does_not_see) {
  SceneMaker maker = two_rooms();
  const LearnedGuide learned = guide_of(*build_scene(maker), 1);
  ASSERT_FALSE(learned.guide.empty());
  const auto worth_at = [&](float x) {
    SurfaceHit surface;
    double sum = 0.0;
    for (const float side : {-1.0f, 1.0f}) {
      surface.p_world = Vec3(x, 3.5f * side, -3);
      surface.ng_world = Vec3(0, side, 0);
      sum += static_cast<double>(learned.guide.worth_per_watt(learned.guide.light_leaf_at(surface)));
    }
    return sum;
  };
  EXPECT_LT(worth_at(20.0f), 0.1 * worth_at(0.0f));
  EXPECT_GE(learned.picks.first, 1);
  EXPECT_NE(learned.picks.later, 1) << "the own walk serves as well";
}

TEST(Guide, does_not_depend_on_threads) {
  SceneMaker maker = two_rooms();
  const std::shared_ptr<const Scene> scene = build_scene(maker);
  const LearnedGuide one = guide_of(*scene, 1), three = guide_of(*scene, 3);
  ASSERT_EQ(one.guide.regions(), three.guide.regions());
  EXPECT_EQ(one.picks.first, three.picks.first);
  EXPECT_EQ(one.picks.later, three.picks.later);
  for (int region = 0; region < one.guide.regions(); ++region)
    for (const float x : {0.0f, 20.0f}) {
      SurfaceHit surface;
      surface.p_world = Vec3(x, 3.5f, -3);
      const int leaf = one.guide.light_leaf_at(surface);
      ASSERT_EQ(leaf, three.guide.light_leaf_at(surface));
      EXPECT_EQ(one.guide.worth_per_watt(region, leaf), three.guide.worth_per_watt(region, leaf));
      EXPECT_EQ(one.guide.chosen(region, leaf), three.guide.chosen(region, leaf));
    }
}

TEST(Guide, is_empty_without_light_and_when_cancelled) {
  SceneMaker dark(32, 32, 1);
  dark.material("white", diffuse(Color(0.7f)));
  dark.sphere("room", Vec3(0, 0, -3), 3.5f, 16, "white");
  EXPECT_TRUE(guide_of(*build_scene(dark), 1).guide.empty());
  CancelFlag cancel;
  cancel.cancel();
  SceneMaker maker = two_rooms();
  EXPECT_TRUE(guide_of(*build_scene(maker), 1, cancel).guide.empty());
}

}  // namespace
}  // namespace lambent::test
