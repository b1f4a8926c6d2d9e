// The interpreter's value instructions. One switch; each case reads its operands, computes, writes its register.
// The file is long because the switch is one table of node definitions.
#include "engine/shading/fresnel.h"
#include "engine/shading/node_math.h"
#include "engine/shading/noise.h"
#include "engine/shading/program_data.h"
#include "engine/shading/sky.h"

namespace lambent {
namespace {

// Operands of one instruction.
struct Arguments {
  const ProgramData& program;
  const Operand* operand;
  const float* registers;

  const float* at(int i) const {
    const Operand o = operand[i];
    return o >= 0 ? registers + o : program.constants.data() + ~o;
  }
  float f(int i) const { return *at(i); }
  Vec3 v(int i) const {
    const float* p = at(i);
    return {p[0], p[1], p[2]};
  }
};

void store(float* out, const Vec3& v) { out[0] = v.x, out[1] = v.y, out[2] = v.z; }

Vec3 position_at(const ShadingPoint& point, int shift, bool world) {
  if (world) return point.wi_world * -1.0f;
  const Vec3 p = point.p_world + point.origin_shift;
  return shift == 1 ? p + point.dpdx_world : shift == 2 ? p + point.dpdy_world : p;
}

// Normals go to object space with the transposed world_from_object, to world space with the transposed inverse.
Vec3 object_normal(const ShadingPoint& point, const Vec3& n) {
  return point.world_from_object ? normalize(point.world_from_object->transposed_vector(n)) : n;
}
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

// Bits of vector_transform's variant.
constexpr uint8_t k_transform_to_object = 1, k_transform_point = 2, k_transform_normal = 4;

Vec3 vector_transform(uint8_t variant, const ShadingPoint& point, const Vec3& v) {
  const bool to_object = variant & k_transform_to_object;
  if (variant & k_transform_normal) return to_object ? object_normal(point, v) : world_normal(point, v);
  const Transform* transform = to_object ? point.object_from_world : point.world_from_object;
  if (!transform) return v;
  return variant & k_transform_point ? transform->point(v) : transform->vector(v);
}

void look_up_table(const std::vector<float>& table, int width, float x, float* out) {
  const int rows = static_cast<int>(table.size()) / width;
  const float scaled = std::isfinite(x) ? saturate(x) * (rows - 1) : 0.0f;
  const int row = std::min(static_cast<int>(scaled), rows - 1), next = std::min(row + 1, rows - 1);
  for (int k = 0; k < width; ++k) out[k] = lerp(table[row * width + k], table[next * width + k], scaled - row);
}

Vec3 normal_map(NormalSpace space, const ShadingPoint& point, const Arguments& a) {
  Vec3 color = a.v(0) * 2.0f - Vec3(1.0f);
  float strength = a.f(1);
  const Vec3 ns = a.v(2);
  Vec3 n;
  if (space == NormalSpace::tangent) {
    // In world space; Cycles works in object space with unnormalised normal and tangent, which differs only by the
    // interpolation of non-uniformly scaled instances. The normal here is not flipped towards the view.
    const float* tangent = a.at(3);
    const Vec3 t(tangent[0], tangent[1], tangent[2]);
    if (length_squared(t) == 0.0f) return ns;
    const Vec3 normal = point.backfacing ? point.ns_world * -1.0f : point.ns_world;
    n = normalize(t * color.x + cross(normal, t) * (tangent[3] * color.y) + normal * color.z);
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

Vec3 bump(bool invert, const ShadingPoint& point, const Arguments& a) {
  // Mikkelsen 2010, "Bump Mapping Unparametrized Surfaces on the GPU", with heights one footprint apart
  const Vec3 n = a.v(0);
  const float strength = std::max(a.f(1), 0.0f), distance = invert ? -a.f(2) : a.f(2);
  const float h = a.f(3), hx = a.f(4), hy = a.f(5);
  // What a footprint of 1e-4 m needs would underflow in the determinant: work in footprints.
  const float size = std::max(length(point.dpdx_world), length(point.dpdy_world));
  if (!(size > 0.0f) || !std::isfinite(size)) return n;
  const Vec3 dpdx = point.dpdx_world * (1.0f / size), dpdy = point.dpdy_world * (1.0f / size);
  const Vec3 rx = cross(dpdy, n), ry = cross(n, dpdx);
  const float determinant = dot(dpdx, rx);
  const Vec3 gradient = rx * ((hx - h) / size) + ry * ((hy - h) / size);
  Vec3 bumped = normalize(n * std::fabs(determinant) - gradient * (determinant < 0.0f ? -distance : distance));
  if (length_squared(bumped) == 0.0f) return n;
  bumped = normalize(bumped * strength + n * (1.0f - strength));
  if (length_squared(bumped) == 0.0f) return n;
  return valid_reflection_normal(point.ng_world, point.wi_world, bumped);
}

Vec3 default_tangent(const ShadingPoint& point, const float* generated) {
  const Vec3 radial(-(generated[1] - 0.5f), generated[0] - 0.5f, 0.0f);
  const Vec3 t = normalize(cross(world_normal(point, radial), point.ns_world));
  return cross(point.ns_world, t);
}

Vec2 equirectangular(const Vec3& d) {
  return {0.5f - std::atan2(d.y, d.x) / (2.0f * k_pi), 1.0f - std::acos(std::clamp(d.z, -1.0f, 1.0f)) / k_pi};
}

Texel look_up(const TextureUse& use, const TextureSystem* textures, const Vec2& uv) {
  if (!use.texture) return {Color(1, 0, 1), 1.0f};
  if (!textures) return {texture_average(*use.texture), 1.0f};
  TextureLookup lookup;
  lookup.uv = uv;
  lookup.interpolation = use.interpolation;
  lookup.extension = use.extension;
  lookup.straight_color = use.straight_color;
  return textures->lookup(*use.texture, lookup);
}

// Blender's box projection: one, two or three sides by how the normal lies, blended near the edges.
Texel look_up_box(const TextureUse& use, const TextureSystem* textures, const ShadingPoint& point, const Vec3& co) {
  const Vec3 signed_n = object_normal(point, point.ns_world);
  Vec3 n = abs(signed_n);
  n = n * safe_divide(1.0f, n.x + n.y + n.z);
  Vec3 weight(0.0f);
  const float blend = use.projection_blend, limit = 0.5f * (1.0f + blend);
  if (n.x > limit * (n.x + n.y) && n.x > limit * (n.x + n.z)) {
    weight.x = 1.0f;
  } else if (n.y > limit * (n.x + n.y) && n.y > limit * (n.y + n.z)) {
    weight.y = 1.0f;
  } else if (n.z > limit * (n.x + n.z) && n.z > limit * (n.y + n.z)) {
    weight.z = 1.0f;
  } else if (blend > 0.0f) {
    const auto between = [&](float a, float b) {
      return saturate((safe_divide(a, a + b) - 0.5f * (1.0f - blend)) / blend);
    };
    if (n.z < (1.0f - limit) * (n.y + n.x)) {
      weight.x = between(n.x, n.y), weight.y = 1.0f - weight.x;
    } else if (n.x < (1.0f - limit) * (n.y + n.z)) {
      weight.y = between(n.y, n.z), weight.z = 1.0f - weight.y;
    } else if (n.y < (1.0f - limit) * (n.x + n.z)) {
      weight.x = between(n.x, n.z), weight.z = 1.0f - weight.x;
    } else {
      weight = (n * (2.0f - limit) + Vec3(limit - 1.0f)) * (1.0f / (2.0f * limit - 1.0f));
    }
  } else {
    weight.x = 1.0f;
  }
  Texel sum{Color(0.0f), 0.0f};
  const auto add = [&](float w, const Vec2& uv) {
    if (w <= 0.0f) return;
    const Texel texel = look_up(use, textures, uv);
    sum.color += texel.color * w;
    sum.alpha += texel.alpha * w;
  };
  add(weight.x, {signed_n.x < 0.0f ? 1.0f - co.y : co.y, co.z});
  add(weight.y, {signed_n.y > 0.0f ? 1.0f - co.x : co.x, co.z});
  add(weight.z, {signed_n.z > 0.0f ? 1.0f - co.y : co.y, co.x});
  return sum;
}

Texel texture_image(const TextureUse& use, const TextureSystem* textures, const ShadingPoint& point, const Vec3& co) {
  switch (use.projection) {
    case Projection::box:
      return look_up_box(use, textures, point, co);
    case Projection::sphere: {
      const Vec3 p = co * 2.0f - Vec3(1.0f);
      const float l = length(p);
      if (!(l > 0.0f)) return look_up(use, textures, {0, 0});
      const float u = p.x == 0.0f && p.y == 0.0f ? 0.0f : (1.0f - std::atan2(p.x, p.y) / k_pi) * 0.5f;
      return look_up(use, textures, {u, 1.0f - std::acos(std::clamp(p.z / l, -1.0f, 1.0f)) / k_pi});
    }
    case Projection::tube: {
      const Vec3 p = co * 2.0f - Vec3(1.0f);
      const float l = std::sqrt(p.x * p.x + p.y * p.y);
      if (!(l > 0.0f)) return look_up(use, textures, {0, 0});
      return look_up(use, textures, {(1.0f - std::atan2(p.x / l, p.y / l) / k_pi) * 0.5f, (p.z + 1.0f) * 0.5f});
    }
    default:
      return look_up(use, textures, {co.x, co.y});
  }
}

Texel texture_environment(const TextureUse& use, const TextureSystem* textures, const Vec3& co) {
  const Vec3 d = normalize(co);
  if (use.projection == Projection::mirror_ball) {
    const float divisor = 2.0f * safe_sqrt(-0.5f * (d.y - 1.0f));
    const float s = divisor > 0.0f ? 1.0f / divisor : 1.0f;
    return look_up(use, textures, {0.5f * (d.x * s + 1.0f), 0.5f * (d.z * s + 1.0f)});
  }
  return look_up(use, textures, equirectangular(d));
}

float gradient(GradientType type, const Vec3& p) {
  switch (type) {
    case GradientType::linear:
      return saturate(p.x);
    case GradientType::quadratic:
      return saturate(sqr(std::max(p.x, 0.0f)));
    case GradientType::easing: {
      const float r = saturate(p.x);
      return r * r * (3.0f - 2.0f * r);
    }
    case GradientType::diagonal:
      return saturate((p.x + p.y) * 0.5f);
    case GradientType::radial:
      return saturate(std::atan2(p.y, p.x) / (2.0f * k_pi) + 0.5f);
    case GradientType::quadratic_sphere:
      return saturate(sqr(std::max(0.999999f - length(p), 0.0f)));
    case GradientType::spherical:
      return saturate(std::max(0.999999f - length(p), 0.0f));
  }
  return 0.0f;
}

float checker(const Vec3& p) {
  // A little off the lattice, where faces of unit cubes lie
  const auto cell = [](float x) {
    const float floored = std::floor((x + 0.000001f) * 0.999999f);
    return std::fabs(floored) < 1e9f ? std::abs(static_cast<int>(floored)) % 2 : 0;
  };
  return (cell(p.x) == cell(p.y)) == (cell(p.z) != 0) ? 1.0f : 0.0f;
}

}  // namespace

void run_instruction(const ProgramData& program, const Instruction& instruction, const ShadingPoint& point,
                     const TextureSystem* textures, float* registers) {
  const Arguments a{program, program.operands.data() + instruction.operands, registers};
  float* out = registers + instruction.out;
  const int variant = instruction.variant;
  const auto texel = [&](const Texel& value) {
    store(out, value.color);
    out[3] = value.alpha;
  };
  switch (instruction.op) {
    case Op::position:
      store(out, position_at(point, variant, program.world));
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
    case Op::parametric:
      store(out, {1.0f - point.barycentric.x - point.barycentric.y, point.barycentric.x, 0.0f});
      break;
    case Op::backfacing:
      *out = point.backfacing ? 1.0f : 0.0f;
      break;
    case Op::random_per_island:
      *out = hash_integers(point.random_id, 1);
      break;
    case Op::attribute: {
      const AttributeValue& value = point.attributes[instruction.data];
      Vec4 v = value.value;
      if (variant) v += variant == 1 ? value.ddx : value.ddy;
      store(out, {v.x, v.y, v.z});
      out[3] = v.w;
      break;
    }
    case Op::object_position: {
      const Vec3 p = position_at(point, variant, program.world);
      store(out, point.object_from_world && !program.world ? point.object_from_world->point(p) : p);
      break;
    }
    case Op::object_normal:
      store(out, program.world ? point.wi_world : object_normal(point, point.ns_world));
      break;
    case Op::object_location:
      store(out, point.world_from_object ? point.world_from_object->origin() : Vec3(0.0f));
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
    case Op::object_random:
      *out = static_cast<float>(point.random_id) * (1.0f / static_cast<float>(0xFFFFFFFFu));
      break;
    case Op::view_distance:
      *out = point.ray_length;
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
      *out = luminance(a.v(0));
      break;
    case Op::average: {
      const Vec3 v = a.v(0);
      *out = (v.x + v.y + v.z) * (1.0f / 3.0f);
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
    case Op::curves: {  // factor, colour; the table's last two floats are the range that it spans
      const std::vector<float>& table = program.tables[instruction.data];
      const Vec3 c = a.v(1);
      const int rows = static_cast<int>((table.size() - 2) / 3);
      const float low = table[table.size() - 2], high = table[table.size() - 1];
      float result[3];
      for (int k = 0; k < 3; ++k) {
        const float x = safe_divide(c[k] - low, high - low) * (rows - 1);
        const float clamped = std::isfinite(x) ? std::clamp(x, 0.0f, static_cast<float>(rows - 1)) : 0.0f;
        const int row = std::min(static_cast<int>(clamped), rows - 2);
        // Beyond its ends a curve goes on straight
        const float t = (std::isfinite(x) ? std::clamp(x, -1e4f, 1e4f + rows) : 0.0f) - row;
        result[k] = lerp(table[row * 3 + k], table[(row + 1) * 3 + k], t);
      }
      store(out, lerp(c, Vec3(result[0], result[1], result[2]), a.f(0)));
      break;
    }
    case Op::float_curve: {
      const std::vector<float>& table = program.tables[instruction.data];
      float result;
      look_up_table(table, 1, a.f(1), &result);
      *out = lerp(a.f(1), result, a.f(0));
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
      store(out, normal_map(static_cast<NormalSpace>(variant), point, a));
      break;
    case Op::bump:
      store(out, bump(variant != 0, point, a));
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
      const Vec3 t = variant ? world_normal(point, a.v(0)) : a.v(0);
      store(out, cross(point.ns_world, normalize(cross(t, point.ns_world))));
      break;
    }
    case Op::blackbody: {
      const Color c = blackbody_color(a.f(0));
      store(out, {std::max(c.x, 0.0f), std::max(c.y, 0.0f), std::max(c.z, 0.0f)});
      break;
    }

    case Op::texture_image:
      texel(texture_image(program.textures[instruction.data], textures, point, a.v(0)));
      break;
    case Op::texture_environment:
      texel(texture_environment(program.textures[instruction.data], textures, a.v(0)));
      break;
    case Op::noise: {  // vector, w, scale, detail, roughness, lacunarity, distortion; variant: dimensions, 8: signed,
                       // 16: colour wanted
      NoiseParameters parameters;
      parameters.dimensions = std::max(1, variant & 7);
      parameters.normalize = !(variant & 8);
      parameters.detail = a.f(3);
      parameters.roughness = a.f(4);
      parameters.lacunarity = a.f(5);
      parameters.distortion = a.f(6);
      const Vec3 p = a.v(0) * a.f(2);
      const float w = a.f(1) * a.f(2);
      Color color(0.0f);
      out[3] = noise_texture(parameters.dimensions == 1 ? Vec4(w, 0, 0, 0) : Vec4(p.x, p.y, p.z, w), parameters,
                             variant & 16 ? &color : nullptr);
      store(out, color);
      break;
    }
    case Op::white_noise: {
      const Vec3 p = a.v(0);
      *out = hash_floats(p.x + p.z * 57.0f, p.y + a.f(1) * 131.0f);
      break;
    }
    case Op::checker: {  // vector, color1, color2, scale
      out[3] = checker(a.v(0) * a.f(3));
      store(out, out[3] == 1.0f ? a.v(1) : a.v(2));
      break;
    }
    case Op::gradient:
      *out = gradient(static_cast<GradientType>(variant), a.v(0));
      break;
    case Op::sky:
      store(out, sky_radiance(program.tables[instruction.data], a.v(0)));
      break;
    case Op::closure:
      break;
  }
}

}  // namespace lambent
