#include "engine/scene/scene_builder.h"

#include <algorithm>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <map>
#include <new>
#include <unordered_map>
#include <utility>

#include "engine/base/check.h"
#include "engine/base/name_id.h"
#include "engine/scene/convert.h"
#include "engine/scene/scene_builder_state.h"

namespace lambent {

namespace {

constexpr const char* k_cancelled = "cancelled";

/// Forgets what the description no longer names.
template <typename Source, typename Made>
void forget_unused(Cache<Source, Made>& cache, const description::Table<Source>& table) {
  std::unordered_map<const Source*, bool> used;
  for (const auto& [id, source] : table) used[source.get()] = true;
  std::erase_if(cache, [&](const auto& entry) { return !used.count(entry.first); });
}

/// How far the world is moved so that coordinates are small: nothing unless the scene is far from the origin compared
/// with its size, where float positions would lose what the picture shows.
Vec3d choose_origin_shift(const Bounds3& bounds) {
  if (bounds.isEmpty()) return Vec3d(0.0);
  const Vec3d center = (Vec3d(bounds.min) + Vec3d(bounds.max)) * 0.5;
  const double extent = (Vec3d(bounds.max) - Vec3d(bounds.min)).length();
  const double distance = std::max({std::fabs(center.x), std::fabs(center.y), std::fabs(center.z)});
  if (!std::isfinite(extent) || !std::isfinite(distance) || distance <= 4.0 * extent) return Vec3d(0.0);
  return Vec3d(Vec3(center));  // a float value: exact to add and subtract
}

/// What Cycles counts users of: an object whose own materials replace those of the mesh has a mesh of its own there.
std::string mesh_and_materials(const description::Object& object) {
  std::string key = object.mesh;
  for (const auto& material : object.materials) key.append(1, '\0').append(material.value_or(""));
  return key;
}

/// Appends a binding's values unless they are those added last; returns where they begin.
uint32_t add_object_values(const std::vector<Vec4>& added, std::vector<Vec4>& values) {
  const bool known = values.size() >= added.size() &&
                     std::equal(added.begin(), added.end(), values.end() - std::ptrdiff_t(added.size()));
  if (!known) values.insert(values.end(), added.begin(), added.end());
  return static_cast<uint32_t>(values.size() - added.size());
}

}  // namespace

/// Starts a texture system if the colour configuration changed, and forgets programs made with images that changed.
void SceneBuilder::State::prepare_textures(const SceneDescription& description) {
  const std::string& config = description.settings->ocio_config;
  const std::string& space = description.settings->working_space;
  if (!textures || config != ocio_config || space != working_space) {
    TextureSystem::Options texture_options;
    texture_options.memory_limit_bytes = options.texture_cache_bytes;
    texture_options.ocio_config = config;
    texture_options.working_space = space;
    const auto matrix_before = textures ? textures->scene_from_computed() : std::nullopt;
    textures = std::make_shared<TextureSystem>(texture_options);
    ocio_config = config;
    working_space = space;
    if (textures->scene_from_computed() != matrix_before) {  // colours are compiled into programs
      materials.clear();
      worlds.clear();
      lights.clear();
    }
    images.clear();
    image_table.clear();
  }
  if (image_table == description.images) return;
  image_table = description.images;
  forget_programs_with_images();
}

/// Opens the new images that some graph names: their memory is shared out in order, their texels are read when asked
/// for.
void SceneBuilder::State::load_images(Build& build) {
  const SceneDescription& description = build.description;
  std::vector<Cached<description::Image, TextureHandle>*> fresh;
  const auto want = [&](const std::string& id) {
    const auto found = description.images.find(id);
    if (found == description.images.end()) return;
    const auto [entry, added] = images.try_emplace(found->second.get());
    if (!added) return;
    entry->second.source = found->second;
    fresh.push_back(&entry->second);
  };
  for (const auto& [id, material] : description.materials) for_each_image(material->graph, want);
  for (const auto& [id, world] : description.worlds) for_each_image(world->graph, want);
  for (const auto& [id, light] : description.lights)
    if (light->graph) for_each_image(*light->graph, want);
  for (auto* image : fresh) {
    if (build.cancel.cancelled()) break;
    image->made = textures->defer(textures->reserve(image_source(image->source), image->report));
  }
  std::erase_if(images, [](const auto& entry) { return !entry.second.made; });
}

/// Decodes what a program will look up, several images at a time: for those that run in the builder. False if
/// cancelled.
bool SceneBuilder::State::fetch_images(const Build& build, const Program& program) {
  const std::vector<TextureHandle> handles = program.images();
  tbb::parallel_for(size_t{0}, handles.size(), [&](size_t i) { textures->fetch(*handles[i], build.cancel); });
  return !build.cancel.cancelled();
}

/// Forgets programs that may have been compiled with images whose decoding was interrupted.
void SceneBuilder::State::forget_programs_with_images() {
  std::erase_if(materials, [](const auto& entry) { return uses_images(entry.first->graph); });
  std::erase_if(displacements, [](const auto& entry) { return uses_images(entry.first->graph); });
  std::erase_if(worlds, [](const auto& entry) { return uses_images(entry.first->graph); });
  std::erase_if(lights, [](const auto& entry) { return entry.first->graph && uses_images(*entry.first->graph); });
}

/// A loaded image, for the compiler; its messages go to the report once a build.
TextureHandle SceneBuilder::State::image(Build& build, const std::string& id) {
  const auto found = build.description.images.find(id);
  if (found == build.description.images.end()) return nullptr;
  const auto loaded = images.find(found->second.get());
  return loaded == images.end() ? nullptr : loaded->second.made;
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
    entry->second.made =
        compile_material(graph(found->second->graph), found->second->name, resolver(build), entry->second.report);
  }
  return entry->second.made;
}

std::shared_ptr<const TriangleMesh> SceneBuilder::State::mesh(const std::shared_ptr<const description::Mesh>& source) {
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
    if (!build.cancel.cancelled())
      fresh[i]->made = TriangleMesh::create(mesh_input(*fresh[i]->source), fresh[i]->report);
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
    if (found != description.meshes.end()) box = shape_of(build, *object, found->second)->bounds_object();
    if (box.isEmpty()) continue;
    for (const Transform& transform : instance_transforms(object->transforms, Vec3d(0.0)))
      if (transform.is_finite()) bounds.extendBy(transform.bounds(box));
  }
  build.scene->origin_shift_ = choose_origin_shift(bounds);

  std::unordered_map<std::string, size_t> users;
  for (const auto& [id, object] : description.objects)
    if (!object->mesh.empty() && object->transforms) users[mesh_and_materials(*object)] += object->transforms->rows();
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
    std::shared_ptr<const TriangleMesh> shape = shape_of(build, *object, found->second);
    const bool without_faces = !found->second->triangles || found->second->triangles->rows() == 0;
    if (without_faces && object->transforms && visibility_mask(object->visibility) != 0)
      build.report.info(
          "empty_mesh", object->name,
          "Object '" + object->name + "' has no faces (mesh '" + found->second->name + "'): nothing of it is visible");
    if (shape->empty() || !object->transforms) continue;
    GeometryObject& placed = build.geometry_objects.emplace_back();
    placed.name = object->name;
    placed.mesh = shape;
    placed.world_from_object = instance_transforms(object->transforms, build.scene->origin_shift_);
    placed.visibility = visibility_mask(object->visibility);
    const uint32_t first = bind_materials(build, *object, *shape);
    const uint32_t slots = static_cast<uint32_t>(build.scene->bindings_.size()) - first;
    placed.normals_at_vertices = users[mesh_and_materials(*object)] == 1 && !build.displaced.contains(object.get());
    for (uint32_t slot = 0; slot < slots; ++slot) {
      const ProgramTraits& traits = build.scene->bindings_[first + slot].program->traits();
      placed.normals_at_vertices &= !traits.subsurface;
      const bool opaque = !traits.may_be_transparent;
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
uint32_t SceneBuilder::State::bind_materials(Build& build, const description::Object& object,
                                             const TriangleMesh& mesh) {
  std::vector<SurfaceBinding>& bindings = build.scene->bindings_;
  const uint32_t first = static_cast<uint32_t>(bindings.size());
  const size_t slots = std::max<size_t>(1, std::min<size_t>(object.materials.size(), mesh.max_material_slot() + 1));
  for (size_t slot = 0; slot < slots; ++slot) {
    SurfaceBinding& binding = bindings.emplace_back();
    const bool given = slot < object.materials.size() && object.materials[slot];
    binding.program = given ? material(build, *object.materials[slot], object.name) : default_material();
    if (given) {
      const auto found = build.description.materials.find(*object.materials[slot]);
      if (found != build.description.materials.end()) {
        binding.material_pass_index = static_cast<uint32_t>(found->second->pass_index);
        if (build.ids) binding.material_id = name_id(found->second->name);
      }
    }
    std::vector<Vec4> values;
    binding.attributes = bind_attributes(*binding.program, object, mesh, values);
    binding.first_object_value = add_object_values(values, build.scene->object_values_);
  }
  return first;
}

/// Which of the mesh's attributes the program's requests read. `object_values`: appended are the object's own that it
/// reads, whose indices count from 0.
AttributeIndices SceneBuilder::State::bind_attributes(const Program& program, const description::Object& object,
                                                      const TriangleMesh& mesh, std::vector<Vec4>& object_values) {
  const std::span<const AttributeRequest> requests = program.attribute_requests();
  AttributeIndices indices;
  indices.fill(-1);
  for (size_t i = 0; i < requests.size() && i < k_max_attributes; ++i) {
    const AttributeRequest& request = requests[i];
    int index = -1;
    switch (request.kind) {
      case AttributeRequest::Kind::named:
      case AttributeRequest::Kind::number:
        index = mesh.find_attribute(request.name);
        break;
      case AttributeRequest::Kind::object:
        if (const auto value = object.attributes.find(request.name); value != object.attributes.end()) {
          index = static_cast<int>(object_values.size());
          object_values.emplace_back(value->second[0], value->second[1], value->second[2], value->second[3]);
        }
        break;
      case AttributeRequest::Kind::uv:
        index = mesh.find_uv(request.name);
        break;
      case AttributeRequest::Kind::color:
        index = mesh.find_color(request.name);
        break;
      case AttributeRequest::Kind::tangent:
        index = mesh.find_uv(request.name);
        if (index >= 0) mesh.prepare_tangents(index);
        break;
      case AttributeRequest::Kind::generated:
      case AttributeRequest::Kind::undisplaced:
      case AttributeRequest::Kind::undisplaced_normal:
        break;
    }
    indices[i] = static_cast<int16_t>(index);
  }
  return indices;
}

uint16_t SceneBuilder::State::light_group(Build& build, const std::string& name) {
  if (name.empty()) return 0;
  std::vector<std::string>& groups = build.scene->light_groups_;
  auto found = std::find(groups.begin(), groups.end(), name);
  if (found == groups.end()) {
    if (groups.size() >= std::numeric_limits<uint16_t>::max()) return 0;
    found = groups.insert(found, name);
  }
  return static_cast<uint16_t>(found - groups.begin() + 1);
}

/// What the shaders of instances `first`... may ask about their particles.
void SceneBuilder::State::add_particles(Scene& scene, std::span<const float> rows, uint32_t first, size_t count) {
  constexpr size_t k_columns = 13;
  scene.particles_.resize(scene.instances_.size());
  for (size_t k = 0; k < count && (k + 1) * k_columns <= rows.size(); ++k) {
    const float* p = rows.data() + k * k_columns;
    if (!(p[0] >= 0.0f)) continue;
    scene.particles_[first + k] = {
        p[0], p[1], p[2], p[3], {p[4], p[5], p[6]}, {p[7], p[8], p[9]}, {p[10], p[11], p[12]}};
  }
}

/// Shading records for the instances, in Geometry's order.
void SceneBuilder::State::add_instances(Build& build) {
  Scene& scene = *build.scene;
  scene.instances_.resize(scene.geometry_->instance_count());
  for (size_t i = 0; i < build.mesh_objects.size(); ++i) {
    const auto& [object, number] = build.mesh_objects[i];
    if (scene.object_colors_.size() <= number) scene.object_colors_.resize(number + 1, Vec4(1.0f));
    scene.object_colors_[number] = {object->color[0], object->color[1], object->color[2], object->color[3]};
    if (build.ids) {
      if (scene.object_ids_.size() <= number) scene.object_ids_.resize(number + 1);
      scene.object_ids_[number] = {name_id(object->name),
                                   name_id(object->asset.empty() ? object->name : object->asset)};
    }
    const uint16_t group = light_group(build, object->light_group);
    const uint32_t first_binding = build.first_bindings[i];
    const uint32_t end = i + 1 < build.first_bindings.size() ? build.first_bindings[i + 1]
                                                             : static_cast<uint32_t>(scene.bindings_.size());
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
      shading.light_group = group;
      shading.holdout = object->holdout || object->shadow_catcher;
      shading.shadow_catcher = object->shadow_catcher && !object->holdout;
      shading.matte = object->matte;
      scene.has_shadow_catchers_ |= shading.shadow_catcher && object->visibility.camera;
      scene.has_mattes_ |= shading.shadow_catcher && shading.matte && object->visibility.camera;
    }
    const auto asks = [](const SurfaceBinding& binding) { return binding.program->traits().reads_particle; };
    if (object->particles && std::any_of(scene.bindings_.begin() + first_binding, scene.bindings_.begin() + end, asks))
      add_particles(scene, object->particles->as<float>(), first, count);
    if (scene.mattes_.empty()) continue;
    if (scene.object_mattes_.size() <= number) scene.object_mattes_.resize(number + 1, 0);
    for (size_t k = 0; k < scene.mattes_.size(); ++k)
      if (std::find(object->mattes.begin(), object->mattes.end(), scene.mattes_[k]) != object->mattes.end())
        scene.object_mattes_[number] |= uint64_t{1} << k;
  }
}

void SceneBuilder::State::find_profile(Build& build) {
  SceneProfile& profile = build.scene->profile_;
  for (const SurfaceBinding& binding : build.scene->bindings_) {
    const ProgramTraits& traits = binding.program->traits();
    profile.transparency = profile.transparency || traits.may_be_transparent;
    profile.differentials = profile.differentials || traits.needs_differentials;
    profile.subsurface = profile.subsurface || traits.subsurface;
  }
  for (const GeometryObject& object : build.geometry_objects)
    profile.alike_for_shadows =
        profile.alike_for_shadows && !(object.visibility & k_ray_diffuse) == !(object.visibility & k_ray_shadow);
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
  const Interruptible interruptible(cancel);
  Result<std::shared_ptr<const Scene>> built = build_scene(description, cancel, report);
  if (render_context().interrupted) state.forget_programs_with_images();
  if (state.textures) report.append(state.textures->take_problems());
  return built;
}

Result<std::shared_ptr<const Scene>> SceneBuilder::build_scene(const SceneDescription& description,
                                                               const CancelFlag& cancel, Report& report) {
  State& state = *state_;
  const description::Settings& settings = *description.settings;
  const auto camera = description.cameras.find(settings.camera);
  if (camera == description.cameras.end())
    return Error{settings.camera.empty() ? "The scene has no camera: add one, or make one active"
                                         : "The scene's camera '" + settings.camera + "' does not exist"};
  forget_unused(state.meshes, description.meshes);
  forget_unused(state.images, description.images);
  forget_unused(state.materials, description.materials);
  forget_unused(state.displacements, description.materials);
  forget_unused(state.worlds, description.worlds);
  forget_unused(state.lights, description.lights);
  state.prepare_textures(description);

  // A first camera, to have a Scene to fill; it is made again once the origin shift is known.
  const CameraSpec spec = camera_spec(*camera->second, settings, Vec3d(0.0));
  Result<Camera> first_camera = Camera::create(spec);
  if (!first_camera) return Error{first_camera.error()};
  if (const std::string problem = lens_problem(spec); !problem.empty())
    report.warning("bad_value", spec.name, "Camera \"" + spec.name + "\": " + problem + "; there is no depth of field");
  State::Build build{description, cancel, report, std::shared_ptr<Scene>(new Scene(*first_camera)), {}, {}, {}, {},
                     false,       {},     {}};
  bool motion = false;
  for (const description::Pass& pass : settings.passes) {
    build.ids = build.ids || pass.kind.starts_with("cryptomatte");
    motion = motion || pass.kind == "vector";
    std::vector<std::string>& mattes = build.scene->mattes_;
    if (pass.kind == "matte" && mattes.size() < Scene::k_most_mattes &&
        std::find(mattes.begin(), mattes.end(), pass.argument) == mattes.end())
      mattes.push_back(pass.argument);
  }
  build.scene->textures_ = state.textures;

  state.load_images(build);
  if (!state.collect_meshes(build)) return Error{k_cancelled};
  for (const auto& [source, loaded] : state.images) {
    report.append(loaded.report);
    // Found by an earlier render.
    const TextureProblem problem = texture_problem(*loaded.made);
    if (!problem.message.empty() && !loaded.report.has_errors())
      report.error(problem.code, source->name, problem.message);
  }
  if (!state.displace_meshes(build)) return Error{k_cancelled};
  state.place_objects(build);
  for (const auto& [source, compiled] : state.materials) report.append(compiled.report);
  if (cancel.cancelled()) return Error{k_cancelled};
  const Result<Camera> shifted_camera =
      Camera::create(camera_spec(*camera->second, settings, build.scene->origin_shift_));
  if (!shifted_camera) return Error{shifted_camera.error()};
  build.scene->camera_ = *shifted_camera;
  const CameraRay middle = shifted_camera->sample_ray(
      {0.5f * static_cast<float>(shifted_camera->width_px()), 0.5f * static_cast<float>(shifted_camera->height_px())},
      {0.5f, 0.5f});
  build.scene->pixel_width_m_ = middle.width_m;
  build.scene->pixel_spread_ = middle.spread;
  ViewSpace& view = build.scene->view_;
  view.camera_from_world = shifted_camera->camera_from_world();
  view.world_from_camera = view.camera_from_world.inverse();
  view.perspective = shifted_camera->projection() == Projection::perspective;
  shifted_camera->window(view.window_scale, view.window_offset);

  const Result<std::shared_ptr<const Geometry>> geometry =
      state.geometry.build(build.geometry_objects, GeometryOptions{}, cancel, report);
  if (!geometry) return Error{geometry.error()};
  build.scene->geometry_ = *geometry;
  state.add_instances(build);
  if (motion) state.add_motion(build);
  state.build_lights(build);
  if (cancel.cancelled()) return Error{k_cancelled};
  state.find_profile(build);
  return std::shared_ptr<const Scene>(build.scene);
}

}  // namespace lambent
