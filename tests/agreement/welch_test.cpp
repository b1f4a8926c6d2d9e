#include "tests/common/welch.h"

#include <gtest/gtest.h>

#include <vector>

#include "engine/sampling/sampler.h"

namespace lambent::test {
namespace {

TEST(Student, p_values_are_those_of_the_tables) {
  // Two-sided critical values (Abramowitz & Stegun, table 26.10).
  EXPECT_NEAR(student_p_value(12.706, 1), 0.05, 1e-5);
  EXPECT_NEAR(student_p_value(2.228, 10), 0.05, 1e-4);
  EXPECT_NEAR(student_p_value(-4.587, 10), 0.001, 1e-6);
  EXPECT_NEAR(student_p_value(3.646, 30), 0.001, 1e-6);
  EXPECT_NEAR(student_p_value(0.0, 7), 1.0, 1e-12);
}

std::vector<double> uniform_means(RandomStream& random, int count, double factor) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) {
    double sum = 0.0;
    for (int k = 0; k < 64; ++k) sum += static_cast<double>(random.next_1d());
    values.push_back(factor * sum / 64);
  }
  return values;
}

TEST(Welch, rejects_equal_means_as_often_as_it_says) {
  RandomStream random(1);
  int rejected = 0;
  constexpr int k_trials = 20000;
  for (int i = 0; i < k_trials; ++i) {
    const std::vector<double> a = uniform_means(random, 16, 1.0), b = uniform_means(random, 8, 1.0);
    rejected += welch_test(a, b).p_value < 0.01;
  }
  EXPECT_NEAR(rejected, 0.01 * k_trials, 4.0 * std::sqrt(0.01 * k_trials));
}

TEST(Welch, finds_a_mean_that_is_off_by_a_few_standard_errors) {
  RandomStream random(2);
  // Standard error of the difference: 0.29 / sqrt(64) · sqrt(2 / 16) of 0.5, i.e. 2.6%.
  const std::vector<double> a = uniform_means(random, 16, 1.0), b = uniform_means(random, 16, 1.25);
  EXPECT_LT(welch_test(a, b).p_value, 1e-6);
  EXPECT_GT(welch_test(a, uniform_means(random, 16, 1.0)).p_value, 1e-6);
}

TEST(Welch, values_that_do_not_vary_differ_if_their_difference_is_more_than_rounding) {
  const std::vector<double> a(16, 1.0), b(16, 1.0 + 1e-7);
  EXPECT_EQ(welch_test(a, b, 1e-6).p_value, 1.0);
  EXPECT_LT(welch_test(a, b, 1e-8).p_value, 1e-12);
}

}  // namespace
}  // namespace lambent::test
