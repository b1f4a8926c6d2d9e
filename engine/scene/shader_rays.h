// Rays for programs that look around (Ambient Occlusion, Bevel, Raycast).
#pragma once

#include <memory>

#include "engine/shading/shading_point.h"

namespace lambent {

class Geometry;

/// Keeps the reference.
class SceneShaderRays final : public ShaderRays {
 public:
  explicit SceneShaderRays(const std::shared_ptr<const Geometry>& geometry) : geometry_(geometry) {}
  bool occluded(const ShadingPoint& point, const Vec3& direction_world, float distance_m,
                bool own_object) const override;
  int crossings(const ShadingPoint& point, const Vec3& origin_world, const Vec3& direction_world, float distance_m,
                std::span<Crossing> found) const override;
  bool meets(const ShadingPoint& point, const Vec3& origin_world, const Vec3& direction_world, float distance_m,
             bool from_surface, bool own_object, Meeting& met) const override;
  MetAttribute attribute(const SurfacePlace& place, const std::string& name) const override;

 private:
  const std::shared_ptr<const Geometry>& geometry_;
};

}  // namespace lambent
