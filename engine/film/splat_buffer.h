// Sums of contributions that land on any pixel (light tracing), exact and independent of their order.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "engine/base/vec.h"
#include "engine/film/zeroed_vector.h"

namespace lambent {

/// RGB sums of planes of a rectangle of pixels in fixed point: integers add to the same sum in any order, so the
/// picture depends on neither threads nor tiles, and adding takes no lock. Each channel has three 64-bit sums with
/// steps of unit · 2^-44, 2^-32 and 2^-8; a value goes to the finest one that has room for many like it, rounded to its
/// step, so that reading while others add shows at worst a part of a splat. 72 bytes a pixel and plane, and 24 bytes a
/// pixel for the squares of what plane 0 gets, on request.
///
/// A value keeps 24 bits, or is exact to unit · 2^-45. Range: values below unit · 2^48 in magnitude; 2^27 splats of any
/// size up to unit · 2^-8, 2^15 up to unit · 2^16, 2^7 above that.
class SplatBuffer {
 public:
  /// @param unit a large radiance of the picture; rounded to a power of two. Not positive or not finite: 1
  /// @param squares keep the sums that squares() gives
  SplatBuffer(size_t pixels, int planes, double unit, bool squares = false);

  /// False, and nothing is added, if a component is not finite or out of range. Any thread.
  bool add(size_t pixel, const Color& value, int plane = 0);
  /// Sum of channel 0, 1 or 2.
  double sum(size_t pixel, int channel, int plane = 0) const;
  /// Sum of (R+G+B)² over the splats that plane 0 got. Splats beyond unit · 2^22 count as that bright.
  double squares(size_t pixel) const;

  /// Light paths whose splats are all added: what sums are divided by.
  void add_paths(uint64_t paths) { paths_.fetch_add(paths, std::memory_order_release); }
  uint64_t paths() const { return paths_.load(std::memory_order_acquire); }

  size_t bytes() const { return pixels_ * stride_ * sizeof(int64_t); }
  /// The raw sums, for checkpoints: int64[pixels][planes · 3, and 1 for squares][fine, middle, coarse].
  int64_t* integers() { return reinterpret_cast<int64_t*>(sums_.data()); }
  void set_paths(uint64_t paths) { paths_.store(paths); }

 private:
  static constexpr size_t k_ranges = 3, k_integers = 3 * k_ranges;
  using Integer = std::atomic<int64_t>;
  static void add_to(Integer* sums, double scaled);
  static double sum_of(const Integer* sums);
  static_assert(sizeof(std::atomic<int64_t>) == sizeof(int64_t) && std::atomic<int64_t>::is_always_lock_free);

  size_t pixels_, planes_;
  size_t stride_;  ///< integers a pixel
  bool keeps_squares_;
  double per_unit_;
  ZeroedVector<Integer> sums_;
  std::atomic<uint64_t> paths_{0};
};

}  // namespace lambent
