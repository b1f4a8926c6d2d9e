#include "engine/session/tile_size.h"

#include <gtest/gtest.h>

namespace lambent {
namespace {

TEST(TileSize, is_what_was_asked_for_where_each_thread_has_many) {
  EXPECT_EQ(tile_size_px({0, 0, 1920, 1080}, 64, 2), 64);
  EXPECT_EQ(tile_size_px({0, 0, 1920, 1080}, 64, 31), 64);
  EXPECT_EQ(tile_size_px({0, 0, 65536, 65536}, 64, 1024), 64);
}

TEST(TileSize, is_halved_until_each_thread_has_many) {
  EXPECT_EQ(tile_size_px({0, 0, 1920, 1080}, 64, 64), 32);
  EXPECT_EQ(tile_size_px({0, 0, 128, 96}, 64, 2), 16);
  EXPECT_EQ(tile_size_px({500, 300, 256, 256}, 128, 2), 32);  // a region
}

TEST(TileSize, stays_worth_its_beginning) {
  EXPECT_EQ(tile_size_px({0, 0, 16, 16}, 64, 8), 16);
  EXPECT_EQ(tile_size_px({0, 0, 100, 100}, 40, 8), 20);
  EXPECT_EQ(tile_size_px({0, 0, 100, 100}, 24, 8), 24);
}

TEST(TileSize, smaller_ones_that_are_asked_for_stay) {
  EXPECT_EQ(tile_size_px({0, 0, 128, 96}, 8, 64), 8);
  EXPECT_EQ(tile_size_px({0, 0, 128, 96}, 1, 64), 1);
}

TEST(TileSize, of_nothing_is_any) { EXPECT_GE(tile_size_px({}, 64, 2), 1); }

}  // namespace
}  // namespace lambent
