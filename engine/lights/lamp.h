// Blender's lamps, prepared for rendering, with the formulas of Cycles 3.4.1.
#pragma once

#include <string>

#include "engine/base/frame.h"
#include "engine/lights/emission_aim.h"
#include "engine/lights/light.h"
#include "engine/lights/light_tree.h"

namespace lambent {

/// Point on a lamp as seen from a receiver, before selection.
struct LampSample {
  Vec3 direction{0.0f};
  float distance = 0.0f;
  Vec3 p{0.0f}, n{0.0f};
  Vec2 uv{0.0f, 0.0f};
  Color radiance{0.0f};          ///< delta lamps: irradiance on a facing surface
  float pdf_solid_angle = 0.0f;  ///< delta lamps: 1; 0: nothing to add
};

/// Start of a ray of an infinite light along `direction` (unit): through a point of the scene's disk, or the target's,
/// on the plane that touches the scene's sphere on the light's side.
Vec3 start_of_infinite_ray(const Vec3& direction, const Vec2& u, const EmissionTarget* target, const Vec3& scene_center,
                           float scene_radius);

/// A lamp with everything derived from its description. Immutable.
///
/// Point and spot lamps with a radius are spheres, or disks of that radius that face the receiver, of radiance energy /
/// (4 pi · pi r²); so from a disk's side a ray at distance b from the centre is seen by receivers beyond b² / sqrt(r² -
/// b²) along it, which is where sample_emission starts rays. Suns are disks one metre away, evenly lit, so their
/// radiance grows as 1 / cos³ off axis. Spread dims area lamps as a grid of slats would (Cycles D10594); its
/// normalisation is exact here, while Cycles 3.4.1 loses digits below 5 degrees and shines a quarter too brightly at 1
/// degree.
class Lamp {
 public:
  /// `light` must be valid (see validate).
  explicit Lamp(const AnalyticLight& light);
  /// Empty, or what is wrong with a description (message for the user, names the lamp).
  static std::string validate(const AnalyticLight& light);

  LightKind kind() const { return kind_; }
  bool is_delta() const { return is_delta_; }
  const Vec3& center() const { return center_; }
  /// Point or spot: a sphere. It shines inwards too; light walks begin on its outside alone.
  bool is_sphere() const { return sphere_; }
  bool is_infinite() const { return kind_ == LightKind::sun; }
  /// False if energy per area exceeds what a float holds.
  bool has_finite_radiance() const { return is_finite(radiance_ * spread_norm_); }
  const LightTraits& traits() const { return traits_; }
  /// For the light tree (finite lamps). Intensity is the largest in any direction, by luminance.
  LightCluster cluster() const;
  /// Luminance of the irradiance on a facing surface (sun).
  double irradiance() const;
  /// Largest cosine between a receiver's normal and a direction to the sun's disk, 0 if it lies below the horizon.
  float largest_cos(const Vec3& n) const;
  Bounds3 bounds() const;

  /// Point on the lamp for a receiver at p.
  LampSample sample(const Vec3& p, const Vec2& u) const;
  /// Density of sample(p) per steradian in `direction`, at a point that a ray from p meets.
  float pdf_solid_angle(const Vec3& p, const Vec3& direction, float distance) const;
  /// Whether a ray meets the lamp's emitting side in (t_min, t_max); fills everything but light and traits.
  bool intersect(const Vec3& origin, const Vec3& direction, float t_min, float t_max, LightHit& hit) const;
  /// Whether a ray that leaves the scene meets the sun's disk.
  bool intersect_infinite(const Vec3& direction, LightHit& hit) const;

  /// Ray that leaves the lamp, sent to `target` unless that is null; fills all but light, traits and densities (see
  /// pdf_emission). `scene` is the scene's sphere. False: no light goes there.
  bool sample_emission(const Vec2& u_position, const Vec2& u_direction, const Vec3& scene_center, float scene_radius,
                       const EmissionTarget* target, EmissionSample& sample) const;
  /// Densities of that without a target.
  EmissionPdf pdf_emission(const Vec3& direction_from_light, float scene_radius) const;

 private:
  float spot_attenuation(const Vec3& direction_from_light) const;
  /// Distances from the lamp's centre squared and its radius squared tell whether p lies in the sphere.
  bool holds(float distance_squared) const { return sphere_ && distance_squared <= radius_ * radius_; }
  float one_minus_cos_seen_from(float distance) const;
  float spread_attenuation(const Vec3& direction) const;
  /// Part of the area lamp's rectangle: from (u, v) on, in metres from its centre.
  struct Part {
    float u, v, width, height;
    bool whole;
  };
  Part lit_part(const Vec3& p) const;
  Vec3 corner_of(const Part& part) const { return center_ + unit_u_ * part.u + unit_v_ * part.v; }

  LightKind kind_ = LightKind::point;
  bool is_delta_ = false, round_ = false, sphere_ = false, even_sun_ = false, spot_cosine_ = true;
  Vec3 center_{0.0f};
  Frame frame_;                             ///< n: where the lamp shines (spot, area); the way light travels (sun)
  float radius_ = 0.0f;                     ///< point, spot; sun: tan of the half angle
  Color radiance_{0.0f};                    ///< on axis; delta lamps: intensity, or irradiance (sun)
  float cos_cone_ = -1.0f, smooth_ = 0.0f;  ///< spot, in its own space
  float cos_bound_ = -1.0f;                 ///< spot: of a round cone that holds it, at least 0
  Vec3 spot_rows_[2];                       ///< spot without spot_cosine: from world directions to its own x and y
  Vec3 unit_u_{0.0f}, unit_v_{0.0f};        ///< area: directions of width and height
  float width_ = 0.0f, height_ = 0.0f;      ///< area, m
  float area_ = 0.0f, tan_spread_ = 0.0f, spread_norm_ = 1.0f;  ///< area lamp
  float one_minus_cos_ = 0.0f;                                  ///< sun: of the half angle
  float cluster_scale_ = 1.0f;                                  ///< luminance of the program's average
  LightTraits traits_;
};

}  // namespace lambent
