#include "engine/assets/color_space.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace lambent {
namespace {

TEST(ColorSpace, srgb_has_its_published_values) {
  EXPECT_NEAR(linear_from_srgb(0.5f), 0.21404114f, 1e-6f);
  EXPECT_NEAR(linear_from_srgb(0.04045f), 0.0031308f, 1e-7f);
  EXPECT_EQ(linear_from_srgb(1.0f), 1.0f);
}

TEST(ColorSpace, srgb_round_trips) {
  for (float x = -0.1f; x < 1.5f; x += 0.013f) EXPECT_NEAR(srgb_from_linear(linear_from_srgb(x)), x, 2e-6f);
}

TEST(ColorSpace, the_table_is_exact_to_a_millionth) {
  for (int i = 0; i <= 100000; ++i) {
    const float x = static_cast<float>(i) / 100000;
    ASSERT_NEAR(linear_from_srgb_fast(x), linear_from_srgb(x), 1e-6f);
  }
}

TEST(ColorSpace, blenders_names_are_known_without_a_configuration) {
  const ColorSpaces spaces("");
  EXPECT_EQ(spaces.find("sRGB", false).kind, ColorConversion::Kind::srgb);
  EXPECT_EQ(spaces.find("sRGB", true).kind, ColorConversion::Kind::srgb);
  for (const char* name : {"Non-Color", "Raw"}) {
    EXPECT_EQ(spaces.find(name, false).kind, ColorConversion::Kind::none) << name;
    EXPECT_TRUE(spaces.find(name, false).is_data) << name;
  }
  for (const char* name : {"Linear", "Linear Rec.709"}) {
    EXPECT_EQ(spaces.find(name, false).kind, ColorConversion::Kind::none) << name;
    EXPECT_FALSE(spaces.find(name, false).is_data) << name;
  }
  EXPECT_TRUE(spaces.find("Linear ACEScg", true).warning.empty());
}

TEST(ColorSpace, an_unnamed_space_is_decided_by_the_file) {
  const ColorSpaces spaces("");
  EXPECT_EQ(spaces.find("", false).kind, ColorConversion::Kind::srgb);
  EXPECT_EQ(spaces.find("", true).kind, ColorConversion::Kind::none);
}

TEST(ColorSpace, linear_spaces_keep_white) {
  const ColorSpaces spaces("");
  for (const char* name : {"Linear ACES", "Linear ACEScg", "Linear Rec.2020", "Linear DCI-P3 D65"}) {
    float white[3] = {1, 1, 1};
    const ColorConversion conversion = spaces.find(name, true);
    ASSERT_TRUE(conversion.transform) << name;
    conversion.transform->apply(white, 1, 3);
    for (const float channel : white) EXPECT_NEAR(channel, 1.0f, 2e-3f) << name;
  }
}

TEST(ColorSpace, an_unknown_name_gives_a_warning_that_names_it) {
  EXPECT_THAT(ColorSpaces("").find("Camera Log X", false).warning, testing::HasSubstr("Camera Log X"));
}

TEST(ColorSpace, a_missing_configuration_is_reported_and_the_built_in_spaces_serve) {
  const ColorSpaces spaces("/nowhere/config.ocio");
  EXPECT_THAT(spaces.error(), testing::HasSubstr("/nowhere/config.ocio"));
  EXPECT_EQ(spaces.find("sRGB", false).kind, ColorConversion::Kind::srgb);
}

TEST(ColorSpace, a_configuration_decides_the_names_it_has) {
  const auto path = std::filesystem::temp_directory_path() / "lambent_color_space_test.ocio";
  std::ofstream(path) << "ocio_profile_version: 1\nroles:\n  scene_linear: lin\n  default: lin\n"
                         "displays:\n  d:\n    - !<View> {name: v, colorspace: lin}\n"
                         "colorspaces:\n  - !<ColorSpace>\n    name: lin\n"
                         "  - !<ColorSpace>\n    name: half\n    to_reference: !<MatrixTransform> {matrix: "
                         "[0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1]}\n"
                         "  - !<ColorSpace>\n    name: mask\n    isdata: true\n";
  const ColorSpaces spaces(path.string());
  EXPECT_EQ(spaces.error(), "");
  const ColorConversion half = spaces.find("half", false);
  ASSERT_TRUE(half.transform);
  float pixel[4] = {1, 0.5f, 0.25f, 0.9f};
  half.transform->apply(pixel, 1, 4);
  EXPECT_NEAR(pixel[0], 0.5f, 1e-5f);
  EXPECT_NEAR(pixel[2], 0.125f, 1e-5f);
  EXPECT_EQ(pixel[3], 0.9f);
  EXPECT_TRUE(spaces.find("mask", false).is_data);
  std::filesystem::remove(path);
}

TEST(ColorSpace, computed_colours_go_the_configurations_way_from_aces) {
  const auto path = std::filesystem::temp_directory_path() / "lambent_aces_test.ocio";
  const auto written = [&](const std::string& role, const std::string& to_scene) {
    std::ofstream(path)
        << "ocio_profile_version: 2\nroles:\n  scene_linear: ours\n  default: ours\n"
        << (role.empty() ? "" : "  " + role + ": aces\n")
        << "displays:\n  d:\n    - !<View> {name: v, colorspace: ours}\n"
           "file_rules:\n  - !<Rule> {name: Default, colorspace: default}\n"
           "colorspaces:\n  - !<ColorSpace>\n    name: aces\n  - !<ColorSpace>\n    name: ours\n"
           "    from_scene_reference: !<GroupTransform>\n      children:\n        - !<BuiltinTransform> "
           "{style: UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD}\n        - !<MatrixTransform> {matrix: ["
        << to_scene << "]}\n";
    ColorSpaces spaces(path.string());
    EXPECT_EQ(spaces.error(), "");
    return spaces.scene_from_computed();
  };
  const std::string lindbloom =
      "3.2404542, -1.5371385, -0.4985314, 0, -0.9692660, 1.8760108, 0.0415560, 0, 0.0556434, -0.2040259, 1.0572252, 0, "
      "0, 0, 0, 1";
  EXPECT_FALSE(written("aces_interchange", lindbloom));
  const auto rows = written("aces_interchange", "1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1");
  ASSERT_TRUE(rows);
  EXPECT_NEAR(rows->at(0), 0.4124564f, 1e-5f);
  EXPECT_NEAR(rows->at(5), 0.0721750f, 1e-5f);
  EXPECT_NEAR(rows->at(8), 2.0f * 0.9503041f, 1e-5f);
  EXPECT_FALSE(written("", lindbloom)) << "nothing is said of XYZ";
  std::filesystem::remove(path);
}

TEST(ColorSpace, a_working_space_of_other_primaries_is_what_everything_is_converted_to) {
  const auto path = std::filesystem::temp_directory_path() / "lambent_working_space_test.ocio";
  std::ofstream(path)
      << "ocio_profile_version: 1\nroles:\n  scene_linear: Linear Rec.709\n  default: Linear Rec.709\n"
         "displays:\n  d:\n    - !<View> {name: v, colorspace: Linear Rec.709}\n"
         "colorspaces:\n  - !<ColorSpace>\n    name: Linear Rec.709\n"
         "  - !<ColorSpace>\n    name: sRGB\n    to_reference: !<ExponentTransform> {value: [2, 2, 2, 1]}\n"
         "  - !<ColorSpace>\n    name: wide\n    to_reference: !<MatrixTransform> {matrix: "
         "[1.6, -0.6, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}\n";
  const ColorSpaces usual(path.string());
  EXPECT_FALSE(usual.scene_from_rec709());
  EXPECT_EQ(usual.find("sRGB", false).kind, ColorConversion::Kind::srgb);
  EXPECT_THAT(ColorSpaces(path.string(), "elsewhere").error(), testing::HasSubstr("elsewhere"));
  const ColorSpaces spaces(path.string(), "wide");
  EXPECT_EQ(spaces.error(), "");
  ASSERT_TRUE(spaces.scene_from_rec709());
  EXPECT_NEAR(spaces.scene_from_rec709()->at(0), 1.0f / 1.6f, 1e-5f);
  EXPECT_NEAR(spaces.scene_from_rec709()->at(1), 0.6f / 1.6f, 1e-5f);
  EXPECT_EQ(spaces.find("wide", true).kind, ColorConversion::Kind::none);
  EXPECT_EQ(spaces.find("", true).kind, ColorConversion::Kind::none);
  EXPECT_EQ(spaces.find("scene_linear", true).kind, ColorConversion::Kind::none);
  for (const auto& [name, green] : {std::pair{"Linear Rec.709", 0.5f}, {"sRGB", 0.25f}, {"", 0.25f}}) {
    const ColorConversion conversion = spaces.find(name, false);
    ASSERT_TRUE(conversion.transform) << name;
    float pixel[3] = {0.0f, 0.5f, 0.0f};
    conversion.transform->apply(pixel, 1, 3);
    EXPECT_NEAR(pixel[0], 0.375f * green, 1e-4f) << name;
    EXPECT_NEAR(pixel[1], green, 1e-4f) << name;
  }
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace lambent
