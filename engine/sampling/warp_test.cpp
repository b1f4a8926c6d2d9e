#include "engine/sampling/warp.h"

#include <gtest/gtest.h>

#include "engine/base/frame.h"
#include "engine/sampling/chi_square.h"

namespace lambent {
namespace {

// Number of chi-square tests in this file: the Šidák correction keeps the file's false alarms at 1 %.
constexpr int k_tests = 24;

void expect_good(const ChiSquareResult& result, double total, const char* what, double total_tolerance = 2e-3) {
  EXPECT_GT(result.p_value, sidak_significance(k_tests))
      << what << " chi² " << result.statistic << " of " << result.degrees;
  EXPECT_NEAR(result.total_probability, total, total_tolerance) << what;
}

template <typename Sample, typename Density>
void expect_directions_follow(const char* what, Sample&& sample, Density&& density, int steps = 32) {
  expect_good(chi_square_test_2d(
                  {-1, -k_pi}, {1, k_pi}, [&](const Vec2& u) { return cylinder_of_direction(sample(u)); },
                  [&](const Vec2& c) { return density(direction_of_cylinder(c)); }, steps),
              1.0, what);
}

template <typename Sample, typename Invert>
void expect_round_trip(const char* what, Sample&& sample, Invert&& invert, float tolerance = 2e-5f) {
  RandomStream random(7);
  for (int i = 0; i < 10000; ++i) {
    const Vec2 u = random.next_2d();
    const Vec2 v = invert(sample(u));
    // At the seam of an angle 0 and 1 are the same.
    const float dy = std::min(std::fabs(u.y - v.y), 1.0f - std::fabs(u.y - v.y));
    ASSERT_NEAR(u.x, v.x, tolerance) << what << " u " << u.x << " " << u.y;
    ASSERT_LT(dy, tolerance) << what << " u " << u.x << " " << u.y;
    ASSERT_TRUE(v.x >= 0.0f && v.x < 1.0f && v.y >= 0.0f && v.y < 1.0f) << what;
  }
}

TEST(ChiSquare, p_values_match_tables) {
  EXPECT_NEAR(chi_square_p_value(3.841459, 1), 0.05, 1e-6);
  EXPECT_NEAR(chi_square_p_value(249.4451, 199), 0.00889, 5e-4);
  EXPECT_NEAR(chi_square_p_value(18.307038, 10), 0.05, 1e-6);
  EXPECT_NEAR(chi_square_p_value(2.0, 10), 0.99634, 1e-5);
}

TEST(ChiSquare, a_wrong_density_is_rejected) {
  const auto wrong = chi_square_test_2d(
      {0, 0}, {1, 1}, [](const Vec2& u) { return Vec2(std::pow(u.x, 1.02f), u.y); }, [](const Vec2&) { return 1.0f; });
  EXPECT_LT(wrong.p_value, 1e-6);
}

TEST(ChiSquare, samples_where_none_belong_are_rejected) {
  std::vector<double> expected(100, 1000.0), observed(100, 1000.0);
  expected[7] = 0.0;
  observed[7] = 30.0;
  EXPECT_LT(chi_square_test(observed, expected).p_value, 1e-6);
}

TEST(Warp, disk_is_uniform_and_inverts) {
  // Polar domain (r², phi), where the density is constant.
  expect_good(chi_square_test_2d(
                  {0, -k_pi}, {1, k_pi},
                  [](const Vec2& u) {
                    const Vec2 p = sample_disk(u);
                    return Vec2(p.x * p.x + p.y * p.y, std::atan2(p.y, p.x));
                  },
                  [](const Vec2&) { return k_pdf_area_disk * 0.5f; }, 1),
              1.0, "disk");
  expect_round_trip("disk", sample_disk, invert_disk);
}

TEST(Warp, hemispheres_and_sphere_follow_their_densities_and_invert) {
  expect_directions_follow("cosine", sample_cosine_hemisphere,
                           [](const Vec3& w) { return pdf_solid_angle_cosine_hemisphere(w.z); });
  expect_directions_follow("hemisphere", sample_uniform_hemisphere,
                           [](const Vec3& w) { return w.z >= 0 ? k_pdf_solid_angle_uniform_hemisphere : 0.0f; });
  expect_directions_follow("sphere", sample_uniform_sphere,
                           [](const Vec3&) { return k_pdf_solid_angle_uniform_sphere; });
  expect_round_trip("cosine", sample_cosine_hemisphere, invert_cosine_hemisphere, 1e-4f);
  expect_round_trip("hemisphere", sample_uniform_hemisphere, invert_uniform_hemisphere);
  expect_round_trip("sphere", sample_uniform_sphere, invert_uniform_sphere);
}

TEST(Warp, cones_are_uniform_from_a_hair_to_the_sphere) {
  for (const float alpha : {1e-4f, 0.01f, 1.0f, 2.5f, k_pi}) {
    const float one_minus_cos = one_minus_cos_of_angle(alpha);
    // Domain (share of the cone's height, phi): uniform. 1 - cos is recovered from the sine, which stays precise.
    const auto height = [&](const Vec3& w) {
      const float sin_squared = w.x * w.x + w.y * w.y;
      return (w.z > 0 ? sin_squared / (1.0f + w.z) : 1.0f - w.z) / one_minus_cos;
    };
    const float density = pdf_solid_angle_cone(one_minus_cos) * one_minus_cos;
    expect_good(chi_square_test_2d(
                    {0, -k_pi}, {1, k_pi},
                    [&](const Vec2& u) {
                      const Vec3 w = sample_cone(u, one_minus_cos);
                      EXPECT_NEAR(length(w), 1.0f, 1e-6f);
                      return Vec2(std::min(height(w), 1.0f), std::atan2(w.y, w.x));
                    },
                    [&](const Vec2&) { return density; }, 1),
                1.0, "cone");
    expect_round_trip(
        "cone", [&](const Vec2& u) { return sample_cone(u, one_minus_cos); },
        [&](const Vec3& w) { return invert_cone(w, one_minus_cos); }, alpha < 3.0f ? 5e-5f : 2e-3f);
  }
  EXPECT_NEAR(one_minus_cos_of_tangent(1e-5f, 1.0f) / 5e-11f, 1.0f, 1e-5f);
  EXPECT_NEAR(one_minus_cos_of_tangent(1.0f, 1.0f), 1.0f - std::sqrt(0.5f), 1e-7f);
}

TEST(Warp, triangle_is_uniform_and_inverts) {
  expect_good(chi_square_test_2d(
                  {0, 0}, {1, 1},
                  [](const Vec2& u) {
                    const Vec2 b = sample_triangle(u);
                    EXPECT_GE(1.0f - b.x - b.y, -1e-6f);
                    // Uniform on the square if (b0, b1) is uniform on the triangle (Osada 2002, inverted).
                    const float s = b.x + b.y;
                    return Vec2(s * s, s > 0 ? b.x / s : 0.0f);
                  },
                  [](const Vec2&) { return 1.0f; }, 1),
              1.0, "triangle");
  expect_round_trip("triangle", sample_triangle, invert_triangle);
}

struct Shape {
  const char* name;
  Vec3 p, a, b, c;
};

TEST(SphericalTriangle, points_follow_the_density_and_invert) {
  const Shape shapes[] = {
      {"near", {0, 0, 0}, {1, 0, 1}, {0, 1.5f, 0.7f}, {-1, -1, 1}},
      {"huge", {0.1f, 0.1f, 0.02f}, {-3, -2, 0}, {4, -2, 0}, {0, 5, 0}},
      {"obtuse", {0, 0, 0}, {2, 0, 0.5f}, {-2, 0.1f, 0.5f}, {0, 3, 0.5f}},
      {"far", {0, 0, 0}, {10, 0, 3}, {10, 1, 3}, {10, 0, 4}},
  };
  for (const Shape& s : shapes) {
    const SphericalTriangle triangle(s.p, s.a, s.b, s.c);
    const Vec3 normal = cross(s.b - s.a, s.c - s.a);
    // Domain: the square that sample_triangle maps to the triangle, so that density there is pdf · cos · area / d².
    const auto result = chi_square_test_2d(
        {0, 0}, {1, 1},
        [&](const Vec2& u) {
          const Vec2 b = triangle.sample(u);
          EXPECT_GE(b.x, 0.0f);
          EXPECT_GE(b.y, 0.0f);
          EXPECT_LE(b.x + b.y, 1.00001f);
          return invert_triangle(b);
        },
        [&](const Vec2& q) {
          const Vec2 b = sample_triangle(q);
          const Vec3 d = s.a * b.x + s.b * b.y + s.c * (1 - b.x - b.y) - s.p;
          const float l = length(d);
          return triangle.pdf_solid_angle(b) * 0.5f * std::fabs(dot(d, normal)) / (l * l * l);
        },
        100);
    expect_good(result, 1.0, s.name, 3e-3);
    expect_round_trip(
        s.name, [&](const Vec2& u) { return triangle.sample(u); }, [&](const Vec2& b) { return triangle.invert(b); },
        2e-3f);
  }
}

TEST(SphericalTriangle, small_and_degenerate_ones_are_sampled_by_area_or_not_at_all) {
  const SphericalTriangle far({0, 0, 0}, {0, 0, 1e4f}, {1, 0, 1e4f}, {0, 1, 1e4f});
  EXPECT_FALSE(far.by_solid_angle());
  EXPECT_NEAR(far.pdf_solid_angle({0.3f, 0.3f}) / 2e8f, 1.0f, 1e-4f);
  EXPECT_NEAR(far.solid_angle() / 0.5e-8f, 1.0f, 1e-3f);
  const SphericalTriangle line({0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {2, 0, 1});
  EXPECT_EQ(line.pdf_solid_angle({0.3f, 0.3f}), 0.0f);
  const SphericalTriangle edge_on({0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 1, 0});
  EXPECT_EQ(edge_on.pdf_solid_angle({0.3f, 0.3f}), 0.0f);
}

TEST(SphericalTriangle, solid_angle_is_that_of_an_octant_and_invariant_under_scale) {
  for (const float scale : {1e-6f, 1.0f, 1e6f})
    EXPECT_NEAR(SphericalTriangle({0, 0, 0}, {scale, 0, 0}, {0, scale, 0}, {0, 0, scale}).solid_angle(), k_pi / 2,
                1e-6f);
}

SphericalRectangle rectangle_of(const Vec3& p, const Vec3& corner, const Vec3& edge_u, const Vec3& edge_v) {
  return {p, corner, normalize(edge_u), normalize(edge_v), length(edge_u), length(edge_v)};
}

/// Solid angle of a rectangle in z = 0 by its four corners, each signed by its side of p's foot, in double.
double solid_angle_by_corners(double x0, double x1, double y0, double y1, double z) {
  const auto at = [&](double x, double y) { return std::atan(x * y / (z * std::sqrt(x * x + y * y + z * z))); };
  return at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0);
}

TEST(SphericalRectangle, solid_angle_is_that_of_its_corners_from_everywhere) {
  RandomStream random(5);
  for (int i = 0; i < 20000; ++i) {
    // Distances over eight decades, on either side of each edge.
    const auto somewhere = [&] {
      return std::pow(10.0, 8.0 * random.next_1d() - 4.0) * (random.next_1d() < 0.5f ? -1 : 1);
    };
    const float x0 = float(somewhere()), y0 = float(somewhere()), z = float(std::fabs(somewhere()));
    const float width = float(std::fabs(somewhere())), height = float(std::fabs(somewhere()));
    const double expected = solid_angle_by_corners(x0, x0 + width, y0, y0 + height, z);
    if (expected < 1e-8) continue;  // the sum of four angles has no digits left
    const SphericalRectangle rectangle({0, 0, z}, {x0, y0, 0}, {1, 0, 0}, {0, 1, 0}, width, height);
    // The far corners' rounding to float, which shows where the rectangle is much smaller than its distance.
    const double rounding = 1e-6 + 1e-6 * (std::fabs(x0) / width + std::fabs(y0) / height);
    EXPECT_NEAR(rectangle.solid_angle() / expected, 1.0, 4 * rounding)
        << x0 << ' ' << y0 << ' ' << z << ' ' << width << ' ' << height;
  }
}

TEST(SphericalRectangle, points_follow_the_density_and_invert) {
  struct Case {
    const char* name;
    Vec3 p, corner, u, v;
  };
  const Case cases[] = {
      {"above", {0, 0, 1}, {-1, -0.5f, 0}, {2, 0, 0}, {0, 1, 0}},
      {"beside", {3, 0.2f, 0.5f}, {-1, -0.5f, 0}, {2, 0, 0}, {0, 1, 0}},
      {"skimming", {0.2f, 0.1f, 0.01f}, {-1, -0.5f, 0}, {2, 0, 0}, {0, 1, 0}},
      {"strip", {0, 0, 1}, {-20, -0.005f, 0}, {40, 0, 0}, {0, 0.01f, 0}},
      {"far", {0, 0, 1000}, {-1, -0.5f, 0}, {2, 0, 0}, {0, 1, 0}},
  };
  for (const Case& c : cases) {
    const SphericalRectangle rectangle = rectangle_of(c.p, c.corner, c.u, c.v);
    const Vec3 cross_product = cross(c.u, c.v);
    // Domain (s, t), where the density per unit square is the solid-angle density times cos · area / d².
    const auto result = chi_square_test_2d(
        {0, 0}, {1, 1}, [&](const Vec2& u) { return rectangle.sample(u); },
        [&](const Vec2& st) {
          const Vec3 d = c.corner + c.u * st.x + c.v * st.y - c.p;
          const float l = length(d);
          return rectangle.pdf_solid_angle(st) * std::fabs(dot(d, cross_product)) / (l * l * l);
        },
        100);
    expect_good(result, 1.0, c.name);
    expect_round_trip(
        c.name, [&](const Vec2& u) { return rectangle.sample(u); },
        [&](const Vec2& st) { return rectangle.invert(st); }, 1e-3f);
  }
}

TEST(SphericalRectangle, solid_angle_is_a_sixth_of_the_sphere_for_a_face_of_a_cube_at_any_scale) {
  for (const float s : {1e-6f, 1.0f, 1e6f})
    EXPECT_NEAR(rectangle_of({0, 0, 0}, {-s, -s, s}, {2 * s, 0, 0}, {0, 2 * s, 0}).solid_angle(), 4 * k_pi / 6, 1e-6f);
  EXPECT_EQ(rectangle_of({0, 0, 0}, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}).pdf_solid_angle({0.5f, 0.5f}), 0.0f);
  EXPECT_EQ(rectangle_of({0, 0, 0}, {-1, -1, 1}, {0, 0, 0}, {0, 2, 0}).pdf_solid_angle({0.5f, 0.5f}), 0.0f);
}

TEST(Aperture, disk_and_polygons_are_uniform_and_invert) {
  for (const Aperture& aperture : {Aperture{0, 0, 1}, Aperture{3, 0.3f, 1}, Aperture{6, 0.5f, 2}}) {
    const float extent = 1.05f / aperture.ratio;
    const auto result = chi_square_test_2d(
        {-extent, -1.05f}, {extent, 1.05f}, [&](const Vec2& u) { return aperture.sample(u); },
        [&](const Vec2& p) { return aperture.pdf_area(p); }, 300);
    expect_good(result, 1.0, "aperture");
    RandomStream random(3);
    for (int i = 0; i < 10000; ++i) {
      const Vec2 u = random.next_2d();
      const Vec2 p = aperture.sample(u);
      ASSERT_GT(aperture.pdf_area(p), 0.0f);
      const Vec2 again = aperture.sample(aperture.invert(p));
      ASSERT_NEAR(p.x, again.x, 1e-4f);
      ASSERT_NEAR(p.y, again.y, 1e-4f);
    }
  }
}

}  // namespace
}  // namespace lambent
