#include "engine/shading/hosek_sky.h"

#include <algorithm>
#include <cmath>

namespace lambent {

namespace {

/// How close to the horizon directions are evaluated, as Blender.
constexpr float k_horizon_rad = 0.001f;

double bernstein(const float (&c)[HosekCoefficients::k_degree + 1], double x) {
  const double y = 1.0 - x, x2 = x * x, y2 = y * y;
  return y2 * y2 * y * static_cast<double>(c[0]) + 5.0 * y2 * y2 * x * static_cast<double>(c[1]) +
         10.0 * y2 * y * x2 * static_cast<double>(c[2]) + 10.0 * y2 * x2 * x * static_cast<double>(c[3]) +
         5.0 * y * x2 * x2 * static_cast<double>(c[4]) + x2 * x2 * x * static_cast<double>(c[5]);
}

}  // namespace

std::vector<float> make_hosek_sky(const Vec3& sun_direction, float turbidity, float ground_albedo) {
  Vec3 sun = length_squared(sun_direction) > 0.0f ? normalize(sun_direction) : Vec3(0, 0, 1);
  if (sun.z < 0.0f) {
    sun.z = 0.0f;
    sun = length_squared(sun) > 0.0f ? normalize(sun) : Vec3(1, 0, 0);
  }
  const double elevation = std::asin(std::clamp(static_cast<double>(sun.z), 0.0, 1.0));
  const double x = std::cbrt(elevation / (0.5 * static_cast<double>(k_pi)));
  const double t = std::clamp(static_cast<double>(turbidity), 1.0, double{k_hosek_turbidities});
  const double albedo = std::clamp(static_cast<double>(ground_albedo), 0.0, 1.0);
  const int below = std::min(static_cast<int>(t), k_hosek_turbidities - 1);
  const double above = t - below;
  std::vector<float> table;
  for (int channel = 0; channel < 3; ++channel) {
    double mixed[HosekCoefficients::k_count];
    for (int i = 0; i < HosekCoefficients::k_count; ++i) {
      const auto at = [&](int turbid, int white) {
        return bernstein(k_hosek_coefficients[turbid - 1][white][channel].bernstein[i], x);
      };
      mixed[i] = (1.0 - above) * ((1.0 - albedo) * at(below, 0) + albedo * at(below, 1)) +
                 above * ((1.0 - albedo) * at(below + 1, 0) + albedo * at(below + 1, 1));
    }
    // The factor of the whole goes into those of the terms.
    for (int i = 0; i < HosekCoefficients::k_count - 1; ++i)
      table.push_back(static_cast<float>(i < 4 ? mixed[i] : mixed[i] * mixed[9]));
  }
  for (const float component : {sun.x, sun.y, sun.z}) table.push_back(component);
  return table;
}

std::array<float, 3> hosek_xyz(const std::vector<float>& table, const Vec3& d) {
  const Vec3 sun(table[27], table[28], table[29]);
  const float cos_theta = std::max(d.z, std::sin(k_horizon_rad));
  const float cos_gamma = std::clamp(dot(d, sun), -1.0f, 1.0f), gamma = std::acos(cos_gamma);
  const float rayleigh = cos_gamma * cos_gamma, zenith = std::sqrt(cos_theta);
  std::array<float, 3> xyz{};
  for (size_t k = 0; k < 3; ++k) {
    const float* c = table.data() + 9 * k;
    const float spread = std::max(1.0f + c[3] * c[3] - 2.0f * c[3] * cos_gamma, 1e-9f);
    const float mie = (1.0f + rayleigh) / (spread * std::sqrt(spread));
    xyz[k] = (1.0f + c[0] * std::exp(c[1] / (cos_theta + 0.01f))) *
             (c[4] + c[5] * std::exp(c[2] * gamma) + c[6] * rayleigh + c[7] * mie + c[8] * zenith);
  }
  return xyz;
}

}  // namespace lambent
