#include "engine/film/splat_buffer.h"

#include <algorithm>
#include <cmath>

namespace lambent {

namespace {
constexpr double k_steps_per_unit[3] = {0x1p44, 0x1p32, 0x1p8};
constexpr double k_largest_fine = 0x1p-8, k_largest_middle = 0x1p16, k_largest = 0x1p48;
constexpr double k_largest_square = 0x1p44;
}  // namespace

SplatBuffer::SplatBuffer(size_t pixels, int planes, double unit, bool squares)
    : pixels_(pixels),
      planes_(static_cast<size_t>(planes)),
      stride_(planes_ * k_integers + (squares ? k_ranges : 0)),
      keeps_squares_(squares),
      per_unit_(unit > 0.0 && std::isfinite(unit) ? std::exp2(-std::round(std::log2(unit))) : 1.0),
      sums_(pixels * stride_) {}

void SplatBuffer::add_to(Integer* sums, double scaled) {
  const double size = std::fabs(scaled);
  const int range = size < k_largest_fine ? 0 : size < k_largest_middle ? 1 : 2;
  const int64_t steps = std::llrint(scaled * k_steps_per_unit[range]);
  if (steps != 0) sums[range].fetch_add(steps, std::memory_order_relaxed);
}

double SplatBuffer::sum_of(const Integer* sums) {
  double sum = 0.0;
  for (int range = 2; range >= 0; --range)
    sum += static_cast<double>(sums[range].load(std::memory_order_relaxed)) / k_steps_per_unit[range];
  return sum;
}

bool SplatBuffer::add(size_t pixel, const Color& value, int plane) {
  double scaled[3];
  for (int c = 0; c < 3; ++c) {
    scaled[c] = static_cast<double>(value[c]) * per_unit_;  // exact: a power of two
    if (!(std::fabs(scaled[c]) < k_largest)) return false;
  }
  Integer* sums = sums_.data() + pixel * stride_;
  if (keeps_squares_ && plane == 0) {
    const double all = scaled[0] + scaled[1] + scaled[2];
    add_to(sums + planes_ * k_integers, std::min(all * all, k_largest_square));
  }
  sums += static_cast<size_t>(plane) * k_integers;
  for (int c = 0; c < 3; ++c) add_to(sums + c * k_ranges, scaled[c]);
  return true;
}

double SplatBuffer::sum(size_t pixel, int channel, int plane) const {
  const size_t place = pixel * stride_ + static_cast<size_t>(plane) * k_integers;
  return sum_of(sums_.data() + place + static_cast<size_t>(channel) * k_ranges) / per_unit_;
}

double SplatBuffer::squares(size_t pixel) const {
  return sum_of(sums_.data() + pixel * stride_ + planes_ * k_integers) / (per_unit_ * per_unit_);
}

}  // namespace lambent
