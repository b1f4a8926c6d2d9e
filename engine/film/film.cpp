#include "engine/film/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <new>
#include <stdexcept>
#include <tuple>

#include "engine/base/check.h"
#include "engine/film/adaptive.h"
#include "engine/film/film_storage.h"
#include "engine/film/pixel_reader.h"
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
  const Storage& s = *storage_;
  PixelReader reader(settings_.channels, layout_,
                     {s.doubles.data(), s.floats.data(), s.things.data(), s.counts.data(), s.splats.get()},
                     settings_.samples_asked, wanted);
  for (int y = 0; y < rectangle.height; ++y) {
    const size_t first = pixel_index(rectangle.x, rectangle.y + y);
    float* out = rows + size_t(y) * row_stride;
    for (size_t i = first; i < first + size_t(rectangle.width); ++i) out = reader.read(i, out);
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

/// The sums of a pixel, of which a tile's do not fit the fastest caches: they are there when flush() adds to them.
template <typename Sums>
[[gnu::always_inline]] inline void fetch_ahead(const Sums& sums, size_t pixel, size_t count) {
  constexpr size_t k_line = 64;
  const char* const begin = reinterpret_cast<const char*>(sums.data() + pixel * count);
  for (size_t i = 0; i < count * sizeof(*sums.data()); i += k_line) __builtin_prefetch(begin + i, 1, 2);
}

void TileWriter::add_next(int x, int y) {
  DCHECK(rectangle().contains(x, y));
  const size_t pixel = film_.pixel_index(x, y);
  pixels_[count_] = static_cast<uint32_t>(pixel);
  if (!film_.layout_.plain && (count_ == 0 || pixels_[count_ - 1] != pixel)) {
    const Film::Storage& s = *film_.storage_;
    fetch_ahead(s.floats, pixel, static_cast<size_t>(film_.layout_.floats));
    fetch_ahead(s.doubles, pixel, static_cast<size_t>(film_.layout_.doubles));
  }
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
