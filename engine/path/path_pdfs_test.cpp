// Weights against their definition: every technique's density multiplied out in double precision.
#include "engine/path/path_pdfs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/sampling/sampler.h"

namespace lambent {
namespace {

/// Techniques by number: 0 emission hit, 1 next event, 2 light tracing, then connections m = 1 ... n-1, merging 1 ...
/// n.
struct Oracle {
  const PathPdfs& pdfs;
  const TechniqueSet& set;
  const TechniqueCounts& counts;
  const MergeReach& reach;

  bool flag(int i, uint8_t which) const { return (pdfs.flags[static_cast<size_t>(i)] & which) == which; }
  /// C_i, times what scatters that later vertices share count for.
  double camera(int i) const {
    const double shared = std::pow(static_cast<double>(counts.shared_scatter), set.merging ? 1.0 : 0.5);
    double product = 1.0;
    for (int j = 1; j <= i; ++j)
      product *= static_cast<double>(pdfs.camera[static_cast<size_t>(j)]) *
                 (j > 1 && flag(j - 1, k_connectible) ? shared : 1.0);
    return product;
  }
  /// L_i: 0 where no light walk gets.
  double light(int i) const {
    double product = 1.0;
    for (int j = i; j <= pdfs.n; ++j) {
      if (!flag(j, k_light_arrives) || (j > i && !flag(j, k_light_scatters))) return 0.0;
      product *= static_cast<double>(pdfs.light[static_cast<size_t>(j)]);
    }
    return product;
  }
  /// rho_i of Grittmann et al. 2021.
  double correlation(int i) const {
    if (!(reach.acceptance_area > 0.0f)) return 1.0;
    const double area = static_cast<double>(reach.acceptance_area);
    double from_camera = 1.0, from_light = std::min(static_cast<double>(pdfs.light_conditional) * area, 1.0);
    for (int j = 1; j <= i; ++j)
      from_camera *= std::min(static_cast<double>(pdfs.camera[static_cast<size_t>(j)]) * area, 1.0);
    for (int j = i; j < pdfs.n; ++j)
      from_light *= std::min(static_cast<double>(pdfs.light[static_cast<size_t>(j)]) * area, 1.0);
    const double either = from_camera + from_light - from_camera * from_light;
    return std::max(from_camera / either, 1.0 / static_cast<double>(counts.merge_paths));
  }
  double density(Technique technique, int vertex) const {
    const int n = pdfs.n;
    switch (technique) {
      case Technique::emission_hit:
        return set.emission ? camera(n) * static_cast<double>(pdfs.scatter) : 0.0;
      case Technique::next_event:
        return set.next_event && flag(n, k_connectible) ? camera(n) * static_cast<double>(pdfs.next_event) : 0.0;
      case Technique::light_tracing:
        return set.light_tracing && n >= set.first_light_tracing && flag(1, k_connectible | k_light_scatters) &&
                       n <= counts.max_light_vertices
                   ? light(1) * static_cast<double>(counts.light_paths)
                   : 0.0;
      case Technique::connection:
        return set.connections && flag(vertex, k_connectible) && flag(vertex + 1, k_connectible | k_light_scatters) &&
                       n - vertex <= counts.max_light_vertices
                   ? camera(vertex) * light(vertex + 1) *
                         static_cast<double>(pdfs.connections[static_cast<size_t>(vertex)])
                   : 0.0;
      case Technique::merging: {
        const int along_light = n - vertex + 1;
        return set.merging && flag(vertex, k_connectible) && vertex >= set.first_merge_camera &&
                       along_light >= set.first_merge_light && along_light <= counts.max_light_vertices
                   ? camera(vertex) * light(vertex) * static_cast<double>(reach.area) *
                         static_cast<double>(counts.merge_paths) * correlation(vertex)
                   : 0.0;
      }
      default:
        return 0.0;
    }
  }
};

/// Weights of techniques of these densities; the first two are the ends, emission hit and next event.
std::vector<double> defined_weights(std::vector<double> densities, bool merging) {
  if (!merging)
    for (double& density : densities) density *= density;
  double sum = 0.0;
  for (const double density : densities) sum += density;
  std::vector<double> weights;
  for (const double density : densities) weights.push_back(density / sum);
  if (merging && densities[0] + densities[1] > 0.0) {
    const double both = weights[0] + weights[1];
    const double squares = densities[0] * densities[0] + densities[1] * densities[1];
    for (const size_t end : {0, 1}) weights[end] = both * densities[end] * densities[end] / squares;
  }
  return weights;
}

/// A path as a scene might give it: densities over several orders of magnitude, some events delta, some surfaces that
/// light walks do not reach or leave.
PathPdfs random_path(RandomStream& random) {
  PathPdfs pdfs;
  const int n = 1 + static_cast<int>(random.next_1d() * 6.0f);
  pdfs.reserve(n);
  pdfs.n = n;
  const auto density = [&] { return std::exp(4.0f * (random.next_1d() - 0.5f)); };
  for (size_t i = 1; i <= static_cast<size_t>(n); ++i) {
    pdfs.camera[i] = density();
    pdfs.light[i] = density();
    const bool arrives = random.next_1d() < 0.9f;
    pdfs.flags[i] =
        static_cast<uint8_t>((random.next_1d() < 0.7f ? k_connectible : 0) | (arrives ? k_light_arrives : 0) |
                             (arrives && random.next_1d() < 0.9f ? k_light_scatters : 0));
  }
  pdfs.next_event = random.next_1d() < 0.2f ? 0.0f : density();
  pdfs.scatter = random.next_1d() < 0.2f ? 0.0f : density();
  if (random.next_1d() < 0.1f) pdfs.light[static_cast<size_t>(n)] = 0.0f;  // a lamp where no walk starts
  pdfs.light_conditional = density();
  const bool chosen = random.next_1d() < 0.5f;
  for (size_t m = 1; chosen && m < static_cast<size_t>(n); ++m) pdfs.connections[m] = density();
  return pdfs;
}

void expect_definition(const TechniqueSet& set, float acceptance_area, int max_light_vertices, uint64_t seed) {
  RandomStream random(seed);
  TechniqueCounts counts{64.0f, 48.0f, max_light_vertices};
  const MergeReach reach{0.02f, acceptance_area};
  int compared = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    counts.shared_scatter = trial % 2 == 0 ? 0.5f : 1.0f;
    PathPdfs pdfs = random_path(random);
    const Oracle oracle{pdfs, set, counts, reach};
    std::vector<std::pair<Technique, int>> techniques{
        {Technique::emission_hit, pdfs.n}, {Technique::next_event, pdfs.n}, {Technique::light_tracing, 0}};
    for (int m = 1; m < pdfs.n; ++m) techniques.push_back({Technique::connection, m});
    for (int i = 1; i <= pdfs.n; ++i) techniques.push_back({Technique::merging, i});
    std::vector<double> densities;
    for (const auto& [technique, vertex] : techniques) densities.push_back(oracle.density(technique, vertex));
    const std::vector<double> defined = defined_weights(densities, set.merging);
    double weights = 0.0;
    for (size_t t = 0; t < techniques.size(); ++t) {
      if (!(densities[t] > 0.0)) continue;
      const auto [technique, vertex] = techniques[t];
      const double expected = defined[t];
      const double found = static_cast<double>(path_weight(pdfs, set, counts, reach, technique, vertex));
      ASSERT_NEAR(found, expected, 1e-4 * expected + 1e-7)
          << "trial " << trial << " technique " << static_cast<int>(technique) << " at " << vertex << " of " << pdfs.n;
      weights += found;
      ++compared;
    }
    if (*std::max_element(densities.begin(), densities.end()) > 0.0) {
      ASSERT_NEAR(weights, 1.0, 1e-4) << "trial " << trial;
    }
  }
  EXPECT_GT(compared, 20000) << "hardly any path had a technique";
}

TEST(PathWeight, is_the_definition_in_bidirectional_path_tracing) {
  expect_definition(k_techniques_bpt, 0.0f, 100, 1);
  expect_definition(k_techniques_bpt, 0.0f, 3, 2);
}

TEST(PathWeight, is_the_definition_in_vertex_connection_and_merging) {
  expect_definition(k_techniques_vcm, 0.0f, 100, 3);
  expect_definition(k_techniques_vcm, 0.0f, 3, 4);
}

TEST(PathWeight, is_the_definition_with_correlation) {
  expect_definition(k_techniques_vcm, 0.3f, 100, 5);
  expect_definition(k_techniques_vcm, 0.3f, 2, 6);
}

TEST(PathWeight, is_the_definition_in_bidirectional_photon_mapping) {
  expect_definition(k_techniques_bpm, 0.0f, 100, 7);
  expect_definition(k_techniques_bpm, 0.3f, 100, 8);
}

TEST(PathWeight, does_not_depend_on_the_scale_of_the_scene) {
  RandomStream random(9);
  const TechniqueCounts counts{64.0f, 48.0f, 100};
  for (int trial = 0; trial < 2000; ++trial) {
    PathPdfs pdfs = random_path(random);
    const MergeReach reach{0.02f, 0.3f};
    for (int m = 1; m < pdfs.n; ++m) {
      if (!(Oracle{pdfs, k_techniques_vcm, counts, reach}.density(Technique::connection, m) > 0.0)) continue;
      const float expected = path_weight(pdfs, k_techniques_vcm, counts, reach, Technique::connection, m);
      for (const float scale : {1e-6f, 1e-3f, 1e3f, 1e6f}) {
        PathPdfs scaled = pdfs;
        const float per_area = 1.0f / (scale * scale);
        for (size_t i = 1; i <= static_cast<size_t>(pdfs.n); ++i) {
          scaled.camera[i] *= per_area;
          scaled.light[i] *= per_area;
        }
        scaled.light_conditional *= per_area;
        const MergeReach scaled_reach{reach.area / per_area, reach.acceptance_area / per_area};
        ASSERT_NEAR(path_weight(scaled, k_techniques_vcm, counts, scaled_reach, Technique::connection, m), expected,
                    1e-4f * expected)
            << "scale " << scale << " trial " << trial;
      }
    }
  }
}

TEST(PathWeight, of_paths_a_thousand_vertices_long_is_finite_and_sums_to_one) {
  RandomStream random(10);
  const TechniqueCounts counts{64.0f, 48.0f, 2000};
  PathPdfs pdfs;
  pdfs.reserve(1000);
  pdfs.n = 1000;
  for (size_t i = 1; i <= 1000; ++i) {
    // Camera walks are the likelier by a factor of 10 a vertex, then the less likely: ratios of 1e±500 in between.
    pdfs.camera[i] = (i <= 500 ? 10.0f : 0.1f) * (0.5f + random.next_1d());
    pdfs.light[i] = 0.5f + random.next_1d();
    pdfs.flags[i] = k_connectible | k_light_arrives | k_light_scatters;
  }
  pdfs.next_event = pdfs.scatter = pdfs.light_conditional = 1.0f;
  float sum = 0.0f;
  for (int m = 1; m < 1000; ++m) {
    const float weight = path_weight(pdfs, k_techniques_bpt, counts, {}, Technique::connection, m);
    ASSERT_TRUE(std::isfinite(weight));
    sum += weight;
  }
  EXPECT_NEAR(sum, 1.0f, 1e-3f);
}

}  // namespace
}  // namespace lambent
