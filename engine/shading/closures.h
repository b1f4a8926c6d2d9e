// From a node's evaluated parameters to lobes: the weights and parameters of every BSDF node, both Principled
// generations.
#pragma once

#include <algorithm>
#include <array>

#include "engine/shading/lobe.h"

namespace lambent {

enum class ClosureKind : uint8_t {
  diffuse,
  glossy,
  glass,
  refraction,
  translucent,
  transparent,
  portal,
  velvet,
  sheen,
  toon,
  glossy_toon,
  hair_reflection,
  hair_transmission,
  hair_fibre,
  hair_microfacets,
  metallic,
  conductor,
  subsurface,
  holdout,
  principled_1,
  principled_2,
  emission
};

/// How a microfacet closure was asked for (`variant` of a closure).
enum class GlossModel : uint8_t { sharp, ggx, beckmann, multiscatter_ggx, ashikhmin_shirley };

// Indices into a closure's parameters. A colour takes three.
namespace closure_parameter {
inline constexpr int k_color = 0;               // all simple closures; emission: times strength
inline constexpr int k_roughness = 3;           // diffuse, glossy, glass, refraction, velvet (sigma), sheen
inline constexpr int k_ior = 4;                 // glass, refraction
inline constexpr int k_glass_generation = 5;    // 2: as Cycles from 4.0 on
inline constexpr int k_glass_film = 6;          // thickness, nm, and index
inline constexpr int k_diffuse_generation = 4;  // 2: as Cycles from 4.3 on
inline constexpr int k_size = 3;                // toon
inline constexpr int k_smooth = 4;              // toon
inline constexpr int k_around = 4;              // hair: roughness around; along is k_roughness
inline constexpr int k_tilt = 5;                // hair
inline constexpr int k_anisotropy = 4;          // glossy, metallic
inline constexpr int k_rotation = 5;            // glossy, metallic
inline constexpr int k_edge_tint = 6;           // metallic
inline constexpr int k_extinction = 6;          // conductor, whose colour is its index
inline constexpr int k_metal_film = 9;          // metallic, conductor: as k_glass_film
inline constexpr int k_place = 3;               // portal: user's world position, and 1 if there is one
inline constexpr int k_direction = 7;           // portal: zero: straight on
inline constexpr int k_radius = 3;              // subsurface: by channel, m
inline constexpr int k_scatter = 6;             // subsurface: anisotropy, index, roughness and SubsurfaceRules
}  // namespace closure_parameter

/// Which method a subsurface closure has, and how paths that met a diffuse surface see it: a parameter, as a float.
struct SubsurfaceRules {
  SubsurfaceMethod method = SubsurfaceMethod::fixed_radius;
  bool diffuse_after_diffuse = false;

  float pack() const { return static_cast<float>(static_cast<int>(method) * 2 + diffuse_after_diffuse); }
  static SubsurfaceRules unpack(float packed) {
    const int bits =
        static_cast<int>(std::clamp(packed, 0.0f, 2.0f * static_cast<float>(SubsurfaceMethod::van_de_hulst) + 1.0f));
    return {static_cast<SubsurfaceMethod>(bits / 2), bits % 2 != 0};
  }
};

/// Principled parameters in the order in which they are stored.
struct Principled1 {  // Blender before 4.0
  Color base;
  float subsurface;
  Color subsurface_color;
  float metallic, specular, specular_tint, roughness, anisotropic, rotation, sheen, sheen_tint, clearcoat,
      clearcoat_roughness, ior, transmission, transmission_roughness;
  Color subsurface_radius;
  float subsurface_ior, subsurface_anisotropy, subsurface_rules;
};
struct Principled2 {  // Blender 4.0 and later
  Color base;
  float metallic, roughness, ior, diffuse_roughness, subsurface, specular_level;
  Color specular_tint;
  float anisotropic, rotation, transmission, coat, coat_roughness, coat_ior;
  Color coat_tint;
  float sheen, sheen_roughness;
  Color sheen_tint, subsurface_radius;
  float subsurface_scale, subsurface_ior, subsurface_anisotropy, subsurface_rules;
  float film_nm, film_ior, thin_wall;
  Color emission;  // the last: what the compiler looks for
};
/// What the colour of a hair fibre means.
enum class HairColor : uint8_t { absorption, melanin, reflectance };
/// Principled hair's parameters in the order in which they are stored.
struct PrincipledHair {
  Color color;  ///< absorption per radius, tint or reflectance
  float meaning, melanin, redness, roughness, radial_roughness, coat, ior, tilt_rad, random, random_color,
      random_roughness;
};
/// What Huang's model has beyond that; follows it.
struct HairSection {
  float aspect, reflected, through, returned;
};
inline constexpr int k_max_closure_parameters = 39;
static_assert(sizeof(Principled1) <= k_max_closure_parameters * sizeof(float));
static_assert(sizeof(Principled2) <= k_max_closure_parameters * sizeof(float));
/// Floats that a closure of the kind reads.
int closure_parameter_count(ClosureKind kind);

/// Lobes of one closure, before its weight and its normals.
struct LobeTemplates {
  static constexpr int k_capacity = 8;
  struct Entry {
    Lobe lobe;
    bool coat = false;         ///< takes the coat normal
    float rotation = 0.0f;     ///< of the tangent around the normal, in turns
    bool anisotropic = false;  ///< takes the tangent
  };
  std::array<Entry, k_capacity> entries;
  int count = 0;
  Color emission{0.0f};  ///< emitted radiance below coat and sheen (principled_2)
  Color holdout{0.0f};   ///< share of what the camera sees that is a hole

  Lobe& add(LobeKind kind, const Color& weight) {
    Entry& entry = entries[count < k_capacity ? count++ : k_capacity - 1];
    entry = Entry{};
    entry.lobe.kind = kind;
    entry.lobe.weight = weight;
    return entry.lobe;
  }
  Entry& last() { return entries[count - 1]; }
};

/// True if the lobes depend on the angle of view, so that they cannot be made ahead of it.
inline bool closure_depends_on_view(ClosureKind kind) { return kind == ClosureKind::principled_2; }

/// @param parameters closure_parameter_count(kind) floats; NaN and infinity count as 0.
/// @param cos_view cosine between the normal and the view, used if closure_depends_on_view.
void make_lobes(ClosureKind kind, GlossModel model, const float* parameters, bool backfacing, float cos_view,
                LobeTemplates& templates);

/// Turns a lobe normal just enough towards ng that the mirrored view leaves above the surface (Cycles'
/// ensure_valid_reflection). All unit; dot(ng, wi) >= 0. Returns n itself where it is fine.
Vec3 bent_reflection_normal(const Vec3& ng, const Vec3& wi, const Vec3& n);
inline Vec3 valid_reflection_normal(const Vec3& ng, const Vec3& wi, const Vec3& n) {
  return n == ng ? n : bent_reflection_normal(ng, wi, n);
}

}  // namespace lambent
