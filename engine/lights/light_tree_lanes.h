// Four floats at a time, and the packed numbers of a light tree's nodes. By GCC's and Clang's vector extension:
// compilers do not vectorise the branches of the importance by themselves.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace lambent {

using Lanes = float __attribute__((vector_size(16)));
using LaneMask = int32_t __attribute__((vector_size(16)));  ///< of a comparison: all bits, or none
using LaneBits = uint32_t __attribute__((vector_size(16)));
using LaneHalves = uint16_t __attribute__((vector_size(8)));
using LaneFixed = int16_t __attribute__((vector_size(8)));

/// Fixed-point cosines and axes: times this.
inline constexpr float k_fixed = 32767.0f;
/// What rounding to fixed point may change a cosine by, generously.
inline constexpr float k_rounding = 1e-4f;

/// Upper half of a non-negative float, rounded up.
inline uint16_t pack_up(float x) { return static_cast<uint16_t>((std::bit_cast<uint32_t>(x) + 0xffffu) >> 16); }
inline float unpack(uint16_t x) { return std::bit_cast<float>(static_cast<uint32_t>(x) << 16); }
inline int16_t pack_cos_down(float c) { return static_cast<int16_t>(std::floor(std::clamp(c, -1.0f, 1.0f) * k_fixed)); }

template <typename Vector, typename Element>
Vector load(const Element* values) {
  Vector v;
  std::memcpy(&v, values, sizeof(v));
  return v;
}
inline Lanes from_fixed(const int16_t* values) { return __builtin_convertvector(load<LaneFixed>(values), Lanes); }
inline Lanes from_halves(const uint16_t* values) {
  return std::bit_cast<Lanes>(__builtin_convertvector(load<LaneHalves>(values), LaneBits) << 16);
}
inline Lanes all(float x) { return Lanes{x, x, x, x}; }
inline Lanes larger(Lanes a, Lanes b) { return a > b ? a : b; }
inline Lanes smaller(Lanes a, Lanes b) { return a < b ? a : b; }
inline float sum_of(Lanes x) { return (x[0] + x[1]) + (x[2] + x[3]); }
inline bool any_of(LaneMask m) { return (m[0] | m[1] | m[2] | m[3]) != 0; }
inline Lanes root(Lanes x) { return Lanes{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])}; }
inline Lanes clamped_cos(Lanes x) { return smaller(larger(x, all(-1.0f)), all(1.0f)); }
/// sin for a cosine in [-1, 1].
inline Lanes sin_of_cos(Lanes c) { return root(all(1.0f) - c * c); }
/// cos(a - b), 1 if a < b; angles in [0, pi] by cosine and sine.
inline Lanes cos_of_difference(Lanes cos_a, Lanes sin_a, Lanes cos_b, Lanes sin_b) {
  return cos_a > cos_b ? all(1.0f) : cos_a * cos_b + sin_a * sin_b;
}
inline Lanes sin_of_difference(Lanes cos_a, Lanes sin_a, Lanes cos_b, Lanes sin_b) {
  return cos_a > cos_b ? all(0.0f) : sin_a * cos_b - cos_a * sin_b;
}

}  // namespace lambent
