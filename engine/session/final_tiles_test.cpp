#include "engine/session/final_tiles.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <numeric>
#include <set>
#include <thread>

namespace lambent {
namespace {

using namespace std::chrono_literals;

/// 64 tiles of a MiB each, whose pixels hold the tile's number.
std::shared_ptr<Film> large_film() {
  FilmSettings settings;
  settings.width = settings.height = 512;
  settings.channels.push_back({.name = "wide", .components = 60});
  const auto film = *Film::create(settings);
  for (int tile = 0; tile < film->tiles().count(); ++tile) {
    TileWriter writer(*film, tile);
    const Rectangle& r = film->tiles()[tile];
    const std::vector<float> sample(64, static_cast<float>(tile));
    for (int y = r.y; y < r.y + r.height; ++y)
      for (int x = r.x; x < r.x + r.width; ++x) writer.add(x, y, sample);
  }
  return film;
}

std::vector<int> all_tiles(const Film& film) {
  std::vector<int> tiles(static_cast<size_t>(film.tiles().count()));
  std::iota(tiles.begin(), tiles.end(), 0);
  return tiles;
}

TEST(FinalTiles, every_tile_is_taken_once_with_its_pixels_whoever_reads_it) {
  WorkerPool pool(3);
  const auto film = large_film();
  std::atomic<int> ready{0};
  FinalTiles tiles(pool, film, all_tiles(*film), [&] { ++ready; });
  std::set<std::pair<int, int>> corners;
  while (tiles.left()) {
    const auto tile = tiles.take();
    if (!tile) continue;  // the last ones are being read
    EXPECT_TRUE(corners.emplace(tile->rectangle.x, tile->rectangle.y).second);
    EXPECT_EQ(tile->samples, 1);
    const float number = static_cast<float>(film->tiles().tile_at(tile->rectangle.x, tile->rectangle.y));
    ASSERT_EQ(tile->pixels.size(), size_t(64) * 64 * 64);
    EXPECT_EQ(tile->pixels.front(), number);
    EXPECT_EQ(tile->pixels.back(), number);
  }
  EXPECT_EQ(corners.size(), 64u);
  EXPECT_FALSE(tiles.take());
  EXPECT_LT(ready, 64) << "the first one at least is read by who takes it";
}

TEST(FinalTiles, workers_read_only_once_a_tile_was_taken_and_only_some_mib_ahead) {
  WorkerPool pool(2);
  const auto film = large_film();
  std::atomic<int> ready{0};
  FinalTiles tiles(pool, film, all_tiles(*film), [&] { ++ready; });
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(ready, 0);
  EXPECT_TRUE(tiles.take());
  for (int i = 0; i < 5000 && ready < 32; ++i) std::this_thread::sleep_for(1ms);
  std::this_thread::sleep_for(20ms);
  EXPECT_GE(ready, 32);
  EXPECT_LE(ready, 33) << "two workers at most were reading when there was enough";
  EXPECT_TRUE(tiles.take());
  EXPECT_TRUE(tiles.take());
  EXPECT_TRUE(tiles.take());
  for (int i = 0; i < 5000 && ready < 34; ++i) std::this_thread::sleep_for(1ms);
  EXPECT_GE(ready, 34) << "taking makes room";
  EXPECT_TRUE(tiles.left()) << "and it may end before all are taken";
}

}  // namespace
}  // namespace lambent
