// Into how large tiles a picture is cut: a matter of time and of what is seen when, of no pixel's value.
#pragma once

#include <algorithm>
#include <cstdint>

#include "engine/film/rectangle.h"

namespace lambent {

/// Where a pass waits for the one before, threads wait for its last tile: with so many tiles for each, on average for
/// about a thirtieth of the pass.
inline constexpr int64_t k_tiles_of_thread = 16;
/// What beginning a tile costs is nothing beside the samples of so many pixels across, px.
inline constexpr int k_least_tile_size_px = 16;

/// Side of the tiles, px: what was asked for, or its half, a quarter ... as long as there would be fewer than
/// k_tiles_of_thread for each of `threads`, but not below k_least_tile_size_px.
inline int tile_size_px(const Rectangle& region, int asked_px, int64_t threads) {
  const auto tiles = [&](int64_t size) {
    return ((region.width + size - 1) / size) * ((region.height + size - 1) / size);
  };
  int size = std::max(asked_px, 1);
  while (size >= 2 * k_least_tile_size_px && tiles(size) < k_tiles_of_thread * threads) size /= 2;
  return size;
}

}  // namespace lambent
