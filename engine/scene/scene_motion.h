// Where the camera and the objects are in the frames before and after: what passes of motion ask. Only scenes of
// renders with such a pass have one.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "engine/base/transform.h"
#include "engine/camera/camera.h"
#include "engine/geometry/geometry.h"

namespace lambent {

class SceneMotion {
 public:
  /// One geometry object (Instance::object) in another frame.
  struct Object {
    std::vector<Transform> world_from_object;  ///< by Instance::index_in_object; empty: it stands still
    SharedSpan<float> positions;               ///< float[V][3], object space; empty: it keeps its shape
    bool moves() const { return !world_from_object.empty() || !positions.empty(); }
  };
  struct Step {
    Camera camera;
    std::vector<Object> objects;
    bool camera_moves = false;
    std::vector<uint8_t> moves = {};  ///< by geometry object: that or the camera
  };

  /// @param positions_now by geometry object: float[V][3] as the user gave them; empty where no step has positions
  SceneMotion(const Camera& camera, Step previous, Step next, std::vector<SharedSpan<float>> positions_now)
      : camera_(camera), steps_{std::move(previous), std::move(next)}, positions_now_(std::move(positions_now)) {
    for (Step& step : steps_)
      for (const Object& object : step.objects) step.moves.push_back(step.camera_moves || object.moves());
  }

  /// How the surface at a hit moves over the picture, px: x, y of its place in the previous frame less its place now,
  /// then of its place now less its place in the next (as Cycles: kernel/geom/primitive.h, primitive_motion_vector).
  Vec4 vector_px(const SurfaceHit& hit, const Instance& instance) const;
  /// The same of what lies infinitely far along a direction, as Cycles 5.2 has it for the world.
  Vec4 vector_px(const Vec3& direction_world) const;

 private:
  /// @param instance of an object that moves
  Vec3 place(const Step& step, const SurfaceHit& hit, const Instance& instance) const;

  Camera camera_;
  std::array<Step, 2> steps_;
  std::vector<SharedSpan<float>> positions_now_;
};

}  // namespace lambent
