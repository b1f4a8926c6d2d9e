// One value of every kind with no member at its default, for round trips.
#pragma once

#include <map>
#include <vector>

#include "engine/description/json_codec.h"

namespace lambent::description {

template <typename T>
ArrayPointer array_of(ElementType type, std::vector<uint64_t> shape, const std::vector<T>& elements) {
  return make_array(type, std::move(shape), elements.data());
}

inline Node node_of(const char* name, const char* type) {
  Node node;
  node.name = name;
  node.type = type;
  return node;
}

inline Graph full_graph() {
  Graph graph;
  Node ramp = node_of("Ramp", "ValToRGB");
  ramp.inputs["Fac"] = Link{1, "Fac"};
  ramp.properties["ramp_interpolation"] = std::string("EASE");
  ramp.ramp = {{0, 0.1f, 0.2f, 0.3f, 1}, {1, 1, 0, 0.5f, 0.25f}};
  Node noise = node_of("Noise", "TexNoise");
  noise.inputs["Scale"] = 5.5f;
  noise.inputs["Vector"] = Numbers{1, 2, 3};
  noise.properties["normalize"] = true;
  Node curves = node_of("Curves", "RGBCurve");
  curves.inputs["Color"] = Link{0, "Color"};
  curves.curves = {{0, 0, 1, 1}, {0, 0.5f, 1, 0.1f}};
  graph.nodes = {ramp, noise, curves};
  graph.surface = Link{2, "Color"};
  graph.displacement = Link{1, "Fac"};
  graph.displacement_method = DisplacementMethod::both;
  graph.transparent_shadow = false;
  graph.volume = Link{0, "Color"};
  return graph;
}

inline Mesh full_mesh() {
  Mesh mesh;
  mesh.name = "Cube é";
  mesh.positions = array_of<float>(ElementType::f32, {3, 3}, {0, 0, 0, 1, 0, 0, 0, 1, 0});
  mesh.triangles = array_of<uint32_t>(ElementType::u32, {1, 3}, {0, 1, 2});
  mesh.triangle_corners = array_of<uint32_t>(ElementType::u32, {1, 3}, {2, 1, 0});
  mesh.triangle_faces = array_of<uint32_t>(ElementType::u32, {1}, {7});
  mesh.triangle_materials = array_of<uint16_t>(ElementType::u16, {1}, {3});
  mesh.normals = array_of<float>(ElementType::f32, {3, 3}, {0, 0, 1, 0, 0, 1, 0, 0, 1});
  mesh.normals_domain = Domain::vertex;
  mesh.attributes.push_back(
      {"UVMap", Domain::corner, AttributeRole::uv, array_of<float>(ElementType::f32, {3, 2}, {0, 0, 1, 0, 0, 1})});
  mesh.attributes.push_back(
      {"Col", Domain::face, AttributeRole::color, array_of<float>(ElementType::f32, {1, 4}, {1, 0, 0, 1})});
  mesh.active_uv = "UVMap";
  mesh.active_color = "Col";
  mesh.texture_space_location = {1, 2, 3};
  mesh.texture_space_size = {4, 5, 6};
  return mesh;
}

/// Transactions that between them hold every kind and every optional member.
inline Transaction full_transaction() {
  Transaction transaction;
  transaction.epoch = 42;
  const auto add = [&](std::string id, Value value) {
    transaction.edits.emplace_back(Upsert{std::move(id), std::move(value)});
  };
  transaction.edits.emplace_back(Clear{});
  add("mesh", full_mesh());

  Image image;
  image.name = "Wood";
  image.path = "/tmp/wood.png";
  image.colorspace = "sRGB";
  image.alpha = AlphaMode::channel_packed;
  add("image-path", image);
  image.path.clear();
  image.encoded = array_of<uint8_t>(ElementType::u8, {5}, {1, 2, 3, 4, 5});
  image.extension = ".png";
  add("image-encoded", image);
  image.encoded = nullptr;
  image.pixels = array_of<float>(ElementType::f32, {1, 2, 3}, {1, 2, 3, 4, 5, 6});
  add("image-pixels", image);

  add("material", Material{"Paint", full_graph(), 5});
  World world{"Sky", full_graph(), {false, true, false, true, false, true}, "sky", 512};
  add("world", world);

  Light light;
  light.name = "Key";
  light.type = LightType::area;
  light.color = {0.5f, 0.25f, 2};
  light.energy = 1e30f;
  light.exposure = -1.5f;
  light.normalize = false;
  light.radius_m = 0.1f;
  light.angle_rad = 0.2f;
  light.spot_size_rad = 1;
  light.spot_blend = 0.3f;
  light.shape = AreaShape::ellipse;
  light.size_m = {2, 3};
  light.spread_rad = 0.5f;
  light.shadows = light.multiple_importance = false;
  light.max_bounces = 3;
  light.soft_falloff = false;
  light.cycles_version = 501;
  light.light_group = "keys";
  light.graph = full_graph();
  add("light", light);

  Object object;
  object.name = "Cubes";
  object.mesh = "mesh";
  object.transforms = array_of<float>(ElementType::f32, {2, 3, 4}, std::vector<float>(24, 0.5f));
  object.materials = {"material", std::nullopt};
  object.visibility = {true, false, true, false, true, false};
  object.random_ids = array_of<uint32_t>(ElementType::u32, {2}, {8, 9});
  object.particles = array_of<float>(ElementType::f32, {2, 13}, std::vector<float>(26, 1.5f));
  object.pass_index = 4;
  object.color = {0.1f, 0.2f, 0.3f, 0.4f};
  object.attributes = {{"wear", {0.25f, 0.5f, 0.75f, 1.0f}}};
  object.light_group = "rim";
  object.light_linking = {"near", "walls", {"near", "far"}, {"walls"}};
  object.shadow_catcher = object.matte = true;
  object.mattes = {"Cubes", "All"};
  object.motion.emplace();
  object.motion->previous.transforms = object.motion->next.transforms = object.transforms;
  object.motion->next.positions = array_of<float>(ElementType::f32, {1, 3}, {1, 2, 3});
  add("object", object);

  Camera camera;
  camera.name = "Camera";
  camera.type = CameraType::orthographic;
  for (int i = 0; i < 12; ++i) camera.transform.m[i / 4][i % 4] = 0.1f * float(i);
  camera.focal_length_mm = 35;
  camera.sensor_width_mm = 32;
  camera.sensor_height_mm = 18;
  camera.sensor_fit = SensorFit::vertical;
  camera.ortho_scale = 7;
  camera.shift = {0.1f, -0.2f};
  camera.clip_near_m = 0.01f;
  camera.clip_far_m = 1e6f;
  camera.depth_of_field = DepthOfField{3, 1.4f, 6, 0.5f, 2};
  camera.motion = CameraMotion{{camera.transform, 34}, {camera.transform, 36}};
  add("camera", camera);

  Settings settings;
  settings.width = 320;
  settings.height = 200;
  settings.region = {10, 20, 300, 200};
  settings.pixel_aspect = {1, 2};
  settings.camera = "camera";
  settings.world = "world";
  settings.integrator = "BPT";
  settings.samples = int64_t(1) << 40;
  settings.time_limit_s = 12.5;
  settings.noise_threshold = 0.01f;
  settings.seed = 0xffffffffu;
  settings.max_bounces = 1;
  settings.diffuse_bounces = 2;
  settings.glossy_bounces = 3;
  settings.transmission_bounces = 5;
  settings.transparent_bounces = 6;
  settings.volume_bounces = 7;
  settings.pixel_filter = PixelFilter::gaussian;
  settings.filter_width_px = 2;
  settings.film_transparent = settings.film_transparent_glass = true;
  settings.film_transparent_roughness = 0.25f;
  settings.exposure = 2;
  settings.clamp_direct = 3;
  settings.clamp_indirect = 4;
  settings.light_threshold = 0.5f;
  settings.caustics_reflective = settings.caustics_refractive = false;
  settings.merge_radius_px = 1.5f;
  settings.merge_alpha = 0.5f;
  settings.shared_light_paths = 9;
  settings.clamp_connection = 8;
  settings.tile_size_px = 32;
  settings.passes = {{"Depth", "depth", ""}, {"Combined_key", "light_group", "key"}};
  settings.mist = {1, 2, MistFalloff::linear};
  settings.ambient_occlusion_distance_m = 3;
  settings.pass_alpha_threshold = 0.25f;
  settings.threads = 3;
  settings.ocio_config = "/tmp/config.ocio";
  settings.working_space = "ACEScg";
  settings.frame = -12;
  settings.metadata = {{"Scene", "Scène"}};
  add("render", settings);
  transaction.edits.emplace_back(Remove{Kind::light, "old"});
  return transaction;
}

/// The arrays of a collector by hash, as a resolver.
inline ArrayResolver resolver_of(const ArrayCollector& collector) {
  std::map<std::string, ArrayPointer> arrays;
  for (const ArrayPointer& array : collector.arrays()) arrays[array->hash] = array;
  return [arrays](const std::string& hash) {
    const auto found = arrays.find(hash);
    return found == arrays.end() ? nullptr : found->second;
  };
}

}  // namespace lambent::description
