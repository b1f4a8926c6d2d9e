// Normals at the vertices of meshes that are displaced: along which they move, and what shading sees afterwards.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/geometry/triangle_mesh.h"

namespace lambent {

/// Triangle corners by the vertex that they meet in.
class CornersByVertex {
 public:
  explicit CornersByVertex(const TriangleMesh& mesh);
  /// 3 * triangle + place in it, ascending.
  std::span<const uint32_t> of(uint32_t vertex) const {
    return std::span(corners_).subspan(first_[vertex], first_[vertex + 1] - first_[vertex]);
  }

 private:
  std::vector<uint32_t> first_, corners_;
};

/// Whose rules hold (mesh_displace.cpp of Cycles): up to 5.0, corners with normals of their own keep sharp edges; from
/// 5.1 on their vertices have one normal.
enum class CornerNormals : uint8_t { kept, merged };

/// Unit direction in which each vertex moves: its normal, or that of its corners; where those have several or none, the
/// mean of the triangles' that meet there, weighted by their angles (as Blender) or, of merged corners, not (as
/// Cycles). Zero for vertices without a triangle that has an area. Cost: one pass, several threads.
std::vector<Vec3> displacement_directions(const TriangleMesh& mesh, const CornersByVertex& corners,
                                          CornerNormals corner_normals);

/// Shading normals of `mesh` once its vertices are at `positions`, in the mesh's own domain; empty if it is flat. The
/// corners of triangles for which recomputed[material slot] holds (the last one for higher slots) get the mean of the
/// geometric normals of such triangles; the others keep theirs. Corners without a normal stay flat.
/// @param positions float[vertex_count][3]
std::vector<float> displaced_normals(const TriangleMesh& mesh, const CornersByVertex& corners,
                                     std::span<const float> positions, const std::vector<bool>& recomputed,
                                     CornerNormals corner_normals);

}  // namespace lambent
