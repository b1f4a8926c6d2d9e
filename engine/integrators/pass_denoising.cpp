// What denoisers are to see: the first surface, and through mirrors, glass and what is transparent those behind it.
//
// As Cycles (kernel/film/denoising_passes.h), but for what it leaves to chance: what lies behind counts by the walk's
// throughput alone, so that neither how lobes are chosen nor roulette changes what the passes converge to, and light
// counts by the throughput once. The light of lamps is what the path tracer's own rays find of it, in every integrator:
// in gloss the rest would be noise.
#include "engine/integrators/passes.h"

namespace lambent {

void PassRecorder::follow(const ShadingPoint& point, const Bsdf& bsdf, const Color& throughput, float segment_m,
                          float sampled) {
  const PassPlan::DataSlots& slots = plan_.data_slots_;
  stands_for_ /= sampled;
  const Color seen = throughput * (shown_ / sampled);
  if (slots.denoising_depth >= 0) values_[slots.denoising_depth] += average(seen) * segment_m;
  // The commonest surfaces, where one lobe is all that is shown.
  if (bsdf.lobes().size() == 1 &&
      (bsdf.lobes()[0].kind == LobeKind::diffuse || sharpness(bsdf.lobes()[0], slots.sharp_rule) == 0.0f)) {
    following_ = false;
    if (slots.denoising_albedo >= 0) add_to(slots.denoising_albedo, seen * bsdf.albedo(point.wi_world));
    if (slots.denoising_normal >= 0)
      add_to(slots.denoising_normal, scene_.view().camera_from_world.vector(bsdf.lobes()[0].n) *
                                         (slots.sharp_rule == SharpRule::blended ? average(seen) : stands_for_));
    return;
  }
  features_ = surface_features(bsdf, point, slots.sharp_rule);
  add_if(slots.denoising_albedo, seen * features_.albedo * features_.shown);
  if (slots.denoising_normal >= 0 && features_.shown > 0.0f) {
    const float weight = slots.sharp_rule == SharpRule::blended ? average(seen) * features_.opaque * features_.shown
                                                                : stands_for_;  // every sample that got here alike
    add_to(slots.denoising_normal, scene_.view().camera_from_world.vector(features_.normal_world) * weight);
  }
  if (bsdf.empty() || (slots.sharp_rule == SharpRule::at_once && features_.shown > 0.0f)) following_ = false;
}

void PassRecorder::followed(const BsdfSample& sample, const Bsdf& bsdf, const Color& throughput) {
  if (sample.event == k_scatter_none) return;
  const PassPlan::DataSlots& slots = plan_.data_slots_;
  const Lobe& lobe = bsdf.lobes()[static_cast<size_t>(sample.lobe)];
  const float sharp = sharpness(lobe, slots.sharp_rule);
  if (!(sample.event & k_scatter_transparent)) shown_ *= sharp * (1.0f - features_.shown);
  following_ = shown_ > 0.0f;
  if (following_ || slots.sharp_rule == SharpRule::blended) return;
  // What little of the surface is not sharp: here it is what the sample sees.
  add_if(slots.denoising_albedo, throughput * sample.weight);
  if (slots.denoising_normal >= 0)
    add_to(slots.denoising_normal, scene_.view().camera_from_world.vector(features_.normal_world) * stands_for_);
}

}  // namespace lambent
