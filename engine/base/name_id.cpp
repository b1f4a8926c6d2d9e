#include "engine/base/name_id.h"

#include <bit>

namespace lambent {

uint32_t murmur3_32(std::string_view text) {
  constexpr uint32_t k_c1 = 0xcc9e2d51u, k_c2 = 0x1b873593u;
  const auto byte = [&](size_t i) { return static_cast<uint32_t>(static_cast<unsigned char>(text[i])); };
  uint32_t hash = 0;
  const size_t blocks = text.size() / 4;
  for (size_t b = 0; b < blocks; ++b) {
    uint32_t k = byte(4 * b) | byte(4 * b + 1) << 8 | byte(4 * b + 2) << 16 | byte(4 * b + 3) << 24;
    k = std::rotl(k * k_c1, 15) * k_c2;
    hash = std::rotl(hash ^ k, 13) * 5u + 0xe6546b64u;
  }
  uint32_t tail = 0;
  for (size_t i = text.size(); i > 4 * blocks; --i) tail = tail << 8 | byte(i - 1);
  hash ^= std::rotl(tail * k_c1, 15) * k_c2;
  hash ^= static_cast<uint32_t>(text.size());
  hash = (hash ^ (hash >> 16)) * 0x85ebca6bu;
  hash = (hash ^ (hash >> 13)) * 0xc2b2ae35u;
  return hash ^ (hash >> 16);
}

float name_id(std::string_view name) {
  uint32_t bits = murmur3_32(name);
  const uint32_t exponent = bits >> 23 & 255u;
  if (exponent == 0u || exponent == 255u) bits ^= 1u << 23;
  return std::bit_cast<float>(bits);
}

}  // namespace lambent
