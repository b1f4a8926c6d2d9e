#include "engine/cli/error_curves.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

namespace lambent {
namespace {

constexpr const char* k_head =
    "integrator,time_limit_s,sample_limit,seed,samples,render_s,cpu_s,rel_mse,rel_mse_trimmed,smape,non_finite";

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line)
    if (c == ',')
      cells.emplace_back();
    else if (c != '\r')
      cells.back().push_back(c);
  return cells;
}

template <typename T>
bool parse(const std::string& text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

bool parse(const std::vector<std::string>& cells, CurvePoint& point) {
  if (cells.size() != 11 || cells[0].empty()) return false;
  point.integrator = cells[0];
  return parse(cells[1], point.time_limit_s) && parse(cells[2], point.sample_limit) && parse(cells[3], point.seed) &&
         parse(cells[4], point.samples) && parse(cells[5], point.render_s) && parse(cells[6], point.cpu_s) &&
         parse(cells[7], point.rel_mse) && parse(cells[8], point.rel_mse_trimmed) && parse(cells[9], point.smape) &&
         parse(cells[10], point.non_finite);
}

/// Linear interpolation in logarithms: y at x between (x0, y0) and (x1, y1).
double interpolate(double x, double x0, double y0, double x1, double y1) {
  if (x0 == x1) return y1;
  const double t = (std::log(x) - std::log(x0)) / (std::log(x1) - std::log(x0));
  return std::exp(std::log(y0) + t * (std::log(y1) - std::log(y0)));
}

}  // namespace

std::string csv_text(std::span<const CurvePoint> points) {
  std::string text = fmt::format("{}\n", k_head);
  for (const CurvePoint& p : points)
    text += fmt::format("{},{},{},{},{},{:.6f},{:.6f},{:.9g},{:.9g},{:.9g},{}\n", p.integrator, p.time_limit_s,
                        p.sample_limit, p.seed, p.samples, p.render_s, p.cpu_s, p.rel_mse, p.rel_mse_trimmed, p.smape,
                        p.non_finite);
  return text;
}

Result<std::vector<CurvePoint>> read_csv(const std::string& path) {
  std::ifstream file(path);
  if (!file) return Error{fmt::format("The curves '{}' cannot be read", path)};
  std::vector<CurvePoint> points;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    if (number == 1) {
      if (split(line) != split(k_head)) return Error{fmt::format("'{}' has not the head line '{}'", path, k_head)};
      continue;
    }
    if (line.empty()) continue;
    if (CurvePoint point; parse(split(line), point))
      points.push_back(point);
    else
      return Error{fmt::format("'{}', line {}: not one name and nine numbers", path, number)};
  }
  return points;
}

std::vector<ErrorCurve> curves_of(std::span<const CurvePoint> points, Clock clock, ErrorMeasure measure) {
  struct Mean {
    double time_limit_s = 0.0, time_s = 0.0, error = 0.0;
    int64_t sample_limit = 0;
    int count = 0;
  };
  std::vector<ErrorCurve> curves;
  std::vector<std::vector<Mean>> means;
  for (const CurvePoint& point : points) {
    const auto of =
        std::find_if(curves.begin(), curves.end(), [&](const auto& c) { return c.integrator == point.integrator; });
    const auto index = static_cast<size_t>(of - curves.begin());
    if (of == curves.end()) {
      curves.push_back({point.integrator, {}, {}});
      means.emplace_back();
    }
    const auto same = [&](const Mean& m) {
      return m.time_limit_s == point.time_limit_s && m.sample_limit == point.sample_limit;
    };
    auto mean = std::find_if(means[index].begin(), means[index].end(), same);
    if (mean == means[index].end())
      mean = means[index].insert(mean, {point.time_limit_s, 0.0, 0.0, point.sample_limit, 0});
    mean->time_s += clock == Clock::cpu ? point.cpu_s : point.render_s;
    mean->error += measure == ErrorMeasure::smape     ? point.smape
                   : measure == ErrorMeasure::rel_mse ? point.rel_mse
                                                      : point.rel_mse_trimmed;
    ++mean->count;
  }
  for (size_t i = 0; i < curves.size(); ++i) {
    std::stable_sort(means[i].begin(), means[i].end(),
                     [](const Mean& a, const Mean& b) { return a.time_s / a.count < b.time_s / b.count; });
    for (const Mean& mean : means[i])
      if (mean.time_s > 0.0 && mean.error > 0.0) {
        curves[i].time_s.push_back(mean.time_s / mean.count);
        curves[i].error.push_back(mean.error / mean.count);
      }
  }
  std::erase_if(curves, [](const ErrorCurve& curve) { return curve.time_s.empty(); });
  return curves;
}

std::optional<double> error_at(const ErrorCurve& curve, double time_s) {
  if (time_s < curve.time_s.front() || time_s > curve.time_s.back()) return std::nullopt;
  const auto next = std::lower_bound(curve.time_s.begin(), curve.time_s.end(), time_s);
  const auto i = static_cast<size_t>(next - curve.time_s.begin());
  if (i == 0) return curve.error.front();
  return interpolate(time_s, curve.time_s[i - 1], curve.error[i - 1], curve.time_s[i], curve.error[i]);
}

std::optional<double> time_to(const ErrorCurve& curve, double error) {
  for (size_t i = 0; i < curve.error.size(); ++i) {
    if (curve.error[i] > error) continue;
    if (i == 0) return curve.time_s.front();
    return interpolate(error, curve.error[i - 1], curve.time_s[i - 1], curve.error[i], curve.time_s[i]);
  }
  return std::nullopt;
}

SpeedUp speed_up(const ErrorCurve& curve, const ErrorCurve& baseline) {
  SpeedUp result;
  result.integrator = curve.integrator;
  result.time_s = std::min(curve.time_s.back(), baseline.time_s.back());
  const auto own = error_at(curve, result.time_s), other = error_at(baseline, result.time_s);
  if (own && other) result.error_ratio = *other / *own;
  const auto lowest = [](const ErrorCurve& of) { return *std::min_element(of.error.begin(), of.error.end()); };
  result.error = std::max(lowest(curve), lowest(baseline));
  const double own_s = *time_to(curve, result.error), other_s = *time_to(baseline, result.error);
  result.time_ratio = other_s / own_s;
  // A curve that begins below took less time than its first point says.
  if (curve.error.front() < result.error) result.time_bound = Bound::at_least;
  if (baseline.error.front() < result.error) result.time_bound = Bound::at_most;
  return result;
}

}  // namespace lambent
