// The Sky Texture: the models of Preetham, Shirley & Smits 1999, of Hosek & Wilkie 2012 (hosek_sky.h), of Nishita et
// al. 1993 as Blender improved it (single scattering in spectral form, with ozone and a sun's disc), and of García
// Liñán 2022 (spectral_atmosphere.h).
#pragma once

#include <vector>

#include "engine/base/vec.h"

namespace lambent {

/// @param sun_direction unit, world space; only the direction relative to +Z matters. @param turbidity in [1, 10].
std::vector<float> make_preetham_sky(const Vec3& sun_direction, float turbidity);

struct AtmosphereSky {
  enum class Model {
    nishita,              ///< single scattering, fading below the horizon (Blender before 5.0)
    single_scattering,    ///< the same, its disc on top of the sky (from 5.0 on)
    multiple_scattering,  ///< García Liñán's, with the ground
  };
  Model model = Model::nishita;
  float sun_elevation_rad = 0.2617994f;
  float sun_rotation_rad = 0.0f;      ///< from +Y towards +X
  float sun_angle_rad = 0.00951204f;  ///< whole angle of the disc
  float sun_intensity = 1.0f;
  bool sun_disc = true;
  float altitude_m = 0.0f;
  float air_density = 1.0f, dust_density = 1.0f, ozone_density = 1.0f;
};
/// Takes about half a second of one core: the sky is integrated once, in parallel.
std::vector<float> make_atmosphere_sky(const AtmosphereSky& sky);
/// Unit direction to the sun.
Vec3 sun_direction(float elevation_rad, float rotation_rad);

/// Radiance in linear Rec. 709, negative where that cannot show it, from direction d (need not be unit). Below the
/// horizon the skies of Preetham and Hosek go on with the horizon's.
Color sky_radiance(const std::vector<float>& table, const Vec3& d);

}  // namespace lambent
