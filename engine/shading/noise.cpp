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
uint32_t lattice_hash(const uint32_t* key, int count) {
  uint32_t a, b, c;
  a = b = c = 0xdeadbeefu + (static_cast<uint32_t>(count) << 2) + 13u;
  if (count == 4) {
    a += key[0], b += key[1], c += key[2];
    mix(a, b, c);
    a += key[3];
  } else {
    a += key[0];
    if (count > 1) b += key[1];
    if (count > 2) c += key[2];
  }
  final_mix(a, b, c);
  return c;
}

float signed_if(float x, uint32_t negative) { return negative ? -x : x; }

float gradient(uint32_t hash, const float* d, int dimensions) {
  switch (dimensions) {
    case 1:
      return signed_if(1.0f + static_cast<float>(hash & 7), hash & 8) * d[0];
    case 2: {
      const uint32_t h = hash & 7;
      return signed_if(h < 4 ? d[0] : d[1], h & 1) + signed_if(2.0f * (h < 4 ? d[1] : d[0]), h & 2);
    }
    case 3: {
      const uint32_t h = hash & 15;
      const float u = h < 8 ? d[0] : d[1];
      const float v = h < 4 ? d[1] : (h == 12 || h == 14) ? d[0] : d[2];
      return signed_if(u, h & 1) + signed_if(v, h & 2);
    }
    default: {
      const uint32_t h = hash & 31;
      const float u = h < 24 ? d[0] : d[1], v = h < 16 ? d[1] : d[2], s = h < 8 ? d[2] : d[3];
      return signed_if(u, h & 1) + signed_if(v, h & 2) + signed_if(s, h & 4);
    }
  }
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
    offsets[0] = 100.0f + static_cast<float>(lattice_hash(&key, 1)) * (1.0f / static_cast<float>(0xFFFFFFFFu)) * 100.0f;
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
  const uint32_t key[2] = {a, b};
  return static_cast<float>(lattice_hash(key, 2)) * (1.0f / static_cast<float>(0xFFFFFFFFu));
}
float hash_floats(float a, float b) { return hash_integers(std::bit_cast<uint32_t>(a), std::bit_cast<uint32_t>(b)); }

float signed_noise(const Vec4& p, int dimensions) {
  const float coordinates[4] = {p.x, p.y, p.z, p.w};
  uint32_t cell[4];
  float within[4], blend[4];
  for (int i = 0; i < dimensions; ++i) {
    const float x = coordinates[i];
    if (!(std::fabs(x) < 1e9f)) return 0.0f;
    const float floored = std::floor(x);
    cell[i] = static_cast<uint32_t>(static_cast<int32_t>(floored));
    const float t = within[i] = x - floored;
    blend[i] = t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f);
  }
  float corner[16];
  const int corners = 1 << dimensions;
  for (int c = 0; c < corners; ++c) {
    uint32_t key[4];
    float d[4];
    for (int i = 0; i < dimensions; ++i) {
      const uint32_t far = (c >> i) & 1;
      key[i] = cell[i] + far;
      d[i] = within[i] - static_cast<float>(far);
    }
    corner[c] = gradient(lattice_hash(key, dimensions), d, dimensions);
  }
  for (int i = 0, count = corners; i < dimensions; ++i) {
    count /= 2;
    for (int c = 0; c < count; ++c) corner[c] = lerp(corner[2 * c], corner[2 * c + 1], blend[i]);
  }
  return corner[0] * k_scale[dimensions];
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
