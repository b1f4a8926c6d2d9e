// The path tracer's kernel: the radiance of one camera sample. Compiled once for each KernelProfile,
// with and without passes.
#pragma once

#include "engine/integrators/integrator.h"
#include "engine/integrators/passes.h"
#include "engine/path/bounces.h"
#include "engine/path/linked_light.h"
#include "engine/path/mis.h"
#include "engine/path/surface.h"
#include "engine/path/transmittance.h"
#include "engine/sampling/event_numbers.h"

namespace lambent::path_tracer {

/// One walk from the camera. Lives on the stack of one sample.
/// @tparam recording there are passes
template <KernelProfile profile, bool recording>
class Kernel {
 public:
  /// @param passes null unless recording
  Kernel(const Scene& scene, const IntegratorSettings& settings, const Sampler& sampler, RayCounts& counts,
         PassRecorder* passes)
      : scene_(scene), settings_(settings), sampler_(sampler), counts_(counts), recorder_(passes) {
    if (settings.light_threshold > 0.0f)
      shadow_survival_scale_ = std::fabs(settings.exposure) / settings.light_threshold;
  }

  PathEstimate run(const CameraRay& camera_ray);

 private:
  static constexpr bool k_transparency = profile >= KernelProfile::surfaces;

  /// The vertex that the walk last scattered at: where emission that a ray meets is weighed against next event.
  struct LastScatter {
    Vec3 p_world{0.0f}, receiver_normal{0.0f};
    float pdf_solid_angle = 0.0f;
    bool weighed = false;  ///< next event could have found the same light: false at the camera and after delta lobes
    uint32_t instance = k_no_index;
  };

  BsdfEval eval(const Bsdf& bsdf, const Vec3& wi_world, const Vec3& wo_world, EvalParts& parts) const;
  BsdfSample sample(const Bsdf& bsdf, const Vec3& wi_world, const EventNumbers& numbers, EvalParts& parts) const;
  /// Adds what is left of a contribution after clamping, and returns it.
  Color add(const Color& contribution, bool indirect);
  void add_met(const Color& contribution, LightSource source, uint16_t group);
  float emission_weight(LightIndex light, const Vec3& direction, float distance, const Vec2& uv,
                        const LightTraits& traits) const;
  void add_lamps(const Ray& ray, float t_end);
  void add_background(const Vec3& direction);
  void add_surface_emission(const SurfaceHit& hit, const SurfaceBinding& binding, const Vec3& direction, float distance,
                            const Color& emission);
  void next_event(const ShadingPoint& point, const SurfaceHit& hit, const Bsdf& bsdf, const Vec3& receiver_normal,
                  const EventNumbers& numbers);
  void add_shadow_linked(const Ray& ray);
  /// Whether light that the ray meets counts there (light linking).
  bool meets(LinkSets linked) const {
    return meets_linked(scene_, linked, (bounces_.ray_kind & k_ray_camera) != 0, last_.instance);
  }
  Color visibility(const Ray& ray, uint8_t blockers);
  /// Null, known when compiling, unless recording.
  PassRecorder* passes() const {
    if constexpr (recording)
      return recorder_;
    else
      return nullptr;
  }
  PathCounts path_counts() const {
    return {bounces_.ray_kind, bounces_.total,        bounces_.diffuse,
            bounces_.glossy,   bounces_.transmission, bounces_.transparent};
  }

  const Scene& scene_;
  const IntegratorSettings& settings_;
  const Sampler& sampler_;
  RayCounts& counts_;
  PassRecorder* const recorder_;
  float shadow_survival_scale_ = k_infinity;  ///< times a contribution: probability of tracing its shadow ray
  PathEstimate estimate_;
  Color throughput_{1.0f};
  BounceState bounces_;
  LastScatter last_;
  float distance_before_ =
      0.0f;  ///< from the last scattering to the present ray's origin, through transparent surfaces
  bool only_transparent_ = true;  ///< nothing but transparent surfaces since the camera, or what counts as such
};

extern template class Kernel<KernelProfile::solid, false>;
extern template class Kernel<KernelProfile::solid, true>;
extern template class Kernel<KernelProfile::surfaces, false>;
extern template class Kernel<KernelProfile::surfaces, true>;

}  // namespace lambent::path_tracer
