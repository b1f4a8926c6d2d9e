// The Voronoi Texture: points scattered one to a cell of the integer lattice, and what lies nearest (Worley 1996), with
// the patterns of Blender: before 4.0, from 4.0 (octaves) and from 5.0 (other hashes of cells).
#pragma once

#include "engine/base/vec.h"

namespace lambent {

enum class VoronoiFeature : uint8_t { f1, f2, smooth_f1, distance_to_edge, n_sphere_radius };
enum class VoronoiMetric : uint8_t { euclidean, manhattan, chebychev, minkowski };

struct VoronoiParameters {
  int dimensions = 3;
  VoronoiFeature feature = VoronoiFeature::f1;
  VoronoiMetric metric = VoronoiMetric::euclidean;
  bool octaves = false;      ///< Blender from 4.0: detail, roughness, lacunarity and `normalize` count
  bool cell_hashes = false;  ///< Blender from 5.0: cells of two and more dimensions hashed as whole numbers
  bool normalize = false;
  bool color = true;   ///< the colour is wanted
  float scale = 1.0f;  ///< coordinates are multiplied by it already; positions are divided by it
  float detail = 0.0f, roughness = 0.5f, lacunarity = 2.0f;
  float smoothness = 1.0f;  ///< in [0, 1]
  float exponent = 0.5f;    ///< of the Minkowski metric
  float randomness = 1.0f;  ///< in [0, 1]
  friend bool operator==(const VoronoiParameters&, const VoronoiParameters&) = default;
};

struct VoronoiResult {
  float distance = 0.0f;  ///< or, of the features that are, the distance to the edge or the radius
  Color color{0.0f};
  Vec4 position{0.0f};  ///< of the point in the texture's coordinates; one dimension: w alone
};

/// All finite for any parameters. @param p coordinates times scale; one dimension: w alone.
VoronoiResult voronoi_texture(const Vec4& p, const VoronoiParameters& parameters);

}  // namespace lambent
