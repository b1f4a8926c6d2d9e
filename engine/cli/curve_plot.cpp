#include "engine/cli/curve_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lambent {
namespace {

constexpr int k_width = 560, k_height = 420, k_left = 74, k_right = 16, k_top = 34, k_bottom = 50;

Vec3 srgb(int r, int g, int b) {
  const auto linear = [](int c) {
    const double x = c / 255.0;
    return static_cast<float>(x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4));  // IEC 61966-2-1
  };
  return {linear(r), linear(g), linear(b)};
}

/// Colours that are told apart by most eyes, in order of use (after Okabe and Ito 2008).
Vec3 color_of(size_t index) {
  static const Vec3 k_colors[] = {srgb(0, 0, 0),       srgb(213, 94, 0),  srgb(0, 114, 178),  srgb(0, 158, 115),
                                  srgb(204, 121, 167), srgb(230, 159, 0), srgb(86, 180, 233), srgb(120, 94, 60)};
  return k_colors[index % std::size(k_colors)];
}

/// A logarithmic axis from `low` to `high`, at least a factor of 2 apart.
struct Axis {
  double low = 1.0, high = 10.0;
  double position(double value) const { return std::log(value / low) / std::log(high / low); }
};

Axis axis_of(std::span<const ErrorCurve> curves, std::vector<double> ErrorCurve::*member) {
  double low = INFINITY, high = 0.0;
  for (const ErrorCurve& curve : curves)
    for (const double value : curve.*member) {
      low = std::min(low, value);
      high = std::max(high, value);
    }
  if (high == 0.0) return {};
  return {low / 1.15, std::max(high, 2.0 * low) * 1.15};
}

/// Marks at 1, 2 and 5 times powers of ten, only powers where these are many.
std::vector<double> marks_of(const Axis& axis) {
  const bool fine = axis.high / axis.low < 300.0;
  std::vector<double> marks;
  for (int power = static_cast<int>(std::floor(std::log10(axis.low))); power <= std::log10(axis.high); ++power)
    for (const double digit : {1.0, 2.0, 5.0})
      if (const double mark = digit * std::pow(10.0, power);
          (fine || digit == 1.0) && mark >= axis.low && mark <= axis.high)
        marks.push_back(mark);
  return marks;
}

void draw(Canvas& canvas, int x0, const Diagram& diagram, std::span<const std::string> integrators) {
  const Vec3 ink = srgb(60, 60, 60), faint = srgb(222, 222, 222);
  const Axis time = axis_of(diagram.curves, &ErrorCurve::time_s), error = axis_of(diagram.curves, &ErrorCurve::error);
  const int left = x0 + k_left, right = x0 + k_width - k_right, top = k_top, bottom = k_height - k_bottom;
  const auto x_of = [&](double t) { return left + (right - left) * time.position(t); };
  const auto y_of = [&](double e) { return bottom - (bottom - top) * error.position(e); };
  for (const double mark : marks_of(time)) {
    const std::string text = fmt::format("{:g}", mark);
    canvas.line(x_of(mark), top, x_of(mark), bottom, 1.0, faint);
    canvas.text(static_cast<int>(x_of(mark)) - Canvas::text_width(text, 1) / 2, bottom + 8, text, ink);
  }
  for (const double mark : marks_of(error)) {
    const std::string text = fmt::format("{:g}", mark);
    canvas.line(left, y_of(mark), right, y_of(mark), 1.0, faint);
    canvas.text(left - 8 - Canvas::text_width(text, 1), static_cast<int>(y_of(mark)) - 3, text, ink);
  }
  for (const auto& [x, y, to_x, to_y] : {std::array{left, top, left, bottom}, std::array{left, bottom, right, bottom}})
    canvas.line(x, y, to_x, to_y, 1.5, ink);
  canvas.text(left, 10, diagram.title, ink, 2);
  canvas.text(right - Canvas::text_width(diagram.time_label), bottom + 26, diagram.time_label, ink);
  int shown = 0;
  for (const ErrorCurve& curve : diagram.curves) {
    const auto found = std::find(integrators.begin(), integrators.end(), curve.integrator);
    if (found == integrators.end()) continue;
    const Vec3 color = color_of(static_cast<size_t>(found - integrators.begin()));
    for (size_t i = 0; i < curve.time_s.size(); ++i) {
      const double x = x_of(curve.time_s[i]), y = y_of(curve.error[i]);
      if (i > 0) canvas.line(x_of(curve.time_s[i - 1]), y_of(curve.error[i - 1]), x, y, 2.0, color);
      canvas.line(x, y, x, y, 6.0, color);
    }
    const int y = top + 6 + 13 * shown++, x = right - 100;
    canvas.fill(x - 4, y - 3, 104, 13, Vec3(1.0f));
    canvas.line(x, y + 3.5, x + 18, y + 3.5, 2.0, color);
    canvas.text(x + 26, y, curve.integrator, ink);
  }
}

}  // namespace

Canvas plot(std::span<const Diagram> diagrams, std::span<const std::string> integrators) {
  Canvas canvas(k_width * static_cast<int>(diagrams.size()), k_height, Vec3(1.0f));
  for (size_t i = 0; i < diagrams.size(); ++i) draw(canvas, k_width * static_cast<int>(i), diagrams[i], integrators);
  return canvas;
}

}  // namespace lambent
