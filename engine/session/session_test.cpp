// What a session gives of a render that ends or is stopped. The scenes are empty: a camera that sees nothing.
#include "engine/session/session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <thread>

#include "engine/description/description.h"

namespace lambent {
namespace {

using namespace std::chrono_literals;
using Corner = std::pair<int, int>;

class SessionTest : public testing::Test {
 protected:
  void configure(int64_t samples, const std::vector<std::string>& passes = {}) {
    auto settings = std::make_shared<description::Settings>();
    settings->width = 256;
    settings->height = 128;
    settings->samples = samples;
    settings->camera = "camera";
    for (const std::string& kind : passes) settings->passes.push_back({kind, kind, ""});
    auto camera = std::make_shared<description::Camera>();
    camera->name = "Camera";
    description::Transaction transaction;
    transaction.epoch = 1;
    transaction.edits.push_back(description::Upsert{"render", *settings});
    transaction.edits.push_back(description::Upsert{"camera", *camera});
    session_.apply(std::move(transaction));
  }
  /// The first tile that is there while it renders, or after.
  TileSnapshot first_tile(const std::vector<std::string>& channels = {}) {
    for (int i = 0; i < 20'000; ++i) {
      std::vector<TileSnapshot> tiles = session_.take_tiles(1, channels);
      if (!tiles.empty()) return tiles.front();
      std::this_thread::sleep_for(1ms);
    }
    ADD_FAILURE() << "no tile came";
    return {};
  }
  std::vector<TileSnapshot> rest(const std::vector<std::string>& channels = {}) {
    std::vector<TileSnapshot> all;
    do {
      for (TileSnapshot& tile : session_.take_tiles(100, channels)) all.push_back(std::move(tile));
    } while (session_.tiles_left());
    return all;
  }
  static std::set<Corner> corners(const std::vector<TileSnapshot>& tiles) {
    std::set<Corner> result;
    for (const TileSnapshot& tile : tiles) result.emplace(tile.rectangle.x, tile.rectangle.y);
    return result;
  }

  std::vector<std::string> events_;
  bool take_when_stopped_ = false;
  std::vector<TileSnapshot> after_stop_;  ///< what there was to take then, if wanted
  RenderOutcome outcome_;
  Session session_{Engine::create({.threads = 2}),
                   {.report = nullptr,
                    .tiles_ready = nullptr,
                    .stopped =
                        [this](int64_t) {
                          events_.push_back("stopped");
                          if (take_when_stopped_) after_stop_ = session_.take_tiles(100);
                        },
                    .done =
                        [this](const RenderOutcome& outcome) {
                          events_.push_back("done");
                          outcome_ = outcome;
                        }}};
};

TEST_F(SessionTest, final_tiles_are_all_there_are_also_those_taken_before) {
  configure(1);
  session_.start(1);
  const TileSnapshot first = first_tile();
  session_.wait();
  const std::vector<TileSnapshot> tiles = rest();
  EXPECT_EQ(events_, (std::vector<std::string>{"stopped", "done"}));
  EXPECT_EQ(corners(tiles).size(), tiles.size());
  int64_t pixels = 0;
  for (const TileSnapshot& tile : tiles) {
    EXPECT_TRUE(tile.final);
    pixels += int64_t(tile.rectangle.width) * tile.rectangle.height;
  }
  const bool was_final = first.final;  // a render so short may be over by then
  EXPECT_EQ(pixels, 256 * 128 - (was_final ? first.rectangle.width * first.rectangle.height : 0));
  EXPECT_TRUE(session_.take_tiles(100).empty());
}

TEST_F(SessionTest, tiles_that_were_taken_whole_and_not_changed_since_come_again_only_if_wanted) {
  for (const bool repeat : {false, true}) {
    configure(1);
    session_.start(repeat ? 2 : 1, repeat);
    const TileSnapshot first = first_tile();
    session_.wait();
    if (first.final) GTEST_SKIP() << "the render was over before a tile could be taken";
    const std::set<Corner> others = corners(rest());
    EXPECT_EQ(others.contains({first.rectangle.x, first.rectangle.y}), repeat);
    EXPECT_TRUE(rest().empty());
  }
}

TEST_F(SessionTest, a_tile_of_which_some_channels_were_taken_comes_again_with_all) {
  configure(1, {"combined", "depth", "normal"});
  session_.start(1, false);
  const TileSnapshot first = first_tile({"combined"});
  session_.wait();
  if (first.final) GTEST_SKIP() << "the render was over before a tile could be taken";
  EXPECT_EQ(first.channels.size(), 1u);
  const std::vector<TileSnapshot> tiles = rest({"combined"});
  EXPECT_TRUE(corners(tiles).contains({first.rectangle.x, first.rectangle.y}));
  for (const TileSnapshot& tile : tiles) EXPECT_EQ(tile.channels.size(), 3u);
}

TEST_F(SessionTest, a_cancelled_render_gives_what_every_pixel_had) {
  configure(0);
  take_when_stopped_ = true;
  session_.start(1);
  first_tile();
  session_.cancel();
  session_.wait();
  EXPECT_EQ(outcome_.status, RenderStatus::cancelled);
  EXPECT_TRUE(after_stop_.empty()) << "then only final tiles come";
  const Picture picture = session_.picture();
  std::vector<float> seen(picture.pixels.size());
  for (const TileSnapshot& tile : rest()) {
    EXPECT_TRUE(tile.final);
    const Rectangle& r = tile.rectangle;
    for (int y = 0; y < r.height; ++y)
      std::copy_n(&tile.pixels[size_t(y) * r.width * 4], size_t(r.width) * 4,
                  &seen[(size_t(r.y + y) * picture.width + r.x) * 4]);
  }
  EXPECT_EQ(seen, picture.pixels);
  EXPECT_GT(*std::max_element(seen.begin(), seen.end()), 0.0f) << "alpha at least";
}

TEST_F(SessionTest, a_render_that_supersedes_another_drops_its_tiles) {
  configure(0);
  session_.start(1);
  first_tile();
  session_.start(2);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(first_tile().epoch, 2);
  session_.cancel();
  session_.wait();
  for (const TileSnapshot& tile : rest()) EXPECT_EQ(tile.epoch, 2);
}

}  // namespace
}  // namespace lambent
