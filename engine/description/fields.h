// The members of every kind of datablock: one list each, walked by FieldReader when decoding and by FieldWriter when
// encoding, so that the two cannot differ. `value` is const when writing.
//
// A visitor has: text, required_text, number, integer, boolean, choice, numbers, array, text_map, group,
// optional_group, objects (lists of objects), and the members with a form of their own, named after it.
#pragma once

#include "engine/description/field_choices.h"

namespace lambent::description {

/// What an array member must be: element type and, per dimension, the sizes it may have.
struct ArrayForm {
  ElementType type;
  struct Range {
    uint64_t least, most;
  };
  std::vector<Range> dimensions;
};
inline constexpr uint64_t k_any = ~uint64_t(0);

inline ArrayForm rows_of(ElementType type, uint64_t least, uint64_t most) {
  return {type, {{0, k_any}, {least, most}}};
}
inline ArrayForm list_of(ElementType type) { return {type, {{0, k_any}}}; }

inline constexpr bool k_required = true;

template <typename V, typename T>
void visit_visibility(V& visitor, T& value) {
  visitor.boolean("camera", value.camera);
  visitor.boolean("diffuse", value.diffuse);
  visitor.boolean("glossy", value.glossy);
  visitor.boolean("transmission", value.transmission);
  visitor.boolean("shadow", value.shadow);
  visitor.boolean("volume_scatter", value.volume_scatter);
}

template <typename V, typename T>
void visit_attribute(V& visitor, T& value) {
  visitor.text("name", value.name, k_required);
  visitor.choice("domain", value.domain, k_domains, k_required);
  visitor.choice("role", value.role, k_roles);
  visitor.array("values", value.values, rows_of(ElementType::f32, 1, 4), k_required);
}

template <typename V, typename T>
void visit_mesh(V& visitor, T& value) {
  visitor.text("name", value.name);
  visitor.array("positions", value.positions, rows_of(ElementType::f32, 3, 3), k_required);
  visitor.array("triangles", value.triangles, rows_of(ElementType::u32, 3, 3), k_required);
  visitor.array("triangle_corners", value.triangle_corners, rows_of(ElementType::u32, 3, 3));
  visitor.array("triangle_faces", value.triangle_faces, list_of(ElementType::u32));
  visitor.array("triangle_materials", value.triangle_materials, list_of(ElementType::u16));
  visitor.group_if("normals", value.normals != nullptr, [&](auto& group) {
    group.choice("domain", value.normals_domain, k_normal_domains, k_required);
    group.array("values", value.normals, rows_of(ElementType::f32, 3, 3), k_required);
  });
  visitor.objects("attributes", value.attributes, [](auto& group, auto& one) { visit_attribute(group, one); });
  visitor.text("active_uv", value.active_uv);
  visitor.text("active_color", value.active_color);
  visitor.group("texture_space", [&](auto& group) {
    group.numbers("location", &value.texture_space_location.x, 3);
    group.numbers("size", &value.texture_space_size.x, 3);
  });
}

template <typename V, typename T>
void visit_image(V& visitor, T& value) {
  visitor.text("name", value.name);
  visitor.text("path", value.path);
  visitor.array("encoded", value.encoded, list_of(ElementType::u8));
  visitor.text("extension", value.extension);
  visitor.array("pixels", value.pixels, {ElementType::f32, {{1, k_any}, {1, k_any}, {1, 4}}});
  visitor.text("colorspace", value.colorspace);
  visitor.choice("alpha", value.alpha, k_alpha_modes);
}

template <typename V, typename T>
void visit_material(V& visitor, T& value) {
  visitor.text("name", value.name);
  visitor.graph("graph", value.graph);
  visitor.integer("pass_index", value.pass_index, 0, INT32_MAX);
}

template <typename V, typename T>
void visit_world(V& visitor, T& value) {
  visitor.text("name", value.name);
  visitor.graph("graph", value.graph);
  visitor.group("visibility", [&](auto& group) { visit_visibility(group, value.visibility); });
  visitor.text("light_group", value.light_group);
  visitor.integer("importance_resolution", value.importance_resolution, 0, 1 << 16);
}

template <typename V, typename T>
void visit_light(V& visitor, T& value) {
  visitor.text("name", value.name);
  visitor.choice("type", value.type, k_light_types, k_required);
  visitor.numbers("color", &value.color.x, 3);
  visitor.number("energy", value.energy);
  visitor.number("exposure", value.exposure);
  visitor.boolean("normalize", value.normalize);
  visitor.number("radius_m", value.radius_m);
  visitor.number("angle_rad", value.angle_rad);
  visitor.number("spot_size_rad", value.spot_size_rad);
  visitor.number("spot_blend", value.spot_blend);
  visitor.choice("shape", value.shape, k_area_shapes);
  visitor.numbers("size_m", &value.size_m.x, 2);
  visitor.number("spread_rad", value.spread_rad);
  visitor.boolean("shadows", value.shadows);
  visitor.boolean("multiple_importance", value.multiple_importance);
  visitor.integer("max_bounces", value.max_bounces, 0, INT32_MAX);
  visitor.boolean("soft_falloff", value.soft_falloff);
  visitor.integer("cycles_version", value.cycles_version, 0, 10000);
  visitor.text("light_group", value.light_group);
  visitor.optional_graph("graph", value.graph);
}

template <typename V, typename T>
void visit_object_step(V& visitor, T& value) {
  visitor.transforms("transform", "transforms", value.transforms);
  visitor.array("positions", value.positions, rows_of(ElementType::f32, 3, 3));
}

template <typename V, typename T>
void visit_camera_step(V& visitor, T& value) {
  visitor.numbers("transform", &value.transform.m[0][0], 12, k_required);
  visitor.number("focal_length_mm", value.focal_length_mm);
}

template <typename V, typename T>
void visit_object(V& visitor, T& value) {
  visitor.text("name", value.name);
  visitor.text("mesh", value.mesh);
  visitor.text("light", value.light);
  visitor.transforms("transform", "transforms", value.transforms);
  visitor.slots("materials", value.materials);
  visitor.group("visibility", [&](auto& group) { visit_visibility(group, value.visibility); });
  visitor.array("random_ids", value.random_ids, list_of(ElementType::u32));
  visitor.array("particles", value.particles, rows_of(ElementType::f32, 13, 13));
  visitor.integer("pass_index", value.pass_index, 0, INT32_MAX);
  visitor.numbers("color", value.color.data(), 4);
  visitor.number_map("attributes", value.attributes);
  visitor.text("light_group", value.light_group);
  visitor.text("asset", value.asset);
  visitor.boolean("holdout", value.holdout);
  visitor.boolean("shadow_catcher", value.shadow_catcher);
  visitor.boolean("matte", value.matte);
  visitor.boolean("shadow_pass", value.shadow_pass);
  visitor.texts("mattes", value.mattes);
  visitor.group_if("light_linking", value.light_linking.any(), [&](auto& group) {
    group.text("receivers", value.light_linking.receivers);
    group.text("blockers", value.light_linking.blockers);
    group.texts("receives", value.light_linking.receives);
    group.texts("blocks", value.light_linking.blocks);
  });
  visitor.optional_group("motion", value.motion, [](auto& group, auto& motion) {
    group.group_if("previous", motion.previous.transforms != nullptr,
                   [&](auto& step) { visit_object_step(step, motion.previous); });
    group.group_if("next", motion.next.transforms != nullptr,
                   [&](auto& step) { visit_object_step(step, motion.next); });
  });
}

template <typename V, typename T>
void visit_camera(V& visitor, T& value) {
  visitor.text("name", value.name);
  visitor.choice("type", value.type, k_camera_types);
  visitor.numbers("transform", &value.transform.m[0][0], 12, k_required);
  visitor.number("focal_length_mm", value.focal_length_mm);
  visitor.number("sensor_width_mm", value.sensor_width_mm);
  visitor.number("sensor_height_mm", value.sensor_height_mm);
  visitor.choice("sensor_fit", value.sensor_fit, k_sensor_fits);
  visitor.number("ortho_scale", value.ortho_scale);
  visitor.numbers("shift", &value.shift.x, 2);
  visitor.pair("clip_m", value.clip_near_m, value.clip_far_m);
  visitor.optional_group("depth_of_field", value.depth_of_field, [](auto& group, auto& lens) {
    group.number("focus_distance_m", lens.focus_distance_m);
    group.number("fstop", lens.fstop);
    group.integer("blades", lens.blades, 0, 1000);
    group.number("rotation_rad", lens.rotation_rad);
    group.number("ratio", lens.ratio);
  });
  visitor.optional_group("motion", value.motion, [](auto& group, auto& motion) {
    group.group("previous", [&](auto& step) { visit_camera_step(step, motion.previous); });
    group.group("next", [&](auto& step) { visit_camera_step(step, motion.next); });
  });
}

inline constexpr int k_max_frame_side_px = 1 << 20;

template <typename V, typename T>
void visit_settings(V& visitor, T& value) {
  visitor.integer("width", value.width, 1, k_max_frame_side_px);
  visitor.integer("height", value.height, 1, k_max_frame_side_px);
  visitor.region("region", value.region);
  visitor.numbers("pixel_aspect", &value.pixel_aspect.x, 2);
  visitor.text("camera", value.camera);
  visitor.text("world", value.world);
  visitor.text("integrator", value.integrator);
  visitor.integer("samples", value.samples, 0, int64_t(1) << 53);
  visitor.number("time_limit_s", value.time_limit_s);
  visitor.number("noise_threshold", value.noise_threshold);
  visitor.integer("seed", value.seed, 0, UINT32_MAX);
  visitor.integer("max_bounces", value.max_bounces, 0, INT32_MAX);
  visitor.integer("diffuse_bounces", value.diffuse_bounces, 0, INT32_MAX);
  visitor.integer("glossy_bounces", value.glossy_bounces, 0, INT32_MAX);
  visitor.integer("transmission_bounces", value.transmission_bounces, 0, INT32_MAX);
  visitor.integer("transparent_bounces", value.transparent_bounces, 0, INT32_MAX);
  visitor.integer("volume_bounces", value.volume_bounces, 0, INT32_MAX);
  visitor.choice("pixel_filter", value.pixel_filter, k_pixel_filters);
  visitor.number("filter_width_px", value.filter_width_px);
  visitor.boolean("film_transparent", value.film_transparent);
  visitor.boolean("film_transparent_glass", value.film_transparent_glass);
  visitor.number("film_transparent_roughness", value.film_transparent_roughness);
  visitor.number("exposure", value.exposure);
  visitor.number("clamp_direct", value.clamp_direct);
  visitor.number("clamp_indirect", value.clamp_indirect);
  visitor.number("light_threshold", value.light_threshold);
  visitor.boolean("caustics_reflective", value.caustics_reflective);
  visitor.boolean("caustics_refractive", value.caustics_refractive);
  visitor.number("merge_radius_px", value.merge_radius_px);
  visitor.number("merge_alpha", value.merge_alpha);
  visitor.integer("shared_light_paths", value.shared_light_paths, 1, 4096);
  visitor.number("clamp_connection", value.clamp_connection);
  visitor.integer("tile_size_px", value.tile_size_px, 8, 4096);
  visitor.passes("passes", value.passes);
  visitor.group("mist", [&](auto& group) {
    group.number("start_m", value.mist.start_m);
    group.number("depth_m", value.mist.depth_m);
    group.choice("falloff", value.mist.falloff, k_mist_falloffs);
  });
  visitor.number("ambient_occlusion_distance_m", value.ambient_occlusion_distance_m);
  visitor.number("pass_alpha_threshold", value.pass_alpha_threshold);
  visitor.integer("threads", value.threads, 0, 4096);
  visitor.text("ocio_config", value.ocio_config);
  visitor.text("working_space", value.working_space);
  visitor.integer("frame", value.frame, INT32_MIN, INT32_MAX);
  visitor.text_map("metadata", value.metadata);
}

/// Calls the list of value's own type.
template <typename V, typename T>
void visit_fields(V& visitor, T& value) {
  using Type = std::remove_const_t<T>;
  if constexpr (std::is_same_v<Type, Mesh>) visit_mesh(visitor, value);
  if constexpr (std::is_same_v<Type, Image>) visit_image(visitor, value);
  if constexpr (std::is_same_v<Type, Material>) visit_material(visitor, value);
  if constexpr (std::is_same_v<Type, Light>) visit_light(visitor, value);
  if constexpr (std::is_same_v<Type, Object>) visit_object(visitor, value);
  if constexpr (std::is_same_v<Type, Camera>) visit_camera(visitor, value);
  if constexpr (std::is_same_v<Type, World>) visit_world(visitor, value);
  if constexpr (std::is_same_v<Type, Settings>) visit_settings(visitor, value);
}

}  // namespace lambent::description
