// The world as a light: importance sampling of a latitude-longitude image of radiance estimates.
#pragma once

#include "engine/base/frame.h"
#include "engine/lights/light.h"
#include "engine/sampling/distribution.h"

namespace lambent {

/// Immutable. Directions are sampled by the image's luminance, piecewise constant, or, for an even world, uniformly:
/// by the cosine at a surface, over the sphere elsewhere. A sun's disc, which would be a part of a texel, has its share
/// of the samples to itself.
class Environment {
 public:
  explicit Environment(EnvironmentLight light);

  const EnvironmentLight& light() const { return light_; }
  /// Every direction has the same luminance: no direction is worth choosing before others.
  bool is_even() const { return is_even_; }
  /// Mean luminance over the sphere (solid-angle weighted), absolute value.
  double mean_luminance() const { return mean_luminance_; }
  size_t bytes() const { return distribution_.bytes(); }

  /// Direction towards the world for a receiver with normal `n` (zero: none); `pdf_solid_angle` per steradian, 0 on
  /// failure.
  Vec3 sample(const Vec3& n_world, const Vec2& u, float& pdf_solid_angle) const;
  /// Density of sample(n) at a unit direction, per steradian.
  float pdf_solid_angle(const Vec3& n_world, const Vec3& direction_world) const;

 private:
  bool in_sun(const Vec3& direction_world) const;

  EnvironmentLight light_;
  Distribution2D distribution_;
  bool is_even_ = true;
  float prob_sun_ = 0.0f, sun_one_minus_cos_ = 0.0f;
  float sun_chord_squared_ = -1.0f;  ///< of the widest |d - sun|² that is in the disc
  Frame sun_frame_;
  double mean_luminance_ = 0.0;
};

}  // namespace lambent
