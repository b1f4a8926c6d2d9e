#include "engine/shading/sky.h"

#include <array>

namespace lambent {
namespace {

// Perez's five coefficients of luminance, x and y as linear functions of turbidity, and the zenith's cubic in the sun's
// angle (Preetham, Shirley & Smits 1999, appendix A.2).
constexpr float k_slope[3][5] = {{0.1787f, -0.3554f, -0.0227f, 0.1206f, -0.0670f},
                                 {-0.0193f, -0.0665f, -0.0004f, -0.0641f, -0.0033f},
                                 {-0.0167f, -0.0950f, -0.0079f, -0.0441f, -0.0109f}};
constexpr float k_offset[3][5] = {{-1.4630f, 0.4275f, 5.3251f, -2.5771f, 0.3703f},
                                  {-0.2592f, 0.0008f, 0.2125f, -0.8989f, 0.0452f},
                                  {-0.2608f, 0.0092f, 0.2102f, -1.6537f, 0.0529f}};
constexpr float k_zenith_x[3][4] = {{0.00166f, -0.00375f, 0.00209f, 0.0f},
                                    {-0.02903f, 0.06377f, -0.03202f, 0.00394f},
                                    {0.11693f, -0.21196f, 0.06052f, 0.25886f}};
constexpr float k_zenith_y[3][4] = {{0.00275f, -0.00610f, 0.00317f, 0.0f},
                                    {-0.04214f, 0.08970f, -0.04153f, 0.00516f},
                                    {0.15346f, -0.26756f, 0.06670f, 0.26688f}};
constexpr float k_luminance_scale = 0.06f;  // Blender's, from kcd/m² to scene units

float perez(const float* c, float cos_theta, float gamma) {
  const float cos_gamma = std::cos(gamma);
  return (1.0f + c[0] * std::exp(c[1] / cos_theta)) *
         (1.0f + c[2] * std::exp(c[3] * gamma) + c[4] * cos_gamma * cos_gamma);
}

float zenith(const float coefficients[3][4], float turbidity, float theta) {
  const float powers[3] = {turbidity * turbidity, turbidity, 1.0f};
  float sum = 0.0f;
  for (int i = 0; i < 3; ++i) {
    const float* c = coefficients[i];
    sum += powers[i] * (((c[0] * theta + c[1]) * theta + c[2]) * theta + c[3]);
  }
  return sum;
}

}  // namespace

std::vector<float> make_preetham_sky(const Vec3& sun_direction, float turbidity) {
  // 15 coefficients, 3 factors, the sun's direction
  std::vector<float> table(21);
  const Vec3 sun = length_squared(sun_direction) > 0.0f ? normalize(sun_direction) : Vec3(0, 0, 1);
  const float t = std::clamp(turbidity, 1.0f, 10.0f), theta = std::acos(std::clamp(sun.z, -1.0f, 1.0f));
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 5; ++i) table[5 * k + i] = k_slope[k][i] * t + k_offset[k][i];
  const float chi = (4.0f / 9.0f - t / 120.0f) * (k_pi - 2.0f * theta);
  const float zeniths[3] = {((4.0453f * t - 4.9710f) * std::tan(chi) - 0.2155f * t + 2.4192f) * k_luminance_scale,
                            zenith(k_zenith_x, t, theta), zenith(k_zenith_y, t, theta)};
  for (int k = 0; k < 3; ++k) table[15 + k] = zeniths[k] / perez(table.data() + 5 * k, 1.0f, theta);
  table[18] = sun.x, table[19] = sun.y, table[20] = sun.z;
  return table;
}

Color sky_radiance(const std::vector<float>& table, const Vec3& d_in) {
  const Vec3 d = normalize(d_in);
  const Vec3 sun(table[18], table[19], table[20]);
  const float gamma = std::acos(std::clamp(dot(d, sun), -1.0f, 1.0f));
  const float cos_theta = std::max(d.z, 0.001f);
  float value[3];
  for (int k = 0; k < 3; ++k) value[k] = table[15 + k] * perez(table.data() + 5 * k, cos_theta, gamma);
  const float luminance_y = value[0], x = value[1], y = value[2];
  if (!(y > 0.0f)) return Color(0.0f);
  const float xyz_x = x / y * luminance_y, xyz_z = (1.0f - x - y) / y * luminance_y;
  return Color(std::max(0.0f, 3.2409699f * xyz_x - 1.5373832f * luminance_y - 0.4986108f * xyz_z),
               std::max(0.0f, -0.9692436f * xyz_x + 1.8759675f * luminance_y + 0.0415551f * xyz_z),
               std::max(0.0f, 0.0556301f * xyz_x - 0.2039770f * luminance_y + 1.0569715f * xyz_z));
}

}  // namespace lambent
