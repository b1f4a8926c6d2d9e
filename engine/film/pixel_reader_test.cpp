#include "engine/film/pixel_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "engine/film/film.h"

namespace lambent {
namespace {

/// Some number from 0 to 1, never the same for neighbours.
float value(int x, int y, int sample, int component) {
  return static_cast<float>((x * 7 + y * 13 + sample * 29 + component * 31) % 61) / 61.0f;
}

TEST(PixelReader, a_channel_read_alone_is_what_it_is_among_all) {
  FilmSettings settings;
  settings.width = settings.height = 8;
  settings.second_moments = true;
  settings.splat_unit = 1.0;
  settings.channels[0].catcher = ShadowCatcher{.lit = 1, .bare = 2, .cover = 3};
  settings.channels.push_back({.name = "lit", .components = 3, .hidden = true});
  settings.channels.push_back({.name = "bare", .components = 3, .hidden = true});
  settings.channels.push_back({.name = "cover", .components = 1, .hidden = true});
  settings.channels.push_back({.name = "direct", .components = 3, .divided_by = 6, .splats = true});
  settings.channels.push_back({.name = "rest", .components = 3, .minus = 4});
  settings.channels.push_back({.name = "color", .components = 3});
  settings.channels.push_back({.name = "normal", .components = 3});
  settings.channels.push_back({.name = "index", .components = 1, .rule = ChannelRule::first});
  settings.channels.push_back({.name = "time", .components = 1, .total = true});
  settings.channels.push_back({.name = "found", .components = 3, .rule = ChannelRule::share});
  settings.channels.push_back({.name = "ids", .components = 8, .rule = ChannelRule::ids});
  settings.channels.push_back({.name = "error", .components = 3, .rule = ChannelRule::error});
  settings.channels.push_back({.name = "count", .components = 1, .rule = ChannelRule::sample_count});
  settings.channels.push_back({.name = "caught", .components = 3, .rule = ChannelRule::caught});
  settings.channels.back().catcher = settings.channels[0].catcher;
  const auto film = *Film::create(settings);
  {
    TileWriter writer(*film, 0);
    std::vector<float> sample(static_cast<size_t>(film->sample_components()));
    for (int n = 0; n < 5; ++n)
      for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 7; ++x) {  // a column has none
          for (size_t c = 0; c < sample.size(); ++c) sample[c] = value(x, y, n, static_cast<int>(c));
          writer.add(x, y, sample);
        }
  }
  for (int x = 0; x < 8; ++x) film->splat(x, 3, Color(0.5f, 0.25f, 2.0f), 0);
  film->add_light_paths(64);
  const size_t outputs = film->channels().size();
  const std::vector<float> all = film->tile(0).pixels;
  size_t before = 0;
  for (size_t channel = 0; channel < outputs; ++channel) {
    std::vector<bool> wanted(outputs);
    wanted[channel] = true;
    const std::vector<float> alone = film->tile(0, wanted).pixels;
    const size_t components = static_cast<size_t>(film->channels()[channel].components);
    ASSERT_EQ(alone.size(), 64 * components);
    for (size_t p = 0; p < 64; ++p)
      for (size_t k = 0; k < components; ++k)
        ASSERT_EQ(std::bit_cast<uint32_t>(alone[p * components + k]),
                  std::bit_cast<uint32_t>(all[p * static_cast<size_t>(film->components()) + before + k]))
            << film->channels()[channel].name;
    before += components;
  }
  EXPECT_NE(*std::max_element(all.begin(), all.end()), 0.0f);
}

}  // namespace
}  // namespace lambent
