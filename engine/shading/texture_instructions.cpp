// The interpreter's instructions of textures, images and procedural ones.
#include "engine/shading/color_math.h"
#include "engine/shading/light_profile.h"
#include "engine/shading/noise.h"
#include "engine/shading/patterns.h"
#include "engine/shading/program_data.h"
#include "engine/shading/sky.h"

namespace lambent {
namespace {

void store(float* out, const Vec3& v) { out[0] = v.x, out[1] = v.y, out[2] = v.z; }

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
    case ImageProjection::box:
      return look_up_box(use, textures, point, co);
    case ImageProjection::sphere: {
      const Vec3 p = co * 2.0f - Vec3(1.0f);
      const float l = length(p);
      if (!(l > 0.0f)) return look_up(use, textures, {0, 0});
      const float u = p.x == 0.0f && p.y == 0.0f ? 0.0f : (1.0f - std::atan2(p.x, p.y) / k_pi) * 0.5f;
      return look_up(use, textures, {u, 1.0f - std::acos(std::clamp(p.z / l, -1.0f, 1.0f)) / k_pi});
    }
    case ImageProjection::tube: {
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
  if (use.projection == ImageProjection::mirror_ball) {
    const float divisor = 2.0f * safe_sqrt(-0.5f * (d.y - 1.0f));
    const float s = divisor > 0.0f ? 1.0f / divisor : 1.0f;
    return look_up(use, textures, {0.5f * (d.x * s + 1.0f), 0.5f * (d.z * s + 1.0f)});
  }
  return look_up(use, textures, equirectangular(d));
}

// A grid of n³ voxels kept as n² rows of n; nothing outside.
Vec4 voxel(const TextureUse& use, const TextureSystem* textures, int n, int x, int y, int z) {
  if (std::min({x, y, z}) < 0 || std::max({x, y, z}) >= n) return Vec4(0.0f);
  const auto size = static_cast<double>(n);
  const Texel texel = look_up(use, textures,
                              {static_cast<float>((x + 0.5) / size),
                               static_cast<float>((static_cast<double>(z) * size + y + 0.5) / (size * size))});
  return {texel.color.x, texel.color.y, texel.color.z, texel.alpha};
}

// Weights of the voxels around a point: one, two, or four by a cubic B-spline. @param t of the way from the second
// (linear: the first) to the next
struct VoxelWeights {
  int count, before;  ///< voxels, and how many of them are before the one that t counts from
  float of[4];

  VoxelWeights(VoxelInterpolation interpolation, float t) : count(1), before(0), of{1.0f, 0.0f, 0.0f, 0.0f} {
    if (interpolation == VoxelInterpolation::linear) {
      count = 2;
      of[0] = 1.0f - t, of[1] = t;
    } else if (interpolation == VoxelInterpolation::cubic) {
      count = 4, before = 1;
      const float s = 1.0f - t;
      of[0] = s * s * s / 6.0f, of[3] = t * t * t / 6.0f;
      of[1] = (4.0f + 3.0f * t * t * (t - 2.0f)) / 6.0f, of[2] = (4.0f + 3.0f * s * s * (s - 2.0f)) / 6.0f;
    }
  }
};

Vec4 voxels(const TextureUse& use, const TextureSystem* textures, const Vec3& coordinates, int n,
            VoxelInterpolation interpolation) {
  if (!use.texture || !textures || n < 1 || !is_finite(coordinates)) return Vec4(0.0f);
  const Vec3 at =
      coordinates * static_cast<float>(n) - Vec3(interpolation == VoxelInterpolation::closest ? 0.0f : 0.5f);
  const auto limit = static_cast<float>(n) + 2.0f;
  if (std::fabs(at.x) > limit || std::fabs(at.y) > limit || std::fabs(at.z) > limit) return Vec4(0.0f);
  const Vec3 low(std::floor(at.x), std::floor(at.y), std::floor(at.z));
  const VoxelWeights x(interpolation, at.x - low.x), y(interpolation, at.y - low.y), z(interpolation, at.z - low.z);
  const int first[3] = {static_cast<int>(low.x) - x.before, static_cast<int>(low.y) - y.before,
                        static_cast<int>(low.z) - z.before};
  Vec4 sum(0.0f);
  for (int k = 0; k < z.count; ++k)
    for (int j = 0; j < y.count; ++j)
      for (int i = 0; i < x.count; ++i) {
        const float weight = x.of[i] * y.of[j] * z.of[k];
        if (weight > 0.0f) sum += voxel(use, textures, n, first[0] + i, first[1] + j, first[2] + k) * weight;
      }
  return sum;
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

// Coordinates times scale of the noises: operands vector, w, scale.
Vec4 coordinates(const Arguments& a, int dimensions) {
  const Vec3 p = a.v(0) * a.f(2);
  const float w = a.f(1) * a.f(2);
  return dimensions == 1 ? Vec4(w, 0, 0, 0) : Vec4(p.x, p.y, p.z, w);
}

}  // namespace

void run_texture_instruction(const ProgramData& program, const Instruction& instruction, const ShadingPoint& point,
                             const TextureSystem* textures, const Arguments& a, float* out) {
  const int variant = instruction.variant;
  const auto texel = [&](const Texel& value) {
    store(out, value.color);
    out[3] = value.alpha;
  };
  switch (instruction.op) {
    case Op::texture_image:
      texel(texture_image(program.textures[instruction.data], textures, point, a.v(0)));
      break;
    case Op::texture_environment:
      texel(texture_environment(program.textures[instruction.data], textures, a.v(0)));
      break;
    case Op::noise: {  // vector, w, scale, detail, roughness, lacunarity, offset, gain, distortion; variant:
                       // dimensions, 8: signed, 16: colour wanted, 32 · type; data 1: repeats
      NoiseParameters parameters;
      parameters.dimensions = std::max(1, variant & 7);
      parameters.normalize = !(variant & 8);
      parameters.type = static_cast<FractalType>(variant >> 5);
      parameters.repeats = instruction.data != 0;
      parameters.detail = a.f(3);
      parameters.roughness = a.f(4);
      parameters.lacunarity = a.f(5);
      parameters.offset = a.f(6);
      parameters.gain = a.f(7);
      parameters.distortion = a.f(8);
      Color color(0.0f);
      out[3] = noise_texture(coordinates(a, parameters.dimensions), parameters, variant & 16 ? &color : nullptr);
      store(out, color);
      break;
    }
    case Op::musgrave: {  // vector, w, scale, detail, dimension, lacunarity, offset, gain
      NoiseParameters parameters;
      parameters.dimensions = std::max(1, variant & 7);
      parameters.type = static_cast<FractalType>(variant >> 3);
      parameters.lacunarity = a.f(5);
      parameters.offset = a.f(6);
      parameters.gain = a.f(7);
      *out = musgrave_texture(coordinates(a, parameters.dimensions), parameters, a.f(3), a.f(4));
      break;
    }
    case Op::voronoi: {  // vector, w, scale, detail, roughness, lacunarity, smoothness, exponent, randomness
      VoronoiParameters parameters = program.voronois[instruction.data];
      parameters.scale = a.f(2);
      parameters.detail = a.f(3);
      parameters.roughness = a.f(4);
      parameters.lacunarity = a.f(5);
      parameters.smoothness = a.f(6);
      parameters.exponent = a.f(7);
      parameters.randomness = a.f(8);
      const Vec3 p = a.v(0) * parameters.scale;
      const VoronoiResult result = voronoi_texture({p.x, p.y, p.z, a.f(1) * parameters.scale}, parameters);
      out[0] = result.distance;
      store(out + 1, result.color);
      for (int k = 0; k < 4; ++k) out[4 + k] = result.position[k];
      break;
    }
    case Op::voxels: {
      const Vec4 v = voxels(program.textures[instruction.data], textures, a.v(0), static_cast<int>(a.f(1)),
                            static_cast<VoxelInterpolation>(variant));
      store(out, {v.x, v.y, v.z});
      out[3] = v.w;
      break;
    }
    case Op::wave:  // vector, scale, distortion, detail, detail scale, detail roughness, phase
      *out = wave_texture(static_cast<WaveShape>(variant & 7), static_cast<WaveProfile>(variant >> 3), a.v(0) * a.f(1),
                          a.f(2), a.f(3), a.f(4), a.f(5), a.f(6));
      break;
    case Op::magic:  // vector, scale, distortion; variant: depth
      store(out, magic_texture(a.v(0), a.f(1), variant, a.f(2)));
      break;
    case Op::brick: {  // vector, color1, color2, mortar, scale, mortar size, mortar smooth, bias, brick width, row
                       // height, offset, offset frequency, squash, squash frequency
      BrickParameters parameters;
      parameters.mortar_size = a.f(5);
      parameters.mortar_smooth = a.f(6);
      parameters.bias = a.f(7);
      parameters.brick_width = a.f(8);
      parameters.row_height = a.f(9);
      parameters.offset = a.f(10);
      parameters.offset_frequency = static_cast<int>(a.f(11));
      parameters.squash = a.f(12);
      parameters.squash_frequency = static_cast<int>(a.f(13));
      const Brick brick = brick_texture(a.v(0) * a.f(4), parameters);
      store(out, lerp(lerp(a.v(1), a.v(2), brick.tint), a.v(3), brick.mortar));
      out[3] = brick.mortar;
      break;
    }
    case Op::gabor: {  // vector, scale, frequency, anisotropy, orientation (angle), orientation (direction)
      const Gabor gabor = gabor_texture(a.v(0) * a.f(1), variant != 0, a.f(2), a.f(3), a.f(4), a.v(5));
      store(out, {gabor.value, gabor.phase, gabor.intensity});
      break;
    }
    case Op::white_noise: {  // vector, w
      const Vec3 p = a.v(0);
      store(out, hash_to_color(variant == 1 ? Vec4(a.f(1), 0, 0, 0) : Vec4(p.x, p.y, p.z, a.f(1)), variant));
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
    case Op::radial_tiling: {  // vector, sides, roundness
      const Vec3 p = a.v(0);
      const RadialTile tile = radial_tiling({p.x, p.y}, a.f(1), a.f(2), variant != 0);
      store(out, Vec3(tile.along, tile.outwards, 0.0f));
      out[3] = tile.segment, out[4] = tile.width, out[5] = tile.rotation_rad;
      break;
    }
    case Op::sky:
      store_color(out, sky_radiance(program.tables[instruction.data], a.v(0)), variant != 0);
      break;
    case Op::ies:  // vector, strength
      *out = light_profile(program.tables[instruction.data], a.v(0)) * a.f(1);
      break;
    default:
      break;
  }
}

}  // namespace lambent
