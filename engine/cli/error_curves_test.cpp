#include "engine/cli/error_curves.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

namespace lambent {
namespace {

ErrorCurve power_law(const std::string& name, double error_at_1_s, double slope, double first_s, double last_s) {
  ErrorCurve curve{name, {}, {}};
  for (double t = first_s; t <= last_s; t *= 2.0) {
    curve.time_s.push_back(t);
    curve.error.push_back(error_at_1_s * std::pow(t, slope));
  }
  return curve;
}

TEST(ErrorCurves, csv_is_read_as_it_was_written) {
  const std::vector<CurvePoint> points = {{"PT", 1.0, 0, 7, 12, 1.25, 2.5, 0.125, 0.0625, 0.25, 3},
                                          {"VCM", 0.0, 16, 8, 16, 0.5, 1.0, 1e-7, 5e-8, 0.5, 0}};
  const std::string path = testing::TempDir() + "curves.csv";
  std::ofstream(path) << csv_text(points);
  const auto read = read_csv(path);
  ASSERT_TRUE(read) << read.error();
  ASSERT_EQ(read->size(), 2u);
  EXPECT_EQ((*read)[0].integrator, "PT");
  EXPECT_EQ((*read)[0].seed, 7u);
  EXPECT_EQ((*read)[0].rel_mse, 0.125);
  EXPECT_EQ((*read)[0].rel_mse_trimmed, 0.0625);
  EXPECT_EQ((*read)[0].non_finite, 3u);
  EXPECT_EQ((*read)[1].sample_limit, 16);
  EXPECT_EQ((*read)[1].rel_mse, 1e-7);
  std::filesystem::remove(path);
}

TEST(ErrorCurves, a_damaged_csv_is_named_with_its_line) {
  const std::string path = testing::TempDir() + "damaged.csv";
  std::ofstream(path) << csv_text({}) << "PT,1,2\n";
  const auto short_line = read_csv(path);
  ASSERT_FALSE(short_line);
  EXPECT_NE(short_line.error().find("damaged.csv', line 2"), std::string::npos) << short_line.error();
  std::ofstream(path) << "time,error\n";
  EXPECT_FALSE(read_csv(path));
  EXPECT_FALSE(read_csv(path + ".missing"));
  std::filesystem::remove(path);
}

TEST(ErrorCurves, points_of_one_limit_are_averaged_over_seeds) {
  const std::vector<CurvePoint> points = {{"PT", 2.0, 0, 1, 4, 2.0, 4.0, 0.3, 0.25, 0.1, 0},
                                          {"PT", 1.0, 0, 1, 2, 1.0, 2.0, 0.8, 0.7, 0.2, 0},
                                          {"PT", 2.0, 0, 2, 4, 2.2, 4.2, 0.5, 0.4, 0.3, 0}};
  const auto by_render = curves_of(points, Clock::render, ErrorMeasure::rel_mse);
  ASSERT_EQ(by_render.size(), 1u);
  ASSERT_EQ(by_render[0].time_s.size(), 2u);
  EXPECT_DOUBLE_EQ(by_render[0].time_s[0], 1.0);
  EXPECT_DOUBLE_EQ(by_render[0].time_s[1], 2.1);
  EXPECT_DOUBLE_EQ(by_render[0].error[1], 0.4);
  const auto by_cpu = curves_of(points, Clock::cpu, ErrorMeasure::smape);
  EXPECT_DOUBLE_EQ(by_cpu[0].time_s[1], 4.1);
  EXPECT_DOUBLE_EQ(by_cpu[0].error[1], 0.2);
}

TEST(ErrorCurves, a_power_law_is_interpolated_exactly) {
  const ErrorCurve curve = power_law("PT", 1.0, -1.0, 1.0, 16.0);
  EXPECT_NEAR(*error_at(curve, 3.0), 1.0 / 3.0, 1e-12);
  EXPECT_NEAR(*time_to(curve, 0.1), 10.0, 1e-12);
  EXPECT_FALSE(error_at(curve, 0.5));
  EXPECT_FALSE(error_at(curve, 17.0));
  EXPECT_FALSE(time_to(curve, 0.01));
}

TEST(ErrorCurves, four_times_less_variance_is_four_times_the_speed) {
  const SpeedUp found = speed_up(power_law("VCM", 0.25, -1.0, 1.0, 16.0), power_law("PT", 1.0, -1.0, 1.0, 16.0));
  EXPECT_EQ(found.time_s, 16.0);
  EXPECT_NEAR(*found.error_ratio, 4.0, 1e-12);
  EXPECT_NEAR(found.time_ratio, 4.0, 1e-12);
  EXPECT_NEAR(found.error, 1.0 / 16.0, 1e-12);
  EXPECT_EQ(found.time_bound, Bound::none);
}

TEST(ErrorCurves, curves_that_do_not_overlap_give_bounds) {
  const ErrorCurve good = power_law("VCM", 1e-3, -1.0, 1.0, 16.0), bad = power_law("PT", 1.0, -1.0, 1.0, 16.0);
  const SpeedUp gain = speed_up(good, bad), loss = speed_up(bad, good);
  EXPECT_EQ(gain.time_bound, Bound::at_least);
  EXPECT_NEAR(gain.time_ratio, 16.0, 1e-12);
  EXPECT_NEAR(*gain.error_ratio, 1000.0, 1e-9);
  EXPECT_EQ(loss.time_bound, Bound::at_most);
  EXPECT_NEAR(loss.time_ratio, 1.0 / 16.0, 1e-12);
}

}  // namespace
}  // namespace lambent
