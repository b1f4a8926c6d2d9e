// How fast errors fall: the slope of log RMSE over log samples, against a reference many times longer. Minutes; not a
// test of every run.
//
//   convergence_slopes [CASE [LONGEST [SEEDS]]]    a case of integrator_scenes.h (lobe_rough_diffuse), samples (256), 4
//
// Unbiased integrators and VCM should show -0.50; PPM, whose radius shrinks by k^((alpha - 1) / 2) with alpha 0.75,
// from -0.25 where its bias rules to -0.375 where its noise does (Knaus & Zwicker 2011). The reference is BPT with 16
// times the longest run's samples.
#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "tests/agreement/integrator_scenes.h"

namespace lambent::test {
namespace {

double mean_square_error(const Picture& picture, const Picture& reference) {
  double sum = 0.0;
  size_t count = 0;
  for (size_t i = 0; i < picture.pixels.size(); ++i) {
    if (i % 4 == 3) continue;
    const double error = static_cast<double>(picture.pixels[i]) - static_cast<double>(reference.pixels[i]);
    sum += error * error;
    ++count;
  }
  return sum / static_cast<double>(count);
}

/// Least squares through (log2 samples, log2 error).
double slope(const std::vector<std::pair<double, double>>& points) {
  double x_mean = 0.0, y_mean = 0.0, xy = 0.0, xx = 0.0;
  for (const auto& [x, y] : points) x_mean += x / points.size(), y_mean += y / points.size();
  for (const auto& [x, y] : points) xy += (x - x_mean) * (y - y_mean), xx += (x - x_mean) * (x - x_mean);
  return xy / xx;
}

int run(const std::string& name, int longest, int seeds) {
  for (IntegratorCase& one : integrator_cases()) {
    if (one.name != name) continue;
    SceneMaker& maker = one.maker;
    maker.settings.width = maker.settings.height = 24;
    maker.settings.merge_radius_px = 2.0f;
    maker.settings.integrator = "BPT";
    maker.settings.samples = 16 * longest;
    maker.settings.seed = 99999;
    const Picture reference = render(maker.transaction());
    fmt::print("{}: RMSE over samples, mean of {} seeds\n", name, seeds);
    for (const char* integrator : {"PT", "BPT", "VCM", "PPM"}) {
      maker.settings.integrator = integrator;
      std::vector<std::pair<double, double>> points;
      fmt::print("{:4}", integrator);
      for (int samples = 4; samples <= longest; samples *= 2) {
        double error = 0.0;
        for (int seed = 0; seed < seeds; ++seed) {
          maker.settings.samples = samples;
          maker.settings.seed = static_cast<uint32_t>(seed);
          error += mean_square_error(render(maker.transaction()), reference) / seeds;
        }
        points.emplace_back(std::log2(samples), 0.5 * std::log2(error));
        fmt::print("  {} {:.5f}", samples, std::sqrt(error));
        std::fflush(stdout);
      }
      const size_t half = points.size() / 2;
      fmt::print("  slope {:.3f}, second half {:.3f}\n", slope(points),
                 slope({points.begin() + static_cast<std::ptrdiff_t>(half), points.end()}));
    }
    return 0;
  }
  fmt::print(stderr, "convergence_slopes: there is no case '{}'\n", name);
  return 1;
}

}  // namespace
}  // namespace lambent::test

int main(int argc, char** argv) {
  return lambent::test::run(argc > 1 ? argv[1] : "lobe_rough_diffuse", argc > 2 ? std::atoi(argv[2]) : 256,
                            argc > 3 ? std::atoi(argv[3]) : 4);
}
