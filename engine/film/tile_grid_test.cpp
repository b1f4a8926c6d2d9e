#include "engine/film/tile_grid.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <vector>

namespace lambent {
namespace {

TEST(TileGrid, covers_every_pixel_once_in_any_order) {
  const Rectangle region{3, 5, 100, 37};
  for (const TileOrder order : {TileOrder::hilbert, TileOrder::centre_out, TileOrder::rows})
    for (const int size : {1, 7, 32, 500}) {
      const TileGrid grid(region, size, order);
      std::vector<int> covered(100 * 37, 0);
      for (int i = 0; i < grid.count(); ++i)
        for (int y = grid[i].y; y < grid[i].y + grid[i].height; ++y)
          for (int x = grid[i].x; x < grid[i].x + grid[i].width; ++x) {
            ASSERT_TRUE(region.contains(x, y));
            ++covered[size_t((y - 5) * 100 + x - 3)];
            EXPECT_EQ(grid.tile_at(x, y), i);
          }
      for (const int count : covered) EXPECT_EQ(count, 1);
    }
}

TEST(TileGrid, hilbert_order_visits_neighbours_of_a_full_square) {
  const TileGrid grid({0, 0, 256, 256}, 32, TileOrder::hilbert);
  ASSERT_EQ(grid.count(), 64);
  for (int i = 1; i < grid.count(); ++i)
    EXPECT_EQ(std::abs(grid[i].x - grid[i - 1].x) + std::abs(grid[i].y - grid[i - 1].y), 32) << i;
}

TEST(TileGrid, centre_out_order_starts_in_the_middle_and_ends_in_a_corner) {
  const TileGrid grid({0, 0, 160, 160}, 32, TileOrder::centre_out);
  EXPECT_EQ(grid[0], (Rectangle{64, 64, 32, 32}));
  EXPECT_TRUE((grid[24].x == 0 || grid[24].x == 128) && (grid[24].y == 0 || grid[24].y == 128));
}

TEST(TileGrid, row_order_starts_at_the_top_left) {
  const TileGrid grid({0, 0, 64, 64}, 32, TileOrder::rows);
  EXPECT_EQ(grid[0], (Rectangle{0, 32, 32, 32}));
}

TEST(TileGrid, empty_region_has_no_tiles) { EXPECT_EQ(TileGrid({0, 0, 0, 5}, 32).count(), 0); }

}  // namespace
}  // namespace lambent
