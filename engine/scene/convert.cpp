#include "engine/scene/convert.h"

#include <type_traits>
#include <utility>

#include "engine/shading/shading_point.h"

namespace lambent {

namespace {

GraphValue graph_value(const description::SocketValue& value) {
  return std::visit(
      [](const auto& v) -> GraphValue {
        if constexpr (std::is_same_v<std::decay_t<decltype(v)>, description::Link>)
          return GraphLink{v.node, v.socket};
        else
          return v;
      },
      value);
}

std::optional<GraphLink> graph_link(const std::optional<description::Link>& link) {
  if (!link) return std::nullopt;
  return GraphLink{link->node, link->socket};
}

template <typename T>
SharedSpan<T> shared_span(const ArrayPointer& array) {
  return array ? SharedSpan<T>(array->as<T>(), array) : SharedSpan<T>();
}

AttributeDomain domain_of(description::Domain domain) {
  switch (domain) {
    case description::Domain::vertex:
      return AttributeDomain::vertex;
    case description::Domain::corner:
      return AttributeDomain::corner;
    case description::Domain::face:
      break;
  }
  return AttributeDomain::face;
}

AttributeRole role_of(description::AttributeRole role) {
  switch (role) {
    case description::AttributeRole::uv:
      return AttributeRole::uv;
    case description::AttributeRole::color:
      return AttributeRole::color;
    case description::AttributeRole::generic:
      break;
  }
  return AttributeRole::generic;
}

}  // namespace

ShaderGraph shader_graph(const description::Graph& graph) {
  ShaderGraph result;
  result.nodes.reserve(graph.nodes.size());
  for (const description::Node& node : graph.nodes) {
    GraphNode& converted = result.nodes.emplace_back();
    converted.name = node.name;
    converted.type = node.type;
    for (const auto& [name, value] : node.inputs) converted.inputs.emplace(name, graph_value(value));
    for (const auto& [name, value] : node.properties) converted.properties.emplace(name, graph_value(value));
    converted.ramp = node.ramp;
    converted.curves = node.curves;
  }
  result.surface = graph_link(graph.surface);
  result.displacement = graph_link(graph.displacement);
  result.volume = graph_link(graph.volume);
  result.aovs = graph.aovs;
  result.cycles_version = graph.cycles_version;
  result.bump_map_correction = graph.bump_map_correction;
  result.transparent_shadow = graph.transparent_shadow;
  switch (graph.displacement_method) {
    case description::DisplacementMethod::bump:
      result.displacement_method = DisplacementMethod::bump;
      break;
    case description::DisplacementMethod::displacement:
      result.displacement_method = DisplacementMethod::displacement;
      break;
    case description::DisplacementMethod::both:
      result.displacement_method = DisplacementMethod::both;
      break;
  }
  return result;
}

MeshInput mesh_input(const description::Mesh& mesh) {
  MeshInput input;
  input.name = mesh.name;
  input.positions = shared_span<float>(mesh.positions);
  input.triangles = shared_span<uint32_t>(mesh.triangles);
  input.triangle_corners = shared_span<uint32_t>(mesh.triangle_corners);
  input.triangle_faces = shared_span<uint32_t>(mesh.triangle_faces);
  input.triangle_materials = shared_span<uint16_t>(mesh.triangle_materials);
  input.normals = shared_span<float>(mesh.normals);
  input.normals_domain = domain_of(mesh.normals_domain);
  for (const description::Attribute& attribute : mesh.attributes) {
    if (!attribute.values) continue;
    MeshAttribute& converted = input.attributes.emplace_back();
    converted.name = attribute.name;
    converted.domain = domain_of(attribute.domain);
    converted.role = role_of(attribute.role);
    converted.components = static_cast<int>(attribute.values->shape.size() > 1 ? attribute.values->shape[1] : 1);
    converted.values = shared_span<float>(attribute.values);
  }
  input.active_uv = mesh.active_uv;
  input.active_color = mesh.active_color;
  input.texture_space_location = mesh.texture_space_location;
  input.texture_space_size = mesh.texture_space_size;
  return input;
}

ImageSource image_source(const std::shared_ptr<const description::Image>& image) {
  ImageSource source;
  source.name = image->name;
  source.path = image->path;
  if (image->encoded) {
    source.encoded = image->encoded->as<uint8_t>();
    source.content_hash = image->encoded->hash;
  }
  source.extension = image->extension;
  if (image->pixels && image->pixels->shape.size() >= 2) {
    source.content_hash = image->pixels->hash;
    source.pixels = image->pixels->as<float>().data();
    source.height = static_cast<int>(image->pixels->shape[0]);
    source.width = static_cast<int>(image->pixels->shape[1]);
    source.channels = static_cast<int>(image->pixels->shape.size() > 2 ? image->pixels->shape[2] : 1);
  }
  source.owner = image;
  source.colorspace = image->colorspace;
  switch (image->alpha) {
    case description::AlphaMode::straight:
      source.alpha = ImageAlpha::straight;
      break;
    case description::AlphaMode::premultiplied:
      source.alpha = ImageAlpha::premultiplied;
      break;
    case description::AlphaMode::channel_packed:
      source.alpha = ImageAlpha::channel_packed;
      break;
    case description::AlphaMode::none:
      source.alpha = ImageAlpha::none;
      break;
  }
  return source;
}

namespace {
Transform shifted(Transform transform, const Vec3d& origin_shift) {
  for (int i = 0; i < 3; ++i)
    transform.m[i][3] = static_cast<float>(static_cast<double>(transform.m[i][3]) - origin_shift[i]);
  return transform;
}
}  // namespace

CameraSpec camera_spec(const description::Camera& camera, const description::Settings& settings,
                       const Vec3d& origin_shift) {
  CameraSpec spec;
  spec.name = camera.name;
  spec.projection =
      camera.type == description::CameraType::orthographic ? Projection::orthographic : Projection::perspective;
  spec.world_from_camera = shifted(camera.transform, origin_shift);
  spec.width_px = settings.width;
  spec.height_px = settings.height;
  spec.pixel_aspect = settings.pixel_aspect;
  spec.focal_length_mm = camera.focal_length_mm;
  spec.sensor_width_mm = camera.sensor_width_mm;
  spec.sensor_height_mm = camera.sensor_height_mm;
  switch (camera.sensor_fit) {
    case description::SensorFit::automatic:
      spec.sensor_fit = SensorFit::automatic;
      break;
    case description::SensorFit::horizontal:
      spec.sensor_fit = SensorFit::horizontal;
      break;
    case description::SensorFit::vertical:
      spec.sensor_fit = SensorFit::vertical;
      break;
  }
  spec.ortho_scale = camera.ortho_scale;
  spec.shift = camera.shift;
  spec.clip_near_m = camera.clip_near_m;
  spec.clip_far_m = camera.clip_far_m;
  if (camera.depth_of_field) {
    spec.depth_of_field = true;
    spec.focus_distance_m = camera.depth_of_field->focus_distance_m;
    spec.fstop = camera.depth_of_field->fstop;
    spec.blades = camera.depth_of_field->blades;
    spec.rotation_rad = camera.depth_of_field->rotation_rad;
    spec.aperture_ratio = camera.depth_of_field->ratio;
  }
  return spec;
}

uint32_t visibility_mask(const description::Visibility& visibility) {
  return (visibility.camera ? k_ray_camera : 0u) | (visibility.diffuse ? k_ray_diffuse : 0u) |
         (visibility.glossy ? k_ray_glossy : 0u) | (visibility.transmission ? k_ray_transmission : 0u) |
         (visibility.shadow ? k_ray_shadow : 0u) | (visibility.volume_scatter ? k_ray_volume_scatter : 0u);
}

std::vector<Transform> instance_transforms(const ArrayPointer& given, const Vec3d& origin_shift) {
  if (!given) return {};
  const std::span<const float> rows = given->as<float>();
  std::vector<Transform> transforms(rows.size() / 12);
  for (size_t i = 0; i < transforms.size(); ++i)
    transforms[i] = shifted(Transform::from_rows(&rows[12 * i]), origin_shift);
  return transforms;
}

}  // namespace lambent
