#include "engine/shading/noise.h"

#include <bit>
#include <limits>

#include "engine/shading/color_math.h"

namespace lambent {
namespace {

// Bob Jenkins's lookup3 final mix (public domain) over up to four words. Always inlined: the loops over corners become
// vector instructions only with the hash inside of them, and so large a body is not inlined by itself.
uint32_t rotate(uint32_t x, int k) { return std::rotl(x, k); }
[[gnu::always_inline]] inline void final_mix(uint32_t& a, uint32_t& b, uint32_t& c) {
  c ^= b, c -= rotate(b, 14);
  a ^= c, a -= rotate(c, 11);
  b ^= a, b -= rotate(a, 25);
  c ^= b, c -= rotate(b, 16);
  a ^= c, a -= rotate(c, 4);
  b ^= a, b -= rotate(a, 14);
  c ^= b, c -= rotate(b, 24);
}
[[gnu::always_inline]] inline void mix(uint32_t& a, uint32_t& b, uint32_t& c) {
  a -= c, a ^= rotate(c, 4), c += b;
  b -= a, b ^= rotate(a, 6), a += c;
  c -= b, c ^= rotate(b, 8), b += a;
  a -= c, a ^= rotate(c, 16), c += b;
  b -= a, b ^= rotate(a, 19), a += c;
  c -= b, c ^= rotate(b, 4), b += a;
}
template <int count>
[[gnu::always_inline]] inline uint32_t lattice_hash(uint32_t x, uint32_t y, uint32_t z, uint32_t w) {
  uint32_t a, b, c;
  a = b = c = 0xdeadbeefu + (static_cast<uint32_t>(count) << 2) + 13u;
  a += x;
  if constexpr (count > 1) b += y;
  if constexpr (count > 2) c += z;
  if constexpr (count == 4) {
    mix(a, b, c);
    a += w;
  }
  final_mix(a, b, c);
  return c;
}

// -x where the bit `bit` of `hash` is set. By the sign's bit: the loops over a cell's corners have no branches, so that
// the compiler makes vector instructions of them.
template <int bit>
float signed_by(float x, uint32_t hash) {
  return std::bit_cast<float>(std::bit_cast<uint32_t>(x) ^ ((hash >> bit) << 31));
}

float gradient(uint32_t hash, float x) {
  return signed_by<3>(1.0f + static_cast<float>(static_cast<int>(hash & 7)), hash) * x;
}
float gradient(uint32_t hash, float x, float y) {
  const bool low = (hash & 7) < 4;
  return signed_by<0>(low ? x : y, hash) + signed_by<1>(2.0f * (low ? y : x), hash);
}
float gradient(uint32_t hash, float x, float y, float z) {
  const uint32_t h = hash & 15;
  const float otherwise = (h & 13) == 12 ? x : z;  // h is 12 or 14
  return signed_by<0>(h < 8 ? x : y, hash) + signed_by<1>(h < 4 ? y : otherwise, hash);
}
float gradient(uint32_t hash, float x, float y, float z, float w) {
  const uint32_t h = hash & 31;
  return signed_by<0>(h < 24 ? x : y, hash) + signed_by<1>(h < 16 ? y : z, hash) + signed_by<2>(h < 8 ? z : w, hash);
}

// What brings the range to about [-1, 1] (found by experiment by OSL's authors).
constexpr float k_scale[5] = {0.0f, 0.25f, 0.6616f, 0.982f, 0.8344f};

Vec4 plus(const Vec4& p, const float* offsets) {
  return {p.x + offsets[0], p.y + offsets[1], p.z + offsets[2], p.w + offsets[3]};
}

// Offset number `seed` between 100 and 200 in each dimension.
Vec4 offset_by_seed(const Vec4& p, float seed, int dimensions) {
  float offsets[4] = {0, 0, 0, 0};
  if (dimensions == 1) {
    const uint32_t key = std::bit_cast<uint32_t>(seed);
    offsets[0] =
        100.0f + static_cast<float>(lattice_hash<1>(key, 0, 0, 0)) * (1.0f / static_cast<float>(0xFFFFFFFFu)) * 100.0f;
  } else {
    for (int i = 0; i < dimensions; ++i) offsets[i] = 100.0f + hash_floats(seed, static_cast<float>(i)) * 100.0f;
  }
  return plus(p, offsets);
}

Vec4 scaled(const Vec4& p, float f) { return {p.x * f, p.y * f, p.z * f, p.w * f}; }

// Sum of octaves of falling amplitude. `whole` octaves and the fraction `rest` of one more.
float fbm(const Vec4& p, const NoiseParameters& parameters, int whole, float rest) {
  float frequency = 1.0f, amplitude = 1.0f, total = 0.0f, sum = 0.0f;
  for (int i = 0; i < whole; ++i) {
    sum += signed_noise(scaled(p, frequency), parameters.dimensions, parameters.repeats) * amplitude;
    total += amplitude;
    amplitude *= parameters.roughness;
    frequency *= parameters.lacunarity;
  }
  const auto result = [&](float value, float weight) {
    return parameters.normalize ? (weight > 0.0f ? 0.5f * value / weight + 0.5f : 0.5f) : value;
  };
  if (rest == 0.0f) return result(sum, total);
  const float finer = sum + signed_noise(scaled(p, frequency), parameters.dimensions, parameters.repeats) * amplitude;
  return lerp(result(sum, total), result(finer, total + amplitude), rest);
}

// `whole` octaves and the fraction `rest` of one more, combined by the type.
float fractal(Vec4 p, const NoiseParameters& parameters, int whole, float rest) {
  const auto noise = [&] { return signed_noise(p, parameters.dimensions, parameters.repeats); };
  const auto next = [&] { p = scaled(p, parameters.lacunarity); };
  const float roughness = parameters.roughness, offset = parameters.offset, gain = parameters.gain;
  switch (parameters.type) {
    case FractalType::fbm:
      return fbm(p, parameters, whole, rest);
    case FractalType::multifractal: {
      float value = 1.0f, amplitude = 1.0f;
      for (int i = 0; i < whole; ++i, next()) {
        value *= amplitude * noise() + 1.0f;
        amplitude *= roughness;
      }
      return rest != 0.0f ? value * (rest * amplitude * noise() + 1.0f) : value;
    }
    case FractalType::hybrid_multifractal: {
      float value = 0.0f, amplitude = 1.0f, weight = 1.0f;
      for (int i = 0; i < whole && weight > 0.001f; ++i, next()) {
        weight = std::min(weight, 1.0f);
        const float signal = (noise() + offset) * amplitude;
        amplitude *= roughness;
        value += weight * signal;
        weight *= gain * signal;
      }
      if (rest != 0.0f && weight > 0.001f) value += rest * std::min(weight, 1.0f) * (noise() + offset) * amplitude;
      return value;
    }
    case FractalType::ridged_multifractal: {
      const auto ridge = [&] { return sqr(offset - std::fabs(noise())); };
      float signal = ridge(), value = signal, amplitude = roughness;
      for (int i = 1; i < whole; ++i) {
        next();
        const float weight = saturate(signal * gain);
        signal = ridge() * weight;
        value += signal * amplitude;
        amplitude *= roughness;
      }
      return value;
    }
    case FractalType::hetero_terrain: {
      float value = offset + noise(), amplitude = roughness;
      next();
      for (int i = 1; i < whole; ++i, next()) {
        value += (noise() + offset) * amplitude * value;
        amplitude *= roughness;
      }
      return rest != 0.0f ? value + rest * (noise() + offset) * amplitude * value : value;
    }
  }
  return 0.0f;
}

float fractal(const Vec4& p, const NoiseParameters& parameters) {
  const float detail = std::isfinite(parameters.detail) ? std::clamp(parameters.detail, 0.0f, 15.0f) : 0.0f;
  const int whole = static_cast<int>(detail);
  return fractal(p, parameters, whole + 1, detail - static_cast<float>(whole));
}

NoiseParameters sane(NoiseParameters parameters) {
  parameters.roughness = std::isfinite(parameters.roughness) ? std::max(parameters.roughness, 0.0f) : 0.5f;
  for (float* x : {&parameters.lacunarity, &parameters.offset, &parameters.gain, &parameters.distortion})
    if (!std::isfinite(*x)) *x = 0.0f;
  return parameters;
}
float finite(float x) { return std::isfinite(x) ? x : 0.0f; }

uint32_t bits(float x) { return std::bit_cast<uint32_t>(x); }
float unit(uint32_t hash) { return static_cast<float>(hash) * (1.0f / static_cast<float>(0xFFFFFFFFu)); }

}  // namespace

float hash_integers(uint32_t a, uint32_t b) {
  return static_cast<float>(lattice_hash<2>(a, b, 0, 0)) * (1.0f / static_cast<float>(0xFFFFFFFFu));
}
float hash_floats(float a) { return unit(lattice_hash<1>(bits(a), 0, 0, 0)); }
float hash_floats(float a, float b) { return unit(lattice_hash<2>(bits(a), bits(b), 0, 0)); }
float hash_floats(float a, float b, float c) { return unit(lattice_hash<3>(bits(a), bits(b), bits(c), 0)); }
float hash_floats(float a, float b, float c, float d) {
  return unit(lattice_hash<4>(bits(a), bits(b), bits(c), bits(d)));
}

Color hash_to_color(const Vec4& p, int dimensions) {
  switch (dimensions) {
    case 1:
      return {hash_floats(p.x), hash_floats(p.x, 1.0f), hash_floats(p.x, 2.0f)};
    case 2:
      return {hash_floats(p.x, p.y), hash_floats(p.x, p.y, 1.0f), hash_floats(p.x, p.y, 2.0f)};
    case 3:
      return {hash_floats(p.x, p.y, p.z), hash_floats(p.x, p.y, p.z, 1.0f), hash_floats(p.x, p.y, p.z, 2.0f)};
    default:
      return {hash_floats(p.x, p.y, p.z, p.w), hash_floats(p.z, p.x, p.w, p.y), hash_floats(p.w, p.z, p.y, p.x)};
  }
}

Vec4 hash_to_vector(const Vec4& p, int dimensions) {
  switch (dimensions) {
    case 1:
      return {hash_floats(p.x), 0, 0, 0};
    case 2:
      return {hash_floats(p.x, p.y), hash_floats(p.x, p.y, 1.0f), 0, 0};
    case 3: {
      const Color c = hash_to_color(p, 3);
      return {c.x, c.y, c.z, 0};
    }
    default:
      return {hash_floats(p.x, p.y, p.z, p.w), hash_floats(p.w, p.x, p.y, p.z), hash_floats(p.z, p.w, p.x, p.y),
              hash_floats(p.y, p.z, p.w, p.x)};
  }
}

Vec4 hash_cell(const int32_t* cell, int dimensions) {
  constexpr uint32_t k_multiplier = 1664525u, k_increment = 1013904223u;
  uint32_t v[4];
  for (int i = 0; i < dimensions; ++i) v[i] = static_cast<uint32_t>(cell[i]) * k_multiplier + k_increment;
  const auto scramble = [&] {
    if (dimensions == 2) {
      v[0] += v[1] * k_multiplier, v[1] += v[0] * k_multiplier;
    } else if (dimensions == 3) {
      v[0] += v[1] * v[2], v[1] += v[2] * v[0], v[2] += v[0] * v[1];
    } else {
      v[0] += v[1] * v[3], v[1] += v[2] * v[0], v[2] += v[0] * v[1], v[3] += v[1] * v[2];
    }
  };
  scramble();
  // Blender shifts signed numbers here.
  for (int i = 0; i < dimensions; ++i) v[i] ^= static_cast<uint32_t>(static_cast<int32_t>(v[i]) >> 16);
  scramble();
  Vec4 result(0.0f);
  for (int i = 0; i < dimensions; ++i)
    result[i] = static_cast<float>(v[i] & 0x7FFFFFFFu) * (1.0f / static_cast<float>(0x7FFFFFFFu));
  return result;
}

namespace {

constexpr float k_period = 1e5f;

/// A coordinate k_period or further from 0 (or not finite) as the noise takes it; NaN: the noise is 0 there.
float far_coordinate(float x, bool repeats) {
  if (!repeats) return std::fabs(x) < 1e9f ? x : std::numeric_limits<float>::quiet_NaN();
  // Floats this large are whole numbers, where the noise is 0.
  return std::fmod(x, k_period) + (std::fabs(x) >= 1e6f ? 0.5f : 0.0f);
}

template <int dimensions>
float signed_noise_in(const float* coordinates, bool repeats) {
  constexpr int k_corners = 1 << dimensions;
  uint32_t cell[dimensions];
  float within[dimensions], blend[dimensions];
  for (int i = 0; i < dimensions; ++i) {
    float x = coordinates[i];
    if (!(std::fabs(x) < k_period)) x = far_coordinate(x, repeats);
    if (std::isnan(x)) return 0.0f;
    const float floored = std::floor(x);
    cell[i] = static_cast<uint32_t>(static_cast<int32_t>(floored));
    const float t = within[i] = x - floored;
    blend[i] = t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f);
  }
  // In arrays by corner, one step at a time: so the compiler vectorises each. The first dimension is a corner's highest
  // bit, so that what is interpolated first lies in two halves.
  const auto beyond = [](int c, int i) { return (c >> (dimensions - 1 - i)) & 1; };
  uint32_t hash[k_corners];
  float corner[k_corners], d[dimensions][k_corners];
  for (int i = 0; i < dimensions; ++i)
    for (int c = 0; c < k_corners; ++c) d[i][c] = within[i] - static_cast<float>(beyond(c, i));
  for (int c = 0; c < k_corners; ++c) {
    const auto key = [&](int i) { return cell[i] + static_cast<uint32_t>(beyond(c, i)); };
    if constexpr (dimensions == 1) hash[c] = lattice_hash<1>(key(0), 0, 0, 0);
    if constexpr (dimensions == 2) hash[c] = lattice_hash<2>(key(0), key(1), 0, 0);
    if constexpr (dimensions == 3) hash[c] = lattice_hash<3>(key(0), key(1), key(2), 0);
    if constexpr (dimensions == 4) hash[c] = lattice_hash<4>(key(0), key(1), key(2), key(3));
  }
  for (int c = 0; c < k_corners; ++c) {
    const float x = d[0][c];
    if constexpr (dimensions == 1) corner[c] = gradient(hash[c], x);
    if constexpr (dimensions == 2) corner[c] = gradient(hash[c], x, d[1][c]);
    if constexpr (dimensions == 3) corner[c] = gradient(hash[c], x, d[1][c], d[2][c]);
    if constexpr (dimensions == 4) corner[c] = gradient(hash[c], x, d[1][c], d[2][c], d[3][c]);
  }
  for (int i = 0, count = k_corners; i < dimensions; ++i) {
    count /= 2;
    for (int c = 0; c < count; ++c) corner[c] = lerp(corner[c], corner[c + count], blend[i]);
  }
  return corner[0] * k_scale[dimensions];
}

}  // namespace

float signed_noise(const Vec4& p, int dimensions, bool repeats) {
  const float coordinates[4] = {p.x, p.y, p.z, p.w};
  switch (dimensions) {
    case 1:
      return signed_noise_in<1>(coordinates, repeats);
    case 2:
      return signed_noise_in<2>(coordinates, repeats);
    case 3:
      return signed_noise_in<3>(coordinates, repeats);
    default:
      return signed_noise_in<4>(coordinates, repeats);
  }
}

float noise_texture(const Vec4& p_in, const NoiseParameters& given, Color* color) {
  const NoiseParameters parameters = sane(given);
  const int n = parameters.dimensions;
  Vec4 p = p_in;
  if (parameters.distortion != 0.0f) {
    float offsets[4] = {0, 0, 0, 0};
    for (int i = 0; i < n; ++i)
      offsets[i] =
          signed_noise(offset_by_seed(p, static_cast<float>(i), n), n, parameters.repeats) * parameters.distortion;
    p = plus(p, offsets);
  }
  const float value = finite(fractal(p, parameters));
  if (color)
    *color = Color(value, finite(fractal(offset_by_seed(p, static_cast<float>(n), n), parameters)),
                   finite(fractal(offset_by_seed(p, static_cast<float>(n + 1), n), parameters)));
  return value;
}

float musgrave_texture(const Vec4& p, const NoiseParameters& given, float octaves, float dimension) {
  NoiseParameters parameters = sane(given);
  parameters.lacunarity = std::max(parameters.lacunarity, 1e-5f);
  parameters.roughness = finite(std::pow(parameters.lacunarity, -std::max(finite(dimension), 1e-5f)));
  parameters.normalize = false;
  const float clamped = std::clamp(finite(octaves), 0.0f, 15.0f);
  const int whole = static_cast<int>(clamped);
  return finite(fractal(p, parameters, whole, clamped - static_cast<float>(whole)));
}

}  // namespace lambent
