// Blender's regular procedural patterns: waves, magic, bricks, Gabor noise, radial tiling.
#pragma once

#include "engine/base/vec.h"

namespace lambent {

enum class WaveShape : uint8_t {
  bands_x,
  bands_y,
  bands_z,
  bands_diagonal,
  rings_x,
  rings_y,
  rings_z,
  rings_spherical
};
enum class WaveProfile : uint8_t { sine, saw, triangle };
/// Wave Texture in [0, 1]. @param p coordinates times scale.
float wave_texture(WaveShape shape, WaveProfile profile, const Vec3& p, float distortion, float detail,
                   float detail_scale, float detail_roughness, float phase_rad);

/// Magic Texture. @param depth in [0, 10].
Color magic_texture(const Vec3& p, float scale, int depth, float distortion);

struct BrickParameters {
  float mortar_size = 0.02f, mortar_smooth = 0.1f, bias = 0.0f, brick_width = 0.5f, row_height = 0.25f;
  float offset = 0.5f, squash = 1.0f;
  int offset_frequency = 2, squash_frequency = 2;  ///< 0: none
};
struct Brick {
  float tint = 0.0f;    ///< from the first brick colour to the second
  float mortar = 0.0f;  ///< from brick to mortar
};
/// Brick Texture. @param p coordinates times scale.
Brick brick_texture(const Vec3& p, const BrickParameters& parameters);

/// A place among segments around the origin, as seen from the middle of its segment's side.
struct RadialTile {
  float along = 0.0f, outwards = 0.0f;  ///< coordinates in the segment
  float segment = 0.0f, width = 0.0f, rotation_rad = 0.0f;
};
/// Radial Tiling: the plane as rings of a polygon. @param sides at least 2, a broken number leaves a narrower last
/// segment @param roundness of the corners, in [0, 1] @param normalize segments are 1 wide, and begin at the origin
RadialTile radial_tiling(const Vec2& p, float sides, float roundness, bool normalize);

struct Gabor {
  float value = 0.5f, phase = 0.0f, intensity = 0.0f;
};
/// Gabor Texture (Lagae et al. 2009; phasor noise of Tricard et al. 2019). @param p coordinates times scale.
/// @param orientation the direction of the waves, need not be unit; @param orientation_rad likewise of two dimensions.
Gabor gabor_texture(const Vec3& p, bool three_dimensions, float frequency, float anisotropy, float orientation_rad,
                    const Vec3& orientation);

}  // namespace lambent
