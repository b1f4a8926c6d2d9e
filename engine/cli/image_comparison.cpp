#include "engine/cli/image_comparison.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lambent {
namespace {

/// Sums over one tile of d, the mean over channels of a - r at a pixel.
struct TileSums {
  size_t pixels = 0;
  double sum = 0.0, sum_squares = 0.0;  ///< of d
  double variance = 0.0;                ///< sum of the variances of d, where given
};

/// Two-sided p-value of a standard normal deviate.
double p_value_of(double z) { return std::erfc(std::fabs(z) / std::numbers::sqrt2); }

TileDifference judge(const TileSums& sums, bool with_variances, int x, int y) {
  const auto n = static_cast<double>(sums.pixels);
  const double mean = sums.sum / n;
  double variance_of_mean = 0.0;
  if (with_variances)
    variance_of_mean = sums.variance / (n * n);
  else if (sums.pixels > 1)
    variance_of_mean = std::max(0.0, sums.sum_squares - n * mean * mean) / (n - 1.0) / n;
  // Equal pixels with no noise are the same; different ones with no noise are different.
  double p = mean == 0.0 ? 1.0 : 0.0;
  if (variance_of_mean > 0.0) p = p_value_of(mean / std::sqrt(variance_of_mean));
  return {x, y, mean, p};
}

}  // namespace

ImageComparison compare_images(const ImageLayer& a, const ImageLayer& reference, const ComparisonOptions& options,
                               const ImageLayer* variance_a, const ImageLayer* variance_reference) {
  ImageComparison result;
  const size_t channels = reference.channels.size();
  const bool with_variances = variance_a && variance_reference;
  const int tiles_x = (reference.width + options.tile_px - 1) / options.tile_px;
  const int tiles_y = (reference.height + options.tile_px - 1) / options.tile_px;
  std::vector<TileSums> tiles(static_cast<size_t>(tiles_x) * tiles_y);
  double error_sum = 0.0, smape_sum = 0.0, sum_a = 0.0, sum_reference = 0.0;
  size_t values = 0;
  std::vector<double> pixel_errors;
  pixel_errors.reserve(static_cast<size_t>(reference.width) * static_cast<size_t>(reference.height));
  for (int y = 0; y < reference.height; ++y)
    for (int x = 0; x < reference.width; ++x) {
      const size_t at = (static_cast<size_t>(y) * reference.width + x) * channels;
      double d_sum = 0.0, variance = 0.0, pixel_error = 0.0, pixel_smape = 0.0, pixel_a = 0.0, pixel_reference = 0.0;
      for (size_t c = 0; c < channels; ++c) {
        const double value = a.pixels[at + c], r = reference.pixels[at + c], d = value - r;
        d_sum += d;
        pixel_a += value;
        pixel_reference += r;
        pixel_error += d * d / (r * r + 0.01);
        if (d != 0.0) pixel_smape += std::fabs(d) / (std::fabs(value) + std::fabs(r));
        if (std::fabs(d) > result.max_error) {
          result.max_error = std::fabs(d);
          result.max_error_x = x;
          result.max_error_y = y;
        }
        if (with_variances) variance += double(variance_a->pixels[at + c]) + double(variance_reference->pixels[at + c]);
      }
      if (!std::isfinite(pixel_error) || !std::isfinite(d_sum)) {
        ++result.non_finite;
        continue;
      }
      error_sum += pixel_error;
      pixel_errors.push_back(pixel_error);
      smape_sum += pixel_smape;
      sum_a += pixel_a;
      sum_reference += pixel_reference;
      values += channels;
      TileSums& tile = tiles[static_cast<size_t>(y / options.tile_px) * tiles_x + x / options.tile_px];
      const double d = d_sum / static_cast<double>(channels);
      ++tile.pixels;
      tile.sum += d;
      tile.sum_squares += d * d;
      tile.variance += variance / static_cast<double>(channels * channels);
    }
  if (values) {
    result.rel_mse = error_sum / static_cast<double>(values);
    result.smape = smape_sum / static_cast<double>(values);
    const size_t kept = pixel_errors.size() - pixel_errors.size() / 1000;
    std::nth_element(pixel_errors.begin(), pixel_errors.begin() + static_cast<std::ptrdiff_t>(kept) - 1,
                     pixel_errors.end());
    double kept_sum = 0.0;
    for (size_t i = 0; i < kept; ++i) kept_sum += pixel_errors[i];
    result.rel_mse_trimmed = kept_sum / static_cast<double>(kept * channels);
  }
  if (sum_a != sum_reference) result.mean_ratio = sum_a / sum_reference;

  const double threshold = options.significance / static_cast<double>(tiles.size());
  for (size_t i = 0; i < tiles.size(); ++i) {
    if (tiles[i].pixels == 0) continue;
    ++result.tiles;
    const TileDifference tile = judge(tiles[i], with_variances, static_cast<int>(i % tiles_x) * options.tile_px,
                                      static_cast<int>(i / tiles_x) * options.tile_px);
    if (tile.p_value >= threshold) continue;
    ++result.failed_tiles;
    result.worst_tiles.push_back(tile);
  }
  std::stable_sort(
      result.worst_tiles.begin(), result.worst_tiles.end(), [](const TileDifference& l, const TileDifference& r) {
        return l.p_value != r.p_value ? l.p_value < r.p_value : std::fabs(l.difference) > std::fabs(r.difference);
      });
  if (result.worst_tiles.size() > 10) result.worst_tiles.resize(10);
  return result;
}

}  // namespace lambent
