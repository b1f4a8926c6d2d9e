#include "engine/film/film.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numeric>
#include <set>
#include <thread>

#include "engine/base/hash.h"
#include "engine/film/adaptive.h"

namespace lambent {
namespace {

using testing::HasSubstr;

std::shared_ptr<Film> make_film(const FilmSettings& settings) {
  auto film = Film::create(settings);
  EXPECT_TRUE(film) << film.error();
  return *film;
}

FilmSettings small_settings() {
  FilmSettings settings;
  settings.width = 50;
  settings.height = 30;
  settings.region = {5, 3, 40, 20};
  settings.tile_size_px = 16;
  settings.second_moments = true;
  return settings;
}

float noise(int x, int y, int64_t sample, uint32_t channel) {
  return unit_float(
      hash_combine(hash_combine(hash_combine(hash_u32(uint32_t(x)), uint32_t(y)), uint32_t(sample)), channel));
}

Vec4 sample_at(int x, int y, int64_t sample) {
  return {noise(x, y, sample, 0), 1e-3f * noise(x, y, sample, 1), 1e4f * noise(x, y, sample, 2), 1.0f};
}

/// Samples [first, end) of every active pixel, tile by tile in the order given, `pass` samples a visit, by `threads`.
void render(Film& film, int64_t first, int64_t end, int64_t pass, int threads, bool backwards) {
  for (int64_t s = first; s < end; s += pass) {
    std::atomic<int> next{0};
    const auto work = [&] {
      for (int i = next++; i < film.tiles().count(); i = next++) {
        TileWriter writer(film, backwards ? film.tiles().count() - 1 - i : i);
        const Rectangle r = writer.rectangle();
        for (int y = r.y; y < r.y + r.height; ++y)
          for (int x = r.x; x < r.x + r.width; ++x)
            if (film.active(x, y))
              for (int64_t n = s; n < std::min(s + pass, end); ++n) writer.add(x, y, sample_at(x, y, n));
      }
    };
    std::vector<std::thread> team;
    for (int i = 0; i < threads; ++i) team.emplace_back(work);
    for (std::thread& thread : team) thread.join();
  }
}

std::string temporary_path(const std::string& name) {
  return (std::filesystem::temp_directory_path() / (name + std::to_string(getpid()))).string();
}

TEST(Film, picture_is_bit_identical_for_any_threads_tiles_order_and_passes) {
  FilmSettings settings = small_settings();
  const auto reference = make_film(settings);
  render(*reference, 0, 100, 100, 1, false);
  for (const int tile_size : {1, 7, 16, 64})
    for (const TileOrder order : {TileOrder::hilbert, TileOrder::centre_out, TileOrder::rows}) {
      settings.tile_size_px = tile_size;
      settings.tile_order = order;
      const auto film = make_film(settings);
      render(*film, 0, 37, 5, 3, true);
      render(*film, 37, 100, 8, 2, false);
      EXPECT_EQ(film->pixels(), reference->pixels()) << tile_size;
    }
}

TEST(Film, mean_of_two_to_the_25_samples_loses_no_precision) {
  FilmSettings settings;
  settings.width = settings.height = 1;
  const auto film = make_film(settings);
  constexpr int64_t n = int64_t(1) << 25;
  {
    TileWriter writer(*film, 0);
    // In float the sum would stop growing at 2^24, and the small channel's at far less beside the first sample.
    for (int64_t i = 0; i < n; ++i) writer.add(0, 0, Vec4(1.0f, i == 0 ? 1e6f : 0.1f, float(i & 1), 1.0f));
  }
  EXPECT_EQ(film->sample_count(0, 0), n);
  const std::vector<float> pixel = film->pixels();
  EXPECT_EQ(pixel[0], 1.0f);
  EXPECT_FLOAT_EQ(pixel[1], static_cast<float>((1e6 + double(0.1f) * double(n - 1)) / double(n)));
  EXPECT_EQ(pixel[2], 0.5f);
  EXPECT_EQ(pixel[3], 1.0f);
}

TEST(Film, tiles_and_pixels_agree_and_rows_start_at_the_bottom) {
  const auto film = make_film(small_settings());
  render(*film, 0, 3, 1, 1, false);
  const std::vector<float> all = film->pixels();
  const Rectangle region = film->region();
  for (int i = 0; i < film->tiles().count(); ++i) {
    const FilmTile tile = film->tile(i);
    EXPECT_EQ(tile.samples, 3);
    const Rectangle& r = tile.rectangle;
    for (int y = 0; y < r.height; ++y)
      for (int x = 0; x < r.width; ++x) {
        const float value = tile.pixels[size_t(y * r.width + x) * 4];
        EXPECT_EQ(value, all[size_t((r.y + y - region.y) * region.width + r.x + x - region.x) * 4]);
        double expected = 0;
        for (int n = 0; n < 3; ++n) expected += sample_at(r.x + x, r.y + y, n).x;
        EXPECT_EQ(value, static_cast<float>(expected * (1.0 / 3)));
      }
  }
}

TEST(Film, takes_memory_for_its_region_only) {
  FilmSettings settings;
  settings.width = settings.height = 30000;
  settings.region = {29990, 29980, 10, 20};
  EXPECT_LT(make_film(settings)->bytes(), 100000u);
}

TEST(Film, settings_that_make_no_sense_are_errors) {
  const auto refused = [](FilmSettings settings) { return !Film::create(settings); };
  FilmSettings settings = small_settings();
  settings.region = {45, 3, 10, 5};
  EXPECT_TRUE(refused(settings));
  settings.region = {-1, 0, 10, 5};
  EXPECT_TRUE(refused(settings));
  settings.region = {2147483647, 0, 2147483647, 5};
  EXPECT_TRUE(refused(settings));
  settings = small_settings();
  settings.height = 0;
  EXPECT_TRUE(refused(settings));
  settings = small_settings();
  settings.channels = {};
  EXPECT_TRUE(refused(settings));
#ifndef __SANITIZE_ADDRESS__  // which aborts instead of throwing
  settings = {};
  settings.width = settings.height = 2000000;  // 128 TB
  EXPECT_TRUE(refused(settings));
#endif
}

TEST(Film, estimates_that_are_not_finite_or_negative_add_nothing_and_are_recorded_for_replay) {
  const auto film = make_film(small_settings());
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  {
    TileWriter writer(*film, film->tiles().tile_at(7, 5));
    writer.add(7, 5, Vec4(1, 1, 1, 1));
    writer.add(7, 5, Vec4(nan, 1, 1, 1));
    writer.add(7, 5, Vec4(1, -1, 1, 1));
    writer.add(7, 5, Vec4(1, 1, infinity, 1));
  }
  EXPECT_EQ(film->rejected_count(), 3u);
  ASSERT_EQ(film->rejected_samples().size(), 3u);
  const RejectedSample second = film->rejected_samples()[1];
  EXPECT_EQ(second.x, 7);
  EXPECT_EQ(second.y, 5);
  EXPECT_EQ(second.sample, 2);
  EXPECT_EQ(second.values[1], -1.0f);
  const FilmTile tile = film->tile(film->tiles().tile_at(7, 5));
  const float* pixel = &tile.pixels[size_t((5 - tile.rectangle.y) * tile.rectangle.width + 7 - tile.rectangle.x) * 4];
  EXPECT_EQ(pixel[0], 0.25f);
}

TEST(Film, the_recorded_rejects_are_the_first_by_sample_and_place_whatever_the_order) {
  const auto film = make_film(small_settings());
  for (int i = film->tiles().count() - 1; i >= 0; --i) {
    TileWriter writer(*film, i);
    const Rectangle r = writer.rectangle();
    for (int n = 0; n < 2; ++n)
      for (int y = r.y; y < r.y + r.height; ++y)
        for (int x = r.x; x < r.x + r.width; ++x) writer.add(x, y, Vec4(-1.0f));
  }
  const auto rejected = film->rejected_samples();
  ASSERT_EQ(rejected.size(), Film::k_recorded);
  for (size_t i = 0; i < rejected.size(); ++i) {
    EXPECT_EQ(rejected[i].sample, 0);
    EXPECT_EQ(rejected[i].y, 3);
    EXPECT_EQ(rejected[i].x, 5 + int(i));
  }
  EXPECT_EQ(film->rejected_count(), 2u * 40 * 20);
}

TEST(Film, further_channels_may_be_negative) {
  FilmSettings settings = small_settings();
  settings.channels.push_back({"Normal", 3});
  const auto film = make_film(settings);
  EXPECT_EQ(film->components(), 7);
  const float values[7] = {1, 1, 1, 1, -1, 0.5f, -0.25f};
  { TileWriter(*film, film->tiles().tile_at(5, 3)).add(5, 3, values); }
  EXPECT_EQ(film->rejected_count(), 0u);
  EXPECT_EQ(film->pixels()[6], -0.25f);
}

TEST(Film, channels_follow_their_rules) {
  FilmSettings settings = small_settings();
  settings.samples_asked = 4;
  settings.channels.push_back({.name = "first", .components = 1, .rule = ChannelRule::first});
  settings.channels.push_back({.name = "ratio", .components = 3, .divided_by = 5});
  settings.channels.push_back({.name = "count", .components = 1, .rule = ChannelRule::sample_count});
  settings.channels.push_back({.name = "error", .components = 3, .rule = ChannelRule::error});
  settings.channels.push_back({.name = {}, .components = 3, .hidden = true});
  const auto film = make_film(settings);
  EXPECT_EQ(film->sample_components(), 4 + 1 + 3 + 3);
  EXPECT_EQ(film->components(), 4 + 1 + 3 + 1 + 3);
  {
    TileWriter writer(*film, film->tiles().tile_at(5, 3));
    // The means in order, then the rest.
    writer.add(5, 3, std::vector<float>{1, 2, 0, 1, 3, 0, 1, 2, 0, 0, 7});
    writer.add(5, 3, std::vector<float>{3, 2, 0, 1, 1, 0, 1, 6, 1, 0, 9});
  }
  const FilmTile tile = film->tile(film->tiles().tile_at(5, 3));
  const size_t pixel = size_t((3 - tile.rectangle.y) * tile.rectangle.width + 5 - tile.rectangle.x);
  const float* p = tile.pixels.data() + pixel * size_t(film->components());
  const std::vector<float> found(p, p + film->components());
  // Samples 1 and 3: mean 2, standard error 1. The ratio is that of sums; the third's divisor is 0.
  EXPECT_EQ(found, (std::vector<float>{2, 2, 0, 1, 7, 0.5f, 0, 1024, 0.5f, 1, 0, 0}));
  const FilmTile part = film->tile(film->tiles().tile_at(5, 3), {false, true, false, true, false});
  EXPECT_EQ(part.pixels.size(), size_t(part.rectangle.width * part.rectangle.height * 2));
  EXPECT_EQ(part.pixels[2 * pixel], 7.0f);
  EXPECT_EQ(part.pixels[2 * pixel + 1], 0.5f);
}

TEST(Film, samples_written_in_place_are_those_that_are_handed_over) {
  FilmSettings settings = small_settings();
  settings.channels.push_back({.name = "odd", .components = 7});
  settings.channels.push_back({.name = "ids", .components = 4, .rule = ChannelRule::ids});
  const auto handed = make_film(settings), in_place = make_film(settings);
  const size_t floats = static_cast<size_t>(handed->sample_components());
  {
    TileWriter one(*handed, 0), other(*in_place, 0);
    const Rectangle r = one.rectangle();
    for (int n = 0; n < 3000; ++n) {  // more than are held back
      const int x = r.x + n % r.width, y = r.y + n % r.height;
      std::vector<float> sample(floats);
      for (size_t c = 0; c < floats; ++c) sample[c] = noise(x, y, n, static_cast<uint32_t>(c));
      one.add(x, y, sample);
      if (n % 5 == 0) std::ranges::fill(other.next(), 1.0f);  // given up
      const std::span<float> room = other.next();
      ASSERT_EQ(room.size(), floats);
      ASSERT_TRUE(std::ranges::all_of(room, [](float value) { return value == 0.0f; }));
      std::ranges::copy(sample, room.begin());
      other.add_next(x, y);
    }
  }
  EXPECT_EQ(handed->pixels(), in_place->pixels());
}

TEST(Film, what_is_not_finite_in_a_pass_costs_the_picture_nothing) {
  FilmSettings settings = small_settings();
  settings.channels.push_back({.name = "pass", .components = 2});
  const auto film = make_film(settings);
  const int tile_index = film->tiles().tile_at(5, 3);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  {
    TileWriter writer(*film, tile_index);
    writer.add(5, 3, std::vector<float>{1, 2, 3, 1, nan, 6});
    writer.add(5, 3, std::vector<float>{3, 2, 1, 1, 4, -2});
    writer.add(5, 3, std::vector<float>{nan, 2, 1, 1, 4, 2});  // this one's picture is bad
  }
  EXPECT_EQ(film->rejected_count(), 1u);
  const FilmTile tile = film->tile(tile_index);
  const size_t pixel = size_t((3 - tile.rectangle.y) * tile.rectangle.width + 5 - tile.rectangle.x);
  const float* p = tile.pixels.data() + pixel * 6;
  EXPECT_NEAR(p[0], 4.0f / 3.0f, 1e-6f);
  EXPECT_NEAR(p[4], 4.0f / 3.0f, 1e-6f);
  EXPECT_NEAR(p[5], 4.0f / 3.0f, 1e-6f);
}

/// Sums of passes are floats: as exact after many samples as those of the picture, but for noise of rounding.
TEST(Film, passes_of_a_hundred_thousand_samples_do_not_drift) {
  FilmSettings settings;
  settings.width = settings.height = 1;
  settings.channels.push_back({.name = "passes", .components = 13});  // several at a time, and a rest
  settings.channels.push_back({.name = "ids", .components = 4, .rule = ChannelRule::ids});
  const auto film = make_film(settings);
  const int ids = film->layout().id_sample;
  constexpr int64_t n = 100000;
  double sums[13] = {}, magnitudes[13] = {}, weights = 0.0;
  {
    TileWriter writer(*film, 0);
    std::vector<float> sample(static_cast<size_t>(film->sample_components()));
    for (int64_t i = 0; i < n; ++i) {
      for (int k = 0; k < 13; ++k) {
        const float u = noise(0, 0, i, static_cast<uint32_t>(k));
        const float values[4] = {0.1f, u, u - 0.5f, u < 0.01f ? 100.0f * u : 0.0f};  // even, like noise, signed, rare
        const float value = i == 0 && k == 4 ? 1e4f : values[k % 4];
        sample[static_cast<size_t>(4 + k)] = value;
        sums[k] += double(value);
        magnitudes[k] += std::fabs(double(value));
      }
      sample[static_cast<size_t>(ids)] = 0.3f;
      sample[static_cast<size_t>(ids) + 1] = 3.0f;
      weights += double(0.3f);
      writer.add(0, 0, sample);
    }
  }
  const std::vector<float> pixel = film->pixels();
  for (size_t k = 0; k < 13; ++k) EXPECT_NEAR(double(pixel[4 + k]) * n, sums[k], 2e-5 * magnitudes[k]) << k;
  // What is always the same is what rounding to the nearest gets wrong: by 1e-3 here.
  EXPECT_NEAR(double(pixel[4]) * n, sums[0], 1e-6 * sums[0]);
  EXPECT_NEAR(double(pixel[18]) * n, weights, 1e-6 * weights);
  float nearest = 0.0f;
  for (int64_t i = 0; i < n; ++i) nearest += 0.1f;
  EXPECT_GT(std::fabs(double(nearest) - sums[0]), 1e-5 * sums[0]);
}

TEST(Film, equal_passes_have_equal_sums_and_whole_numbers_are_exact) {
  FilmSettings settings;
  settings.width = settings.height = 1;
  settings.channels.push_back({.name = "first", .components = 9});
  settings.channels.push_back({.name = "second", .components = 9});
  const auto film = make_film(settings);
  {
    TileWriter writer(*film, 0);
    for (int64_t i = 0; i < 20000; ++i) {
      std::vector<float> sample(22, 1.0f);
      for (size_t k = 0; k < 8; ++k) sample[4 + k] = sample[13 + k] = noise(0, 0, i, static_cast<uint32_t>(k));
      writer.add(0, 0, sample);
    }
  }
  const std::vector<float> pixel = film->pixels();
  for (size_t k = 0; k < 9; ++k) EXPECT_EQ(pixel[4 + k], pixel[13 + k]);
  EXPECT_EQ(pixel[12], 1.0f);
}

TEST(Film, passes_beyond_the_range_of_floats_read_as_its_end) {
  FilmSettings settings;
  settings.width = settings.height = 1;
  settings.channels.push_back({.name = "pass", .components = 1});
  const auto film = make_film(settings);
  {
    TileWriter writer(*film, 0);
    for (int i = 0; i < 9; ++i) writer.add(0, 0, std::vector<float>{1, 1, 1, 1, 3e38f});
  }
  EXPECT_TRUE(std::isfinite(film->pixels()[4]));
  EXPECT_GT(film->pixels()[4], 3e37f);
}

TEST(Film, share_is_the_mean_cover_times_what_some_samples_found) {
  FilmSettings settings;
  settings.width = settings.height = 1;
  settings.channels.push_back({.name = "AO", .components = 3, .rule = ChannelRule::share});
  const auto film = make_film(settings);
  {
    TileWriter writer(*film, 0);
    // (weight * cover * found, weight * cover, cover): two samples look, for two each; the last misses.
    for (const auto& [found, looked, cover] :
         {std::array{1.0f, 2.0f, 1.0f}, {0.0f, 0.0f, 1.0f}, {0.5f, 1.0f, 0.5f}, {0.0f, 0.0f, 0.0f}})
      writer.add(0, 0, std::vector<float>{1, 1, 1, 1, found, looked, cover});
  }
  const std::vector<float> pixel = film->pixels();
  for (size_t k = 4; k < 7; ++k) EXPECT_FLOAT_EQ(pixel[k], 2.5f / 4.0f * (1.5f / 3.0f));
}

TEST(Film, ids_are_ranked_by_coverage) {
  FilmSettings settings = small_settings();
  settings.channels.push_back({.name = "Crypto", .components = 4, .rule = ChannelRule::ids});
  const auto film = make_film(settings);
  EXPECT_EQ(film->channels(), (std::vector<Channel>{{"combined", 4}, {"Crypto00", 4}}));
  std::vector<float> sample(4 + 2 * k_ids_a_sample, 0.0f);
  {
    TileWriter writer(*film, film->tiles().tile_at(5, 3));
    // (id, weight) pairs: id 1e-3 a quarter, -2 half, 5 an eighth of four samples.
    for (const auto& [id, weight] : {std::pair{1e-3f, 1.0f}, {-2.0f, 1.0f}, {5.0f, 0.5f}, {-2.0f, 1.0f}}) {
      sample[4] = weight;
      sample[5] = id;
      writer.add(5, 3, sample);
    }
  }
  const FilmTile tile = film->tile(film->tiles().tile_at(5, 3));
  const size_t pixel = size_t((3 - tile.rectangle.y) * tile.rectangle.width + 5 - tile.rectangle.x);
  const float* p = tile.pixels.data() + pixel * 8 + 4;
  EXPECT_EQ(std::vector<float>(p, p + 4), (std::vector<float>{-2.0f, 0.5f, 1e-3f, 0.25f}));
}

std::shared_ptr<Film> pixel_of_ids(int objects, int materials) {
  FilmSettings settings;
  settings.width = settings.height = 1;
  settings.channels.push_back({.name = "object", .components = objects, .rule = ChannelRule::ids});
  settings.channels.push_back({.name = "material", .components = materials, .rule = ChannelRule::ids});
  return make_film(settings);
}

TEST(Film, channels_of_ids_share_the_things_that_samples_met) {
  const auto film = pixel_of_ids(4, 8);
  ASSERT_EQ(film->layout().id_slots, 8);
  ASSERT_EQ(film->layout().id_floats(), 3);
  using Things = std::vector<float>;  // (weight, object, material)...
  {
    TileWriter writer(*film, 0);
    for (const Things& things :
         {Things{1, 5, 7}, Things{0.25f, 6, 7, 0.75f, 5, 8}, Things{1, 5, 8}, Things{0.5f, 9, 9}}) {
      Things sample(static_cast<size_t>(film->sample_components()));
      std::copy(things.begin(), things.end(), sample.begin() + film->layout().id_sample);
      writer.add(0, 0, sample);
    }
  }
  const std::vector<float> pixel = film->pixels();
  EXPECT_EQ(std::vector<float>(pixel.begin() + 4, pixel.end()),
            (std::vector<float>{5, 2.75f / 4, 9, 0.5f / 4, 8, 1.75f / 4, 7, 1.25f / 4, 9, 0.5f / 4, 0, 0}));
}

TEST(Film, a_pixel_that_meets_more_things_than_it_holds_keeps_their_weights) {
  const auto film = pixel_of_ids(4, 4);
  std::vector<float> sample(static_cast<size_t>(film->sample_components()));
  {
    TileWriter writer(*film, 0);
    for (int n = 0; n < 40; ++n) {  // ten things, each object of five materials
      const float thing[] = {1.0f, n % 2 + 1.0f, n % 10 + 20.0f};
      std::copy_n(thing, 3, sample.begin() + film->layout().id_sample);
      writer.add(0, 0, sample);
    }
  }
  const std::vector<float> pixel = film->pixels();
  EXPECT_FLOAT_EQ(pixel[5] + pixel[7], 1.0f) << "both objects, whatever their materials";
  EXPECT_GE(pixel[9], 0.7f) << "what found no place joined one that had";
}

TEST(Film, sums_do_not_depend_on_how_many_samples_come_at_once) {
  FilmSettings settings;
  settings.width = 2;
  settings.height = 1;
  settings.second_moments = true;
  settings.channels.push_back({.name = "passes", .components = 47});
  settings.channels.push_back({.name = "error", .components = 3, .rule = ChannelRule::error});
  settings.channels.push_back({.name = "ids", .components = 4, .rule = ChannelRule::ids});
  settings.channels.push_back({.name = "index", .components = 1, .rule = ChannelRule::first});
  const auto add = [&](Film& film, int x, int n, TileWriter& writer) {
    std::vector<float> sample(static_cast<size_t>(film.sample_components()));
    for (size_t c = 0; c < sample.size(); ++c) sample[c] = noise(x, 0, n, static_cast<uint32_t>(c));
    if (n == 7 && x == 1) sample[9] = std::numeric_limits<float>::infinity();  // in a pass
    if (n == 11) sample[0] = -1.0f;                                            // rejected
    writer.add(x, 0, sample);
  };
  const auto together = make_film(settings), apart = make_film(settings);
  {
    TileWriter writer(*together, 0);
    for (int x = 0; x < 2; ++x)
      for (int n = 0; n < 53; ++n) add(*together, x, n, writer);
  }
  for (int n = 0; n < 53; ++n)
    for (int x = 0; x < 2; ++x) {
      TileWriter writer(*apart, 0);
      add(*apart, x, n, writer);
    }
  EXPECT_EQ(together->pixels(), apart->pixels());
  EXPECT_EQ(together->rejected_count(), 2u);
  EXPECT_EQ(together->standard_error(1, 0), apart->standard_error(1, 0));
}

TEST(Film, dirty_tiles_are_taken_once_oldest_first) {
  const auto film = make_film(small_settings());
  EXPECT_TRUE(film->take_dirty(100).empty());
  for (const int tile : {4, 1, 3, 1}) TileWriter(*film, tile).flush();
  EXPECT_EQ(film->take_dirty(2), (std::vector<int>{4, 1}));
  EXPECT_EQ(film->take_dirty(100), (std::vector<int>{3}));
  EXPECT_TRUE(film->take_dirty(100).empty());
  film->mark_filled_dirty();
  EXPECT_TRUE(film->take_dirty(100).empty()) << "none holds anything";
  const Rectangle& r = film->tiles()[2];
  TileWriter(*film, 2).add(r.x + 1, r.y + 1, std::vector<float>(size_t(film->sample_components()), 1.0f));
  film->take_dirty(100), film->mark_filled_dirty();
  EXPECT_EQ(film->take_dirty(100), (std::vector<int>{2}));
}

TEST(Film, tiles_can_be_read_while_they_are_written) {
  FilmSettings settings;
  settings.width = settings.height = 64;
  const auto film = make_film(settings);
  std::atomic<bool> stop{false};
  std::thread reader([&] {
    while (!stop)
      for (const int index : film->take_dirty(100)) {
        const FilmTile tile = film->tile(index);
        for (size_t i = 0; i < tile.pixels.size(); i += 4) {
          // Sum and count always belong together.
          EXPECT_TRUE(tile.pixels[i] == 0.5f || tile.pixels[i] == 0.0f);
        }
      }
  });
  for (int pass = 0; pass < 200; ++pass) {
    TileWriter writer(*film, 0);
    for (int i = 0; i < 64 * 64; ++i) writer.add(i % 64, i / 64, Vec4(0.5f));
  }
  stop = true;
  reader.join();
  EXPECT_EQ(film->min_sample_count(), 200);
}

TEST(Checkpoint, continued_film_is_bit_identical_even_with_other_tiles) {
  FilmSettings settings = small_settings();
  const auto whole = make_film(settings), first = make_film(settings);
  render(*whole, 0, 40, 4, 1, false);
  render(*first, 0, 17, 17, 1, false);
  const std::string path = temporary_path("lambent_checkpoint");
  ASSERT_TRUE(first->save(path, "scene 1"));
  settings.tile_size_px = 8;
  const auto second = make_film(settings);
  const Status loaded = second->load(path, "scene 1");
  ASSERT_TRUE(loaded) << loaded.error();
  EXPECT_EQ(second->min_sample_count(), 17);
  EXPECT_EQ(second->take_dirty(1000).size(), size_t(second->tiles().count()));
  render(*second, 17, 40, 3, 2, true);
  EXPECT_EQ(second->pixels(), whole->pixels());
  EXPECT_EQ(second->standard_error(20, 10), whole->standard_error(20, 10));
  std::filesystem::remove(path);
}

TEST(Checkpoint, of_version_4_whose_sums_are_all_doubles_is_read) {
  FilmSettings settings;
  settings.width = settings.height = 1;
  settings.channels.push_back({.name = "index", .components = 1, .rule = ChannelRule::first});
  settings.channels.push_back({.name = "pass", .components = 3});
  settings.channels.push_back({.name = "error", .components = 3, .rule = ChannelRule::error});
  settings.channels.push_back({.name = "ids", .components = 4, .rule = ChannelRule::ids});
  const auto film = make_film(settings);
  // Two samples: (4, 6, 2, 2) and the pass's (1, 0.5, 3), the index 7, squares (10, 20, 3), ids 5 and -2 of 1.5 and
  // 0.5.
  const std::string header =
      "frame 1 1\nregion 0 0 1 1\nsecond_moments 0\nchannel 4 0 -1 1 combined\nchannel 1 1 -1 0 index\n"
      "channel 3 0 -1 0 pass\nchannel 3 4 -1 0 error\nchannel 4 2 -1 0 ids\nidentity x";
  constexpr uint8_t k_frame[] = {0x28, 0xb5, 0x2f, 0xfd, 0x04, 0x48, 0x2d, 0x02, 0x00, 0x74, 0x02, 0x00, 0x00, 0x00,
                                 0x00, 0x00, 0x00, 0x10, 0x40, 0x00, 0x18, 0x00, 0xf0, 0x3f, 0xe0, 0x08, 0x40, 0x1c,
                                 0x24, 0x34, 0x08, 0x40, 0x00, 0x00, 0xa0, 0x40, 0x00, 0x00, 0x00, 0xc0, 0x00, 0xf8,
                                 0x00, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x0d, 0x00, 0x60, 0x40, 0xd0, 0x19,
                                 0x0c, 0xb1, 0x84, 0x8c, 0x20, 0x1f, 0xc8, 0x0c, 0x64, 0x01, 0x06, 0x82, 0xcc, 0xc0,
                                 0xd0, 0x40, 0x97, 0x95, 0xbc, 0x2d, 0x38, 0x02, 0x4a, 0xd6, 0xfa, 0x9b};
  std::string content = "LMBTFILM";
  content.append({4, 0, 0, 0, static_cast<char>(header.size()), 0, 0, 0, 0, 0, 0, 0});
  content += header;
  content.append(reinterpret_cast<const char*>(k_frame), sizeof k_frame);
  const std::string path = temporary_path("lambent_checkpoint_4");
  std::ofstream(path, std::ios::binary) << content;
  const Status loaded = film->load(path, "x");
  ASSERT_TRUE(loaded) << loaded.error();
  const std::vector<float> pixel = film->pixels();
  EXPECT_EQ(std::vector<float>(pixel.begin(), pixel.begin() + 8),
            (std::vector<float>{2, 3, 1, 1, 7, 0.5f, 0.25f, 1.5f}));
  EXPECT_FLOAT_EQ(pixel[8], 1.0f);  // of 3 and 5
  EXPECT_EQ(std::vector<float>(pixel.begin() + 11, pixel.end()), (std::vector<float>{5, 0.75f, -2, 0.25f}));
  std::filesystem::remove(path);
}

/// Before version 6 each channel of ids had weights of its own.
TEST(Checkpoint, of_an_older_version_with_several_channels_of_ids_says_why_it_is_not_read) {
  FilmSettings settings = small_settings();
  for (const char* name : {"object", "material"})
    settings.channels.push_back({.name = name, .components = 4, .rule = ChannelRule::ids});
  const auto film = make_film(settings);
  const std::string path = temporary_path("lambent_checkpoint_5");
  ASSERT_TRUE(film->save(path, "x"));
  ASSERT_TRUE(film->load(path, "x"));
  std::fstream(path, std::ios::binary | std::ios::in | std::ios::out).seekp(8).put(5);
  const Status loaded = film->load(path, "x");
  ASSERT_FALSE(loaded);
  EXPECT_NE(loaded.error().find("Cryptomatte"), std::string::npos) << loaded.error();
  std::filesystem::remove(path);
}

TEST(Checkpoint, of_another_scene_or_layout_or_damaged_is_refused_and_changes_nothing) {
  const auto film = make_film(small_settings());
  render(*film, 0, 5, 5, 1, false);
  const std::vector<float> before = film->pixels();
  const std::string path = temporary_path("lambent_checkpoint");
  ASSERT_TRUE(film->save(path, "scene 1"));

  const auto refusal = [&](Film& loading, const std::string& file, const std::string& identity) {
    const Status status = loading.load(file, identity);
    EXPECT_FALSE(status);
    return status ? std::string() : status.error();
  };
  EXPECT_THAT(refusal(*film, path, "scene 2"), HasSubstr("another scene"));
  EXPECT_THAT(refusal(*film, path + ".missing", "scene 1"), HasSubstr("No such file"));
  FilmSettings other = small_settings();
  other.region.width = 39;
  EXPECT_THAT(refusal(*make_film(other), path, "scene 1"), HasSubstr("another scene"));

  std::string content;
  {
    std::ifstream file(path, std::ios::binary);
    content.assign(std::istreambuf_iterator<char>(file), {});
  }
  const auto write = [&](const std::string& bytes) {
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
    return path;
  };
  for (size_t length = 0; length < content.size(); length += 1 + content.size() / 50)
    EXPECT_FALSE(refusal(*film, write(content.substr(0, length)), "scene 1").empty()) << length;
  for (size_t at = 0; at < content.size(); at += 1 + content.size() / 50) {
    std::string damaged = content;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    EXPECT_THAT(refusal(*film, write(damaged), "scene 1"), HasSubstr(path)) << at;
  }
  EXPECT_EQ(film->pixels(), before);
  EXPECT_TRUE(film->load(write(content), "scene 1"));
  std::filesystem::remove(path);
}

TEST(Checkpoint, that_cannot_be_written_is_an_error_that_names_the_file_and_leaves_no_rest) {
  const auto film = make_film(small_settings());
  const Status status = film->save("/nonexistent_folder/checkpoint", "scene");
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error(), HasSubstr("/nonexistent_folder/checkpoint"));
  // A folder stands where the file should go: the temporary file is removed again.
  const std::string folder = temporary_path("lambent_checkpoint_folder");
  std::filesystem::create_directories(folder + "/checkpoint/occupied");
  EXPECT_FALSE(film->save(folder + "/checkpoint", "scene"));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
  std::filesystem::remove_all(folder);
}

TEST(Adaptive, standard_error_is_that_of_the_mean) {
  const auto film = make_film(small_settings());
  double sum = 0, squares = 0;
  {
    TileWriter writer(*film, film->tiles().tile_at(5, 3));
    for (int n = 0; n < 50; ++n) {
      const Vec4 value = sample_at(5, 3, n);
      writer.add(5, 3, value);
      const double s = double(value.x) + value.y + value.z;
      sum += s;
      squares += s * s;
    }
  }
  const double variance = (squares - sum * sum / 50) / 49;
  EXPECT_FLOAT_EQ(film->standard_error(5, 3), static_cast<float>(std::sqrt(variance / 50)));
}

TEST(Adaptive, standard_error_has_the_part_of_splats) {
  FilmSettings settings;
  settings.width = 2;
  settings.height = 1;
  settings.second_moments = true;
  settings.splat_unit = 3.0;
  const auto film = make_film(settings);
  // 1000 light paths, each fifth of which brings pixel 1 something between 0 and 3.
  double sum = 0.0, squares = 0.0;
  for (int n = 0; n < 200; ++n) {
    const float value = noise(0, 0, n, 0);
    film->splat(1, 0, Color(value, 2.0f * value, 0.0f));
    sum += 3.0 * double(value);
    squares += 9.0 * double(value) * double(value);
  }
  film->add_light_paths(1000);
  {
    TileWriter writer(*film, 0);
    for (int x = 0; x < 2; ++x)
      for (int64_t n = 0; n < 50; ++n) writer.add(x, 0, Vec4(0.25f));
  }
  const double variance = (squares - sum * sum / 1000) / 999;
  EXPECT_EQ(film->standard_error(0, 0), 0.0f);
  EXPECT_FLOAT_EQ(film->standard_error(1, 0), static_cast<float>(std::sqrt(variance / 1000)));
}

TEST(Adaptive, nothing_stops_while_splats_are_what_is_noisy) {
  FilmSettings settings;
  settings.width = settings.height = 32;
  settings.second_moments = true;
  settings.splat_unit = 1.0;
  const auto film = make_film(settings);
  for (int i = 0; i < film->tiles().count(); ++i) {
    TileWriter writer(*film, i);
    const Rectangle r = writer.rectangle();
    for (int y = r.y; y < r.y + r.height; ++y)
      for (int x = r.x; x < r.x + r.width; ++x)
        for (int64_t n = 0; n < 64; ++n) writer.add(x, y, Vec4(0.25f));
  }
  // A caustic in a corner of the picture that few paths have reached; later, many.
  film->splat(30, 30, Color(3000.0f));
  film->add_light_paths(32 * 32 * 64);
  EXPECT_EQ(film->stop_converged(0.01f, 64), size_t(32 * 32));
  for (int n = 0; n < 10000; ++n) film->splat(30, 30, Color(30.0f));
  film->add_light_paths(100u << 20);
  EXPECT_EQ(film->stop_converged(0.01f, 64), size_t(0));
}

/// A film whose left half is quiet and whose right half is noisy.
std::shared_ptr<Film> half_noisy(int tile_size) {
  FilmSettings settings;
  settings.width = 64;
  settings.height = 32;
  settings.tile_size_px = tile_size;
  settings.second_moments = true;
  return make_film(settings);
}

void render_half_noisy(Film& film, int64_t first, int64_t end) {
  for (int i = 0; i < film.tiles().count(); ++i) {
    TileWriter writer(film, i);
    const Rectangle r = writer.rectangle();
    for (int y = r.y; y < r.y + r.height; ++y)
      for (int x = r.x; x < r.x + r.width; ++x)
        for (int64_t n = first; n < end && film.active(x, y); ++n)
          writer.add(x, y, Vec4((x < 32 ? 0.01f : 4.0f) * noise(x, y, n, 0) + 0.2f));
  }
}

TEST(Adaptive, quiet_pixels_stop_for_good_and_noisy_ones_go_on_until_they_are_quiet) {
  const auto film = half_noisy(16);
  render_half_noisy(*film, 0, 64);
  const size_t active = film->stop_converged(0.02f, 64);
  EXPECT_EQ(active, size_t(32 + k_adaptive_radius) * 32);  // the noisy half, and those that have it in their window
  EXPECT_FALSE(film->active(10, 10));
  EXPECT_TRUE(film->active(31, 10));
  EXPECT_TRUE(film->active(40, 10));
  EXPECT_FALSE(film->tile_active(film->tiles().tile_at(0, 0)));
  EXPECT_TRUE(film->tile_active(film->tiles().tile_at(63, 0)));
  int64_t samples = 64;
  while (film->stop_converged(0.02f, samples) > 0 && samples < 100000) {
    render_half_noisy(*film, samples, 2 * samples);
    samples *= 2;
  }
  EXPECT_EQ(film->sample_count(10, 10), 64);
  EXPECT_GT(film->sample_count(60, 10), 4096);
  EXPECT_LT(samples, 100000);
}

TEST(Adaptive, decisions_do_not_depend_on_tiles) {
  const auto a = half_noisy(16), b = half_noisy(5);
  for (const auto& film : {a, b}) {
    render_half_noisy(*film, 0, 64);
    film->stop_converged(0.05f, 64);
    render_half_noisy(*film, 64, 512);
    film->stop_converged(0.05f, 512);
    render_half_noisy(*film, 512, 600);
  }
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x) EXPECT_EQ(a->sample_count(x, y), b->sample_count(x, y));
  EXPECT_EQ(a->pixels(), b->pixels());
}

TEST(Adaptive, render_interrupted_within_a_pass_continues_bit_identically) {
  // About the noise of a pixel with 64 samples: half of them are about to stop.
  const float threshold = 0.168f;
  const auto whole = half_noisy(16), interrupted = half_noisy(16);
  for (const auto& film : {whole, interrupted}) {
    render_half_noisy(*film, 0, 64);
    film->stop_converged(threshold, 64);
  }
  for (int n = 64; n < 80; ++n) {  // part of one tile gets its next pass, then the render ends
    TileWriter writer(*interrupted, interrupted->tiles().tile_at(40, 8));
    for (int x = 35; x < 45; ++x)
      if (interrupted->active(x, 8)) writer.add(x, 8, Vec4(4.0f * noise(x, 8, n, 0) + 0.2f));
  }
  size_t undecided = 0;
  for (int x = 33; x < 47; ++x) undecided += interrupted->active(x, 8);
  EXPECT_GT(undecided, 3u);
  interrupted->stop_converged(threshold, interrupted->min_sample_count());  // what a continuing session does
  for (const auto& film : {whole, interrupted}) {
    for (int i = 0; i < film->tiles().count(); ++i) {
      TileWriter writer(*film, i);
      const Rectangle r = writer.rectangle();
      for (int y = r.y; y < r.y + r.height; ++y)
        for (int x = r.x; x < r.x + r.width; ++x)
          for (int64_t n = film->sample_count(x, y); n < 80 && film->active(x, y); ++n)
            writer.add(x, y, Vec4((x < 32 ? 0.01f : 4.0f) * noise(x, y, n, 0) + 0.2f));
    }
    film->stop_converged(threshold, 80);
  }
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x) EXPECT_EQ(whole->active(x, y), interrupted->active(x, y));
  EXPECT_EQ(whole->pixels(), interrupted->pixels());
}

TEST(Adaptive, stopped_pixels_stay_stopped_after_a_checkpoint) {
  const auto film = half_noisy(16), continued = half_noisy(16);
  render_half_noisy(*film, 0, 64);
  film->stop_converged(0.02f, 64);
  const std::string path = temporary_path("lambent_adaptive");
  ASSERT_TRUE(film->save(path, "x") && continued->load(path, "x"));
  EXPECT_FALSE(continued->active(10, 10));
  EXPECT_TRUE(continued->active(40, 10));
  EXPECT_EQ(continued->min_sample_count(), 64);
  std::filesystem::remove(path);
}

TEST(Adaptive, first_check_comes_later_for_stricter_thresholds) {
  EXPECT_EQ(first_adaptive_check(0.01f), 64);
  EXPECT_GT(first_adaptive_check(0.001f), 64);
  EXPECT_FALSE(is_adaptive_check(0.0f, 64));
  EXPECT_FALSE(is_adaptive_check(0.01f, 48));
  EXPECT_TRUE(is_adaptive_check(0.01f, 80));
}

}  // namespace
}  // namespace lambent
