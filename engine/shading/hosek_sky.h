// The sky of Hosek & Wilkie 2012, "An Analytic Model for Full Spectral Sky-Dome Radiance".
#pragma once

#include <array>
#include <vector>

#include "engine/base/vec.h"

namespace lambent {

/// Coefficients of one of CIE X, Y, Z for one sky, as polynomials: Bernstein coefficients of degree 5 over the cube
/// root of the sun's elevation over 90 degrees. A, B, E and H of the model's formula, then C, D, F, G and I, and the
/// factor of the whole.
struct HosekCoefficients {
  static constexpr int k_count = 10, k_degree = 5;
  float bernstein[k_count][k_degree + 1];
};
inline constexpr int k_hosek_turbidities = 10;
/// By whole turbidity from 1 on, albedo of the ground 0 or 1, and X, Y, Z (hosek_sky_table.cpp).
extern const HosekCoefficients k_hosek_coefficients[k_hosek_turbidities][2][3];

inline constexpr size_t k_hosek_floats = 30;

/// A table for sky_radiance.
/// @param sun_direction unit, world space; a sun below the horizon counts as at it @param turbidity clamped to [1, 10]
/// @param ground_albedo clamped to [0, 1]
std::vector<float> make_hosek_sky(const Vec3& sun_direction, float turbidity, float ground_albedo);

/// CIE XYZ, in the scene units of Blender's sky, from the unit direction d. Below the horizon the sky goes on with the
/// horizon's.
std::array<float, 3> hosek_xyz(const std::vector<float>& table, const Vec3& d);

}  // namespace lambent
