#include "engine/film/tile_grid.h"

#include <algorithm>
#include <cstdint>

namespace lambent {

namespace {

/// Distance along the Hilbert curve that fills a side x side square (side a power of two); from the recursive
/// definition: each level picks a quadrant and turns the rest accordingly.
uint64_t hilbert_distance(uint32_t x, uint32_t y, uint32_t side) {
  uint64_t distance = 0;
  for (uint32_t s = side / 2; s > 0; s /= 2) {
    const uint32_t right = (x & s) != 0, top = (y & s) != 0;
    distance += uint64_t(s) * s * ((3 * right) ^ top);
    if (!top) {
      if (right) {
        x = side - 1 - x;
        y = side - 1 - y;
      }
      std::swap(x, y);
    }
  }
  return distance;
}

}  // namespace

TileGrid::TileGrid(const Rectangle& region, int tile_size_px, TileOrder order)
    : region_(region), tile_size_(std::max(tile_size_px, 1)) {
  if (region.empty()) return;
  columns_ = (region.width + tile_size_ - 1) / tile_size_;
  const int rows = (region.height + tile_size_ - 1) / tile_size_;
  struct Cell {
    uint64_t key;
    int x, y;
  };
  std::vector<Cell> cells;
  cells.reserve(size_t(columns_) * size_t(rows));
  uint32_t side = 1;
  while (side < static_cast<uint32_t>(std::max(columns_, rows))) side *= 2;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns_; ++x) {
      uint64_t key = uint64_t(rows - 1 - y) * uint64_t(columns_) + uint64_t(x);  // rows from the top
      if (order == TileOrder::hilbert) key = hilbert_distance(uint32_t(x), uint32_t(y), side);
      if (order == TileOrder::centre_out) {
        const int64_t dx = 2 * x + 1 - columns_, dy = 2 * y + 1 - rows;
        key = static_cast<uint64_t>(dx * dx + dy * dy);
      }
      cells.push_back({key, x, y});
    }
  std::stable_sort(cells.begin(), cells.end(), [](const Cell& a, const Cell& b) { return a.key < b.key; });
  tile_of_cell_.resize(cells.size());
  tiles_.reserve(cells.size());
  for (const Cell& cell : cells) {
    tile_of_cell_[size_t(cell.y) * size_t(columns_) + size_t(cell.x)] = count();
    const int x = cell.x * tile_size_, y = cell.y * tile_size_;
    tiles_.push_back(
        {region.x + x, region.y + y, std::min(tile_size_, region.width - x), std::min(tile_size_, region.height - y)});
  }
}

int TileGrid::tile_at(int x, int y) const {
  const int column = (x - region_.x) / tile_size_, row = (y - region_.y) / tile_size_;
  return tile_of_cell_[size_t(row) * size_t(columns_) + size_t(column)];
}

}  // namespace lambent
