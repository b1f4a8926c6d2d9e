#include "engine/base/name_id.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <string>

namespace lambent {
namespace {

TEST(NameId, hash_is_that_of_published_vectors) {
  // Appleby's SMHasher and the Wikipedia article on MurmurHash list these for seed 0.
  EXPECT_EQ(murmur3_32(""), 0u);
  EXPECT_EQ(murmur3_32("test"), 0xba6bd213u);
  EXPECT_EQ(murmur3_32("Hello, world!"), 0xc0363e43u);
  EXPECT_EQ(murmur3_32("The quick brown fox jumps over the lazy dog"), 0x2e4ff723u);
}

TEST(NameId, is_an_ordinary_number_whatever_the_hash) {
  for (int i = 0; i < 100000; ++i) {
    const std::string name = "object " + std::to_string(i);
    const float id = name_id(name);
    ASSERT_TRUE(std::isnormal(id)) << name;
    const uint32_t difference = std::bit_cast<uint32_t>(id) ^ murmur3_32(name);
    ASSERT_TRUE(difference == 0 || difference == 1u << 23);
  }
}

}  // namespace
}  // namespace lambent
