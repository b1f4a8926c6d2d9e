// The closed set of scattering lobes. Plain data; evaluated by free functions that switch on the kind.
//
// A lobe is a function f_cos(camera, light): the radiance that leaves towards `camera` per radiance arriving from
// `light` and unit solid angle, with the lobe's own cosine |light·n| included. Everything else follows from it: for
// Transport::radiance f_cos(wi, wo); for Transport::importance f_cos(wo, wi)·|wo·ng|/|wi·ng| (Veach 1997, eq. 5.19,
// with the swap of roles carrying the eta² of refraction), so both directions of transport agree by construction.
//
// Refraction carries the basic radiance L/n², as Cycles does: radiance is not divided by eta² on entering a medium.
// Closed objects look the same either way; an open pane of glass, which artists model often, does not darken what is
// behind it. The adjoint (importance) is scaled to match.
#pragma once

#include <cstdint>

#include "engine/base/vec.h"
#include "engine/shading/bsdf.h"

namespace lambent {

enum class LobeKind : uint8_t {
  diffuse,     ///< Lambert
  oren_nayar,  ///< Oren–Nayar as Cycles: `param` is sigma in [0, 1]; with energy_compensation f0 is its albedo
  principled_diffuse,  ///< Burley 2012 retro-reflective diffuse (Cycles before 4.0): `param` is roughness
  principled_sheen,    ///< Burley 2012 sheen (Cycles before 4.0)
  velvet,              ///< Ashikhmin & Premoze 2007 (Cycles before 4.0): `param` is sigma in [0.01, 1]
  sheen,               ///< Zeltner et al. 2022 (Cycles from 4.0): alpha_x is the roughness
  principled_retro,    ///< the retro-reflective part of principled_diffuse alone
  principled_exit,  ///< Lambert with the Fresnel factor of light that enters alone: where a principled subsurface walk
                    ///< ends
  subsurface,       ///< a random walk under the surface (subsurface.h): f0 its albedo, f90 the mean free path by
                    ///< channel, m (of a profile: its scale), `param` the anisotropy of scattering, alpha_x and eta
                    ///< those of refractive entry
  toon,             ///< a cone around the normal of equal brightness: `param` its half angle, `alpha_x` that of the
                    ///< fading rim, both in quarter turns
  rough_translucent,  ///< oren_nayar through the surface, towards the mirror image of where it would reflect
  translucent,        ///< Lambert through the surface
  transparent,        ///< straight on
  portal,             ///< on from elsewhere: `n` the direction there, `tangent` the place, both in world space
  glossy_toon,        ///< the same around the mirrored view
  hair_reflection,    ///< a cylinder along the tangent (Marschner et al. 2003, simplified): alpha_x along, alpha_y
                      ///< around, `param` the cuticle's tilt, radians
  hair_transmission,  ///< likewise through it
  ashikhmin_shirley,  ///< Ashikhmin & Shirley 2000 without their Fresnel term (Cycles before 4.0)
  hair_fibre,  ///< Chiang et al. 2016 (hair_fibre.h): n geometric, tangent along the fibre, alpha_x and alpha_y the
               ///< roughness along and around, `param` the cuticle's tilt, radians, f0 the absorption per radius,
               ///< f90.x what the primary reflection has of alpha_x, f90.y the index of refraction
  hair_microfacets,   ///< Huang et al. 2022 (hair_microfacet.h): n, tangent, `param` and f0 as hair_fibre; alpha_x the
                      ///< facets' slopes, alpha_y the cross-section's ratio of axes, f90 strengths of R, TT and TRT
  reflection,         ///< microfacet or mirror
  refraction,         ///< microfacet or smooth
  glass,              ///< reflection and refraction with the Fresnel term at the microfacet
  thin_transmission,  ///< a pane's blur: reflection that leaves on the other side, mirrored there; never a delta
};

/// Light goes on as it came, here or elsewhere.
inline bool goes_straight(LobeKind kind) { return kind == LobeKind::transparent || kind == LobeKind::portal; }

/// Hair whose frame is the fibre's: light comes and goes on all sides.
inline bool is_fibre(LobeKind kind) { return kind == LobeKind::hair_fibre || kind == LobeKind::hair_microfacets; }

/// Whether light passes through the surface by the lobe.
inline bool sends_through(LobeKind kind) {
  return kind == LobeKind::translucent || kind == LobeKind::rough_translucent || kind == LobeKind::hair_transmission ||
         kind == LobeKind::refraction || kind == LobeKind::glass || kind == LobeKind::thin_transmission ||
         is_fibre(kind);
}

/// Whether the lobe's value does not fall with the cosine of the light's direction.
inline bool lacks_cosine(LobeKind kind) {
  return kind == LobeKind::toon || kind == LobeKind::glossy_toon || kind == LobeKind::hair_reflection ||
         kind == LobeKind::hair_transmission || is_fibre(kind);
}

enum class Distribution : uint8_t { ggx, beckmann, gtr1 };

/// How a subsurface walk enters and what its radius means; the rules of the Cycles that has the method.
enum class SubsurfaceMethod : uint8_t {
  fixed_radius,  ///< 3.x RANDOM_WALK_FIXED_RADIUS: diffuse entry
  random_walk,   ///< 3.x RANDOM_WALK: diffuse entry; the radius is that of a diffusion profile
  refractive,    ///< 4.0 to 5.1 RANDOM_WALK, since then RANDOM_WALK_LEGACY: entry by rough refraction
  skin,          ///< RANDOM_WALK_SKIN: either entry; the radius as random_walk's
  burley,        ///< no walk: a diffusion profile around the entry (Christensen & Burley 2015)
  van_de_hulst,  ///< 5.2 and later RANDOM_WALK: entry by rough refraction; the radius is the mean free path itself
};

/// How diffuse lobes whose normal is not the surface's darken towards the smooth surface's terminator, which would else
/// cut them off hard.
enum class BumpShadowing : uint8_t {
  cubic,    ///< Chiang, Li & Burley 2019 (Cycles before 4.5)
  masking,  ///< Conty Estevez, Lecocq & Stein 2019: GGX's masking (Cycles from 4.5 on)
  none,
};

enum class FresnelMode : uint8_t {
  none,        ///< 1: the weight is the colour
  dielectric,  ///< dielectric at the microfacet
  schlick,     ///< f0 to f90 along the dielectric curve of `eta`, at the microfacet (both Principled generations)
  f82,         ///< metal: f0 and, in f90, the tint at 82° (Kutz et al. 2021)
  // Under a thin film (thin_film.h). Glass and schlick's curve, tints as without it
  film_dielectric,
  film_f82,
  film_conductor,  ///< f0: index of refraction, f90: extinction, by channel
};

/// One weighted lobe. Invariants: n unit; alpha in [0, 1]; eta > 0; all finite (Bsdf::add ensures them).
struct Lobe {
  Color weight{1.0f};
  Vec3 n{0, 0, 1};     ///< lobe normal in world space, on the side of the walk's `wi`; of diffuse lobes perhaps not
  Vec3 tangent{0.0f};  ///< world direction of alpha_x; zero: isotropic
  float alpha_x = 1.0f, alpha_y = 1.0f;   ///< microfacet slopes' scale; both below k_delta_alpha: delta
  float eta = 1.0f;                       ///< index beyond the surface over index on n's side
  float param = 0.0f;                     ///< see LobeKind
  float film_nm = 0.0f, film_eta = 1.0f;  ///< of FresnelMode::film_*: thickness, and index as eta's
  Color f0{1.0f}, f90{1.0f};              ///< see FresnelMode; glass: tints of its reflection and of its refraction
  LobeKind kind = LobeKind::diffuse;
  Distribution distribution = Distribution::ggx;
  FresnelMode fresnel = FresnelMode::none;
  /// Multiplies by the dielectric reflectance F (refraction: 1 − F) at the camera's angle to n, as Cycles before 4.0
  /// does for glass. Subsurface: its exit has the principled diffuse lobe's factor of the light
  /// (Cycles 3.4 leaves that of the view out).
  bool macro_fresnel = false;
  bool energy_compensation =
      false;  ///< restores what single scattering loses (multiscatter GGX, Oren–Nayar), tinted by f0
  /// Microfacets: masking and shadowing are correlated by height (Heitz 2014, eq. 99; Cycles from 3.5 on), else
  /// separable.
  bool correlated_masking = false;
  bool fitted_film = false;  ///< ThinFilm::fitted
  SubsurfaceMethod subsurface = SubsurfaceMethod::fixed_radius;
  bool diffuse_after_diffuse = false;  ///< subsurface: paths that met a diffuse surface before see a diffuse lobe
};

/// Below this alpha a microfacet lobe is a mirror (delta): roughness 0.01, where GGX's density passes 1e7 per steradian
/// and float directions no longer resolve the lobe. Cycles (3.4) uses the same threshold on alpha_x·alpha_y (1e-7 →
/// 3e-4).
inline constexpr float k_delta_alpha = 3.1622776e-4f;
/// Up to this (of the mean of alpha_x and alpha_y) lobes are LobeWidth::narrow.
inline constexpr float k_narrow_alpha = 0.3f;

}  // namespace lambent
