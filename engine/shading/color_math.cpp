#include "engine/shading/color_math.h"

#include "engine/shading/standard_observer.h"

namespace lambent {
namespace {

template <typename F>
Color per_channel(const Color& a, const Color& b, const F& f) {
  return Color(f(a.x, b.x), f(a.y, b.y), f(a.z, b.z));
}

/// One range of temperatures T of Cycles' fit (its coefficients; kernel/tables.h, Apache-2.0): red and green are a / T
/// + b T + c, blue is a T³ + b T² + c T + d.
struct BlackbodyRange {
  float below_kelvin;
  float red[3], green[3], blue[4];
};
constexpr BlackbodyRange k_blackbody[] = {
    {965.0f,
     {1619.19106f, -0.00205010916f, 5.02995757f},
     {-488.999748f, 0.000604330754f, -0.0755807526f},
     {5.96945309e-11f, -4.85742887e-08f, -9.70622247e-05f, -0.00407936148f}},
    {1167.0f,
     {2488.45471f, -0.00111330907f, 3.22621544f},
     {-755.994277f, 0.000316730098f, 0.478306139f},
     {2.40430366e-11f, 5.55021075e-08f, -0.000198503712f, 0.0289312858f}},
    {1449.0f,
     {3341.43193f, -0.000486551192f, 1.76486769f},
     {-1023.63977f, 0.00012022347f, 0.936662319f},
     {-1.40949732e-11f, 1.89878968e-07f, -0.000356632824f, 0.0910767778f}},
    {1902.0f,
     {4094.61742f, -0.000127446582f, 0.725731635f},
     {-1265.71316f, 4.87340896e-06f, 1.27054498f},
     {-3.61460868e-11f, 2.84822009e-07f, -0.000493211319f, 0.15672344f}},
    {3315.0f,
     {4670.28036f, 2.91258199e-05f, 0.126703442f},
     {-1425.29332f, -4.01150431e-05f, 1.43972784f},
     {-1.97075738e-11f, 1.75359352e-07f, -0.000250542825f, -0.0222783266f}},
    {6365.0f,
     {4595.09185f, 2.87495649e-05f, 0.15034502f},
     {-1175.54822f, -2.16378048e-05f, 1.30408023f},
     {-1.61997957e-13f, -1.64216008e-08f, 0.000386216271f, -0.738077418f}},
    {k_infinity,
     {3787.1745f, 9.35907826e-06f, 0.399075871f},
     {-500.799571f, -4.59832026e-06f, 1.09098763f},
     {6.72650283e-13f, -2.73078809e-08f, 0.000424098264f, -0.752335691f}},
};

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
  if (!(kelvin >= 800.0f)) return Color(5.4132945f, -0.2031939f, -0.0822535f);
  if (kelvin >= 12000.0f) return Color(0.8262955f, 0.9945081f, 1.5663077f);
  const float t = kelvin;
  const BlackbodyRange* range = k_blackbody;
  while (t >= range->below_kelvin) ++range;
  const auto rational = [&](const float* c) { return c[0] / t + c[1] * t + c[2]; };
  const float* b = range->blue;
  return Color(rational(range->red), rational(range->green), ((b[0] * t + b[1]) * t + b[2]) * t + b[3]);
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
