// Ids of names as Cryptomatte has them.
#pragma once

#include <cstdint>
#include <string_view>

namespace lambent {

/// MurmurHash3 (Appleby), 32 bits, seed 0, of the bytes.
uint32_t murmur3_32(std::string_view text);

/// The id of a name in Cryptomatte layers (Friedman & Jones 2015, "Cryptomatte specification", 1.2): the hash's bits as
/// a float, an exponent bit flipped where it would be zero, denormal, infinite or not a number.
float name_id(std::string_view name);

}  // namespace lambent
