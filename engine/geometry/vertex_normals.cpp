#include "engine/geometry/vertex_normals.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace lambent {

namespace {

constexpr uint32_t k_grain = 4096;

Vec3 normal_of(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3d n = Vec3d(b - a).cross(Vec3d(c - a));
  const double l = std::sqrt(n.dot(n));
  return l > 0.0 ? Vec3(n / l) : Vec3(0.0f);
}

Vec3 at(std::span<const float> values, size_t i) { return {values[3 * i], values[3 * i + 1], values[3 * i + 2]}; }

float angle_between(const Vec3& a, const Vec3& b) {
  return std::acos(std::clamp(dot(normalize(a), normalize(b)), -1.0f, 1.0f));
}

}  // namespace

CornersByVertex::CornersByVertex(const TriangleMesh& mesh)
    : first_(size_t(mesh.vertex_count()) + 1, 0), corners_(3 * size_t(mesh.triangle_count())) {
  const uint32_t* vertex = mesh.indices();
  for (size_t c = 0; c < corners_.size(); ++c) ++first_[size_t(vertex[c]) + 1];
  for (size_t v = 0; v + 1 < first_.size(); ++v) first_[v + 1] += first_[v];
  std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
  for (size_t c = 0; c < corners_.size(); ++c) corners_[next[vertex[c]]++] = static_cast<uint32_t>(c);
}

std::vector<Vec3> displacement_directions(const TriangleMesh& mesh, const CornersByVertex& corners,
                                          CornerNormals corner_normals) {
  std::vector<Vec3> directions(mesh.vertex_count());
  const bool given = mesh.has_normals();
  const bool by_corner = given && mesh.normals_domain() == AttributeDomain::corner;
  const bool merged = by_corner && corner_normals == CornerNormals::merged;
  const auto common_normal = [&](uint32_t vertex) {
    Vec3 common(0.0f);
    for (const uint32_t corner : corners.of(vertex)) {
      const Vec3 n = at(mesh.normals(), mesh.corners(corner / 3)[corner % 3]);
      if (n == Vec3(0.0f)) continue;
      if (!(common == Vec3(0.0f)) && !(n == common)) return Vec3(0.0f);
      common = n;
    }
    return common;
  };
  const auto mean_normal = [&](uint32_t vertex) {
    Vec3 sum(0.0f);
    for (const uint32_t corner : corners.of(vertex)) {
      const Triangle p = mesh.triangle(corner / 3);
      const uint32_t k = corner % 3;
      const float weight = merged ? 1.0f : angle_between(p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
      sum += mesh.geometric_normal(corner / 3) * weight;
    }
    return sum;
  };
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, mesh.vertex_count(), k_grain), [&](const auto& range) {
    for (uint32_t v = range.begin(); v != range.end(); ++v) {
      Vec3 n(0.0f);
      if (given && !merged) n = by_corner ? common_normal(v) : at(mesh.normals(), v);
      if (!is_finite(n) || length_squared(n) == 0.0f) n = mean_normal(v);
      directions[v] = normalize(n);
    }
  });
  return directions;
}

std::vector<float> displaced_normals(const TriangleMesh& mesh, const CornersByVertex& corners,
                                     std::span<const float> positions, const std::vector<bool>& recomputed,
                                     CornerNormals corner_normals) {
  std::vector<float> normals(mesh.normals().begin(), mesh.normals().end());
  if (!mesh.has_normals()) return normals;
  const bool by_corner = mesh.normals_domain() == AttributeDomain::corner;
  const bool merged = by_corner && corner_normals == CornerNormals::merged;
  if (!merged && std::find(recomputed.begin(), recomputed.end(), true) == recomputed.end()) return normals;
  const auto counts = [&](uint32_t triangle) {
    return merged || recomputed[std::min<size_t>(mesh.material_slot(triangle), recomputed.size() - 1)];
  };
  const auto face_normal = [&](uint32_t triangle) {
    const auto [a, b, c] = mesh.vertices(triangle);
    return normal_of(at(positions, a), at(positions, b), at(positions, c));
  };
  struct Corner {
    uint32_t corner;
    size_t place;  ///< of its normal
    Vec3 old;      ///< corners that had the same one share the new one
  };
  const auto before = [](const Corner& a, const Corner& b) {
    return std::tuple(a.old.x, a.old.y, a.old.z, a.corner) < std::tuple(b.old.x, b.old.y, b.old.z, b.corner);
  };
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, mesh.vertex_count(), k_grain), [&](const auto& range) {
    std::vector<Corner> around;
    for (uint32_t v = range.begin(); v != range.end(); ++v) {
      around.clear();
      for (const uint32_t corner : corners.of(v)) {
        if (!counts(corner / 3)) continue;
        const size_t place = by_corner ? mesh.corners(corner / 3)[corner % 3] : v;
        const Vec3 old = at(mesh.normals(), place);
        around.push_back({corner, place, by_corner && !merged && is_finite(old) ? old : Vec3(0.0f)});
      }
      if (by_corner && !merged) std::sort(around.begin(), around.end(), before);
      Vec3 flat(0.0f);  // flat triangles count for all groups
      if (by_corner && !merged)
        for (const Corner& corner : around)
          if (corner.old == Vec3(0.0f)) flat += face_normal(corner.corner / 3);
      for (size_t begin = 0, end; begin < around.size(); begin = end) {
        Vec3 sum = flat;
        for (end = begin; end < around.size() && around[end].old == around[begin].old; ++end)
          sum += face_normal(around[end].corner / 3);
        const Vec3 n = normalize(sum);
        for (size_t i = begin; i < end; ++i) {
          const size_t place = around[i].place;
          if (by_corner && at(mesh.normals(), place) == Vec3(0.0f)) continue;  // flat
          for (int k = 0; k < 3; ++k) normals[3 * place + static_cast<size_t>(k)] = n[k];
        }
      }
    }
  });
  return normals;
}

}  // namespace lambent
