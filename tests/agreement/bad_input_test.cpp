// Bad input through the whole engine: a message that names the object, and the rest rendered.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/common/scene_maker.h"

namespace lambent::test {
namespace {

using description::LightType;

/// A grey floor under a sun of irradiance pi, seen from straight above: 0.5 everywhere.
SceneMaker floor_under_sun() {
  SceneMaker maker(8, 8, 16);
  maker.material("grey", diffuse(Color(0.5f)));
  maker.mesh("floor", {{-9, -9, -2}, {9, -9, -2}, {9, 9, -2}, {-9, 9, -2}}, {{0, 1, 2}, {0, 2, 3}}, "grey");
  description::Light sun;
  sun.type = LightType::sun;
  sun.energy = k_pi;
  maker.light("sun", sun, Transform());
  maker.settings.max_bounces = 0;
  return maker;
}

/// Renders, expects the floor as if nothing were wrong, and a message about `object`.
void expect_floor_and_message(const SceneMaker& maker, const std::string& object) {
  RenderOutcome outcome;
  Report report;
  const Picture picture = render(maker.transaction(), 0, &outcome, &report);
  ASSERT_EQ(outcome.status, RenderStatus::finished) << outcome.message;
  EXPECT_NEAR(mean(picture).value.x, 0.5f, 1e-4f);
  EXPECT_EQ(outcome.statistics.non_finite, 0u);
  bool named = false;
  for (const Message& message : report.messages())
    named = named || (message.object == object && message.text.find(object) != std::string::npos);
  EXPECT_TRUE(named) << "no message names " << object;
}

TEST(BadInput, the_floor_itself_is_right) {
  EXPECT_NEAR(mean(render(floor_under_sun().transaction())).value.x, 0.5f, 1e-4f);
}

TEST(BadInput, subsurface_scattering_of_any_radius_and_colour_is_finite_and_reflects_no_more_than_comes_in) {
  const float nan = std::nanf("");
  for (const float radius : {0.0f, -1.0f, 1e-30f, 1e-6f, 1.0f, 1e6f, 1e30f, nan})
    for (const float color : {0.0f, 1e-4f, 0.5f, 1.0f})
      for (const float generation : {1.0f, 2.0f})
        for (const float anisotropy : {-5.0f, 0.0f, 0.8f, nan, 7.0f}) {  // 7: the method without one
          SceneMaker maker(4, 4, 64);
          std::map<std::string, description::SocketValue> inputs{
              {"Color", std::vector<float>{color, color, color, 1.0f}},
              {"Radius", std::vector<float>{radius, 0.1f, radius}},
              {"Scale", 1.0f},
              {"Anisotropy", anisotropy}};
          if (generation == 2.0f) inputs["Roughness"] = nan;
          const std::string method = anisotropy == 7.0f ? "BURLEY" : "RANDOM_WALK";
          maker.material("m", single("SubsurfaceScattering", inputs, {{"falloff", method}}));
          // A closed ball, and a sheet that a walk never comes back from.
          maker.sphere("ball", Vec3(0, 0, -3), 1.0f, 16, "m");
          maker.mesh("sheet", {{-9, -9, -5}, {9, -9, -5}, {9, 9, -5}, {-9, 9, -5}}, {{0, 1, 2}, {0, 2, 3}}, "m");
          maker.world(background(Color(1.0f)));
          maker.settings.max_bounces = maker.settings.diffuse_bounces = 4;
          RenderOutcome outcome;
          const Picture picture = render(maker.transaction(), 0, &outcome);
          SCOPED_TRACE("radius " + std::to_string(radius) + ", colour " + std::to_string(color) + ", generation " +
                       std::to_string(generation) + ", anisotropy " + std::to_string(anisotropy));
          EXPECT_EQ(outcome.statistics.non_finite, 0u);
          EXPECT_LT(mean(picture).value.y, 1.1f) << "with 1024 samples a mean's noise";
        }
}

TEST(BadInput, no_camera_is_a_failure_that_says_so) {
  SceneMaker maker = floor_under_sun();
  maker.settings.camera = "";
  RenderOutcome outcome;
  render(maker.transaction(), 0, &outcome);
  EXPECT_EQ(outcome.status, RenderStatus::failed);
  EXPECT_NE(outcome.message.find("camera"), std::string::npos);
}

TEST(BadInput, with_a_lens_that_is_impossible_everything_is_in_focus) {
  SceneMaker maker = floor_under_sun();
  maker.camera.depth_of_field.emplace().focus_distance_m = 0.0f;
  expect_floor_and_message(maker, maker.settings.camera);
}

TEST(BadInput, an_empty_scene_shows_the_world) {
  SceneMaker maker(4, 4, 4);
  EXPECT_EQ(mean(render(maker.transaction())).value, Color(0.0f));
  maker.world(background(Color(0.25f)));
  EXPECT_NEAR(mean(render(maker.transaction())).value.x, 0.25f, 1e-6f);
}

TEST(BadInput, meshes_without_faces_are_no_trouble) {
  SceneMaker maker = floor_under_sun();
  maker.mesh("points", {{0, 0, -1}, {1, 0, -1}}, {}, "grey").mesh("nothing", {}, {}, "grey");
  EXPECT_NEAR(mean(render(maker.transaction())).value.x, 0.5f, 1e-4f);
}

TEST(BadInput, triangles_with_vertices_that_are_not_finite_are_left_out) {
  SceneMaker maker = floor_under_sun();
  maker.mesh("broken", {{-9, -9, -1}, {9, -9, NAN}, {9, INFINITY, -1}}, {{0, 1, 2}}, "grey");
  expect_floor_and_message(maker, "broken");
}

TEST(BadInput, indices_out_of_range_are_left_out) {
  SceneMaker maker = floor_under_sun();
  maker.mesh("wild", {{-9, -9, -1}, {9, -9, -1}, {9, 9, -1}}, {{0, 1, 77}}, "grey");
  expect_floor_and_message(maker, "wild");
}

TEST(BadInput, singular_and_non_finite_instances_are_left_out) {
  for (const Vec3& factors : {Vec3(1, 0, 1), Vec3(0.0f), Vec3(NAN, 1, 1), Vec3(INFINITY, 1, 1)}) {
    SceneMaker maker = floor_under_sun();
    maker.mesh("flat", {{-9, -9, -1}, {9, -9, -1}, {9, 9, -1}}, {{0, 1, 2}}, "grey", {Transform::scale(factors)});
    expect_floor_and_message(maker, "flat");
  }
}

TEST(BadInput, mirrored_instances_render_as_their_shape_says) {
  SceneMaker maker = floor_under_sun();
  maker.mesh("mirrored", {{-9, -9, -1}, {9, -9, -1}, {9, 9, -1}, {-9, 9, -1}}, {{0, 1, 2}, {0, 2, 3}}, "grey",
             {Transform::scale({-1, 1, 1})});
  EXPECT_NEAR(mean(render(maker.transaction())).value.x, 0.5f, 1e-4f);
}

TEST(BadInput, zero_area_triangles_that_emit_are_harmless) {
  SceneMaker maker = floor_under_sun();
  maker.material("lamp", emission(Color(1.0f), 1e6f));
  maker.mesh("sliver", {{-1, 0, -1}, {0, 0, -1}, {1, 0, -1}}, {{0, 1, 2}, {0, 0, 0}}, "lamp");
  const Picture picture = render(maker.transaction());
  EXPECT_NEAR(mean(picture).value.x, 0.5f, 1e-4f);
}

TEST(BadInput, a_lamp_of_no_power_adds_nothing_and_one_of_negative_power_subtracts) {
  SceneMaker maker = floor_under_sun();
  description::Light sun;
  sun.type = LightType::sun;
  sun.energy = 0.0f;
  maker.light("dark", sun, Transform());
  EXPECT_NEAR(mean(render(maker.transaction())).value.x, 0.5f, 1e-4f);
  sun.energy = -0.5f * k_pi;
  maker.light("dark", sun, Transform());
  RenderOutcome outcome;
  maker.settings.samples = 4096;
  EXPECT_NEAR(mean(render(maker.transaction(), 0, &outcome)).value.x, 0.25f, 0.01f);
  EXPECT_EQ(outcome.statistics.non_finite, 0u);
}

TEST(BadInput, a_lamp_of_1e30_watts_is_finite_and_in_proportion) {
  const auto lit = [](float energy) {
    SceneMaker maker = floor_under_sun();
    description::Light light;
    light.energy = energy;
    light.radius_m = 0.1f;
    maker.light("huge", light, Transform::translation({0, 0, -1}));
    maker.settings.samples = 64;
    RenderOutcome outcome;
    const Mean result = mean(render(maker.transaction(), 0, &outcome));
    EXPECT_EQ(outcome.statistics.non_finite, 0u);
    return double(result.value.x);
  };
  EXPECT_NEAR(lit(1e30f) / lit(1e6f), 1e24, 0.02e24);
}

TEST(BadInput, a_missing_material_is_grey_and_named) {
  SceneMaker maker = floor_under_sun();
  maker.mesh("bare", {{50, 50, -1}, {51, 50, -1}, {51, 51, -1}}, {{0, 1, 2}}, "no such material");
  expect_floor_and_message(maker, "bare");
}

TEST(BadInput, a_missing_texture_is_pink_and_named_with_its_file) {
  SceneMaker maker = floor_under_sun();
  description::Graph graph = diffuse(Color(0.5f));
  description::Node image;
  image.name = "Image Texture";
  image.type = "TexImage";
  image.properties["image"] = std::string("lost");
  graph.nodes.push_back(image);
  graph.nodes[0].inputs["Color"] = description::Link{1, "Color"};
  maker.material("grey", graph);
  description::Transaction transaction = maker.transaction();
  description::Image lost;
  lost.name = "lost.png";
  lost.path = "/nowhere/lost.png";
  transaction.edits.push_back(description::Upsert{"lost", lost});
  Report report;
  RenderOutcome outcome;
  const Mean found = mean(render(transaction, 0, &outcome, &report));
  EXPECT_NEAR(found.value.x, 1.0f, 1e-3f);
  EXPECT_NEAR(found.value.y, 0.0f, 1e-3f);
  EXPECT_NEAR(found.value.z, 1.0f, 1e-3f);
  int named = 0;
  for (const Message& message : report.messages())
    named += message.text.find("lost.png") != std::string::npos && message.text.find("/nowhere/") != std::string::npos;
  EXPECT_EQ(named, 1) << "once, whatever the number of users";
}

TEST(BadInput, nodes_that_are_unknown_or_form_a_cycle_are_named) {
  SceneMaker maker = floor_under_sun();
  description::Graph graph = diffuse(Color(0.5f));
  description::Node strange;
  strange.name = "Strange";
  strange.type = "NoSuchNode";
  graph.nodes.push_back(strange);
  graph.nodes[0].inputs["Roughness"] = description::Link{1, "Value"};
  maker.material("odd", graph);
  description::Graph loop;
  for (int i = 0; i < 2; ++i) {
    description::Node add;
    add.name = "Loop";
    add.type = "AddShader";
    add.inputs["Shader"] = description::Link{1 - i, "Shader"};
    loop.nodes.push_back(add);
  }
  loop.surface = description::Link{0, "Shader"};
  maker.material("loop", loop);
  maker.mesh("a", {{50, 50, -1}, {51, 50, -1}, {51, 51, -1}}, {{0, 1, 2}}, "odd");
  maker.mesh("b", {{50, 50, -1}, {51, 50, -1}, {51, 51, -1}}, {{0, 1, 2}}, "loop");
  expect_floor_and_message(maker, "odd");
  expect_floor_and_message(maker, "loop");
}

TEST(BadInput, a_frame_without_pixels_or_an_unknown_integrator_is_a_failure_that_says_so) {
  SceneMaker maker = floor_under_sun();
  maker.settings.integrator = "MAGIC";
  RenderOutcome outcome;
  render(maker.transaction(), 0, &outcome);
  EXPECT_EQ(outcome.status, RenderStatus::failed);
  EXPECT_NE(outcome.message.find("MAGIC"), std::string::npos);
  maker.settings.integrator = "PT";
  maker.settings.region = {{5, 5, 5, 5}};
  render(maker.transaction(), 0, &outcome);
  EXPECT_EQ(outcome.status, RenderStatus::failed);
  EXPECT_FALSE(outcome.message.empty());
}

TEST(BadInput, the_next_render_after_a_failure_works) {
  SceneMaker maker = floor_under_sun();
  RenderOutcome outcome;
  SessionEvents events;
  events.done = [&](const RenderOutcome& done) { outcome = done; };
  Session session(Engine::create({}), events);
  description::Transaction bad = maker.transaction();
  bad.edits.push_back(description::Remove{description::Kind::camera, "camera"});
  session.apply(bad);
  session.start(1);
  session.wait();
  EXPECT_EQ(outcome.status, RenderStatus::failed);
  session.apply(maker.transaction(2));
  session.start(2);
  session.wait();
  EXPECT_EQ(outcome.status, RenderStatus::finished);
  EXPECT_NEAR(mean(session.picture()).value.x, 0.5f, 1e-4f);
}

}  // namespace
}  // namespace lambent::test
