#include "engine/shading/color_math.h"

#include <algorithm>
#include <cmath>

#include "engine/shading/blackbody_table.h"
#include "engine/shading/standard_observer.h"

namespace lambent {
namespace {

template <typename F>
Color per_channel(const Color& a, const Color& b, const F& f) {
  return Color(f(a.x, b.x), f(a.y, b.y), f(a.z, b.z));
}

}  // namespace

Color rec709_from_xyz(float x, float y, float z) {
  return Color(3.2404542f * x - 1.5371385f * y - 0.4985314f * z, -0.9692660f * x + 1.8760108f * y + 0.0415560f * z,
               0.0556434f * x - 0.2040259f * y + 1.0572252f * z);
}

Color blend_colors(Blend mode, float t, const Color& a, const Color& b) {
  const float s = 1.0f - t;
  switch (mode) {
    case Blend::mix:
      return lerp(a, b, t);
    case Blend::add:
      return a + b * t;
    case Blend::multiply:
      return lerp(a, a * b, t);
    case Blend::screen:
      return Color(1.0f) - (Color(s) + (Color(1.0f) - b) * t) * (Color(1.0f) - a);
    case Blend::overlay:
      return per_channel(a, b, [&](float x, float y) {
        return x < 0.5f ? x * (s + 2.0f * t * y) : 1.0f - (s + 2.0f * t * (1.0f - y)) * (1.0f - x);
      });
    case Blend::subtract:
      return a - b * t;
    case Blend::divide:
      return per_channel(a, b, [&](float x, float y) { return y != 0.0f ? s * x + t * x / y : x; });
    case Blend::difference:
      return lerp(a, abs(a - b), t);
    case Blend::darken:
      return lerp(a, per_channel(a, b, [](float x, float y) { return std::min(x, y); }), t);
    case Blend::lighten:
      return lerp(a, per_channel(a, b, [](float x, float y) { return std::max(x, y); }), t);
    case Blend::dodge:
      return per_channel(a, b, [&](float x, float y) {
        if (x == 0.0f) return x;
        const float rest = 1.0f - t * y;
        return rest <= 0.0f ? 1.0f : std::min(x / rest, 1.0f);
      });
    case Blend::burn:
      return per_channel(a, b, [&](float x, float y) {
        const float rest = s + t * y;
        return rest <= 0.0f ? 0.0f : saturate(1.0f - (1.0f - x) / rest);
      });
    case Blend::hue: {
      const Color other = hsv_from_rgb(b);
      if (other.y == 0.0f) return a;
      const Color own = hsv_from_rgb(a);
      return lerp(a, rgb_from_hsv(Color(other.x, own.y, own.z)), t);
    }
    case Blend::saturation: {
      const Color own = hsv_from_rgb(a);
      if (own.y == 0.0f) return a;
      return rgb_from_hsv(Color(own.x, lerp(own.y, hsv_from_rgb(b).y, t), own.z));
    }
    case Blend::value: {
      const Color own = hsv_from_rgb(a);
      return rgb_from_hsv(Color(own.x, own.y, lerp(own.z, hsv_from_rgb(b).z, t)));
    }
    case Blend::color: {
      const Color other = hsv_from_rgb(b);
      if (other.y == 0.0f) return a;
      return lerp(a, rgb_from_hsv(Color(other.x, other.y, hsv_from_rgb(a).z)), t);
    }
    case Blend::soft_light:
      return per_channel(a, b, [&](float x, float y) {
        const float screen = 1.0f - (1.0f - y) * (1.0f - x);
        return s * x + t * ((1.0f - x) * y * x + x * screen);
      });
    case Blend::linear_light:
      return a + (b * 2.0f - Color(1.0f)) * t;
    case Blend::exclusion:
      return per_channel(a, b, [&](float x, float y) { return std::max(lerp(x, x + y - 2.0f * x * y, t), 0.0f); });
  }
  return a;
}

Color blackbody_color(float kelvin) {
  const BlackbodyTable& table = k_blackbody_table;
  const auto color = [](const float* c) { return Color(c[0], c[1], c[2]); };
  if (!(kelvin >= k_blackbody_low_kelvin)) return color(table.below);
  if (kelvin >= k_blackbody_high_kelvin) return color(table.above);
  static const float k_cells_per_log = k_blackbody_cells / std::log(k_blackbody_high_kelvin / k_blackbody_low_kelvin);
  const float position = std::log(kelvin / k_blackbody_low_kelvin) * k_cells_per_log;
  const int cell = std::clamp(static_cast<int>(position), 0, k_blackbody_cells - 1);
  return lerp(color(table.colors[cell]), color(table.colors[cell + 1]), position - static_cast<float>(cell));
}

Color wavelength_color(float nanometres) {
  const float position = (nanometres - k_observer_start_nm) / k_observer_step_nm;
  if (!(position > -1.0f && position < k_observer_count - 1)) return Color(0.0f);
  const int i = static_cast<int>(position);
  float xyz[3];
  for (int k = 0; k < 3; ++k) xyz[k] = lerp(k_observer_xyz[i][k], k_observer_xyz[i + 1][k], position - i);
  constexpr float k_scale = 1.0f / 2.52f;  // so that no channel passes 1
  return rec709_from_xyz(xyz[0], xyz[1], xyz[2]) * k_scale;
}

}  // namespace lambent
