// The Sky Texture: the models of Preetham, Shirley & Smits 1999 and of Nishita et al. 1993 as Blender improved it
// (single scattering in spectral form, with ozone and a sun's disc).
#pragma once

#include <vector>

#include "engine/base/vec.h"

namespace lambent {

/// @param sun_direction unit, world space; only the direction relative to +Z matters. @param turbidity in [1, 10].
std::vector<float> make_preetham_sky(const Vec3& sun_direction, float turbidity);

struct NishitaSky {
  float sun_elevation_rad = 0.2617994f;
  float sun_rotation_rad = 0.0f;      ///< from +Y towards +X
  float sun_angle_rad = 0.00951204f;  ///< whole angle of the disc
  float sun_intensity = 1.0f;
  bool sun_disc = true;
  float altitude_m = 0.0f;
  float air_density = 1.0f, dust_density = 1.0f, ozone_density = 1.0f;
};
/// Takes about half a second of one core: the sky over the hemisphere is integrated once, in parallel.
std::vector<float> make_nishita_sky(const NishitaSky& sky);
/// Unit direction to the sun.
Vec3 sun_direction(float elevation_rad, float rotation_rad);

/// Scene-linear radiance from direction d (need not be unit). Below the horizon Preetham's sky goes on with the
/// horizon's, Nishita's fades to black.
Color sky_radiance(const std::vector<float>& table, const Vec3& d);

}  // namespace lambent
