// What a light is made of, in Blender's units, and what sampling or hitting one returns. Plain values.
//
// Directions: `direction` always points from the receiver towards the light, as the ray that would hit it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/transform.h"
#include "engine/base/vec.h"

namespace lambent {

enum class LightKind : uint8_t { point, spot, sun, area, triangle, environment };

/// What light comes from, for passes.
enum class LightSource : uint8_t { lamp, surface, background };

/// Index of a light in a LightSet. Analytic lights have the number that LightSetBuilder::add returned; triangles and
/// the environment come after them.
using LightIndex = uint32_t;
inline constexpr LightIndex k_no_light = 0xffffffffu;

/// Light linking: the sets of objects (numbers of the caller's, from 1) that a light reaches and that block it; 0: all.
struct LinkSets {
  uint8_t receivers = 0, blockers = 0;
  bool any() const { return (receivers | blockers) != 0; }
};

/// What every kind of light hands through to its samples and hits.
struct LightTraits {
  uint32_t user = 0;  ///< the caller's: for example which program or object this is
  uint32_t hidden_from =
      0;  ///< ray kinds (the caller's bits) that do not see the light: it is not hit by rays of any of these kinds
  bool program =
      false;  ///< radiance must be multiplied by (analytic) or replaced by (triangle, environment) the emission program
  bool shadows = true;  ///< false: connections are not occluded
  /// False ("multiple importance" off): no ray hits it, not even from the camera; its MIS weight when sampled is 1.
  bool hit_by_rays = true;
  int max_bounces = 1024;  ///< deeper paths do not see it
  uint16_t group = 0;      ///< the caller's number of its light group; 0: in none
  LinkSets linked;
  /// False: no walk starts at it, because what it sends depends on the path that meets it (Light Path node, hidden from
  /// some kinds of ray) or passes through everything (no shadows). Camera walks alone find it.
  bool starts_walks = true;
};

/// A lamp as Blender describes it and Cycles renders it: 3.4.1 by default, later ones by the fields that say so.
struct AnalyticLight {
  std::string name;                   ///< for messages
  LightKind kind = LightKind::point;  ///< point, spot, sun or area
  Transform world_from_light;         ///< shines along -Z. Scale matters for area lights alone
  Color energy{10.0f};                ///< colour × energy × 2^exposure, W; sun: W/m². May be negative or zero
  /// False (Blender 4.5 and later): energy is not divided by the lamp's area, so radiance is multiplied by 4 pi r²
  /// (point and spot; 4 without radius), pi sin²(angle / 2) (sun; 1 without angle) or width x height.
  bool normalize = true;
  float radius_m = 0.0f;                               ///< point, spot
  float angle_rad = 0.0f;                              ///< sun: whole angle of the disk
  float spot_size_rad = k_pi / 4, spot_blend = 0.15f;  ///< whole cone angle; share of it that fades
  bool spot_cosine = true;      ///< spot: intensity falls by the cosine off axis, scale does not matter (before 3.5);
                                ///< false: it does not, and scale makes the cone elliptic
  bool sphere = false;          ///< point, spot: a sphere that shines to both sides (4.0; later without soft falloff)
  bool even_sun = false;        ///< sun: as bright at the rim of a wide disk as in its middle (4.0)
  bool round = false;           ///< area: ellipse inscribed in the rectangle
  Vec2 size_m{1.0f, 1.0f};      ///< area: width and height (squares and disks: both the same)
  float spread_rad = k_pi;      ///< area: whole angle
  Color program_average{1.0f};  ///< if traits.program: its average, to choose lights by
  LightTraits traits;
};

/// Emission shared by triangles: a material seen on an instance. `front` and `back` say which sides are sampled; rays
/// that hit the other side get density 0, so a closed mesh whose material emits both ways may leave `back` out: no
/// picture changes, and no samples are wasted on sides that nobody sees.
struct SurfaceEmission {
  Color radiance{1.0f};            ///< W sr⁻¹ m⁻²; with traits.program an estimate, to choose lights by
  bool front = true, back = true;  ///< sides to sample; front: anticlockwise (b - a) x (c - a)
  LightTraits traits;
};

/// A triangle that emits, in world space.
struct EmissiveTriangle {
  Vec3 a{0.0f}, b{0.0f}, c{0.0f};
  uint32_t triangle = 0;          ///< the caller's index within the instance
  uint32_t emission = 0;          ///< number that LightSetBuilder::add_emission returned
  float importance_scale = 1.0f;  ///< this triangle's radiance over the emission's estimate, to choose lights by
};

/// The world. Directions map to the image as in Blender (see equirectangular_of_direction).
struct EnvironmentLight {
  Color radiance{0.0f};          ///< constant, or the average, W sr⁻¹ m⁻²
  std::vector<float> luminance;  ///< float[height][width] radiance estimates, row 0 at the bottom (-Z); empty: constant
  int width = 0, height = 0;
  /// A sun's disc in the sky, sampled for itself: `luminance` is then that of the rest. Whole angle; 0: none.
  float sun_angle_rad = 0.0f;
  Vec3 sun_direction_world{0, 0, 1};  ///< unit, towards it
  float sun_luminance = 0.0f;         ///< mean over the disc
  LightTraits traits;
};

/// (u, v) in [0, 1)² of a direction in Blender's equirectangular mapping: u = 0.5 looks along +X and grows towards -Y
/// (clockwise from above), v = 0 down, 1 up.
Vec2 equirectangular_of_direction(const Vec3& direction);
/// Unit direction of (u, v).
Vec3 direction_of_equirectangular(const Vec2& uv);

/// A point on a light, chosen for a receiver.
struct LightSample {
  LightIndex light = k_no_light;  ///< k_no_light: nothing to add (behind the light, outside the cone, no lights)
  bool is_delta =
      false;  ///< cannot be hit: no MIS. `radiance` is then irradiance on a facing surface (W/m²) and
              ///< `pdf_solid_angle` equals `prob_selection`: the estimate is f·cos·radiance/pdf all the same
  bool is_infinite = false;      ///< sun, environment
  Vec3 direction_world{0.0f};    ///< unit, receiver to light
  float distance_m = 0.0f;       ///< infinity for infinite lights
  Vec3 p_light_world{0.0f};      ///< undefined for infinite lights
  Vec3 n_light_world{0.0f};      ///< emitting side's normal; triangles: the geometric normal of the front
  Vec2 uv{0.0f, 0.0f};           ///< triangles: weights of b and c; area lamps: as Cycles' lamp parametric coordinates;
                                 ///< point and spot lamps likewise, if they have a program; else (0, 0)
  Color radiance{0.0f};          ///< towards the receiver; see LightTraits::program
  float pdf_solid_angle = 0.0f;  ///< per steradian, selection included
  float prob_selection = 0.0f;   ///< of this light, for this receiver
  uint32_t instance = 0, triangle = 0;  ///< triangles: the caller's numbers
  const LightTraits* traits = nullptr;  ///< null if light is k_no_light

  explicit operator bool() const { return light != k_no_light; }
};

/// A ray that meets a light.
struct LightHit {
  LightIndex light = k_no_light;
  float distance_m = k_infinity;
  Vec3 direction_world{0.0f};  ///< of the ray
  Vec3 p_light_world{0.0f};    ///< undefined for infinite lights
  Vec3 n_light_world{0.0f};
  Vec2 uv{0.0f, 0.0f};   ///< as in LightSample
  Color radiance{0.0f};  ///< as in LightSample
  const LightTraits* traits = nullptr;

  explicit operator bool() const { return light != k_no_light; }
};

/// A ray that leaves a light. Flux weight: radiance · cos_light / (prob_selection · pdf_area ·
/// pdf_direction_solid_angle).
struct EmissionSample {
  LightIndex light = k_no_light;
  Vec3 p_light_world{0.0f};  ///< start of the ray. Infinite lights: on a disk that touches the scene's bounding sphere
  Vec3 n_light_world{0.0f};
  Vec3 direction_world{0.0f};  ///< unit, away from the light: the exception to this file's convention
  Vec2 uv{0.0f, 0.0f};
  Color radiance{0.0f};    ///< delta position: intensity, W/sr. Delta direction: irradiance, W/m²
  float cos_light = 1.0f;  ///< 1 where pdf_area is per area perpendicular to the ray (point, spot, sun, environment)
  float prob_selection = 0.0f;
  float pdf_area = 0.0f;                   ///< m⁻²; 1 if the position is delta
  float pdf_direction_solid_angle = 0.0f;  ///< sr⁻¹, given the position; 1 if the direction is delta
  bool is_delta_position = false, is_delta_direction = false, is_infinite = false;
  uint32_t instance = 0, triangle = 0;
  const LightTraits* traits = nullptr;
  /// Lamps that face their receiver (Lamp): what the ray keeps from the centre, squared (m²), and how far the start is
  /// past where it comes nearest to it (m). Others: 0.
  float b_squared_m2 = 0.0f, along_m = 0.0f;

  /// How far behind the start the lamp is, m, for a receiver that far from it: what lies there stands before the lamp.
  float behind_m(float distance_m) const {
    return b_squared_m2 > 0.0f ? along_m + b_squared_m2 / (along_m + distance_m) : 0.0f;
  }

  explicit operator bool() const { return light != k_no_light; }
};

/// Densities of sample_emission for a given ray.
struct EmissionPdf {
  float prob_selection = 0.0f;
  float pdf_area = 0.0f;                   ///< as in EmissionSample
  float pdf_direction_solid_angle = 0.0f;  ///< as in EmissionSample
};

}  // namespace lambent
