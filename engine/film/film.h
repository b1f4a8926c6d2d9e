// Where samples become pixels: exact sums per pixel, tile by tile.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/base/result.h"
#include "engine/base/vec.h"
#include "engine/film/film_channel.h"
#include "engine/film/tile_grid.h"

namespace lambent {

struct FilmSettings {
  int width = 0, height = 0;  ///< px of the full frame
  Rectangle region;           ///< what is rendered of it; the film has memory for no more. Empty: all
  int tile_size_px = 64;
  TileOrder tile_order = TileOrder::hilbert;
  std::vector<FilmChannel> channels{{.name = "combined", .splats = true}};  ///< first the picture: premultiplied RGBA
  /// A sample's picture may rightly be below 0: lights of negative power take light away, and on a transparent film
  /// seen through glass a sample's alpha is less than 0 where its weight is more than 1.
  bool allow_negative = false;
  int64_t samples_asked = 0;    ///< what channels of rule sample_count are divided by; 0: 1
  bool second_moments = false;  ///< needed by stop_converged() and standard_error()
  /// A large radiance of the picture: the film takes splats (see SplatBuffer). 0: it takes none and has no memory for
  /// them.
  double splat_unit = 0.0;
};

/// Normalised pixels of one tile.
struct FilmTile {
  Rectangle rectangle;
  int64_t samples = 0;        ///< fewest of any pixel in it that is still active (of all pixels if none is)
  std::vector<float> pixels;  ///< float[height][width][components of the channels read], row 0 at the bottom
};

/// Of a pixel's R+G+B: its mean, and the standard errors of what samples and what splats have of it.
struct PixelError {
  double mean = 0.0, of_samples = 0.0, of_splats = 0.0;
};

/// A sample that was not finite or negative: its place, for a replay.
struct RejectedSample {
  int x = 0, y = 0;
  int64_t sample = 0;
  std::vector<float> values;
};

/// Sums of samples per pixel (the picture's in double, passes' in float without drift: FilmLayout), each pixel's added
/// in the order of its samples: so the picture depends on neither threads nor tiles nor pauses. Invariant: a pixel's
/// sample n is added after its samples 0..n-1, once.
///
/// Threads: each tile is written by one thread at a time, through a TileWriter; reading a tile is allowed meanwhile.
/// A sample's estimate belongs to one pixel (filters are importance-sampled). What lands elsewhere (light tracing) goes
/// to a SplatBuffer beside these sums, from any thread; a pixel is the mean of its samples plus its splats a light
/// path.
class Film {
 public:
  /// Error: a size or region that is empty or outside the frame, no channels, or not enough memory.
  static Result<std::shared_ptr<Film>> create(const FilmSettings& settings);
  ~Film();

  const FilmSettings& settings() const { return settings_; }
  const Rectangle& region() const { return settings_.region; }
  const TileGrid& tiles() const { return grid_; }
  /// Floats of a sample: those of all channels in order (FilmLayout).
  int sample_components() const { return layout_.sample_floats; }
  const FilmLayout& layout() const { return layout_; }
  /// What tile() and pixels() give of each pixel, in order.
  const std::vector<Channel>& channels() const { return output_channels_; }
  /// Floats of a pixel: the components of channels().
  int components() const { return layout_.output_floats; }
  size_t bytes() const;

  /// Samples added to a pixel so far: the number of its next sample.
  int64_t sample_count(int x, int y) const;
  /// Fewest samples of any active pixel (of all pixels if none is active).
  int64_t min_sample_count() const;

  bool takes_splats() const { return settings_.splat_unit > 0.0; }
  /// Adds to a plane's RGB at a pixel (FilmLayout::Place::plane; 0: the picture); outside the region nothing happens.
  /// Any thread, without locks, any order: the sums are the same. A value that is not finite, out of range or negative
  /// without allow_negative is rejected.
  void splat(int x, int y, const Color& value, int plane = 0);
  /// Tells that the splats of so many more light paths are in: the number that their sums are divided by.
  void add_light_paths(uint64_t paths);
  uint64_t light_paths() const;

  /// The newest pixels of a tile. Divides by each pixel's own count; pixels without samples are 0.
  /// @param wanted by number in channels(): what to read; empty: all
  FilmTile tile(int index, const std::vector<bool>& wanted = {}) const;
  /// The whole region: float[region.height][region.width][components()], row 0 at the bottom.
  std::vector<float> pixels() const;

  /// Tiles finished by a writer since last taken, oldest first, at most `limit`. One reader at a time.
  std::vector<int> take_dirty(size_t limit);
  /// Those that hold anything. While nobody writes.
  void mark_filled_dirty();

  /// Estimates that were rejected: counted, and the first k_recorded of them (by pixel and sample, whatever the
  /// thread).
  uint64_t rejected_count() const;
  std::vector<RejectedSample> rejected_samples() const;
  static constexpr size_t k_recorded = 16;
  static constexpr int64_t k_splat = -1;  ///< RejectedSample::sample of a splat

  /// Adaptive sampling (noise_threshold). To be called between passes, when active pixels have `samples` samples, at
  /// the counts that is_adaptive_check() names, so that an interrupted and continued render decides the same. Pixels
  /// whose neighbourhood is quieter than `threshold` become inactive for good, none while splats are what is noisy.
  /// Returns how many stay active. Does nothing if some active pixel has more than `samples`. Error measure: see
  /// adaptive.h. Requires second_moments.
  size_t stop_converged(float threshold, int64_t samples);
  bool active(int x, int y) const;
  bool tile_active(int index) const;
  /// Standard error of a pixel's mean of R+G+B, splats included; infinity with fewer than 2 samples. Requires
  /// second_moments.
  float standard_error(int x, int y) const;

  /// Saves the exact sums (zstd) to a temporary name, then renames. `identity` says what the samples belong to
  /// (scene, settings that change them); load fails unless it is the same. No writer may be active.
  Status save(const std::string& path, const std::string& identity) const;
  /// Replaces the film's content. On an Error, which names the file, the film is as before.
  Status load(const std::string& path, const std::string& identity);

 private:
  friend class TileWriter;
  struct Storage;
  Film();
  size_t pixel_index(int x, int y) const {
    return size_t(y - settings_.region.y) * size_t(settings_.region.width) + size_t(x - settings_.region.x);
  }
  /// @param wanted by number in channels(); empty: all
  void read(const Rectangle& rectangle, const std::vector<bool>& wanted, float* rows, size_t row_stride) const;
  void reject(size_t pixel, int64_t sample, std::span<const float> values);
  double intensity_sum(size_t pixel) const;
  PixelError error_of(size_t pixel) const;

  FilmSettings settings_;
  TileGrid grid_;
  FilmLayout layout_;
  std::vector<Channel> output_channels_;
  std::unique_ptr<Storage> storage_;
};

/// Adds one thread's samples to one tile. Buffers them and takes the tile's lock rarely; the destructor adds the rest
/// and marks the tile dirty. Within a pixel samples arrive in order, starting at Film::sample_count(x, y).
class TileWriter {
 public:
  TileWriter(Film& film, int tile);
  ~TileWriter();
  TileWriter(const TileWriter&) = delete;
  TileWriter& operator=(const TileWriter&) = delete;

  const Rectangle& rectangle() const { return film_.tiles()[tile_]; }
  /// One sample of a pixel: film.sample_components() floats. A sample whose picture (the first channel) is not finite
  /// or negative is counted and recorded, and adds nothing but its count; what is not finite in other channels adds 0.
  void add(int x, int y, std::span<const float> values);
  /// The usual case of one RGBA channel.
  void add(int x, int y, const Vec4& rgba) {
    if (stride_ != 4) return add(x, y, std::span<const float>(&rgba.x, 4));
    std::memcpy(values_.get() + count_ * 4, &rgba.x, 4 * sizeof(float));
    add_next(x, y);
  }
  /// Room for a sample's floats, all 0, until anything else is called; add_next() adds it as add() does.
  std::span<float> next() {
    float* const values = values_.get() + count_ * stride_;
    using Floats8 = float __attribute__((vector_size(32)));
    constexpr Floats8 k_zeros{};
    for (size_t i = 0; i < stride_; i += k_piece)
      for (size_t k = 0; k < k_piece; k += 8) std::memcpy(values + i + k, &k_zeros, sizeof k_zeros);
    return {values, floats_};
  }
  void add_next(int x, int y);
  /// Adds what is buffered, so that readers see it.
  void flush();

 private:
  void add_channels(size_t pixel, int64_t sample, const float* values);
  void add_things(size_t pixel, const float* values, float noise);

  Film& film_;
  int tile_;
  static constexpr size_t k_piece = 32;
  const size_t floats_;  ///< of a sample
  const size_t stride_;  ///< from one to the next: whole pieces, but of films of the picture alone
  const size_t held_;    ///< samples, at most
  size_t count_ = 0;     ///< of those that are held back
  std::unique_ptr<uint32_t[]> pixels_;
  std::unique_ptr<float[]> values_;
};

}  // namespace lambent
