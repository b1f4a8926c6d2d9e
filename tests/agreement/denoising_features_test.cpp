// What denoisers are given to see: the first surface, and in mirrors, glass and behind what is transparent those that
// one sees there, against what follows from the surfaces' colours and distances.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/common/scene_maker.h"

namespace lambent::test {
namespace {

using Means = std::map<std::string, std::vector<double>>;

constexpr const char* k_integrators[] = {"PT", "LT", "VPL", "BPT", "PPM", "BPM", "VCM"};
constexpr double k_wall[3] = {0.2, 0.5, 0.7};

/// Means over the picture of each component of each channel.
Means means_of(const Picture& picture) {
  size_t floats = 0, first = 0;
  for (const Channel& channel : picture.channels) floats += static_cast<size_t>(channel.components);
  const size_t pixels = picture.pixels.size() / floats;
  Means means;
  for (const Channel& channel : picture.channels)
    for (int k = 0; k < channel.components; ++k, ++first) {
      double sum = 0.0;
      for (size_t pixel = 0; pixel < pixels; ++pixel)
        sum += static_cast<double>(picture.pixels[pixel * floats + first]);
      means[channel.name].push_back(sum / static_cast<double>(pixels));
    }
  return means;
}

description::Graph glossy(float color, float roughness) {
  return single("BsdfGlossy", {{"Color", description::Numbers{color, color, color, 1}}, {"Roughness", roughness}},
                {{"distribution", std::string("GGX")}});
}

/// `opaque` of a diffuse surface, the rest transparent.
description::Graph veil(float opaque, float albedo) {
  description::Graph graph;
  graph.nodes.resize(3);
  graph.nodes[0].type = "BsdfTransparent";
  graph.nodes[0].inputs = {{"Color", description::Numbers{1, 1, 1, 1}}};
  graph.nodes[1].type = "BsdfDiffuse";
  graph.nodes[1].inputs = {{"Color", description::Numbers{albedo, albedo, albedo, 1}}};
  graph.nodes[2].type = "MixShader";
  graph.nodes[2].inputs = {
      {"Fac", opaque}, {"Shader", description::Link{0, "BSDF"}}, {"Shader_001", description::Link{1, "BSDF"}}};
  graph.surface = description::Link{2, "Shader"};
  return graph;
}

/// A sheet across the view at a distance of 2 m before a wall at 5 m, and another wall 3 m behind the camera.
SceneMaker between_walls(description::Graph sheet, description::Graph wall, int64_t samples, bool behind = true) {
  SceneMaker maker(8, 8, samples);
  maker.material("sheet", std::move(sheet)).material("wall", std::move(wall));
  const auto add = [&](const char* id, float size, float z) {
    maker.mesh(id, {{-size, -size, z}, {size, -size, z}, {size, size, z}, {-size, size, z}}, {{0, 1, 2}, {0, 2, 3}},
               z == -2.0f ? "sheet" : "wall");
  };
  add("sheet", 9.0f, -2.0f);
  add("far", 90.0f, -5.0f);
  if (behind) add("behind", 90.0f, 3.0f);
  maker.world(background(Color(0.5f)));
  return maker;
}

SceneMaker between_walls(description::Graph sheet, int64_t samples = 16) {
  return between_walls(std::move(sheet), diffuse(Color(0.2f, 0.5f, 0.7f)), samples);
}

Means features_of(SceneMaker maker, const char* integrator, const std::string& rule) {
  maker.settings.integrator = integrator;
  maker.settings.passes = {
      {"Albedo", "denoising_albedo", rule}, {"Normal", "denoising_normal", rule}, {"Depth", "denoising_depth", rule}};
  return means_of(render(maker.transaction()));
}

void expect_albedo(const Means& means, double own, double of_wall, double tolerance) {
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(means.at("Albedo")[k], own + of_wall * k_wall[k], tolerance);
}

TEST(DenoisingFeatures, of_a_mirror_are_those_of_what_it_mirrors_in_every_integrator) {
  const Means wall = features_of(between_walls(diffuse(Color(0.3f))), "PT", "");
  expect_albedo(wall, 0.3, 0.0, 1e-5);
  const double towards = wall.at("Normal")[2];
  EXPECT_NEAR(std::abs(towards), 1.0, 1e-5);
  const SceneMaker maker = between_walls(glossy(0.8f, 0.0f));
  const double near = static_cast<double>(maker.camera.clip_near_m);
  for (const char* integrator : k_integrators)
    for (const char* rule : {"", "blended"}) {
      SCOPED_TRACE(fmt::format("{} {}", integrator, rule));
      const Means mirror = features_of(maker, integrator, rule);
      expect_albedo(mirror, 0.0, 0.8, 1e-4);
      EXPECT_NEAR(mirror.at("Normal")[2], -towards * (*rule ? 0.8 : 1.0), 1e-4);
      // Seen along a ray all lengths are as those along the axis.
      const double there = (2.0 - near + 0.8 * 5.0) / (2.0 - near);
      EXPECT_NEAR(mirror.at("Depth")[0] / wall.at("Depth")[0], there, 1e-2 * there);
    }
}

TEST(DenoisingFeatures, of_rough_mirrors_change_at_one_roughness_or_fade) {
  const auto step = [](double t) { return t * t * (3.0 - 2.0 * t); };
  for (const char* integrator : k_integrators) {
    SCOPED_TRACE(integrator);
    expect_albedo(features_of(between_walls(glossy(0.8f, 0.2f)), integrator, ""), 0.0, 0.8, 0.01);
    expect_albedo(features_of(between_walls(glossy(0.8f, 0.3f)), integrator, ""), 0.8, 0.0, 1e-4);
    for (const double roughness : {0.2, 0.3}) {
      SCOPED_TRACE(roughness);
      const double rough = step(roughness * roughness / 0.15);
      const double shown = step(std::min(rough / 0.5, 1.0));
      const Means means =
          features_of(between_walls(glossy(0.8f, static_cast<float>(roughness)), 64), integrator, "blended");
      expect_albedo(means, 0.8 * rough * shown, 0.8 * (1.0 - rough) * (1.0 - shown), 0.01);
    }
  }
}

TEST(DenoisingFeatures, go_through_glass_and_what_is_transparent) {
  const double toward = features_of(between_walls(diffuse(Color(0.3f))), "PT", "").at("Normal")[2];
  for (const char* integrator : k_integrators) {
    SCOPED_TRACE(integrator);
    const auto glass = [](float roughness) {
      return single("BsdfGlass", {{"Color", description::Numbers{1, 1, 1, 1}}, {"Roughness", roughness}, {"IOR", 1.5f}},
                    {{"distribution", std::string("GGX")}});
    };
    // The walls look alike: it shows no more whether they are reflected or refracted.
    expect_albedo(features_of(between_walls(glass(0.0f), 256), integrator, ""), 0.0, 1.0, 0.005);
    expect_albedo(features_of(between_walls(glass(0.2f), 256), integrator, ""), 0.0, 1.0, 0.02);
    expect_albedo(features_of(between_walls(transparent(Color(0.5f))), integrator, ""), 0.0, 0.5, 1e-4);
    // Where the rest has over a quarter it is all that is seen; else it counts with what lies behind, as in the
    // picture.
    expect_albedo(features_of(between_walls(veil(0.5f, 0.6f)), integrator, ""), 0.5 * 0.6, 0.0, 1e-4);
    expect_albedo(features_of(between_walls(veil(0.2f, 0.9f), 256), integrator, ""), 0.2 * 0.9, 0.8, 0.01);
    for (const float opaque : {0.2f, 0.6f}) {
      SCOPED_TRACE(opaque);
      const double o = static_cast<double>(opaque);
      const Means faded = features_of(between_walls(veil(opaque, 0.9f), 256), integrator, "blended");
      expect_albedo(faded, o * 0.9, 1.0 - o, 0.02);
      const double share = o * 0.9 / (o * 0.9 + 1.0 - o);
      EXPECT_NEAR(faded.at("Normal")[2] / toward, share + (1.0 - o), 0.02) << "both face the camera";
    }
  }
}

TEST(DenoisingFeatures, do_not_depend_on_roulette) {
  for (const char* integrator : k_integrators) {
    SCOPED_TRACE(integrator);
    // A throughput of 0.05 after two surfaces: roulette ends most walks.
    SceneMaker maker = between_walls(transparent(Color(0.2f)), glossy(0.25f, 0.0f), 4096);
    maker.material("wall", glossy(0.25f, 0.0f)).material("back", diffuse(Color(0.8f)));
    maker.mesh("back", {{-90, -90, 2}, {90, -90, 2}, {90, 90, 2}, {-90, 90, 2}}, {{0, 1, 2}, {0, 2, 3}}, "back");
    const Means means = features_of(maker, integrator, "");
    // Through the sheet, by the far wall, through the sheet again, to the diffuse one.
    for (const double value : means.at("Albedo")) EXPECT_NEAR(value, 0.2 * 0.25 * 0.2 * 0.8, 0.0005);
    EXPECT_NEAR(std::abs(means.at("Normal")[2]), 1.0, 0.03);
  }
}

TEST(DenoisingFeatures, have_light_that_is_seen_once_by_the_colours_between) {
  for (const char* integrator : k_integrators) {
    SCOPED_TRACE(integrator);
    const Means sign = features_of(between_walls(glossy(0.8f, 0.0f), emission(Color(1.0f), 2.0f), 16), integrator, "");
    for (const double value : sign.at("Albedo")) EXPECT_NEAR(value, 0.8 * 2.0, 1e-4);
    const Means world = features_of(between_walls(glossy(0.8f, 0.0f), diffuse(Color(0.5f)), 16, false), integrator, "");
    for (const double value : world.at("Albedo")) EXPECT_NEAR(value, 0.8 * 0.5, 1e-4);
  }
}

/// LT, VPL and PPM have walks that end at the first surface that is no mirror: for denoisers they go on, for the
/// picture not.
TEST(DenoisingFeatures, leave_the_picture_as_it_is) {
  for (const char* integrator : k_integrators)
    for (const bool film_transparent : {false, true}) {
      SCOPED_TRACE(fmt::format("{} {}", integrator, film_transparent));
      SceneMaker maker = room(4);
      maker.settings.integrator = integrator;
      maker.settings.film_transparent = maker.settings.film_transparent_glass = film_transparent;
      maker.settings.passes = {{"Light", "light_path", "C.*L"}};
      const Means without = means_of(render(maker.transaction()));
      maker.settings.passes.push_back({"Albedo", "denoising_albedo", ""});
      const Means with = means_of(render(maker.transaction()));
      EXPECT_EQ(with.at("combined"), without.at("combined"));
      EXPECT_EQ(with.at("Light"), without.at("Light"));
    }
}

}  // namespace
}  // namespace lambent::test
