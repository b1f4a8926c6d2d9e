// What all walks ask about a surface that they scatter at.
#pragma once

#include "engine/shading/bsdf_set.h"

namespace lambent {

/// Share of the samples, at what the camera sees directly, for each lobe (Cycles: defensive sampling, the same share).
inline constexpr float k_camera_least_share = 0.125f;

/// Where rays go on that a portal's lobe sends away.
inline const Vec3& portal_exit(const Lobe& lobe) { return lobe.tangent; }
/// The place that a ray from `p_world`, the portal's, starts from: its exit, unless that is the same place (Cycles'
/// number).
inline Vec3 start_beyond_portal(const Lobe& lobe, const Vec3& p_world, const Vec3& start_at_surface) {
  constexpr float k_least_distance_squared_m2 = 1e-9f;
  return length_squared(portal_exit(lobe) - p_world) > k_least_distance_squared_m2 ? portal_exit(lobe)
                                                                                   : start_at_surface;
}

/// The normal that lights are chosen for (LightSet, "receivers"): the geometric one on wi's side, or zero if some lobe
/// sends light through the surface, so that lights on both sides matter.
inline Vec3 light_receiver_normal(const Bsdf& bsdf, const Vec3& ng_world) {
  for (const Lobe& lobe : bsdf.lobes())
    if (sends_through(lobe.kind)) return Vec3(0.0f);
  return ng_world;
}

/// The kind of event that a pair of directions counts as where several kinds of lobe meet: one of them, chosen by u in
/// [0, 1) and what each has of the density. What sampled the direction does not matter: sampling picks one lobe and
/// evaluates all.
inline uint8_t event_by_share(const EventShares& shares, float u) {
  if ((u -= shares.diffuse) < 0.0f) return k_scatter_diffuse;
  if ((u -= shares.diffuse_transmission) < 0.0f) return k_scatter_diffuse | k_scatter_transmission;
  if ((u -= shares.glossy) < 0.0f) return k_scatter_glossy;
  return shares.transmission > 0.0f ? k_scatter_glossy | k_scatter_transmission : k_scatter_glossy;
}

inline uint8_t event_by_share(const Bsdf& bsdf, const Vec3& wi_world, const Vec3& wo_world, float u) {
  return event_by_share(bsdf.event_shares(wi_world, wo_world), u);
}

/// What part of the light along a pair of directions rays see that `hidden_from` (LightTraits) hides a light from: rays
/// are of the kind of the lobe that scattered them (bounces.h).
/// @param mesh meshes are met by rays of any kind that they are not hidden from, lamps by those of no hidden kind
/// @param width of the lobes that are asked for
inline float share_that_sees(const Bsdf& bsdf, const Vec3& wi_world, const Vec3& wo_world, uint32_t hidden_from,
                             bool mesh, LobeWidth width = LobeWidth::any) {
  const EventShares shares = bsdf.event_shares(wi_world, wo_world, width);
  const auto seen = [&](uint32_t kinds) {
    const uint32_t hidden = hidden_from & kinds;
    return (mesh ? hidden == kinds : hidden != 0u) ? 0.0f : 1.0f;
  };
  return shares.diffuse * seen(k_ray_diffuse) + shares.glossy * seen(k_ray_glossy) +
         (shares.transmission - shares.diffuse_transmission) * seen(k_ray_transmission | k_ray_glossy) +
         shares.diffuse_transmission * seen(k_ray_transmission | k_ray_diffuse);
}

}  // namespace lambent
