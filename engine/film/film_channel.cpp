#include "engine/film/film_channel.h"

#include <fmt/format.h>

namespace lambent {

FilmLayout::FilmLayout(const std::vector<FilmChannel>& channels) {
  int outputs = 0;
  for (const FilmChannel& channel : channels) {
    Place& place = places.emplace_back();
    place.sample = sample_floats;
    place.sum = sums;
    if (channel.rule == ChannelRule::mean) {
      const bool follows = !means.empty() && means.back().sample + means.back().floats == place.sample &&
                           means.back().sum + means.back().floats == place.sum;
      if (!follows) means.push_back({place.sample, place.sum, 0});
      means.back().floats += channel.components;
    } else if (channel.rule != ChannelRule::sample_count && channel.rule != ChannelRule::caught) {
      others.push_back(static_cast<int>(places.size()) - 1);
    }
    switch (channel.rule) {
      case ChannelRule::mean:
      case ChannelRule::first:
        sample_floats += channel.components;
        sums += channel.components;
        break;
      case ChannelRule::ids:
        sample_floats += 2 * k_ids_a_sample;
        place.id = id_slots;
        place.slots = channel.components;
        id_slots += place.slots;
        break;
      case ChannelRule::error:
        sums += channel.components;
        break;
      case ChannelRule::sample_count:
      case ChannelRule::caught:
        break;
    }
    if (channel.splats) place.plane = planes++;
    if (!channel.hidden) {
      place.output = outputs;
      outputs += channel.rule == ChannelRule::ids ? channel.components / 4 : 1;
      output_floats += channel.components;
    }
    plain = plain && channel.rule == ChannelRule::mean && channel.divided_by < 0 && channel.minus < 0 &&
            !channel.catcher && !channel.hidden;
  }
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
