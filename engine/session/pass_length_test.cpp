#include "engine/session/pass_length.h"

#include <gtest/gtest.h>

#include <vector>

namespace lambent {
namespace {

std::vector<int64_t> targets(double sample_s, int64_t limit = 0, int count = 8) {
  std::vector<int64_t> found{next_pass_target(0, limit, 0.0)};
  while (static_cast<int>(found.size()) < count) found.push_back(next_pass_target(found.back(), limit, sample_s));
  return found;
}

using Targets = std::vector<int64_t>;

TEST(PassLength, passes_of_quick_samples_grow_to_sixteen) {
  EXPECT_EQ(targets(0.01), (Targets{1, 2, 4, 8, 16, 32, 48, 64}));
  EXPECT_EQ(targets(0.0), (Targets{1, 2, 4, 8, 16, 32, 48, 64}));
}

TEST(PassLength, passes_take_a_second_at_most_where_a_sample_does_not) {
  EXPECT_EQ(targets(0.3), (Targets{1, 2, 4, 7, 10, 13, 16, 19}));
  for (const double sample_s : {0.02, 0.07, 0.11, 0.3, 0.9})
    for (int64_t samples = 1; samples < 200; ++samples)
      EXPECT_LE(static_cast<double>(next_pass_target(samples, 0, sample_s) - samples) * sample_s, k_longest_pass_s);
}

TEST(PassLength, passes_of_slow_samples_are_of_one) {
  EXPECT_EQ(targets(0.7), (Targets{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(targets(1e9), (Targets{1, 2, 3, 4, 5, 6, 7, 8}));
}

TEST(PassLength, no_pass_goes_past_what_is_asked_for_or_where_pixels_may_stop) {
  EXPECT_EQ(next_pass_target(16, 20, 0.01), 20);
  EXPECT_EQ(next_pass_target(20, 20, 0.01), 20);
  for (const double sample_s : {0.0, 0.07, 0.11, 0.3})
    for (int64_t samples = 0; samples < 200; ++samples)
      EXPECT_EQ((next_pass_target(samples, 0, sample_s) - 1) / k_adaptive_step, samples / k_adaptive_step);
}

}  // namespace
}  // namespace lambent
