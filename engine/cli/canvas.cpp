#include "engine/cli/canvas.h"

#include <algorithm>
#include <cmath>

#include "engine/cli/letters.h"
#include "engine/film/picture_writer.h"

namespace lambent {

Canvas::Canvas(int width, int height, const Vec3& paper)
    : width_(width), height_(height), pixels_(static_cast<size_t>(width) * height, paper) {}

void Canvas::fill(int x, int y, int width, int height, const Vec3& ink) {
  for (int row = std::max(y, 0); row < std::min(y + height, height_); ++row)
    for (int column = std::max(x, 0); column < std::min(x + width, width_); ++column) pixel(column, row) = ink;
}

void Canvas::line(double x0, double y0, double x1, double y1, double thickness, const Vec3& ink) {
  const double dx = x1 - x0, dy = y1 - y0, length_squared = dx * dx + dy * dy, reach = thickness / 2 + 1;
  const auto low = [&](double a, double b) { return static_cast<int>(std::floor(std::min(a, b) - reach)); };
  const auto high = [&](double a, double b) { return static_cast<int>(std::ceil(std::max(a, b) + reach)); };
  for (int y = std::max(low(y0, y1), 0); y < std::min(high(y0, y1), height_); ++y)
    for (int x = std::max(low(x0, x1), 0); x < std::min(high(x0, x1), width_); ++x) {
      const double px = x + 0.5 - x0, py = y + 0.5 - y0;
      const double t = length_squared > 0.0 ? std::clamp((px * dx + py * dy) / length_squared, 0.0, 1.0) : 0.0;
      const double distance = std::hypot(px - t * dx, py - t * dy);
      const auto coverage = static_cast<float>(std::clamp(thickness / 2 - distance + 0.5, 0.0, 1.0));
      pixel(x, y) = pixel(x, y) * (1.0f - coverage) + ink * coverage;
    }
}

void Canvas::text(int x, int y, const std::string& text, const Vec3& ink, int scale) {
  for (const char letter : text) {
    const uint8_t* columns = k_letters[(letter < ' ' || letter > '~' ? '?' : letter) - ' '];
    for (int column = 0; column < 5; ++column)
      for (int row = 0; row < k_letter_height; ++row)
        if (columns[column] >> row & 1) fill(x + column * scale, y + row * scale, scale, scale, ink);
    x += 6 * scale;
  }
}

int Canvas::text_width(const std::string& text, int scale) {
  return text.empty() ? 0 : (6 * static_cast<int>(text.size()) - 1) * scale;
}

void Canvas::picture(int x, int y, int width, int height, const ImageLayer& picture, float factor) {
  const size_t channels = picture.channels.size();
  const double step_x = double(picture.width) / width, step_y = double(picture.height) / height;
  const auto value = [&](int column, int row) {
    const float* from = &picture.pixels[(static_cast<size_t>(row) * picture.width + column) * channels];
    const Vec3 color = channels >= 3 ? Vec3(from[0], from[1], from[2]) : Vec3(from[0]);
    if (!std::isfinite(color.x + color.y + color.z)) return Vec3(1, 0, 1);
    const auto clip = [&](float c) { return std::clamp(c * factor, 0.0f, 1.0f); };
    return Vec3(clip(color.x), clip(color.y), clip(color.z));
  };
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      if (!inside(x + column, y + row)) continue;
      Vec3 sum(0.0f);
      float area = 0.0f;
      const double top = row * step_y, left = column * step_x;
      for (int py = static_cast<int>(top); py < std::min<double>(picture.height, top + step_y); ++py)
        for (int px = static_cast<int>(left); px < std::min<double>(picture.width, left + step_x); ++px) {
          const double covered = (std::min(py + 1.0, top + step_y) - std::max<double>(py, top)) *
                                 (std::min(px + 1.0, left + step_x) - std::max<double>(px, left));
          sum = sum + value(px, py) * static_cast<float>(covered);
          area += static_cast<float>(covered);
        }
      pixel(x + column, y + row) = sum * (1.0f / area);
    }
}

Status Canvas::write_png(const std::string& path) const {
  std::vector<float> values;
  values.reserve(pixels_.size() * 3);
  for (int y = height_ - 1; y >= 0; --y)
    for (int x = 0; x < width_; ++x) {
      const Vec3& color = at(x, y);
      values.insert(values.end(), {color.x, color.y, color.z});
    }
  const Channel channels[] = {{"combined", 3}};
  return write_picture(path, {width_, height_, {0, 0, width_, height_}, channels, values, {}});
}

}  // namespace lambent
