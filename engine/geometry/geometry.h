// All surfaces of a scene, ready for rays: an immutable snapshot in two levels, made by GeometryBuilder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "engine/base/cancel.h"
#include "engine/base/report.h"
#include "engine/base/result.h"
#include "engine/base/transform.h"
#include "engine/geometry/ray.h"
#include "engine/geometry/triangle_mesh.h"

namespace lambent {

/// N instances of one mesh.
struct GeometryObject {
  std::string name;  ///< the user's, for messages
  std::shared_ptr<const TriangleMesh> mesh;
  std::vector<Transform> world_from_object;
  uint32_t visibility = k_visible_all;  ///< bits of RayKind (see ray.h)
  /// Whether shadow rays are simply blocked. If not, Geometry::occluded(ray, visitor) asks the visitor hit by hit ...
  bool opaque = true;
  /// ... except on material slots that are opaque: by slot, nonzero is opaque; missing slots are not. May be empty.
  std::vector<uint8_t> opaque_slots;
  /// Under uneven scale: each vertex's normal is turned to the world and normalised before normals are interpolated, as
  /// in Cycles for a mesh that one object alone shows. Else interpolated ones are turned.
  bool normals_at_vertices = false;
};

/// A mesh placed in the world. Owned by its Geometry.
struct Instance {
  const TriangleMesh* mesh = nullptr;  ///< null: dropped (singular or non-finite transform)
  Transform world_from_object, object_from_world;
  float inverse_error = 1.0f;  ///< how much the inverse amplifies rounding: at least 1
  uint32_t visibility = k_visible_all;
  uint32_t object = 0;           ///< index into the builder's list of objects
  uint32_t index_in_object = 0;  ///< which of the object's transforms
  bool mirrored = false;
  bool opaque = true;                      ///< as given
  bool normals_at_vertices = false;        ///< as given, if the scale is uneven
  const float* positions_world = nullptr;  ///< float[V][3] if flattened into the top level, else null
};

/// A surface point in world space.
struct SurfaceHit {
  Vec3 p_world{0.0f};  ///< inside its triangle, interpolated from the vertices
  float p_error =
      0.0f;  ///< metres along ng that p and any intersection with this triangle may be off by; for offset_origin
  Vec3 ng_world{0, 0, 1};  ///< unit geometric normal of the front (as modelled: not turned towards the ray)
  Vec3 ns_world{0, 0, 1};  ///< unit interpolated normal; same hemisphere convention as modelled
  Vec3 dpdu_world{1, 0, 0}, dpdv_world{0, 1, 0};  ///< edges p1 - p0 and p2 - p0: derivatives by the barycentrics
  Vec2 barycentric{0, 0};
  uint32_t instance = k_no_index, primitive = k_no_index, material_slot = 0;
  const TriangleMesh* mesh = nullptr;
};

struct GeometryOptions {
  /// Meshes with one instance go into the top level in world space: faster rays; but moving one of them rebuilds the
  /// top level with all of them. Off for interactive editing: then moving an object rebuilds only a small top level.
  bool flatten = true;
  /// Less memory and slower rays (Embree's compact mode).
  bool compact = false;
  /// Acceleration structures of this builder may take so many bytes, 0: any; more is an Error.
  size_t memory_limit_bytes = 0;

  friend bool operator==(const GeometryOptions&, const GeometryOptions&) = default;
};

/// Immutable, thread-safe. Threads that trace hold a DenormalsFlushed.
class Geometry {
 public:
  Geometry();  ///< empty: every ray misses
  ~Geometry();
  Geometry(const Geometry&) = delete;
  Geometry& operator=(const Geometry&) = delete;

  /// Closest hit; false (and hit untouched) if there is none.
  bool intersect(const Ray& ray, Hit& hit) const;
  /// The nearest hit with one instance, past all others (64 of their surfaces at most); ray.t_min moves beyond what was
  /// met, so that the next call goes on from there. @param rays if given, grows by the rays that it took
  bool intersect_instance(Ray& ray, uint32_t instance, Hit& hit, uint64_t* rays = nullptr) const;
  /// Whether anything lies on the ray, opaque or not. Runs no filter.
  bool occluded(const Ray& ray) const;
  /// Whether the ray is blocked, letting non-opaque surfaces through as `visitor` says: bool(const Hit&), true to go on
  /// (after multiplying its own transmittance), false to block. Every non-opaque surface on the ray is visited at most
  /// once, in no particular order; opaque ones block before any visit. Same cost as occluded(ray) if all is opaque.
  template <typename Visitor>
  requires std::is_invocable_r_v<bool, Visitor, const Hit&>
  bool occluded(const Ray& ray, Visitor&& visitor) const {
    using Plain = std::remove_reference_t<Visitor>;
    return occluded_visiting(
        ray, [](void* context, const Hit& hit) -> bool { return (*static_cast<Plain*>(context))(hit); },
        const_cast<std::remove_const_t<Plain>*>(&visitor));
  }
  /// Whether any instance is not opaque: only then is the visiting occluded() needed.
  bool has_transparent_shadows() const { return transparent_instances_ > 0; }

  /// Position, normals and error bound of a hit.
  SurfaceHit surface(const Hit& hit) const { return surface(hit.instance, hit.primitive, hit.barycentric); }
  SurfaceHit surface(uint32_t instance, uint32_t primitive, const Vec2& barycentric) const;
  /// The triangle in world space, as rays meet it.
  Triangle triangle_world(uint32_t instance, uint32_t primitive) const;

  /// Instances in the order given: object by object, transform by transform. Dropped ones keep their number.
  uint32_t instance_count() const { return static_cast<uint32_t>(instances_.size()); }
  const Instance& instance(uint32_t index) const { return instances_[index]; }
  /// First instance of an object; the others follow.
  uint32_t first_instance(uint32_t object) const { return first_instances_[object]; }
  const Bounds3& bounds_world() const { return bounds_; }

  uint64_t triangle_count() const { return triangles_; }                ///< instances counted each
  uint64_t unique_triangle_count() const { return unique_triangles_; }  ///< meshes counted once
  size_t mesh_bytes() const { return mesh_bytes_; }  ///< vertex, index and attribute arrays, and world copies
  size_t bvh_bytes() const;                          ///< acceleration structures (of the builder that made this)

 private:
  bool occluded_visiting(const Ray& ray, bool (*visit)(void*, const Hit&), void* context) const;

  struct Scenes;

  std::unique_ptr<Scenes> scenes_;  ///< Embree's, and what they refer to; null if empty
  std::vector<Instance> instances_;
  std::vector<uint32_t> first_instances_;
  std::vector<std::shared_ptr<const std::vector<uint8_t>>> opaque_slots_;  ///< by object; null: none
  Bounds3 bounds_;
  uint64_t triangles_ = 0, unique_triangles_ = 0;
  size_t mesh_bytes_ = 0;
  uint32_t transparent_instances_ = 0;
  friend class GeometryBuilder;
};

/// Makes snapshots, and keeps what consecutive ones share: a mesh (by pointer) that was in the previous snapshot is not
/// built again. One per session. build() is for one thread at a time; snapshots outlive their builder.
class GeometryBuilder {
 public:
  GeometryBuilder();
  ~GeometryBuilder();  ///< waits for what a cancelled build left running (up to a second for 10 million triangles)
  GeometryBuilder(const GeometryBuilder&) = delete;
  GeometryBuilder& operator=(const GeometryBuilder&) = delete;

  /// Builds in parallel on TBB's threads. Instances with a singular or non-finite transform are dropped and reported by
  /// object name. Error: out of memory, over the memory limit, Embree unavailable, or "cancelled": within 100 ms of the
  /// flag, though Embree may need longer to notice (then it goes on in the background, and the next build waits for
  /// that). Meshes finished by then are kept for the next call.
  Result<std::shared_ptr<const Geometry>> build(const std::vector<GeometryObject>& objects,
                                                const GeometryOptions& options, const CancelFlag& cancel,
                                                Report& report);

 private:
  struct Job;
  struct State;
  std::unique_ptr<State> state_;
};

/// While it lives, the calling thread flushes denormals to zero, which Embree asks for; restores the mode afterwards.
class DenormalsFlushed {
 public:
  DenormalsFlushed();
  ~DenormalsFlushed();
  DenormalsFlushed(const DenormalsFlushed&) = delete;
  DenormalsFlushed& operator=(const DenormalsFlushed&) = delete;

 private:
  unsigned mode_;
};

}  // namespace lambent
