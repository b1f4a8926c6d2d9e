#include "engine/shading/voronoi.h"

#include "engine/shading/color_math.h"
#include "engine/shading/noise.h"

namespace lambent {
namespace {

constexpr float k_far = 1e30f;

// One octave in n dimensions.
template <int n>
class Cells {
 public:
  Cells(const float* p, const VoronoiParameters& parameters) : parameters_(parameters) {
    for (int i = 0; i < n; ++i) {
      cell_[i] = std::floor(p[i]);
      local_[i] = p[i] - cell_[i];
    }
  }

  struct Point {
    int offset[n];   // of its cell from the one at hand
    float place[n];  // from the corner of the cell at hand
  };
  Point point(const int* offset) const {
    Point result;
    const Vec4 random = hashed(offset);
    for (int i = 0; i < n; ++i) {
      result.offset[i] = offset[i];
      result.place[i] = static_cast<float>(offset[i]) + random[i] * parameters_.randomness;
    }
    return result;
  }
  Color color(const int* offset) const {
    if (!parameters_.color) return Color(0.0f);
    if constexpr (n > 1) {
      if (parameters_.cell_hashes) {
        int32_t cell[4] = {0, 0, 0, 0};
        whole_cell(offset, cell);
        const Vec4 h = hash_cell(cell, std::max(n, 3));
        return {h.x, h.y, h.z};
      }
    }
    return hash_to_color(float_cell(offset), n);
  }
  Vec4 world(const float* place) const {
    Vec4 result(0.0f);
    for (int i = 0; i < n; ++i) result[n == 1 ? 3 : i] = cell_[i] + place[i];
    return result;
  }

  float distance(const float* a, const float* b) const { return from_bound(bound(a, b)); }
  /// Something that grows with the distance and costs less.
  float bound(const float* a, const float* b) const {
    float sum = 0.0f;
    if (n == 1) return std::fabs(a[0] - b[0]);
    switch (parameters_.metric) {
      case VoronoiMetric::euclidean:
        return squared_distance(a, b);
      case VoronoiMetric::manhattan:
        for (int i = 0; i < n; ++i) sum += std::fabs(a[i] - b[i]);
        return sum;
      case VoronoiMetric::chebychev:
        for (int i = 0; i < n; ++i) sum = std::max(sum, std::fabs(a[i] - b[i]));
        return sum;
      case VoronoiMetric::minkowski:
        for (int i = 0; i < n; ++i) sum += std::pow(std::fabs(a[i] - b[i]), parameters_.exponent);
        return sum;
    }
    return sum;
  }
  float from_bound(float bound) const {
    if (n == 1) return bound;
    if (parameters_.metric == VoronoiMetric::euclidean) return std::sqrt(bound);
    return parameters_.metric == VoronoiMetric::minkowski ? std::pow(bound, 1.0f / parameters_.exponent) : bound;
  }
  static float squared_distance(const float* a, const float* b) {
    float sum = 0.0f;
    for (int i = 0; i < n; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sum;
  }
  const float* local() const { return local_; }

  // Calls visit(offset) for the cells within `reach` of the one at `center`, the first axis running fastest.
  template <typename Visit>
  static void visit_cells(int reach, const int* center, Visit&& visit) {
    int offset[n], relative[n];
    for (int i = 0; i < n; ++i) relative[i] = -reach;
    while (true) {
      for (int i = 0; i < n; ++i) offset[i] = relative[i] + (center ? center[i] : 0);
      visit(offset);
      int axis = 0;
      while (axis < n && ++relative[axis] > reach) relative[axis++] = -reach;
      if (axis == n) return;
    }
  }

 private:
  void whole_cell(const int* offset, int32_t* cell) const {
    for (int i = 0; i < n; ++i)
      cell[i] = static_cast<int32_t>(std::clamp(cell_[i], -2.1e9f, 2.1e9f)) + static_cast<int32_t>(offset[i]);
  }
  Vec4 float_cell(const int* offset) const {
    Vec4 cell(0.0f);
    for (int i = 0; i < n; ++i) cell[i] = cell_[i] + static_cast<float>(offset[i]);
    return cell;
  }
  Vec4 hashed(const int* offset) const {
    if constexpr (n > 1) {
      if (parameters_.cell_hashes) {
        int32_t cell[4];
        whole_cell(offset, cell);
        return hash_cell(cell, n);
      }
    }
    return hash_to_vector(float_cell(offset), n);
  }

  const VoronoiParameters& parameters_;
  float cell_[n], local_[n];
};

/// The cells around one, that one first and those that touch it least last; with each its place in the order of
/// visit_cells.
template <int n>
struct NearOrder {
  static constexpr int count = n == 1 ? 3 : n == 2 ? 9 : n == 3 ? 27 : 81;
  int offset[count][n] = {};
  int place[count] = {};

  constexpr NearOrder() {
    int next = 0;
    for (int touching = 0; touching <= n; ++touching)
      for (int cell = 0; cell < count; ++cell) {
        int digits[n] = {}, away = 0;
        for (int i = 0, rest = cell; i < n; ++i, rest /= 3) {
          digits[i] = rest % 3 - 1;
          away += digits[i] != 0;
        }
        if (away != touching) continue;
        for (int i = 0; i < n; ++i) offset[next][i] = digits[i];
        place[next++] = cell;
      }
  }
};

/// Bounds of how near the points of cells can be, a little too low against rounding.
template <int n>
class NearestInCell {
 public:
  NearestInCell(const float* local, const VoronoiParameters& parameters)
      : largest_(n > 1 && parameters.metric == VoronoiMetric::chebychev) {
    constexpr float k_slack = 1e-5f;
    for (int i = 0; i < n; ++i) {
      const float beyond = local[i] - parameters.randomness;
      const float away[3] = {beyond + 1.0f, beyond, 1.0f - local[i]};
      for (int k = 0; k < 3; ++k) {
        const float d = std::max(away[k] - k_slack, 0.0f);
        axis_[i][k] = n == 1 || parameters.metric == VoronoiMetric::manhattan || largest_ ? d
                      : parameters.metric == VoronoiMetric::euclidean                     ? d * d
                                                                                          : 0.0f;
      }
    }
  }
  float operator()(const int* offset) const {
    float sum = 0.0f;
    for (int i = 0; i < n; ++i) {
      const float d = axis_[i][offset[i] + 1];
      sum = largest_ ? std::max(sum, d) : sum + d;
    }
    return sum * (1.0f - 1e-5f);
  }

 private:
  float axis_[n][3];
  bool largest_;
};

// Distance, colour and place of the nearest point, or the second nearest. Of points equally far, visit_cells' first;
// cells that are too far to change the result are left out.
template <int n>
VoronoiResult nearest(const Cells<n>& cells, const VoronoiParameters& parameters, bool second) {
  using Point = typename Cells<n>::Point;
  static constexpr NearOrder<n> k_order;
  const NearestInCell<n> least(cells.local(), parameters);
  float first_distance = k_far, second_distance = k_far;
  int first_place = 0, other_place = 0;
  Point first{}, other{};
  for (int c = 0; c < k_order.count; ++c) {
    if (least(k_order.offset[c]) > (second ? second_distance : first_distance)) continue;
    const Point point = cells.point(k_order.offset[c]);
    const int place = k_order.place[c];
    const float distance = cells.bound(point.place, cells.local());
    if (distance < first_distance || (distance == first_distance && place < first_place)) {
      second_distance = first_distance, other = first, other_place = first_place;
      first_distance = distance, first = point, first_place = place;
    } else if (distance < second_distance || (distance == second_distance && place < other_place)) {
      second_distance = distance, other = point, other_place = place;
    }
  }
  const Point& found = second ? other : first;
  return {cells.from_bound(second ? second_distance : first_distance), cells.color(found.offset),
          cells.world(found.place)};
}

// All points blended by a smooth minimum (Quilez 2014).
template <int n>
VoronoiResult smooth(const Cells<n>& cells, const VoronoiParameters& parameters) {
  const float smoothness = std::clamp(parameters.smoothness * 0.5f, 0.0f, 0.5f);
  VoronoiResult result;
  result.distance = parameters.octaves ? 0.0f : 8.0f;
  float place[n] = {};
  bool first = parameters.octaves;
  Cells<n>::visit_cells(2, nullptr, [&](const int* offset) {
    const auto point = cells.point(offset);
    const float distance = cells.distance(point.place, cells.local());
    float h = 1.0f;
    if (!first) {
      const float x = 0.5f + 0.5f * (result.distance - distance) / smoothness;
      const float t = std::isnan(x) ? 0.0f : saturate(x);
      h = t * t * (3.0f - 2.0f * t);
    }
    first = false;
    float correction = smoothness * h * (1.0f - h);
    result.distance = lerp(result.distance, distance, h) - correction;
    correction /= 1.0f + 3.0f * smoothness;
    result.color = lerp(result.color, cells.color(offset), h) - Color(correction);
    for (int i = 0; i < n; ++i) place[i] = lerp(place[i], point.place[i], h) - correction;
  });
  result.position = cells.world(place);
  return result;
}

// Distance to the border between the nearest point's cell and its neighbours (Quilez 2012).
template <int n>
float distance_to_edge(const Cells<n>& cells) {
  const float* local = cells.local();
  if constexpr (n == 1) {
    const auto place = [&](int offset) { return cells.point(&offset).place[0]; };
    const float middle = place(0);
    return std::min(std::fabs((middle + place(-1)) / 2.0f - local[0]),
                    std::fabs((middle + place(1)) / 2.0f - local[0]));
  } else {
    float best = k_far, closest[n] = {};
    const auto vector_to = [&](const int* offset, float* v) {
      const auto point = cells.point(offset);
      for (int i = 0; i < n; ++i) v[i] = point.place[i] - local[i];
    };
    Cells<n>::visit_cells(1, nullptr, [&](const int* offset) {
      float v[n], squared = 0.0f;
      vector_to(offset, v);
      for (int i = 0; i < n; ++i) squared += v[i] * v[i];
      if (squared < best) {
        best = squared;
        std::copy(v, v + n, closest);
      }
    });
    best = k_far;
    Cells<n>::visit_cells(1, nullptr, [&](const int* offset) {
      float v[n], across = 0.0f, squared = 0.0f;
      vector_to(offset, v);
      for (int i = 0; i < n; ++i) squared += sqr(v[i] - closest[i]);
      if (squared <= 0.0001f) return;
      for (int i = 0; i < n; ++i) across += (closest[i] + v[i]) / 2.0f * (v[i] - closest[i]);
      best = std::min(best, across / std::sqrt(squared));
    });
    return best;
  }
}

// Half the distance from the nearest point to the point nearest to it.
template <int n>
float n_sphere_radius(const Cells<n>& cells) {
  using Point = typename Cells<n>::Point;
  float best = k_far;
  Point closest{}, neighbour{};
  Cells<n>::visit_cells(1, nullptr, [&](const int* offset) {
    const Point point = cells.point(offset);
    const float squared = Cells<n>::squared_distance(point.place, cells.local());
    if (squared < best) best = squared, closest = point;
  });
  best = k_far;
  Cells<n>::visit_cells(1, closest.offset, [&](const int* offset) {
    if (std::equal(offset, offset + n, closest.offset)) return;
    const Point point = cells.point(offset);
    const float squared = Cells<n>::squared_distance(point.place, closest.place);
    if (squared < best) best = squared, neighbour = point;
  });
  return std::sqrt(Cells<n>::squared_distance(neighbour.place, closest.place)) / 2.0f;
}

template <int n>
VoronoiResult octave(const float* p, const VoronoiParameters& parameters, float frequency) {
  float at[n];
  for (int i = 0; i < n; ++i) at[i] = p[i] * frequency;
  const Cells<n> cells(at, parameters);
  switch (parameters.feature) {
    case VoronoiFeature::smooth_f1:
      if (parameters.smoothness > 0.0f || !parameters.octaves) return smooth(cells, parameters);
      return nearest(cells, parameters, false);
    case VoronoiFeature::distance_to_edge:
      return {distance_to_edge(cells), Color(0.0f), Vec4(0.0f)};
    case VoronoiFeature::n_sphere_radius:
      return {n_sphere_radius(cells), Color(0.0f), Vec4(0.0f)};
    default:
      return nearest(cells, parameters, parameters.feature == VoronoiFeature::f2);
  }
}

Vec4 mixed(const Vec4& a, const Vec4& b, float t) { return a + (b - a) * t; }

// Octaves of the distance to edges: the smallest counts.
template <int n>
VoronoiResult fractal_edges(const float* p, const VoronoiParameters& parameters, float largest) {
  VoronoiResult result;
  result.distance = 8.0f;
  float amplitude = 1.0f, frequency = 1.0f, total = largest;
  const bool plain = parameters.detail == 0.0f || parameters.roughness == 0.0f;
  for (int i = 0; i <= static_cast<int>(std::ceil(parameters.detail)); ++i) {
    const float distance = octave<n>(p, parameters, frequency).distance;
    if (plain) {
      result.distance = distance;
      break;
    }
    const float next_total = lerp(total, largest / frequency, amplitude);
    const float next = lerp(result.distance, std::min(result.distance, distance / frequency), amplitude);
    if (static_cast<float>(i) <= parameters.detail) {
      total = next_total, result.distance = next;
      frequency *= parameters.lacunarity;
      amplitude *= parameters.roughness;
    } else if (const float rest = parameters.detail - std::floor(parameters.detail); rest != 0.0f) {
      total = lerp(total, next_total, rest);
      result.distance = lerp(result.distance, std::min(result.distance, next), rest);
    }
  }
  if (parameters.normalize) result.distance /= total;
  return result;
}

// Octaves of the others: distances and colours add up, positions blend.
template <int n>
VoronoiResult fractal(const float* p, const VoronoiParameters& parameters, float largest) {
  VoronoiResult result;
  float amplitude = 1.0f, frequency = 1.0f, total = 0.0f;
  const bool plain = parameters.detail == 0.0f || parameters.roughness == 0.0f;
  for (int i = 0; i <= static_cast<int>(std::ceil(parameters.detail)); ++i) {
    const VoronoiResult found = octave<n>(p, parameters, frequency);
    if (plain) {
      result = found, total = 1.0f;
      break;
    }
    const Vec4 blended = mixed(result.position, found.position * (1.0f / frequency), amplitude);
    float share = 1.0f;
    if (static_cast<float>(i) > parameters.detail) share = parameters.detail - std::floor(parameters.detail);
    total += share * amplitude;
    result.distance += found.distance * (share * amplitude);
    result.color += found.color * (share * amplitude);
    result.position = mixed(result.position, blended, share);
    frequency *= parameters.lacunarity;
    amplitude *= parameters.roughness;
  }
  if (parameters.normalize) {
    result.distance /= total * largest;
    result.color *= 1.0f / total;
  }
  return result;
}

template <int n>
VoronoiResult texture(const float* p, const VoronoiParameters& parameters) {
  if (!parameters.octaves || parameters.feature == VoronoiFeature::n_sphere_radius)
    return octave<n>(p, parameters, 1.0f);
  const float side = 0.5f + 0.5f * parameters.randomness;
  if (parameters.feature == VoronoiFeature::distance_to_edge) return fractal_edges<n>(p, parameters, side);
  // The largest distance that can be: across the cell
  float zero[n] = {}, corner[n];
  std::fill(corner, corner + n, side);
  const float largest = Cells<n>(zero, parameters).distance(zero, corner);
  return fractal<n>(p, parameters, parameters.feature == VoronoiFeature::f2 ? 2.0f * largest : largest);
}

float finite(float x, float otherwise = 0.0f) { return std::isfinite(x) ? x : otherwise; }

}  // namespace

VoronoiResult voronoi_texture(const Vec4& p_in, const VoronoiParameters& given) {
  VoronoiParameters parameters = given;
  parameters.detail = std::clamp(finite(given.detail), 0.0f, 15.0f);
  parameters.roughness = std::clamp(finite(given.roughness), 0.0f, 1.0f);
  parameters.randomness = std::clamp(finite(given.randomness), 0.0f, 1.0f);
  parameters.smoothness = std::clamp(finite(given.smoothness), 0.0f, 1.0f);
  parameters.lacunarity = finite(given.lacunarity);
  parameters.exponent = finite(given.exponent);
  float p[4] = {finite(p_in.x), finite(p_in.y), finite(p_in.z), finite(p_in.w)};
  VoronoiResult result;
  switch (parameters.dimensions) {
    case 1:
      result = texture<1>(p + 3, parameters);
      break;
    case 2:
      result = texture<2>(p, parameters);
      break;
    case 3:
      result = texture<3>(p, parameters);
      break;
    default:
      result = texture<4>(p, parameters);
  }
  result.distance = finite(result.distance);
  for (int i = 0; i < 3; ++i) result.color[i] = finite(result.color[i]);
  for (int i = 0; i < 4; ++i) result.position[i] = finite(safe_divide(result.position[i], parameters.scale));
  return result;
}

}  // namespace lambent
