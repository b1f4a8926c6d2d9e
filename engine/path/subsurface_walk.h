// A random walk under a surface, from where a camera walk enters an object to where it leaves it; or, for the method
// that asks for it, a probe of the surface around by a diffusion profile (subsurface_probe.h).
//
// Camera walks alone take it: light walks end where it begins. So it is no vertex of a path: the vertex is where it
// leaves, which scatters by a diffuse lobe, and which light walks reach (next event, connections, photons) but do not
// go on from.
#pragma once

#include "engine/sampling/sampler.h"
#include "engine/scene/scene.h"
#include "engine/shading/bsdf_set.h"

namespace lambent {

/// Where a walk leaves the object.
struct SubsurfaceExit {
  SurfaceHit surface;
  Vec3 direction_world{0.0f};  ///< unit, of its last step: out of the object
  Color weight{0.0f};          ///< of the walk; the lobe's weight (with the surface's albedo) comes before it
  float spread_m = 0.0f;       ///< how far from the entry walks typically leave
};

/// Walks through the entry's object alone: other objects inside it do not exist for it. Absorbed (false) where the walk
/// is lost: 256 events, or a surface that is not closed.
/// Source: Chiang, Kutz & Burley 2016 with the guided sampling of Krivanek & d'Eon 2014 and Meng, Hanika & Dachsbacher
/// 2016 ("Improving the Dwivedi Sampling Scheme").
/// @param lobe LobeKind::subsurface, of the entry
/// @param wi_world unit, where the walk comes from
/// @param bounce number of the event, for the sampler
/// @param rays counts them
bool walk_subsurface(const Scene& scene, const SurfaceHit& entry, const Lobe& lobe, const Vec3& wi_world,
                     const Sampler& sampler, uint32_t bounce, uint64_t& rays, SubsurfaceExit& exit);

/// The point and the lobe that scatters there: diffuse, with the entry lobe's rules, the same for any wi_world.
/// @param counts of the path, for programs that ask
void fill_subsurface_exit(const Scene& scene, const SubsurfaceExit& exit, const Lobe& lobe, const RayCone& cone,
                          const PathCounts& counts, ShadingPoint& point, Bsdf& bsdf);

}  // namespace lambent
