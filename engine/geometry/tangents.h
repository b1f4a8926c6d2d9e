// Tangents of one UV set, per corner. Internal to TriangleMesh.
#pragma once

#include <mutex>
#include <vector>

#include "engine/geometry/triangle_mesh.h"

namespace lambent {

struct TriangleMesh::Tangents {
  std::once_flag made;
  std::vector<Vec4>
      corners;  ///< [triangle_count][3]: unit tangent, sign of the bitangent; (0, 0, 0, 1) if there is none
};

}  // namespace lambent
