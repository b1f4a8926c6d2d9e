// What every integrator offers to the session: virtual calls happen once a tile, never per ray.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/cancel.h"
#include "engine/film/film.h"
#include "engine/sampling/filter.h"
#include "engine/scene/scene.h"

namespace lambent {

/// What was traced; each worker counts its own and they are added up.
struct RayCounts {
  uint64_t rays = 0;   ///< intersection and occlusion queries
  uint64_t paths = 0;  ///< camera samples
  void operator+=(const RayCounts& other) {
    rays += other.rays;
    paths += other.paths;
  }
};

/// Blender's limits; how they count is in path/bounces.h.
struct BounceLimits {
  int total = 12, diffuse = 4, glossy = 4, transmission = 12, transparent = 8;
};

struct IntegratorSettings {
  uint32_t seed = 0;
  BounceLimits bounces;
  PixelFilter filter;
  bool film_transparent = false;
  float exposure = 1.0f;
  /// Shadow rays whose contribution, exposure included, would be below this are traced with the probability
  /// contribution / threshold, and weigh so much more: saves rays that hardly matter, without bias. 0: all are traced.
  float light_threshold = 0.0f;
  float clamp_direct = 0.0f, clamp_indirect = 0.0f;  ///< largest sum of R, G, B of a contribution; 0: no clamping
  bool caustics_reflective = true, caustics_refractive = true;
  /// The kernel to use; must cover the scene's profile. A test renders with both and compares.
  KernelProfile profile = KernelProfile::solid;
};

/// Renders one scene with one algorithm. Immutable; render_tile is called by several threads at the same time.
class Integrator {
 public:
  virtual ~Integrator() = default;
  /// Adds samples to every active pixel of a tile until each has `target_samples`, or the flag is set (polled between
  /// pixels). A pixel that has some samples already continues with its next one.
  virtual RayCounts render_tile(Film& film, int tile, int64_t target_samples, const CancelFlag& cancel) const = 0;
};

/// Error: there is no integrator of that name.
Result<std::unique_ptr<Integrator>> make_integrator(const std::string& name, std::shared_ptr<const Scene> scene,
                                                    const IntegratorSettings& settings);
/// Names that make_integrator knows.
std::vector<std::string> integrator_names();

}  // namespace lambent
