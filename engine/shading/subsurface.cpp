#include "engine/shading/subsurface.h"

#include <algorithm>
#include <cmath>

namespace lambent {
namespace {

/// Walks in darker media would be lost before they return: they are made for this albedo, and weighed.
constexpr float k_least_albedo = 0.2f;
constexpr float k_most_albedo = 0.999999f;

// Reduced albedo of a half space with the diffuse reflectance `reflectance`, by the dipole of Jensen et al. 2001;
// `boundary`: 4/3 of the factor A of its boundary condition. As many halvings as Cycles has.
float dipole_albedo(float reflectance, float boundary) {
  if (reflectance < 1e-4f) return 0.0f;
  if (reflectance >= 0.995f) return k_most_albedo;
  float low = 0.0f, high = 1.0f, middle = 0.5f;
  for (int i = 0; i < 12; ++i) {
    middle = 0.5f * (low + high);
    const float s = std::sqrt(3.0f * (1.0f - middle));
    (0.5f * middle * (1.0f + std::exp(-boundary * s)) * std::exp(-s) < reflectance ? low : high) = middle;
  }
  return middle;
}

float polynomial(const float (&coefficients)[8], float x) {
  float sum = 0.0f;
  for (int i = 7; i >= 0; --i) sum = sum * x + coefficients[i];
  return sum;
}

// Single-scattering albedo for a surface albedo and anisotropy: Wrenninge et al. 2017, the fit of their supplement.
float fitted_albedo(float surface, float g) {
  static constexpr float k_a[8] = {1.8260523782f,   -1.28451056436f, -1.79904629312f, 9.19393289202f,
                                   -22.8215585862f, 32.0234874259f,  -23.6264803333f, 7.21067002658f};
  static constexpr float k_b[8] = {0.0f,           31.1491581433f,  -201.847017512f, 841.576016723f, -2018.09288505f,
                                   2731.71560286f, -1935.41424244f, 559.009054474f};
  static constexpr float k_c[8] = {1.09686102424f, -0.394704063468f, 1.05258115941f, -8.83963712726f,
                                   28.8643230661f, -46.8802913581f,  38.5402837518f, -12.7181042538f};
  static constexpr float k_d[8] = {0.496310210422f, 0.360146581622f, -2.15139309747f, 17.8896899217f,
                                   -55.2984010333f, 82.065982243f,   -58.5106008578f, 15.8478295021f};
  static constexpr float k_e[8] = {0.0f,           76.7316253952f,  -594.356773233f, 2448.8834203f, -5576.68528998f,
                                   7116.60171912f, -4763.54467887f, 1303.5318055f};
  static constexpr float k_f[8] = {2.40602999408f, -2.51814844609f, 9.18494908356f, -79.2191708682f,
                                   259.082868209f, -403.613804597f, 302.85712436f,  -87.4370473567f};
  const float b = 4.98511194385f + 0.127355959438f * std::exp(polynomial(k_b, g));
  const float e = 4.23190299701f + 0.00310603949088f * std::exp(polynomial(k_e, g));
  const float blend = std::sqrt(std::sqrt(surface));
  const float low = polynomial(k_a, g) * std::pow(std::atan(b * surface), polynomial(k_c, g));
  const float high = polynomial(k_d, g) * std::pow(std::atan(e * surface), polynomial(k_f, g));
  return (1.0f - blend) * low + blend * high;
}

// The same by d'Eon 2022, eq. 53.7.
float van_de_hulst_albedo(float surface, float g) {
  const float s = 4.20863f * surface - std::sqrt(9.59217f + 41.6808f * surface + 17.7126f * sqr(surface)) + 4.09712f;
  return (1.0f - sqr(s)) / (1.0f - g * sqr(s));
}

}  // namespace

Color subsurface_mean_free_path(SubsurfaceMethod method, const Color& radius, const Color& albedo, float ior) {
  if (method == SubsurfaceMethod::van_de_hulst) return radius;
  // Scaled so that it looks like the diffusion profiles of older Blenders.
  if (method == SubsurfaceMethod::fixed_radius || method == SubsurfaceMethod::refractive ||
      method == SubsurfaceMethod::burley)
    return radius * (0.25f * k_inv_pi);
  const float eta = std::clamp(ior, 1.01f, 3.8f);
  const float diffuse = (-1.440f / eta + 0.710f) / eta + 0.668f + 0.0636f * eta;  // Jensen et al. 2001, F_dr
  const float boundary = 4.0f / 3.0f * (1.0f + diffuse) / (1.0f - diffuse);
  Color result;
  for (int k = 0; k < 3; ++k) result[k] = radius[k] * std::sqrt(3.0f * (1.0f - dipole_albedo(albedo[k], boundary)));
  return result;
}

SubsurfaceMedium subsurface_medium(const Lobe& lobe, float least_m) {
  SubsurfaceMedium medium;
  medium.anisotropy = lobe.param;
  const bool fitted = lobe.subsurface != SubsurfaceMethod::van_de_hulst && lobe.param >= 0.0f;
  for (int k = 0; k < 3; ++k) {
    float albedo = fitted ? fitted_albedo(lobe.f0[k], lobe.param) : van_de_hulst_albedo(lobe.f0[k], lobe.param);
    albedo = std::clamp(albedo, 0.0f, k_most_albedo);
    if (albedo < k_least_albedo) medium.weight[k] = albedo / k_least_albedo;
    medium.albedo[k] = std::max(albedo, k_least_albedo);
    medium.extinction[k] = 1.0f / std::max(lobe.f90[k], std::max(least_m, 1e-16f));
    if (fitted) medium.extinction[k] /= 1.0f - lobe.param;
  }
  return medium;
}

}  // namespace lambent
