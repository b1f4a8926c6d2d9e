// `lambent diff`.
#include <fmt/format.h>

#include <optional>

#include "engine/cli/commands.h"
#include "engine/cli/image_comparison.h"

namespace lambent {
namespace {

struct DiffOptions {
  std::string a, reference, layer, variance_a, variance_reference;
  double threshold = 0.0;
  std::optional<double> failing_tiles;
  ComparisonOptions comparison;
};

int diff(const DiffOptions& options) {
  const auto a = read_image_layer(options.a, options.layer);
  const auto reference = read_image_layer(options.reference, options.layer);
  for (const auto* image : {&a, &reference})
    if (!*image) {
      std::fprintf(stderr, "lambent: %s\n", image->error().c_str());
      return 2;
    }
  const auto same_form = [](const ImageLayer& l, const ImageLayer& r) {
    return l.width == r.width && l.height == r.height && l.channels.size() == r.channels.size();
  };
  if (!same_form(*a, *reference)) {
    std::fprintf(stderr,
                 "lambent: the images differ in form: '%s' is %d x %d with %zu channels, '%s' %d x %d with %zu\n",
                 options.a.c_str(), a->width, a->height, a->channels.size(), options.reference.c_str(),
                 reference->width, reference->height, reference->channels.size());
    return 2;
  }
  std::optional<ImageLayer> variance_a, variance_reference;
  if (!options.variance_a.empty()) {
    auto first = read_image_layer(options.variance_a, options.layer);
    auto second = read_image_layer(options.variance_reference, options.layer);
    for (const auto* image : {&first, &second})
      if (!*image || !same_form(**image, *reference)) {
        std::fprintf(stderr, "lambent: %s\n",
                     *image ? "a variance image has another form than the images" : image->error().c_str());
        return 2;
      }
    variance_a = std::move(*first);
    variance_reference = std::move(*second);
  }
  const ImageComparison found = compare_images(*a, *reference, options.comparison, variance_a ? &*variance_a : nullptr,
                                               variance_a ? &*variance_reference : nullptr);
  fmt::print("relMSE      {:.6g}\nSMAPE       {:.6g}\nmean ratio  {:.6f}\nmax error   {:.6g} at ({}, {})\n",
             found.rel_mse, found.smape, found.mean_ratio, found.max_error, found.max_error_x, found.max_error_y);
  fmt::print("tiles       {} of {} differ ({} x {} px, significance {} in all)\n", found.failed_tiles, found.tiles,
             options.comparison.tile_px, options.comparison.tile_px, options.comparison.significance);
  for (const TileDifference& tile : found.worst_tiles)
    fmt::print("            ({}, {}): mean differs by {:+.4g}, p = {:.3g}\n", tile.x, tile.y, tile.difference,
               tile.p_value);
  if (found.non_finite) fmt::print("not finite  {} pixels\n", found.non_finite);
  const bool tiles_differ = options.failing_tiles && static_cast<double>(found.failed_tiles) >
                                                         *options.failing_tiles * static_cast<double>(found.tiles);
  return found.rel_mse > options.threshold || tiles_differ || found.non_finite ? 1 : 0;
}

}  // namespace

Command add_diff_command(CLI::App& program) {
  const auto options = std::make_shared<DiffOptions>();
  CLI::App* app = program.add_subcommand("diff", "Compare two images; the second is the reference");
  app->add_option("image", options->a, "Image")->required();
  app->add_option("reference", options->reference, "Image to compare with")->required();
  app->add_option("--threshold", options->threshold, "Largest relMSE that counts as the same")
      ->check(CLI::NonNegativeNumber);
  app->add_option("--failing-tiles", options->failing_tiles,
                  "Largest fraction of tiles whose means may differ significantly")
      ->check(CLI::Range(0.0, 1.0));
  app->add_option("--tile", options->comparison.tile_px, "Side of a tile in pixels")
      ->check(CLI::Range(2, 65536))
      ->capture_default_str();
  app->add_option("--significance", options->comparison.significance, "Of the test of all tiles together")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app->add_option("--layer", options->layer, "Pass to compare; default: the main picture");
  CLI::Option* first = app->add_option("--variance", options->variance_a, "Variance of the image's pixels (an image)");
  CLI::Option* second =
      app->add_option("--reference-variance", options->variance_reference, "Variance of the reference's pixels");
  first->needs(second);
  second->needs(first);
  return {app, [options] { return diff(*options); }};
}

}  // namespace lambent
