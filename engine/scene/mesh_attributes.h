// What a program reads of a mesh besides position and normal.
#pragma once

#include <array>
#include <span>

#include "engine/geometry/triangle_mesh.h"
#include "engine/shading/shading_point.h"

namespace lambent {

/// By request of a program: index of the mesh's attribute, or of the scene's object values; -1: none.
using AttributeIndices = std::array<int16_t, k_max_attributes>;

/// A point of a mesh, with the change of its barycentrics over one pixel footprint.
struct MeshPoint {
  const TriangleMesh& mesh;
  uint32_t primitive;
  Vec2 barycentric;
  bool mirrored;         ///< by the object's transform
  float width_m = 0.0f;  ///< of the footprint
  Vec2 dx{0, 0}, dy{0, 0};
};

/// Extent of one pixel on a surface from the width of the ray's cone there: as wide in all directions, whatever the
/// angle, as Cycles' compact differentials, so that bumps are as steep.
void footprint(const Vec3& n, float width_m, Vec3& dpdx, Vec3& dpdy);

/// An attribute of some components as one number: the mean of three, the first of two.
inline float as_number(const Vec4& value, int components) {
  return components <= 2 ? value.x : (value.x + value.y + value.z) * (1.0f / 3.0f);
}

/// Fills point.attributes; the rest of `point` is ready. @param differentials: their changes too
void fill_attributes(const MeshPoint& at, std::span<const AttributeRequest> requests, const AttributeIndices& indices,
                     std::span<const Vec4> object_values, bool differentials, ShadingPoint& point);

}  // namespace lambent
