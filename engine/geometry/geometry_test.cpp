#include "engine/geometry/geometry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "engine/geometry/shapes_for_tests.h"

namespace lambent {
namespace {

using testing::HasSubstr;

std::shared_ptr<const Geometry> build(const std::vector<GeometryObject>& objects, bool flatten = true) {
  GeometryBuilder builder;
  GeometryOptions options;
  options.flatten = flatten;
  Report report;
  auto result = builder.build(objects, options, CancelFlag(), report);
  EXPECT_TRUE(result) << result.error();
  return *result;
}

Ray ray(const Vec3& origin, const Vec3& direction, uint32_t mask = k_visible_all) {
  return {origin, 0.0f, direction, k_infinity, mask};
}

/// The unit square at z = 0, facing +z.
std::shared_ptr<const TriangleMesh> square_mesh() {
  Shape shape;
  for (const Vec3& p : {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0)}) shape.add(p);
  shape.triangles = {0, 1, 2, 0, 2, 3};
  return make_mesh(shape);
}

TEST(Geometry, empty_scene_misses_every_ray) {
  for (const auto& geometry : {std::make_shared<const Geometry>(), build({}), build({make_object(make_mesh({}))})}) {
    Hit hit;
    EXPECT_FALSE(geometry->intersect(ray({0, 0, 1}, {0, 0, -1}), hit));
    EXPECT_FALSE(geometry->occluded(ray({0, 0, 1}, {0, 0, -1})));
    EXPECT_FALSE(hit.valid());
  }
}

TEST(Geometry, flattened_and_instanced_give_the_same_surface) {
  const Transform transform =
      Transform::translation({5, 6, 7}) * rotation({1, 2, 3}, 0.5f) * Transform::scale({1, 2, 3});
  MeshInput input = mesh_input(icosphere_shape(2));
  input.normals = input.positions;
  input.normals_domain = AttributeDomain::vertex;
  Report report;
  const auto mesh = TriangleMesh::create(std::move(input), report);
  const auto flat = build({make_object(mesh, {transform})}, true),
             instanced = build({make_object(mesh, {transform})}, false);
  TestRandom random;
  for (int i = 0; i < 1000; ++i) {
    const Ray r = ray(transform.origin(), random.direction());
    Hit a, b;
    ASSERT_TRUE(flat->intersect(r, a) && instanced->intersect(r, b));
    EXPECT_EQ(a.instance, 0u);
    EXPECT_EQ(b.instance, 0u);
    EXPECT_NEAR(a.t, b.t, 1e-5f);
    if (a.primitive != b.primitive) continue;  // on an edge
    const SurfaceHit p = flat->surface(a), q = instanced->surface(b);
    EXPECT_LT(length(p.p_world - q.p_world), 1e-5f);
    EXPECT_LT(length(p.p_world - (r.origin + r.direction * a.t)), 1e-5f);
    EXPECT_LT(length(p.ng_world - q.ng_world), 1e-5f);
    EXPECT_LT(length(p.ns_world - q.ns_world), 1e-5f);
    EXPECT_LT(length(p.dpdu_world - q.dpdu_world), 1e-5f);
    EXPECT_GT(dot(p.ng_world, r.direction), 0.0f);  // outward winding, seen from inside
    EXPECT_GT(dot(p.ns_world, p.ng_world), 0.8f);
  }
}

TEST(Geometry, normals_at_vertices_are_normalised_before_they_are_interpolated) {
  MeshInput input = mesh_input(icosphere_shape(1));
  input.normals = input.positions;
  input.normals_domain = AttributeDomain::vertex;
  Report report;
  const auto mesh = TriangleMesh::create(std::move(input), report);
  for (const Vec3& scale : {Vec3(1, 1, 4), Vec3(2, 2, 2)}) {
    GeometryObject object = make_object(mesh, {rotation({1, 2, 3}, 0.5f) * Transform::scale(scale)});
    const auto interpolated = build({object}, true);
    object.normals_at_vertices = true;
    const auto at_vertices = build({object}, true);
    const Transform& object_from_world = at_vertices->instance(0).object_from_world;
    float largest = 0.0f;
    for (uint32_t t = 0; t < mesh->triangle_count(); ++t) {
      const Triangle corners = mesh->triangle(t);
      Vec3 sum(0.0f);
      for (const Vec3& corner : corners) sum += normalize(object_from_world.transposed_vector(corner));
      const Vec2 middle(1.0f / 3.0f);
      const Vec3 ns = at_vertices->surface(0, t, middle).ns_world;
      EXPECT_LT(length(ns - normalize(sum)), 1e-6f);
      largest = std::max(largest, length(ns - interpolated->surface(0, t, middle).ns_world));
    }
    // Even scale changes no angle, whichever comes first.
    if (scale.z == scale.x)
      EXPECT_LT(largest, 1e-6f);
    else
      EXPECT_GT(largest, 0.05f);
  }
}

TEST(Geometry, mirrored_instances_keep_the_side_of_their_normals) {
  const auto mesh = make_mesh(icosphere_shape(2));
  for (const bool flatten : {true, false}) {
    const auto geometry = build({make_object(mesh, {Transform::scale({-1, 1, 1})})}, flatten);
    EXPECT_TRUE(geometry->instance(0).mirrored);
    Hit hit;
    ASSERT_TRUE(geometry->intersect(ray({5, 0.1f, 0.2f}, {-1, 0, 0}), hit));
    EXPECT_GT(geometry->surface(hit).ng_world.x, 0.5f) << flatten;
  }
}

TEST(Geometry, instances_are_numbered_object_by_object_and_dropped_ones_keep_their_number) {
  const auto square = square_mesh(), box = make_mesh(box_shape());
  const Transform away = Transform::translation({10, 0, 0});
  std::vector<GeometryObject> objects{make_object(square, {Transform::scale({1, 1, 0}), away}),
                                      make_object(box, {Transform::translation({0, INFINITY, 0})}),
                                      make_object(box, {Transform::translation({30, 0, 0})})};
  objects[0].name = "Flat";
  GeometryBuilder builder;
  Report report;
  const auto result = builder.build(objects, {}, CancelFlag(), report);
  ASSERT_TRUE(result) << result.error();
  const Geometry& geometry = **result;
  EXPECT_EQ(geometry.instance_count(), 4u);
  EXPECT_EQ(geometry.first_instance(2), 3u);
  EXPECT_EQ(geometry.instance(0).mesh, nullptr);
  EXPECT_EQ(geometry.instance(1).index_in_object, 1u);
  Hit hit;
  ASSERT_TRUE(geometry.intersect(ray({10.5f, 0.2f, 1}, {0, 0, -1}), hit));
  EXPECT_EQ(hit.instance, 1u);
  ASSERT_TRUE(geometry.intersect(ray({30, 0, 5}, {0, 0, -1}), hit));
  EXPECT_EQ(hit.instance, 3u);
  EXPECT_FALSE(geometry.intersect(ray({0.5f, 0.2f, 1}, {0, 0, -1}), hit));
  ASSERT_EQ(report.messages().size(), 2u);
  EXPECT_THAT(report.messages()[0].text, HasSubstr("Object 'Flat': 1 of its 2 instances"));
}

TEST(Geometry, transforms_that_float_cannot_invert_are_traced_all_the_same) {
  const auto mesh = make_mesh(icosphere_shape(2));
  for (const float scale : {3e-11f, 1e11f}) {
    const auto geometry = build({make_object(mesh, {Transform::scale(Vec3(scale)), Transform::scale(Vec3(scale))})});
    Hit hit;
    ASSERT_TRUE(geometry->intersect(ray(Vec3(0, 0.1f, 5) * scale, {0, 0, -1}), hit)) << scale;
    EXPECT_NEAR(geometry->surface(hit).p_world.z / scale, 1.0f, 0.1f);
  }
}

TEST(Geometry, instances_are_seen_by_the_kinds_of_ray_that_their_visibility_names) {
  for (const bool opaque : {true, false})
    for (const bool flatten : {true, false})
      for (uint32_t visibility = 0; visibility <= k_visible_all; ++visibility) {
        GeometryObject object = make_object(square_mesh());
        object.visibility = visibility;
        object.opaque = opaque;
        if (visibility % 7 != 0 && visibility % 5 != 0) continue;  // a third of the combinations
        const auto geometry = build({object}, flatten);
        for (uint32_t bit = 1; bit <= k_visible_all; bit <<= 1) {
          const Ray r = ray({0.4f, 0.2f, 1}, {0, 0, -1}, bit);
          const bool expected = (visibility & bit) != 0;
          Hit hit;
          EXPECT_EQ(geometry->intersect(r, hit), expected);
          EXPECT_EQ(geometry->occluded(r), expected);
          int visits = 0;
          const bool blocked = geometry->occluded(r, [&](const Hit&) {
            ++visits;
            return true;
          });
          EXPECT_EQ(blocked, expected && opaque);
          EXPECT_EQ(visits, expected && !opaque);
        }
        // A ray of two kinds is stopped by what either of them sees; the singular bit is no kind.
        Hit hit;
        EXPECT_EQ(geometry->intersect(
                      ray({0.4f, 0.2f, 1}, {0, 0, -1}, k_visible_glossy | k_visible_transmission | 1u << 6), hit),
                  (visibility & (k_visible_glossy | k_visible_transmission)) != 0);
      }
}

TEST(Geometry, shadow_rays_visit_every_transparent_surface_once) {
  const auto square = square_mesh();
  for (const bool flatten : {true, false}) {
    std::vector<Transform> layers;
    for (int i = 0; i < 20; ++i) layers.push_back(Transform::translation({0, 0, float(i / 2)}));  // coincident pairs
    GeometryObject glass = make_object(square, layers);
    glass.opaque = false;
    GeometryObject single = make_object(square_mesh(), {Transform::translation({0, 0, 15})});
    single.opaque = false;
    const auto geometry = build({glass, single}, flatten);
    EXPECT_TRUE(geometry->has_transparent_shadows());
    std::multiset<uint32_t> visited;
    const bool blocked = geometry->occluded(ray({0.4f, 0.2f, -1}, {0, 0, 1}), [&](const Hit& hit) {
      visited.insert(hit.instance);
      EXPECT_NEAR(geometry->surface(hit).p_world.z, hit.t - 1.0f, 1e-5f);
      return true;
    });
    EXPECT_FALSE(blocked);
    EXPECT_EQ(visited.size(), 21u) << flatten;
    EXPECT_EQ(std::set<uint32_t>(visited.begin(), visited.end()).size(), 21u) << flatten;
    int visits = 0;
    EXPECT_TRUE(geometry->occluded(ray({0.4f, 0.2f, -1}, {0, 0, 1}), [&](const Hit&) { return ++visits < 3; }));
    EXPECT_EQ(visits, 3);
    Ray shorter = ray({0.4f, 0.2f, -1}, {0, 0, 1});
    shorter.t_max = 5.5f;
    visits = 0;
    EXPECT_FALSE(geometry->occluded(shorter, [&](const Hit&) { return ++visits > 0; }));
    EXPECT_EQ(visits, 10);
  }
}

TEST(Geometry, opaque_surfaces_block_before_any_visit) {
  GeometryObject glass = make_object(square_mesh()),
                 wall = make_object(square_mesh(), {Transform::translation({0, 0, 5})});
  glass.opaque = false;
  const auto geometry = build({glass, wall});
  EXPECT_TRUE(geometry->occluded(ray({0.4f, 0.2f, -1}, {0, 0, 1}), [](const Hit&) {
    ADD_FAILURE() << "visited";
    return true;
  }));
}

TEST(Geometry, opaque_material_slots_block_without_a_visit) {
  MeshInput input = mesh_input(box_shape());
  std::vector<uint16_t> slots(12, 0);
  slots[0] = slots[1] = 1;  // the bottom
  input.triangle_materials = SharedSpan<uint16_t>(slots);
  Report report;
  GeometryObject box = make_object(TriangleMesh::create(std::move(input), report));
  box.opaque = false;
  box.opaque_slots = {0, 1};
  for (const bool flatten : {true, false}) {
    const auto geometry = build({box}, flatten);
    EXPECT_TRUE(geometry->occluded(ray({0.1f, 0.2f, -5}, {0, 0, 1}), [](const Hit&) { return true; }));
    EXPECT_FALSE(geometry->occluded(ray({-5, 0.1f, 0.2f}, {1, 0, 0}), [](const Hit&) { return true; }));
  }
}

TEST(Geometry, rays_that_are_not_finite_hit_nothing_and_return) {
  const auto geometry = build({make_object(make_mesh(icosphere_shape(3)))});
  for (const Vec3& bad : {Vec3(NAN), Vec3(k_infinity, 0, 0), Vec3(0, NAN, 0)}) {
    Hit hit;
    EXPECT_FALSE(geometry->intersect(ray(bad, {0, 0, 1}), hit));
    EXPECT_FALSE(geometry->intersect(ray({0, 0, 0}, bad), hit));
  }
}

TEST(Geometry, triangle_in_the_world_is_the_one_that_rays_meet) {
  const Transform transform = Transform::translation({5, 6, 7}) * rotation({1, 2, 3}, 0.5f);
  for (const bool flatten : {true, false}) {
    const auto geometry = build({make_object(make_mesh(icosphere_shape(1)), {transform})}, flatten);
    Hit hit;
    ASSERT_TRUE(geometry->intersect(ray(transform.origin(), {0.3f, 0.5f, 0.7f}), hit));
    const Triangle p = geometry->triangle_world(0, hit.primitive);
    const Vec2 b = hit.barycentric;
    const Vec3 expected = p[0] * (1 - b.x - b.y) + p[1] * b.x + p[2] * b.y;
    EXPECT_LT(length(geometry->surface(hit).p_world - expected), 5e-6f);
  }
}

TEST(GeometryBuilder, unchanged_objects_give_the_same_snapshot) {
  GeometryBuilder builder;
  Report report;
  const auto mesh = make_mesh(box_shape());
  const auto first = *builder.build({make_object(mesh)}, {}, CancelFlag(), report);
  EXPECT_EQ(*builder.build({make_object(mesh)}, {}, CancelFlag(), report), first);
  GeometryObject changed = make_object(mesh);
  changed.visibility = k_visible_camera;
  EXPECT_NE(*builder.build({changed}, {}, CancelFlag(), report), first);
}

TEST(GeometryBuilder, snapshots_outlive_it_and_each_other) {
  std::shared_ptr<const Geometry> first, second;
  {
    GeometryBuilder builder;
    Report report;
    GeometryOptions options;
    options.flatten = false;
    const auto mesh = make_mesh(box_shape());
    first = *builder.build({make_object(mesh)}, options, CancelFlag(), report);
    second = *builder.build({make_object(mesh, {Transform::translation({9, 0, 0})})}, options, CancelFlag(), report);
  }
  EXPECT_TRUE(first->occluded(ray({0, 0.1f, 5}, {0, 0, -1})));
  first.reset();
  EXPECT_TRUE(second->occluded(ray({9, 0.1f, 5}, {0, 0, -1})));
  EXPECT_FALSE(second->occluded(ray({0, 0.1f, 5}, {0, 0, -1})));
}

TEST(GeometryBuilder, a_mesh_that_turns_transparent_is_visited_though_it_was_cached) {
  GeometryBuilder builder;
  Report report;
  GeometryOptions options;
  options.flatten = false;
  GeometryObject object = make_object(square_mesh());
  ASSERT_TRUE(builder.build({object}, options, CancelFlag(), report));
  object.opaque = false;
  const auto geometry = *builder.build({object}, options, CancelFlag(), report);
  EXPECT_FALSE(geometry->occluded(ray({0.4f, 0.2f, -1}, {0, 0, 1}), [](const Hit&) { return true; }));
}

TEST(GeometryBuilder, cancelled_before_it_starts_builds_nothing) {
  GeometryBuilder builder;
  Report report;
  CancelFlag cancel;
  cancel.cancel();
  const auto result = builder.build({make_object(square_mesh())}, {}, cancel, report);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error(), "cancelled");
}

}  // namespace
}  // namespace lambent
