// The Sky Texture. Preetham, Shirley & Smits 1999 is exact; the other models are stood in for by it (reported).
#pragma once

#include <vector>

#include "engine/base/vec.h"

namespace lambent {

/// @param sun_direction unit, world space; only the direction relative to +Z matters. @param turbidity in [1, 10].
std::vector<float> make_preetham_sky(const Vec3& sun_direction, float turbidity);

/// Scene-linear radiance from direction d (need not be unit; below the horizon: the horizon's).
Color sky_radiance(const std::vector<float>& table, const Vec3& d);

}  // namespace lambent
