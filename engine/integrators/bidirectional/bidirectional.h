// LT, VPL, BPT, PPM, BPM and VCM: one kernel with different sets of techniques.
#pragma once

#include <memory>
#include <string_view>

#include "engine/integrators/integrator.h"
#include "engine/path/technique.h"

namespace lambent {

struct NamedTechniques {
  const char* name;
  TechniqueSet set;
};
inline constexpr NamedTechniques k_bidirectional[] = {
    {"LT", k_techniques_lt},   {"VPL", k_techniques_vpl}, {"BPT", k_techniques_bpt},
    {"PPM", k_techniques_ppm}, {"BPM", k_techniques_bpm}, {"VCM", k_techniques_vcm},
};

/// Null if there is no such integrator in the family.
inline const TechniqueSet* find_techniques(std::string_view name) {
  for (const NamedTechniques& named : k_bidirectional)
    if (name == named.name) return &named.set;
  return nullptr;
}

/// Light tracing (Arvo 1986), instant radiosity (Keller 1997), bidirectional path tracing (Veach & Guibas 1994),
/// progressive photon mapping (Hachisuka et al. 2008, in the stochastic form of Knaus & Zwicker 2011) and vertex
/// connection and merging (Georgiev et al. 2012), by their techniques. What a set cannot find is missing from its
/// picture: LT what the camera sees through delta surfaces, VPL caustics; merging blurs by a radius that shrinks.
std::unique_ptr<Integrator> make_bidirectional(std::shared_ptr<const Scene> scene, const IntegratorSettings& settings,
                                               const TechniqueSet& set);

}  // namespace lambent
