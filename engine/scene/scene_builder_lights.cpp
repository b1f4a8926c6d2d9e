// The lights of a scene: lamps, emissive meshes, the world.
#include <algorithm>
#include <cmath>

#include "engine/scene/convert.h"
#include "engine/scene/light_visibility.h"
#include "engine/scene/scene_builder_state.h"
#include "engine/scene/world_map.h"

namespace lambent {

LinkSets SceneBuilder::State::Build::links_of(const description::Object& object) const {
  const auto number_of = [](const std::map<std::string, uint8_t>& sets, const std::string& name) {
    const auto found = sets.find(name);
    return found == sets.end() ? uint8_t{0} : found->second;
  };
  return {number_of(receiver_sets, object.light_linking.receivers),
          number_of(blocker_sets, object.light_linking.blockers)};
}

/// Numbers the sets of light linking that lights name, and notes which objects are in them.
void SceneBuilder::State::link_lights(Build& build) {
  constexpr size_t k_most_sets = 64;
  bool over = false;
  const auto number = [&](const std::string& name, std::map<std::string, uint8_t>& sets) {
    if (name.empty() || sets.contains(name)) return;
    const bool full = sets.size() >= k_most_sets;
    if (!full) sets.emplace(name, static_cast<uint8_t>(sets.size() + 1));
    over = over || full;
  };
  for (const auto& [id, object] : build.description.objects) {
    number(object->light_linking.receivers, build.receiver_sets);
    number(object->light_linking.blockers, build.blocker_sets);
  }
  if (over)
    build.report.warning(
        "light_linking", "light linking",
        "Lights are linked to more than 64 different sets of objects; what goes beyond that takes part "
        "in all lighting");
  Scene& scene = *build.scene;
  if (build.receiver_sets.empty() && build.blocker_sets.empty()) return;
  scene.profile_.light_linking = !build.receiver_sets.empty();
  scene.profile_.shadow_linking = !build.blocker_sets.empty();
  const auto mask = [](const std::vector<std::string>& names, const std::map<std::string, uint8_t>& sets) {
    uint64_t bits = 0;
    for (const std::string& name : names)
      if (const auto found = sets.find(name); found != sets.end()) bits |= uint64_t{1} << (found->second - 1);
    return bits;
  };
  scene.object_links_.resize(build.description.objects.size());
  size_t i = 0;
  for (const auto& [id, object] : build.description.objects) {
    const description::LightLinking& linking = object->light_linking;
    scene.object_links_[i++] = {mask(linking.receives, build.receiver_sets), mask(linking.blocks, build.blocker_sets),
                                build.links_of(*object), 0};
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
      case description::LightType::point:
        lamp.kind = LightKind::point;
        break;
      case description::LightType::spot:
        lamp.kind = LightKind::spot;
        break;
      case description::LightType::sun:
        lamp.kind = LightKind::sun;
        break;
      case description::LightType::area:
        lamp.kind = LightKind::area;
        break;
    }
    lamp.energy = light.color * (light.energy * std::exp2(light.exposure));
    lamp.normalize = light.normalize;
    lamp.radius_m = light.radius_m;
    lamp.angle_rad = light.angle_rad;
    lamp.spot_size_rad = light.spot_size_rad;
    lamp.spot_blend = light.spot_blend;
    lamp.spot_cosine = light.cycles_version < 305;
    lamp.sphere = light.cycles_version >= 400 && (light.cycles_version == 400 || !light.soft_falloff);
    lamp.even_sun = light.cycles_version >= 400;
    lamp.round = light.shape == description::AreaShape::disk || light.shape == description::AreaShape::ellipse;
    lamp.size_m = light.size_m;
    if (light.shape == description::AreaShape::square || light.shape == description::AreaShape::disk)
      lamp.size_m.y = lamp.size_m.x;
    lamp.spread_rad = light.spread_rad;
    const float least_degrees = light.cycles_version < 305                              ? 1.0f
                                : light.cycles_version < 400 && light.spread_rad > 0.0f ? 0.1f
                                                                                        : 0.0f;
    if (light.spread_rad >= 0.0f) lamp.spread_rad = std::max(light.spread_rad, least_degrees * k_pi / 180.0f);
    lamp.traits.hidden_from = ~visibility_mask(object->visibility) & k_visible_all;
    lamp.traits.shadows = light.shadows;
    lamp.traits.hit_by_rays = light.multiple_importance;
    lamp.traits.max_bounces = light.max_bounces;
    lamp.traits.group = light_group(build, object->light_group.empty() ? light.light_group : object->light_group);

    lamp.traits.linked = build.links_of(*object);

    std::shared_ptr<const Program> program;
    if (light.graph) {
      const auto [entry, added] = lights.try_emplace(found->second.get());
      if (added) {
        entry->second.source = found->second;
        entry->second.made = compile_light(graph(*light.graph), light.name, resolver(build), entry->second.report);
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
        build.scene->subtracts_light_ |= traits.emits_negative;
      }
      lamp.traits.starts_walks = !traits.path_dependent;
    }
    lamp.traits.starts_walks &= lamp.traits.shadows && !(lamp.traits.hidden_from & k_visible_scattered);
    if (!lamp.traits.starts_walks) build.scene->lights_without_walks_.push_back(object->name);
    build.scene->subtracts_light_ |= min_component(lamp.energy) < 0.0f;
    for (const Transform& transform : instance_transforms(object->transforms, build.scene->origin_shift_)) {
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
    scene.emissive_objects_.insert(object.name);
    std::vector<uint32_t> emissions(slots, 0);
    for (uint32_t slot = 0; slot < slots; ++slot) {
      const ProgramTraits& traits = scene.bindings_[first_binding + slot].program->traits();
      if (!traits.emits) continue;
      SurfaceEmission emission;
      emission.radiance = traits.emission;
      scene.subtracts_light_ |= traits.emits_negative;
      emission.traits.program = !traits.constant_emission;
      emission.traits.hidden_from = ~object.visibility & k_visible_all;
      emission.traits.group = scene.instances_[first_instance].light_group;
      emission.traits.linked = build.links_of(*build.mesh_objects[i].first);
      if (emission.traits.linked.blockers != 0)
        scene.shadow_linked_meshes_ |= uint64_t{1} << (emission.traits.linked.blockers - 1);
      emission.traits.starts_walks =
          (traits.constant_emission || !traits.path_dependent) && !(emission.traits.hidden_from & k_visible_scattered);
      if (!emission.traits.starts_walks) scene.lights_without_walks_.push_back(object.name);
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
        compile_world(graph(found->second->graph), found->second->name, resolver(build), entry->second.report);
  }
  build.report.append(entry->second.report);
  const std::shared_ptr<const Program>& program = entry->second.made;
  if (!program->traits().emits) return;
  build.scene->world_ = program;
  build.scene->subtracts_light_ |= program->traits().emits_negative;
  build.scene->profile_.environment = true;
  EnvironmentLight light;
  if (program->traits().constant_emission) {
    light.radiance = program->traits().emission;
  } else {
    if (world_map.first != program) {
      int height = found->second->importance_resolution;
      if (height <= 0) height = uses_images(found->second->graph) ? 1024 : 256;
      if (!fetch_images(build, *program)) return;
      EnvironmentLight map = world_importance_map(*program, textures.get(), std::min(height, 8192), build.cancel);
      if (build.cancel.cancelled()) return;
      world_map = {program, std::move(map)};
    }
    light = world_map.second;
    light.traits.program = true;
    light.traits.starts_walks = !program->traits().path_dependent;
  }
  light.traits.hidden_from = ~visibility_mask(found->second->visibility) & k_visible_all;
  light.traits.group = light_group(build, found->second->light_group);
  light.traits.starts_walks &= !(light.traits.hidden_from & k_visible_scattered);
  if (!light.traits.starts_walks) build.scene->lights_without_walks_.push_back(found->second->name);
  set.set_environment(std::move(light));
}

void SceneBuilder::State::build_lights(Build& build) {
  LightSetBuilder set;
  set.set_scene_bounds(build.scene->geometry_->bounds_world());
  link_lights(build);
  if (!build.receiver_sets.empty()) {
    // Receivers of all lights choose among all.
    const uint64_t all = ~uint64_t{0} >> (64 - build.receiver_sets.size());
    for (ObjectLinks& links : build.scene->object_links_)
      if (links.receives != all) links.choices = set.add_receivers(links.receives);
  }
  add_lamps(build, set);
  add_emissive_meshes(build, set);
  add_world(build, set);
  if (build.cancel.cancelled()) return;
  const std::shared_ptr<LightSet> built = set.build(build.report);
  built->scale_importance(learn_light_visibility(*build.scene->geometry_, build.scene->camera_, *built, build.cancel));
  build.scene->lights_ = built;
}

}  // namespace lambent
