// Perlin's gradient noise as Blender's Noise Texture: same lattice hash (Jenkins's lookup3), gradients and scales, so
// the same patterns.
#pragma once

#include "engine/base/vec.h"

namespace lambent {

/// Signed gradient noise in about [-1, 1]; 0 for coordinates that are not finite. `dimensions` in 1..4 says how many of
/// p's components count.
float signed_noise(const Vec4& p, int dimensions);

struct NoiseParameters {
  int dimensions = 3;
  float detail = 2.0f;      ///< octaves above the first, clamped to [0, 15]; may be fractional
  float roughness = 0.5f;   ///< amplitude from octave to octave, clamped to [0, 1] as Blender before 4.0
  float lacunarity = 2.0f;  ///< frequency from octave to octave
  float distortion = 0.0f;
  bool normalize = true;  ///< result in [0, 1]; else signed
};

/// Noise Texture. @param p coordinates times scale. @param color three decorrelated values, computed if not null; the
/// first is the returned value.
float noise_texture(const Vec4& p, const NoiseParameters& parameters, Color* color);

/// Value in [0, 1] from the bits of two floats.
float hash_floats(float a, float b);
/// Value in [0, 1] from two integers.
float hash_integers(uint32_t a, uint32_t b);

}  // namespace lambent
