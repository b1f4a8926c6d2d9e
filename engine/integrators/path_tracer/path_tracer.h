// The path tracer: next-event estimation and emission hits, weighted by the power heuristic.
#pragma once

#include <memory>

#include "engine/integrators/integrator.h"

namespace lambent {

/// Path tracing (Kajiya 1986) with multiple importance sampling (Veach 1997). One camera path a sample; unbiased unless
/// a clamp is set.
std::unique_ptr<Integrator> make_path_tracer(std::shared_ptr<const Scene> scene, const IntegratorSettings& settings);

}  // namespace lambent
