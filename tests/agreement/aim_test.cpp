// Aims of emission: learned where light walks would mostly go astray, the same whatever the threads, and not elsewhere.
#include <gtest/gtest.h>

#include "engine/base/check.h"
#include "engine/integrators/bidirectional/pilot.h"
#include "tests/agreement/integrator_scenes.h"
#include "tests/common/direct_render.h"

namespace lambent::test {
namespace {

std::shared_ptr<const Scene> scene_of(const std::string& name) {
  const std::vector<IntegratorCase> all = integrator_cases();
  const auto found = std::ranges::find_if(all, [&](const IntegratorCase& one) { return one.name == name; });
  CHECK(found != all.end(), "a case of integrator_scenes.h");
  return build_scene(found->maker);
}

EmissionAim aim_of(const Scene& scene, int threads, const CancelFlag& cancel = CancelFlag{}) {
  const std::shared_ptr<Film> film = *Film::create({.width = 128, .height = 128});
  IntegratorSettings settings;
  settings.threads = threads;
  const Vec3 p = scene.camera().origin() + scene.camera().sample_ray({16, 16}, {0.5f, 0.5f}).direction * 4.0f;
  RayCounts counts;
  return bidirectional::learn_aim<KernelProfile::surfaces>(scene, settings, k_techniques_vcm, *film,
                                                           scene.footprint_at(p).width_m, cancel, counts);
}

TEST(Aim, is_learned_where_the_camera_sees_little_of_what_light_reaches) {
  for (const char* name : {"light_far_and_wide", "light_many_far_and_wide"}) {
    const std::shared_ptr<const Scene> scene = scene_of(name);
    const EmissionAim aim = aim_of(*scene, 1);
    ASSERT_FALSE(aim.empty()) << name;
    // Where the camera looks, and far from there.
    const auto gain_at = [&](const Vec3& p) {
      double aimed = 0.0, by_power = 0.0;
      const LightSet& lights = scene->lights();
      for (uint32_t i = 0; i < 4096; ++i) {
        const Sampler sampler(1, 0, 0, i);
        const LightSample s = lights.sample(p, {0, 0, 1}, sampler.get_2d(0));
        if (!s) continue;
        for (const EmissionAim* by : {&aim, static_cast<const EmissionAim*>(nullptr)})
          (by ? aimed : by_power) += static_cast<double>(
              light_walk_density(lights, by, s.light, s.n_light_world, p, -s.direction_world, s.distance_m) /
              s.pdf_solid_angle);
      }
      return aimed / by_power;
    };
    // Half of the walks are aimed: below 1 where the camera does not look, clearly above where it does. How far above
    // depends on how well next event does there without them.
    EXPECT_GT(gain_at({0, 0, -4}), 1.5) << name;
    EXPECT_LT(gain_at({14, 14, -4.01f}), 1.0) << name;
  }
}

TEST(Aim, is_learned_where_hardly_a_walk_of_a_sun_comes_near_what_is_seen) {
  const std::shared_ptr<const Scene> scene = scene_of("light_sun_over_vast_ground");
  const EmissionAim aim = aim_of(*scene, 1);
  ASSERT_FALSE(aim.empty());
  const LightSet& lights = scene->lights();
  const Vec3 p(0, 0, -4);
  const LightSample s = lights.sample(p, {0, 0, 1}, {0.5f, 0.5f});
  ASSERT_TRUE(s);
  const auto density = [&](const EmissionAim* by) {
    return light_walk_density(lights, by, s.light, s.n_light_world, p, -s.direction_world, s.distance_m);
  };
  // Targets are a thousandth of the scene at least: half of the walks to some of them, instead of all to a million.
  EXPECT_GT(density(&aim) / density(nullptr), 1e4f);
}

TEST(Aim, is_not_learned_where_the_camera_sees_most_of_it) {
  SceneMaker maker(32, 32, 1);
  maker.settings.max_bounces = 4;
  maker.material("white", diffuse(Color(0.7f))).material("e", emission(Color(1.0f), 5.0f));
  maker.sphere("room", Vec3(0, 0, -3), 3.5f, 16, "white");
  maker.mesh("e", {{-0.5f, 1.5f, -3}, {0.5f, 1.5f, -3}, {0, 1.5f, -4}}, {{0, 1, 2}}, "e");
  EXPECT_TRUE(aim_of(*build_scene(maker), 1).empty());
}

TEST(Aim, does_not_depend_on_threads) {
  const EmissionAim one = aim_of(*scene_of("light_far_and_wide"), 1),
                    three = aim_of(*scene_of("light_far_and_wide"), 3);
  ASSERT_EQ(one.targets().size(), three.targets().size());
  for (size_t i = 0; i < one.targets().size(); ++i) {
    EXPECT_EQ(one.targets()[i].center_world, three.targets()[i].center_world);
    EXPECT_EQ(one.targets()[i].radius_m, three.targets()[i].radius_m);
  }
}

TEST(Aim, is_empty_when_cancelled) {
  CancelFlag cancel;
  cancel.cancel();
  EXPECT_TRUE(aim_of(*scene_of("light_far_and_wide"), 1, cancel).empty());
}

}  // namespace
}  // namespace lambent::test
