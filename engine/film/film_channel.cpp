#include "engine/film/film_channel.h"

#include <fmt/format.h>

#include <algorithm>

namespace lambent {

FilmLayout::FilmLayout(const std::vector<FilmChannel>& channels) {
  places.resize(channels.size());
  if (!channels.empty()) places[0].exact = true;
  if (!channels.empty() && channels[0].catcher) {
    const ShadowCatcher& parts = *channels[0].catcher;
    for (const int part : {parts.lit, parts.bare, parts.brought, parts.cover, parts.behind})
      if (part >= 0) places[static_cast<size_t>(part)].exact = true;
  }
  // Means first, so that they are added in one go.
  const auto place_means = [&](bool exact, int& sums) {
    for (size_t c = 0; c < channels.size(); ++c) {
      if (!is_mean(channels[c].rule) || places[c].exact != exact) continue;
      places[c].sample = means;
      places[c].sum = sums;
      means += channels[c].components;
      sums += channels[c].components;
    }
  };
  place_means(true, doubles);
  exact_means = means;
  place_means(false, floats);
  sample_floats = means;
  int outputs = 0;
  for (size_t c = 0; c < channels.size(); ++c) {
    const FilmChannel& channel = channels[c];
    Place& place = places[c];
    const int number = static_cast<int>(c);
    switch (channel.rule) {
      case ChannelRule::mean:
      case ChannelRule::share:
      case ChannelRule::sample_count:
      case ChannelRule::caught:
        break;
      case ChannelRule::first:
        place.sample = sample_floats;
        place.sum = floats;
        sample_floats += channel.components;
        floats += channel.components;
        firsts.push_back(number);
        break;
      case ChannelRule::ids:
        place.id = id_channels++;
        id_slots = std::max(id_slots, channel.components);
        break;
      case ChannelRule::error:
        place.sum = doubles;
        place.exact = true;
        doubles += channel.components;
        squares.push_back(place.sum);
        break;
    }
    if (channel.splats) place.plane = planes++;
    if (!channel.hidden) {
      place.output = outputs;
      outputs += channel.rule == ChannelRule::ids ? channel.components / 4 : 1;
      output_floats += channel.components;
    }
    plain = plain && channel.rule == ChannelRule::mean && place.exact;
  }
  id_sample = sample_floats;
  if (id_channels > 0) sample_floats += k_ids_a_sample * id_floats();
  for (size_t c = 0; c < channels.size(); ++c)
    if (channels[c].divided_by >= 0)
      places[static_cast<size_t>(channels[c].divided_by)].dividends.push_back(static_cast<int>(c));
}

std::vector<Channel> output_channels(const std::vector<FilmChannel>& channels) {
  std::vector<Channel> result;
  for (const FilmChannel& channel : channels) {
    if (channel.hidden) continue;
    if (channel.rule != ChannelRule::ids) {
      result.push_back({channel.name, channel.components, channel.letters});
      continue;
    }
    for (int i = 0; i < channel.components / 4; ++i)
      result.push_back({fmt::format("{}{:02}", channel.name, i), 4, channel.letters});
  }
  return result;
}

}  // namespace lambent
