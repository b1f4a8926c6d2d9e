#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <mutex>
#include <new>
#include <system_error>
#include <unordered_map>

#include "engine/geometry/geometry.h"
#include "engine/geometry/geometry_scenes.h"

namespace lambent {

namespace {

/// Meshes below this build in one thread each, side by side; larger ones one after another with all threads.
constexpr uint32_t k_parallel_build = 20000;
/// Transforms whose inverse loses this much in float are applied to the vertices instead.
constexpr float k_inverse_error_limit = 64.0f;
/// How often a waiting build() looks at its cancel flag.
constexpr std::chrono::milliseconds k_cancel_interval(5);

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

/// Whether angles change: some axis is stretched more than another, or they are not at right angles.
bool is_uneven(const Transform& t) {
  constexpr double k_tolerance = 1e-5;
  double products[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      products[i][j] = 0.0;
      for (const auto& row : t.m) products[i][j] += double(row[i]) * double(row[j]);
    }
  const double largest = std::max({products[0][0], products[1][1], products[2][2]});
  const double least = std::min({products[0][0], products[1][1], products[2][2]});
  const double skew = std::max({std::fabs(products[0][1]), std::fabs(products[0][2]), std::fabs(products[1][2])});
  return largest - least > k_tolerance * largest || skew > k_tolerance * largest;
}

/// Whether Embree, which inverts in float with denormals flushed, can.
bool invertible_in_float(const Transform& t, float error) {
  const double determinant = std::fabs(t.determinant());
  return determinant > 1e-30 && determinant < 1e30 && error < k_inverse_error_limit;
}

bool same(const GeometryObject& a, const GeometryObject& b) {
  return a.mesh == b.mesh && a.visibility == b.visibility && a.opaque == b.opaque &&
         a.normals_at_vertices == b.normals_at_vertices && a.opaque_slots == b.opaque_slots && a.name == b.name &&
         a.world_from_object == b.world_from_object;
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
  bool filter = false;        ///< some instance is not opaque
  bool flattened = false;     ///< goes into the top level
  bool object_space = false;  ///< some instance can be traced in object space
  std::shared_ptr<const MeshScene> scene;
};

/// Finished meshes, shared between a builder and a build that it has abandoned.
class MeshSceneCache {
 public:
  std::shared_ptr<const MeshScene> find(const TriangleMesh* mesh, bool filter, bool compact) {
    const std::lock_guard lock(mutex_);
    const auto found = scenes_.find(mesh);
    if (found == scenes_.end() || found->second->compact != compact || (filter && !found->second->filter))
      return nullptr;
    return found->second;
  }
  void insert(std::shared_ptr<const MeshScene> scene) {
    const std::lock_guard lock(mutex_);
    scenes_[scene->mesh.get()] = std::move(scene);
  }
  void clear() {
    const std::lock_guard lock(mutex_);
    scenes_.clear();
  }

 private:
  std::mutex mutex_;
  std::unordered_map<const TriangleMesh*, std::shared_ptr<const MeshScene>> scenes_;
};

}  // namespace

/// One build: owns or shares all that it touches, so that it can outlive the call that started it.
struct GeometryBuilder::Job {
  std::shared_ptr<embree::Device> device;
  std::shared_ptr<MeshSceneCache> cache;
  GeometryOptions options;
  CancelFlag cancel;
  std::shared_ptr<Geometry> geometry;
  std::vector<MeshUse> uses;
  std::unordered_map<const TriangleMesh*, size_t> use_by_mesh;
  std::vector<bool> baked;  ///< by instance: its transform is no good for Embree

  void add_instances(const std::vector<GeometryObject>& objects, Report& report);
  Status run();
  Status build_meshes();
  Status build_mesh(MeshUse& use);
  Status build_top();
  bool in_top_level(uint32_t instance) const {
    return baked[instance] || uses[use_by_mesh.at(geometry->instances_[instance].mesh)].flattened;
  }
};

struct GeometryBuilder::State {
  std::shared_ptr<embree::Device> device;
  std::shared_ptr<MeshSceneCache> cache = std::make_shared<MeshSceneCache>();
  std::vector<GeometryObject> last_objects;
  GeometryOptions last_options;
  std::weak_ptr<const Geometry> last;  ///< not kept alive: its memory is that of the session's scene
  std::shared_ptr<Job> job;            ///< the newest; abandoned if its result was not awaited
  std::future<Status> result;          ///< of the job; its destructor waits
};

GeometryBuilder::GeometryBuilder() : state_(std::make_unique<State>()) {}

GeometryBuilder::~GeometryBuilder() {
  if (state_->job) state_->job->cancel.cancel();
}

void GeometryBuilder::Job::add_instances(const std::vector<GeometryObject>& objects, Report& report) {
  Geometry& g = *geometry;
  for (uint32_t o = 0; o < objects.size(); ++o) {
    const GeometryObject& object = objects[o];
    g.first_instances_.push_back(g.instance_count());
    g.opaque_slots_.push_back(object.opaque || object.opaque_slots.empty()
                                  ? nullptr
                                  : std::make_shared<const std::vector<uint8_t>>(object.opaque_slots));
    size_t dropped = 0;
    for (uint32_t i = 0; i < object.world_from_object.size(); ++i) {
      Instance instance;
      instance.object = o;
      instance.index_in_object = i;
      instance.visibility = object.visibility;
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
        instance.normals_at_vertices = object.normals_at_vertices && is_uneven(instance.world_from_object);
        instance.mesh = object.mesh.get();
      }
      if (instance.mesh && !instance.mesh->empty()) {
        const auto [entry, is_new] = use_by_mesh.try_emplace(instance.mesh, uses.size());
        if (is_new) uses.emplace_back().mesh = object.mesh;
        MeshUse& use = uses[entry->second];
        ++use.instances;
        use.filter |= !instance.opaque;
        use.object_space |= !bake;
        g.transparent_instances_ += !instance.opaque;
        g.triangles_ += instance.mesh->triangle_count();
      }
      baked.push_back(bake);
      g.instances_.push_back(instance);
    }
    if (object.mesh) g.scenes_->meshes.push_back(object.mesh);
    if (dropped > 0)
      report.warning("singular_transform", object.name,
                     fmt::format("Object '{}': {} of its {} instances left out, because the transform is singular or "
                                 "not finite.",
                                 object.name, dropped, object.world_from_object.size()));
  }
  for (MeshUse& use : uses) {
    use.flattened = options.flatten && use.instances == 1;
    g.mesh_bytes_ += use.mesh->bytes();
    g.unique_triangles_ += use.mesh->triangle_count();
  }
}

Status GeometryBuilder::Job::build_mesh(MeshUse& use) {
  if (cancel.cancelled()) return Error{"cancelled"};
  auto result = std::shared_ptr<MeshScene>(
      new MeshScene{use.mesh, embree::Scene(device, use.filter, options.compact), use.filter, options.compact});
  RTCGeometry triangles = embree::new_triangles(device->get(), use.mesh->positions(), use.mesh->vertex_count(),
                                                use.mesh->indices(), use.mesh->triangle_count(), 0xffffffffu);
  rtcAttachGeometry(result->scene.get(), triangles);
  rtcReleaseGeometry(triangles);
  Status status = result->scene.commit(cancel, fmt::format("mesh '{}'", use.mesh->name()));
  if (!status) return status;
  use.scene = result;
  cache->insert(std::move(result));
  return Ok{};
}

Status GeometryBuilder::Job::build_meshes() {
  std::vector<MeshUse*> large, small;
  for (MeshUse& use : uses) {
    if (use.flattened || !use.object_space) continue;
    use.scene = cache->find(use.mesh.get(), use.filter, options.compact);
    if (!use.scene) (use.mesh->triangle_count() >= k_parallel_build ? large : small).push_back(&use);
  }
  for (MeshUse* use : large)
    if (Status status = build_mesh(*use); !status) return status;
  std::vector<std::string> errors(small.size());
  tbb::parallel_for(size_t(0), small.size(), [&](size_t i) {
    if (Status status = build_mesh(*small[i]); !status) errors[i] = status.error();
  });
  for (const std::string& error : errors)
    if (!error.empty()) return Error{error};
  return Ok{};
}

Status GeometryBuilder::Job::build_top() {
  Geometry& g = *geometry;
  Geometry::Scenes& scenes = *g.scenes_;
  const auto present = [&](uint32_t i) { return g.instances_[i].mesh && !g.instances_[i].mesh->empty(); };
  bool filter = false;
  for (uint32_t i = 0; i < g.instance_count(); ++i) filter |= present(i) && !g.instances_[i].opaque && in_top_level(i);
  scenes.top = std::make_unique<embree::Scene>(device, filter, options.compact);
  for (uint32_t i = 0; i < g.instance_count(); ++i) {
    if (!present(i)) continue;
    if (cancel.cancelled()) return Error{"cancelled"};
    Instance& instance = g.instances_[i];
    const TriangleMesh& mesh = *instance.mesh;
    const uint32_t mask = embree_mask(instance.visibility, instance.opaque);
    RTCGeometry entry;
    if (in_top_level(i)) {
      if (instance.world_from_object == Transform()) {
        instance.positions_world = mesh.positions();
        g.bounds_.extendBy(mesh.bounds_object());
      } else {
        scenes.positions_world.push_back(transformed(mesh, instance.world_from_object));
        instance.positions_world = scenes.positions_world.back().get();
        g.mesh_bytes_ += 3 * sizeof(float) * size_t(mesh.vertex_count());
        g.bounds_.extendBy(bounds_of(instance.positions_world, mesh));
      }
      entry = embree::new_triangles(device->get(), instance.positions_world, mesh.vertex_count(), mesh.indices(),
                                    mesh.triangle_count(), mask);
    } else {
      g.bounds_.extendBy(instance.world_from_object.bounds(mesh.bounds_object()));
      entry = rtcNewGeometry(device->get(), RTC_GEOMETRY_TYPE_INSTANCE);
      rtcSetGeometryInstancedScene(entry, uses[use_by_mesh.at(&mesh)].scene->scene.get());
      rtcSetGeometryTransform(entry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, &instance.world_from_object.m[0][0]);
      rtcSetGeometryMask(entry, mask);
      rtcCommitGeometry(entry);
    }
    rtcAttachGeometryByID(scenes.top->get(), entry, i);
    rtcReleaseGeometry(entry);
  }
  for (const MeshUse& use : uses)
    if (use.scene) scenes.mesh_scenes.push_back(use.scene);
  return scenes.top->commit(cancel, "the scene");
}

Status GeometryBuilder::Job::run() try {
  Status status = Ok{};
  // An arena of its own: all cores, even if the caller's tasks run in a smaller one. Measured: hits, ties between
  // coincident triangles included, do not depend on the number of threads that build.
  tbb::task_arena arena;
  arena.execute([&] {
    status = build_meshes();
    if (status) status = build_top();
  });
  return status;
} catch (const std::bad_alloc&) {
  return Error{"Not enough memory for the scene's geometry."};
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
  // True when the job is done, false when cancelled.
  const auto await_job = [&] {
    while (state.result.wait_for(k_cancel_interval) != std::future_status::ready)
      if (cancel.cancelled()) {
        state.job->cancel.cancel();
        return false;
      }
    return true;
  };
  if (state.result.valid()) {
    // An abandoned build still holds memory and cores.
    if (!await_job()) return Error{"cancelled"};
    state.result = {};
    state.job.reset();
  }
  if (cancel.cancelled()) return Error{"cancelled"};

  state.device->set_memory_limit(options.memory_limit_bytes);
  state.job = std::make_shared<Job>();
  Job& job = *state.job;
  job.device = state.device;
  job.cache = state.cache;
  job.options = options;
  job.geometry = std::make_shared<Geometry>();
  job.geometry->scenes_ = std::make_unique<Geometry::Scenes>();
  job.geometry->scenes_->device = state.device;
  job.add_instances(objects, report);

  state.result = std::async(std::launch::async, [shared = state.job] {
    Status status = shared->run();
    if (!status) shared->geometry.reset();  // here, not in the caller: freeing takes time too
    return status;
  });
  if (!await_job()) return Error{"cancelled"};
  const Status status = state.result.get();
  const std::shared_ptr<Job> done = std::move(state.job);
  if (!status) return Error{status.error()};

  // What this snapshot does not use is not kept for the next.
  state.cache->clear();
  for (const MeshUse& use : done->uses)
    if (use.scene) state.cache->insert(use.scene);
  state.last_objects = objects;
  state.last_options = options;
  state.last = done->geometry;
  return std::shared_ptr<const Geometry>(done->geometry);
} catch (const std::bad_alloc&) {
  return Error{"Not enough memory for the scene's geometry."};
} catch (const std::system_error& error) {
  return Error{fmt::format("The geometry cannot be built: {}.", error.what())};
}

}  // namespace lambent
