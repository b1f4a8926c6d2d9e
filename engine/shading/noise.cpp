#include "engine/shading/noise.h"

#include <bit>

namespace lambent {
namespace {

// Bob Jenkins's lookup3 final mix (public domain) over up to four words.
uint32_t rotate(uint32_t x, int k) { return std::rotl(x, k); }
void final_mix(uint32_t& a, uint32_t& b, uint32_t& c) {
  c ^= b, c -= rotate(b, 14);
  a ^= c, a -= rotate(c, 11);
  b ^= a, b -= rotate(a, 25);
  c ^= b, c -= rotate(b, 16);
  a ^= c, a -= rotate(c, 4);
  b ^= a, b -= rotate(a, 14);
  c ^= b, c -= rotate(b, 24);
}
void mix(uint32_t& a, uint32_t& b, uint32_t& c) {
  a -= c, a ^= rotate(c, 4), c += b;
  b -= a, b ^= rotate(a, 6), a += c;
  c -= b, c ^= rotate(b, 8), b += a;
  a -= c, a ^= rotate(c, 16), c += b;
  b -= a, b ^= rotate(a, 19), a += c;
  c -= b, c ^= rotate(b, 4), b += a;
}
template <int count>
uint32_t lattice_hash(uint32_t x, uint32_t y, uint32_t z, uint32_t w) {
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

float fractal(const Vec4& p, const NoiseParameters& parameters) {
  const float octaves = std::isfinite(parameters.detail) ? std::clamp(parameters.detail, 0.0f, 15.0f) : 0.0f;
  const float roughness = std::isfinite(parameters.roughness) ? std::clamp(parameters.roughness, 0.0f, 1.0f) : 0.5f;
  const auto octave = [&](float frequency) {
    const float n =
        signed_noise({p.x * frequency, p.y * frequency, p.z * frequency, p.w * frequency}, parameters.dimensions);
    return parameters.normalize ? 0.5f * n + 0.5f : n;
  };
  float frequency = 1.0f, amplitude = 1.0f, total = 0.0f, sum = 0.0f;
  const int whole = static_cast<int>(octaves);
  for (int i = 0; i <= whole; ++i) {
    sum += octave(frequency) * amplitude;
    total += amplitude;
    amplitude *= roughness;
    frequency *= parameters.lacunarity;
  }
  const float rest = octaves - static_cast<float>(whole);
  if (rest == 0.0f) return sum / total;
  const float finer = sum + octave(frequency) * amplitude;
  return (1.0f - rest) * sum / total + rest * finer / (total + amplitude);
}

}  // namespace

float hash_integers(uint32_t a, uint32_t b) {
  return static_cast<float>(lattice_hash<2>(a, b, 0, 0)) * (1.0f / static_cast<float>(0xFFFFFFFFu));
}
float hash_floats(float a, float b) { return hash_integers(std::bit_cast<uint32_t>(a), std::bit_cast<uint32_t>(b)); }

namespace {

template <int dimensions>
float signed_noise_in(const float* coordinates) {
  constexpr int k_corners = 1 << dimensions;
  uint32_t cell[dimensions];
  float within[dimensions], blend[dimensions];
  for (int i = 0; i < dimensions; ++i) {
    const float x = coordinates[i];
    if (!(std::fabs(x) < 1e9f)) return 0.0f;
    const float floored = std::floor(x);
    cell[i] = static_cast<uint32_t>(static_cast<int32_t>(floored));
    const float t = within[i] = x - floored;
    blend[i] = t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f);
  }
  // In arrays by corner, one step at a time: so the compiler vectorises each.
  uint32_t hash[k_corners];
  float corner[k_corners], d[dimensions][k_corners];
  for (int i = 0; i < dimensions; ++i)
    for (int c = 0; c < k_corners; ++c) d[i][c] = within[i] - static_cast<float>((c >> i) & 1);
  for (int c = 0; c < k_corners; ++c) {
    const auto key = [&](int i) { return cell[i] + static_cast<uint32_t>((c >> i) & 1); };
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
    for (int c = 0; c < count; ++c) corner[c] = lerp(corner[2 * c], corner[2 * c + 1], blend[i]);
  }
  return corner[0] * k_scale[dimensions];
}

}  // namespace

float signed_noise(const Vec4& p, int dimensions) {
  const float coordinates[4] = {p.x, p.y, p.z, p.w};
  switch (dimensions) {
    case 1:
      return signed_noise_in<1>(coordinates);
    case 2:
      return signed_noise_in<2>(coordinates);
    case 3:
      return signed_noise_in<3>(coordinates);
    default:
      return signed_noise_in<4>(coordinates);
  }
}

float noise_texture(const Vec4& p_in, const NoiseParameters& parameters, Color* color) {
  const int n = parameters.dimensions;
  Vec4 p = p_in;
  if (parameters.distortion != 0.0f) {
    float offsets[4] = {0, 0, 0, 0};
    for (int i = 0; i < n; ++i)
      offsets[i] = signed_noise(offset_by_seed(p, static_cast<float>(i), n), n) * parameters.distortion;
    p = plus(p, offsets);
  }
  const float value = fractal(p, parameters);
  if (color)
    *color = Color(value, fractal(offset_by_seed(p, static_cast<float>(n), n), parameters),
                   fractal(offset_by_seed(p, static_cast<float>(n + 1), n), parameters));
  return value;
}

}  // namespace lambent
