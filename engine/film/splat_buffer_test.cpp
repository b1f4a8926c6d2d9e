#include "engine/film/splat_buffer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <thread>

#include "engine/film/film.h"
#include "engine/sampling/sampler.h"

namespace lambent {
namespace {

struct Splat {
  size_t pixel;
  Color value;
};

std::vector<Splat> random_splats(int count, uint64_t seed) {
  RandomStream random(seed);
  std::vector<Splat> splats;
  for (int i = 0; i < count; ++i)
    splats.push_back({random.next_u32() % 5,
                      Color(std::exp(40.0f * (random.next_1d() - 0.7f)), random.next_1d(), random.next_1d() - 0.5f)});
  return splats;
}

std::vector<double> sums(const SplatBuffer& buffer) {
  std::vector<double> result;
  for (size_t pixel = 0; pixel < 5; ++pixel)
    for (int c = 0; c < 3; ++c) result.push_back(buffer.sum(pixel, c));
  return result;
}

TEST(SplatBuffer, sums_are_the_same_bit_for_bit_in_any_order_and_from_any_number_of_threads) {
  std::vector<Splat> splats = random_splats(20000, 1);
  SplatBuffer reference(5, 1, 3.0);
  for (const Splat& splat : splats) ASSERT_TRUE(reference.add(splat.pixel, splat.value));
  std::reverse(splats.begin(), splats.end());
  for (const size_t threads : {size_t{1}, size_t{2}, size_t{7}}) {
    SplatBuffer buffer(5, 1, 3.0);
    std::vector<std::thread> running;
    for (size_t t = 0; t < threads; ++t)
      running.emplace_back([&, t] {
        for (size_t i = t; i < splats.size(); i += threads) buffer.add(splats[i].pixel, splats[i].value);
      });
    for (std::thread& thread : running) thread.join();
    EXPECT_EQ(sums(buffer), sums(reference)) << threads << " threads";
  }
}

TEST(SplatBuffer, is_off_by_at_most_half_its_finest_step_a_splat) {
  const std::vector<Splat> splats = random_splats(20000, 2);
  const double unit = 4.0;
  SplatBuffer buffer(5, 1, unit);
  std::vector<double> exact(15, 0.0);
  for (const Splat& splat : splats) {
    buffer.add(splat.pixel, splat.value);
    for (int c = 0; c < 3; ++c) exact[3 * splat.pixel + static_cast<size_t>(c)] += static_cast<double>(splat.value[c]);
  }
  const std::vector<double> found = sums(buffer);
  for (size_t i = 0; i < exact.size(); ++i)
    EXPECT_NEAR(found[i], exact[i], 20000 * unit * 0x1p-45 + 1e-13 * std::fabs(exact[i]));
}

TEST(SplatBuffer, keeps_small_values_beside_large_ones) {
  SplatBuffer buffer(1, 1, 1.0);
  ASSERT_TRUE(buffer.add(0, Color(0x1p30f)));
  for (int i = 0; i < 1024; ++i) ASSERT_TRUE(buffer.add(0, Color(0x1p-40f)));
  ASSERT_TRUE(buffer.add(0, Color(-0x1p30f)));
  EXPECT_EQ(buffer.sum(0, 1), 0x1p-30);
}

TEST(SplatBuffer, refuses_what_is_not_finite_or_out_of_range_and_stays_as_it_was) {
  SplatBuffer buffer(1, 1, 1.0);
  ASSERT_TRUE(buffer.add(0, Color(1.0f, 2.0f, 3.0f)));
  const float bad[] = {k_infinity, -k_infinity, std::numeric_limits<float>::quiet_NaN(), 0x1p48f, -1e38f};
  for (const float value : bad)
    for (int c = 0; c < 3; ++c) {
      Color color(1.0f);
      color[c] = value;
      EXPECT_FALSE(buffer.add(0, color)) << value;
    }
  EXPECT_TRUE(buffer.add(0, Color(0x1p47f)));
  EXPECT_EQ(buffer.sum(0, 0), 0x1p47 + 1.0);
}

TEST(SplatBuffer, a_unit_that_is_no_radiance_counts_as_one) {
  for (const double unit : {0.0, -1.0, std::numeric_limits<double>::infinity(), std::nan("")}) {
    SplatBuffer buffer(1, 1, unit);
    ASSERT_TRUE(buffer.add(0, Color(0.75f)));
    EXPECT_EQ(buffer.sum(0, 2), 0.75);
  }
}

std::shared_ptr<Film> film_for_splats() {
  FilmSettings settings;
  settings.width = 8;
  settings.height = 4;
  settings.region = {2, 1, 5, 3};
  settings.splat_unit = 2.0;
  return *Film::create(settings);
}

TEST(FilmSplats, are_divided_by_light_paths_and_added_to_the_samples_mean) {
  const std::shared_ptr<Film> film = film_for_splats();
  {
    TileWriter writer(*film, 0);
    for (int y = 1; y < 4; ++y)
      for (int x = 2; x < 7; ++x) writer.add(x, y, Vec4(1.0f, 2.0f, 3.0f, 1.0f));
  }
  film->splat(3, 2, Color(5.0f, 10.0f, 20.0f));
  film->splat(3, 2, Color(5.0f, 10.0f, 20.0f));
  film->add_light_paths(10);
  const std::vector<float> pixels = film->pixels();
  const size_t at = 4 * (1 * 5 + 1), beside = at + 4;
  EXPECT_FLOAT_EQ(pixels[at], 1.0f + 1.0f);
  EXPECT_FLOAT_EQ(pixels[at + 2], 3.0f + 4.0f);
  EXPECT_FLOAT_EQ(pixels[at + 3], 1.0f);
  EXPECT_FLOAT_EQ(pixels[beside], 1.0f);
}

TEST(FilmSplats, outside_of_the_region_do_nothing_and_bad_ones_are_counted) {
  const std::shared_ptr<Film> film = film_for_splats();
  film->add_light_paths(1);
  for (const auto& [x, y] : {std::pair{1, 2}, {7, 2}, {3, 0}, {3, 4}, {-5, -5}, {1 << 30, 1}})
    film->splat(x, y, Color(1.0f));
  for (const float value : film->pixels()) EXPECT_EQ(value, 0.0f);
  EXPECT_EQ(film->rejected_count(), 0u);
  film->splat(3, 2, Color(k_infinity));
  film->splat(3, 2, Color(-1.0f));
  EXPECT_EQ(film->rejected_count(), 2u);
  for (const float value : film->pixels()) EXPECT_EQ(value, 0.0f);
}

TEST(FilmSplats, survive_being_saved_and_loaded_bit_for_bit) {
  const std::shared_ptr<Film> film = film_for_splats(), loaded = film_for_splats();
  RandomStream random(3);
  for (int i = 0; i < 1000; ++i)
    film->splat(2 + static_cast<int>(random.next_1d() * 5.0f), 1 + static_cast<int>(random.next_1d() * 3.0f),
                Color(std::exp(30.0f * (random.next_1d() - 0.8f))));
  film->add_light_paths(77);
  const std::string path = (std::filesystem::temp_directory_path() / "lambent_splats.checkpoint").string();
  const Status saved = film->save(path, "scene");
  ASSERT_TRUE(static_cast<bool>(saved)) << saved.error();
  const Status read = loaded->load(path, "scene");
  ASSERT_TRUE(static_cast<bool>(read)) << read.error();
  EXPECT_EQ(loaded->pixels(), film->pixels());
  EXPECT_EQ(loaded->light_paths(), 77u);
  // What is added later must sum up alike, too.
  film->splat(4, 2, Color(0.1f));
  loaded->splat(4, 2, Color(0.1f));
  EXPECT_EQ(loaded->pixels(), film->pixels());
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace lambent
