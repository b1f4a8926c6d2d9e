// Colour arithmetic of Blender's nodes: models of hue and the blend modes. Definitions as Blender's documentation and
// Cycles have them; components may be negative or above 1.
#pragma once

#include "engine/base/vec.h"

namespace lambent {

inline float safe_divide(float a, float b) { return b != 0.0f ? a / b : 0.0f; }
inline float fraction(float x) { return x - std::floor(x); }
inline float saturate(float x) { return std::clamp(x, 0.0f, 1.0f); }

inline Color hsv_from_rgb(const Color& c) {
  const float high = max_component(c), low = min_component(c), range = high - low;
  if (high == 0.0f || range == 0.0f) return Color(0.0f, 0.0f, high);
  float hue;
  if (c.x == high)
    hue = (c.y - c.z) / range;
  else if (c.y == high)
    hue = 2.0f + (c.z - c.x) / range;
  else
    hue = 4.0f + (c.x - c.y) / range;
  hue /= 6.0f;
  return Color(hue < 0.0f ? hue + 1.0f : hue, range / high, high);
}

inline Color rgb_from_hsv(const Color& c) {
  const float s = c.y, v = c.z;
  if (s == 0.0f) return Color(v);
  const float h = (c.x == 1.0f ? 0.0f : c.x) * 6.0f;
  const float sector = std::floor(h), f = h - sector;
  const float p = v * (1.0f - s), q = v * (1.0f - s * f), t = v * (1.0f - s * (1.0f - f));
  switch (std::isfinite(sector) ? static_cast<int>(std::clamp(sector, -1.0f, 6.0f)) : 6) {
    case 0:
      return Color(v, t, p);
    case 1:
      return Color(q, v, p);
    case 2:
      return Color(p, v, t);
    case 3:
      return Color(p, q, v);
    case 4:
      return Color(t, p, v);
    default:
      return Color(v, p, q);
  }
}

inline Color hsl_from_rgb(const Color& c) {
  const float high = max_component(c), low = min_component(c), range = high - low;
  const float lightness = std::min(1.0f, 0.5f * (high + low));
  if (range == 0.0f) return Color(0.0f, 0.0f, lightness);
  const float s = safe_divide(range, lightness > 0.5f ? 2.0f - high - low : high + low);
  return Color(hsv_from_rgb(c).x, s, lightness);
}

inline Color rgb_from_hsl(const Color& c) {
  const float r = saturate(std::fabs(c.x * 6.0f - 3.0f) - 1.0f);
  const float g = saturate(2.0f - std::fabs(c.x * 6.0f - 2.0f));
  const float b = saturate(2.0f - std::fabs(c.x * 6.0f - 4.0f));
  const float chroma = (1.0f - std::fabs(2.0f * c.z - 1.0f)) * c.y;
  return Color((r - 0.5f) * chroma + c.z, (g - 0.5f) * chroma + c.z, (b - 0.5f) * chroma + c.z);
}

enum class Blend : uint8_t {
  mix,
  add,
  multiply,
  screen,
  overlay,
  subtract,
  divide,
  difference,
  darken,
  lighten,
  dodge,
  burn,
  hue,
  saturation,
  value,
  color,
  soft_light,
  linear_light,
  exclusion
};

/// Blender's blend modes. @param t the factor, already clamped if it is to be.
Color blend_colors(Blend mode, float t, const Color& a, const Color& b);

/// Linear Rec. 709 with white point D65 (the matrix of Blender's configuration); negative where it cannot be shown.
Color rec709_from_xyz(float x, float y, float z);

/// Colour of a black body in linear Rec. 709, luminance about 1, 0 where Rec. 709 cannot show it: as measured in Cycles
/// (2e-3 from Planck's law and the CIE 1931 observer at most). @param kelvin below 800 and above 12000 one colour each
Color blackbody_color(float kelvin);
/// Colour of light of one wavelength in linear Rec. 709, scaled as in Blender; black outside [380, 780) nm. Negative
/// where Rec. 709 cannot show it.
Color wavelength_color(float nanometres);

}  // namespace lambent
