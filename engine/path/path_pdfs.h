// The densities of one full path from both ends, and from them the weight of the technique that made it.
//
// Notation (technique.h): surface vertices x_1 ... x_n between lens and light. c_i is the area density (m⁻²) with which
// a camera walk samples x_i given the vertices before it, l_i that of a light walk. Roulette and choices to go through
// transparent surfaces are left out of both: weights may be any function of the path whose values sum to 1.
//   c_1  J·cos: of the pixel's unit raster density (camera.h), so that one camera sample a pixel has count 1
//   l_n  density of light walks that leave the light towards x_n, m⁻² at x_n times sr⁻¹ at x_n (delta lights: m⁻²)
//   next_event, scatter  densities at x_n, sr⁻¹ (delta lights and lobes: discrete), of choosing the direction to the
//                        light by next event and by scattering
// A delta event at x_i leaves probabilities in c_(i+1) and l_(i-1); techniques that would have to evaluate it are not
// connectible.
//
// With C_i = c_1···c_i and L_i = l_i···l_n the techniques' densities are
//   emission hit C_n·scatter, next event C_n·next_event, connection m  C_m·L_(m+1), light tracing L_1·light_paths,
//   merging i  C_i·L_i·π r²·merge_paths                                     (Georgiev et al. 2012, eq. 5 to 9)
// all in one measure; only their ratios are formed, step by step along the path, so that no scale over- or underflows.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/base/vec.h"
#include "engine/path/technique.h"

namespace lambent {

/// 1/d², of distances whose squares leave the range of floats too.
inline float inverse_square(float d) { return 1.0f / d * (1.0f / d); }

/// Facts about a vertex that decide which techniques exist.
enum PathVertexFlag : uint8_t {
  k_connectible = 1,     ///< the path's event there has a density
  k_light_arrives = 2,   ///< light walks may get there ...
  k_light_scatters = 4,  ///< ... and go on from there
  k_light_begins = 8,    ///< light walks may get there straight from the light
};

/// Grows as the walks go; reused from path to path. One thread's.
class PathPdfs {
 public:
  /// Makes room for vertices 1..n; keeps what there is.
  void reserve(int vertices) {
    if (static_cast<int>(camera.size()) > vertices) return;
    const size_t size = static_cast<size_t>(vertices) + 32;
    camera.resize(size);
    light.resize(size);
    flags.resize(size);
    camera_acceptance.resize(size);
    correlation.resize(size);
    connections.resize(size, 1.0f);
  }

  std::vector<float> camera, light;  ///< c_i and l_i by i; element 0 is unused
  std::vector<uint8_t> flags;        ///< PathVertexFlag by i
  float next_event = 0.0f;           ///< 0: the light cannot be chosen from x_n
  float scatter = 0.0f;              ///< 0: the light cannot be met from x_n
  float light_conditional = 0.0f;    ///< area density of x_n given the point on the light: for correlation alone
  /// Connections of x_m to what is x_(m+1), over those that a light walk of the sample's own would make, by m: where
  /// vertices are chosen. Any function of the path.
  std::vector<float> connections;
  int n = 0;

  // Scratch of path_weight.
  std::vector<float> camera_acceptance;  ///< products of min(c_j·A, 1), j <= i
  std::vector<float> correlation;        ///< ρ_i of Grittmann et al. 2021
};

struct MergeReach {
  float area = 0.0f;  ///< π r², m²
  float acceptance_area =
      0.0f;  ///< A of Grittmann et al. 2021: π (d·tan 1°)² with d the distance to x_1; 0: no correlation
};

/// Correlation factors ρ_i of merging at x_i, into pdfs.correlation (Grittmann, Georgiev & Slusallek 2021,
/// "Correlation-Aware Multiple Importance Sampling for Bidirectional Rendering Algorithms"): all pixels merge with one
/// photon map, so where the light walk's prefix is the narrower one, merging is worth less than its count says.
void fill_correlation(PathPdfs& pdfs, const TechniqueCounts& counts, float acceptance_area);

/// Weight of a technique for the path: power heuristic with exponent 2 without merging, balance heuristic with it (the
/// correlation-aware one) but for next events and emission hits, which share what both have by the power heuristic; all
/// with TechniqueCounts::shared_scatter. Weights of all techniques of `set` that can make the path sum to 1.
/// @param vertex connection: m; merging: i; ignored for the others
float path_weight(PathPdfs& pdfs, const TechniqueSet& set, const TechniqueCounts& counts, const MergeReach& merge,
                  Technique technique, int vertex);

}  // namespace lambent
