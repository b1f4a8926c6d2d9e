#include "engine/film/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>
#include <tuple>

#include "engine/base/check.h"
#include "engine/film/film_storage.h"

namespace lambent {

namespace {
/// Samples that a TileWriter holds back before it takes the tile's lock.
constexpr size_t k_buffered_samples = 4096;
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
  for (const Channel& channel : settings.channels) {
    if (channel.components < 1 || channel.components > 64)
      return Error{fmt::format("Channel '{}' has {} components.", channel.name, channel.components)};
    film->components_ += channel.components;
  }
  if (settings.channels.empty() || settings.channels[0].components != 4)
    return Error{"The first channel must be the picture's RGBA."};

  film->storage_ = std::make_unique<Storage>();
  Storage& storage = *film->storage_;
  const size_t pixels = size_t(region.width) * size_t(region.height);
  storage.sums.resize(pixels * size_t(film->components_));
  storage.counts.resize(pixels);
  if (settings.second_moments) {
    storage.second_moments.resize(pixels);
    storage.stopped.resize(pixels);
  }
  if (film->takes_splats()) storage.splats = std::make_unique<SplatBuffer>(pixels, settings.splat_unit);
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
  return s.sums.size() * sizeof(double) + s.counts.size() * sizeof(uint32_t) +
         s.second_moments.size() * sizeof(double) + s.stopped.size() + s.tiles.size() * sizeof(Storage::Tile) +
         (s.splats ? s.splats->bytes() : 0);
}

void Film::splat(int x, int y, const Color& value) {
  if (!settings_.region.contains(x, y)) return;
  const bool good = settings_.allow_negative || min_component(value) >= 0.0f;
  if (good && storage_->splats->add(pixel_index(x, y), value)) return;
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

void Film::read(const Rectangle& rectangle, float* rows, size_t row_stride) const {
  const Storage& s = *storage_;
  const size_t components = static_cast<size_t>(components_);
  const uint64_t light_paths = s.splats ? s.splats->paths() : 0;
  for (int y = 0; y < rectangle.height; ++y) {
    const size_t first = pixel_index(rectangle.x, rectangle.y + y);
    float* out = rows + size_t(y) * row_stride;
    for (size_t i = first; i < first + size_t(rectangle.width); ++i) {
      const double scale = s.counts[i] ? 1.0 / s.counts[i] : 0.0;
      for (size_t c = 0; c < components; ++c) {
        double value = s.sums[i * components + c] * scale;
        if (c < 3 && light_paths > 0) value += s.splats->sum(i, static_cast<int>(c)) / static_cast<double>(light_paths);
        *out++ = static_cast<float>(value);
      }
    }
  }
}

FilmTile Film::tile(int index) const {
  FilmTile result;
  result.rectangle = grid_[index];
  const Rectangle& r = result.rectangle;
  const size_t stride = size_t(r.width) * size_t(components_);
  result.pixels.resize(stride * size_t(r.height));
  uint32_t least = UINT32_MAX, least_active = UINT32_MAX;
  Storage& s = *storage_;
  const std::lock_guard lock(s.tiles[static_cast<size_t>(index)].mutex);
  read(r, result.pixels.data(), stride);
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
  const size_t components = static_cast<size_t>(components_), stride = size_t(all.width) * components;
  std::vector<float> result(stride * size_t(all.height));
  for (int index = 0; index < grid_.count(); ++index) {
    const Rectangle& r = grid_[index];
    const std::lock_guard lock(storage_->tiles[static_cast<size_t>(index)].mutex);
    read(r, result.data() + size_t(r.y - all.y) * stride + size_t(r.x - all.x) * components, stride);
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

void Film::mark_all_dirty() {
  for (Storage::Tile& tile : storage_->tiles) storage_->mark_dirty(tile);
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

TileWriter::TileWriter(Film& film, int tile) : film_(film), tile_(tile) {
  pixels_.reserve(k_buffered_samples);
  values_.reserve(k_buffered_samples * static_cast<size_t>(film.components()));
}

TileWriter::~TileWriter() {
  flush();
  film_.storage_->mark_dirty(film_.storage_->tiles[static_cast<size_t>(tile_)]);
}

void TileWriter::add(int x, int y, std::span<const float> values) {
  DCHECK(rectangle().contains(x, y));
  DCHECK(values.size() == static_cast<size_t>(film_.components()));
  pixels_.push_back(static_cast<uint32_t>(film_.pixel_index(x, y)));
  values_.insert(values_.end(), values.begin(), values.end());
  if (pixels_.size() >= k_buffered_samples) flush();
}

void TileWriter::flush() {
  Film::Storage& s = *film_.storage_;
  const size_t components = static_cast<size_t>(film_.components());
  const std::lock_guard lock(s.tiles[static_cast<size_t>(tile_)].mutex);
  for (size_t n = 0; n < pixels_.size(); ++n) {
    const size_t pixel = pixels_[n];
    const std::span<const float> values(values_.data() + n * components, components);
    const int64_t sample = s.counts[pixel]++;
    bool good = true;
    for (const float value : values) good &= std::isfinite(value);
    if (!film_.settings_.allow_negative)
      for (size_t c = 0; c < 4; ++c) good &= values[c] >= 0.0f;
    if (!good) [[unlikely]] {
      film_.reject(pixel, sample, values);
      continue;
    }
    double* sum = s.sums.data() + pixel * components;
    for (size_t c = 0; c < components; ++c) sum[c] += values[c];
    if (!s.second_moments.empty()) {
      const double intensity = double(values[0]) + values[1] + values[2];
      s.second_moments[pixel] += intensity * intensity;
    }
  }
  pixels_.clear();
  values_.clear();
}

}  // namespace lambent
