#include "engine/cli/canvas.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

namespace lambent {
namespace {

int inked(const Canvas& canvas) {
  int count = 0;
  for (int y = 0; y < canvas.height(); ++y)
    for (int x = 0; x < canvas.width(); ++x) count += canvas.at(x, y).x > 0.5f;
  return count;
}

TEST(Canvas, every_printable_letter_has_a_shape_of_its_own_within_its_cell) {
  std::vector<std::vector<float>> shapes;
  for (char letter = '!'; letter <= '~'; ++letter) {
    Canvas canvas(7, 9, Vec3(0.0f));
    canvas.text(1, 1, std::string(1, letter), Vec3(1.0f));
    std::vector<float> shape;
    for (int y = 0; y < 9; ++y)
      for (int x = 0; x < 7; ++x) {
        if (x == 0 || x == 6 || y == 0 || y == 8) {
          EXPECT_EQ(canvas.at(x, y).x, 0.0f) << letter;
        }
        shape.push_back(canvas.at(x, y).x);
      }
    EXPECT_GT(inked(canvas), 1) << letter;
    EXPECT_EQ(std::count(shapes.begin(), shapes.end(), shape), 0) << letter;
    shapes.push_back(shape);
  }
}

TEST(Canvas, text_is_as_wide_as_it_says) {
  Canvas canvas(100, 20, Vec3(0.0f));
  canvas.text(0, 0, "HH", Vec3(1.0f), 2);
  const int width = Canvas::text_width("HH", 2);
  int last = 0;
  for (int x = 0; x < 100; ++x)
    for (int y = 0; y < 20; ++y)
      if (canvas.at(x, y).x > 0) last = x;
  EXPECT_EQ(last + 1, width);
  EXPECT_EQ(Canvas::text_width(""), 0);
}

TEST(Canvas, a_line_has_its_length_times_its_thickness) {
  Canvas canvas(100, 100, Vec3(0.0f));
  canvas.line(20, 30, 80, 70, 3.0, Vec3(1.0f));
  double area = 0.0;
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 100; ++x) area += canvas.at(x, y).x;
  EXPECT_NEAR(area, std::hypot(60, 40) * 3.0 + 3.1416 * 1.5 * 1.5, 2.0);
  canvas.line(-50, -50, 200, 300, 2.0, Vec3(1.0f));  // leaves the canvas
}

TEST(Canvas, a_picture_is_clipped_before_it_is_averaged) {
  Canvas canvas(4, 4, Vec3(0.0f));
  ImageLayer picture{4, 4, {"R", "G", "B"}, std::vector<float>(48, 0.25f)};
  picture.pixels[0] = 1000.0f;  // red of the upper left pixel
  picture.pixels[3 * 3 + 1] = std::numeric_limits<float>::quiet_NaN();
  canvas.picture(1, 1, 2, 2, picture, 2.0f);
  EXPECT_NEAR(canvas.at(1, 1).x, (1.0f + 3 * 0.5f) / 4, 1e-6);
  EXPECT_NEAR(canvas.at(1, 1).y, 0.5f, 1e-6);
  EXPECT_NEAR(canvas.at(2, 1).y, 3 * 0.5f / 4, 1e-6);  // magenta has no green
  EXPECT_EQ(canvas.at(0, 0).x, 0.0f);
  EXPECT_EQ(canvas.at(3, 3).x, 0.0f);
  EXPECT_NEAR(canvas.at(2, 2).x, 0.5f, 1e-6);
}

TEST(Canvas, a_png_that_cannot_be_written_is_named) {
  const Status failed = Canvas(2, 2, Vec3(0.5f)).write_png("/nonexistent/folder/a.png");
  ASSERT_FALSE(failed);
  EXPECT_NE(failed.error().find("/nonexistent/folder/a.png"), std::string::npos);
}

}  // namespace
}  // namespace lambent
