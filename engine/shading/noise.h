// Perlin's gradient noise as Blender's Noise Texture: same lattice hash (Jenkins's lookup3), gradients and scales, so
// the same patterns.
#pragma once

#include "engine/base/vec.h"

namespace lambent {

/// Signed gradient noise in about [-1, 1]; 0 for coordinates that are not finite. `dimensions` in 1..4 says how many of
/// p's components count. @param repeats every 100 000 units, as Blender's from 4.2 on
float signed_noise(const Vec4& p, int dimensions, bool repeats);

/// How octaves are combined (Musgrave 2003, "Procedural Fractal Terrains"; names of Blender).
enum class FractalType : uint8_t { fbm, multifractal, hybrid_multifractal, ridged_multifractal, hetero_terrain };

struct NoiseParameters {
  int dimensions = 3;
  FractalType type = FractalType::fbm;
  float detail = 2.0f;      ///< octaves above the first, clamped to [0, 15]; may be fractional
  float roughness = 0.5f;   ///< amplitude from octave to octave, at least 0
  float lacunarity = 2.0f;  ///< frequency from octave to octave
  float offset = 0.0f;      ///< hybrid, ridged and hetero terrain
  float gain = 1.0f;        ///< hybrid and ridged
  float distortion = 0.0f;
  bool normalize = true;  ///< fbm: result in [0, 1]; else signed
  bool repeats = false;   ///< signed_noise()'s
};

/// Noise Texture. @param p coordinates times scale. @param color three decorrelated values, computed if not null; the
/// first is the returned value.
float noise_texture(const Vec4& p, const NoiseParameters& parameters, Color* color);

/// Musgrave Texture of Blender before 4.1, without its scale. @param octaves clamped to [0, 15]: of these the first is
/// left out where it is less than 1. @param dimension amplitudes fall as lacunarity to the power of minus this.
float musgrave_texture(const Vec4& p, const NoiseParameters& parameters, float octaves, float dimension);

// --- Hashes as Blender's textures use them: values in [0, 1] from the bits of `count` floats -------------------------

float hash_floats(float a);
float hash_floats(float a, float b);
float hash_floats(float a, float b, float c);
float hash_floats(float a, float b, float c, float d);
/// Three values from the first `dimensions` components of p.
Color hash_to_color(const Vec4& p, int dimensions);
/// As many values as there are dimensions, from those components of p.
Vec4 hash_to_vector(const Vec4& p, int dimensions);
/// The same from whole numbers by PCG (Jarzynski & Olano 2020), as Blender's Voronoi since 5.0. `dimensions` in 2..4.
Vec4 hash_cell(const int32_t* cell, int dimensions);
/// Value in [0, 1] from two integers.
float hash_integers(uint32_t a, uint32_t b);

}  // namespace lambent
