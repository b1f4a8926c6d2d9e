#include "engine/base/check.h"
#include "engine/film/adaptive.h"
#include "engine/film/film_storage.h"

namespace lambent {

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
  const double* sum = storage_->sums.data() + pixel * static_cast<size_t>(layout_.sums);
  return sum[0] + sum[1] + sum[2];
}

float Film::standard_error(int x, int y) const {
  CHECK(settings_.second_moments);
  const size_t pixel = pixel_index(x, y);
  return static_cast<float>(
      standard_error_of_mean(intensity_sum(pixel), storage_->second_moments[pixel], storage_->counts[pixel]));
}

size_t Film::stop_converged(float threshold, int64_t samples) {
  CHECK(settings_.second_moments);
  Storage& s = *storage_;
  const int width = settings_.region.width, height = settings_.region.height;
  const auto index = [&](int x, int y) { return size_t(y) * size_t(width) + size_t(x); };

  // In a render that was interrupted in the pass after this check and continued, the check was made already, and on
  // other sums than there are now.
  size_t active_count = 0;
  bool made = false;
  for (size_t i = 0; i < s.counts.size(); ++i)
    if (!s.stopped[i]) ++active_count, made |= s.counts[i] > samples;
  if (made) return active_count;

  // Squared noise, summed over a window in x, then in y. Every window is summed afresh in the same order.
  std::vector<float> squared(s.counts.size()), rows(s.counts.size());
  for (size_t i = 0; i < squared.size(); ++i) {
    const double noise = adaptive_noise(intensity_sum(i), s.second_moments[i], s.counts[i]);
    squared[i] = static_cast<float>(noise * noise);
  }
  constexpr int r = k_adaptive_radius;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      float sum = 0.0f;
      for (int i = std::max(x - r, 0); i <= std::min(x + r, width - 1); ++i) sum += squared[index(i, y)];
      rows[index(x, y)] = sum;
    }
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const size_t i = index(x, y);
      if (s.stopped[i]) continue;
      const int y0 = std::max(y - r, 0), y1 = std::min(y + r, height - 1);
      const int neighbours = (y1 - y0 + 1) * (std::min(x + r, width - 1) - std::max(x - r, 0) + 1);
      float sum = 0.0f;
      for (int j = y0; j <= y1; ++j) sum += rows[index(x, j)];
      const bool quiet = sum < threshold * threshold * static_cast<float>(neighbours);
      if (quiet && s.counts[i] >= samples) {
        s.stopped[i] = 1;
        --active_count;
      }
    }
  return active_count;
}

}  // namespace lambent
