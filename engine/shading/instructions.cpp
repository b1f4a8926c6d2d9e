// The interpreter's value instructions. One switch; each case reads its operands, computes, writes its register.
// The file is long because the switch is one table of node definitions.
#include <cstring>

#include "engine/shading/fresnel.h"
#include "engine/shading/node_math.h"
#include "engine/shading/noise.h"
#include "engine/shading/program_data.h"
#include "engine/shading/ray_instructions.h"

namespace lambent {

Vec3 object_normal(const ShadingPoint& point, const Vec3& n) {
  return point.world_from_object ? normalize(point.world_from_object->transposed_vector(n)) : n;
}

namespace {

void store(float* out, const Vec3& v) { out[0] = v.x, out[1] = v.y, out[2] = v.z; }

// @param shift 0 here, 1 or 2 a step further that bumps need
Vec3 shifted_position(const ShadingPoint& point, const Vec3& p, int shift, const ProgramData& program) {
  return shift ? p + (shift == 1 ? point.dpdx_world : point.dpdy_world) * program.bump_filter_width : p;
}
Vec3 position_at(const ShadingPoint& point, int shift, const ProgramData& program) {
  if (program.world) return point.wi_world * -1.0f;
  return shifted_position(point, point.p_world + point.origin_shift, shift, program);
}
Vec3 object_position_at(const ShadingPoint& point, int shift, const ProgramData& program) {
  if (program.world || !point.object_from_world) return position_at(point, shift, program);
  return point.object_from_world->point(shifted_position(point, point.p_world, shift, program));
}

// Normals go to object space with the transposed world_from_object, to world space with the transposed inverse.
Vec3 world_normal(const ShadingPoint& point, const Vec3& n) {
  return point.object_from_world ? normalize(point.object_from_world->transposed_vector(n)) : normalize(n);
}

float light_path(const ShadingPoint& point, LightPathField field) {
  const auto kind = [&](uint32_t bit) { return point.ray_kind & bit ? 1.0f : 0.0f; };
  switch (field) {
    case LightPathField::camera:
      return kind(k_ray_camera);
    case LightPathField::shadow:
      return kind(k_ray_shadow);
    case LightPathField::diffuse:
      return kind(k_ray_diffuse);
    case LightPathField::glossy:
      return kind(k_ray_glossy);
    case LightPathField::singular:
      return kind(k_ray_singular);
    case LightPathField::reflection:
      return kind(k_ray_diffuse | k_ray_glossy) * (1.0f - kind(k_ray_transmission));
    case LightPathField::transmission:
      return kind(k_ray_transmission);
    case LightPathField::volume_scatter:
      return kind(k_ray_volume_scatter);
    case LightPathField::length:
      return point.ray_length;
    case LightPathField::depth:
      return static_cast<float>(point.ray_depth);
    case LightPathField::diffuse_depth:
      return static_cast<float>(point.diffuse_depth);
    case LightPathField::glossy_depth:
      return static_cast<float>(point.glossy_depth);
    case LightPathField::transparent_depth:
      return static_cast<float>(point.transparent_depth);
    case LightPathField::transmission_depth:
      return static_cast<float>(point.transmission_depth);
  }
  return 0.0f;
}

float map_range(MapRange type, float x, float from_min, float from_max, float to_min, float to_max, float steps) {
  if (from_max == from_min) return 0.0f;
  float t = (x - from_min) / (from_max - from_min);
  switch (type) {
    case MapRange::linear:
      break;
    case MapRange::stepped:
      t = steps > 0.0f ? std::floor(t * (steps + 1.0f)) / steps : 0.0f;
      break;
    case MapRange::smoothstep:
      t = saturate(t), t = t * t * (3.0f - 2.0f * t);
      break;
    case MapRange::smootherstep:
      t = saturate(t), t = t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f);
      break;
  }
  return to_min + t * (to_max - to_min);
}

Vec3 mapping(MappingType type, const Vec3& vector, const Vec3& location, const Vec3& rotation, const Vec3& scale) {
  Vec3 rows[3];
  euler_rows(rotation, rows);
  const auto rotated = [&](const Vec3& v) { return Vec3(dot(rows[0], v), dot(rows[1], v), dot(rows[2], v)); };
  const auto divided = [](const Vec3& a, const Vec3& b) {
    return Vec3(safe_divide(a.x, b.x), safe_divide(a.y, b.y), safe_divide(a.z, b.z));
  };
  switch (type) {
    case MappingType::point:
      return rotated(vector * scale) + location;
    case MappingType::texture: {
      const Vec3 v = vector - location;
      return divided(rows[0] * v.x + rows[1] * v.y + rows[2] * v.z, scale);
    }
    case MappingType::vector:
      return rotated(vector * scale);
    case MappingType::normal:
      return normalize(rotated(divided(vector, scale)));
  }
  return vector;
}

Vec3 vector_rotate(RotateType type, const Arguments& a, float sign) {
  const Vec3 vector = a.v(0), center = a.v(1);
  const float angle = a.f(3) * sign;
  switch (type) {
    case RotateType::axis_angle: {
      const Vec3 axis = normalize(a.v(2));
      return length_squared(axis) > 0.0f ? rotate_around_axis(vector - center, axis, angle) + center : vector;
    }
    case RotateType::x:
      return rotate_around_axis(vector - center, {1, 0, 0}, angle) + center;
    case RotateType::y:
      return rotate_around_axis(vector - center, {0, 1, 0}, angle) + center;
    case RotateType::z:
      return rotate_around_axis(vector - center, {0, 0, 1}, angle) + center;
    case RotateType::euler: {
      Vec3 rows[3];
      euler_rows(a.v(4), rows);
      const Vec3 v = vector - center;
      return center + (sign > 0.0f ? Vec3(dot(rows[0], v), dot(rows[1], v), dot(rows[2], v))
                                   : rows[0] * v.x + rows[1] * v.y + rows[2] * v.z);
    }
  }
  return vector;
}

// Spaces of vector_transform's variant.
enum class Space { world, object, camera };

Vec3 to_world(const ShadingPoint& point, Space space, bool is_point, const Vec3& v) {
  if (space == Space::object && point.world_from_object)
    return is_point ? point.world_from_object->point(v) + point.origin_shift : point.world_from_object->vector(v);
  if (space == Space::camera && point.view)
    return is_point ? point.view->world_from_camera.point(v) + point.origin_shift
                    : point.view->world_from_camera.vector(v);
  return v;
}
Vec3 from_world(const ShadingPoint& point, Space space, bool is_point, const Vec3& v) {
  if (space == Space::object && point.object_from_world)
    return is_point ? point.object_from_world->point(v - point.origin_shift) : point.object_from_world->vector(v);
  if (space == Space::camera && point.view)
    return is_point ? point.view->camera_from_world.point(v - point.origin_shift)
                    : point.view->camera_from_world.vector(v);
  return v;
}

Vec3 vector_transform(int variant, const ShadingPoint& point, const Vec3& v) {
  const auto from = static_cast<Space>(variant % 3), to = static_cast<Space>(variant / 3 % 3);
  const int kind = variant / 9;
  if (kind == 3) {  // normals, as such
    if (from == to) return v;
    const Vec3 world = from == Space::object   ? world_normal(point, v)
                       : from == Space::camera ? normalize(to_world(point, from, false, v))
                                               : v;
    return to == Space::object   ? object_normal(point, world)
           : to == Space::camera ? normalize(from_world(point, to, false, world))
                                 : world;
  }
  const Vec3 result = from_world(point, to, kind == 1, to_world(point, from, kind == 1, v));
  return kind == 2 ? normalize(result) : result;
}

// In the camera's space: x right, y up, z forward. The world lies around the camera.
Vec3 camera_position(const ShadingPoint& point, bool world) {
  if (!point.view) return world ? point.wi_world * -1.0f : point.p_world;
  return world ? point.view->camera_from_world.vector(point.wi_world * -1.0f)
               : point.view->camera_from_world.point(point.p_world);
}

Vec3 window_position(const ShadingPoint& point, int shift, const ProgramData& program) {
  if (!point.view) return Vec3(0.0f);
  Vec3 p = camera_position(point, program.world);
  if (shift && !program.world)
    p += point.view->camera_from_world.vector(shift == 1 ? point.dpdx_world : point.dpdy_world) *
         program.bump_filter_width;
  const float scale = point.view->perspective ? safe_divide(1.0f, p.z) : 1.0f;
  return {point.view->window_offset.x + point.view->window_scale.x * p.x * scale,
          point.view->window_offset.y + point.view->window_scale.y * p.y * scale, 0.0f};
}

// 1 within half the size of an edge of the triangle.
float wireframe(const ShadingPoint& point, bool in_pixels, float size) {
  float half = 0.5f * size;
  if (in_pixels) {
    const auto across = [&](const Vec3& d) { return length(d - point.wi_world * dot(d, point.wi_world)); };
    half *= 0.5f * (across(point.dpdx_world) + across(point.dpdy_world));
  }
  // Corners relative to the point, from the tangents of the barycentric coordinates
  const Vec3 a = point.dpdu_world * -point.barycentric.x - point.dpdv_world * point.barycentric.y;
  const Vec3 corners[3] = {a, a + point.dpdu_world, a + point.dpdv_world};
  for (int i = 0; i < 3; ++i) {
    const Vec3 edge = corners[(i + 1) % 3] - corners[i], area = cross(edge, corners[i]);
    if (length_squared(area) < length_squared(edge) * half * half) return 1.0f;
  }
  return 0.0f;
}

float light_falloff(const ShadingPoint& point, int kind, float strength, float smooth) {
  const float length = point.ray_length, squared = length * length;
  if (kind == 1) strength *= length;
  if (kind == 2) strength *= squared;
  if (smooth > 0.0f && std::isfinite(squared)) strength *= squared / (smooth + squared);
  return std::isfinite(strength) ? strength : 0.0f;
}

void look_up_table(const std::vector<float>& table, int width, float x, float* out) {
  const int rows = static_cast<int>(table.size()) / width;
  const float scaled = std::isfinite(x) ? saturate(x) * (rows - 1) : 0.0f;
  const int row = std::min(static_cast<int>(scaled), rows - 1), next = std::min(row + 1, rows - 1);
  for (int k = 0; k < width; ++k) out[k] = lerp(table[row * width + k], table[next * width + k], scaled - row);
}

Vec3 normal_map(int variant, const ShadingPoint& point, const Arguments& a) {
  const auto space = static_cast<NormalSpace>(variant % k_normal_map_newer);
  const bool newer = variant & k_normal_map_newer;
  Vec3 color = a.v(0) * 2.0f - Vec3(1.0f);
  if (variant & k_normal_map_directx) color.y = -color.y;
  float strength = a.f(1);
  const Vec3 ns = a.v(2);
  Vec3 n;
  if (space == NormalSpace::tangent) {
    // In object space, as Cycles. The normal here is not flipped towards the view.
    const float* tangent = a.at(3);
    const Vec3 t_world(tangent[0], tangent[1], tangent[2]);
    if (length_squared(t_world) == 0.0f) return ns;
    const Vec3 t = point.object_from_world ? normalize(point.object_from_world->vector(t_world)) : t_world;
    const bool original = variant & k_normal_map_original;
    if (newer && !original) {
      color = {color.x * strength, color.y * strength, lerp(1.0f, color.z, saturate(strength))};
      strength = 1.0f;
    }
    const Vec3 base = original ? a.v(4) : point.ns_world;
    const Vec3 normal = object_normal(point, point.backfacing ? base * -1.0f : base);
    const float sign = point.world_from_object && point.world_from_object->mirrors() ? -tangent[3] : tangent[3];
    n = world_normal(point, t * color.x + cross(normal, t) * (sign * color.y) + normal * color.z);
  } else {
    if (space == NormalSpace::blender_object || space == NormalSpace::blender_world)
      color = {color.x, -color.y, -color.z};
    n = space == NormalSpace::object || space == NormalSpace::blender_object ? world_normal(point, color)
                                                                             : normalize(color);
  }
  if (point.backfacing) n = n * -1.0f;
  if (strength != 1.0f) n = normalize(ns + (n - ns) * std::max(strength, 0.0f));
  return length_squared(n) > 0.0f ? n : ns;
}

Vec3 bump(int variant, const ShadingPoint& point, const Arguments& a) {
  // Mikkelsen 2010, "Bump Mapping Unparametrized Surfaces on the GPU", with heights one footprint apart
  const bool in_object_space = variant & k_bump_object;
  const Vec3 n_world = a.v(0), n = in_object_space ? object_normal(point, n_world) : n_world;
  Vec3 dpdx = point.dpdx_world, dpdy = point.dpdy_world;
  float width = a.program.bump_filter_width;
  if (in_object_space) {
    dpdx = a.v(6), dpdy = a.v(7);
    width = 1.0f;  // the steps are as wide as the filter
    if (point.object_from_world)
      dpdx = point.object_from_world->vector(dpdx), dpdy = point.object_from_world->vector(dpdy);
  }
  const float strength = std::max(a.f(1), 0.0f), distance = (variant & k_bump_inverted ? -a.f(2) : a.f(2)) / width;
  const float h = a.f(3), hx = a.f(4), hy = a.f(5);
  // What a footprint of 1e-4 m needs would underflow in the determinant: work in footprints.
  const float size = std::max(length(dpdx), length(dpdy));
  if (!(size > 0.0f) || !std::isfinite(size)) return n_world;
  dpdx *= 1.0f / size, dpdy *= 1.0f / size;
  const Vec3 rx = cross(dpdy, n), ry = cross(n, dpdx);
  const float determinant = dot(dpdx, rx);
  const Vec3 gradient = rx * ((hx - h) / size) + ry * ((hy - h) / size);
  Vec3 bumped = normalize(n * std::fabs(determinant) - gradient * (determinant < 0.0f ? -distance : distance));
  if (length_squared(bumped) == 0.0f) return n_world;
  bumped = normalize(bumped * strength + n * (1.0f - strength));
  if (length_squared(bumped) == 0.0f) return n_world;
  if (in_object_space) bumped = world_normal(point, bumped);
  return variant & k_bump_newer ? bumped : valid_reflection_normal(point.ng_world, point.wi_world, bumped);
}

void store_particle(const ShadingPoint& point, ParticleField field, float* out) {
  static constexpr ParticleState k_none{};
  const ParticleState& particle = point.particle ? *point.particle : k_none;
  switch (field) {
    case ParticleField::random:
      *out = hash_integers(static_cast<uint32_t>(std::clamp(particle.index, 0.0f, 4e9f)), 0);
      break;
    case ParticleField::index:
      *out = particle.index;
      break;
    case ParticleField::age:
      *out = particle.age;
      break;
    case ParticleField::lifetime:
      *out = particle.lifetime;
      break;
    case ParticleField::size:
      *out = particle.size;
      break;
    case ParticleField::location:
      store(out, particle.location);
      break;
    case ParticleField::velocity:
      store(out, particle.velocity);
      break;
    case ParticleField::angular_velocity:
      store(out, particle.angular_velocity);
      break;
  }
}

Vec3 default_tangent(const ShadingPoint& point, const float* generated) {
  const Vec3 radial(-(generated[1] - 0.5f), generated[0] - 0.5f, 0.0f);
  const Vec3 t = normalize(cross(world_normal(point, radial), point.ns_world));
  return cross(point.ns_world, t);
}

}  // namespace

void run_instruction(const ProgramData& program, const Instruction& instruction, const ShadingPoint& point,
                     const TextureSystem* textures, float* registers) {
  const Arguments a{program, program.operands.data() + instruction.operands, registers};
  float* out = registers + instruction.out;
  const int variant = instruction.variant;
  switch (instruction.op) {
    case Op::position:
      store(out, position_at(point, variant, program));
      break;
    case Op::normal:
      store(out, program.world ? point.wi_world : point.ns_world);
      break;
    case Op::true_normal:
      store(out, program.world ? point.wi_world : point.ng_world);
      break;
    case Op::incoming:
      store(out, point.wi_world);
      break;
    case Op::default_tangent:
      store(out, default_tangent(point, a.at(0)));
      break;
    case Op::bitangent:
      store(out, normalize(point.dpdv_world));
      break;
    case Op::parametric:
      store(out, {1.0f - point.barycentric.x - point.barycentric.y, point.barycentric.x, 0.0f});
      break;
    case Op::backfacing:
      *out = point.backfacing ? 1.0f : 0.0f;
      break;
    case Op::attribute: {
      const AttributeValue& value = point.attributes[instruction.data];
      Vec4 v = value.value;
      if (variant) v += (variant == 1 ? value.ddx : value.ddy) * program.bump_filter_width;
      store(out, {v.x, v.y, v.z});
      out[3] = v.w;
      break;
    }
    case Op::object_position:
      store(out, object_position_at(point, variant, program));
      break;
    case Op::object_normal:
      store(out, program.world ? point.wi_world : object_normal(point, point.ns_world));
      break;
    case Op::object_location:
      store(out, point.world_from_object ? point.world_from_object->origin() + point.origin_shift : Vec3(0.0f));
      break;
    case Op::reflection:
      store(out, program.world ? point.wi_world
                               : point.ns_world * (2.0f * dot(point.ns_world, point.wi_world)) - point.wi_world);
      break;
    case Op::light_path:
      *out = light_path(point, static_cast<LightPathField>(variant));
      break;
    case Op::object_index:
      *out = static_cast<float>(point.object_pass_index);
      break;
    case Op::material_index:
      *out = static_cast<float>(point.material_pass_index);
      break;
    case Op::particle:
      store_particle(point, static_cast<ParticleField>(variant), out);
      break;
    case Op::object_random:
      *out = static_cast<float>(point.random_id) * (1.0f / static_cast<float>(0xFFFFFFFFu));
      break;
    case Op::view_distance:
      *out = length(camera_position(point, program.world));
      break;
    case Op::view_vector:
      store(out, normalize(camera_position(point, program.world)));
      break;
    case Op::view_depth:
      *out = camera_position(point, program.world).z;
      break;
    case Op::camera_position:
      store(out, camera_position(point, program.world));
      break;
    case Op::window_position:
      store(out, window_position(point, variant, program));
      break;
    case Op::object_color:
      for (int k = 0; k < 4; ++k) out[k] = point.object_color ? (*point.object_color)[k] : 1.0f;
      break;
    case Op::wireframe:
      *out = wireframe(point, variant != 0, a.f(0));
      break;
    case Op::light_falloff:
      *out = light_falloff(point, variant, a.f(0), a.f(1));
      break;

    case Op::math:
      *out = math_operation(static_cast<MathOperation>(variant), a.f(0), a.f(1), a.f(2));
      break;
    case Op::vector_math:
      store(out, vector_operation(static_cast<VectorOperation>(variant), a.v(0), a.v(1), a.v(2), a.f(3)));
      break;
    case Op::vector_math_float:
      *out = vector_operation_float(static_cast<VectorOperation>(variant), a.v(0), a.v(1));
      break;
    case Op::blend:
      store(out, blend_colors(static_cast<Blend>(variant), a.f(0), a.v(1), a.v(2)));
      break;
    case Op::mix_float:
      *out = lerp(a.f(1), a.f(2), a.f(0));
      break;
    case Op::mix_vector:
      store(out, lerp(a.v(1), a.v(2), a.f(0)));
      break;
    case Op::mix_vector_by_vector:
      store(out, a.v(1) + (a.v(2) - a.v(1)) * a.v(0));
      break;
    case Op::clamp:
      *out = std::min(std::max(a.f(0), a.f(1)), a.f(2));
      break;
    case Op::clamp_range: {
      const float low = std::min(a.f(1), a.f(2)), high = std::max(a.f(1), a.f(2));
      *out = std::min(std::max(a.f(0), low), high);
      break;
    }
    case Op::clamp_color: {
      const Vec3 c = a.v(0);
      store(out, {saturate(c.x), saturate(c.y), saturate(c.z)});
      break;
    }
    case Op::map_range:
      *out = map_range(static_cast<MapRange>(variant), a.f(0), a.f(1), a.f(2), a.f(3), a.f(4), a.f(5));
      break;
    case Op::map_range_vector: {
      const Vec3 x = a.v(0), f0 = a.v(1), f1 = a.v(2), t0 = a.v(3), t1 = a.v(4), s = a.v(5);
      const auto type = static_cast<MapRange>(variant);
      store(out, {map_range(type, x.x, f0.x, f1.x, t0.x, t1.x, s.x), map_range(type, x.y, f0.y, f1.y, t0.y, t1.y, s.y),
                  map_range(type, x.z, f0.z, f1.z, t0.z, t1.z, s.z)});
      break;
    }
    case Op::mapping:
      store(out, mapping(static_cast<MappingType>(variant), a.v(0), a.v(1), a.v(2), a.v(3)));
      break;
    case Op::vector_rotate:
      store(out, vector_rotate(static_cast<RotateType>(variant & 15), a, variant & 16 ? -1.0f : 1.0f));
      break;
    case Op::vector_transform:
      store(out, vector_transform(instruction.variant, point, a.v(0)));
      break;
    case Op::combine:
      store(out, {a.f(0), a.f(1), a.f(2)});
      break;
    case Op::convert_color: {
      const Color c = a.v(0);
      switch (static_cast<ColorModel>(variant)) {
        case ColorModel::rgb_to_hsv:
          store(out, hsv_from_rgb(c));
          break;
        case ColorModel::hsv_to_rgb:
          store(out, rgb_from_hsv(c));
          break;
        case ColorModel::rgb_to_hsl:
          store(out, hsl_from_rgb(c));
          break;
        case ColorModel::hsl_to_rgb:
          store(out, rgb_from_hsl(c));
          break;
      }
      break;
    }
    case Op::luminance:
      // Blender's weights, the row Y of its configuration's matrix
      *out = dot(a.v(0), Vec3(0.2126729f, 0.7151522f, 0.0721750f));
      break;
    case Op::average: {
      const Vec3 v = a.v(0);
      // Exact for numbers that came as colours, except where Cycles is not
      *out = variant == 0 && v.x == v.y && v.y == v.z ? v.x : (v.x + v.y + v.z) * (1.0f / 3.0f);
      break;
    }
    case Op::length:
      *out = length(a.v(0));
      break;
    case Op::scale_color:
      store(out, a.v(0) * a.f(1));
      break;
    case Op::multiply:
      *out = a.f(0) * a.f(1);
      break;
    case Op::mix_weight_first:
      *out = a.f(0) * (1.0f - saturate(a.f(1)));
      break;
    case Op::mix_weight_second:
      *out = a.f(0) * saturate(a.f(1));
      break;
    case Op::invert: {
      const Vec3 c = a.v(1);
      store(out, lerp(c, Vec3(1.0f) - c, a.f(0)));
      break;
    }
    case Op::gamma: {
      const Vec3 c = a.v(0);
      const float g = a.f(1);
      const auto power = [g](float x) { return g == 0.0f ? 1.0f : x > 0.0f ? std::pow(x, g) : x; };
      store(out, {power(c.x), power(c.y), power(c.z)});
      break;
    }
    case Op::bright_contrast: {
      const Vec3 c = a.v(0);
      const float scale = 1.0f + a.f(2), offset = a.f(1) - a.f(2) * 0.5f;
      const auto f = [&](float x) { return std::max(scale * x + offset, 0.0f); };
      store(out, {f(c.x), f(c.y), f(c.z)});
      break;
    }
    case Op::hue_saturation: {  // hue, saturation, value, factor, color
      const Color in = a.v(4);
      Color hsv = hsv_from_rgb(in);
      hsv.x = std::fmod(hsv.x + a.f(0) + 0.5f, 1.0f);
      hsv.y = saturate(hsv.y * a.f(1));
      hsv.z *= a.f(2);
      const Color c = lerp(in, rgb_from_hsv(hsv), a.f(3));
      store(out, {std::max(c.x, 0.0f), std::max(c.y, 0.0f), std::max(c.z, 0.0f)});
      break;
    }
    case Op::ramp: {
      const std::vector<float>& table = program.tables[instruction.data];
      if (variant) {  // constant: no interpolation between entries
        const int rows = static_cast<int>(table.size()) / 4;
        const float f = a.f(0);
        const int row = std::isfinite(f) ? static_cast<int>(saturate(f) * (rows - 1)) : 0;
        for (int k = 0; k < 4; ++k) out[k] = table[row * 4 + k];
      } else {
        look_up_table(table, 4, a.f(0), out);
      }
      break;
    }
    case Op::curves: {  // factor, colour; the table's last two floats are the range that it spans; variant: 1 goes on
                        // straight beyond its ends
      const std::vector<float>& table = program.tables[instruction.data];
      const Vec3 c = a.v(1);
      const int rows = static_cast<int>((table.size() - 2) / 3);
      const float low = table[table.size() - 2], high = table[table.size() - 1];
      float result[3];
      for (int k = 0; k < 3; ++k) {
        const float x = safe_divide(c[k] - low, high - low) * (rows - 1);
        const float clamped = std::isfinite(x) ? std::clamp(x, 0.0f, static_cast<float>(rows - 1)) : 0.0f;
        const int row = std::min(static_cast<int>(clamped), rows - 2);
        const float t = (variant && std::isfinite(x) ? x : clamped) - row;
        result[k] = lerp(table[row * 3 + k], table[(row + 1) * 3 + k], t);
      }
      store(out, lerp(c, Vec3(result[0], result[1], result[2]), a.f(0)));
      break;
    }

    case Op::ambient_occlusion:
      *out = ambient_occlusion(point, a.v(0), a.f(1), static_cast<int>(a.f(2)), variant & 1, variant & 2);
      break;
    case Op::raycast: {
      const Raycast cast = cast_ray(point, a.v(0), a.v(1), a.f(2), variant & 1);
      out[0] = cast.hit ? 1.0f : 0.0f, out[1] = cast.own_object ? 1.0f : 0.0f, out[2] = cast.distance;
      store(out + 3, cast.position);
      store(out + 6, cast.normal);
      std::memcpy(out + 9, &cast.place, sizeof(cast.place));
      break;
    }
    case Op::met_attribute: {
      ShaderRays::MetAttribute met{Vec4(0.0f), 0.0f};
      if (a.f(0) != 0.0f) {
        SurfacePlace place;
        std::memcpy(static_cast<void*>(&place), a.at(1), sizeof(place));
        met = point.rays->attribute(place, program.met_attributes[instruction.data]);
      }
      for (int k = 0; k < 4; ++k) out[k] = met.value[k];
      out[4] = met.number;
      break;
    }
    case Op::bevel: {
      const Vec3 n = bevelled_normal(point, a.f(0), static_cast<int>(a.f(1)));
      store(out, variant ? normalize(a.v(2) + n - point.ns_world) : n);
      break;
    }
    case Op::fresnel: {
      const float eta = std::max(a.f(0), 1e-5f);
      *out = fresnel_dielectric(dot(point.wi_world, a.v(1)), point.backfacing ? 1.0f / eta : eta);
      break;
    }
    case Op::layer_weight_fresnel: {
      const float eta = std::max(1.0f - a.f(0), 1e-5f);
      *out = fresnel_dielectric(dot(point.wi_world, a.v(1)), point.backfacing ? eta : 1.0f / eta);
      break;
    }
    case Op::layer_weight_facing: {
      float f = std::fabs(dot(point.wi_world, a.v(1)));
      if (a.f(0) != 0.5f) {
        const float blend = std::clamp(a.f(0), 0.0f, 1.0f - 1e-5f);
        f = std::pow(f, blend < 0.5f ? 2.0f * blend : 0.5f / (1.0f - blend));
      }
      *out = 1.0f - f;
      break;
    }
    case Op::normal_map:
      store(out, normal_map(variant, point, a));
      break;
    case Op::bump:
      store(out, bump(variant, point, a));
      break;
    case Op::normal_dot:
      *out = dot(normalize(a.v(0)), normalize(a.v(1)));
      break;
    case Op::radial_tangent: {
      const Vec3 g = a.v(0) - Vec3(0.5f);
      store(out, variant == 0 ? Vec3(0.0f, -g.z, g.y) : variant == 1 ? Vec3(-g.z, 0.0f, g.x) : Vec3(-g.y, g.x, 0.0f));
      break;
    }
    case Op::world_tangent: {
      // Cycles turns tangents as normals; attributes are turned as what they are.
      Vec3 t = a.v(0);
      if (!variant && point.object_from_world) t = point.object_from_world->vector(t);
      t = world_normal(point, t);
      store(out, cross(point.ns_world, normalize(cross(t, point.ns_world))));
      break;
    }
    case Op::wavelength:
      store_color(out, wavelength_color(a.f(0)), variant != 0);
      break;
    case Op::object_normal_of:
      store(out, object_normal(point, a.v(0)));
      break;
    case Op::blackbody:
      store_color(out, blackbody_color(a.f(0)), variant != 0);
      break;

    case Op::texture_image:
    case Op::texture_environment:
    case Op::voxels:
    case Op::noise:
    case Op::musgrave:
    case Op::voronoi:
    case Op::wave:
    case Op::magic:
    case Op::brick:
    case Op::gabor:
    case Op::white_noise:
    case Op::checker:
    case Op::gradient:
    case Op::radial_tiling:
    case Op::sky:
    case Op::ies:
      run_texture_instruction(program, instruction, point, textures, a, out);
      break;
    case Op::closure:
      break;
  }
}

}  // namespace lambent
