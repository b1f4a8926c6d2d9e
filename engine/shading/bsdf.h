// The scattering functions of one surface point: a small set of weighted lobes, with densities in both directions.
//
// Convention (all lobes): directions are unit and point away from the surface. `wi` is where the walk came from, `wo`
// where it goes. With Transport::radiance the walk started at the camera (light flows from wo to wi); with
// Transport::importance it started at a light (light flows from wi to wo). f includes the adjoint corrections for that
// direction: the eta² of refraction (Veach 1997, ch. 5.2; lobe.h says which convention) and, for importance, the
// shading-normal factor |wi·ns||wo·ng| / (|wi·ng||wo·ns|) (Veach 1997, eq. 5.19). `cos` below is |wo·n| with the lobe's
// own normal n (a normal map may differ from ns).
#pragma once

#include <cstdint>

#include "engine/base/frame.h"
#include "engine/base/vec.h"

namespace lambent {

enum class Transport : uint8_t { radiance, importance };

/// What happened at a scattering event; bits combine (glossy | transmission).
enum ScatterEvent : uint8_t {
  k_scatter_none = 0,
  k_scatter_diffuse = 1,
  k_scatter_glossy = 2,
  k_scatter_transmission = 4,
  k_scatter_delta = 8,         ///< probability, not density
  k_scatter_transparent = 16,  ///< goes straight on: not counted as a bounce
  k_scatter_subsurface = 32,   ///< goes in, and on from where a walk under the surface comes out: no bounce by itself
  k_scatter_portal = 64,       ///< goes on from Lobe::tangent; comes with k_scatter_transparent, whose limit it shares
};

/// Value of all non-delta lobes for a pair of directions.
struct BsdfEval {
  Color f_cos{0.0f};                     ///< f(wi, wo) · |wo·ns|, all lobes
  float pdf_solid_angle = 0.0f;          ///< of sampling wo given wi
  float pdf_reverse_solid_angle = 0.0f;  ///< of sampling wi given wo, the walk reversed
};

struct BsdfSample {
  Vec3 wo_world{0.0f};                   ///< not set by subsurface lobes
  Color weight{0.0f};                    ///< f·cos/pdf, all lobes that share wo; for delta lobes f·cos/prob
  float pdf_solid_angle = 0.0f;          ///< for delta lobes the discrete probability
  float pdf_reverse_solid_angle = 0.0f;  ///< likewise, reversed
  uint8_t event = k_scatter_none;        ///< of the sampled lobe; k_scatter_none: absorbed, path ends
  float eta = 1.0f;                      ///< transmitted over incident index if transmitted, else 1
  float roughness = 1.0f;                ///< of the sampled lobe (alpha), for footprints
  int lobe = -1;                         ///< number of the sampled lobe in Bsdf::lobes()
};

/// Lobes by how narrow they are; deltas are none of them. Narrow: microfacets that next to only their own sampling
/// finds (lobe.h, is_narrow).
enum class LobeWidth : uint8_t { any, narrow, wide };

/// How the density of a pair of directions is shared by kinds of event: shares sum to 1, or are all 0.
struct EventShares {
  float diffuse = 0.0f, glossy = 0.0f, transmission = 0.0f;
  float diffuse_transmission = 0.0f;  ///< the part of transmission that translucent lobes have
};

/// Classes of lobes that passes keep apart, as Cycles does: translucent lobes count as diffuse.
enum class LobeClass : uint8_t { diffuse, glossy, transmission };
inline constexpr int k_lobe_classes = 3;

/// What part of f each class of lobes has, per colour channel, indexed by LobeClass. Sums to 1.
struct ClassShares {
  Color of[k_lobe_classes] = {Color(0.0f), Color(0.0f), Color(0.0f)};

  static ClassShares all_of(LobeClass one) {
    ClassShares result;
    result.of[static_cast<int>(one)] = Color(1.0f);
    return result;
  }
};

/// Albedo of each class of lobes, indexed by LobeClass.
struct ClassAlbedos {
  Color of[k_lobe_classes] = {Color(0.0f), Color(0.0f), Color(0.0f)};
};

inline constexpr int k_max_lobes = 12;

/// The lobes of one shading point: class Bsdf in bsdf_set.h; the kinds of lobe and their parameters: lobe.h.
/// Transparent closures are lobes too: sampled with event k_scatter_transparent | k_scatter_delta. Portals add
/// k_scatter_portal; light does not come back through them (reverse probability 0).
class Bsdf;

}  // namespace lambent
