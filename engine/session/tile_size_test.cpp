#include "engine/session/tile_size.h"

#include <gtest/gtest.h>

namespace lambent {
namespace {

struct Case {
  const char* text;
  Rectangle region;
  int asked_px, threads, expected_px;
};

TEST(TileSize, is_halved_until_each_thread_has_many_but_stays_worth_its_beginning) {
  const Case cases[] = {
      {"many for each thread", {0, 0, 1920, 1080}, 64, 2, 64},
      {"just enough", {0, 0, 1920, 1080}, 64, 31, 64},
      {"more than an int counts", {0, 0, 65536, 65536}, 64, 1024, 64},
      {"too few for so many threads", {0, 0, 1920, 1080}, 64, 64, 32},
      {"a small picture", {0, 0, 128, 96}, 64, 2, 16},
      {"a region", {500, 300, 256, 256}, 128, 2, 32},
      {"the least", {0, 0, 16, 16}, 64, 8, 16},
      {"a quarter would be too small", {0, 0, 100, 100}, 40, 8, 20},
      {"half would be too small", {0, 0, 100, 100}, 24, 8, 24},
      {"small ones were asked for", {0, 0, 128, 96}, 8, 64, 8},
      {"the smallest", {0, 0, 128, 96}, 1, 64, 1},
  };
  for (const Case& one : cases)
    EXPECT_EQ(tile_size_px(one.region, one.asked_px, one.threads), one.expected_px) << one.text;
}

TEST(TileSize, of_nothing_is_any) { EXPECT_GE(tile_size_px({}, 64, 2), 1); }

}  // namespace
}  // namespace lambent
