// Walks inside closed shapes at all scales and places: no ray may leave, none may meet the triangle that it starts on.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "engine/geometry/shapes_for_tests.h"

namespace lambent {
namespace {

constexpr int k_bounces = 150000;  // per configuration; about 1.4e7 in the whole file

struct Walk {
  int escapes = 0, self_hits = 0;
  float largest_error = 0.0f;  ///< m
};

/// Uniform and grazing directions alternate. Directions closer to the surface than rounding of a unit vector can tell
/// (cos < 1e-5) have no side and carry no light: they are replaced.
Walk walk_inside(const Geometry& geometry, const Vec3& centre, uint64_t seed) {
  TestRandom random(seed);
  const DenormalsFlushed denormals_flushed;
  Walk walk;
  Ray ray;
  ray.origin = centre;
  ray.direction = random.direction();
  Hit previous;
  for (int i = 0; i < k_bounces; ++i) {
    Hit hit;
    if (!geometry.intersect(ray, hit)) {
      ++walk.escapes;
      ray.origin = centre;
      ray.direction = random.direction();
      previous = {};
      continue;
    }
    walk.self_hits += hit.instance == previous.instance && hit.primitive == previous.primitive;
    previous = hit;
    const SurfaceHit point = geometry.surface(hit);
    walk.largest_error = std::max(walk.largest_error, point.p_error);
    const Vec3 inwards = dot(point.ng_world, ray.direction) < 0.0f ? point.ng_world : -point.ng_world;
    Vec3 direction = random.direction();
    if (dot(direction, inwards) < 0.0f) direction = -direction;
    if (i % 4 == 0) direction = normalize(direction - inwards * dot(direction, inwards) * 0.999f);
    if (dot(direction, inwards) < 1e-5f) direction = inwards;
    ray = ray_from_surface(point.p_world, point.p_error, point.ng_world, direction, k_visible_all);
  }
  return walk;
}

enum class Placing { flattened, instanced, in_mesh };

void expect_closed(const Shape& shape, const Transform& transform, uint64_t seed, const std::string& what) {
  for (const Placing placing : {Placing::flattened, Placing::instanced, Placing::in_mesh}) {
    const bool in_mesh = placing == Placing::in_mesh;
    GeometryOptions options;
    options.flatten = placing != Placing::instanced;
    GeometryBuilder builder;
    Report report;
    const auto geometry = builder.build(
        {make_object(make_mesh(in_mesh ? shape.transformed(transform) : shape), {in_mesh ? Transform() : transform})},
        options, CancelFlag(), report);
    ASSERT_TRUE(geometry) << geometry.error();
    const Walk walk = walk_inside(**geometry, transform.origin(), seed);
    EXPECT_EQ(walk.escapes, 0) << what << ", placing " << int(placing);
    EXPECT_EQ(walk.self_hits, 0) << what << ", placing " << int(placing);
  }
}

class ClosedShape : public testing::TestWithParam<int> {
 protected:
  Shape shape() const { return GetParam() == 0 ? box_shape() : icosphere_shape(GetParam()); }
  static Transform turned() { return rotation({1, 2, 3}, 1.1f); }
};

TEST_P(ClosedShape, keeps_rays_inside_at_scales_from_1e_minus_6_to_1e6) {
  for (const float scale : {1e-6f, 1e-3f, 1.0f, 1e3f, 1e6f}) {
    const Transform scaled = Transform::scale(Vec3(scale));
    expect_closed(shape(), scaled, 1, fmt::format("scale {}", scale));
    expect_closed(shape(), Transform::translation(Vec3(3, -5, 7) * scale) * turned() * scaled, 2,
                  fmt::format("turned and moved, scale {}", scale));
  }
}

TEST_P(ClosedShape, keeps_rays_inside_ten_thousand_diameters_from_the_origin) {
  for (const float scale : {1e-6f, 1.0f, 100.0f}) {
    const Transform away = Transform::translation(Vec3(1e4f, -1e4f, 1e4f) * scale);
    expect_closed(shape(), away * Transform::scale(Vec3(scale)), 3, fmt::format("scale {}", scale));
    expect_closed(shape(), away * turned() * Transform::scale(Vec3(scale)), 4, fmt::format("turned, scale {}", scale));
  }
}

TEST_P(ClosedShape, keeps_rays_inside_under_scaling_by_different_factors) {
  for (const float scale : {1e-6f, 1.0f, 1e6f})
    expect_closed(
        shape(),
        Transform::translation(Vec3(3, -5, 7) * scale) * turned() * Transform::scale(Vec3(1.0f, 0.4f, 4.0f) * scale), 5,
        fmt::format("scale {}", scale));
}

TEST_P(ClosedShape, keeps_rays_inside_when_mirrored) {
  expect_closed(shape(), turned() * Transform::scale({-1, 1, 1}), 6, "mirrored");
}

INSTANTIATE_TEST_SUITE_P(Shapes, ClosedShape, testing::Values(0, 3, 5), [](const auto& shape) {
  return shape.param == 0 ? std::string("box") : "icosphere_" + std::to_string(shape.param);
});

TEST(Bounce, room_of_overlapping_instances_loses_no_more_rays_than_rounding_at_the_edges_explains) {
  // Six instances of one square, as walls are modelled with duplicated planes. They overlap a little at the edges.
  Shape square;
  for (const Vec3& p : {Vec3(-1, -1, 0), Vec3(1, -1, 0), Vec3(1, 1, 0), Vec3(-1, 1, 0)}) square.add(p * 1.001f);
  square.triangles = {0, 1, 2, 0, 2, 3};
  for (const float scale : {1e-5f, 1.0f, 1e5f}) {
    std::vector<Transform> walls;
    const Transform outer =
        Transform::translation(Vec3(20, 30, -10) * scale) * Transform::scale(Vec3(scale)) * rotation({3, 1, 2}, 0.7f);
    for (int axis = 0; axis < 3; ++axis)
      for (const float side : {-1.0f, 1.0f}) {
        const Vec3 around = axis == 0 ? Vec3(0, 1, 0) : Vec3(1, 0, 0);
        walls.push_back(outer * rotation(around, axis == 2 ? 0.0f : k_pi / 2) * Transform::translation({0, 0, side}));
      }
    GeometryBuilder builder;
    Report report;
    const auto geometry = builder.build({make_object(make_mesh(square), walls)}, {}, CancelFlag(), report);
    ASSERT_TRUE(geometry) << geometry.error();
    const Walk walk = walk_inside(**geometry, outer.origin(), 7);
    EXPECT_EQ(walk.self_hits, 0) << scale;
    // Where walls pass through each other no edge of a triangle tells that the room ends: points within the error of
    // that line may lie behind the other wall. Such strips along the 12 edges of length 2, on both walls, are this
    // share of the area 6·4; the number of hits in them is Poisson distributed.
    const double share = 12.0 * 2.0 * 2.0 * double(walk.largest_error / scale) / 24.0, expected = k_bounces * share;
    EXPECT_LE(walk.escapes, expected + 4.0 * std::sqrt(expected)) << scale;
    EXPECT_LT(share, 2e-4) << scale;
  }
}

TEST(Segment, between_two_points_of_a_closed_shape_is_not_blocked_by_the_surfaces_at_its_ends) {
  for (const float scale : {1e-6f, 1.0f, 1e6f}) {
    GeometryBuilder builder;
    Report report;
    const Transform transform = Transform::translation(Vec3(3, -5, 7) * scale) * Transform::scale(Vec3(scale));
    const auto geometry =
        builder.build({make_object(make_mesh(icosphere_shape(4)), {transform})}, {}, CancelFlag(), report);
    ASSERT_TRUE(geometry);
    const DenormalsFlushed denormals_flushed;
    TestRandom random(8);
    const auto point_on = [&] {
      Hit hit;
      Ray ray;
      ray.origin = transform.origin();
      ray.direction = random.direction();
      EXPECT_TRUE((*geometry)->intersect(ray, hit));
      return (*geometry)->surface(hit);
    };
    int blocked = 0;
    for (int i = 0; i < 200000; ++i) {
      const SurfaceHit a = point_on(), b = point_on();
      const Vec3 ab = b.p_world - a.p_world;
      // Chords within neighbouring triangles are tangent to rounding.
      if (length(ab) < 0.2f * scale) continue;
      const Vec3 start = offset_origin(a.p_world, a.p_error, a.ng_world, ab);
      const Vec3 end = offset_origin(b.p_world, b.p_error, b.ng_world, -ab);
      blocked += (*geometry)->occluded(segment(start, end, k_visible_shadow));
    }
    EXPECT_EQ(blocked, 0) << scale;
  }
}

}  // namespace
}  // namespace lambent
