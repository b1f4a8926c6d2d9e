// Subsurface scattering by a diffusion profile: where the light leaves is found by probing the surface around, as
// Cycles' Christensen-Burley method does. An alternative to the random walk for the same callers (subsurface_walk.h).
#pragma once

#include "engine/path/subsurface_walk.h"

namespace lambent {

/// As walk_subsurface, for lobes of SubsurfaceMethod::burley. False where the probe meets nothing of the object. Needs
/// no closed surface; thin parts let through what the profile gives at that distance.
/// Source: King et al. 2013, "BSSRDF Importance Sampling", with Cycles' weights: the power heuristic over the axes, and
/// the profile at the true distance over its density at the distance on the disk (so that the mean over a plane is 1).
bool probe_subsurface(const Scene& scene, const SurfaceHit& entry, const Lobe& lobe, const Vec3& wi_world,
                      const Sampler& sampler, uint32_t bounce, uint64_t& rays, SubsurfaceExit& exit);

}  // namespace lambent
