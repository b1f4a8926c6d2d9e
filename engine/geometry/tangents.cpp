// Tangents for normal maps, after Mikkelsen 2008 ("Simulation of Wrinkled Surfaces Revisited"), which Blender and
// Cycles use: corners that share vertex, normal, UV and handedness share the angle-weighted mean of their triangles'
// tangents. Unlike his reference code this one works on triangles only, and groups by shared vertices instead of shared
// edges.
#include "engine/geometry/tangents.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace lambent {

namespace {

struct CornerTangent {
  Vec3 normal{0.0f};
  Vec2 uv{0.0f, 0.0f};
  Vec3 weighted{0.0f};  ///< unit tangent in the corner's tangent plane, times the corner's angle
  float sign = 1.0f;
};

Vec3 projected(const Vec3& v, const Vec3& n) { return normalize(v - n * dot(v, n)); }

}  // namespace

void TriangleMesh::prepare_tangents(int index) const {
  if (undisplaced_) return undisplaced_->prepare_tangents(index);
  Tangents& tangents = *tangents_[static_cast<size_t>(index)];
  std::call_once(tangents.made, [&] {
    std::vector<CornerTangent> corner_tangents(3 * size_t(triangle_count_));
    const auto compute = [&](uint32_t t) {
      const Triangle p = triangle(t);
      Vec2 uv[3];
      for (int k = 0; k < 3; ++k) {
        const Vec4 value = attribute(index, t, {k == 1 ? 1.0f : 0.0f, k == 2 ? 1.0f : 0.0f});
        uv[k] = {value.x, value.y};
      }
      const Vec2 d1 = uv[1] - uv[0], d2 = uv[2] - uv[0];
      const float area = d1.x * d2.y - d1.y * d2.x;
      const float sign = area < 0.0f ? -1.0f : 1.0f;
      // dp/du up to a positive factor: solves e = dp/du du + dp/dv dv for both edges.
      const Vec3 dpdu = ((p[1] - p[0]) * d2.y - (p[2] - p[0]) * d1.y) * sign;
      for (int k = 0; k < 3; ++k) {
        CornerTangent& corner = corner_tangents[3 * size_t(t) + size_t(k)];
        corner.normal = shading_normal(t, {k == 1 ? 1.0f : 0.0f, k == 2 ? 1.0f : 0.0f});
        corner.uv = uv[k];
        corner.sign = sign;
        if (area == 0.0f) continue;
        const Vec3 a = projected(p[(k + 1) % 3] - p[k], corner.normal),
                   b = projected(p[(k + 2) % 3] - p[k], corner.normal);
        const float angle = std::acos(std::clamp(dot(a, b), -1.0f, 1.0f));
        corner.weighted = projected(dpdu, corner.normal) * angle;
      }
    };
    tbb::parallel_for(tbb::blocked_range<uint32_t>(0, triangle_count_, 4096), [&](const auto& range) {
      for (uint32_t t = range.begin(); t != range.end(); ++t) compute(t);
    });

    // Corners by vertex (counting sort).
    std::vector<uint32_t> first(size_t(vertex_count_) + 1, 0), by_vertex(corner_tangents.size());
    for (size_t c = 0; c < by_vertex.size(); ++c) ++first[size_t(indices()[c]) + 1];
    for (size_t v = 0; v < vertex_count_; ++v) first[v + 1] += first[v];
    {
      std::vector<uint32_t> next(first.begin(), first.end() - 1);
      for (size_t c = 0; c < by_vertex.size(); ++c) by_vertex[next[indices()[c]]++] = static_cast<uint32_t>(c);
    }

    const auto key = [&](uint32_t c) {
      const CornerTangent& corner = corner_tangents[c];
      return std::array<float, 6>{corner.sign,     corner.uv.x,     corner.uv.y,
                                  corner.normal.x, corner.normal.y, corner.normal.z};
    };
    tangents.corners.assign(corner_tangents.size(), Vec4(0, 0, 0, 1));
    tbb::parallel_for(tbb::blocked_range<uint32_t>(0, vertex_count_, 4096), [&](const auto& range) {
      for (uint32_t v = range.begin(); v != range.end(); ++v) {
        const auto begin = by_vertex.begin() + first[v], end = by_vertex.begin() + first[v + 1];
        std::sort(begin, end, [&](uint32_t a, uint32_t b) {
          const auto key_a = key(a), key_b = key(b);
          return key_a != key_b ? key_a < key_b : a < b;
        });
        for (auto group = begin; group != end;) {
          auto group_end = group;
          Vec3 sum(0.0f);
          for (; group_end != end && key(*group_end) == key(*group); ++group_end)
            sum += corner_tangents[*group_end].weighted;
          const Vec3 tangent = normalize(sum);
          for (; group != group_end; ++group)
            tangents.corners[*group] = {tangent.x, tangent.y, tangent.z, corner_tangents[*group].sign};
        }
      }
    });
  });
}

Vec4 TriangleMesh::tangent(int index, uint32_t primitive, const Vec2& barycentric) const {
  if (undisplaced_) return undisplaced_->tangent(index, primitive, barycentric);
  prepare_tangents(index);
  const Vec4* corner = tangents_[static_cast<size_t>(index)]->corners.data() + 3 * size_t(primitive);
  const float u = barycentric.x, v = barycentric.y;
  const Vec4 mean = corner[0] * (1.0f - u - v) + corner[1] * u + corner[2] * v;
  const Vec3 tangent = normalize({mean.x, mean.y, mean.z});
  return {tangent.x, tangent.y, tangent.z, corner[0].w};
}

}  // namespace lambent
