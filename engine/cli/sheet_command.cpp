// `lambent sheet`: a contact sheet.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/cli/canvas.h"
#include "engine/cli/commands.h"
#include "engine/cli/interruption.h"

namespace lambent {
namespace {

constexpr int k_gap = 4, k_label = 22;
constexpr int k_largest_px = 30000;

struct SheetOptions {
  std::string output;
  std::vector<std::string> pictures, columns, rows, captions;
  int width = 240;
  double exposure = 0.0;
};

int sheet(const SheetOptions& options) {
  const size_t columns = options.columns.size(), rows = options.rows.size();
  if (options.pictures.size() != columns * rows) {
    say(fmt::format("{} pictures do not fill {} columns and {} rows; '-' leaves a place empty", options.pictures.size(),
                    columns, rows));
    return 2;
  }
  if (!options.captions.empty() && options.captions.size() != options.pictures.size()) {
    say(fmt::format("{} captions for {} pictures", options.captions.size(), options.pictures.size()));
    return 2;
  }
  std::vector<std::optional<ImageLayer>> images;
  for (const std::string& path : options.pictures) {
    images.emplace_back();
    if (path == "-") continue;
    auto image = read_image_layer(path, "");
    if (!image) {
      say(image.error());
      return 1;
    }
    images.back() = std::move(*image);
  }
  // A row is as high as its highest picture at the common width.
  std::vector<int> heights(rows, options.width / 4);
  int total_height = k_label;
  for (size_t row = 0; row < rows; ++row) {
    for (size_t column = 0; column < columns; ++column)
      if (const auto& image = images[row * columns + column])
        heights[row] =
            std::max(heights[row], static_cast<int>(std::lround(double(options.width) * image->height / image->width)));
    total_height += heights[row] + k_label + k_gap;
  }
  const int total_width = static_cast<int>(columns) * (options.width + k_gap) + k_gap;
  if (total_width > k_largest_px || total_height > k_largest_px) {
    say(fmt::format("A sheet of {} x {} px is too large; make --width smaller", total_width, total_height));
    return 2;
  }
  Canvas canvas(total_width, total_height, Vec3(0.02f));
  const Vec3 bright(0.85f), dim(0.35f);
  const auto factor = static_cast<float>(std::exp2(options.exposure));
  for (size_t column = 0; column < columns; ++column)
    canvas.text(k_gap + static_cast<int>(column) * (options.width + k_gap), 4, options.columns[column], bright, 2);
  int y = k_label;
  for (size_t row = 0; row < rows; ++row) {
    for (size_t column = 0; column < columns; ++column) {
      const size_t index = row * columns + column;
      const int x = k_gap + static_cast<int>(column) * (options.width + k_gap);
      if (const auto& image = images[index])
        canvas.picture(x, y, options.width,
                       static_cast<int>(std::lround(double(options.width) * image->height / image->width)), *image,
                       factor);
      const int below = y + heights[row] + 5;
      if (column == 0) canvas.text(x, below, options.rows[row], bright, 1);
      if (!options.captions.empty() && options.captions[index] != "-")
        canvas.text(x + options.width - Canvas::text_width(options.captions[index]), below, options.captions[index],
                    dim, 1);
    }
    y += heights[row] + k_label + k_gap;
  }
  if (const Status written = canvas.write_png(options.output); !written) {
    say(written.error());
    return 1;
  }
  return 0;
}

}  // namespace

Command add_sheet_command(CLI::App& program) {
  const auto options = std::make_shared<SheetOptions>();
  CLI::App* app = program.add_subcommand("sheet", "Put pictures beside each other on a labelled contact sheet");
  app->add_option("pictures", options->pictures, "Scene-linear images row by row; '-': an empty place")->required();
  app->add_option("-o,--output", options->output, "PNG to write")->required();
  app->add_option("--columns", options->columns, "Labels of the columns")
      ->allow_extra_args(false)
      ->delimiter(',')
      ->required();
  app->add_option("--rows", options->rows, "Labels of the rows")->allow_extra_args(false)->delimiter(',')->required();
  app->add_option("--captions", options->captions, "A short text below each picture; '-': none")
      ->allow_extra_args(false)
      ->delimiter(',');
  app->add_option("--width", options->width, "Width of each picture in pixels")
      ->check(CLI::Range(16, 4096))
      ->capture_default_str();
  app->add_option("--exposure", options->exposure, "Stops brighter")->check(CLI::Range(-20.0, 20.0));
  return {app, [options] { return sheet(*options); }};
}

}  // namespace lambent
