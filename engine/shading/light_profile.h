// Photometric light profiles: IES LM-63 files as tables of intensity over directions.
#pragma once

#include <string>
#include <vector>

#include "engine/base/result.h"
#include "engine/base/vec.h"

namespace lambent {

/// A profile of an LM-63 file (1986 to 2019; photometric types B and C) as a table for light_profile(), or what is
/// wrong with it. Candelas count as 4π/177.83 W, the efficacy of daylight D65, as in Blender.
Result<std::vector<float>> read_light_profile(const std::string& text);

/// Intensity towards d (need not be unit; −Z is nadir), cubically interpolated; 0 beyond the profile's last angle.
float light_profile(const std::vector<float>& table, const Vec3& d);

}  // namespace lambent
