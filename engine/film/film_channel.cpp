#include "engine/film/film_channel.h"

#include <fmt/format.h>

namespace lambent {

FilmLayout::FilmLayout(const std::vector<FilmChannel>& channels) {
  places.resize(channels.size());
  // Means first, so that they are added in one go.
  for (size_t c = 0; c < channels.size(); ++c)
    if (channels[c].rule == ChannelRule::mean) {
      places[c].sample = places[c].sum = means;
      means += channels[c].components;
    }
  sample_floats = sums = means;
  int outputs = 0;
  for (size_t c = 0; c < channels.size(); ++c) {
    const FilmChannel& channel = channels[c];
    Place& place = places[c];
    const int number = static_cast<int>(c);
    switch (channel.rule) {
      case ChannelRule::mean:
      case ChannelRule::sample_count:
      case ChannelRule::caught:
        break;
      case ChannelRule::first:
        place.sample = sample_floats;
        place.sum = sums;
        sample_floats += channel.components;
        sums += channel.components;
        firsts.push_back(number);
        break;
      case ChannelRule::ids:
        place.sample = sample_floats;
        sample_floats += sample_floats_of(channel);
        place.id = id_slots;
        place.slots = channel.components;
        id_slots += place.slots;
        ids.push_back({place.sample, place.id, place.slots});
        break;
      case ChannelRule::error:
        place.sum = sums;
        sums += channel.components;
        errors.push_back(number);
        break;
    }
    if (channel.splats) place.plane = planes++;
    if (!channel.hidden) {
      place.output = outputs;
      outputs += channel.rule == ChannelRule::ids ? channel.components / 4 : 1;
      output_floats += channel.components;
    }
    plain = plain && channel.rule == ChannelRule::mean && channel.divided_by < 0 && channel.minus < 0 &&
            !channel.catcher && !channel.total && !channel.hidden;
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
