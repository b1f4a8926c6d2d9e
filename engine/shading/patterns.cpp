#include "engine/shading/patterns.h"

#include "engine/shading/color_math.h"
#include "engine/shading/noise.h"

namespace lambent {
namespace {

constexpr float k_two_pi = 2.0f * k_pi;

int whole(float x) { return static_cast<int>(std::clamp(std::floor(x), -2.1e9f, 2.1e9f)); }

}  // namespace

float wave_texture(WaveShape shape, WaveProfile profile, const Vec3& p_in, float distortion, float detail,
                   float detail_scale, float detail_roughness, float phase_rad) {
  const Vec3 p = (p_in + Vec3(0.000001f)) * 0.999999f;  // off the faces of unit cubes
  float n = 0.0f;
  switch (shape) {
    case WaveShape::bands_x:
      n = p.x * 20.0f;
      break;
    case WaveShape::bands_y:
      n = p.y * 20.0f;
      break;
    case WaveShape::bands_z:
      n = p.z * 20.0f;
      break;
    case WaveShape::bands_diagonal:
      n = (p.x + p.y + p.z) * 10.0f;
      break;
    case WaveShape::rings_x:
      n = length(Vec3(0.0f, p.y, p.z)) * 20.0f;
      break;
    case WaveShape::rings_y:
      n = length(Vec3(p.x, 0.0f, p.z)) * 20.0f;
      break;
    case WaveShape::rings_z:
      n = length(Vec3(p.x, p.y, 0.0f)) * 20.0f;
      break;
    case WaveShape::rings_spherical:
      n = length(p) * 20.0f;
      break;
  }
  n += phase_rad;
  if (distortion != 0.0f) {
    NoiseParameters parameters;
    parameters.detail = detail;
    parameters.roughness = detail_roughness;
    const Vec3 at = p * detail_scale;
    n += distortion * (noise_texture({at.x, at.y, at.z, 0.0f}, parameters, nullptr) * 2.0f - 1.0f);
  }
  if (!std::isfinite(n)) return 0.5f;
  if (profile == WaveProfile::sine) return 0.5f + 0.5f * std::sin(n - 0.5f * k_pi);
  n /= k_two_pi;
  return profile == WaveProfile::saw ? n - std::floor(n) : std::fabs(n - std::floor(n + 0.5f)) * 2.0f;
}

Color magic_texture(const Vec3& p, float scale, int depth, float distortion) {
  const float px = std::fmod(p.x, k_two_pi), py = std::fmod(p.y, k_two_pi), pz = std::fmod(p.z, k_two_pi);
  float x = std::sin((px + py + pz) * 5.0f * scale);
  float y = std::cos((-px + py - pz) * 5.0f * scale);
  float z = -std::cos((-px - py + pz) * 5.0f * scale);
  // Each step turns one component by the others.
  if (depth > 0) x *= distortion, y *= distortion, z *= distortion, y = -std::cos(x - y + z) * distortion;
  if (depth > 1) x = std::cos(x - y - z) * distortion;
  if (depth > 2) z = std::sin(-x - y - z) * distortion;
  if (depth > 3) x = -std::cos(-x + y - z) * distortion;
  if (depth > 4) y = -std::sin(-x + y + z) * distortion;
  if (depth > 5) y = -std::cos(-x + y + z) * distortion;
  if (depth > 6) x = std::cos(x + y + z) * distortion;
  if (depth > 7) z = std::sin(x + y - z) * distortion;
  if (depth > 8) x = -std::cos(-x - y + z) * distortion;
  if (depth > 9) y = -std::sin(x - y + z) * distortion;
  if (distortion != 0.0f) {
    const float twice = 2.0f * distortion;
    x /= twice, y /= twice, z /= twice;
  }
  const Color c(0.5f - x, 0.5f - y, 0.5f - z);
  return is_finite(c) ? c : Color(0.5f);
}

Brick brick_texture(const Vec3& p, const BrickParameters& b) {
  const int row = whole(safe_divide(p.y, b.row_height));
  float width = b.brick_width, offset = 0.0f;
  if (b.offset_frequency && b.squash_frequency) {
    if (row % b.squash_frequency == 0) width *= b.squash;
    if (row % b.offset_frequency == 0) offset = width * b.offset;
  }
  const int column = whole(safe_divide(p.x + offset, width));
  const float x = p.x + offset - width * static_cast<float>(column), y = p.y - b.row_height * static_cast<float>(row);
  // An integer noise of the brick's place
  uint32_t n = ((static_cast<uint32_t>(row) << 16) + (static_cast<uint32_t>(column) & 0xFFFFu) + 1013u) & 0x7fffffffu;
  n = (n >> 13) ^ n;
  n = (n * (n * n * 60493u + 19990303u) + 1376312589u) & 0x7fffffffu;
  Brick result;
  result.tint = saturate(0.5f * (static_cast<float>(n) / 1073741824.0f) + (std::isfinite(b.bias) ? b.bias : 0.0f));
  const float edge = std::min(std::min(x, y), std::min(width - x, b.row_height - y));
  if (edge >= b.mortar_size) {
    result.mortar = 0.0f;
  } else if (b.mortar_smooth == 0.0f) {
    result.mortar = 1.0f;
  } else {
    const float within = 1.0f - edge / b.mortar_size;
    const float t = saturate(within / b.mortar_smooth);
    result.mortar = within < b.mortar_smooth ? t * t * (3.0f - 2.0f * t) : 1.0f;
  }
  if (!std::isfinite(result.mortar)) result.mortar = 1.0f;
  return result;
}

namespace {

constexpr int k_impulses = 8;  // a cell

struct Phasor {
  float real = 0.0f, imaginary = 0.0f;
  // The Gabor kernel: a Gaussian under a Hann window, times a wave.
  void add(float weight, float squared_distance, float waves) {
    const float window = 0.5f + 0.5f * std::cos(k_pi * squared_distance);
    const float height = weight * window * std::exp(-k_pi * squared_distance), angle = k_two_pi * waves;
    real += height * std::cos(angle);
    imaginary += height * std::sin(angle);
  }
};

Phasor gabor_2d(const Vec3& p, float frequency, float isotropy, float orientation_rad) {
  Phasor sum;
  const float cell_x = std::floor(p.x), cell_y = std::floor(p.y);
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i) {
      const float cx = cell_x + static_cast<float>(i), cy = cell_y + static_cast<float>(j);
      for (int k = 0; k < k_impulses; ++k) {
        const float seed = static_cast<float>(3 * k);
        const float x = p.x - cell_x - static_cast<float>(i) - hash_floats(cx, cy, seed + 1.0f);
        const float y = p.y - cell_y - static_cast<float>(j) - hash_floats(seed + 1.0f, cx, cy);
        const float squared = x * x + y * y;
        if (squared >= 1.0f) continue;
        const float angle = orientation_rad + (hash_floats(cx, cy, seed) - 0.5f) * k_pi * isotropy;
        const float weight = hash_floats(cx, cy, seed + 2.0f) < 0.5f ? -1.0f : 1.0f;
        sum.add(weight, squared, frequency * (x * std::cos(angle) + y * std::sin(angle)));
      }
    }
  return sum;
}

// The direction turned by random angles, as far as the noise is isotropic.
Vec3 turned(const Vec3& direction, float isotropy, const Vec4& seed) {
  if (isotropy == 0.0f) return direction;
  const float across = std::sqrt(direction.x * direction.x + direction.y * direction.y);
  float inclination = std::acos(std::clamp(direction.z, -1.0f, 1.0f));
  float azimuth = across > 0.0f ? std::acos(std::clamp(direction.x / across, -1.0f, 1.0f)) : 0.0f;
  if (direction.y < 0.0f) azimuth = -azimuth;
  inclination += hash_floats(seed.x, seed.y, seed.z, seed.w) * k_pi * isotropy;
  azimuth += hash_floats(seed.z, seed.x, seed.w, seed.y) * k_pi * isotropy;
  return {std::sin(inclination) * std::cos(azimuth), std::sin(inclination) * std::sin(azimuth), std::cos(inclination)};
}

Phasor gabor_3d(const Vec3& p, float frequency, float isotropy, const Vec3& orientation) {
  Phasor sum;
  const Vec3 cell(std::floor(p.x), std::floor(p.y), std::floor(p.z)), local = p - cell;
  for (int k = -1; k <= 1; ++k)
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
        const Vec3 offset(static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)), c = cell + offset;
        for (int impulse = 0; impulse < k_impulses; ++impulse) {
          const float seed = static_cast<float>(3 * impulse);
          const Color center = hash_to_color({c.x, c.y, c.z, seed + 1.0f}, 4);
          const Vec3 v = local - offset - center;
          const float squared = dot(v, v);
          if (squared >= 1.0f) continue;
          const Vec3 direction = turned(orientation, isotropy, {c.x, c.y, c.z, seed});
          const float weight = hash_floats(c.x, c.y, c.z, seed + 2.0f) < 0.5f ? -1.0f : 1.0f;
          sum.add(weight, squared, frequency * dot(v, direction));
        }
      }
  return sum;
}

}  // namespace

Gabor gabor_texture(const Vec3& p, bool three_dimensions, float frequency, float anisotropy, float orientation_rad,
                    const Vec3& orientation) {
  if (!is_finite(p)) return {};
  const float isotropy = 1.0f - saturate(anisotropy);
  frequency = std::max(frequency, 0.001f);
  const Phasor sum = three_dimensions ? gabor_3d(p, frequency, isotropy, normalize(orientation))
                                      : gabor_2d(p, frequency, isotropy, orientation_rad);
  // Six standard deviations: impulses a cell, half of them squared, times the kernel's integral
  const float squared_integral = three_dimensions ? 1.0f / (4.0f * 1.41421356f) : 0.25f;
  const float scale = 6.0f * std::sqrt(k_impulses * 0.5f * squared_integral);
  Gabor result;
  result.value = sum.imaginary / scale * 0.5f + 0.5f;
  result.phase = (std::atan2(sum.imaginary, sum.real) + k_pi) / k_two_pi;
  result.intensity = std::sqrt(sum.real * sum.real + sum.imaginary * sum.imaginary) / scale;
  if (!std::isfinite(result.value)) result = {};
  return result;
}

}  // namespace lambent
