// What a Geometry owns of Embree, and what the builder keeps between snapshots. Internal to geometry/.
#pragma once

#include <memory>
#include <vector>

#include "engine/geometry/embree_scene.h"
#include "engine/geometry/geometry.h"

namespace lambent {

/// The acceleration structure of one mesh in object space. Immutable once built; shared by snapshots.
struct MeshScene {
  std::shared_ptr<const TriangleMesh> mesh;
  embree::Scene scene;
  bool filter, compact;
};

struct Geometry::Scenes {
  std::shared_ptr<embree::Device> device;
  std::unique_ptr<embree::Scene> top;  ///< released first: it refers to what follows
  std::vector<std::shared_ptr<const TriangleMesh>> meshes;
  std::vector<std::shared_ptr<const MeshScene>> mesh_scenes;
  std::vector<std::unique_ptr<float[]>> positions_world;

  ~Scenes() { top.reset(); }
};

/// Embree's masks are tested with "any bit in common", but a shadow ray that visits wants only opaque instances, then
/// only the others: so an instance carries its visibility twice, as it is and shifted by its kind.
inline constexpr int k_opaque_shift = 8, k_transparent_shift = 16;
inline uint32_t embree_mask(uint32_t visibility, bool opaque) {
  visibility &= k_visible_all;
  return visibility | visibility << (opaque ? k_opaque_shift : k_transparent_shift);
}

}  // namespace lambent
