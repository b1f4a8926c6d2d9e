#include "engine/film/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <stdexcept>
#include <tuple>

#include "engine/base/check.h"
#include "engine/film/adaptive.h"
#include "engine/film/film_storage.h"
#include "engine/film/rounded_sum.h"

namespace lambent {

namespace {
/// Floats of samples that a TileWriter holds back before it takes the tile's lock: few enough for the fastest cache.
constexpr size_t k_buffered_floats = 4096;

/// The picture's four floats, and what few others there are.
void add_exactly(const float* values, size_t count, double* sums) {
  using Floats4 = float __attribute__((vector_size(16)));
  using Doubles4 = double __attribute__((vector_size(32)));
  Floats4 value;
  Doubles4 sum;
  std::memcpy(&value, values, sizeof value);
  std::memcpy(&sum, sums, sizeof sum);
  sum += __builtin_convertvector(value, Doubles4);
  std::memcpy(sums, &sum, sizeof sum);
  for (size_t i = 4; i < count; ++i) [[unlikely]] sums[i] += values[i];
}

/// Of the picture's four floats, none of them NaN.
bool none_negative(const float* values) {
  return values[0] >= 0.0f && values[1] >= 0.0f && values[2] >= 0.0f && values[3] >= 0.0f;
}

/// Of R, G and B.
void add_squares(const float* values, double* sums) {
  for (int k = 0; k < 3; ++k) {
    const double value = values[k];
    sums[k] += value * value;
  }
}

/// A sum that went beyond the range of floats reads as its end.
double finite(float sum) { return std::isfinite(sum) ? double(sum) : double(std::numeric_limits<float>::max()); }

}  // namespace

Film::Film() = default;
Film::~Film() = default;

Result<std::shared_ptr<Film>> Film::create(const FilmSettings& settings) try {
  std::shared_ptr<Film> film(new Film);
  film->settings_ = settings;
  Rectangle& region = film->settings_.region;
  if (settings.width <= 0 || settings.height <= 0)
    return Error{fmt::format("The picture has no pixels ({} x {}).", settings.width, settings.height)};
  if (region == Rectangle{}) region = {0, 0, settings.width, settings.height};
  // In 64 bits: the sums of a hostile region could overflow.
  if (region.empty() || region.x < 0 || region.y < 0 || int64_t(region.x) + region.width > settings.width ||
      int64_t(region.y) + region.height > settings.height)
    return Error{fmt::format("The render region ({}, {}) + {} x {} does not lie inside the picture of {} x {} pixels.",
                             region.x, region.y, region.width, region.height, settings.width, settings.height)};
  for (const FilmChannel& channel : settings.channels) {
    const bool levels = channel.rule == ChannelRule::ids;
    if (channel.components < 1 || channel.components > 64 || (levels && channel.components % 4 != 0))
      return Error{fmt::format("Channel '{}' has {} components.", channel.name, channel.components)};
    CHECK(std::max(channel.divided_by, channel.minus) < static_cast<int>(settings.channels.size()));
  }
  if (settings.channels.empty() || settings.channels[0].components != 4)
    return Error{"The first channel must be the picture's RGBA."};
  film->layout_ = FilmLayout(settings.channels);
  film->output_channels_ = output_channels(settings.channels);

  film->storage_ = std::make_unique<Storage>();
  Storage& storage = *film->storage_;
  const size_t pixels = size_t(region.width) * size_t(region.height);
  storage.doubles.resize(pixels * size_t(film->layout_.doubles));
  storage.floats.resize(pixels * size_t(film->layout_.floats));
  storage.things.resize(pixels * size_t(film->layout_.id_slots) * size_t(film->layout_.id_floats()));
  storage.counts.resize(pixels);
  if (settings.second_moments) {
    storage.second_moments.resize(pixels);
    storage.stopped.resize(pixels);
  }
  if (film->takes_splats())
    storage.splats =
        std::make_unique<SplatBuffer>(pixels, film->layout_.planes, settings.splat_unit, settings.second_moments);
  film->grid_ = TileGrid(region, settings.tile_size_px, settings.tile_order);  // after what a huge picture fails on
  storage.tiles = std::vector<Storage::Tile>(static_cast<size_t>(film->grid_.count()));
  return film;
} catch (const std::bad_alloc&) {
  return Error{fmt::format("Not enough memory for a picture of {} x {} pixels.", settings.width, settings.height)};
} catch (const std::length_error&) {
  return Error{fmt::format("Not enough memory for a picture of {} x {} pixels.", settings.width, settings.height)};
}

size_t Film::bytes() const {
  const Storage& s = *storage_;
  return s.doubles.size() * sizeof(double) + s.floats.size() * sizeof(float) + s.counts.size() * sizeof(uint32_t) +
         s.things.size() * sizeof(float) + s.second_moments.size() * sizeof(double) + s.stopped.size() +
         s.tiles.size() * sizeof(Storage::Tile) + (s.splats ? s.splats->bytes() : 0);
}

void Film::splat(int x, int y, const Color& value, int plane) {
  if (!settings_.region.contains(x, y)) return;
  const bool good = settings_.allow_negative || min_component(value) >= 0.0f;
  if (good && storage_->splats->add(pixel_index(x, y), value, plane)) return;
  const float values[3] = {value.x, value.y, value.z};
  reject(pixel_index(x, y), k_splat, values);
}

void Film::add_light_paths(uint64_t paths) { storage_->splats->add_paths(paths); }

uint64_t Film::light_paths() const { return storage_->splats ? storage_->splats->paths() : 0; }

int64_t Film::sample_count(int x, int y) const { return storage_->counts[pixel_index(x, y)]; }

int64_t Film::min_sample_count() const {
  Storage& s = *storage_;
  uint32_t least = UINT32_MAX, least_active = UINT32_MAX;
  for (int tile = 0; tile < grid_.count(); ++tile) {
    const Rectangle& r = grid_[tile];
    const std::lock_guard lock(s.tiles[static_cast<size_t>(tile)].mutex);
    for (int y = r.y; y < r.y + r.height; ++y)
      for (size_t i = pixel_index(r.x, y), end = i + size_t(r.width); i < end; ++i) {
        least = std::min(least, s.counts[i]);
        if (s.stopped.empty() || !s.stopped[i]) least_active = std::min(least_active, s.counts[i]);
      }
  }
  return least_active != UINT32_MAX ? least_active : least;
}

void Film::read(const Rectangle& rectangle, const std::vector<bool>& wanted, float* rows, size_t row_stride) const {
  for (int y = 0; y < rectangle.height; ++y) {
    const size_t first = pixel_index(rectangle.x, rectangle.y + y);
    float* out = rows + size_t(y) * row_stride;
    for (size_t i = first; i < first + size_t(rectangle.width); ++i) out = read_channels(i, wanted, out);
  }
}

namespace {

/// Adds to the picture what stands in the place of the catchers.
template <typename Mean, typename Shadow>
void add_caught(const ShadowCatcher& catcher, const Mean& mean, const Shadow& shadow, float* picture) {
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

}  // namespace

/// Writes the pixel's floats from `to` on; returns where they end.
float* Film::read_channels(size_t pixel, const std::vector<bool>& wanted, float* to) const {
  const Storage& s = *storage_;
  const double* doubles = s.doubles.data() + pixel * static_cast<size_t>(layout_.doubles);
  const float* floats = s.floats.data() + pixel * static_cast<size_t>(layout_.floats);
  const uint64_t paths = s.splats ? s.splats->paths() : 0;
  const uint32_t count = s.counts[pixel];
  const double per_sample = count ? 1.0 / count : 0.0;
  const auto mean = [&](size_t channel, int component) {
    const FilmLayout::Place& place = layout_.places[channel];
    double value = (place.exact ? doubles[place.sum + component] : finite(floats[place.sum + component])) * per_sample;
    if (paths > 0 && place.plane >= 0 && component < 3)
      value += s.splats->sum(pixel, component, place.plane) / static_cast<double>(paths);
    return value;
  };
  const auto divisor = [&](size_t channel, int component) {
    const double value = mean(channel, component);
    if (value != 0.0 || layout_.places[channel].plane >= 0) return value;
    for (const int dividend : layout_.places[channel].dividends)
      if (mean(static_cast<size_t>(dividend), component) != 0.0) return k_least_divisor;
    return 0.0;
  };
  // Where catchers get no light at all there is no shadow either.
  const auto shadow = [&](const ShadowCatcher& catcher, int component) {
    const double bare = mean(static_cast<size_t>(catcher.bare), component);
    if (bare == 0.0) return 1.0;
    double lit = mean(static_cast<size_t>(catcher.lit), component);
    if (catcher.brought >= 0) lit -= mean(static_cast<size_t>(catcher.brought), component);
    return lit / bare;
  };
  for (size_t c = 0; c < settings_.channels.size(); ++c) {
    const FilmChannel& channel = settings_.channels[c];
    const FilmLayout::Place& place = layout_.places[c];
    const auto is_wanted = [&](int output) { return wanted.empty() || wanted[static_cast<size_t>(output)]; };
    if (channel.hidden || (channel.rule != ChannelRule::ids && !is_wanted(place.output))) continue;
    switch (channel.rule) {
      case ChannelRule::mean:
        for (int k = 0; k < channel.components; ++k) {
          double value = place.dividends.empty() ? mean(c, k) : divisor(c, k);
          if (channel.divided_by >= 0) {
            const size_t divided_by = static_cast<size_t>(channel.divided_by);
            const double by = divisor(divided_by, std::min(k, settings_.channels[divided_by].components - 1));
            value = by != 0.0 ? value / by : 0.0;
          }
          if (channel.minus >= 0) value -= mean(static_cast<size_t>(channel.minus), k);
          if (channel.total) value *= count;
          to[k] = static_cast<float>(value);
        }
        if (c == 0 && channel.components == 4) to[3] = std::max(to[3], 0.0f);
        if (channel.catcher) add_caught(*channel.catcher, mean, shadow, to);
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
        for (int k = 0; k < channel.components; ++k) to[k] = floats[place.sum + k];
        break;
      case ChannelRule::ids: {
        float levels[64];
        read_ids(pixel, place, levels, channel.components);
        for (int i = 0; i < channel.components / 4; ++i)
          if (is_wanted(place.output + i)) to = std::copy_n(levels + 4 * i, 4, to);
        continue;
      }
      case ChannelRule::sample_count:
        to[0] = static_cast<float>(count) / static_cast<float>(std::max<int64_t>(settings_.samples_asked, 1));
        break;
      case ChannelRule::error:
        for (int k = 0; k < channel.components; ++k)
          to[k] =
              count < 2 ? 0.0f : static_cast<float>(standard_error_of_mean(doubles[k], doubles[place.sum + k], count));
        break;
    }
    to += channel.components;
  }
  return to;
}

void Film::read_ids(size_t pixel, const FilmLayout::Place& place, float* out, int components) const {
  const Storage& s = *storage_;
  const size_t floats = static_cast<size_t>(layout_.id_floats()), slots = static_cast<size_t>(layout_.id_slots);
  const float* thing = s.things.data() + pixel * slots * floats;
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
    out[2 * level + 1] = level < used ? static_cast<float>(ranked[level].first / s.counts[pixel]) : 0.0f;
  }
}

FilmTile Film::tile(int index, const std::vector<bool>& wanted) const {
  FilmTile result;
  result.rectangle = grid_[index];
  const Rectangle& r = result.rectangle;
  size_t components = 0;
  for (size_t c = 0; c < output_channels_.size(); ++c)
    if (wanted.empty() || wanted[c]) components += static_cast<size_t>(output_channels_[c].components);
  const size_t stride = size_t(r.width) * components;
  result.pixels.resize(stride * size_t(r.height));
  uint32_t least = UINT32_MAX, least_active = UINT32_MAX;
  Storage& s = *storage_;
  const std::lock_guard lock(s.tiles[static_cast<size_t>(index)].mutex);
  read(r, wanted, result.pixels.data(), stride);
  for (int y = r.y; y < r.y + r.height; ++y)
    for (size_t i = pixel_index(r.x, y), end = i + size_t(r.width); i < end; ++i) {
      least = std::min(least, s.counts[i]);
      if (s.stopped.empty() || !s.stopped[i]) least_active = std::min(least_active, s.counts[i]);
    }
  result.samples = least_active != UINT32_MAX ? least_active : least;
  return result;
}

std::vector<float> Film::pixels() const {
  const Rectangle& all = settings_.region;
  const size_t components = static_cast<size_t>(this->components()), stride = size_t(all.width) * components;
  std::vector<float> result(stride * size_t(all.height));
  for (int index = 0; index < grid_.count(); ++index) {
    const Rectangle& r = grid_[index];
    const std::lock_guard lock(storage_->tiles[static_cast<size_t>(index)].mutex);
    read(r, {}, result.data() + size_t(r.y - all.y) * stride + size_t(r.x - all.x) * components, stride);
  }
  return result;
}

std::vector<int> Film::take_dirty(size_t limit) {
  std::vector<std::pair<uint64_t, int>> dirty;
  for (int i = 0; i < grid_.count(); ++i)
    if (const uint64_t since = storage_->tiles[static_cast<size_t>(i)].dirty.load(std::memory_order_acquire))
      dirty.emplace_back(since, i);
  std::sort(dirty.begin(), dirty.end());
  if (dirty.size() > limit) dirty.resize(limit);
  std::vector<int> result;
  for (const auto& [since, i] : dirty) {
    // Cleared before the pixels are read: what is added after that makes the tile dirty again.
    storage_->tiles[static_cast<size_t>(i)].dirty.store(0, std::memory_order_seq_cst);
    result.push_back(i);
  }
  return result;
}

void Film::mark_filled_dirty() {
  const bool has_splats = light_paths() > 0;  // which may lie anywhere
  for (int i = 0; i < grid_.count(); ++i) {
    const Rectangle& r = grid_[i];
    const auto has_samples = [&] {
      for (int y = r.y; y < r.y + r.height; ++y)
        for (size_t p = pixel_index(r.x, y), end = p + size_t(r.width); p < end; ++p)
          if (storage_->counts[p] > 0) return true;
      return false;
    };
    if (has_splats || has_samples()) storage_->mark_dirty(storage_->tiles[static_cast<size_t>(i)]);
  }
}

uint64_t Film::rejected_count() const {
  const std::lock_guard lock(storage_->rejected_mutex);
  return storage_->rejected_count;
}

std::vector<RejectedSample> Film::rejected_samples() const {
  const std::lock_guard lock(storage_->rejected_mutex);
  return storage_->rejected;
}

void Film::reject(size_t pixel, int64_t sample, std::span<const float> values) {
  const int width = settings_.region.width;
  RejectedSample rejected{settings_.region.x + static_cast<int>(pixel % size_t(width)),
                          settings_.region.y + static_cast<int>(pixel / size_t(width)),
                          sample,
                          {values.begin(), values.end()}};
  const auto place = [](const RejectedSample& r) { return std::tuple(r.sample, r.y, r.x); };
  const std::lock_guard lock(storage_->rejected_mutex);
  ++storage_->rejected_count;
  auto& list = storage_->rejected;
  const auto at = std::upper_bound(list.begin(), list.end(), rejected,
                                   [&](const auto& a, const auto& b) { return place(a) < place(b); });
  list.insert(at, std::move(rejected));
  if (list.size() > k_recorded) list.pop_back();
}

TileWriter::TileWriter(Film& film, int tile)
    : film_(film),
      tile_(tile),
      floats_(static_cast<size_t>(film.sample_components())),
      stride_(floats_ <= 4 ? floats_ : (floats_ + k_piece - 1) / k_piece * k_piece),
      held_(std::max<size_t>(k_buffered_floats / stride_, 1)),
      pixels_(std::make_unique_for_overwrite<uint32_t[]>(held_)),
      values_(std::make_unique_for_overwrite<float[]>(held_ * stride_ + k_piece)) {}

TileWriter::~TileWriter() {
  flush();
  film_.storage_->mark_dirty(film_.storage_->tiles[static_cast<size_t>(tile_)]);
}

void TileWriter::add(int x, int y, std::span<const float> values) {
  DCHECK(values.size() == floats_);
  float* const to = values_.get() + count_ * stride_;
  std::copy_n(values.data(), floats_, to);
  std::fill(to + floats_, to + stride_, 0.0f);
  add_next(x, y);
}

void TileWriter::add_next(int x, int y) {
  DCHECK(rectangle().contains(x, y));
  pixels_[count_] = static_cast<uint32_t>(film_.pixel_index(x, y));
  if (++count_ == held_) flush();
}

/// One sample of a film with channels of several rules.
[[gnu::always_inline]] inline void TileWriter::add_channels(size_t pixel, int64_t sample, const float* values) {
  Film::Storage& s = *film_.storage_;
  const FilmLayout& layout = film_.layout_;
  double* const doubles = s.doubles.data() + pixel * static_cast<size_t>(layout.doubles);
  float* const floats = s.floats.data() + pixel * static_cast<size_t>(layout.floats);
  const float noise = rounding_noise(sample);
  add_exactly(values, static_cast<size_t>(layout.exact_means), doubles);
  add_rounded(values + layout.exact_means, static_cast<size_t>(layout.means - layout.exact_means), floats, noise);
  if (sample == 0) [[unlikely]]
    for (const int number : layout.firsts) {
      const FilmLayout::Place& place = layout.places[static_cast<size_t>(number)];
      const int components = film_.settings_.channels[static_cast<size_t>(number)].components;
      std::copy_n(values + place.sample, components, floats + place.sum);
    }
  for (const int first : layout.squares) add_squares(values, doubles + first);
  if (layout.id_channels > 0) add_things(pixel, values, noise);
}

[[gnu::always_inline]] inline void TileWriter::add_things(size_t pixel, const float* values, float noise) {
  const FilmLayout& layout = film_.layout_;
  const float* met = values + layout.id_sample;
  if (!(met[0] > 0.0f)) return;
  const size_t floats = static_cast<size_t>(layout.id_floats()), slots = static_cast<size_t>(layout.id_slots);
  float* const held = film_.storage_->things.data() + pixel * slots * floats;
  const auto is_met = [&](const float* thing) {
    for (size_t k = 1; k < floats; ++k)
      if (std::bit_cast<uint32_t>(thing[k]) != std::bit_cast<uint32_t>(met[k])) return false;
    return true;
  };
  for (int i = 0; i < k_ids_a_sample && met[0] > 0.0f; ++i, met += floats) {
    float* thing = held;  // which most samples have met first
    if (!(thing[0] > 0.0f) || !is_met(thing)) [[unlikely]] {
      float* const last = held + (slots - 1) * floats;
      while (thing < last && thing[0] > 0.0f && !is_met(thing)) thing += floats;
      if (!(thing[0] > 0.0f)) std::copy_n(met + 1, floats - 1, thing + 1);
    }
    add_rounded(thing[0], met[0], noise);
  }
}

void TileWriter::flush() {
  Film::Storage& s = *film_.storage_;
  const std::lock_guard lock(s.tiles[static_cast<size_t>(tile_)].mutex);
  const bool all_good = all_finite({values_.get(), count_ * stride_});
  for (size_t n = 0; n < count_; ++n) {
    const size_t pixel = pixels_[n];
    const std::span<float> values(values_.get() + n * stride_, floats_);
    const int64_t sample = s.counts[pixel]++;
    bool good = all_good || all_finite(values.first(4));
    if (!all_good && good) [[unlikely]]
      // What is not finite in a pass (a broken UV map) does not cost the picture its sample.
      for (float& value : values.subspan(4))
        if (!std::isfinite(value)) value = 0.0f;
    if (!film_.settings_.allow_negative) good &= none_negative(values.data());
    if (!good) [[unlikely]] {
      film_.reject(pixel, sample, values);
      continue;
    }
    if (film_.layout_.plain) {
      double* sum = s.doubles.data() + pixel * floats_;
      for (size_t c = 0; c < floats_; ++c) sum[c] += values[c];
    } else {
      add_channels(pixel, sample, values.data());
    }
    if (!s.second_moments.empty()) {
      const double intensity = double(values[0]) + values[1] + values[2];
      s.second_moments[pixel] += intensity * intensity;
    }
  }
  count_ = 0;
}

}  // namespace lambent
