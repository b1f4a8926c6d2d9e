// Sums of a pixel as what readers get of it. Internal to film/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/film/film_channel.h"
#include "engine/film/splat_buffer.h"

namespace lambent {

/// Where a film has its sums (Film::Storage).
struct FilmSums {
  const double* doubles = nullptr;
  const float* floats = nullptr;
  const float* things = nullptr;
  const uint32_t* counts = nullptr;
  const SplatBuffer* splats = nullptr;  ///< null: there are none
};

/// Reads pixels, one after the other, of the channels that are wanted; what that takes is decided once. For one thread.
class PixelReader {
 public:
  /// @param wanted by number in output_channels(); empty: all
  /// @param samples_asked FilmSettings::samples_asked
  /// All references are kept.
  PixelReader(const std::vector<FilmChannel>& channels, const FilmLayout& layout, const FilmSums& sums,
              int64_t samples_asked, const std::vector<bool>& wanted);

  /// Writes a pixel's floats from `to` on; returns where they end.
  float* read(size_t pixel, float* to);

 private:
  /// Means that lie together and are read as they are, or a channel that takes more.
  struct Step {
    int channel = -1;  ///< -1: means
    size_t from = 0;   ///< of means: in means_
    size_t count = 0;
    int first_level = 0, levels = 0;  ///< rule ids: which fours of it
  };
  struct Range {
    size_t from = 0, count = 0;  ///< among the doubles or the floats
  };

  void add_step(size_t channel, const std::vector<bool>& wanted);
  void need(int channel);
  void work_out_means(size_t pixel);
  double mean(size_t channel, int component) const { return means_[from_[channel] + static_cast<size_t>(component)]; }
  double divisor(size_t channel, int component) const;
  double shadow(const ShadowCatcher& catcher, int component) const;
  void add_caught(const ShadowCatcher& catcher, float* picture) const;
  float* read_channel(size_t pixel, const Step& step, float* to);
  void read_ids(size_t pixel, const FilmLayout::Place& place, float* out, int components) const;

  const std::vector<FilmChannel>& channels_;
  const FilmLayout& layout_;
  const FilmSums sums_;
  const int64_t samples_asked_;
  const uint64_t light_paths_;
  std::vector<Step> steps_;
  std::vector<bool> needed_;  ///< by channel: its means
  std::vector<Range> of_doubles_, of_floats_;
  std::vector<size_t> splatted_;  ///< channels that are needed and take splats
  std::vector<size_t> from_;      ///< by channel: its place in means_
  std::vector<double> means_;     ///< of the pixel: those of the doubles, then those of the floats
};

}  // namespace lambent
