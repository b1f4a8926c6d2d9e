// The channels of a film: how the values of many samples make a pixel's.
#pragma once

#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/film/rectangle.h"

namespace lambent {

enum class ChannelRule : uint8_t {
  mean,          ///< of the samples
  first,         ///< the value of the pixel's first sample: for what has no mean, such as indices
  ids,           ///< which ids (floats, compared bit by bit) the samples met and with what share: see FilmChannel
  sample_count,  ///< takes nothing of a sample
  error,         ///< standard error of the mean of the picture's R, G, B, splats left out; takes nothing of a sample
  caught,        ///< what shadow catchers caught (ShadowCatcher), 1 where there are none; takes nothing of a sample
};

/// Ids that one sample brings at most, each with its weight: what lies behind several transparent surfaces.
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
  /// Of a pixel. ids: 2 a level, (id, coverage) from the largest coverage down; a multiple of 4, and a reader gets
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

/// Whether all of the floats are finite, told by their exponents' bits: several at a time.
inline bool all_finite(std::span<const float> values) {
  constexpr uint32_t k_exponent = 0x7f800000u;
  uint32_t bad = 0;
  for (const float value : values) bad |= (std::bit_cast<uint32_t>(value) & k_exponent) == k_exponent ? 1u : 0u;
  return bad == 0;
}

/// Where everything of a channel lies: those of rule mean before all others, each kind in the order of the channels.
struct FilmLayout {
  struct Place {
    int sample = 0;   ///< first of its floats in a sample
    int sum = 0;      ///< first of its sums in a pixel
    int id = -1;      ///< ids: first of its slots in a pixel
    int slots = 0;    ///< ids: number of them; more than levels, so that what comes late and often is not lost
    int plane = -1;   ///< of the splats; -1: takes none
    int output = -1;  ///< its number in output_channels(), the first where it makes several; -1: hidden
    std::vector<int> dividends;  ///< channels that are divided by it
  };
  std::vector<Place> places;             ///< by channel
  int means = 0;                         ///< floats of rule mean: the first of a sample, added to the first of the sums
  std::vector<int> firsts, errors, ids;  ///< channels of those rules
  int sample_floats = 0, sums = 0, id_slots = 0, planes = 0, output_floats = 0;
  bool plain = true;  ///< nothing but means, all read as they are

  explicit FilmLayout(const std::vector<FilmChannel>& channels = {});
  /// That a channel has in a sample, one of a rule that takes some.
  static int sample_floats_of(const FilmChannel& channel) {
    return channel.rule == ChannelRule::ids ? 2 * k_ids_a_sample : channel.components;
  }
};

/// The channels that a reader gets, in order.
std::vector<Channel> output_channels(const std::vector<FilmChannel>& channels);

}  // namespace lambent
