#include "engine/scene/scene_builder.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <map>
#include <new>
#include <unordered_map>
#include <utility>

#include "engine/scene/convert.h"
#include "engine/scene/world_map.h"
#include "engine/shading/graph.h"

namespace lambent {

using description::SceneDescription;

namespace {

constexpr const char* k_cancelled = "cancelled";

/// What was made from one immutable datablock, with the messages of making it (repeated in every build that uses it).
template <typename Source, typename Made>
struct Cached {
  std::shared_ptr<const Source> source;  ///< kept, so that its address is not used again
  Made made;
  Report report;
};
template <typename Source, typename Made>
using Cache = std::unordered_map<const Source*, Cached<Source, Made>>;

/// Forgets what the description no longer names.
template <typename Source, typename Made>
void forget_unused(Cache<Source, Made>& cache, const description::Table<Source>& table) {
  std::unordered_map<const Source*, bool> used;
  for (const auto& [id, source] : table) used[source.get()] = true;
  std::erase_if(cache, [&](const auto& entry) { return !used.count(entry.first); });
}

bool uses_images(const description::Graph& graph) {
  for (const description::Node& node : graph.nodes)
    if (node.properties.count("image")) return true;
  return false;
}

/// How far the world is moved so that coordinates are small: nothing unless the scene is far from the origin compared with
/// its size, where float positions would lose what the picture shows.
Vec3d choose_origin_shift(const Bounds3& bounds) {
  if (bounds.isEmpty()) return Vec3d(0.0);
  const Vec3d center = (Vec3d(bounds.min) + Vec3d(bounds.max)) * 0.5;
  const double extent = (Vec3d(bounds.max) - Vec3d(bounds.min)).length();
  const double distance = std::max({std::fabs(center.x), std::fabs(center.y), std::fabs(center.z)});
  if (!std::isfinite(extent) || !std::isfinite(distance) || distance <= 4.0 * extent) return Vec3d(0.0);
  return Vec3d(Vec3(center));  // a float value: exact to add and subtract
}

}  // namespace

struct SceneBuilder::State {
  SceneBuilderOptions options;
  std::shared_ptr<TextureSystem> textures;
  std::string ocio_config;
  Cache<description::Mesh, std::shared_ptr<const TriangleMesh>> meshes;
  Cache<description::Image, TextureHandle> images;
  description::Table<description::Image> image_table;  ///< that the programs below were compiled with
  Cache<description::Material, std::shared_ptr<const Program>> materials;
  Cache<description::World, std::shared_ptr<const Program>> worlds;
  Cache<description::Light, std::shared_ptr<const Program>> lights;
  std::pair<std::shared_ptr<const Program>, EnvironmentLight> world_map;  ///< the last world's importance map
  GeometryBuilder geometry;

  /// One build: what it makes and reads.
  struct Build {
    const SceneDescription& description;
    const CancelFlag& cancel;
    Report& report;
    std::shared_ptr<Scene> scene;
    /// Objects that have a usable mesh, in the order of GeometryObject.
    std::vector<std::pair<const description::Object*, uint32_t>> mesh_objects;  ///< and number among all objects
    std::vector<GeometryObject> geometry_objects;
    std::vector<uint32_t> first_bindings;  ///< by geometry object
  };

  void prepare_textures(const SceneDescription& description);
  TextureHandle image(Build& build, const std::string& id);
  std::shared_ptr<const Program> material(Build& build, const std::string& id, const std::string& object);
  std::shared_ptr<const TriangleMesh> mesh(Build& build, const std::shared_ptr<const description::Mesh>& source);
  bool collect_meshes(Build& build);
  void place_objects(Build& build);
  uint32_t bind_materials(Build& build, const description::Object& object, const TriangleMesh& mesh);
  void add_instances(Build& build);
  void build_lights(Build& build);
  void add_lamps(Build& build, LightSetBuilder& lights);
  void add_emissive_meshes(Build& build, LightSetBuilder& lights);
  void add_world(Build& build, LightSetBuilder& lights);
  void find_profile(Build& build);
  ImageResolver resolver(Build& build) {
    return [this, &build](const std::string& id) { return image(build, id); };
  }
};

/// Starts a texture system if the colour configuration changed, and forgets programs made with images that changed.
void SceneBuilder::State::prepare_textures(const SceneDescription& description) {
  const std::string& config = description.settings->ocio_config;
  if (!textures || config != ocio_config) {
    TextureSystem::Options texture_options;
    texture_options.memory_limit_bytes = options.texture_cache_bytes;
    texture_options.ocio_config = config;
    textures = std::make_shared<TextureSystem>(texture_options);
    ocio_config = config;
    images.clear();
    image_table.clear();
  }
  if (image_table == description.images) return;
  image_table = description.images;
  std::erase_if(materials, [](const auto& entry) { return uses_images(entry.first->graph); });
  std::erase_if(worlds, [](const auto& entry) { return uses_images(entry.first->graph); });
  std::erase_if(lights, [](const auto& entry) { return entry.first->graph && uses_images(*entry.first->graph); });
}

TextureHandle SceneBuilder::State::image(Build& build, const std::string& id) {
  const auto found = build.description.images.find(id);
  if (found == build.description.images.end()) return nullptr;
  const auto [entry, added] = images.try_emplace(found->second.get());
  if (added) {
    entry->second.source = found->second;
    entry->second.made = textures->add_image(image_source(found->second), entry->second.report);
  }
  build.report.append(entry->second.report);
  return entry->second.made;
}

std::shared_ptr<const Program> SceneBuilder::State::material(Build& build, const std::string& id,
                                                             const std::string& object) {
  const auto found = build.description.materials.find(id);
  if (found == build.description.materials.end()) {
    build.report.warning("missing_material", object,
                         "Object '" + object + "' uses material '" + id + "', which does not exist: shown in grey");
    return default_material();
  }
  const auto [entry, added] = materials.try_emplace(found->second.get());
  if (added) {
    entry->second.source = found->second;
    entry->second.made = compile_material(shader_graph(found->second->graph), found->second->name, resolver(build),
                                          entry->second.report);
    build.report.append(entry->second.report);
  }
  return entry->second.made;
}

std::shared_ptr<const TriangleMesh> SceneBuilder::State::mesh(Build& build,
                                                              const std::shared_ptr<const description::Mesh>& source) {
  const auto found = meshes.find(source.get());
  if (found == meshes.end()) return nullptr;
  return found->second.made;
}

/// Makes the new meshes, several at a time. False if cancelled.
bool SceneBuilder::State::collect_meshes(Build& build) {
  std::vector<Cached<description::Mesh, std::shared_ptr<const TriangleMesh>>*> fresh;
  for (const auto& [id, source] : build.description.meshes) {
    const auto [entry, added] = meshes.try_emplace(source.get());
    if (!added) continue;
    entry->second.source = source;
    fresh.push_back(&entry->second);
  }
  tbb::parallel_for(size_t{0}, fresh.size(), [&](size_t i) {
    if (!build.cancel.cancelled()) fresh[i]->made = TriangleMesh::create(mesh_input(*fresh[i]->source), fresh[i]->report);
  });
  if (build.cancel.cancelled()) {
    std::erase_if(meshes, [](const auto& entry) { return !entry.second.made; });
    return false;
  }
  for (const auto& [id, source] : build.description.meshes) build.report.append(meshes.at(source.get()).report);
  return true;
}

/// Chooses the origin shift, then lists objects with their transforms.
void SceneBuilder::State::place_objects(Build& build) {
  const SceneDescription& description = build.description;
  Bounds3 bounds;
  for (const auto& [id, object] : description.objects) {
    const auto found = description.meshes.find(object->mesh);
    Bounds3 box(Vec3(0.0f));
    if (found != description.meshes.end()) box = mesh(build, found->second)->bounds_object();
    if (box.isEmpty()) continue;
    for (const Transform& transform : instance_transforms(*object, Vec3d(0.0)))
      if (transform.is_finite()) bounds.extendBy(transform.bounds(box));
  }
  build.scene->origin_shift_ = choose_origin_shift(bounds);

  uint32_t number = 0;
  for (const auto& [id, object] : description.objects) {
    ++number;
    if (object->mesh.empty()) continue;
    const auto found = description.meshes.find(object->mesh);
    if (found == description.meshes.end()) {
      build.report.error("missing_mesh", object->name,
                         "Object '" + object->name + "' uses mesh '" + object->mesh + "', which does not exist");
      continue;
    }
    std::shared_ptr<const TriangleMesh> shape = mesh(build, found->second);
    if (shape->empty() || !object->transforms) continue;
    GeometryObject& placed = build.geometry_objects.emplace_back();
    placed.name = object->name;
    placed.mesh = shape;
    placed.world_from_object = instance_transforms(*object, build.scene->origin_shift_);
    placed.visibility = visibility_mask(object->visibility);
    const uint32_t first = bind_materials(build, *object, *shape);
    const uint32_t slots = static_cast<uint32_t>(build.scene->bindings_.size()) - first;
    for (uint32_t slot = 0; slot < slots; ++slot) {
      const bool opaque = !build.scene->bindings_[first + slot].program->traits().may_be_transparent;
      placed.opaque = placed.opaque && opaque;
      placed.opaque_slots.push_back(opaque);
    }
    // Triangles whose slot lies beyond the list take the last material.
    while (placed.opaque_slots.size() <= shape->max_material_slot())
      placed.opaque_slots.push_back(placed.opaque_slots.back());
    build.first_bindings.push_back(first);
    build.mesh_objects.emplace_back(object.get(), number - 1);
    build.scene->meshes_.push_back(std::move(shape));
  }
}

/// Appends the object's bindings, one a material slot; returns the first.
uint32_t SceneBuilder::State::bind_materials(Build& build, const description::Object& object, const TriangleMesh& mesh) {
  std::vector<SurfaceBinding>& bindings = build.scene->bindings_;
  const uint32_t first = static_cast<uint32_t>(bindings.size());
  const size_t slots = std::max<size_t>(1, std::min<size_t>(object.materials.size(), mesh.max_material_slot() + 1));
  for (size_t slot = 0; slot < slots; ++slot) {
    SurfaceBinding& binding = bindings.emplace_back();
    const bool given = slot < object.materials.size() && object.materials[slot];
    binding.program = given ? material(build, *object.materials[slot], object.name) : default_material();
    if (given) {
      const auto found = build.description.materials.find(*object.materials[slot]);
      if (found != build.description.materials.end())
        binding.material_pass_index = static_cast<uint32_t>(found->second->pass_index);
    }
    const std::span<const AttributeRequest> requests = binding.program->attribute_requests();
    binding.attributes.fill(-1);
    for (size_t i = 0; i < requests.size() && i < k_max_attributes; ++i) {
      const AttributeRequest& request = requests[i];
      int index = -1;
      switch (request.kind) {
        case AttributeRequest::Kind::named: index = mesh.find_attribute(request.name); break;
        case AttributeRequest::Kind::uv: index = mesh.find_uv(request.name); break;
        case AttributeRequest::Kind::color: index = mesh.find_color(request.name); break;
        case AttributeRequest::Kind::tangent:
          index = mesh.find_uv(request.name);
          if (index >= 0) mesh.prepare_tangents(index);
          break;
        case AttributeRequest::Kind::generated: break;
      }
      binding.attributes[i] = static_cast<int16_t>(index);
    }
  }
  return first;
}

/// Shading records for the instances, in Geometry's order.
void SceneBuilder::State::add_instances(Build& build) {
  Scene& scene = *build.scene;
  scene.instances_.resize(scene.geometry_->instance_count());
  for (size_t i = 0; i < build.mesh_objects.size(); ++i) {
    const auto& [object, number] = build.mesh_objects[i];
    const uint32_t first_binding = build.first_bindings[i];
    const uint32_t end =
        i + 1 < build.first_bindings.size() ? build.first_bindings[i + 1] : static_cast<uint32_t>(scene.bindings_.size());
    const std::span<const uint32_t> random_ids =
        object->random_ids ? object->random_ids->as<uint32_t>() : std::span<const uint32_t>();
    const uint32_t first = scene.geometry_->first_instance(static_cast<uint32_t>(i));
    const size_t count = build.geometry_objects[i].world_from_object.size();
    for (size_t k = 0; k < count; ++k) {
      InstanceShading& shading = scene.instances_[first + k];
      shading.first_binding = first_binding;
      shading.slots = end - first_binding;
      shading.random_id = k < random_ids.size() ? random_ids[k] : 0;
      shading.object_index = number;
      shading.object_pass_index = static_cast<uint32_t>(object->pass_index);
    }
  }
}

void SceneBuilder::State::add_lamps(Build& build, LightSetBuilder& set) {
  const SceneDescription& description = build.description;
  for (const auto& [id, object] : description.objects) {
    if (object->light.empty()) continue;
    const auto found = description.lights.find(object->light);
    if (found == description.lights.end()) {
      build.report.error("missing_light", object->name,
                         "Object '" + object->name + "' uses light '" + object->light + "', which does not exist");
      continue;
    }
    const description::Light& light = *found->second;
    AnalyticLight lamp;
    lamp.name = light.name;
    switch (light.type) {
      case description::LightType::point: lamp.kind = LightKind::point; break;
      case description::LightType::spot: lamp.kind = LightKind::spot; break;
      case description::LightType::sun: lamp.kind = LightKind::sun; break;
      case description::LightType::area: lamp.kind = LightKind::area; break;
    }
    lamp.energy = light.color * (light.energy * std::exp2(light.exposure));
    lamp.normalize = light.normalize;
    lamp.radius_m = light.radius_m;
    lamp.angle_rad = light.angle_rad;
    lamp.spot_size_rad = light.spot_size_rad;
    lamp.spot_blend = light.spot_blend;
    lamp.round = light.shape == description::AreaShape::disk || light.shape == description::AreaShape::ellipse;
    lamp.size_m = light.size_m;
    if (light.shape == description::AreaShape::square || light.shape == description::AreaShape::disk)
      lamp.size_m.y = lamp.size_m.x;
    lamp.spread_rad = light.spread_rad;
    lamp.traits.hidden_from = ~visibility_mask(object->visibility) & k_visible_all;
    lamp.traits.shadows = light.shadows;
    lamp.traits.hit_by_rays = light.multiple_importance;
    lamp.traits.max_bounces = light.max_bounces;

    std::shared_ptr<const Program> program;
    if (light.graph) {
      const auto [entry, added] = lights.try_emplace(found->second.get());
      if (added) {
        entry->second.source = found->second;
        entry->second.made =
            compile_light(shader_graph(*light.graph), light.name, resolver(build), entry->second.report);
      }
      build.report.append(entry->second.report);
      program = entry->second.made;
      const ProgramTraits& traits = program->traits();
      lamp.program_average = traits.emission;
      if (traits.constant_emission) {
        lamp.energy *= traits.emission;
        lamp.program_average = Color(1.0f);
      } else {
        lamp.traits.program = true;
      }
    }
    for (const Transform& transform : instance_transforms(*object, build.scene->origin_shift_)) {
      lamp.world_from_light = transform;
      if (lamp.traits.program) {
        lamp.traits.user = static_cast<uint32_t>(build.scene->lamp_programs_.size());
        build.scene->lamp_programs_.push_back({program, transform, transform.inverse()});
      }
      set.add(lamp);
      build.scene->profile_.lamps = true;
    }
  }
}

void SceneBuilder::State::add_emissive_meshes(Build& build, LightSetBuilder& set) {
  Scene& scene = *build.scene;
  for (SurfaceBinding& binding : scene.bindings_) binding.samples_emission = binding.program->traits().emits;
  for (size_t i = 0; i < build.mesh_objects.size(); ++i) {
    const GeometryObject& object = build.geometry_objects[i];
    const uint32_t first_instance = scene.geometry_->first_instance(static_cast<uint32_t>(i));
    const uint32_t slots = scene.instances_[first_instance].slots;
    const uint32_t first_binding = build.first_bindings[i];
    bool any = false;
    for (uint32_t slot = 0; slot < slots; ++slot) any = any || scene.bindings_[first_binding + slot].samples_emission;
    if (!any) continue;
    scene.profile_.emissive_meshes = true;
    std::vector<uint32_t> emissions(slots, 0);
    for (uint32_t slot = 0; slot < slots; ++slot) {
      const ProgramTraits& traits = scene.bindings_[first_binding + slot].program->traits();
      if (!traits.emits) continue;
      SurfaceEmission emission;
      emission.radiance = traits.emission;
      emission.traits.program = !traits.constant_emission;
      emission.traits.hidden_from = ~object.visibility & k_visible_all;
      emissions[slot] = set.add_emission(emission);
    }
    for (size_t k = 0; k < object.world_from_object.size(); ++k) {
      if (build.cancel.cancelled()) return;
      const uint32_t instance = first_instance + static_cast<uint32_t>(k);
      if (!scene.geometry_->instance(instance).mesh) continue;  // dropped and reported by the geometry
      std::vector<EmissiveTriangle> triangles;
      for (uint32_t t = 0; t < object.mesh->triangle_count(); ++t) {
        const uint32_t slot = std::min(object.mesh->material_slot(t), slots - 1);
        if (!scene.bindings_[first_binding + slot].samples_emission) continue;
        const Triangle corners = scene.geometry_->triangle_world(instance, t);
        triangles.push_back({corners[0], corners[1], corners[2], t, emissions[slot], 1.0f});
      }
      set.add_mesh(instance, object.name, std::move(triangles));
    }
  }
}

void SceneBuilder::State::add_world(Build& build, LightSetBuilder& set) {
  const std::string& id = build.description.settings->world;
  if (id.empty()) return;
  const auto found = build.description.worlds.find(id);
  if (found == build.description.worlds.end()) {
    build.report.error("missing_world", id, "The settings name world '" + id + "', which does not exist: black");
    return;
  }
  const auto [entry, added] = worlds.try_emplace(found->second.get());
  if (added) {
    entry->second.source = found->second;
    entry->second.made =
        compile_world(shader_graph(found->second->graph), found->second->name, resolver(build), entry->second.report);
  }
  build.report.append(entry->second.report);
  const std::shared_ptr<const Program>& program = entry->second.made;
  if (!program->traits().emits) return;
  build.scene->world_ = program;
  build.scene->profile_.environment = true;
  EnvironmentLight light;
  if (program->traits().constant_emission) {
    light.radiance = program->traits().emission;
  } else {
    if (world_map.first != program) {
      int height = found->second->importance_resolution;
      if (height <= 0) height = uses_images(found->second->graph) ? 1024 : 256;
      EnvironmentLight map = world_importance_map(*program, textures.get(), std::min(height, 8192), build.cancel);
      if (build.cancel.cancelled()) return;
      world_map = {program, std::move(map)};
    }
    light = world_map.second;
    light.traits.program = true;
  }
  light.traits.hidden_from = ~visibility_mask(found->second->visibility) & k_visible_all;
  set.set_environment(std::move(light));
}

void SceneBuilder::State::build_lights(Build& build) {
  LightSetBuilder set;
  set.set_scene_bounds(build.scene->geometry_->bounds_world());
  add_lamps(build, set);
  add_emissive_meshes(build, set);
  add_world(build, set);
  if (build.cancel.cancelled()) return;
  build.scene->lights_ = set.build(build.report);
}

void SceneBuilder::State::find_profile(Build& build) {
  SceneProfile& profile = build.scene->profile_;
  for (const SurfaceBinding& binding : build.scene->bindings_) {
    const ProgramTraits& traits = binding.program->traits();
    profile.transparency = profile.transparency || traits.may_be_transparent;
    profile.differentials = profile.differentials || traits.needs_differentials;
  }
  profile.textures = !images.empty();
  profile.depth_of_field = build.scene->camera_.lens_radius_m() > 0.0f;
}

SceneBuilder::SceneBuilder(const SceneBuilderOptions& options) : state_(std::make_unique<State>()) {
  state_->options = options;
}
SceneBuilder::~SceneBuilder() = default;

Result<std::shared_ptr<const Scene>> SceneBuilder::build(const SceneDescription& description, const CancelFlag& cancel,
                                                         Report& report) {
  State& state = *state_;
  const description::Settings& settings = *description.settings;
  const auto camera = description.cameras.find(settings.camera);
  if (camera == description.cameras.end())
    return Error{settings.camera.empty() ? "The scene has no camera: add one, or make one active"
                                         : "The scene's camera '" + settings.camera + "' does not exist"};
  forget_unused(state.meshes, description.meshes);
  forget_unused(state.images, description.images);
  forget_unused(state.materials, description.materials);
  forget_unused(state.worlds, description.worlds);
  forget_unused(state.lights, description.lights);
  state.prepare_textures(description);

  // A first camera, to have a Scene to fill; it is made again once the origin shift is known.
  Result<Camera> first_camera = Camera::create(camera_spec(*camera->second, settings, Vec3d(0.0)));
  if (!first_camera) return Error{first_camera.error()};
  State::Build build{description, cancel, report, std::shared_ptr<Scene>(new Scene(*first_camera)), {}, {}, {}};
  build.scene->textures_ = state.textures;

  if (!state.collect_meshes(build)) return Error{k_cancelled};
  state.place_objects(build);
  if (cancel.cancelled()) return Error{k_cancelled};
  const Result<Camera> shifted_camera =
      Camera::create(camera_spec(*camera->second, settings, build.scene->origin_shift_));
  if (!shifted_camera) return Error{shifted_camera.error()};
  build.scene->camera_ = *shifted_camera;

  const Result<std::shared_ptr<const Geometry>> geometry =
      state.geometry.build(build.geometry_objects, GeometryOptions{}, cancel, report);
  if (!geometry) return Error{geometry.error()};
  build.scene->geometry_ = *geometry;
  state.add_instances(build);
  state.build_lights(build);
  if (cancel.cancelled()) return Error{k_cancelled};
  state.find_profile(build);
  return std::shared_ptr<const Scene>(build.scene);
}

}  // namespace lambent
