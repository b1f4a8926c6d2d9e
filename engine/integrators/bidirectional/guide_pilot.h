// Learns which light vertices are worth connecting to what the camera sees first, before the first sample.
#pragma once

#include "engine/base/cancel.h"
#include "engine/integrators/bidirectional/kernel.h"

namespace lambent::bidirectional {

struct LearnedGuide {
  ConnectionGuide guide;
  ConnectionPicks picks;  ///< that are worth their time
};

/// Connects what some camera rays meet first to vertices of some light walks, evenly chosen, and learns from what that
/// brings; then once more by what was learned, to see how much noise the choice of a vertex leaves. Depends on scene,
/// settings and region alone. Costs about a sample of small pictures, and a quarter of a second of one core of large
/// ones.
/// @param like what the walks of the integrator share
/// @return empty where nothing can be learned, and when cancelled
template <KernelProfile profile>
LearnedGuide learn_guide(const Scene& scene, const IntegratorSettings& settings, const Pass& like, Film& film,
                         const CancelFlag& cancel, RayCounts& counts);

}  // namespace lambent::bidirectional
