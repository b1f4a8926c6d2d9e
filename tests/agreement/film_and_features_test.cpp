// What a transparent film shows through glass, and the passes that are no light: what denoisers ask for, times,
// volumes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tests/common/scene_maker.h"

namespace lambent::test {
namespace {

/// Means over the picture of each component of each channel.
std::map<std::string, std::vector<double>> means_of(const Picture& picture) {
  size_t floats = 0;
  for (const Channel& channel : picture.channels) floats += static_cast<size_t>(channel.components);
  const size_t pixels = picture.pixels.size() / floats;
  std::map<std::string, std::vector<double>> means;
  size_t first = 0;
  for (const Channel& channel : picture.channels) {
    for (size_t k = 0; k < static_cast<size_t>(channel.components); ++k) {
      double sum = 0.0;
      for (size_t pixel = 0; pixel < pixels; ++pixel)
        sum += static_cast<double>(picture.pixels[pixel * floats + first + k]);
      means[channel.name].push_back(sum / static_cast<double>(pixels));
    }
    first += static_cast<size_t>(channel.components);
  }
  return means;
}

/// A sheet across the whole view before an even world.
SceneMaker sheet(description::Graph graph, int64_t samples) {
  SceneMaker maker(16, 16, samples);
  maker.material("sheet", std::move(graph));
  maker.mesh("sheet", {{-9, -9, -2}, {9, -9, -2}, {9, 9, -2}, {-9, 9, -2}}, {{0, 1, 2}, {0, 2, 3}}, "sheet");
  maker.world(background(Color(0.5f)));
  return maker;
}

description::Graph glass(float roughness) {
  return single("BsdfGlass", {{"Color", description::Numbers{1, 1, 1, 1}}, {"Roughness", roughness}, {"IOR", 1.5f}},
                {{"distribution", std::string("GGX")}});
}

TEST(TransparentFilm, is_seen_through_clear_glass_where_it_is_asked_for_in_every_integrator) {
  for (const char* integrator : {"PT", "LT", "VPL", "BPT", "PPM", "BPM", "VCM"}) {
    SCOPED_TRACE(integrator);
    SceneMaker maker = sheet(glass(0.0f), 256);
    maker.settings.integrator = integrator;
    maker.settings.film_transparent = true;
    maker.settings.passes = {{"Environment", "environment", ""}, {"Emission", "emission", ""}};
    const auto hidden = means_of(render(maker.transaction()));
    EXPECT_NEAR(hidden.at("combined")[3], 1.0, 1e-6);
    EXPECT_NEAR(hidden.at("combined")[0], 0.5, 0.01);
    maker.settings.film_transparent_glass = true;
    const auto seen = means_of(render(maker.transaction()));
    // Fresnel's reflectance: 0.04 straight on, hardly more at the corners of the picture (0.5 rad).
    EXPECT_GT(seen.at("combined")[3], 0.035);
    EXPECT_LT(seen.at("combined")[3], 0.05);
    EXPECT_NEAR(seen.at("combined")[0], 0.5 * seen.at("combined")[3], 0.002) << "what it reflects is there";
    EXPECT_NEAR(seen.at("Environment")[0], 0.5 * (1.0 - seen.at("combined")[3]), 1e-4);
    maker.settings.film_transparent = false;
    const auto opaque = means_of(render(maker.transaction()));
    EXPECT_NEAR(opaque.at("combined")[3], 1.0, 1e-6) << "an opaque film";
    EXPECT_NEAR(opaque.at("combined")[0], 0.5, 0.01);
  }
}

TEST(TransparentFilm, is_hidden_by_glass_that_is_rougher_than_asked_for_and_by_what_is_no_glass) {
  for (const char* integrator : {"PT", "BPT", "VCM"})
    for (const auto& [roughness, threshold, clear] :
         {std::tuple{0.09f, 0.1f, true}, std::tuple{0.2f, 0.1f, false}, std::tuple{0.2f, 0.3f, true},
          std::tuple{0.0f, -1.0f, true}, std::tuple{0.2f, std::nanf(""), false}}) {
      SCOPED_TRACE(fmt::format("{} {} {}", integrator, roughness, threshold));
      SceneMaker maker = sheet(glass(roughness), 64);
      maker.settings.integrator = integrator;
      maker.settings.film_transparent = maker.settings.film_transparent_glass = true;
      maker.settings.film_transparent_roughness = threshold;
      const auto means = means_of(render(maker.transaction()));
      EXPECT_NEAR(means.at("combined")[3], clear ? 0.043 : 1.0, clear ? 0.02 : 1e-6);
      // What other techniques find of the world through it stays, and is little.
      EXPECT_NEAR(means.at("combined")[0], clear ? 0.0215 : 0.5, 0.02);
    }
  SceneMaker leaf = sheet(single("BsdfTranslucent", {{"Color", description::Numbers{1, 1, 1, 1}}}), 4);
  leaf.settings.film_transparent = leaf.settings.film_transparent_glass = true;
  leaf.settings.film_transparent_roughness = 1.0f;
  EXPECT_NEAR(means_of(render(leaf.transaction())).at("combined")[3], 1.0, 1e-6);
}

TEST(Holdout, cuts_a_hole_whatever_the_film_is) {
  for (const char* integrator : {"PT", "BPT", "VCM"})
    for (const bool film_transparent : {false, true})
      for (const bool of_shader : {false, true}) {
        SCOPED_TRACE(fmt::format("{} {} {}", integrator, film_transparent, of_shader));
        SceneMaker maker = sheet(of_shader ? single("Holdout", {}) : diffuse(Color(0.5f)), 4);
        maker.settings.integrator = integrator;
        maker.settings.film_transparent = film_transparent;
        maker.object("sheet").holdout = !of_shader;
        const auto means = means_of(render(maker.transaction()));
        for (const double value : means.at("combined")) EXPECT_EQ(value, 0.0);
      }
}

TEST(DenoisingFeatures, are_the_sharp_albedo_and_the_roughness_of_what_is_seen_first) {
  struct Case {
    const char* name;
    description::Graph graph;
    double albedo, roughness;
  };
  const auto glossy = [](float roughness) {
    return single("BsdfGlossy", {{"Color", description::Numbers{0.8f, 0.8f, 0.8f, 1}}, {"Roughness", roughness}},
                  {{"distribution", std::string("GGX")}});
  };
  for (const Case& one : {Case{"mirror", glossy(0.0f), 0.8, 0.0}, Case{"rough metal", glossy(0.5f), 0.0, 0.5},
                          Case{"wall", diffuse(Color(0.6f)), 0.0, 1.0},
                          Case{"nothing", transparent(Color(1.0f)), 0.0, 0.0}, Case{"glass", glass(0.0f), 1.0, 0.0}})
    for (const char* integrator : {"PT", "BPT"}) {
      SCOPED_TRACE(fmt::format("{} {}", one.name, integrator));
      SceneMaker maker = sheet(one.graph, 4);
      maker.settings.integrator = integrator;
      maker.settings.passes = {{"Albedo", "denoising_specular_albedo", ""}, {"Roughness", "denoising_roughness", ""}};
      const auto means = means_of(render(maker.transaction()));
      for (const double albedo : means.at("Albedo")) EXPECT_NEAR(albedo, one.albedo, 0.02);
      EXPECT_NEAR(means.at("Roughness")[0], one.roughness, 1e-5);
    }
}

TEST(PassesOfNoLight, are_there_under_every_name_of_blenders) {
  SceneMaker maker = room(8);
  maker.settings.passes = {{"Time", "time", ""},
                           {"Render Time", "render_time", ""},
                           {"Volume Scatter", "volume_scatter", ""},
                           {"Volume Transmit", "volume_transmit", ""},
                           {"Volume Majorant", "volume_majorant", ""},
                           {"Catcher", "shadow_catcher", ""},
                           {"Noisy Catcher", "noisy_shadow_catcher", ""}};
  for (const char* integrator : {"PT", "VCM"}) {
    maker.settings.integrator = integrator;
    const auto means = means_of(render(maker.transaction()));
    // Milliseconds of all samples, microseconds of one.
    EXPECT_GT(means.at("Time")[0], 0.0);
    EXPECT_NEAR(means.at("Render Time")[0], 8e-3 * means.at("Time")[0], 1e-5 * means.at("Render Time")[0]);
    for (const char* name : {"Volume Scatter", "Volume Transmit", "Volume Majorant"})
      for (const double value : means.at(name)) EXPECT_EQ(value, 0.0) << name;
    EXPECT_EQ(means.at("Volume Majorant").size(), 1u);
    EXPECT_EQ(means.at("Noisy Catcher"), means.at("Catcher"));
  }
  maker.object("ball").shadow_catcher = true;
  maker.settings.integrator = "PT";
  const auto caught = means_of(render(maker.transaction()));
  EXPECT_NE(caught.at("Catcher"), (std::vector<double>{1.0, 1.0, 1.0}));
  EXPECT_EQ(caught.at("Noisy Catcher"), caught.at("Catcher"));
}

}  // namespace
}  // namespace lambent::test
