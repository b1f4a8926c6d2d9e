#include "engine/base/check.h"
#include "engine/film/adaptive.h"
#include "engine/film/film_storage.h"

namespace lambent {

namespace {

/// Replaces each value by the mean of those within k_adaptive_radius around it. Sums over x, then over y; every window
/// is summed afresh in the same order.
void average_around(std::vector<float>& values, int width, int height) {
  constexpr int r = k_adaptive_radius;
  const auto index = [&](int x, int y) { return size_t(y) * size_t(width) + size_t(x); };
  std::vector<float> rows(values.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      float sum = 0.0f;
      for (int i = std::max(x - r, 0); i <= std::min(x + r, width - 1); ++i) sum += values[index(i, y)];
      rows[index(x, y)] = sum;
    }
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int y0 = std::max(y - r, 0), y1 = std::min(y + r, height - 1);
      const int neighbours = (y1 - y0 + 1) * (std::min(x + r, width - 1) - std::max(x - r, 0) + 1);
      float sum = 0.0f;
      for (int j = y0; j <= y1; ++j) sum += rows[index(x, j)];
      values[index(x, y)] = sum / static_cast<float>(neighbours);
    }
}

}  // namespace

bool Film::active(int x, int y) const { return storage_->stopped.empty() || !storage_->stopped[pixel_index(x, y)]; }

bool Film::tile_active(int index) const {
  if (storage_->stopped.empty()) return true;
  const Rectangle& r = grid_[index];
  for (int y = r.y; y < r.y + r.height; ++y)
    for (int x = r.x; x < r.x + r.width; ++x)
      if (active(x, y)) return true;
  return false;
}

double Film::intensity_sum(size_t pixel) const {
  const double* sum = storage_->doubles.data() + pixel * static_cast<size_t>(layout_.doubles);
  return sum[0] + sum[1] + sum[2];
}

PixelError Film::error_of(size_t pixel) const {
  const Storage& s = *storage_;
  const double sum = intensity_sum(pixel);
  const uint32_t count = s.counts[pixel];
  PixelError error{count ? sum / count : 0.0, standard_error_of_mean(sum, s.second_moments[pixel], count), 0.0};
  const uint64_t paths = light_paths();
  if (paths == 0) return error;
  const double splats = s.splats->sum(pixel, 0) + s.splats->sum(pixel, 1) + s.splats->sum(pixel, 2);
  error.mean += splats / static_cast<double>(paths);
  error.of_splats = standard_error_of_mean(splats, s.splats->squares(pixel), static_cast<int64_t>(paths));
  return error;
}

float Film::standard_error(int x, int y) const {
  CHECK(settings_.second_moments);
  const PixelError error = error_of(pixel_index(x, y));
  return static_cast<float>(std::hypot(error.of_samples, error.of_splats));
}

size_t Film::stop_converged(float threshold, int64_t samples) {
  CHECK(settings_.second_moments);
  Storage& s = *storage_;
  const int width = settings_.region.width, height = settings_.region.height;

  // In a render that was interrupted in the pass after this check and continued, the check was made already, and on
  // other sums than there are now.
  size_t active_count = 0;
  bool made = false;
  for (size_t i = 0; i < s.counts.size(); ++i)
    if (!s.stopped[i]) ++active_count, made |= s.counts[i] > samples;
  if (made) return active_count;

  std::vector<float> squared(s.counts.size()), of_splats(takes_splats() ? s.counts.size() : 0);
  for (size_t i = 0; i < squared.size(); ++i) {
    const PixelError error = error_of(i);
    const auto noise_squared = [&](double standard_error) {
      const double noise = adaptive_noise(error.mean, standard_error);
      return static_cast<float>(noise * noise);
    };
    squared[i] = noise_squared(std::hypot(error.of_samples, error.of_splats));
    if (!of_splats.empty()) of_splats[i] = noise_squared(error.of_splats);
  }
  const float limit = sqr(threshold);
  if (!of_splats.empty()) {
    average_around(of_splats, width, height);
    size_t noisy = 0;
    for (size_t i = 0; i < of_splats.size(); ++i) noisy += !s.stopped[i] && !(of_splats[i] < limit);
    if (static_cast<double>(noisy) > k_adaptive_splat_share * static_cast<double>(of_splats.size()))
      return active_count;
  }
  average_around(squared, width, height);
  for (size_t i = 0; i < squared.size(); ++i)
    if (!s.stopped[i] && squared[i] < limit && s.counts[i] >= samples) {
      s.stopped[i] = 1;
      --active_count;
    }
  return active_count;
}

}  // namespace lambent
