#include "engine/film/splat_buffer.h"

#include <cmath>

namespace lambent {

namespace {
constexpr double k_steps_per_unit[3] = {0x1p44, 0x1p32, 0x1p8};
constexpr double k_largest_fine = 0x1p-8, k_largest_middle = 0x1p16, k_largest = 0x1p48;
}  // namespace

SplatBuffer::SplatBuffer(size_t pixels, int planes, double unit)
    : pixels_(pixels),
      planes_(static_cast<size_t>(planes)),
      per_unit_(unit > 0.0 && std::isfinite(unit) ? std::exp2(-std::round(std::log2(unit))) : 1.0),
      sums_(new std::atomic<int64_t>[pixels * planes_ * k_integers]()) {}

bool SplatBuffer::add(size_t pixel, const Color& value, int plane) {
  double scaled[3];
  for (int c = 0; c < 3; ++c) {
    scaled[c] = static_cast<double>(value[c]) * per_unit_;  // exact: a power of two
    if (!(std::fabs(scaled[c]) < k_largest)) return false;
  }
  std::atomic<int64_t>* sums = sums_.get() + (pixel * planes_ + static_cast<size_t>(plane)) * k_integers;
  for (int c = 0; c < 3; ++c, sums += 3) {
    const double size = std::fabs(scaled[c]);
    const int range = size < k_largest_fine ? 0 : size < k_largest_middle ? 1 : 2;
    const int64_t steps = std::llrint(scaled[c] * k_steps_per_unit[range]);
    if (steps != 0) sums[range].fetch_add(steps, std::memory_order_relaxed);
  }
  return true;
}

double SplatBuffer::sum(size_t pixel, int channel, int plane) const {
  const std::atomic<int64_t>* sums =
      sums_.get() + (pixel * planes_ + static_cast<size_t>(plane)) * k_integers + 3 * channel;
  double sum = 0.0;
  for (int range = 2; range >= 0; --range)
    sum += static_cast<double>(sums[range].load(std::memory_order_relaxed)) / k_steps_per_unit[range];
  return sum / per_unit_;
}

}  // namespace lambent
