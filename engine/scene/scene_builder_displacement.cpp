// True displacement: programs of materials move the vertices of meshes. After mesh_displace.cpp of Cycles, with which
// it shares that a mesh shown by several objects with the same materials is displaced once, for the first of them.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

#include "engine/scene/convert.h"
#include "engine/scene/scene_builder_state.h"

namespace lambent {

namespace {

constexpr uint32_t k_no_corner = 0xffffffffu;
constexpr uint32_t k_vertices_between_polls = 256;
constexpr float k_coordinate_limit = 1e18f;  // as of TriangleMesh

const description::Material* material_of(const description::SceneDescription& description,
                                         const description::Object& object, size_t slot) {
  if (slot >= object.materials.size() || !object.materials[slot]) return nullptr;
  const auto found = description.materials.find(*object.materials[slot]);
  return found == description.materials.end() ? nullptr : found->second.get();
}

bool moves_vertices(const description::Material* material) {
  return material && material->graph.displacement &&
         material->graph.displacement_method != description::DisplacementMethod::bump;
}

Transform first_transform(const description::Object& object) {
  return Transform::from_rows(object.transforms->as<float>().data());
}

/// Everything that programs may read of the object, as far as they do.
std::vector<float> place_of(const description::SceneDescription& description, const description::Object& object,
                            const DisplacedMesh& displaced) {
  bool orientation = false, place = false;
  for (const auto& program : displaced.programs)
    if (program) {
      orientation |= program->traits().reads_orientation;
      place |= program->traits().reads_place;
    }
  std::vector<float> read;
  const Transform transform = first_transform(object);
  if (orientation || place)
    for (const auto& row : transform.m) read.insert(read.end(), row, row + (place ? 4 : 3));
  if (!place) return read;
  read.insert(read.end(), object.color.begin(), object.color.end());
  const auto add_whole = [&](uint32_t number) {
    read.push_back(static_cast<float>(number >> 16));
    read.push_back(static_cast<float>(number & 0xffffu));
  };
  add_whole(static_cast<uint32_t>(object.pass_index));
  add_whole(object.random_ids && object.random_ids->rows() > 0 ? object.random_ids->as<uint32_t>()[0] : 0u);
  for (size_t slot = 0; slot < displaced.programs.size(); ++slot) {
    const description::Material* material = material_of(description, object, slot);
    add_whole(material ? static_cast<uint32_t>(material->pass_index) : 0u);
    if (!displaced.programs[slot]) continue;
    for (const AttributeRequest& request : displaced.programs[slot]->attribute_requests()) {
      if (request.kind != AttributeRequest::Kind::object) continue;
      const auto value = object.attributes.find(request.name);
      for (int k = 0; k < 4; ++k)
        read.push_back(value == object.attributes.end() ? 0.0f : static_cast<float>(value->second[k]));
    }
  }
  return read;
}

bool usable(const Vec3& p) { return max_component(abs(p)) < k_coordinate_limit && is_finite(p); }

}  // namespace

/// The program that a material moves vertices with, null if none. Programs that compute the same are the same.
std::shared_ptr<const Program> SceneBuilder::State::displacement(Build& build, const std::string& material_id) {
  const auto found = build.description.materials.find(material_id);
  if (found == build.description.materials.end() || !moves_vertices(found->second.get())) return nullptr;
  const auto [entry, added] = displacements.try_emplace(found->second.get());
  if (added) {
    entry->second.source = found->second;
    const ShaderGraph asked = graph(found->second->graph);
    Report unread;  // the surface's program reports what both read
    Report& report = asked.displacement_method == DisplacementMethod::both ? unread : entry->second.report;
    std::shared_ptr<const Program> made = compile_displacement(asked, found->second->name, resolver(build), report);
    for (const auto& [mesh, list] : displaced_meshes)
      for (const auto& one : list)
        for (const auto& known : one->programs)
          if (made && known && made != known && same_displacement(*made, *known)) made = known;
    entry->second.made = std::move(made);
  }
  return entry->second.made;
}

/// What the object's materials ask to be done to its mesh; null for nothing.
std::unique_ptr<DisplacedMesh> SceneBuilder::State::asked_displacement(
    Build& build, const description::Object& object, const std::shared_ptr<const TriangleMesh>& mesh) {
  const size_t slots = std::max<size_t>(1, std::min<size_t>(object.materials.size(), mesh->max_material_slot() + 1));
  bool any = false;
  for (size_t slot = 0; slot < slots; ++slot) any |= moves_vertices(material_of(build.description, object, slot));
  if (!any) return nullptr;
  auto asked = std::make_unique<DisplacedMesh>();
  asked->programs.resize(slots);
  asked->recomputed.resize(slots);
  asked->not_finite.resize(slots);
  any = false;
  for (size_t slot = 0; slot < slots; ++slot) {
    const description::Material* material = material_of(build.description, object, slot);
    if (!moves_vertices(material)) continue;
    asked->programs[slot] = displacement(build, *object.materials[slot]);
    if (!asked->programs[slot]) continue;
    any = true;
    asked->recomputed[slot] = material->graph.displacement_method == description::DisplacementMethod::displacement;
    if (material->graph.cycles_version >= 501) asked->corner_normals = CornerNormals::merged;
  }
  if (!any) return nullptr;
  asked->place = place_of(build.description, object, *asked);
  asked->mesh = mesh;
  return asked;
}

/// Runs the programs at the vertices, as they are in the object's first instance.
void SceneBuilder::State::displace(Build& build, const description::Object& object, DisplacedMesh& displaced) {
  const TriangleMesh& mesh = *displaced.mesh;
  const Transform world_from_object = first_transform(object);
  if (!world_from_object.is_finite() || !world_from_object.is_invertible()) return;
  const Transform object_from_world = world_from_object.inverse();
  const size_t slots = displaced.programs.size();
  const auto slot_of = [&](uint32_t triangle) { return std::min<size_t>(mesh.material_slot(triangle), slots - 1); };

  // Each vertex goes by the first triangle that moves it.
  std::vector<uint32_t> corner_of(mesh.vertex_count(), k_no_corner);
  bool any = false;
  for (uint32_t t = 0; t < mesh.triangle_count(); ++t) {
    if (t % 65536 == 0 && build.cancel.cancelled()) return;
    if (!displaced.programs[slot_of(t)]) continue;
    any = true;
    for (uint32_t k = 0; k < 3; ++k) {
      uint32_t& corner = corner_of[mesh.vertices(t)[k]];
      if (corner == k_no_corner) corner = 3 * t + k;
    }
  }
  if (!any) return;
  const CornersByVertex corners(mesh);
  if (build.cancel.cancelled()) return;
  const std::vector<Vec3> directions = displacement_directions(mesh, corners, displaced.corner_normals);
  if (build.cancel.cancelled()) return;
  std::vector<AttributeIndices> attributes(slots);
  std::vector<std::vector<Vec4>> object_values(slots);
  for (size_t slot = 0; slot < slots; ++slot)
    if (displaced.programs[slot] && !fetch_images(build, *displaced.programs[slot])) return;
  for (size_t slot = 0; slot < slots; ++slot)
    if (displaced.programs[slot])
      attributes[slot] = bind_attributes(*displaced.programs[slot], object, mesh, object_values[slot]);

  ShadingPoint common;
  common.wi_world = Vec3(0.0f);
  common.ray_kind = 0;
  common.world_from_object = &world_from_object;
  common.object_from_world = &object_from_world;
  common.object_pass_index = static_cast<uint32_t>(object.pass_index);
  common.random_id = object.random_ids && object.random_ids->rows() > 0 ? object.random_ids->as<uint32_t>()[0] : 0u;
  const Vec4 color(object.color[0], object.color[1], object.color[2], object.color[3]);
  common.object_color = &color;
  const bool mirrored = world_from_object.mirrors();

  std::vector<float> positions(mesh.positions(), mesh.positions() + 3 * size_t(mesh.vertex_count()));
  std::vector<std::atomic<uint32_t>> not_finite(slots);
  const auto move = [&](uint32_t vertex, ShadingPoint& point) {
    const uint32_t corner = corner_of[vertex], triangle = corner / 3, k = corner % 3;
    const size_t slot = slot_of(triangle);
    const Triangle p = mesh.triangle(triangle);
    const Vec3 p_object = p[k];
    point.p_world = world_from_object.point(p_object);
    point.ns_world = normalize(object_from_world.transposed_vector(directions[vertex]));
    point.ng_world = normalize(object_from_world.transposed_vector(mesh.geometric_normal(triangle)));
    if (length_squared(point.ng_world) == 0.0f) point.ng_world = point.ns_world;
    point.dpdu_world = world_from_object.vector(p[1] - p[0]);
    point.dpdv_world = world_from_object.vector(p[2] - p[0]);
    point.barycentric = {k == 1 ? 1.0f : 0.0f, k == 2 ? 1.0f : 0.0f};
    const description::Material* material = material_of(build.description, object, slot);
    point.material_pass_index = material ? static_cast<uint32_t>(material->pass_index) : 0u;
    const Program& program = *displaced.programs[slot];
    fill_attributes({mesh, triangle, point.barycentric, mirrored}, program.attribute_requests(), attributes[slot],
                    object_values[slot], true, point);
    const Vec3 moved = p_object + program.displacement(point, textures.get());
    if (usable(moved))
      for (int i = 0; i < 3; ++i) positions[3 * size_t(vertex) + static_cast<size_t>(i)] = moved[i];
    else
      not_finite[slot].fetch_add(1, std::memory_order_relaxed);
  };
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, mesh.vertex_count(), k_vertices_between_polls),
                    [&](const auto& range) {
                      ShadingPoint point = common;
                      for (uint32_t v = range.begin(); v != range.end(); ++v) {
                        if (v % k_vertices_between_polls == 0 && build.cancel.cancelled()) return;
                        if (corner_of[v] != k_no_corner) move(v, point);
                      }
                    });
  if (build.cancel.cancelled()) return;
  for (size_t slot = 0; slot < slots; ++slot) displaced.not_finite[slot] = not_finite[slot].load();
  std::vector<float> normals =
      displaced_normals(mesh, corners, positions, displaced.recomputed, displaced.corner_normals);
  if (build.cancel.cancelled()) return;
  displaced.shape =
      TriangleMesh::create_displaced(displaced.mesh, std::move(positions), std::move(normals), displaced.report);
}

/// Displaces the meshes of objects whose materials ask for it, unless that was done before. False if cancelled.
bool SceneBuilder::State::displace_meshes(Build& build) {
  for (auto& [mesh, list] : displaced_meshes)
    for (auto& entry : list) entry->used = false;
  for (const auto& [id, object] : build.description.objects) {
    if (!object->transforms || object->transforms->rows() == 0) continue;
    const auto source = build.description.meshes.find(object->mesh);
    if (source == build.description.meshes.end()) continue;
    const std::shared_ptr<const TriangleMesh> mesh = this->mesh(source->second);
    if (!mesh || mesh->empty()) continue;
    std::unique_ptr<DisplacedMesh> asked = asked_displacement(build, *object, mesh);
    if (!asked) continue;
    auto& list = displaced_meshes[mesh.get()];
    const auto fits = [&](const std::unique_ptr<DisplacedMesh>& entry) {
      return entry->asks_the_same(*asked) && (entry->used || entry->place == asked->place);
    };
    // One that an object before went by comes first.
    auto found = std::find_if(list.begin(), list.end(), [&](const auto& entry) { return entry->used && fits(entry); });
    if (found == list.end()) found = std::find_if(list.begin(), list.end(), fits);
    if (found == list.end()) {
      displace(build, *object, *asked);
      if (build.cancel.cancelled()) return false;
      list.push_back(std::move(asked));
      found = list.end() - 1;
    }
    DisplacedMesh& entry = **found;
    if (!entry.used) {
      build.report.append(entry.report);
      for (size_t slot = 0; slot < entry.not_finite.size(); ++slot)
        if (entry.not_finite[slot] > 0)
          build.report.warning("bad_value", object->name,
                               "Object '" + object->name + "', material '" +
                                   material_of(build.description, *object, slot)->name + "': the displacement of " +
                                   std::to_string(entry.not_finite[slot]) +
                                   " vertices is not finite or leads beyond 1e18 m; they stay where they are.");
    }
    entry.used = true;
    if (entry.shape) build.displaced[object.get()] = entry.shape;
  }
  for (auto& [mesh, list] : displaced_meshes) std::erase_if(list, [](const auto& entry) { return !entry->used; });
  std::erase_if(displaced_meshes, [](const auto& entry) { return entry.second.empty(); });
  for (const auto& [source, compiled] : displacements) build.report.append(compiled.report);
  return true;
}

}  // namespace lambent
