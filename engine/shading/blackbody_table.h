// Colours of black bodies as Cycles has them, measured there (tests/nodes/measure_blackbody.py).
#pragma once

namespace lambent {

inline constexpr int k_blackbody_cells = 256;
inline constexpr float k_blackbody_low_kelvin = 800.0f, k_blackbody_high_kelvin = 12000.0f;

/// Linear Rec. 709, luminance about 1.
struct BlackbodyTable {
  float colors[k_blackbody_cells + 1][3];  ///< at temperatures even in their logarithm, from low to high
  float below[3], above[3];                ///< of all temperatures beyond
};

extern const BlackbodyTable k_blackbody_table;

}  // namespace lambent
