// How a region is cut into tiles, and in which order they are rendered.
#pragma once

#include <vector>

#include "engine/film/rectangle.h"

namespace lambent {

enum class TileOrder { hilbert, centre_out, rows };

/// Tiles that partition a region: tile_size squares from its lower left, cut at the upper and right edges. Immutable.
class TileGrid {
 public:
  TileGrid() = default;
  /// An empty region gives no tiles; tile_size below 1 counts as 1.
  TileGrid(const Rectangle& region, int tile_size_px, TileOrder order = TileOrder::hilbert);

  const Rectangle& region() const { return region_; }
  int count() const { return static_cast<int>(tiles_.size()); }
  /// In the order of rendering.
  const Rectangle& operator[](int tile) const { return tiles_[static_cast<size_t>(tile)]; }
  /// The tile that a pixel of the region belongs to.
  int tile_at(int x, int y) const;

 private:
  Rectangle region_;
  int tile_size_ = 1, columns_ = 0;
  std::vector<Rectangle> tiles_;
  std::vector<int> tile_of_cell_;  ///< row by row from the lower left
};

}  // namespace lambent
