#include "engine/sampling/sampler.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <set>
#include <vector>

#include "engine/sampling/chi_square.h"
#include "engine/sampling/dimension.h"
#include "engine/sampling/event_numbers.h"

namespace lambent {
namespace {

TEST(Sampler, second_sobol_dimension_matches_its_direction_numbers) {
  // Definition: v_1 = 1/2, v_{i+1} = v_i xor (v_i >> 1).
  for (uint32_t index : {0u, 1u, 2u, 3u, 5u, 255u, 1000u, 123456789u, 0xffffffffu}) {
    uint32_t expected = 0;
    uint32_t direction = 0x80000000u;
    for (uint32_t bits = index; bits; bits >>= 1, direction ^= direction >> 1)
      if (bits & 1u) expected ^= direction;
    EXPECT_EQ(reverse_bits(sobol_second_reversed(index)), expected) << index;
  }
}

TEST(Sampler, scrambling_is_a_bijection_that_never_looks_at_higher_bits) {
  for (const uint32_t seed : {0u, 1u, 0x80000000u, 0xdeadbeefu}) {
    std::set<uint32_t> seen;
    for (uint32_t x = 0; x < 4096; ++x) {
      const uint32_t y = owen_scramble_reversed(x, seed) & 0xfffu;
      EXPECT_EQ(y, owen_scramble_reversed(x | 0xabcd0000u, seed) & 0xfffu);
      seen.insert(y);
    }
    EXPECT_EQ(seen.size(), 4096u);
  }
}

// Every elementary interval 2^-j x 2^-(k-j) holds exactly one of 2^k consecutive aligned samples.
void expect_net(uint32_t seed, int x, int y, uint32_t first, int k, uint32_t dimension) {
  const uint32_t n = 1u << k;
  for (int j = 0; j <= k; ++j) {
    std::vector<int> count(n, 0);
    for (uint32_t i = 0; i < n; ++i) {
      const Vec2 p = Sampler(seed, x, y, first + i).get_2d(dimension);
      const auto column = static_cast<uint32_t>(p.x * static_cast<float>(1u << j));
      const auto row = static_cast<uint32_t>(p.y * static_cast<float>(1u << (k - j)));
      ++count[column * (1u << (k - j)) + row];
    }
    for (const int c : count) ASSERT_EQ(c, 1) << "2^" << k << " samples from " << first << ", j = " << j;
  }
}

TEST(Sampler, numbers_of_an_event_are_those_drawn_one_by_one) {
  for (uint32_t i = 0; i < 2000; ++i) {
    const Sampler sampler(i, static_cast<int>(7 * i), -static_cast<int>(i), hash_u32(i));
    const uint32_t bounce = i % 50;
    const EventNumbers numbers(sampler, bounce);
    const auto one = [&](BounceDimension which) { return sampler.get_1d(bounce_dimension(bounce, which)); };
    const auto two = [&](BounceDimension which) { return sampler.get_2d(bounce_dimension(bounce, which)); };
    EXPECT_EQ(numbers.light, two(k_dimension_light));
    EXPECT_EQ(numbers.lobe, one(k_dimension_lobe));
    EXPECT_EQ(numbers.direction, two(k_dimension_direction));
    EXPECT_EQ(numbers.roulette, one(k_dimension_roulette));
    EXPECT_EQ(numbers.shadow_roulette, one(k_dimension_shadow_roulette));
  }
}

TEST(Sampler, aligned_powers_of_two_are_stratified_in_every_elementary_interval) {
  for (int k = 0; k <= 10; ++k) {
    expect_net(0, 0, 0, 0, k, 1);
    expect_net(42, 17, -3, 3u << k, k, bounce_dimension(5, k_dimension_light));
  }
}

TEST(ReusedNumber, keeps_the_strata_of_what_chose_alike) {
  // Of 64 stratified points a choice of 1/4 takes exactly 16, each in a sixteenth of its own; so for choices of
  // choices.
  const double begin = 0.5, width = 0.25;
  std::vector<int> count(16, 0);
  int chosen = 0, twice = 0;
  for (uint32_t i = 0; i < 64; ++i) {
    ReusedNumber u(Sampler(3, 1, 2, i).get_2d(bounce_dimension(0, k_dimension_direction)));
    if (u.value() < begin || u.value() >= begin + width) continue;
    ++chosen;
    u.stretch(begin, width);
    ++count[static_cast<size_t>(u.rest() * 16.0f)];
    if (u.value() < 0.25) ++twice;
  }
  EXPECT_EQ(chosen, 16);
  EXPECT_EQ(twice, 4);
  for (const int c : count) EXPECT_EQ(c, 1);
}

TEST(ReusedNumber, is_uniform_after_choices_that_leave_nothing_of_24_bits) {
  // Twenty choices of 1/4 each: 2^-40.
  double sum = 0.0, squares = 0.0;
  constexpr int k_count = 20000;
  for (uint32_t i = 0; i < k_count; ++i) {
    ReusedNumber u(Sampler(5, 0, 0, i).get_2d(7));
    for (int choice = 0; choice < 20; ++choice) u.stretch(std::floor(4.0 * u.value()) / 4.0, 0.25);
    const double x = static_cast<double>(u.rest());
    ASSERT_TRUE(x >= 0.0 && x < 1.0);
    sum += x;
    squares += x * x;
  }
  // 4.5 standard errors of the moments of a uniform number.
  EXPECT_NEAR(sum / k_count, 0.5, 4.5 * std::sqrt(1.0 / 12.0 / k_count));
  EXPECT_NEAR(squares / k_count, 1.0 / 3.0, 4.5 * std::sqrt(4.0 / 45.0 / k_count));
}

TEST(Sampler, stays_stratified_after_millions_of_samples) {
  expect_net(1, 100, 200, 64u << 20, 10, 3);  // samples from 67,108,864 on
  // The first 2^22 samples fill 2^22 strata of one axis.
  std::vector<bool> seen(1u << 22, false);
  for (uint32_t i = 0; i < (1u << 22); ++i) {
    const auto cell = static_cast<uint32_t>(Sampler(9, 1, 2, i).get_1d(4) * static_cast<float>(1u << 22));
    ASSERT_FALSE(seen[cell]);
    seen[cell] = true;
  }
}

TEST(Sampler, values_are_in_the_half_open_unit_interval) {
  EXPECT_EQ(unit_float(0xffffffffu), k_one_minus_epsilon);
  EXPECT_EQ(unit_float(0u), 0.0f);
}

TEST(Sampler, one_dimensional_numbers_are_the_first_of_the_pair) {
  for (uint32_t i = 0; i < 100; ++i) EXPECT_EQ(Sampler(1, 2, 3, i).get_1d(7), Sampler(1, 2, 3, i).get_2d(7).x);
}

// Sums over samples of products of two numbers that should be independent: correlation within 5 standard errors.
double correlation(const std::function<std::pair<float, float>(uint32_t)>& pair, uint32_t n) {
  double sum = 0.0;
  for (uint32_t i = 0; i < n; ++i) {
    const auto [a, b] = pair(i);
    sum += (static_cast<double>(a) - 0.5) * (static_cast<double>(b) - 0.5);
  }
  return sum / n * 12.0 * std::sqrt(static_cast<double>(n));  // unit variance for independent uniforms
}

TEST(Sampler, dimensions_pixels_and_seeds_are_uncorrelated) {
  const uint32_t n = 1 << 16;
  for (uint32_t d = 0; d < 40; ++d) {
    EXPECT_LT(std::fabs(correlation(
                  [&](uint32_t i) {
                    const Sampler s(5, 3, 4, i);
                    return std::pair(s.get_1d(d), s.get_1d(d + 1));
                  },
                  n)),
              5.0)
        << d;
    EXPECT_LT(std::fabs(correlation(
                  [&](uint32_t i) {
                    return std::pair(Sampler(5, static_cast<int>(i), 4, 0).get_1d(d),
                                     Sampler(5, static_cast<int>(i) + 1, 4, 0).get_1d(d));
                  },
                  n)),
              5.0)
        << d;
    EXPECT_LT(
        std::fabs(correlation(
            [&](uint32_t i) { return std::pair(Sampler(i, 3, 4, 0).get_1d(d), Sampler(i + 1, 3, 4, 0).get_1d(d)); },
            n)),
        5.0)
        << d;
  }
}

TEST(Sampler, first_samples_of_pixels_are_uniform) {
  const auto result = chi_square_test_2d(
      {0, 0}, {1, 1},
      [i = 0](const Vec2&) mutable {
        ++i;
        return Sampler(0, i % 1000, i / 1000, 0).get_2d(bounce_dimension(0, k_dimension_direction));
      },
      [](const Vec2&) { return 1.0f; }, 1);
  EXPECT_GT(result.p_value, sidak_significance(2));
}

TEST(Sampler, integrates_a_smooth_function_faster_than_random_numbers) {
  // Error of 4096 samples of an integral over the square, root mean square of 64 pixels: scrambled nets converge as
  // N^-1.5 on smooth integrands, random numbers as N^-0.5 (0.0056 for this one).
  double square = 0.0;
  for (int pixel = 0; pixel < 64; ++pixel) {
    double sum = 0.0;
    for (uint32_t i = 0; i < 4096; ++i) {
      const Vec2 p = Sampler(3, pixel, 0, i).get_2d(2);
      sum += std::sin(3.0 * static_cast<double>(p.x)) * static_cast<double>(p.y);
    }
    const double error = sum / 4096 - (1.0 - std::cos(3.0)) / 6.0;
    square += error * error / 64;
  }
  EXPECT_LT(std::sqrt(square), 2e-5);
}

TEST(RandomStream, is_uniform) {
  const auto result = chi_square_test_2d(
      {0, 0}, {1, 1}, [](const Vec2& u) { return u; }, [](const Vec2&) { return 1.0f; }, 1, 1'000'000, 99);
  EXPECT_GT(result.p_value, sidak_significance(2));
}

TEST(Dimension, numbers_of_different_decisions_differ) {
  std::set<uint32_t> seen;
  const auto add = [&](uint32_t d) { EXPECT_TRUE(seen.insert(d).second) << d; };
  for (uint32_t d = 0; d < k_camera_dimensions; ++d) add(d);
  for (uint32_t d = 0; d < 3; ++d) add(k_light_path_dimension + d);
  for (uint32_t bounce = 0; bounce < 1024; ++bounce)
    for (uint32_t d = 0; d < k_bounce_stride; ++d) {
      add(bounce_dimension(bounce, static_cast<BounceDimension>(d)));
      add(light_bounce_dimension(bounce, static_cast<BounceDimension>(d)));
    }
}

}  // namespace
}  // namespace lambent
