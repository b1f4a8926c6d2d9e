// Learns where light walks are wanted, before the first sample.
#pragma once

#include "engine/base/cancel.h"
#include "engine/integrators/bidirectional/kernel.h"
#include "engine/lights/emission_aim.h"

namespace lambent::bidirectional {

/// What some rays, evenly over the picture, meet first. Those that meet nothing are left out.
std::vector<Vec3> points_seen(const Scene& scene);
/// Distance from the camera to these, m, in the median; 0 if there are none.
float typical_distance(const Scene& scene, std::span<const Vec3> points_world);

/// Traces some light walks and some camera walks, merges them, and aims emission at where those light walks first
/// arrived that bring a part of what pixels see which the camera's own techniques do not bring. Repeated, aimed by what
/// was learned, since without an aim hardly a walk may be seen at all; where the scene is far larger than what is seen,
/// suns and worlds are aimed at that to begin with. Depends on scene, settings and region alone.
/// @param set the integrator's techniques
/// @param footprint_m typical width of a pixel (typical_footprint); 0: the camera sees nothing
/// @return empty where walks are as well sent everywhere, and when cancelled
template <KernelProfile profile>
EmissionAim learn_aim(const Scene& scene, const IntegratorSettings& settings, const TechniqueSet& set, Film& film,
                      float footprint_m, const CancelFlag& cancel, RayCounts& counts);

}  // namespace lambent::bidirectional
