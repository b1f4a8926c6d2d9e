// What one path adds to the picture, with everything that passes may ask about the path.
#pragma once

#include "engine/lights/light.h"
#include "engine/path/event_counts.h"
#include "engine/path/technique.h"

namespace lambent {

/// The same whatever the technique and the integrator.
struct Contribution {
  Vec2 raster_px{0.0f, 0.0f};  ///< on the full frame; of camera walks the centre of their pixel
  /// Unweighted; what a sample of the pixel gets, exposure not applied. Light tracing: what one light walk a pixel
  /// gives per px².
  Color value{0.0f};
  float weight = 1.0f;
  Technique technique = Technique::emission_hit;
  int vertices = 0;         ///< n of technique.h
  int camera_vertices = 0;  ///< of them made by the camera walk (merging: i)
  /// Events at x_1 ... x_n. Where walks were joined all lobes were evaluated together: the kind is then the likeliest.
  EventSequence events;
  LightIndex light = k_no_light;  ///< k_no_light also for emission that is never sampled
  uint32_t first_instance = ~0u;  ///< of x_1; ~0 if the camera sees the light directly
};

/// Sees every contribution before it is summed. Called by several threads.
class ContributionObserver {
 public:
  virtual ~ContributionObserver() = default;
  virtual void on_contribution(const Contribution& contribution) = 0;
};

}  // namespace lambent
