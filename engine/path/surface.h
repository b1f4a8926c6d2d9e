// What all walks ask about a surface that they scatter at.
#pragma once

#include "engine/shading/bsdf_set.h"

namespace lambent {

/// Share of the samples, at what the camera sees directly, for each lobe (Cycles: defensive sampling, the same share).
inline constexpr float k_camera_least_share = 0.125f;

/// The normal that lights are chosen for (LightSet, "receivers"): the geometric one on wi's side, or zero if some lobe
/// sends light through the surface, so that lights on both sides matter.
inline Vec3 light_receiver_normal(const Bsdf& bsdf, const Vec3& ng_world) {
  for (const Lobe& lobe : bsdf.lobes())
    if (lobe.kind == LobeKind::translucent || lobe.kind == LobeKind::refraction || lobe.kind == LobeKind::glass)
      return Vec3(0.0f);
  return ng_world;
}

}  // namespace lambent
