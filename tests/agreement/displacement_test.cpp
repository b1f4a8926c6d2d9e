// True displacement of meshes: analytic shapes, what is made again and what is kept, bad input.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/scene/scene_builder.h"
#include "tests/common/scene_maker.h"

namespace lambent::test {
namespace {

using description::DisplacementMethod;
using description::Link;
using description::Node;

Node node(const std::string& type, std::map<std::string, description::SocketValue> inputs,
          std::map<std::string, description::SocketValue> properties = {}) {
  return {type, type, std::move(inputs), std::move(properties), {}, {}};
}

/// A diffuse material of which every vertex rises by `height` metres along its normal.
description::Graph raised(float height, const std::string& space = "OBJECT",
                          DisplacementMethod method = DisplacementMethod::displacement) {
  description::Graph graph = diffuse(Color(0.8f));
  graph.nodes.push_back(
      node("Displacement", {{"Height", height}, {"Midlevel", 0.0f}, {"Scale", 1.0f}}, {{"space", space}}));
  graph.displacement = Link{static_cast<int>(graph.nodes.size()) - 1, "Displacement"};
  graph.displacement_method = method;
  return graph;
}

/// ... by noise, in the space that `coordinates` (an output of TexCoord, or "Position") says.
description::Graph noisy(const std::string& coordinates, DisplacementMethod method, float scale = 0.5f) {
  description::Graph graph = raised(0.0f, "OBJECT", method);
  const bool world = coordinates == "Position";
  graph.nodes.push_back(node(world ? "NewGeometry" : "TexCoord", {}));
  const int n = static_cast<int>(graph.nodes.size());
  graph.nodes.push_back(node("TexNoise", {{"Vector", Link{n - 1, coordinates}}, {"Scale", 3.0f}}));
  Node& displacement = graph.nodes[static_cast<size_t>(graph.displacement->node)];
  displacement.inputs["Height"] = Link{n, "Fac"};
  displacement.inputs["Scale"] = scale;
  return graph;
}

/// One ball of radius 1 around the origin.
SceneMaker ball(description::Graph graph, bool smooth = true) {
  SceneMaker maker(8, 8, 1);
  maker.material("m", std::move(graph));
  maker.sphere("ball", Vec3(0.0f), 1.0f, 32, "m", smooth);
  return maker;
}

struct Built {
  Report report;
  std::shared_ptr<const Scene> scene;
  const TriangleMesh& mesh(uint32_t instance = 0) const { return *scene->geometry().instance(instance).mesh; }
  bool says(const std::string& text) const {
    for (const Message& message : report.messages())
      if (message.text.find(text) != std::string::npos) return true;
    return false;
  }
};

Built build(SceneBuilder& builder, const SceneMaker& maker) {
  Built built;
  description::SceneDescription description;
  description::apply(maker.transaction(), description);
  const CancelFlag cancel;
  auto result = builder.build(description, cancel, built.report);
  EXPECT_TRUE(result) << result.error();
  if (result) built.scene = *result;
  return built;
}
Built build(const SceneMaker& maker) {
  SceneBuilder builder({});
  return build(builder, maker);
}

TEST(Displacement, a_ball_raised_by_a_constant_is_a_larger_ball_with_the_same_normals) {
  for (const bool smooth : {true, false}) {
    const Built built = build(ball(raised(0.25f), smooth));
    const TriangleMesh& mesh = built.mesh();
    for (uint32_t v = 0; v < mesh.vertex_count(); ++v) {
      // The mean of flat faces around a vertex is not quite radial.
      ASSERT_NEAR(length(mesh.vertex(v)), 1.25f, smooth ? 1e-5f : 2e-3f) << v;
    }
    ASSERT_EQ(mesh.has_normals(), smooth);
    double worst = 1.0;
    for (uint32_t t = 0; t < mesh.triangle_count(); ++t) {
      const Triangle p = mesh.triangle(t);
      const Vec3 middle = normalize(p[0] + p[1] + p[2]);
      worst = std::min<double>(worst, dot(mesh.shading_normal(t, {1.0f / 3, 1.0f / 3}), middle));
    }
    EXPECT_GT(worst, std::cos(0.06));
    EXPECT_NEAR(built.scene->geometry().bounds_world().max.z, 1.25f, 1e-3f);
    EXPECT_TRUE(built.report.messages().empty());
  }
}

TEST(Displacement, both_keeps_the_normals_of_the_mesh) {
  const Built before = build(ball(diffuse(Color(0.8f)))), both = build(ball(noisy("Object", DisplacementMethod::both))),
              displaced = build(ball(noisy("Object", DisplacementMethod::displacement)));
  const auto largest_turn = [&](const Built& built) {
    float least = 1.0f;
    for (uint32_t t = 0; t < built.mesh().triangle_count(); ++t)
      least = std::min(least, dot(built.mesh().shading_normal(t, {0, 0}), before.mesh().shading_normal(t, {0, 0})));
    return std::acos(least);
  };
  EXPECT_LT(largest_turn(both), 1e-3f);
  EXPECT_GT(largest_turn(displaced), 0.2f);
  EXPECT_GT(length(both.mesh().vertex(500) - before.mesh().vertex(500)), 0.01f);
  EXPECT_EQ(length(both.mesh().vertex(500) - displaced.mesh().vertex(500)), 0.0f);
}

TEST(Displacement, heights_are_in_object_space_or_in_the_worlds) {
  const Transform stretched = Transform::scale({2.0f, 3.0f, 0.5f});
  for (const bool world : {false, true}) {
    SceneMaker maker(8, 8, 1);
    maker.material("m", raised(0.1f, world ? "WORLD" : "OBJECT"));
    maker.mesh("sheet", {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, "m", {stretched});
    const Bounds3 bounds = build(maker).scene->geometry().bounds_world();
    EXPECT_NEAR(bounds.min.z, world ? 0.1f : 0.05f, 1e-6f);
    EXPECT_NEAR(bounds.max.x, 2.0f, 1e-6f);
  }
}

TEST(Displacement, a_vertex_goes_by_the_first_triangle_that_moves_it_and_others_stay) {
  SceneMaker maker(8, 8, 1);
  maker.material("still", diffuse(Color(0.5f))).material("moved", raised(1.0f));
  maker.mesh("strip", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}, {2, 1, 0}},
             {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}}, "still");
  description::Mesh strip = *maker.description().meshes.at("strip");
  const uint16_t slots[]{0, 0, 1, 1};
  strip.triangle_materials = make_array(ElementType::u16, {4}, slots);
  maker.replace_mesh("strip", strip);
  maker.object("strip").materials = {std::string("still"), std::string("moved")};
  const Built built = build(maker);
  for (uint32_t v = 0; v < 6; ++v) EXPECT_EQ(built.mesh().vertex(v).z, v == 0 || v == 3 ? 0.0f : 1.0f) << v;
}

TEST(Displacement, sharp_corners_stay_sharp_until_blender_5_1_and_flat_ones_always) {
  // A box of raised faces: corner normals of its faces, or none (flat).
  for (const int version : {304, 501})
    for (const bool flat : {false, true}) {
      description::Graph graph = raised(0.5f);
      graph.cycles_version = version;
      SceneMaker maker(8, 8, 1);
      maker.material("m", graph);
      maker.mesh("roof", {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {-1, -1, -2}, {1, -1, -2}},
                 {{0, 1, 2}, {0, 2, 3}, {4, 5, 1}, {4, 1, 0}}, "m");
      description::Mesh roof = *maker.description().meshes.at("roof");
      std::vector<float> normals;
      for (int corner = 0; corner < 12; ++corner)
        for (const float x : {0.0f, corner < 6 || flat ? 0.0f : -1.0f, corner < 6 && !flat ? 1.0f : 0.0f})
          normals.push_back(x);
      roof.normals = make_array(ElementType::f32, {12, 3}, normals.data());
      roof.normals_domain = description::Domain::corner;
      const Built built = build(maker.replace_mesh("roof", roof));
      const TriangleMesh& mesh = built.mesh();
      EXPECT_GT(mesh.vertex(0).z, 0.2f);   // the edge moves along the mean of both faces
      EXPECT_LT(mesh.vertex(0).y, -1.2f);  // and does not open
      const Vec3 edge = mesh.shading_normal(0, {0, 0}), face = mesh.geometric_normal(0);
      EXPECT_EQ(dot(edge, face) > 0.98f, flat || version < 501);
    }
}

TEST(Displacement, generated_coordinates_are_those_from_before) {
  const Built built = build(ball(noisy("Generated", DisplacementMethod::both)));
  const SurfaceHit hit = built.scene->geometry().surface(0, 100, {0.3f, 0.3f});
  const SurfaceBinding& binding = built.scene->binding(0, 0);
  ShadingPoint point;
  built.scene->fill_shading_point(hit, binding, hit.ng_world, 1.0f, {0.01f, 0.0f}, {}, point);
  const auto requests = binding.program->attribute_requests();
  const TriangleMesh& before = built.mesh().undisplaced();
  const Triangle p = before.triangle(100);
  const Vec3 expected = before.generated(p[0] * 0.4f + p[1] * 0.3f + p[2] * 0.3f);
  bool found = false;
  for (size_t i = 0; i < requests.size(); ++i) {
    if (requests[i].kind != AttributeRequest::Kind::generated) continue;
    found = true;
    const Vec4& value = point.attributes[i].value;
    EXPECT_NEAR(length(Vec3(value.x, value.y, value.z) - expected), 0.0f, 1e-5f);
  }
  EXPECT_TRUE(found);
}

TEST(Displacement, meshes_whose_materials_do_not_ask_are_neither_run_nor_copied) {
  for (const DisplacementMethod method : {DisplacementMethod::bump, DisplacementMethod::displacement}) {
    const SceneMaker maker = ball(noisy("Object", method));
    const Built built = build(maker);
    EXPECT_EQ(&built.mesh().undisplaced() == &built.mesh(), method == DisplacementMethod::bump);
  }
  // Neither are those of a displacement that is zero.
  const Built zero = build(ball(raised(0.0f)));
  EXPECT_EQ(&zero.mesh().undisplaced(), &zero.mesh());
}

TEST(Displacement, only_an_edit_of_what_it_reads_makes_the_mesh_again) {
  for (const bool world : {false, true}) {
    SceneBuilder builder({});
    const auto maker_of = [&](float grey, float scale, const Transform& transform) {
      description::Graph graph = noisy(world ? "Position" : "Object", DisplacementMethod::displacement, scale);
      graph.nodes[0].inputs["Color"] = std::vector<float>{grey, grey, grey, 1.0f};
      SceneMaker maker(8, 8, 1);
      maker.material("m", graph);
      maker.mesh("sheet", {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, "m", {transform});
      return maker;
    };
    // One description, edited: unchanged datablocks keep their pointers.
    description::SceneDescription description;
    description::apply(maker_of(0.5f, 0.5f, Transform()).transaction(), description);
    std::vector<std::shared_ptr<const Scene>> scenes;  // alive, so that no address is used twice
    const auto mesh_after = [&](const SceneMaker* edit, bool objects) {
      if (edit && objects) description.objects = edit->description().objects;
      if (edit && !objects) description.materials = edit->description().materials;
      Report report;
      const auto scene = builder.build(description, CancelFlag(), report);
      EXPECT_TRUE(scene);
      scenes.push_back(*scene);
      return (*scene)->geometry().instance(0).mesh;
    };
    const auto* first = mesh_after(nullptr, false);
    const SceneMaker recolored = maker_of(0.9f, 0.5f, Transform()), rescaled = maker_of(0.9f, 0.7f, Transform()),
                     moved = maker_of(0.9f, 0.7f, Transform::translation({5, 0, 0})),
                     turned = maker_of(0.9f, 0.7f, Transform::scale({1, 2, 1}));
    EXPECT_EQ(mesh_after(&recolored, false), first);
    const auto* second = mesh_after(&rescaled, false);
    EXPECT_NE(second, first);
    EXPECT_EQ(mesh_after(&moved, true) == second, !world);
    EXPECT_EQ(mesh_after(&turned, true) == second, !world);
  }
}

TEST(Displacement, objects_that_share_mesh_and_materials_share_what_it_becomes) {
  SceneMaker maker = ball(noisy("Object", DisplacementMethod::displacement));
  maker.material("other", raised(0.5f));
  description::Object second = maker.object("ball"), third = second;
  second.name = "second";
  third.name = "third";
  third.materials = {std::string("other")};
  maker.object("second", second).object("third", third);
  const Built built = build(maker);
  EXPECT_EQ(&built.mesh(0), &built.mesh(1));
  EXPECT_NE(&built.mesh(0), &built.mesh(2));
  EXPECT_NEAR(length(built.mesh(2).vertex(7)), 1.5f, 1e-5f);
}

TEST(Displacement, a_height_that_is_not_finite_leaves_the_vertex_and_is_reported_by_object_and_material) {
  for (const float bad : {std::numeric_limits<float>::infinity(), 1e30f}) {
    description::Graph graph = raised(0.0f);
    graph.nodes.push_back(node("Attribute", {}, {{"attribute_name", std::string("height")}}));
    graph.nodes[static_cast<size_t>(graph.displacement->node)].inputs["Height"] =
        Link{static_cast<int>(graph.nodes.size()) - 1, "Fac"};
    SceneMaker maker(8, 8, 1);
    maker.material("paint", graph);
    maker.mesh("sheet", {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, "paint");
    description::Mesh sheet = *maker.description().meshes.at("sheet");
    const float heights[]{0.5f, bad, 0.25f, 0.0f};
    sheet.attributes.push_back({"height", description::Domain::vertex, description::AttributeRole::generic,
                                make_array(ElementType::f32, {4, 1}, heights)});
    maker.replace_mesh("sheet", sheet);
    const Built built = build(maker);
    // What is interpolated between infinity and a number is none.
    const bool huge = std::isfinite(bad);
    EXPECT_EQ(built.mesh().vertex(0).z, huge ? 0.5f : 0.0f);
    EXPECT_EQ(built.mesh().vertex(1).z, 0.0f);
    EXPECT_EQ(built.mesh().vertex(2).z, huge ? 0.25f : 0.0f);
    const std::string count = huge ? "1" : "3";
    EXPECT_TRUE(
        built.says("Object 'sheet', material 'paint': the displacement of " + count + " vertices is not finite"));
  }
}

TEST(Displacement, a_cancelled_build_says_so_and_the_next_one_is_whole) {
  SceneBuilder builder({});
  const SceneMaker maker = ball(noisy("Object", DisplacementMethod::displacement));
  description::SceneDescription description;
  description::apply(maker.transaction(), description);
  CancelFlag cancelled;
  cancelled.cancel();
  Report report;
  EXPECT_FALSE(builder.build(description, cancelled, report));
  const auto scene = builder.build(description, CancelFlag(), report);
  ASSERT_TRUE(scene);
  const TriangleMesh* mesh = (*scene)->geometry().instance(0).mesh;
  EXPECT_NE(&mesh->undisplaced(), mesh);
}

}  // namespace
}  // namespace lambent::test
