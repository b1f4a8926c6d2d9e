#include "engine/path/path_pdfs.h"

#include <algorithm>
#include <cmath>

#include "engine/path/mis.h"

namespace lambent {

void fill_correlation(PathPdfs& pdfs, const TechniqueCounts& counts, float acceptance_area) {
  const float least = 1.0f / std::max(counts.merge_paths, 1.0f);
  float product = 1.0f;
  for (int i = 1; i <= pdfs.n; ++i)
    pdfs.camera_acceptance[i] = product *= std::min(pdfs.camera[i] * acceptance_area, 1.0f);
  product = std::min(pdfs.light_conditional * acceptance_area, 1.0f);
  for (int i = pdfs.n; i >= 1; --i) {
    if (i < pdfs.n) product *= std::min(pdfs.light[i] * acceptance_area, 1.0f);
    const float from_camera = pdfs.camera_acceptance[i];
    const float either = from_camera + product - from_camera * product;
    pdfs.correlation[i] = either > 0.0f ? std::max(from_camera / either, least) : 1.0f;
  }
}

namespace {

/// The sum over all techniques of (density / density of the one at hand)^exponent.
template <bool merging>
float sum_of_ratios(const PathPdfs& pdfs, const TechniqueSet& set, const TechniqueCounts& counts,
                    const MergeReach& merge, Technique technique, int vertex) {
  const int n = pdfs.n;
  const float* c = pdfs.camera.data();
  const float* l = pdfs.light.data();
  const uint8_t* flags = pdfs.flags.data();
  const auto power = [](float ratio) { return merging ? ratio : ratio * ratio; };
  // Of a camera walk's way on from x_i, i >= 1; `power` makes counts.shared_scatter of it.
  const float of_scatter = merging ? counts.shared_scatter : std::sqrt(counts.shared_scatter);
  const auto shared = [&](int i) { return flags[i] & k_connectible ? of_scatter : 1.0f; };
  float sum = 0.0f;
  const auto merge_term = [&](int i, float q) {
    if constexpr (merging) {
      const int along_light = n - i + 1;
      if (i >= set.first_merge_camera && along_light >= set.first_merge_light &&
          along_light <= counts.max_light_vertices && (flags[i] & k_connectible))
        sum += q * (merge.area * counts.merge_paths) * pdfs.correlation[i];
    }
  };

  const float* connections = pdfs.connections.data();

  // q: C_i·L_(i+1) over the density at hand, for the present i.
  int i = vertex;
  float q = 1.0f;
  bool at_end = false;  // the technique at hand is an end of the camera walk
  switch (technique) {
    case Technique::emission_hit:
      at_end = true;
      q = 1.0f / pdfs.scatter;
      break;
    case Technique::next_event:
      at_end = true;
      q = 1.0f / pdfs.next_event;
      break;
    case Technique::connection:
      q = 1.0f / connections[vertex];
      break;
    case Technique::light_tracing:
      i = 0;
      q = 1.0f / counts.light_paths;
      break;
    case Technique::merging:
      q = 1.0f / (l[vertex] * merge.area * counts.merge_paths * (merging ? pdfs.correlation[vertex] : 1.0f));
      break;
  }
  if (at_end) i = n;
  const int start = i;
  const float q_start = q;

  const auto end_terms = [&](float q_n) {
    if (set.next_event && (flags[n] & k_connectible)) sum += power(q_n * pdfs.next_event);
    if (set.emission) sum += power(q_n * pdfs.scatter);
  };
  const auto connection_term = [&](int m, float q_m) {
    if (m == 0) {
      if (set.light_tracing && n >= set.first_light_tracing && (flags[1] & k_connectible) &&
          n <= counts.max_light_vertices)
        sum += power(q_m * counts.light_paths);
    } else if (set.connections && n - m <= counts.max_light_vertices && (flags[m] & k_connectible) &&
               (flags[m + 1] & k_connectible)) {
      sum += power(q_m * connections[m]);
    }
  };

  // The technique's own term, then towards the camera.
  if (start == n) {
    end_terms(q);
  } else {
    connection_term(start, q);
  }
  for (; i >= 1; --i) {
    if (l[i] == 0.0f || !(flags[i] & k_light_arrives)) break;
    merge_term(i, q * l[i]);
    if (!(flags[i] & k_light_scatters)) break;
    q *= l[i] / c[i];
    if (i > 1) q /= shared(i - 1);
    connection_term(i - 1, q);
  }
  // Towards the light.
  q = q_start;
  for (i = start + 1; i <= n; ++i) {
    if (c[i] == 0.0f) break;
    q *= c[i] / l[i];
    if (i > 1) q *= shared(i - 1);
    merge_term(i, q * l[i]);
    if (i < n)
      connection_term(i, q);
    else
      end_terms(q);
  }
  return sum;
}

/// What next event and hits of the light have of their common weight, over what they have of the sum: they find the
/// same paths, and next events nearly without noise, so between the two the power heuristic holds, whatever the others
/// have.
float share_of_end(const PathPdfs& pdfs, const TechniqueSet& set, Technique technique) {
  const bool hit = technique == Technique::emission_hit;
  if (!hit && technique != Technique::next_event) return 1.0f;
  if (!set.emission || !set.next_event || !(pdfs.flags[pdfs.n] & k_connectible)) return 1.0f;
  const float own = hit ? pdfs.scatter : pdfs.next_event, other = hit ? pdfs.next_event : pdfs.scatter;
  return power_heuristic(own, other) * (1.0f + other / own);
}

}  // namespace

float path_weight(PathPdfs& pdfs, const TechniqueSet& set, const TechniqueCounts& counts, const MergeReach& merge,
                  Technique technique, int vertex) {
  float sum, share = 1.0f;
  if (set.merging) {
    share = share_of_end(pdfs, set, technique);
    if (merge.acceptance_area > 0.0f)
      fill_correlation(pdfs, counts, merge.acceptance_area);
    else
      std::fill_n(pdfs.correlation.begin() + 1, pdfs.n, 1.0f);
    sum = sum_of_ratios<true>(pdfs, set, counts, merge, technique, vertex);
  } else {
    sum = sum_of_ratios<false>(pdfs, set, counts, merge, technique, vertex);
  }
  // Terms that overflow belong to techniques next to which this one hardly counts.
  return sum > 0.0f && sum < k_infinity ? std::min(share / sum, 1.0f) : 0.0f;
}

}  // namespace lambent
