#include "engine/film/splat_buffer.h"

#include <cmath>

namespace lambent {

namespace {
constexpr double k_coarse = 0x1p16, k_fine = 0x1p52, k_largest = 0x1p40;
}

SplatBuffer::SplatBuffer(size_t pixels, double unit)
    : pixels_(pixels),
      unit_(unit > 0.0 && std::isfinite(unit) ? std::exp2(std::round(std::log2(unit))) : 1.0),
      sums_(new std::atomic<int64_t>[pixels * k_integers]()) {}

bool SplatBuffer::add(size_t pixel, const Color& value) {
  double scaled[3];
  for (int c = 0; c < 3; ++c) {
    scaled[c] = static_cast<double>(value[c]) / unit_;  // exact: a power of two
    if (!(std::fabs(scaled[c]) < k_largest)) return false;
  }
  std::atomic<int64_t>* sums = sums_.get() + pixel * k_integers;
  for (int c = 0; c < 3; ++c) {
    const double coarse = std::nearbyint(scaled[c] * k_coarse);
    const double rest = scaled[c] - coarse / k_coarse;  // exact: a float has 24 bits
    if (coarse != 0.0) sums[2 * c].fetch_add(static_cast<int64_t>(coarse), std::memory_order_relaxed);
    if (rest != 0.0)
      sums[2 * c + 1].fetch_add(static_cast<int64_t>(std::nearbyint(rest * k_fine)), std::memory_order_relaxed);
  }
  return true;
}

double SplatBuffer::sum(size_t pixel, int channel) const {
  const std::atomic<int64_t>* sums = sums_.get() + pixel * k_integers + 2 * channel;
  return unit_ * (static_cast<double>(sums[0].load(std::memory_order_relaxed)) / k_coarse +
                  static_cast<double>(sums[1].load(std::memory_order_relaxed)) / k_fine);
}

}  // namespace lambent
