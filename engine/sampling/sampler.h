// Random numbers as pure functions of (seed, pixel, sample, dimension): nothing is stored but the key, so results do
// not depend on thread count, tile order, or being stopped and resumed.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "engine/base/hash.h"
#include "engine/base/vec.h"

namespace lambent {

/// The 32 bits of x in opposite order.
inline uint32_t reverse_bits(uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  return ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
}

/// Owen's nested uniform scrambling of a number whose bits come in opposite order (least significant first), by
/// hashing: each bit is flipped by a function of the bits below it. Laine & Karras 2011; constants of N. Vegdahl 2022
/// ("Building a Better LK Hash"). A bijection for every seed.
inline uint32_t owen_scramble_reversed(uint32_t x, uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

/// Second dimension of the Sobol sequence at `index`, bits in opposite order (digit 1 after the point in bit 0). Its
/// generator is Pascal's triangle modulo 2, whose row r holds c where (c & r) == r (Lucas); so the product with the
/// index is a superset sum over bits, in five butterfly steps (Ahmed 2024, "An Implementation Algorithm of 2D Sobol
/// Sequence").
inline uint32_t sobol_second_reversed(uint32_t index) {
  index ^= (index >> 1) & 0x55555555u;
  index ^= (index >> 2) & 0x33333333u;
  index ^= (index >> 4) & 0x0f0f0f0fu;
  index ^= (index >> 8) & 0x00ff00ffu;
  return index ^ (index >> 16);
}

/// Owen-scrambled Sobol points, padded in pairs (Burley 2020, "Practical Hash-based Owen Scrambling"): within a pixel
/// the samples of one dimension number form a scrambled (0,2)-sequence, shuffled differently for every number and
/// pixel. Every aligned power of two of sample indices up to 2^24 is stratified; indices to 2^32 - 1 are valid. 12
/// bytes.
class Sampler {
 public:
  /// Key of one sample. `seed` is the user's, (x, y) the pixel in the full frame (may be negative), `sample` counts up
  /// from 0 within the pixel.
  Sampler(uint32_t seed, int x, int y, uint32_t sample)
      : pixel_(hash_combine(hash_combine(hash_u32(seed + 0x51a7f00du), static_cast<uint32_t>(x)),
                            static_cast<uint32_t>(y))),
        reversed_index_(reverse_bits(sample)) {}

  /// Uniform pair in [0, 1)² for dimension number `dimension` (see dimension.h). Independent of get_1d of other
  /// numbers; get_1d of the same number returns the same first coordinate.
  Vec2 get_2d(uint32_t dimension) const {
    const uint32_t key = hash_combine(pixel_, dimension);
    const uint32_t index = shuffled(key);
    const uint32_t x = owen_scramble_reversed(index, hash_u32(key ^ 0xa511e9b3u));
    const uint32_t y = owen_scramble_reversed(sobol_second_reversed(index), hash_u32(key ^ 0x63d83595u));
    return {unit_float(reverse_bits(x)), unit_float(reverse_bits(y))};
  }

  /// Uniform number in [0, 1) for dimension number `dimension`.
  float get_1d(uint32_t dimension) const {
    const uint32_t key = hash_combine(pixel_, dimension);
    return unit_float(reverse_bits(owen_scramble_reversed(shuffled(key), hash_u32(key ^ 0xa511e9b3u))));
  }

  /// Eight coordinates at once, out[i] the first or, where second[i] is ~0, the second of get_2d(dimensions[i]): a
  /// loop of integer arithmetic without branches, which the compiler turns into vector instructions.
  void get_8(const uint32_t (&dimensions)[8], const uint32_t (&second)[8], float (&out)[8]) const {
    for (int i = 0; i < 8; ++i) {
      const uint32_t key = hash_combine(pixel_, dimensions[i]);
      const uint32_t index = shuffled(key);
      const uint32_t position = index ^ ((index ^ sobol_second_reversed(index)) & second[i]);
      const uint32_t salt = 0xa511e9b3u ^ ((0xa511e9b3u ^ 0x63d83595u) & second[i]);
      out[i] = unit_float(reverse_bits(owen_scramble_reversed(position, hash_u32(key ^ salt))));
    }
  }

 private:
  /// Position in the sequence: an Owen scramble of the index, which keeps aligned powers of two together.
  uint32_t shuffled(uint32_t key) const { return reverse_bits(owen_scramble_reversed(reversed_index_, key)); }

  uint32_t pixel_;
  uint32_t reversed_index_;
};

/// A number in [0, 1) that makes choices and serves again after each, stretched to what the choice left of it: points
/// that are stratified in two dimensions stay so among those that chose alike, which numbers of their own for the
/// choices would undo. 53 bits: those of u.x, then hashed ones, so that rare choices leave enough.
class ReusedNumber {
 public:
  explicit ReusedNumber(const Vec2& u)
      : u_(static_cast<double>(u.x) +
           static_cast<double>(hash_combine(std::bit_cast<uint32_t>(u.x), std::bit_cast<uint32_t>(u.y))) * 0x1p-56) {}

  double value() const { return u_; }
  float rest() const { return std::min(static_cast<float>(u_), k_one_minus_epsilon); }
  /// To be called once value() is known to lie in [begin, begin + width).
  void stretch(double begin, double width) { set((u_ - begin) / width); }
  void set(double u) { u_ = std::clamp(u, 0.0, 0x1.fffffffffffffp-1); }

 private:
  double u_;
};

/// Independent uniform numbers from a counter: for tests and set-up work, not for pixels.
class RandomStream {
 public:
  explicit RandomStream(uint64_t seed) : key_(hash_u64(seed + 0x9e3779b97f4a7c15ull)) {}

  uint64_t next_u64() { return hash_u64(key_ + 0x9e3779b97f4a7c15ull * ++counter_); }
  uint32_t next_u32() { return static_cast<uint32_t>(next_u64() >> 32); }
  /// In [0, 1), 24 bits.
  float next_1d() { return unit_float(next_u32()); }
  /// In [0, 1)².
  Vec2 next_2d() {
    const uint64_t bits = next_u64();
    return {unit_float(static_cast<uint32_t>(bits >> 32)), unit_float(static_cast<uint32_t>(bits))};
  }

 private:
  uint64_t key_;
  uint64_t counter_ = 0;
};

}  // namespace lambent
