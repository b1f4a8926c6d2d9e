// What every integrator offers to the session: virtual calls happen once a tile, never per ray.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/cancel.h"
#include "engine/film/film.h"
#include "engine/integrators/passes.h"
#include "engine/path/contribution.h"
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

/// What one camera sample sees: premultiplied, exposure not applied.
struct PathEstimate {
  Color radiance{0.0f};
  float transparency = 0.0f;  ///< share of the sample that saw the (transparent) film behind the scene
  Color behind{0.0f};  ///< opaque film: the world that the sample saw through shadow catchers; no part of radiance
};

struct IntegratorSettings {
  uint32_t seed = 0;
  BounceLimits bounces;
  PixelFilter filter;
  bool film_transparent = false;
  /// Transparent film: transmission with an alpha up to this counts as a transparent surface, as in Cycles; below 0:
  /// none does. What other techniques than walks from the camera find through such glass, where it is rough, counts as
  /// ever.
  float see_through_alpha = -1.0f;
  float exposure = 1.0f;
  /// Shadow rays whose contribution, exposure included, would be below this are traced with the probability
  /// contribution / threshold, and weigh so much more: saves rays that hardly matter, without bias. 0: all are traced.
  float light_threshold = 0.0f;
  float clamp_direct = 0.0f, clamp_indirect = 0.0f;  ///< largest sum of R, G, B of a contribution; 0: no clamping
  bool caustics_reflective = true, caustics_refractive = true;
  // The bidirectional family's own.
  float merge_radius_px = 2.0f;   ///< radius of the first pass, in widths of a pixel at the first hit; 0: no merging
  float merge_alpha = 0.75f;      ///< radius of pass k: times k^((alpha - 1) / 2); 1: fixed
  int shared_light_paths = 16;    ///< VPL: light paths of a pass, which all pixels share
  float clamp_connection = 0.0f;  ///< VPL: largest sum of R, G, B that one connection adds; 0: no clamping
  std::shared_ptr<ContributionObserver> observer;  ///< null: nobody looks
  std::shared_ptr<const PassPlan> passes;          ///< null: the picture alone. The film has its channels
  std::shared_ptr<const PassPlan> parts;           ///< of another picture, `picture`: whose parts it has; null: none
  OtherPicture picture = OtherPicture::without_shadows;
  /// The scenes of the other pictures, by OtherPicture; null: no pass asks for it.
  std::array<std::shared_ptr<const Scene>, k_other_pictures> others;
  int threads = 0;  ///< for work between passes that the session does not hand out; 0: all
  /// The kernel to use; must cover the scene's profile. A test renders with both and compares.
  KernelProfile profile = KernelProfile::solid;
};

/// The camera sees a hole where the object stands: the film, whatever it is, or through a shadow catcher the world.
inline void see_hole(PathEstimate& estimate, const Scene& scene, const InstanceShading& object, bool film_transparent,
                     const Color& throughput, const Vec3& direction_world, const PathCounts& counts) {
  if (film_transparent || !object.shadow_catcher)
    estimate.transparency += average(throughput);
  else
    estimate.behind += throughput * scene.background_radiance(direction_world, counts);
}

/// Whether what is seen after the event counts as seen through a transparent surface: by the film and by passes.
inline bool counts_as_transparent(const IntegratorSettings& settings, const BsdfSample& scattered) {
  return (scattered.event & k_scatter_transmission) && !(scattered.event & k_scatter_diffuse) &&
         scattered.roughness <= settings.see_through_alpha;
}

/// A sample as the film takes it.
inline Vec4 picture_of(const PathEstimate& estimate, float exposure) {
  const Color radiance = estimate.radiance * exposure;
  return {radiance.x, radiance.y, radiance.z, 1.0f - estimate.transparency};
}

/// The settings with which a render's other pictures are made: without passes, those of catchers without the world.
std::array<IntegratorSettings, k_other_pictures> for_other_pictures(const IntegratorSettings& settings);

/// Renders one scene with one algorithm. render_tile and run_piece are called by several threads at the same time.
class Integrator {
 public:
  virtual ~Integrator() = default;
  /// To be called once, before anything else, with the film that the others will get.
  virtual void prepare(Film&) {}
  /// Adds samples to every active pixel of a tile until each has `target_samples`, or the flag is set (polled between
  /// pixels). A pixel that has some samples already continues with its next one.
  virtual RayCounts render_tile(Film& film, int tile, int64_t target_samples, const CancelFlag& cancel) = 0;

  /// Stages of work that come before the tiles of the pass that brings pixels to `sample` + 1 samples, one stage after
  /// the other, with nothing else running in between; such a pass is of one sample. 0: there are none, passes overlap.
  virtual int stages(int64_t sample) const { return 0; }
  /// Prepares a stage of the pass that brings pixels to `sample` + 1 samples. Returns its number of pieces. Short;
  /// called by one thread while nothing runs.
  virtual int begin_stage(Film& film, int64_t sample, int stage) { return 0; }
  virtual RayCounts run_piece(Film& film, int64_t sample, int stage, int piece, const CancelFlag& cancel) { return {}; }
};

/// Error: there is no integrator of that name.
Result<std::unique_ptr<Integrator>> make_integrator(const std::string& name, std::shared_ptr<const Scene> scene,
                                                    const IntegratorSettings& settings);
/// Names that make_integrator knows.
std::vector<std::string> integrator_names();
/// Says what of the scene's light an integrator cannot find: those whose light walks do it all lose lights that start
/// none and suns over scenes far larger than what is seen, and those without whole camera walks what scatters under
/// surfaces.
void report_lost_light(const std::string& name, const Scene& scene, Report& report);
/// Says where an integrator that merges cannot, because its radius is 0, or blurs all, because it exceeds the picture.
/// @param side_px the picture's larger side
void report_merge_radius(const std::string& name, float merge_radius_px, int side_px, Report& report);
/// PassSettings::first_light_tracing for that integrator.
int first_light_tracing(const std::string& name);

/// FilmSettings::splat_unit for that integrator and scene: 0 if it makes no splats.
double splat_unit(const std::string& name, const Scene& scene, float exposure);

}  // namespace lambent
