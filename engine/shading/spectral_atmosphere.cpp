#include "engine/shading/spectral_atmosphere.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace lambent {
namespace {

constexpr int k_bands = 4;
using Bands = std::array<float, k_bands>;

// García Liñán's data for the air of a town.
constexpr Bands k_sun_irradiance{1.679f, 1.828f, 1.986f, 1.307f};
constexpr Bands k_molecular_scattering{6.605e-3f, 1.067e-2f, 1.842e-2f, 3.156e-2f};  // at sea level, 1/km
constexpr Bands k_ozone_cross_section{3.472e-25f, 3.914e-25f, 1.349e-25f, 11.03e-27f};
constexpr Bands k_aerosol_absorption{2.8722e-24f, 4.6168e-24f, 7.9706e-24f, 1.3578e-23f};
constexpr Bands k_aerosol_scattering{1.5908e-22f, 1.7711e-22f, 2.0942e-22f, 2.4033e-22f};
constexpr float k_ozone_dobson = 334.5f;  // the mean over a year
constexpr float k_aerosol_density = 1.3681e20f, k_aerosol_background = 2e6f, k_aerosol_height_km = 0.73f;
constexpr float k_aerosol_anisotropy = 0.8f, k_ground_albedo = 0.3f;
constexpr float k_isotropic = 0.25f * k_inv_pi;
// The fit of what is scattered more than once.
constexpr Bands k_multiple{0.217f, 0.347f, 0.594f, 1.0f};

constexpr float k_xyz[k_bands][3] = {{53.3869177f, 22.9813375f, 0.0f},
                                     {43.9048445f, 71.3477957f, 0.1025069f},
                                     {1.6137278f, 18.4229606f, 31.7429212f},
                                     {20.7626687f, 2.3614214f, 110.4800964f}};

Color xyz_of(const Bands& spectrum) {
  Color sum(0.0f);
  for (int b = 0; b < k_bands; ++b) sum += Color(k_xyz[b][0], k_xyz[b][1], k_xyz[b][2]) * spectrum[b];
  return sum;
}

}  // namespace

double distance_to_sphere(const Vec3d& p, const Vec3d& d, double radius) {
  const double b = p ^ d, c = (p ^ p) - radius * radius, root = b * b - c;
  if (root < 0.0 || (c > 0.0 && b > 0.0)) return -1.0;
  return c > 0.0 ? -b - std::sqrt(root) : -b + std::sqrt(root);
}

SpectralAtmosphere::SpectralAtmosphere(float air_density, float aerosol_density, float ozone_density)
    : air_density_(air_density), aerosol_density_(aerosol_density), ozone_density_(ozone_density) {
  transmittances_.resize(static_cast<size_t>(k_heights) * k_angles);
  tbb::parallel_for(0, k_heights, [&](int y) {
    for (int x = 0; x < k_angles; ++x)
      transmittances_[static_cast<size_t>(y) * k_angles + x] =
          integrated_transmittance(2.0 * x / (k_angles - 1) - 1.0, static_cast<double>(y) / (k_heights - 1));
  });
}

SpectralAtmosphere::Air SpectralAtmosphere::air_at(double altitude_km) const {
  const float h = static_cast<float>(std::max(altitude_km, 0.0));
  const float air = air_density_ * std::exp(-0.07771971f * std::pow(h, 1.16364243f));
  const float log_h = std::log(std::max(h, 1e-4f));
  const float ozone =
      ozone_density_ * k_ozone_dobson * 3.78547397e20f * std::exp(-sqr(log_h - 3.22261f) * 5.55555555f - log_h);
  const float aerosol = aerosol_density_ * k_aerosol_density *
                        (std::exp(-h / k_aerosol_height_km) + k_aerosol_background / k_aerosol_density);
  Air result;
  for (int b = 0; b < k_bands; ++b) {
    result.molecules[b] = k_molecular_scattering[b] * air;
    result.aerosols[b] = k_aerosol_scattering[b] * aerosol;
    result.extinction[b] =
        result.molecules[b] + result.aerosols[b] + k_aerosol_absorption[b] * aerosol + k_ozone_cross_section[b] * ozone;
  }
  return result;
}

SpectralAtmosphere::Spectrum SpectralAtmosphere::integrated_transmittance(double cos_zenith,
                                                                          double relative_height) const {
  const Vec3d d(std::sqrt(std::max(0.0, 1.0 - cos_zenith * cos_zenith)), 0.0, cos_zenith);
  const Vec3d from(0.0, 0.0, k_earth_radius_km + relative_height * k_thickness_km);
  const double step = std::max(0.0, distance_to_sphere(from, d, k_earth_radius_km + k_thickness_km)) / k_steps;
  Spectrum depth{};
  for (int i = 0; i < k_steps; ++i) {
    const Air air = air_at((from + d * ((i + 0.5) * step)).length() - k_earth_radius_km);
    for (int b = 0; b < k_bands; ++b) depth[b] += air.extinction[b] * static_cast<float>(step);
  }
  for (float& value : depth) value = std::exp(-value);
  return depth;
}

SpectralAtmosphere::Spectrum SpectralAtmosphere::transmittance(double cos_zenith, double relative_height) const {
  const double x = std::clamp(0.5 * cos_zenith + 0.5, 0.0, 1.0) * (k_angles - 1);
  const double y = std::clamp(relative_height, 0.0, 1.0) * (k_heights - 1);
  const int x0 = std::min(static_cast<int>(x), k_angles - 2), y0 = std::min(static_cast<int>(y), k_heights - 2);
  const float u = static_cast<float>(x - x0), v = static_cast<float>(y - y0);
  const Spectrum* low = &transmittances_[static_cast<size_t>(y0) * k_angles + x0];
  const Spectrum* high = low + k_angles;
  Spectrum result;
  for (int b = 0; b < k_bands; ++b) result[b] = lerp(lerp(low[0][b], low[1][b], u), lerp(high[0][b], high[1][b], u), v);
  return result;
}

SpectralAtmosphere::Spectrum SpectralAtmosphere::scattered_more_than_once(double cos_zenith, double relative_height,
                                                                          double from_centre_km) const {
  // The ground's light: from its solid angle, through the air that lies between.
  const double ratio = std::min(k_earth_radius_km / from_centre_km, 1.0);
  const float solid_angle = static_cast<float>(2.0 * std::numbers::pi * (1.0 - std::sqrt(1.0 - ratio * ratio)));
  const float cosine = static_cast<float>(cos_zenith);
  const Spectrum arriving = transmittance(cos_zenith, 0.0);
  const Spectrum whole = transmittances_[k_angles - 1], above = transmittance(1.0, relative_height);
  const float ground = k_isotropic * solid_angle * k_ground_albedo * k_inv_pi * std::max(cosine, 0.0f);
  const float air = 0.02f / (1.0f + 5.0f * std::exp(-17.92f * cosine));
  Spectrum result;
  for (int b = 0; b < k_bands; ++b)
    result[b] = k_multiple[b] * air + (above[b] > 0.0f ? ground * arriving[b] * whole[b] / above[b] : 0.0f);
  return result;
}

Color SpectralAtmosphere::radiance(double altitude_km, const Vec3d& d, const Vec3d& sun) const {
  const Vec3d eye(0.0, 0.0, k_earth_radius_km + altitude_km);
  const double to_ground = distance_to_sphere(eye, d, k_earth_radius_km);
  const double length = to_ground < 0.0 ? distance_to_sphere(eye, d, k_earth_radius_km + k_thickness_km) : to_ground;
  const double step = std::max(length, 0.0) / k_steps;
  const float mu = static_cast<float>(d ^ sun), g = k_aerosol_anisotropy;
  const float phase_air = 3.0f / 16.0f * k_inv_pi * (1.0f + mu * mu);
  const float phase_aerosol = k_isotropic * (1.0f - g * g) / std::pow(1.0f + g * g - 2.0f * g * mu, 1.5f);
  Spectrum sum{}, through;
  through.fill(1.0f);
  for (int i = 0; i < k_steps; ++i) {
    const Vec3d p = eye + d * ((i + 0.5) * step);
    const double from_centre = p.length(), altitude = std::max(from_centre - k_earth_radius_km, 0.0);
    const double height = altitude / k_thickness_km, cos_zenith = (p ^ sun) / from_centre;
    const Air air = air_at(altitude);
    const Spectrum sunlight = transmittance(cos_zenith, height);
    const Spectrum more = scattered_more_than_once(cos_zenith, height, from_centre);
    for (int b = 0; b < k_bands; ++b) {
      const float source = air.molecules[b] * (phase_air * sunlight[b] + more[b]) +
                           air.aerosols[b] * (phase_aerosol * sunlight[b] + more[b]);
      // A step's light in closed form, its extinction constant
      const float kept = std::exp(-static_cast<float>(step) * air.extinction[b]);
      sum[b] += through[b] * k_sun_irradiance[b] * source * (1.0f - kept) / std::max(air.extinction[b], 1e-7f);
      through[b] *= kept;
    }
  }
  return xyz_of(sum);
}

Color SpectralAtmosphere::sunlight(double altitude_km, double elevation_rad, double solid_angle_sr) const {
  Spectrum spectrum = integrated_transmittance(std::sin(elevation_rad), altitude_km / k_thickness_km);
  for (int b = 0; b < k_bands; ++b) spectrum[b] *= k_sun_irradiance[b] / static_cast<float>(solid_angle_sr);
  return xyz_of(spectrum);
}

}  // namespace lambent
