#include "engine/shading/light_profile.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace lambent {
namespace {

constexpr float k_watts = 4.0f * k_pi / 177.83f;

std::string profile(const std::string& vertical, const std::string& horizontal, const std::string& candelas,
                    int vertical_count, int horizontal_count, int type = 1) {
  return "IESNA:LM-63-1995\n[TEST] made up\nTILT=NONE\n1 1000 2.0 " + std::to_string(vertical_count) + " " +
         std::to_string(horizontal_count) + " " + std::to_string(type) + " 2 0 0 0\n1.0 1.0 100\n" + vertical + "\n" +
         horizontal + "\n" + candelas + "\n";
}

Vec3 towards(float vertical_degrees, float horizontal_degrees) {
  const float v = vertical_degrees * k_pi / 180.0f, h = horizontal_degrees * k_pi / 180.0f - k_pi;
  return {std::sin(v) * std::sin(h), std::sin(v) * std::cos(h), -std::cos(v)};
}

TEST(LightProfile, intensities_at_the_file_s_angles_are_those_of_the_file) {
  const auto table = read_light_profile(profile("0 45 90", "0", "100, 80, 20", 3, 1));
  ASSERT_TRUE(table) << table.error();
  EXPECT_NEAR(light_profile(*table, towards(0, 0)), 200 * k_watts, 1e-3f);
  EXPECT_NEAR(light_profile(*table, towards(45, 123)), 160 * k_watts, 1e-3f);
  EXPECT_EQ(light_profile(*table, towards(120, 0)), 0.0f);
  EXPECT_EQ(light_profile(*table, Vec3(0.0f)), 0.0f);
}

TEST(LightProfile, one_quadrant_is_mirrored_into_all_four) {
  const auto table = read_light_profile(profile("0 90 180", "0 45 90", "10 10 10 20 20 20 30 30 30", 3, 3));
  ASSERT_TRUE(table) << table.error();
  for (const float h : {0.0f, 20.0f, 45.0f, 70.0f})
    for (const float mirrored : {180.0f - h, 180.0f + h, 360.0f - h})
      EXPECT_NEAR(light_profile(*table, towards(60, h)), light_profile(*table, towards(60, mirrored)), 1e-3f) << h;
}

TEST(LightProfile, type_b_is_turned_into_type_c) {
  const auto table = read_light_profile(profile("0 45 90", "0 45 90", "9 8 7 6 5 4 3 2 1", 3, 3, 2));
  ASSERT_TRUE(table) << table.error();
  EXPECT_GT(light_profile(*table, towards(60, 100)), 0.0f);
}

TEST(LightProfile, what_is_wrong_with_a_file_is_said) {
  const auto error = [](const std::string& text) {
    const auto table = read_light_profile(text);
    return table ? std::string() : table.error();
  };
  EXPECT_THAT(error(""), testing::HasSubstr("TILT="));
  EXPECT_THAT(error("TILT=NONE"), testing::HasSubstr("ends"));
  EXPECT_THAT(error("TILT=NONE\n1 2 3"), testing::HasSubstr("header"));
  EXPECT_THAT(error(profile("0 90", "0", "1", 2, 1)), testing::HasSubstr("fewer intensities"));
  EXPECT_THAT(error(profile("0 90", "0", "1 1", 2, 1, 3)), testing::HasSubstr("type"));
  EXPECT_THAT(error(profile("0 90", "0", "1 1", 2, 1000000)), testing::HasSubstr("number of angles"));
  EXPECT_THAT(error(profile("90 0", "0", "1 1", 2, 1)), testing::HasSubstr("ascend"));
}

}  // namespace
}  // namespace lambent
