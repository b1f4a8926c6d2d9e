// Pictures rendered in independent batches (seeds), summed up by tiles: what Welch's test compares.
#pragma once

#include <string>
#include <vector>

#include "tests/common/scene_maker.h"

namespace lambent::test {

/// Means of a picture's parts over batches. A part is a tile of k_tile_px² pixels (sum of R, G and B), and last come R,
/// G, B and alpha over the whole region.
struct BatchMeans {
  static constexpr int k_tile_px = 8;
  std::vector<std::string> names;           ///< by part
  std::vector<std::vector<double>> values;  ///< by part and batch
  uint64_t non_finite = 0;                  ///< samples and splats that the film refused
};

/// Renders `maker` `batches` times with integrator `name`, seeds first_seed, first_seed + 1, ... On one thread.
BatchMeans render_batches(SceneMaker maker, const std::string& name, int batches, uint32_t first_seed);

/// Expects the same expectations from both: no part differs in Welch's test, at a significance such that `comparisons`
/// of them together reject wrongly with probability 0.01. Failures name `what`, the part, both means and t.
void expect_same(const BatchMeans& found, const BatchMeans& reference, int comparisons, const std::string& what);

}  // namespace lambent::test
