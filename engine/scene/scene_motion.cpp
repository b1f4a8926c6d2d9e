#include "engine/scene/scene_motion.h"

#include <fmt/format.h>

#include "engine/scene/convert.h"
#include "engine/scene/scene_builder_state.h"

namespace lambent {

namespace {

Vec3 interpolated(const SharedSpan<float>& positions, const SurfaceHit& hit) {
  const std::array<uint32_t, 3> corners = hit.mesh->vertices(hit.primitive);
  const float weights[3] = {1.0f - hit.barycentric.x - hit.barycentric.y, hit.barycentric.x, hit.barycentric.y};
  Vec3 sum(0.0f);
  for (int k = 0; k < 3; ++k) {
    const float* p = positions.values.data() + 3 * size_t(corners[k]);
    sum += Vec3(p[0], p[1], p[2]) * weights[k];
  }
  return sum;
}

}  // namespace

Vec3 SceneMotion::place(const Step& step, const SurfaceHit& hit, const Instance& instance) const {
  const Object& object = step.objects[instance.object];
  Vec3 p_object = instance.object_from_world.point(hit.p_world);
  // By the difference: the surface may have been displaced from the positions that the user gave.
  if (!object.positions.empty())
    p_object += interpolated(object.positions, hit) - interpolated(positions_now_[instance.object], hit);
  return object.world_from_object.empty() ? instance.world_from_object.point(p_object)
                                          : object.world_from_object[instance.index_in_object].point(p_object);
}

Vec4 SceneMotion::vector_px(const SurfaceHit& hit, const Instance& instance) const {
  const bool moved = steps_[0].moves[instance.object], will_move = steps_[1].moves[instance.object];
  if (!moved && !will_move) return Vec4(0.0f);
  const Vec2 now = camera_.raster_of(hit.p_world);
  const auto raster_in = [&](const Step& step) {
    return step.camera.raster_of(step.objects[instance.object].moves() ? place(step, hit, instance) : hit.p_world);
  };
  const Vec2 before = moved ? raster_in(steps_[0]) - now : Vec2(0.0f);
  const Vec2 after = will_move ? now - raster_in(steps_[1]) : Vec2(0.0f);
  return {before.x, before.y, after.x, after.y};
}

Vec4 SceneMotion::vector_px(const Vec3& direction_world) const {
  if (!steps_[0].camera_moves && !steps_[1].camera_moves) return Vec4(0.0f);
  const auto seen = [&](const Camera& camera) { return camera.raster_of(camera.origin() + direction_world); };
  const Vec2 now = seen(camera_), before = seen(steps_[0].camera) - now, after = now - seen(steps_[1].camera);
  return {before.x, before.y, after.x, after.y};
}

// --- How it is made ------------------------------------------------------------------------------------------------

namespace {

/// The camera in another frame; as now where it is none.
Camera camera_of_step(const description::Camera& camera, const description::CameraStep& step,
                      const description::Settings& settings, const Scene& scene, Report& report) {
  description::Camera moved = camera;
  moved.transform = step.transform;
  moved.focal_length_mm = step.focal_length_mm;
  Result<Camera> made = Camera::create(camera_spec(moved, settings, scene.origin_shift()));
  if (made) return *made;
  report.warning("motion", camera.name,
                 made.error() + ", in another frame: passes of motion take it as standing still");
  return scene.camera();
}

}  // namespace

void SceneBuilder::State::add_motion(Build& build) {
  Scene& scene = *build.scene;
  const description::Settings& settings = *build.description.settings;
  const description::Camera& camera = *build.description.cameras.at(settings.camera);
  const size_t count = build.mesh_objects.size();
  SceneMotion::Step steps[2] = {{scene.camera_, {}, false}, {scene.camera_, {}, false}};
  std::vector<SharedSpan<float>> positions_now(count);
  for (int i = 0; i < 2; ++i) {
    if (camera.motion) {
      const description::CameraStep& given = i == 0 ? camera.motion->previous : camera.motion->next;
      steps[i].camera_moves = given.transform != camera.transform || given.focal_length_mm != camera.focal_length_mm;
      if (steps[i].camera_moves) steps[i].camera = camera_of_step(camera, given, settings, scene, build.report);
    }
    steps[i].objects.resize(count);
  }
  for (size_t n = 0; n < count; ++n) {
    const description::Object& object = *build.mesh_objects[n].first;
    if (!object.motion) continue;
    const GeometryObject& placed = build.geometry_objects[n];
    const auto& mesh = build.description.meshes.at(object.mesh);
    for (int i = 0; i < 2; ++i) {
      const description::ObjectStep& given = i == 0 ? object.motion->previous : object.motion->next;
      SceneMotion::Object& step = steps[i].objects[n];
      const auto stands_still = [&](const std::string& why) {
        build.report.warning("motion", object.name,
                             fmt::format("Object '{}' {}: passes of motion take that as it is now", object.name, why));
      };
      if (given.transforms) {
        std::vector<Transform> transforms = instance_transforms(given.transforms, scene.origin_shift_);
        if (transforms.size() != placed.world_from_object.size())
          stands_still(fmt::format("has {} instances and {} in another frame", placed.world_from_object.size(),
                                   transforms.size()));
        else if (transforms != placed.world_from_object)
          step.world_from_object = std::move(transforms);
      }
      if (given.positions && given.positions->hash != mesh->positions->hash) {
        if (given.positions->rows() != mesh->positions->rows() ||
            given.positions->rows() != placed.mesh->vertex_count()) {
          stands_still(fmt::format("has a mesh of {} vertices and of {} in another frame", placed.mesh->vertex_count(),
                                   given.positions->rows()));
        } else {
          step.positions = {given.positions->as<float>(), given.positions};
          positions_now[n] = {mesh->positions->as<float>(), mesh->positions};
        }
      }
    }
  }
  scene.motion_ =
      std::make_shared<SceneMotion>(scene.camera_, std::move(steps[0]), std::move(steps[1]), std::move(positions_now));
}

}  // namespace lambent
