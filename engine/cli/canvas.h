// A picture to draw plots and contact sheets on: rectangles, lines, small letters, rendered pictures.
#pragma once

#include <string>
#include <vector>

#include "engine/base/result.h"
#include "engine/base/vec.h"
#include "engine/cli/image_file.h"

namespace lambent {

/// Coordinates are pixels, (0, 0) the upper left corner. Colours are linear, 0 to 1. What lies outside is not drawn.
class Canvas {
 public:
  Canvas(int width, int height, const Vec3& paper);

  int width() const { return width_; }
  int height() const { return height_; }
  const Vec3& at(int x, int y) const { return pixels_[static_cast<size_t>(y) * width_ + x]; }

  void fill(int x, int y, int width, int height, const Vec3& ink);
  /// A line with round ends, its edges smoothed over a pixel.
  void line(double x0, double y0, double x1, double y1, double thickness, const Vec3& ink);
  /// Writes printable ASCII (all else as '?'), its upper left corner at (x, y), letters 5 x 7 px times `scale` large.
  void text(int x, int y, const std::string& text, const Vec3& ink, int scale = 1);
  /// Width of what text() writes.
  static int text_width(const std::string& text, int scale = 1);
  static constexpr int k_letter_height = 7;

  /// Draws a scene-linear picture of one or three channels into a rectangle: times `factor`, clipped to [0, 1], then
  /// averaged over each pixel's area, so that one bright pixel does not brighten its neighbours. Values that are not
  /// finite are drawn in magenta.
  void picture(int x, int y, int width, int height, const ImageLayer& picture, float factor);

  /// Writes a PNG (sRGB). Fails naming the file.
  Status write_png(const std::string& path) const;

 private:
  bool inside(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }
  Vec3& pixel(int x, int y) { return pixels_[static_cast<size_t>(y) * width_ + x]; }

  int width_, height_;
  std::vector<Vec3> pixels_;  ///< [height][width], row 0 at the top
};

}  // namespace lambent
