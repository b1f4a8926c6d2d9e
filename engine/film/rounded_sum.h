// Sums of many numbers in single floats that do not drift.
//
// A float sum that is rounded to the nearest loses what each number has below its last bit: what is always the same is
// lost always, and a sum stops growing. Here each addition rounds up or down with the probability that makes the
// expected sum exact: noise of a part of the last bit is added to the number before the addition rounds (Widrow &
// Kollar 2008, "Quantization Noise", ch. 19: dither). The noise is a function of the sample's number alone, even like a
// Weyl sequence, so that equal values have equal sums, whoever adds them. The error of n additions is some sqrt(n) / 5
// last bits for values like noise (1e-5 of the sum after 100,000) and a few last bits for equal ones.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace lambent {

/// The noise of a sample: uniform in (-1/2, 1/2) times the last bit of a float of [1, 2).
inline float rounding_noise(int64_t sample) {
  const uint32_t even = static_cast<uint32_t>(sample) * 2654435769u;           // by the golden section
  const int32_t centred = static_cast<int32_t>((even >> 8) | 1u) - (1 << 23);  // odd: never a half
  return static_cast<float>(centred) * 0x1p-47f;
}

/// Of one or several sums. @param noise as rounding_noise()
template <typename Floats, typename Bits>
inline Floats rounded_sum(const Floats& sum, const Floats& value, float noise) {
  const Bits exponent = std::bit_cast<Bits>(sum) & 0x7f800000u;  // the power of two below the sum; 0: no noise
  return sum + (value + std::bit_cast<Floats>(exponent) * noise);
}

inline void add_rounded(float& sum, float value, float noise) { sum = rounded_sum<float, uint32_t>(sum, value, noise); }

/// Adds each of `count` values to its sum.
inline void add_rounded(const float* values, size_t count, float* sums, float noise) {
  const auto add_several = [&]<typename Floats, typename Bits>(size_t i, Floats, Bits) {
    Floats sum, value;
    std::memcpy(&sum, sums + i, sizeof sum);
    std::memcpy(&value, values + i, sizeof value);
    sum = rounded_sum<Floats, Bits>(sum, value, noise);
    std::memcpy(sums + i, &sum, sizeof sum);
  };
  using Floats8 = float __attribute__((vector_size(32)));
  using Bits8 = uint32_t __attribute__((vector_size(32)));
  using Floats4 = float __attribute__((vector_size(16)));
  using Bits4 = uint32_t __attribute__((vector_size(16)));
  size_t i = 0;
  for (; i + 32 <= count; i += 32)
    for (size_t k = 0; k < 32; k += 8) add_several(i + k, Floats8{}, Bits8{});
  for (; i + 8 <= count; i += 8) add_several(i, Floats8{}, Bits8{});
  if (i + 4 <= count) {
    add_several(i, Floats4{}, Bits4{});
    i += 4;
  }
  const size_t rest = count - i;  // not in a loop, of which the compiler makes more than it is worth
  if (rest > 0) add_rounded(sums[i], values[i], noise);
  if (rest > 1) add_rounded(sums[i + 1], values[i + 1], noise);
  if (rest > 2) add_rounded(sums[i + 2], values[i + 2], noise);
}

}  // namespace lambent
