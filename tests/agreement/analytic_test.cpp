// Renders whose answer is known in closed form (light_transport: closed emitting sphere, furnace, irradiances).
#include <gtest/gtest.h>

#include <cmath>

#include "tests/common/scene_maker.h"

namespace lambent::test {
namespace {

using description::LightType;

/// 4.5 standard errors: a false alarm in one of 150,000 comparisons.
void expect_mean(const Picture& picture, double expected, double relative_rounding = 2e-6) {
  const Mean result = mean(picture);
  const double gray = (result.value.x + result.value.y + result.value.z) / 3.0;
  EXPECT_NEAR(gray, expected, 4.5 * result.standard_error + relative_rounding * expected);
  EXPECT_LT(result.standard_error, 0.02 * expected) << "too noisy to say anything";
}

TEST(ClosedEmittingSphere, radiance_is_the_geometric_series_whatever_the_bounce_limit) {
  // Every point emits 1 and reflects half: after k bounces the sum of k + 1 terms of 1/2^i (a closed polyhedron serves
  // too).
  for (const int bounces : {0, 1, 2, 5, 64}) {
    SceneMaker maker(16, 16, 256);
    maker.material("m", diffuse_emitter(Color(0.5f), Color(1.0f))).sphere("s", Vec3(0.0f), 1.0f, 8, "m");
    maker.settings.max_bounces = maker.settings.diffuse_bounces = bounces;
    expect_mean(render(maker.transaction()), 2.0 * (1.0 - std::pow(0.5, bounces + 2)));
  }
}

TEST(PointLightInSphere, radiance_is_one) {
  // Intensity pi in a unit sphere of albedo 1/2: irradiance pi, first radiance 1/2, and 1/2 + 1/4 + ... = 1.
  SceneMaker maker(16, 16, 256);
  maker.material("m", diffuse(Color(0.5f))).sphere("s", Vec3(0.0f), 1.0f, 64, "m");
  description::Light light;
  light.energy = 4.0f * k_pi * k_pi;
  maker.light("l", light, Transform());
  expect_mean(render(maker.transaction()), 1.0,
              2e-3);  // the polyhedron of 64 rings is that much smaller than the sphere
}

TEST(Furnace, a_white_diffuse_object_vanishes_in_a_white_world) {
  SceneMaker maker(32, 32, 64);
  maker.material("m", diffuse(Color(1.0f))).sphere("s", Vec3(0, 0, -3), 1.0f, 16, "m").world(background(Color(0.7f)));
  maker.settings.max_bounces = maker.settings.diffuse_bounces = 1000;
  expect_mean(render(maker.transaction()), 0.7);
}

TEST(Furnace, an_open_plane_under_a_sun_and_an_even_world_has_no_noise) {
  // Each does what the other would do worse: scattered rays meet the world, shadow rays go to the sun.
  SceneMaker maker(8, 8, 1);
  maker.material("m", diffuse(Color(0.5f))).world(background(Color(0.7f)));
  maker.mesh("plane", {{-99, -99, -2}, {99, -99, -2}, {99, 99, -2}, {-99, 99, -2}}, {{0, 1, 2}, {0, 2, 3}}, "m");
  description::Light sun;
  sun.type = LightType::sun;
  sun.energy = 3.0f;
  maker.light("sun", sun, Transform());
  const Mean result = mean(render(maker.transaction()));
  EXPECT_NEAR(result.value.x, 0.5 * (0.7 + 3.0 / std::numbers::pi), 1e-5);
  EXPECT_LT(result.standard_error, 1e-6);
}

TEST(Furnace, an_object_much_larger_than_its_scattering_radius_reflects_its_colour_whatever_the_scale) {
  // A half space that reflects A of uniform light, by the methods' own fits of A, which are good to a percent or two.
  for (const float scale : {1e-3f, 1.0f, 1e3f})
    for (const float albedo : {0.1f, 0.5f, 0.9f})
      for (const char* method : {"RANDOM_WALK_FIXED_RADIUS", "RANDOM_WALK"}) {
        SceneMaker maker(8, 8, 512);
        maker.material("m", single("SubsurfaceScattering",
                                   {{"Color", std::vector<float>{albedo, albedo, albedo, 1.0f}},
                                    {"Radius", std::vector<float>{0.02f * scale, 0.01f * scale, 0.005f * scale}},
                                    {"Scale", 1.0f}},
                                   {{"falloff", std::string(method)}}));
        maker.sphere("s", Vec3(0, 0, -2), 1.0f, 64, "m").world(background(Color(1.0f)));
        maker.camera.focal_length_mm = 200.0f;  // it fills the picture
        maker.scale_and_move(scale, Vec3(0.0f));
        SCOPED_TRACE(std::string(method) + ", colour " + std::to_string(albedo) + ", scale " + std::to_string(scale));
        expect_mean(render(maker.transaction()), albedo, 0.03);
      }
}

TEST(Holdout, cuts_a_hole_into_a_transparent_film_and_is_black_to_other_rays) {
  for (const char* integrator : {"PT", "BPT", "VCM"}) {
    SceneMaker maker(16, 16, 64);
    maker.material("hole", single("Holdout", {})).material("white", diffuse(Color(1.0f)));
    // The left half of the picture, and all that a white sheet in the right half could see but for the world behind.
    maker.mesh("left", {{-9, -9, -2}, {0, -9, -2}, {0, 9, -2}, {-9, 9, -2}}, {{0, 1, 2}, {0, 2, 3}}, "hole");
    maker.mesh("right", {{0, -9, -2}, {9, -9, -2}, {9, 9, -2}, {0, 9, -2}}, {{0, 1, 2}, {0, 2, 3}}, "white");
    maker.mesh("shade", {{-99, -99, 1}, {99, -99, 1}, {99, 99, 1}, {-99, 99, 1}}, {{0, 2, 1}, {0, 3, 2}}, "hole");
    maker.world(background(Color(1.0f)));
    maker.settings.integrator = integrator;
    maker.settings.film_transparent = true;
    const Picture picture = render(maker.transaction());
    for (int y = 0; y < 16; ++y)
      for (int x = 0; x < 16; ++x) {
        const float* pixel = &picture.pixels[static_cast<size_t>(y * 16 + x) * 4];
        ASSERT_EQ(pixel[3], x < 8 ? 0.0f : 1.0f) << integrator << " at " << x << ", " << y;
        ASSERT_LT(pixel[0], x < 8 ? 1e-9f : 0.5f) << integrator << " at " << x << ", " << y;
      }
  }
}

TEST(Furnace, transparent_sheets_and_a_colour_multiply) {
  SceneMaker maker(16, 16, 16);
  maker.material("t", transparent(Color(0.5f))).world(background(Color(1.0f)));
  for (int i = 0; i < 3; ++i)
    maker.mesh("sheet" + std::to_string(i),
               {{-9, -9, -2.f - i}, {9, -9, -2.f - i}, {9, 9, -2.f - i}, {-9, 9, -2.f - i}}, {{0, 1, 2}, {0, 2, 3}},
               "t");
  // Roulette makes it noisy: compare the mean.
  maker.settings.samples = 1024;
  expect_mean(render(maker.transaction()), 0.125);
}

/// The radiance of the diffuse wall in front of the camera, inside a closed box that emits 1. The diffuse albedo is 0.4
/// everywhere; the other walls have a rough lobe of `glossy_node` beside it.
Picture diffuse_wall_in_a_glossy_box(const std::string& glossy_node, bool caustics) {
  SceneMaker maker(16, 16, 512);
  maker.settings.caustics_reflective = maker.settings.caustics_refractive = caustics;
  maker.material("plain", diffuse_emitter(Color(0.4f), Color(1.0f)));
  description::Graph glossy = diffuse_emitter(Color(0.4f), Color(1.0f));
  const int both = glossy.surface->node;
  glossy.nodes.push_back(
      single(glossy_node, {{"Color", description::Numbers{0.5f, 0.5f, 0.5f, 1.0f}}, {"Roughness", 0.3f}}).nodes[0]);
  glossy.nodes.push_back(single("AddShader", {{"Shader", description::Link{both, "Shader"}},
                                              {"Shader_001", description::Link{both + 1, "BSDF"}}})
                             .nodes[0]);
  glossy.surface = description::Link{both + 2, "Shader"};
  maker.material("glossy", glossy);
  const std::vector<Vec3> corners = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                     {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
  maker.mesh("front", corners, {{0, 1, 2}, {0, 2, 3}}, "plain");
  maker.mesh(
      "others", corners,
      {{4, 6, 5}, {4, 7, 6}, {0, 5, 1}, {0, 4, 5}, {3, 2, 6}, {3, 6, 7}, {0, 3, 7}, {0, 7, 4}, {1, 6, 2}, {1, 5, 6}},
      "glossy");
  return render(maker.transaction());
}

TEST(Caustics, switched_off_leave_the_diffuse_lobes_as_if_the_glossy_ones_were_not_there) {
  for (const char* node : {"BsdfGlossy", "BsdfRefraction", "BsdfGlass"}) {
    SCOPED_TRACE(node);
    expect_mean(diffuse_wall_in_a_glossy_box(node, false), 1.0 / (1.0 - 0.4));
  }
  EXPECT_GT(mean(diffuse_wall_in_a_glossy_box("BsdfGlossy", true)).value.x, 1.1 / (1.0 - 0.4));
}

TEST(TransparentShadow, dims_by_the_product_of_the_sheets) {
  const auto lit = [](int sheets) {
    SceneMaker maker(8, 8, 64);
    maker.material("floor", diffuse(Color(0.8f))).material("t", transparent(Color(0.5f)));
    maker.mesh("floor", {{-1, -1, -2}, {1, -1, -2}, {1, 1, -2}, {-1, 1, -2}}, {{0, 1, 2}, {0, 2, 3}}, "floor");
    for (int i = 0; i < sheets; ++i) {
      const float z = 1.0f + i;  // behind the camera, before the lamp
      maker.mesh("s" + std::to_string(i), {{-9, -9, z}, {9, -9, z}, {9, 9, z}, {-9, 9, z}}, {{0, 1, 2}, {0, 2, 3}},
                 "t");
    }
    description::Light sun;
    sun.type = LightType::sun;
    sun.energy = 1.0f;
    maker.light("sun", sun, Transform());
    maker.settings.max_bounces = 0;
    return mean(render(maker.transaction())).value.x;
  };
  const float bare = lit(0);
  EXPECT_NEAR(bare, 0.8f / k_pi, 1e-4f);
  EXPECT_NEAR(lit(1), 0.5f * bare, 1e-4f);
  EXPECT_NEAR(lit(3), 0.125f * bare, 1e-4f);
}

/// A floor patch straight below the camera lit by one lamp above it, as radiance / (albedo / pi) = irradiance.
double irradiance(const description::Light& light, const Transform& transform) {
  SceneMaker maker(4, 4, 4096);
  maker.camera.type = description::CameraType::orthographic;
  maker.camera.ortho_scale = 1e-3f;
  maker.camera.transform = Transform::translation({0, 0, 0.5f});
  maker.material("floor", diffuse(Color(1.0f)));
  maker.mesh("floor", {{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}}, {{0, 1, 2}, {0, 2, 3}}, "floor");
  maker.light("l", light, transform);
  maker.settings.max_bounces = 0;
  return mean(render(maker.transaction())).value.x * k_pi;
}

TEST(LampIrradiance, point_lamp_of_100_watts_gives_what_blender_measured_at_2_m) {
  description::Light light;
  light.energy = 100.0f;
  EXPECT_NEAR(irradiance(light, Transform::translation({0, 0, 2})), 1.98942, 2e-4);
}

TEST(LampIrradiance, sun_energy_is_irradiance) {
  description::Light light;
  light.type = LightType::sun;
  light.energy = 3.0f;
  EXPECT_NEAR(irradiance(light, Transform()), 3.0, 1e-4);
}

TEST(LampIrradiance, coaxial_disk) {
  // Blender's area lamps have radiance P / (4 area); E = pi L R² / (R² + h²).
  description::Light light;
  light.type = LightType::area;
  light.shape = description::AreaShape::disk;
  light.size_m = {2.0f, 2.0f};
  light.energy = 50.0f;
  const double radiance = 50.0 / (4.0 * M_PI);
  EXPECT_NEAR(irradiance(light, Transform::translation({0, 0, 1.5f})), M_PI * radiance / (1 + 1.5 * 1.5), 0.01);
}

TEST(EmissiveMesh, polygon_irradiance_is_lamberts) {
  // E = (L/2) Σ γ_i (n · Γ_i) for a square of side 2 at height 1 above a floor point under its centre.
  const Vec3d corner[4] = {{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}};
  double expected = 0;
  for (int i = 0; i < 4; ++i) {
    const Vec3d a = corner[i].normalized(), b = corner[(i + 1) % 4].normalized();
    expected += 0.5 * std::acos(a.dot(b)) * a.cross(b).normalized().z;
  }
  SceneMaker maker(4, 4, 16384);
  maker.camera.type = description::CameraType::orthographic;
  maker.camera.ortho_scale = 1e-3f;
  maker.camera.transform = Transform::translation({0, 0, 0.5f});
  maker.material("floor", diffuse(Color(1.0f))).material("e", emission(Color(1.0f), 1.0f));
  maker.mesh("floor", {{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}}, {{0, 1, 2}, {0, 2, 3}}, "floor");
  maker.mesh("e", {{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}, {{0, 1, 2}, {0, 2, 3}}, "e");
  maker.settings.max_bounces = 1;
  expect_mean(render(maker.transaction()), std::fabs(expected) / M_PI);
}

}  // namespace
}  // namespace lambent::test
