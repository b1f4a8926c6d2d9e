#include "engine/shading/sky.h"

#include <gtest/gtest.h>

namespace lambent {
namespace {

TEST(Sky, of_each_model_is_finite_blue_overhead_and_symmetric_about_the_sun) {
  for (const auto model : {AtmosphereSky::Model::nishita, AtmosphereSky::Model::single_scattering,
                           AtmosphereSky::Model::multiple_scattering})
    for (const float elevation : {-0.05f, 0.3f, 1.2f, 2.0f}) {
      AtmosphereSky sky;
      sky.model = model;
      sky.sun_elevation_rad = elevation;
      sky.sun_disc = false;
      const std::vector<float> table = make_atmosphere_sky(sky);
      const Color zenith = sky_radiance(table, {0, 0, 1});
      EXPECT_GE(zenith.z, zenith.x) << elevation;
      for (const float z : {-1.0f, -0.3f, 0.0f, 0.4f}) {
        const Color left = sky_radiance(table, {0.6f, 0.2f, z}), right = sky_radiance(table, {-0.6f, 0.2f, z});
        EXPECT_TRUE(is_finite(left)) << elevation << " " << z;
        EXPECT_NEAR(left.y, right.y, 1e-4f + 1e-3f * left.y) << elevation << " " << z;
      }
    }
}

TEST(Sky, with_all_scattering_lights_what_lies_below_and_is_about_as_bright_as_with_one) {
  AtmosphereSky sky;
  sky.sun_disc = false;
  sky.model = AtmosphereSky::Model::single_scattering;
  const std::vector<float> once = make_atmosphere_sky(sky);
  sky.model = AtmosphereSky::Model::multiple_scattering;
  const std::vector<float> all = make_atmosphere_sky(sky);
  EXPECT_EQ(max_component(sky_radiance(once, {0, 0.5f, -0.5f})), 0.0f);
  EXPECT_GT(max_component(sky_radiance(all, {0, 0.5f, -0.5f})), 0.0f);
  const float ratio = sky_radiance(all, {1, 0, 0.3f}).y / sky_radiance(once, {1, 0, 0.3f}).y;
  EXPECT_GT(ratio, 0.5f);
  EXPECT_LT(ratio, 2.0f);
}

TEST(Sky, sun_disc_spreads_the_same_light_over_its_area_and_is_redder_than_white) {
  AtmosphereSky sky;
  sky.model = AtmosphereSky::Model::multiple_scattering;
  sky.sun_elevation_rad = 1.0f;
  const std::vector<float> with = make_atmosphere_sky(sky);
  const Vec3 sun = sun_direction(1.0f, 0.0f);
  const Color centre = sky_radiance(with, sun);
  sky.sun_angle_rad *= 2.0f;
  const Color wider = sky_radiance(make_atmosphere_sky(sky), sun);
  EXPECT_NEAR(wider.y * 4.0f, centre.y, 0.01f * centre.y);  // twice the width, four times the area
  EXPECT_GT(centre.x, centre.z);                            // what is missing of the blue is the sky's
}

}  // namespace
}  // namespace lambent
