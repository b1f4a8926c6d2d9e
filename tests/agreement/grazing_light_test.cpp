// Merging on lobes that have no cosine (toon, hair): photons of light that grazes the surface are rare there, and yet
// count as much as others.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "engine/integrators/bidirectional/grazing_reach.h"
#include "tests/common/scene_maker.h"

namespace lambent::test {
namespace {

using description::Numbers;

/// A floor that fills the picture and reflects all of an even world: 1 in every pixel.
SceneMaker floor_under_the_sky(description::Graph floor) {
  SceneMaker maker(32, 32, 256);
  maker.material("floor", std::move(floor));
  maker.mesh("floor", {{-3, -3, -4}, {3, -3, -4}, {3, 3, -4}, {-3, 3, -4}}, {{0, 1, 2}, {0, 2, 3}}, "floor");
  maker.world(background(Color(1.0f)));
  maker.settings.merge_radius_px = 3.0f;
  maker.settings.merge_alpha = 1.0f;
  return maker;
}

struct Spread {
  double mean = 0.0, deviation = 0.0, largest = 0.0;
};
Spread spread_of(SceneMaker maker, const char* integrator) {
  maker.settings.integrator = integrator;
  const Picture picture = render(maker.transaction());
  const double count = static_cast<double>(picture.pixels.size()) / 4.0;
  Spread spread;
  double squares = 0.0;
  for (size_t i = 0; i < picture.pixels.size(); i += 4) {
    const double value = static_cast<double>(picture.pixels[i]);
    spread.mean += value / count;
    squares += value * value / count;
    spread.largest = std::max(spread.largest, value);
  }
  spread.deviation = std::sqrt(std::max(0.0, squares - spread.mean * spread.mean));
  return spread;
}

TEST(GrazingLight, is_merged_on_toon_with_no_more_noise_than_on_lambert) {
  // A cone of the whole hemisphere: the radiance from every side counts alike.
  const description::Graph toon =
      single("BsdfToon", {{"Color", Numbers{1, 1, 1, 1}}, {"Size", 1.0f}, {"Smooth", 0.0f}});
  for (const char* integrator : {"PPM", "BPM"}) {
    const Spread lambert = spread_of(floor_under_the_sky(diffuse(Color(1.0f))), integrator);
    const Spread even = spread_of(floor_under_the_sky(toon), integrator);
    EXPECT_NEAR(even.mean, 1.0, 0.02) << integrator;  // one map serves all pixels: their mean has its noise
    // Dividing by the cosine gives twice Lambert's deviation, and pixels twelve of Lambert's deviations too bright.
    EXPECT_LT(even.deviation, 1.2 * lambert.deviation) << integrator;
    EXPECT_LT(even.largest - even.mean, 6.0 * lambert.deviation) << integrator;
  }
}

TEST(GrazingLight, reach_is_the_area_that_photons_are_looked_for_in) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-bidirectional::k_longest_reach, bidirectional::k_longest_reach);
  constexpr int k_trials = 1 << 20;
  const double square = std::pow(2.0 * bidirectional::k_longest_reach, 2);
  for (const double c : {1.0, 0.5, 0.26, 0.24, 0.1, 0.01}) {
    int found = 0;
    for (int i = 0; i < k_trials; ++i) {
      const double x = place(random), y = place(random);
      found += x * x + y * y < square / 4.0 && c * c * x * x + y * y < 1.0;
    }
    const double share = static_cast<double>(found) / k_trials, error = std::sqrt(share * (1.0 - share) / k_trials);
    const double to_reach = square * c / 3.14159265358979;
    EXPECT_NEAR(bidirectional::reach_across(static_cast<float>(c)), share * to_reach, 4.5 * error * to_reach + 1e-5)
        << c;
  }
  EXPECT_GT(bidirectional::reach_across(1e-6f), 0.0f);
}

}  // namespace
}  // namespace lambent::test
