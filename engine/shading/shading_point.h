// What a shader program may ask about the point being shaded.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "engine/base/transform.h"
#include "engine/base/vec.h"

namespace lambent {

/// What kind of ray arrived (Blender's Light Path node, ray visibility and per-type bounce limits). Bits combine: a ray
/// that a glossy transmission made is `transmission | glossy`.
enum RayKind : uint32_t {
  k_ray_camera = 1u << 0,
  k_ray_diffuse = 1u << 1,
  k_ray_glossy = 1u << 2,
  k_ray_transmission = 1u << 3,
  k_ray_shadow = 1u << 4,
  k_ray_volume_scatter = 1u << 5,
  k_ray_singular = 1u << 6,  ///< made by a delta lobe; never part of visibility masks
};

/// Mesh data that a program reads besides position and normal.
struct AttributeRequest {
  enum class Kind : uint8_t {
    named,      ///< attribute `name`, any role
    number,     ///< the same as one number: the mean of three components, the first of two
    object,     ///< attribute `name` of the object
    uv,         ///< UV set `name`; empty: the active one
    color,      ///< colour attribute `name`; empty: the active one
    tangent,    ///< unit tangent of UV set `name` in world space; w: sign of the bitangent
    generated,  ///< texture-space coordinates in [0, 1]
    /// Where the point was before true displacement, in world space. Name "compact": with a footprint as Cycles before
    /// 5.0 has it, of mean length and in the directions of the displaced surface.
    undisplaced,
    undisplaced_normal,  ///< the normal there, unit, in world space and on the side of wi
  };
  Kind kind = Kind::named;
  std::string name;
  friend bool operator==(const AttributeRequest&, const AttributeRequest&) = default;
};

/// Interpolated attribute. Missing components are 0 (w: 1); a missing attribute is all 0. Left uninitialised: whoever
/// fills a ShadingPoint writes those that the program asks for.
struct AttributeValue {
  Vec4 value;
  Vec4 ddx, ddy;  ///< change over one pixel footprint; filled if the program asks for differentials

  static AttributeValue constant(const Vec4& value) { return {value, Vec4(0.0f), Vec4(0.0f)}; }
};

inline constexpr int k_max_attributes = 16;

/// The camera as shaders may ask for it.
struct ViewSpace {
  Transform camera_from_world, world_from_camera;  ///< of p_world; camera: x right, y up, z forward
  bool perspective = true;
  /// Window coordinates, 0 to 1 across the picture: offset + scale · (x, y), or of (x, y) / z in perspective.
  Vec2 window_scale{1.0f, 1.0f}, window_offset{0.5f, 0.5f};
};

/// The particle that an instance stands for, as Blender's particle systems tell: world space, times in frames.
struct ParticleState {
  float index = 0.0f, age = 0.0f, lifetime = 0.0f, size = 0.0f;
  Vec3 location{0.0f}, velocity{0.0f}, angular_velocity{0.0f};
};

struct ShadingPoint;

/// Where on the scene's surfaces something is.
struct SurfacePlace {
  uint32_t instance = 0, primitive = 0;
  Vec2 barycentric{0, 0};
};
static_assert(sizeof(SurfacePlace) == 4 * sizeof(float), "Op::raycast has room for four floats");

/// Rays of programs that look around a point, as the scene traces them.
class ShaderRays {
 public:
  struct Crossing {
    Vec3 p_world, ng_world, ns_world;  ///< unit normals of the front
  };
  virtual ~ShaderRays() = default;
  /// Whether something is nearer than `distance_m` along a unit direction. @param own_object else than itself nothing
  virtual bool occluded(const ShadingPoint& point, const Vec3& direction_world, float distance_m,
                        bool own_object) const = 0;
  /// The point's own object where a segment crosses it, nearest first: how many there are, at most found.size().
  virtual int crossings(const ShadingPoint& point, const Vec3& origin_world, const Vec3& direction_world,
                        float distance_m, std::span<Crossing> found) const = 0;
  struct Meeting {
    float distance_m = 0.0f;
    Vec3 ns_world{0.0f};  ///< unit, towards where the ray came from
    bool own_object = false;
    SurfacePlace place;
  };
  /// What a ray meets first within `distance_m` along a unit direction. False: nothing.
  /// @param from_surface it starts at the point itself, which it does not meet
  virtual bool meets(const ShadingPoint& point, const Vec3& origin_world, const Vec3& direction_world, float distance_m,
                     bool from_surface, bool own_object, Meeting& met) const = 0;
  struct MetAttribute {
    Vec4 value{0, 0, 0, 1};  ///< as AttributeValue's; 0 and w 1 where there is none
    float number = 0.0f;     ///< as of AttributeRequest::Kind::number
  };
  /// Attribute `name` of the mesh at a place that meets() found.
  virtual MetAttribute attribute(const SurfacePlace& place, const std::string& name) const = 0;
};

/// All in world space. For surfaces; for the world and distant lights, `wi` alone is meaningful (p = -wi direction
/// lookups). Invariant: ng and ns are unit and on wi's side (dot(ng, wi) >= 0); `backfacing` tells that they were
/// flipped.
struct ShadingPoint {
  Vec3 p_world{0.0f};
  Vec3 ng_world{0, 0, 1};  ///< geometric normal
  Vec3 ns_world{0, 0, 1};  ///< interpolated normal
  Vec3 wi_world{0, 0, 1};  ///< unit, towards where the walk came from (for the world: minus the ray direction)
  Vec3 dpdu_world{1, 0, 0}, dpdv_world{0, 1, 0};  ///< edges-based tangents of the barycentric parameterisation
  Vec3 dpdx_world{0.0f}, dpdy_world{0.0f};        ///< footprint of one pixel on the surface (ray cone); zero if unknown
  Vec2 barycentric{0, 0};
  bool backfacing = false;
  uint32_t ray_kind = k_ray_camera;
  int ray_depth = 0, diffuse_depth = 0, glossy_depth = 0, transmission_depth = 0, transparent_depth = 0;
  float ray_length = 0.0f;
  float time = 0.0f;
  uint32_t random_id = 0;  ///< of the instance
  uint32_t object_index = 0, material_pass_index = 0, object_pass_index = 0;
  const Transform* world_from_object = nullptr;  ///< to and from the space of p_world; may be null
  const Transform* object_from_world = nullptr;
  const ViewSpace* view = nullptr;
  const ShaderRays* rays = nullptr;                         ///< null: nothing is around, or the program asks for none
  uint32_t instance = 0;                                    ///< for rays
  float p_error = 0.0f;                                     ///< for rays: SurfaceHit's, m
  const ParticleState* particle = nullptr;                  ///< null: none
  const Vec4* object_color = nullptr;                       ///< viewport colour and alpha; null: white
  Vec3 origin_shift{0.0f};                                  ///< add to p_world to get the user's world position
  std::array<AttributeValue, k_max_attributes> attributes;  ///< in the order of Program::attribute_requests()
};

}  // namespace lambent
