#include "engine/lights/emission_aim.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace lambent {
namespace {

/// Arrivals of `light` around some centres, as many around each.
std::vector<EmissionArrival> around(const std::vector<Vec3>& centers, float radius_m, int each, LightIndex light) {
  std::vector<EmissionArrival> arrivals;
  RandomStream random(7);
  for (const Vec3& center : centers)
    for (int i = 0; i < each; ++i) {
      const Vec3 offset(random.next_1d() - 0.5f, random.next_1d() - 0.5f, random.next_1d() - 0.5f);
      arrivals.push_back({light, false, center + offset * (radius_m * 1.1547f), 1.0f});
    }
  return arrivals;
}

TEST(EmissionAim, is_empty_without_arrivals_of_worth) {
  EXPECT_TRUE(EmissionAim().empty());
  EXPECT_TRUE(EmissionAim({}, 0.1f).empty());
  const float nan = std::nanf("");
  const std::vector<EmissionArrival> none = {{0, false, Vec3(0.0f), 0.0f},
                                             {0, false, Vec3(0.0f), nan},
                                             {0, false, Vec3(nan), 1.0f},
                                             {0, false, Vec3(0.0f), -1.0f}};
  EXPECT_TRUE(EmissionAim(none, 0.1f).empty());
}

TEST(EmissionAim, divides_what_lies_apart_but_makes_no_targets_of_a_few_arrivals) {
  const EmissionAim two(around({{0, 0, 0}, {10, 0, 0}}, 0.5f, 15, 0), 1e-3f);
  ASSERT_EQ(two.targets().size(), 2u);
  for (const EmissionTarget& target : two.targets()) {
    EXPECT_LT(target.radius_m, 1.0f);
    EXPECT_TRUE(length(target.center_world) < 0.5f || length(target.center_world - Vec3(10, 0, 0)) < 0.5f);
  }
  EXPECT_EQ(EmissionAim(around({{0, 0, 0}, {10, 0, 0}}, 0.5f, 5, 0), 1e-3f).targets().size(), 1u);
  const EmissionAim point(around({{3, 2, 1}}, 0.0f, 100, 0), 0.25f);
  ASSERT_EQ(point.targets().size(), 1u);
  EXPECT_EQ(point.targets()[0].radius_m, 0.25f) << "no smaller than what was asked for";
  std::vector<Vec3> many;
  for (int i = 0; i < 100; ++i) many.emplace_back(static_cast<float>(i % 10) * 9, static_cast<float>(i / 10) * 9, 0);
  EXPECT_EQ(EmissionAim(around(many, 0.5f, 50, 0), 1e-3f).targets().size(),
            static_cast<size_t>(EmissionAim::k_most_targets));
}

TEST(EmissionAim, gives_rows_to_the_lights_worth_most_and_one_to_the_rest) {
  std::vector<EmissionArrival> arrivals;
  for (LightIndex light = 0; light < 40; ++light)
    for (const EmissionArrival& a :
         around({{static_cast<float>(light), 0, 0}}, 0.1f, 10 + static_cast<int>(light), light))
      arrivals.push_back(a);
  const EmissionAim aim(arrivals, 1e-3f);
  EXPECT_NE(aim.row_of(39), EmissionAim::k_no_row);
  EXPECT_EQ(aim.row_of(0), EmissionAim::k_no_row);
  ASSERT_NE(aim.row_of_rest(), EmissionAim::k_no_row);
  EXPECT_EQ(aim.light_of(aim.row_of_rest()), k_no_light);
  float sum = 0.0f;
  for (int row = 0; row <= aim.row_of_rest(); ++row) sum += aim.prob(row);
  EXPECT_NEAR(sum, 1.0f, 1e-5f);
}

/// Chosen rows, lines and directions have the densities that are stated: means of 1 / density are the measures that the
/// samples cover, here those of one disk and one cone.
TEST(EmissionAim, samples_with_the_densities_it_states) {
  std::vector<EmissionArrival> arrivals = around({{0, 0, 0}, {4, 0, 1}}, 0.5f, 12, 3);
  for (const EmissionArrival& a : around({{-4, 0, 1}}, 0.5f, 15, 5)) arrivals.push_back(a);
  const EmissionAim aim(arrivals, 1e-3f);
  const Vec3 direction = normalize(Vec3(1, 2, -2)), origin(0.5f, 7, 3);
  constexpr int k_count = 1 << 16;
  RandomStream random(1);
  for (const LightIndex light : {3u, 5u}) {
    const int row = aim.row_of(light);
    double rows = 0.0, area = 0.0, angle = 0.0, exact_area = 0.0, exact_angle = 0.0;
    for (int i = 0; i < k_count; ++i) {
      const Vec2 u = random.next_2d();
      ReusedNumber number(u);
      const EmissionAim::Choice choice = aim.choose(number);
      if (choice.row != row) continue;
      rows += 1.0 / k_count;
      const Vec2 next = random.next_2d();
      // Over disks and cones that do not overlap the integral of 1 is their sum; where a target has no share, 0.
      area += 1.0 /
              static_cast<double>(aim.density_of_line(row, choice.target->sample_line(direction, next), direction)) /
              k_count;
      angle +=
          1.0 /
          static_cast<double>(aim.density_of_direction(row, origin, choice.target->sample_direction(origin, next))) /
          k_count;
    }
    EXPECT_NEAR(rows, aim.prob(row), 0.01);
    for (const EmissionTarget& target : aim.targets()) {
      const double r = static_cast<double>(target.radius_m),
                   d = static_cast<double>(length(target.center_world - origin));
      const bool shared = aim.density_of_line(row, target.center_world, direction) > 0.0f;
      exact_area += shared ? std::numbers::pi * r * r : 0.0;
      exact_angle += shared ? 2 * std::numbers::pi * (1 - std::sqrt(1 - r * r / (d * d))) : 0.0;
    }
    EXPECT_NEAR(area / exact_area, 1.0, 0.03) << light;
    EXPECT_NEAR(angle / exact_angle, 1.0, 0.03) << light;
  }
  // From within a target every direction is aimed.
  for (const EmissionTarget& target : aim.targets())
    for (const Vec3& any : {direction, -direction})
      EXPECT_GT(aim.density_of_direction(aim.row_of(3), target.center_world, any) +
                    aim.density_of_direction(aim.row_of(5), target.center_world, any),
                0.0f);
}

}  // namespace
}  // namespace lambent
