// The channels of a film: how the values of many samples make a pixel's.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/film/rectangle.h"

namespace lambent {

/// Checkpoints have their numbers.
enum class ChannelRule : uint8_t {
  mean,          ///< of the samples
  first,         ///< the value of the pixel's first sample: for what has no mean, such as indices
  ids,           ///< which ids (floats, compared bit by bit) the samples met and with what share: see FilmLayout
  sample_count,  ///< takes nothing of a sample
  error,         ///< standard error of the mean of the picture's R, G, B, splats left out; takes nothing of a sample
  caught,        ///< what shadow catchers caught (ShadowCatcher), 1 where there are none; takes nothing of a sample
  share,         ///< of what the samples show, found by some of them: see FilmChannel
};

/// Whether the floats of samples are summed.
constexpr bool is_mean(ChannelRule rule) { return rule == ChannelRule::mean || rule == ChannelRule::share; }

/// Things that one sample meets at most, each with its weight: what lies behind several transparent surfaces.
inline constexpr int k_ids_a_sample = 8;

inline constexpr double k_least_divisor = 0x1p-10;

/// Numbers of the mean channels that say what shadow catchers caught. The shadow is (lit - brought) / bare, a ratio of
/// sums.
struct ShadowCatcher {
  int lit = -1, bare = -1;  ///< R, G, B of the catchers, shaded by others and not
  int brought = -1;         ///< R, G, B of lit that mattes show as it is: it came by way of others; -1: there are none
  int cover = -1;           ///< share of the pixel that they take
  int behind = -1;          ///< R, G, B of the world behind them; -1: the film is transparent
  bool in_picture = true;   ///< the picture shows the shadow; if not, a channel does and the compositor lays it under
};

struct FilmChannel {
  std::string name;
  /// Of a pixel. share: 3, which all read the same; of a sample they are (weight times what it found times its cover,
  /// weight times cover, cover), weight 0 where it did not look; the pixel is the mean cover times the weighted mean of
  /// what was found. ids: 2 a level, (id, coverage) from the largest coverage down; a multiple of 4, and a reader gets
  /// channels of 4 named name00, name01 ...
  int components = 4;
  ChannelRule rule = ChannelRule::mean;
  /// Number of a mean channel with as many components or one: a pixel is the ratio, 0 where the divisor is.
  /// But where splats reach a pixel in which no sample had any of a divisor that takes no splats itself (a colour),
  /// that reads as k_least_divisor, so that products give back the sums.
  int divided_by = -1;
  int minus = -1;  ///< number of a mean channel with as many components that is subtracted when it is read
  /// What catchers add to the picture when it is read: the world behind them times the shadow or, on a transparent
  /// film, alpha, as much as the shadow darkens; and what is brought to mattes.
  std::optional<ShadowCatcher> catcher = {};
  bool total = false;        ///< mean: reads as the sum of the samples
  bool hidden = false;       ///< summed for others' sake, not read
  std::string letters = {};  ///< Channel::letters
  bool splats = false;       ///< takes splats in its first three components. Where the film takes none: nothing
};

/// Whether all of the floats are finite: several at a time, by a sum of zero times each, which is 0 or no number.
inline bool all_finite(std::span<const float> values) {
  const float* const first = values.data();
  const size_t count = values.size();
  const auto several = [&]<typename Floats>(Floats zero) {
    constexpr size_t n = sizeof(Floats) / sizeof(float);
    Floats sums[4] = {zero, zero, zero, zero};
    const auto take = [&](size_t i, Floats& sum) {
      Floats value;
      std::memcpy(&value, first + i, sizeof value);
      sum += value * zero;
    };
    size_t i = 0;
    for (; i + 4 * n <= count; i += 4 * n)
      for (size_t k = 0; k < 4; ++k) take(i + k * n, sums[k]);
    for (; i + n <= count; i += n) take(i, sums[0]);
    take(count - n, sums[1]);  // the rest, and some again
    const auto good = (sums[0] + sums[1]) + (sums[2] + sums[3]) == zero;
    uint64_t all = ~uint64_t{0}, parts[sizeof good / sizeof all];
    std::memcpy(parts, &good, sizeof good);
    for (const uint64_t part : parts) all &= part;
    return all == ~uint64_t{0};
  };
  using Floats4 = float __attribute__((vector_size(16)));
  using Floats8 = float __attribute__((vector_size(32)));
  if (count >= 8) return several(Floats8{});
  if (count >= 4) return several(Floats4{});
  for (const float value : values)
    if (!std::isfinite(value)) return false;
  return true;
}

/// Where everything of a channel lies. In a sample the means come first, those whose sums are doubles before the
/// others. Doubles hold the picture, what catchers make of it and the squares of `error`; all else is held in floats
/// (rounded_sum.h).
struct FilmLayout {
  struct Place {
    int sample = 0;              ///< first of its floats in a sample
    int sum = 0;                 ///< first of its sums in a pixel, among the doubles or the floats
    bool exact = false;          ///< the doubles
    int id = -1;                 ///< ids: number of its id among those of a thing
    int plane = -1;              ///< of the splats; -1: takes none
    int output = -1;             ///< its number in output_channels(), the first where it makes several; -1: hidden
    std::vector<int> dividends;  ///< channels that are divided by it
  };
  std::vector<Place> places;  ///< by channel
  int means = 0;              ///< floats that are summed: the first of a sample
  int exact_means = 0;        ///< the first of those, added to the first of the doubles; the others to the floats
  std::vector<int> firsts;    ///< channels of that rule
  std::vector<int> squares;   ///< rule error: first of the sums of the squares of R, G, B
  int sample_floats = 0, planes = 0, output_floats = 0;
  /// The channels of rule ids share a table of the things that samples met, each a weight and the thing's id for each
  /// of these channels. A sample brings k_ids_a_sample of them at most, ended by a weight of 0.
  int id_channels = 0;
  int id_sample = 0;  ///< where the things begin in a sample
  /// Things that a pixel holds; more than levels, so that what comes late and often is not lost. What finds no place
  /// joins the last one.
  int id_slots = 0;
  int doubles = 0, floats = 0;  ///< sums of a pixel
  bool plain = true;            ///< nothing but exact means: a sample's floats are added to a pixel's doubles

  explicit FilmLayout(const std::vector<FilmChannel>& channels = {});
  int id_floats() const { return 1 + id_channels; }  ///< of a thing: its weight, then the ids
};

/// The channels that a reader gets, in order.
std::vector<Channel> output_channels(const std::vector<FilmChannel>& channels);

}  // namespace lambent
