// An immutable snapshot of everything a render reads. Made by SceneBuilder; shared by threads; never changes.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "engine/assets/texture_system.h"
#include "engine/camera/camera.h"
#include "engine/geometry/geometry.h"
#include "engine/lights/light_set.h"
#include "engine/scene/mesh_attributes.h"
#include "engine/scene/profile.h"
#include "engine/scene/scene_motion.h"
#include "engine/scene/shader_rays.h"
#include "engine/shading/program.h"
#include "engine/shading/shading_point.h"

namespace lambent {

/// A material as it meets a mesh: the program and where the mesh keeps what the program asks for.
struct SurfaceBinding {
  std::shared_ptr<const Program> program;
  AttributeIndices attributes{};
  uint32_t first_object_value = 0;  ///< where Scene's values for the requests of kind object begin
  uint32_t material_pass_index = 0;
  float material_id = 0.0f;       ///< name_id of the material, if some pass asks for it
  bool samples_emission = false;  ///< its triangles are in the LightSet
};

/// What passes ask of an object: name_id of it and of its asset.
struct ObjectIds {
  float object = 0.0f, asset = 0.0f;
};

/// Light linking of an object: the sets that it is in, number n as bit n - 1, and the sets of what it emits.
struct ObjectLinks {
  uint64_t receives = 0, blocks = 0;
  LinkSets emitted;
  uint8_t choices = 0;  ///< LightChoices::linked of its surfaces
};

/// What shading needs to know about an instance. 24 bytes.
struct InstanceShading {
  uint32_t first_binding = 0;  ///< of Scene's bindings, by material slot
  uint32_t slots = 1;          ///< higher slots take the last
  uint32_t random_id = 0;
  uint32_t object_index = 0;
  uint32_t object_pass_index = 0;
  uint16_t light_group = 0;         ///< of what its surfaces emit
  bool holdout : 1 = false;         ///< the camera sees a hole there
  bool shadow_catcher : 1 = false;  ///< ... through which the world shows if the film is opaque
  bool matte : 1 = false;           ///< catches more than shadows
};
static_assert(sizeof(InstanceShading) == 24);

/// Extent of a pixel along a ray: width_m + spread * t (ray cones, Akenine-Möller et al. 2019).
struct RayCone {
  float width_m = 0.0f, spread = 0.0f;
};

/// Where a path stands, for the Light Path node.
struct PathCounts {
  uint32_t ray_kind = k_ray_camera;
  int depth = 0, diffuse = 0, glossy = 0, transmission = 0, transparent = 0;
};

/// Counts for the statistics.
struct SceneStatistics {
  uint64_t triangles = 0, unique_triangles = 0, instances = 0, emitters = 0;
  size_t geometry_bytes = 0, bvh_bytes = 0, texture_bytes = 0, light_bytes = 0, shading_bytes = 0;
};

class Scene {
 public:
  const Camera& camera() const { return camera_; }
  const Geometry& geometry() const { return *geometry_; }
  const LightSet& lights() const { return *lights_; }
  const TextureSystem* textures() const { return textures_.get(); }
  const SceneProfile& profile() const { return profile_; }
  /// There are lights that scattered rays may meet.
  bool rays_meet_light() const {
    return profile_.emissive_meshes || lights_->has_visible_lamps() || lights_->has_infinite_lights();
  }
  /// Objects whose light only camera walks find (LightTraits::starts_walks), the world's name among them.
  const std::vector<std::string>& lights_without_walks() const { return lights_without_walks_; }
  /// Names of objects some of whose materials emit.
  const std::set<std::string>& emissive_objects() const { return emissive_objects_; }
  /// The camera may see objects that show nothing but the shadows on them.
  bool has_shadow_catchers() const { return has_shadow_catchers_; }
  /// ... some of them also the light that comes by way of other objects.
  bool has_mattes() const { return has_mattes_; }
  /// Names of the mattes that passes ask for.
  const std::vector<std::string>& mattes() const { return mattes_; }
  static constexpr size_t k_most_mattes = 64;
  /// Whether a matte, by its number in mattes(), shows an object.
  bool in_matte(uint32_t object_index, size_t matte) const { return (object_mattes_[object_index] >> matte & 1u) != 0; }
  /// Null unless a pass asks for motion.
  const SceneMotion* motion() const { return motion_.get(); }
  /// What a ray that leaves the scene along `direction` sees of the world and of suns.
  Color background_radiance(const Vec3& direction_world, const PathCounts& counts) const {
    Color radiance(0.0f);
    lights_->for_each_infinite(direction_world, counts.ray_kind,
                               [&](const LightHit& hit) { radiance += light_radiance(hit, counts); });
    return radiance;
  }
  const ViewSpace& view() const { return view_; }
  const InstanceShading& instance(uint32_t instance) const { return instances_[instance]; }
  /// By object_index; empty unless the settings ask for passes of ids.
  const ObjectIds& ids(uint32_t object_index) const { return object_ids_[object_index]; }
  /// Names of the light groups: number n of LightTraits::group is the n-th, counted from 1.
  const std::vector<std::string>& light_groups() const { return light_groups_; }
  /// What next event at the surfaces of an instance chooses among.
  LightChoices light_choices(uint32_t instance, EvenWorld even_world) const {
    if (object_links_.empty()) return even_world;
    return {even_world, object_links_[instances_[instance].object_index].choices};
  }
  /// Whether light of a set of receivers reaches the surfaces of an instance.
  bool reaches(uint8_t receivers, uint32_t instance) const {
    return receivers == 0 || (object_links_[instances_[instance].object_index].receives >> (receivers - 1) & 1u) != 0;
  }
  /// Whether the surfaces of an instance block light of a set of blockers.
  bool blocks(uint8_t blockers, uint32_t instance) const {
    return blockers == 0 || (object_links_[instances_[instance].object_index].blocks >> (blockers - 1) & 1u) != 0;
  }
  /// The sets of blockers that an instance is in, number n as bit n - 1.
  uint64_t blocked_sets(uint32_t instance) const { return object_links_[instances_[instance].object_index].blocks; }
  /// Linking of what the surfaces of an instance emit.
  LinkSets emission_links(uint32_t instance) const {
    return object_links_.empty() ? LinkSets{} : object_links_[instances_[instance].object_index].emitted;
  }
  /// Sets of blockers that emissive meshes have, number n as bit n - 1.
  uint64_t shadow_linked_meshes() const { return shadow_linked_meshes_; }
  /// The user's world position is p_world + origin_shift.
  const Vec3d& origin_shift() const { return origin_shift_; }
  SceneStatistics statistics() const;
  /// Some light has negative power, so that samples may rightly be negative.
  bool subtracts_light() const { return subtracts_light_; }

  /// The material at a hit. Cheap: no shading is done.
  const SurfaceBinding& binding(uint32_t instance, uint32_t material_slot) const {
    const InstanceShading& shading = instances_[instance];
    return bindings_[shading.first_binding + std::min(material_slot, shading.slots - 1)];
  }

  /// Fills `point` for running the program of `binding` at `hit`. `wi_world` unit, towards where the ray came from.
  void fill_shading_point(const SurfaceHit& hit, const SurfaceBinding& binding, const Vec3& wi_world, float ray_length,
                          const RayCone& cone, const PathCounts& counts, ShadingPoint& point) const;

  /// About one pixel at a point that the camera sees, for walks that do not come from it.
  RayCone footprint_at(const Vec3& p_world) const {
    return {pixel_width_m_ + pixel_spread_ * length(p_world - camera_.origin()), 0.0f};
  }

  /// Radiance of the world along unit `direction_world` as seen by rays of `ray_kind`, black without a world program.
  Color environment(const Vec3& direction_world, const PathCounts& counts) const;

  /// Radiance of a lamp or the world, as sampled or hit, towards the receiver, its program run if it has one.
  template <typename LightPoint>
  Color light_radiance(const LightPoint& light, const PathCounts& counts) const {
    if (!light.traits->program) return light.radiance;
    return programmed_radiance(light.light, light.direction_world, light.distance_m, light.p_light_world,
                               light.n_light_world, light.uv, light.radiance, *light.traits, counts);
  }
  /// The same for a sampled point, which may also be on an emissive triangle.
  Color sample_radiance(const LightSample& sample, const PathCounts& counts) const {
    if (!sample.traits->program || lights_->kind(sample.light) != LightKind::triangle)
      return light_radiance(sample, counts);
    return triangle_radiance(sample.instance, sample.triangle, sample.uv, -sample.direction_world, sample.distance_m,
                             counts);
  }
  /// The same for a ray that leaves a light: along it for radiance, else of EmissionSample's measure.
  Color emitted_radiance(const EmissionSample& emission) const;
  LightSource source_of(LightIndex light) const {
    const LightKind kind = lights_->kind(light);
    return kind == LightKind::triangle      ? LightSource::surface
           : kind == LightKind::environment ? LightSource::background
                                            : LightSource::lamp;
  }
  /// Light of the emissive triangle at a hit; k_no_light if it is not sampled.
  LightIndex light_at(const SurfaceHit& hit) const { return lights_->find_triangle(hit.instance, hit.primitive); }

 private:
  friend class SceneBuilder;
  Color triangle_radiance(uint32_t instance, uint32_t primitive, const Vec2& barycentric, const Vec3& wi_world,
                          float distance, const PathCounts& counts) const;
  explicit Scene(const Camera& camera) : camera_(camera) {}

  Color programmed_radiance(LightIndex light, const Vec3& direction, float distance, const Vec3& p_light,
                            const Vec3& n_light, const Vec2& uv, const Color& radiance, const LightTraits& traits,
                            const PathCounts& counts) const;

  Camera camera_;
  std::shared_ptr<const Geometry> geometry_;
  SceneShaderRays rays_{geometry_};
  std::vector<std::shared_ptr<const TriangleMesh>> meshes_;  ///< keeps those of geometry_ alive
  std::vector<InstanceShading> instances_;
  std::vector<SurfaceBinding> bindings_;
  std::vector<Vec4> object_values_;        ///< what requests of kind object read, binding after binding
  std::vector<Vec4> object_colors_;        ///< by object_index
  std::vector<ParticleState> particles_;   ///< by instance; empty if no program asks or no instance is a particle
  std::vector<ObjectIds> object_ids_;      ///< by object_index
  std::vector<ObjectLinks> object_links_;  ///< by object_index; empty if no light is linked
  uint64_t shadow_linked_meshes_ = 0;
  std::vector<std::string> light_groups_;
  ViewSpace view_;  ///< of camera_
  std::shared_ptr<const LightSet> lights_;
  struct LampProgram {
    std::shared_ptr<const Program> program;
    Transform world_from_light, light_from_world;
  };
  std::vector<LampProgram> lamp_programs_;  ///< LightTraits::user of lamps with programs
  std::shared_ptr<const Program> world_;
  std::shared_ptr<const TextureSystem> textures_;
  SceneProfile profile_;
  std::vector<std::string> lights_without_walks_;
  std::set<std::string> emissive_objects_;
  bool has_shadow_catchers_ = false, has_mattes_ = false;
  std::vector<std::string> mattes_;
  std::vector<uint64_t> object_mattes_;  ///< by object_index: number n of mattes_ as bit n; empty without mattes_
  std::shared_ptr<const SceneMotion> motion_;
  Vec3d origin_shift_{0.0};
  bool subtracts_light_ = false;
  float pixel_width_m_ = 0.0f, pixel_spread_ = 0.0f;  ///< at the middle of the frame
};

}  // namespace lambent
