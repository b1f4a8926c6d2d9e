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

/// What part of the light along a pair of directions rays see that `hidden_from` (LightTraits) hides a light from: rays
/// are of the kind of the lobe that scattered them (bounces.h).
/// @param mesh meshes are met by rays of any kind that they are not hidden from, lamps by those of no hidden kind
inline float share_that_sees(const Bsdf& bsdf, const Vec3& wi_world, const Vec3& wo_world, uint32_t hidden_from,
                             bool mesh) {
  const EventShares shares = bsdf.event_shares(wi_world, wo_world);
  const auto seen = [&](uint32_t kinds) {
    const uint32_t hidden = hidden_from & kinds;
    return (mesh ? hidden == kinds : hidden != 0u) ? 0.0f : 1.0f;
  };
  return shares.diffuse * seen(k_ray_diffuse) + shares.glossy * seen(k_ray_glossy) +
         (shares.transmission - shares.diffuse_transmission) * seen(k_ray_transmission | k_ray_glossy) +
         shares.diffuse_transmission * seen(k_ray_transmission | k_ray_diffuse);
}

}  // namespace lambent
