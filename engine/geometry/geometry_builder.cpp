#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <new>
#include <unordered_map>

#include "engine/geometry/geometry.h"
#include "engine/geometry/geometry_scenes.h"

namespace lambent {

namespace {

/// Meshes below this build in one thread each, side by side; larger ones one after another with all threads.
constexpr uint32_t k_parallel_build = 20000;
/// Transforms whose inverse loses this much in float are applied to the vertices instead.
constexpr float k_inverse_error_limit = 64.0f;

/// How much the float inverse amplifies rounding: the sum of the determinant's terms over its absolute value.
float inverse_error(const Transform& t) {
  double terms = 0.0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    terms +=
        std::fabs(double(t.m[0][i]) * t.m[1][j] * t.m[2][k]) + std::fabs(double(t.m[0][i]) * t.m[1][k] * t.m[2][j]);
  }
  return static_cast<float>(std::max(1.0, terms / std::fabs(t.determinant())));
}

/// Whether Embree, which inverts in float with denormals flushed, can.
bool invertible_in_float(const Transform& t, float error) {
  const double determinant = std::fabs(t.determinant());
  return determinant > 1e-30 && determinant < 1e30 && error < k_inverse_error_limit;
}

bool same(const GeometryObject& a, const GeometryObject& b) {
  return a.mesh == b.mesh && a.visibility == b.visibility && a.opaque == b.opaque && a.opaque_slots == b.opaque_slots &&
         a.name == b.name && a.world_from_object == b.world_from_object;
}

/// Vertices in world space: float[V][3], and one float that Embree may read.
std::unique_ptr<float[]> transformed(const TriangleMesh& mesh, const Transform& world_from_object) {
  std::unique_ptr<float[]> result(new float[3 * size_t(mesh.vertex_count()) + 1]);
  result[3 * size_t(mesh.vertex_count())] = 0.0f;
  const Transform& m = world_from_object;
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, mesh.vertex_count(), 16384), [&](const auto& range) {
    for (uint32_t v = range.begin(); v != range.end(); ++v) {
      const Vec3 p = mesh.vertex(v);
      for (int i = 0; i < 3; ++i)
        result[3 * size_t(v) + size_t(i)] =
            static_cast<float>(double(m.m[i][0]) * p.x + double(m.m[i][1]) * p.y + double(m.m[i][2]) * p.z + m.m[i][3]);
    }
  });
  return result;
}

Bounds3 bounds_of(const float* positions, const TriangleMesh& mesh) {
  return tbb::parallel_reduce(
      tbb::blocked_range<size_t>(0, 3 * size_t(mesh.triangle_count()), 65536), Bounds3(),
      [&](const auto& range, Bounds3 bounds) {
        for (size_t i = range.begin(); i != range.end(); ++i) {
          const float* p = positions + 3 * size_t(mesh.indices()[i]);
          bounds.extendBy(Vec3(p[0], p[1], p[2]));
        }
        return bounds;
      },
      [](Bounds3 a, const Bounds3& b) {
        a.extendBy(b);
        return a;
      });
}

/// How one mesh is used in a snapshot.
struct MeshUse {
  std::shared_ptr<const TriangleMesh> mesh;
  uint32_t instances = 0;
  bool filter = false;     ///< some instance is not opaque
  bool flattened = false;  ///< all instances are
  bool object_space = false;
  std::shared_ptr<const MeshScene> scene;
};

}  // namespace

struct GeometryBuilder::State {
  std::shared_ptr<embree::Device> device;
  std::unordered_map<const TriangleMesh*, std::shared_ptr<const MeshScene>> mesh_scenes;
  std::vector<GeometryObject> last_objects;
  GeometryOptions last_options;
  std::weak_ptr<const Geometry> last;  ///< not kept alive: its memory is that of the session's scene

  Status build_mesh_scenes(std::vector<MeshUse*> uses, bool compact, const CancelFlag& cancel);
  Result<std::shared_ptr<const MeshScene>> build_mesh_scene(const MeshUse& use, bool compact, const CancelFlag& cancel);
};

GeometryBuilder::GeometryBuilder() : state_(std::make_unique<State>()) {}
GeometryBuilder::~GeometryBuilder() = default;

Result<std::shared_ptr<const MeshScene>> GeometryBuilder::State::build_mesh_scene(const MeshUse& use, bool compact,
                                                                                  const CancelFlag& cancel) {
  auto result = std::shared_ptr<MeshScene>(
      new MeshScene{use.mesh, embree::Scene(device, use.filter, compact), use.filter, compact});
  RTCGeometry geometry = embree::new_triangles(device->get(), use.mesh->positions(), use.mesh->vertex_count(),
                                               use.mesh->indices(), use.mesh->triangle_count(), 0xffffffffu);
  rtcAttachGeometry(result->scene.get(), geometry);
  rtcReleaseGeometry(geometry);
  if (Status status = result->scene.commit(cancel, fmt::format("mesh '{}'", use.mesh->name())); !status)
    return Error{status.error()};
  return std::shared_ptr<const MeshScene>(std::move(result));
}

Status GeometryBuilder::State::build_mesh_scenes(std::vector<MeshUse*> uses, bool compact, const CancelFlag& cancel) {
  std::vector<std::string> errors(uses.size());
  const auto build_one = [&](size_t i) {
    if (cancel.cancelled()) {
      errors[i] = "cancelled";
      return;
    }
    auto result = build_mesh_scene(*uses[i], compact, cancel);
    if (result)
      uses[i]->scene = *result;
    else
      errors[i] = result.error();
  };
  const auto small = std::partition(uses.begin(), uses.end(),
                                    [](const MeshUse* use) { return use->mesh->triangle_count() >= k_parallel_build; });
  const auto large_count = static_cast<size_t>(small - uses.begin());
  for (size_t i = 0; i < large_count; ++i) build_one(i);
  tbb::parallel_for(large_count, uses.size(), build_one);
  // Kept even if others failed or were cancelled: the next build starts from them.
  for (const MeshUse* use : uses)
    if (use->scene) mesh_scenes[use->mesh.get()] = use->scene;
  for (const std::string& error : errors)
    if (!error.empty()) return Error{error};
  return Ok{};
}

Result<std::shared_ptr<const Geometry>> GeometryBuilder::build(const std::vector<GeometryObject>& objects,
                                                               const GeometryOptions& options, const CancelFlag& cancel,
                                                               Report& report) try {
  State& state = *state_;
  if (auto last = state.last.lock(); last && options == state.last_options &&
                                     objects.size() == state.last_objects.size() &&
                                     std::equal(objects.begin(), objects.end(), state.last_objects.begin(), same))
    return last;
  if (!state.device) {
    auto device = embree::Device::create();
    if (!device) return Error{device.error()};
    state.device = *device;
  }
  state.device->set_memory_limit(options.memory_limit_bytes);

  auto geometry = std::make_shared<Geometry>();
  geometry->scenes_ = std::make_unique<Geometry::Scenes>();
  Geometry::Scenes& scenes = *geometry->scenes_;
  scenes.device = state.device;

  // Instances, and how often each mesh is used.
  std::vector<MeshUse> uses;
  std::unordered_map<const TriangleMesh*, size_t> use_by_mesh;
  std::vector<bool> baked;  // by instance: its transform is no good for Embree
  bool any_transparent_flattened = false;
  for (uint32_t o = 0; o < objects.size(); ++o) {
    const GeometryObject& object = objects[o];
    geometry->first_instances_.push_back(geometry->instance_count());
    geometry->opaque_slots_.push_back(object.opaque || object.opaque_slots.empty()
                                          ? nullptr
                                          : std::make_shared<const std::vector<uint8_t>>(object.opaque_slots));
    size_t dropped = 0;
    for (uint32_t i = 0; i < object.world_from_object.size(); ++i) {
      Instance instance;
      instance.object = o;
      instance.index_in_object = i;
      instance.opaque = object.opaque;
      instance.world_from_object = object.world_from_object[i];
      const bool invertible = instance.world_from_object.is_invertible();
      dropped += !invertible;
      bool bake = false;
      if (invertible) {
        instance.object_from_world = instance.world_from_object.inverse();
        instance.mirrored = instance.world_from_object.mirrors();
        instance.inverse_error = inverse_error(instance.world_from_object);
        bake = !invertible_in_float(instance.world_from_object, instance.inverse_error);
        if (object.mesh) instance.mesh = object.mesh.get();
      }
      if (instance.mesh && !instance.mesh->empty()) {
        const auto [entry, is_new] = use_by_mesh.try_emplace(instance.mesh, uses.size());
        if (is_new) uses.emplace_back().mesh = object.mesh;
        MeshUse& use = uses[entry->second];
        ++use.instances;
        use.filter |= !instance.opaque;
        use.object_space |= !bake;
        geometry->transparent_instances_ += !instance.opaque;
        geometry->triangles_ += instance.mesh->triangle_count();
      }
      baked.push_back(bake);
      geometry->instances_.push_back(instance);
    }
    if (dropped > 0)
      report.warning("singular_transform", object.name,
                     fmt::format("Object '{}': {} of its {} instances left out, because the transform is singular or "
                                 "not finite.",
                                 object.name, dropped, object.world_from_object.size()));
  }
  std::vector<MeshUse*> to_build;
  for (MeshUse& use : uses) {
    scenes.meshes.push_back(use.mesh);
    geometry->mesh_bytes_ += use.mesh->bytes();
    geometry->unique_triangles_ += use.mesh->triangle_count();
    use.flattened = options.flatten && use.instances == 1;
    if (use.flattened || !use.object_space) continue;
    const auto cached = state.mesh_scenes.find(use.mesh.get());
    if (cached != state.mesh_scenes.end() && cached->second->compact == options.compact &&
        (cached->second->filter || !use.filter))
      use.scene = cached->second;
    else
      to_build.push_back(&use);
  }

  Status status = Ok{};
  // An arena of its own: all cores, even if the caller's tasks run in a smaller one. Measured: hits, ties between
  // coincident triangles included, do not depend on the number of threads that build.
  tbb::task_arena arena;
  arena.execute([&] {
    status = state.build_mesh_scenes(to_build, options.compact, cancel);
    if (!status) return;
    for (uint32_t i = 0; i < geometry->instance_count(); ++i) {
      const Instance& instance = geometry->instances_[i];
      if (instance.mesh && !instance.mesh->empty() && !instance.opaque)
        any_transparent_flattened |= baked[i] || uses[use_by_mesh[instance.mesh]].flattened;
    }
    scenes.top = std::make_unique<embree::Scene>(state.device, any_transparent_flattened, options.compact);
    for (uint32_t i = 0; i < geometry->instance_count(); ++i) {
      Instance& instance = geometry->instances_[i];
      if (!instance.mesh || instance.mesh->empty()) continue;
      if (cancel.cancelled()) {
        status = Error{"cancelled"};
        return;
      }
      const MeshUse& use = uses[use_by_mesh[instance.mesh]];
      const uint32_t mask = embree_mask(objects[instance.object].visibility, instance.opaque);
      RTCGeometry entry;
      if (use.flattened || baked[i]) {
        if (instance.world_from_object == Transform()) {
          instance.positions_world = instance.mesh->positions();
        } else {
          scenes.positions_world.push_back(transformed(*instance.mesh, instance.world_from_object));
          instance.positions_world = scenes.positions_world.back().get();
          geometry->mesh_bytes_ += 3 * sizeof(float) * size_t(instance.mesh->vertex_count());
        }
        geometry->bounds_.extendBy(bounds_of(instance.positions_world, *instance.mesh));
        entry = embree::new_triangles(state.device->get(), instance.positions_world, instance.mesh->vertex_count(),
                                      instance.mesh->indices(), instance.mesh->triangle_count(), mask);
      } else {
        geometry->bounds_.extendBy(instance.world_from_object.bounds(instance.mesh->bounds_object()));
        entry = rtcNewGeometry(state.device->get(), RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(entry, use.scene->scene.get());
        rtcSetGeometryTransform(entry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, &instance.world_from_object.m[0][0]);
        rtcSetGeometryMask(entry, mask);
        rtcCommitGeometry(entry);
      }
      rtcAttachGeometryByID(scenes.top->get(), entry, i);
      rtcReleaseGeometry(entry);
    }
    status = scenes.top->commit(cancel, "the scene");
  });
  if (!status) return Error{status.error()};

  // What this snapshot does not use is not kept for the next.
  state.mesh_scenes.clear();
  for (const MeshUse& use : uses)
    if (use.scene) {
      scenes.mesh_scenes.push_back(use.scene);
      state.mesh_scenes[use.mesh.get()] = use.scene;
    }
  state.last_objects = objects;
  state.last_options = options;
  state.last = geometry;
  return std::shared_ptr<const Geometry>(std::move(geometry));
} catch (const std::bad_alloc&) {
  return Error{"Not enough memory for the scene's geometry."};
}

}  // namespace lambent
