#include "engine/film/pixel_reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/film/adaptive.h"

namespace lambent {

namespace {

/// A sum that went beyond the range of floats reads as its end.
double finite(float sum) {
  constexpr float k_end = std::numeric_limits<float>::max();
  return std::fabs(sum) <= k_end ? sum : k_end;
}

}  // namespace

PixelReader::PixelReader(const std::vector<FilmChannel>& channels, const FilmLayout& layout, const FilmSums& sums,
                         int64_t samples_asked, const std::vector<bool>& wanted)
    : channels_(channels),
      layout_(layout),
      sums_(sums),
      samples_asked_(samples_asked),
      light_paths_(sums.splats ? sums.splats->paths() : 0),
      needed_(channels.size()),
      from_(channels.size()),
      means_(static_cast<size_t>(layout.doubles + layout.floats)) {
  for (size_t c = 0; c < channels.size(); ++c) {
    const FilmLayout::Place& place = layout.places[c];
    from_[c] = static_cast<size_t>(place.exact ? place.sum : layout.doubles + place.sum);
  }
  for (size_t c = 0; c < channels.size(); ++c)
    if (!channels[c].hidden) add_step(c, wanted);
  for (size_t c = 0; c < channels.size(); ++c) {
    if (!needed_[c]) continue;
    const FilmLayout::Place& place = layout.places[c];
    if (light_paths_ > 0 && place.plane >= 0) splatted_.push_back(c);
    std::vector<Range>& ranges = place.exact ? of_doubles_ : of_floats_;
    const size_t from = static_cast<size_t>(place.sum), count = static_cast<size_t>(channels[c].components);
    if (!ranges.empty() && ranges.back().from + ranges.back().count == from)
      ranges.back().count += count;
    else
      ranges.push_back({from, count});
  }
}

void PixelReader::need(int channel) {
  if (channel < 0 || needed_[static_cast<size_t>(channel)]) return;
  needed_[static_cast<size_t>(channel)] = true;
  for (const int dividend : layout_.places[static_cast<size_t>(channel)].dividends) need(dividend);
}

void PixelReader::add_step(size_t c, const std::vector<bool>& wanted) {
  const FilmChannel& channel = channels_[c];
  const FilmLayout::Place& place = layout_.places[c];
  const auto is_wanted = [&](int output) { return wanted.empty() || wanted[static_cast<size_t>(output)]; };
  if (channel.rule == ChannelRule::ids) {
    for (int level = 0; level < channel.components / 4; ++level) {
      if (!is_wanted(place.output + level)) continue;
      Step* const last = steps_.empty() ? nullptr : &steps_.back();
      if (last && last->channel == static_cast<int>(c) && last->first_level + last->levels == level)
        ++last->levels;
      else
        steps_.push_back({static_cast<int>(c), 0, 0, level, 1});
    }
    return;
  }
  if (!is_wanted(place.output)) return;
  if (is_mean(channel.rule)) need(static_cast<int>(c));
  need(channel.divided_by);
  need(channel.minus);
  if (channel.catcher) {
    const ShadowCatcher& of = *channel.catcher;
    for (const int part : {of.lit, of.bare, of.brought, of.cover, of.behind}) need(part);
    need(0);
  }
  const bool plain = channel.rule == ChannelRule::mean && c > 0 && place.dividends.empty() && channel.divided_by < 0 &&
                     channel.minus < 0 && !channel.catcher && !channel.total;
  const size_t count = static_cast<size_t>(channel.components);
  if (!plain)
    steps_.push_back({static_cast<int>(c)});
  else if (!steps_.empty() && steps_.back().channel < 0 && steps_.back().from + steps_.back().count == from_[c])
    steps_.back().count += count;
  else
    steps_.push_back({-1, from_[c], count});
}

void PixelReader::work_out_means(size_t pixel) {
  const uint32_t count = sums_.counts[pixel];
  const double per_sample = count ? 1.0 / count : 0.0;
  double* means = means_.data();
  const double* doubles = sums_.doubles + pixel * static_cast<size_t>(layout_.doubles);
  for (const Range& range : of_doubles_)
    for (size_t i = range.from, end = i + range.count; i < end; ++i) means[i] = doubles[i] * per_sample;
  means += layout_.doubles;
  const float* floats = sums_.floats + pixel * static_cast<size_t>(layout_.floats);
  for (const Range& range : of_floats_)
    for (size_t i = range.from, end = i + range.count; i < end; ++i) means[i] = finite(floats[i]) * per_sample;
  for (const size_t c : splatted_)
    for (int k = 0; k < std::min(channels_[c].components, 3); ++k)
      means_[from_[c] + static_cast<size_t>(k)] +=
          sums_.splats->sum(pixel, k, layout_.places[c].plane) / static_cast<double>(light_paths_);
}

double PixelReader::divisor(size_t channel, int component) const {
  const double value = mean(channel, component);
  if (value != 0.0 || layout_.places[channel].plane >= 0) return value;
  for (const int dividend : layout_.places[channel].dividends)
    if (mean(static_cast<size_t>(dividend), component) != 0.0) return k_least_divisor;
  return 0.0;
}

/// Where catchers get no light at all there is no shadow either.
double PixelReader::shadow(const ShadowCatcher& catcher, int component) const {
  const double bare = mean(static_cast<size_t>(catcher.bare), component);
  if (bare == 0.0) return 1.0;
  double lit = mean(static_cast<size_t>(catcher.lit), component);
  if (catcher.brought >= 0) lit -= mean(static_cast<size_t>(catcher.brought), component);
  return lit / bare;
}

/// Adds to the picture what stands in the place of the catchers.
void PixelReader::add_caught(const ShadowCatcher& catcher, float* picture) const {
  for (int k = 0; k < 3 && catcher.brought >= 0; ++k)
    picture[k] += static_cast<float>(mean(static_cast<size_t>(catcher.brought), k));
  const double cover = mean(static_cast<size_t>(catcher.cover), 0);
  if (!(cover > 0.0)) return;
  double shadows[3] = {1.0, 1.0, 1.0};
  for (int k = 0; k < 3 && catcher.in_picture; ++k) shadows[k] = shadow(catcher, k);
  if (catcher.behind >= 0) {
    for (int k = 0; k < 3; ++k)
      picture[k] += static_cast<float>(mean(static_cast<size_t>(catcher.behind), k) * shadows[k]);
  } else {
    const double darkness = 1.0 - (shadows[0] + shadows[1] + shadows[2]) / 3.0;
    picture[3] += static_cast<float>(cover * std::clamp(darkness, 0.0, 1.0));
  }
}

float* PixelReader::read(size_t pixel, float* to) {
  work_out_means(pixel);
  for (const Step& step : steps_) {
    if (step.channel >= 0) {
      to = read_channel(pixel, step, to);
      continue;
    }
    const double* const means = means_.data() + step.from;
    for (size_t i = 0; i < step.count; ++i) to[i] = static_cast<float>(means[i]);
    to += step.count;
  }
  return to;
}

float* PixelReader::read_channel(size_t pixel, const Step& step, float* to) {
  const size_t c = static_cast<size_t>(step.channel);
  const FilmChannel& channel = channels_[c];
  const FilmLayout::Place& place = layout_.places[c];
  const uint32_t count = sums_.counts[pixel];
  const double* const doubles = sums_.doubles + pixel * static_cast<size_t>(layout_.doubles);
  switch (channel.rule) {
    case ChannelRule::mean:
      for (int k = 0; k < channel.components; ++k) {
        double value = place.dividends.empty() ? mean(c, k) : divisor(c, k);
        if (channel.divided_by >= 0) {
          const size_t divided_by = static_cast<size_t>(channel.divided_by);
          const double by = divisor(divided_by, std::min(k, channels_[divided_by].components - 1));
          value = by != 0.0 ? value / by : 0.0;
        }
        if (channel.minus >= 0) value -= mean(static_cast<size_t>(channel.minus), k);
        if (channel.total) value *= count;
        to[k] = static_cast<float>(value);
      }
      if (c == 0 && channel.components == 4) to[3] = std::max(to[3], 0.0f);
      if (channel.catcher) add_caught(*channel.catcher, to);
      break;
    case ChannelRule::share: {
      const double looked = mean(c, 1), found = looked > 0.0 ? mean(c, 0) / looked : 0.0;
      for (int k = 0; k < channel.components; ++k) to[k] = static_cast<float>(found * mean(c, 2));
      break;
    }
    case ChannelRule::caught:
      for (int k = 0; k < channel.components; ++k) {
        double share = channel.catcher ? mean(static_cast<size_t>(channel.catcher->cover), 0) : 0.0;
        // Of what a backdrop shows through the picture's alpha, over which the picture is laid afterwards.
        if (share > 0.0 && channel.catcher->behind < 0)
          share = std::min(1.0, share / std::max(1.0 - mean(0, 3), share));
        to[k] = static_cast<float>(share > 0.0 ? 1.0 + share * (shadow(*channel.catcher, k) - 1.0) : 1.0);
      }
      break;
    case ChannelRule::first:
      std::copy_n(sums_.floats + pixel * static_cast<size_t>(layout_.floats) + place.sum, channel.components, to);
      break;
    case ChannelRule::ids: {
      float levels[64];
      read_ids(pixel, place, levels, channel.components);
      return std::copy_n(levels + 4 * step.first_level, 4 * step.levels, to);
    }
    case ChannelRule::sample_count:
      to[0] = static_cast<float>(count) / static_cast<float>(std::max<int64_t>(samples_asked_, 1));
      break;
    case ChannelRule::error:
      for (int k = 0; k < channel.components; ++k)
        to[k] =
            count < 2 ? 0.0f : static_cast<float>(standard_error_of_mean(doubles[k], doubles[place.sum + k], count));
      break;
  }
  return to + channel.components;
}

void PixelReader::read_ids(size_t pixel, const FilmLayout::Place& place, float* out, int components) const {
  const size_t floats = static_cast<size_t>(layout_.id_floats()), slots = static_cast<size_t>(layout_.id_slots);
  const float* thing = sums_.things + pixel * slots * floats;
  std::array<std::pair<double, float>, 64> ranked;  // components are at most 64, slots as many
  size_t used = 0;
  for (size_t i = 0; i < slots && thing[0] > 0.0f; ++i, thing += floats) {
    const float id = thing[1 + place.id];
    size_t rank = 0;  // several things may share an id
    while (rank < used && std::bit_cast<uint32_t>(ranked[rank].second) != std::bit_cast<uint32_t>(id)) ++rank;
    if (rank == used) ranked[used++] = {0.0, id};
    ranked[rank].first += double(thing[0]);
  }
  std::sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(used), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first
                              : std::bit_cast<uint32_t>(a.second) < std::bit_cast<uint32_t>(b.second);
  });
  for (size_t level = 0; level < static_cast<size_t>(components) / 2; ++level) {
    out[2 * level] = level < used ? ranked[level].second : 0.0f;
    out[2 * level + 1] = level < used ? static_cast<float>(ranked[level].first / sums_.counts[pixel]) : 0.0f;
  }
}

}  // namespace lambent
