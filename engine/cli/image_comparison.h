// How two pictures differ: error measures, and a test per tile of whether their expectations do.
#pragma once

#include <optional>
#include <vector>

#include "engine/cli/image_file.h"

namespace lambent {

struct TileDifference {
  int x = 0, y = 0;         ///< px, upper left corner
  double difference = 0.0;  ///< of the tile's means over pixels and channels, a - reference
  double p_value = 1.0;     ///< of a difference this large if the expectations were the same
};

struct ImageComparison {
  double rel_mse = 0.0;  ///< mean of (a - r)^2 / (r^2 + 0.01) over pixels and channels where both are finite
  /// Without the worst thousandth of the pixels: what is seen by one path in a million samples is a handful of pixels
  /// so bright that they alone make relMSE, equally in every method.
  double rel_mse_trimmed = 0.0;
  double smape = 0.0;       ///< mean of |a - r| / (|a| + |r|) over the same, 0 where both are 0; in [0, 1]
  double mean_ratio = 1.0;  ///< mean of a over mean of r; 1 if both are 0
  double max_error = 0.0;   ///< largest |a - r|
  int max_error_x = 0, max_error_y = 0;
  size_t non_finite = 0;  ///< pixels where either is not finite
  size_t tiles = 0, failed_tiles = 0;
  std::vector<TileDifference> worst_tiles;  ///< the failed ones, at most 10, least probable first
};

struct ComparisonOptions {
  int tile_px = 16;
  double significance = 0.01;  ///< of the whole test; each tile has it divided by their number (Bonferroni)
};

/// Compares `a` with `reference`, which has the same size and number of channels. Per tile, Welch's test on the mean
/// over its pixels and channels: with `variance_a` and `variance_reference` (variances of each pixel's value, same
/// layout) by those; without, by the spread of the difference over the tile's pixels, which also holds what differs in
/// structure, so the test is then less sensitive. The normal distribution stands for Student's (tiles have hundreds of
/// pixels).
ImageComparison compare_images(const ImageLayer& a, const ImageLayer& reference, const ComparisonOptions& options,
                               const ImageLayer* variance_a = nullptr, const ImageLayer* variance_reference = nullptr);

}  // namespace lambent
