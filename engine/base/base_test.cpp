#include <gtest/gtest.h>

#include "engine/base/frame.h"
#include "engine/base/report.h"
#include "engine/base/transform.h"
#include "engine/base/trig.h"

namespace lambent {
namespace {

Transform skewed() {
  const float rows[12] = {1e3f, 2, -1, 1e6f, 0.5f, 1e-2f, 3, -4, 0, 7, 1, 0.25f};
  return Transform::from_rows(rows);
}

TEST(Transform, inverse_undoes_the_transform_across_scales) {
  for (const float scale : {1e-6f, 1.0f, 1e6f}) {
    const Transform t = Transform::scale(Vec3(scale)) * skewed();
    const Transform identity = t.inverse() * t;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) EXPECT_NEAR(identity.m[i][j], i == j ? 1.0f : 0.0f, 2e-4f) << scale;
  }
}

TEST(Transform, singular_and_non_finite_matrices_are_not_invertible) {
  EXPECT_FALSE(Transform::scale({1, 1, 0}).is_invertible());
  EXPECT_FALSE(Transform::scale({1, NAN, 1}).is_invertible());
  EXPECT_FALSE(Transform::translation({INFINITY, 0, 0}).is_invertible());
  EXPECT_TRUE(Transform::scale(Vec3(1e-6f)).is_invertible());
  EXPECT_TRUE(Transform::scale(Vec3(1e6f)).is_invertible());
}

TEST(Transform, mirroring_is_seen_at_any_scale) {
  EXPECT_TRUE(Transform::scale({-1e-6f, 1e-6f, 1e-6f}).mirrors());
  EXPECT_FALSE(Transform::scale({-1e6f, -1e6f, 1e6f}).mirrors());
}

TEST(Transform, normals_stay_orthogonal_to_tangents_under_shear) {
  const Transform t = skewed();
  const Vec3 tangent(1, 2, 3), normal(3, 0, -1);
  const Vec3 n = normalize(t.inverse().transposed_vector(normal)), v = normalize(t.vector(tangent));
  EXPECT_NEAR(dot(n, v), 0.0f, 1e-4f);
}

TEST(Frame, is_orthonormal_for_every_direction_including_the_poles) {
  for (const Vec3& n : {Vec3(0, 0, 1), Vec3(0, 0, -1), normalize(Vec3(1e-20f, 0, -1)), normalize(Vec3(1, 2, 3))}) {
    const Frame frame = Frame::from_normal(n);
    EXPECT_NEAR(dot(frame.s, frame.t), 0.0f, 1e-6f);
    EXPECT_NEAR(dot(frame.s, frame.n), 0.0f, 1e-6f);
    EXPECT_NEAR(length(frame.s), 1.0f, 1e-6f);
    EXPECT_NEAR(length(cross(frame.s, frame.t) - frame.n), 0.0f, 1e-6f);
  }
}

TEST(Vec, normalize_survives_tiny_and_huge_vectors) {
  EXPECT_NEAR(length(normalize(Vec3(1e-30f, 1e-30f, 0))), 1.0f, 1e-6f);
  EXPECT_NEAR(length(normalize(Vec3(1e30f, -1e30f, 0))), 1.0f, 1e-6f);
  EXPECT_EQ(normalize(Vec3(0.0f)), Vec3(0.0f));
}

TEST(Report, keeps_a_bounded_number_of_messages_and_counts_the_rest) {
  Report report;
  for (size_t i = 0; i < Report::k_limit + 5; ++i) report.warning("code", "object", "text");
  EXPECT_EQ(report.messages().size(), Report::k_limit);
  EXPECT_EQ(report.dropped(), 5u);
  EXPECT_FALSE(report.has_errors());
}

TEST(Trig, sine_and_cosine_are_those_of_the_library) {
  for (int i = -100000; i <= 100000; ++i) {
    const float x = static_cast<float>(i) * (0.7853981f / 100000);
    const SinCos eighth = sin_cos_eighth(x);
    ASSERT_NEAR(eighth.sin, std::sin(static_cast<double>(x)), 1.2e-7 * std::fabs(x)) << x;
    ASSERT_NEAR(eighth.cos, std::cos(static_cast<double>(x)), 1.2e-7) << x;
    const float turns = static_cast<float>(i) * 2e-5f;
    const SinCos turn = sin_cos_turn(turns);
    ASSERT_NEAR(turn.sin, std::sin(2.0 * std::numbers::pi * turns), 2e-7) << turns;
    ASSERT_NEAR(turn.cos, std::cos(2.0 * std::numbers::pi * turns), 2e-7) << turns;
  }
  EXPECT_EQ(sin_cos_turn(0.25f).sin, 1.0f);
  EXPECT_EQ(sin_cos_turn(0.25f).cos, 0.0f);
}

}  // namespace
}  // namespace lambent
