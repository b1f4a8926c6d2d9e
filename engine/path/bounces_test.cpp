#include "engine/path/bounces.h"

#include <gtest/gtest.h>

#include "engine/path/mis.h"

namespace lambent {
namespace {

struct Limits {
  int total = 12, diffuse = 4, glossy = 4, transmission = 12, transparent = 8;
};

TEST(BounceState, light_is_gathered_at_the_last_allowed_bounce_and_only_emission_after_it) {
  const Limits limits{.total = 2};
  BounceState state;
  for (int bounce = 0; bounce < 2; ++bounce) {
    EXPECT_TRUE(state.advance(k_scatter_diffuse, limits));
    EXPECT_FALSE(state.last) << bounce;
  }
  EXPECT_TRUE(state.advance(k_scatter_diffuse, limits));
  EXPECT_TRUE(state.last);
}

TEST(BounceState, each_kind_has_its_own_limit) {
  const Limits limits{.diffuse = 0, .glossy = 1, .transmission = 0};
  BounceState diffuse, glossy, refracted, translucent;
  diffuse.advance(k_scatter_diffuse, limits);
  EXPECT_TRUE(diffuse.last);
  glossy.advance(k_scatter_glossy, limits);
  EXPECT_FALSE(glossy.last);
  refracted.advance(k_scatter_glossy | k_scatter_transmission | k_scatter_delta, limits);
  EXPECT_TRUE(refracted.last);
  translucent.advance(k_scatter_diffuse | k_scatter_transmission, limits);
  EXPECT_TRUE(translucent.last) << "diffuse transmission counts as transmission";
  EXPECT_EQ(translucent.diffuse, 0);
}

TEST(BounceState, transparent_surfaces_are_not_bounces_and_keep_the_kind_of_ray) {
  const Limits limits{.total = 0, .transparent = 2};
  BounceState state;
  EXPECT_TRUE(state.advance(k_scatter_transparent | k_scatter_delta, limits));
  EXPECT_TRUE(state.advance(k_scatter_transparent | k_scatter_delta, limits));
  EXPECT_FALSE(state.last);
  EXPECT_EQ(state.total, 0);
  EXPECT_EQ(state.ray_kind, uint32_t{k_ray_camera});
  EXPECT_FALSE(state.advance(k_scatter_transparent | k_scatter_delta, limits));
}

TEST(BounceState, the_kind_of_ray_follows_the_event) {
  const Limits limits;
  BounceState state;
  state.advance(k_scatter_glossy | k_scatter_transmission | k_scatter_delta, limits);
  EXPECT_EQ(state.ray_kind, uint32_t{k_ray_transmission | k_ray_glossy | k_ray_singular});
  state.advance(k_scatter_diffuse, limits);
  EXPECT_EQ(state.ray_kind, uint32_t{k_ray_diffuse});
}

TEST(PowerHeuristic, two_weights_of_the_same_path_sum_to_one_at_any_scale) {
  for (const float scale : {1e-30f, 1e-6f, 1.0f, 1e12f, 1e30f})
    for (const float ratio : {1e-6f, 0.1f, 1.0f, 3.0f, 1e6f})
      EXPECT_NEAR(power_heuristic(scale, scale * ratio) + power_heuristic(scale * ratio, scale), 1.0f, 1e-6f)
          << scale << " " << ratio;
  EXPECT_EQ(power_heuristic(0.0f, 1.0f), 0.0f);
  EXPECT_EQ(power_heuristic(1.0f, 0.0f), 1.0f);
  EXPECT_EQ(power_heuristic(1.0f, k_infinity), 0.0f);
}

}  // namespace
}  // namespace lambent
