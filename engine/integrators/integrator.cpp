#include "engine/integrators/integrator.h"

#include "engine/integrators/path_tracer/path_tracer.h"

namespace lambent {

std::vector<std::string> integrator_names() { return {"PT"}; }

Result<std::unique_ptr<Integrator>> make_integrator(const std::string& name, std::shared_ptr<const Scene> scene,
                                                    const IntegratorSettings& settings) {
  if (name == "PT") return make_path_tracer(std::move(scene), settings);
  return Error{"There is no integrator '" + name + "' in this version; it offers PT"};
}

}  // namespace lambent
