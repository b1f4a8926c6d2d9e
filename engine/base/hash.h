// Integer hashes for counter-based random numbers: pure functions, no state.
#pragma once

#include <cstdint>

namespace lambent {

/// Bijective 32-bit mixer with low bias (Ellis, "lowbias32", hash-prospector).
inline uint32_t hash_u32(uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}

/// Mixes a value into a running hash.
inline uint32_t hash_combine(uint32_t seed, uint32_t value) {
  return hash_u32(seed ^ (value + 0x9e3779b9u + (seed << 6) + (seed >> 2)));
}

/// Bijective 64-bit mixer (Stafford's variant 13 of the MurmurHash3 finaliser, as in SplitMix64).
inline uint64_t hash_u64(uint64_t x) {
  x ^= x >> 30;
  x *= 0xbf58476d1ce4e5b9ull;
  x ^= x >> 27;
  x *= 0x94d049bb133111ebull;
  x ^= x >> 31;
  return x;
}

/// Uniform float in [0, 1) with 24 bits.
inline float unit_float(uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

}  // namespace lambent
