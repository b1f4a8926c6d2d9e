// The letters that Canvas writes: printable ASCII, 5 x 7 pixels.
#pragma once

#include <cstdint>

namespace lambent {

/// [letter - ' '][column], bit 0 of a column its upper pixel.
extern const uint8_t k_letters[95][5];

}  // namespace lambent
