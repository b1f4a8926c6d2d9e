// The Earth's atmosphere at four wavelengths, with a fit of all orders of scattering: García Liñán 2022, "A Spectral
// Approach to Real-Time Sky Rendering" (fgarlin.com/posts/2024-12-06-spectral_sky), the Sky Texture's model since
// Blender 5.0, with Blender's parameters.
#pragma once

#include <array>
#include <vector>

#include "engine/base/vec.h"

namespace lambent {

/// Distance to a sphere around the origin along a unit direction, to where it is entered or, from inside, left;
/// negative where it is missed. In double: a few metres of height against the Earth's radius.
double distance_to_sphere(const Vec3d& p, const Vec3d& d, double radius);

class SpectralAtmosphere {
 public:
  /// Densities relative to the Earth's. Takes some 50 ms of one core for a table of transmittances.
  SpectralAtmosphere(float air_density, float aerosol_density, float ozone_density);

  /// XYZ of the sky's light along unit direction d from a height above sea level, without the sun itself. Directions
  /// that meet the ground see the air before it.
  Color radiance(double altitude_km, const Vec3d& d, const Vec3d& sun) const;

  /// XYZ of the sunlight that arrives from an elevation, per unit of the sun's irradiance spread over solid_angle_sr.
  Color sunlight(double altitude_km, double elevation_rad, double solid_angle_sr) const;

  static constexpr double k_earth_radius_km = 6371.0, k_thickness_km = 100.0;

 private:
  using Spectrum = std::array<float, 4>;  // at 630, 560, 490 and 430 nm
  struct Air {
    Spectrum molecules, aerosols, extinction;  // scattering by each; all that is lost; 1/km
  };
  static constexpr int k_angles = 256, k_heights = 64, k_steps = 64;

  Air air_at(double altitude_km) const;
  Spectrum integrated_transmittance(double cos_zenith, double relative_height) const;
  Spectrum transmittance(double cos_zenith, double relative_height) const;
  Spectrum scattered_more_than_once(double cos_zenith, double relative_height, double from_centre_km) const;

  float air_density_, aerosol_density_, ozone_density_;
  std::vector<Spectrum> transmittances_;  // to the top of the atmosphere, by height and cosine
};

}  // namespace lambent
