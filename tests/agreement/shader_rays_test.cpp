// What programs with rays of their own read of the scene.
#include <gtest/gtest.h>

#include "engine/scene/scene_builder.h"
#include "tests/common/scene_maker.h"

namespace lambent::test {
namespace {

using description::AttributeRole;
using description::Domain;
using description::Link;

/// Emits what an item of a type of a Raycast node, upwards by the normal, reads of the attribute of a name.
description::Graph reads_above(const std::string& name, const std::string& type, const std::string& output) {
  description::Graph graph;
  graph.nodes.push_back({"look", "Raycast", {{"Length", 10.0f}, {"Value_0", name}}, {{"type_0", type}}, {}, {}});
  graph.nodes.push_back({"glow", "Emission", {{"Color", Link{0, output}}, {"Strength", 1.0f}}, {}, {}, {}});
  graph.surface = Link{1, "Emission"};
  return graph;
}

Color seen_from_below(const std::string& name, const std::string& type, const std::string& output, float x, float y) {
  SceneMaker maker(8, 8, 1);
  maker.material("floor", reads_above(name, type, output));
  maker.material("roof", diffuse(Color(0.5f)));
  maker.mesh("floor", {{-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0}}, {{0, 1, 2}, {0, 2, 3}}, "floor");
  maker.mesh("roof", {{-1, -1, 2}, {1, -1, 2}, {1, 1, 2}, {-1, 1, 2}}, {{0, 1, 2}, {0, 2, 3}}, "roof");
  description::Mesh roof = *maker.description().meshes.at("roof");
  const float heights[]{-1.0f, 1.0f, 3.0f, 1.0f};  // 1 + x + y
  const float colors[]{0.1f, 0.2f, 0.6f, 0.75f, 0.4f, 0.5f, 0.6f, 0.25f};
  roof.attributes.push_back(
      {"height", Domain::vertex, AttributeRole::generic, make_array(ElementType::f32, {4, 1}, heights)});
  roof.attributes.push_back(
      {"paint", Domain::face, AttributeRole::color, make_array(ElementType::f32, {2, 4}, colors)});
  maker.replace_mesh("roof", roof);

  description::SceneDescription description;
  description::apply(maker.transaction(), description);
  Report report;
  SceneBuilder builder({});
  const auto scene = builder.build(description, CancelFlag(), report);
  EXPECT_TRUE(scene);
  if (!scene) return Color(-1.0f);
  Hit hit;
  const Ray down{Vec3(x, y, 1.0f), 0.0f, Vec3(0, 0, -1), k_infinity, k_visible_all};
  EXPECT_TRUE((*scene)->geometry().intersect(down, hit));
  const SurfaceHit surface = (*scene)->geometry().surface(hit);
  const SurfaceBinding& binding = (*scene)->binding(surface.instance, surface.material_slot);
  ShadingPoint point;
  (*scene)->fill_shading_point(surface, binding, Vec3(0, 0, 1), 1.0f, {}, {}, point);
  return binding.program->emission(point, nullptr);
}

TEST(ShaderRays, raycast_reads_attributes_of_any_domain_where_it_meets_a_surface) {
  EXPECT_NEAR(seen_from_below("height", "FLOAT", "Attribute_0", 0.5f, 0.25f).x, 1.75f, 1e-5f);
  EXPECT_NEAR(seen_from_below("height", "VECTOR", "Attribute_0", -0.5f, 0.75f).z, 1.25f, 1e-5f);
  const Color paint = seen_from_below("paint", "RGBA", "Attribute_0", 0.5f, -0.5f);
  EXPECT_NEAR(paint.y, 0.2f, 1e-6f);
  EXPECT_NEAR(seen_from_below("paint", "FLOAT", "Attribute_0", 0.5f, -0.5f).x, 0.3f, 1e-6f);
  EXPECT_NEAR(seen_from_below("paint", "RGBA", "Attribute_0_Alpha", -0.5f, 0.5f).x, 0.25f, 1e-6f);
  EXPECT_EQ(seen_from_below("paint", "RGBA", "Attribute_0_Alpha", 3.0f, 0.5f).x, 0.0f) << "nothing is above";
  EXPECT_EQ(seen_from_below("rust", "RGBA", "Attribute_0_Alpha", 0.5f, 0.5f).x, 1.0f) << "a mesh without it";
}

}  // namespace
}  // namespace lambent::test
