// Error against time: what `lambent measure` measures, as CSV and as ratios to a baseline.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/result.h"

namespace lambent {

/// One render of the measured scene.
struct CurvePoint {
  std::string integrator;     ///< or the name of another renderer
  double time_limit_s = 0.0;  ///< what it was asked for: seconds by the clock,
  int64_t sample_limit = 0;   ///< or samples a pixel; 0 where the other one is given
  uint32_t seed = 0;
  int64_t samples = 0;           ///< samples that every pixel got
  double render_s = 0.0;         ///< wall time without building the scene
  double cpu_s = 0.0;            ///< of all threads meanwhile
  double rel_mse = 0.0;          ///< as ImageComparison
  double rel_mse_trimmed = 0.0;  ///< as ImageComparison
  double smape = 0.0;            ///< as ImageComparison
  uint64_t non_finite = 0;       ///< pixels left out of all
};

/// A head line and one line a point.
std::string csv_text(std::span<const CurvePoint> points);
/// Reads what csv_text wrote. Fails naming the file and line.
Result<std::vector<CurvePoint>> read_csv(const std::string& path);

enum class Clock : uint8_t { render, cpu };
enum class ErrorMeasure : uint8_t { rel_mse, rel_mse_trimmed, smape };

/// Error of one integrator by time: means over the seeds of each limit, by growing time. All values are positive.
struct ErrorCurve {
  std::string integrator;
  std::vector<double> time_s, error;
};

/// One curve for each integrator, in the order of their first points. A point whose time or mean error is 0 is left
/// out: it has no logarithm.
std::vector<ErrorCurve> curves_of(std::span<const CurvePoint> points, Clock clock, ErrorMeasure measure);

/// The error at a time by interpolation in logarithms; empty outside the times of the curve.
std::optional<double> error_at(const ErrorCurve& curve, double time_s);
/// The first time with an error this small; empty if it was never reached. Where already the first point is below, its
/// time, which is then too long.
std::optional<double> time_to(const ErrorCurve& curve, double error);

enum class Bound : uint8_t { none, at_least, at_most };

/// What an integrator gains over another.
struct SpeedUp {
  std::string integrator;
  double time_s = 0.0;                ///< the longest time that both have
  std::optional<double> error_ratio;  ///< error of the baseline over its own at that time; empty if no time is common
  double error = 0.0;                 ///< the lowest error that both reached
  double time_ratio = 0.0;            ///< time of the baseline to that error over its own
  Bound time_bound = Bound::none;     ///< where one was better with its first point already, the ratio is only a bound
};

/// Compares curves that have at least one point each.
SpeedUp speed_up(const ErrorCurve& curve, const ErrorCurve& baseline);

}  // namespace lambent
