#include "engine/integrators/path_tracer/kernel.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/path/roulette.h"
#include "engine/path/subsurface_walk.h"
#include "engine/scene/shadow_ray.h"

namespace lambent::path_tracer {

namespace {

constexpr EvenWorld k_even_world = EvenWorld::left_to_scattering;

/// Walks of this throughput and more play no roulette: the first bounces bring much of most pictures, and the noise of
/// ending them costs more than tracing them.
constexpr float k_safe_throughput = 0.4f;

}  // namespace

template <KernelProfile profile, bool recording>
Color Kernel<profile, recording>::add(const Color& contribution, bool indirect) {
  const float limit = indirect ? settings_.clamp_indirect : settings_.clamp_direct;
  Color added = contribution;
  if (limit > 0.0f) {
    const float sum = std::fabs(contribution.x) + std::fabs(contribution.y) + std::fabs(contribution.z);
    if (sum > limit) added = contribution * (limit / sum);
  }
  estimate_.radiance += added;
  return added;
}

/// @param parts as they begin; set where passes have a use for them
template <KernelProfile profile, bool recording>
BsdfEval Kernel<profile, recording>::eval(const Bsdf& bsdf, const Vec3& wi_world, const Vec3& wo_world,
                                          EvalParts& parts) const {
  if constexpr (recording)
    if (passes()->wants_eval_parts(bsdf))
      return bsdf.eval(wi_world, wo_world, Transport::radiance, ReversePdf::no, parts);
  return bsdf.eval(wi_world, wo_world, Transport::radiance, ReversePdf::no);
}

template <KernelProfile profile, bool recording>
BsdfSample Kernel<profile, recording>::sample(const Bsdf& bsdf, const Vec3& wi_world, const EventNumbers& numbers,
                                              EvalParts& parts) const {
  if constexpr (recording) {
    parts.clear();
    if (passes()->wants_sample_parts(bsdf))
      return bsdf.sample(wi_world, numbers.lobe, numbers.direction, Transport::radiance, ReversePdf::no, parts);
  }
  return bsdf.sample(wi_world, numbers.lobe, numbers.direction, Transport::radiance, ReversePdf::no);
}

/// Light that the walk met.
template <KernelProfile profile, bool recording>
void Kernel<profile, recording>::add_met(const Color& contribution, LightSource source, uint16_t group) {
  const Color added = add(contribution, bounces_.total > 1);
  if constexpr (recording) {
    passes()->met(added, source, group);
    if (passes()->following()) passes()->follow_light(contribution);
  }
}

/// MIS weight of meeting a light by scattering.
template <KernelProfile profile, bool recording>
float Kernel<profile, recording>::emission_weight(LightIndex light, const Vec3& direction, float distance,
                                                  const Vec2& uv, const LightTraits& traits) const {
  if (!last_.weighed) return 1.0f;
  if (!traits.hit_by_rays) return 0.0f;  // found by next event alone
  const float pdf_next_event =
      scene_.lights().pdf_solid_angle(last_.p_world, last_.receiver_normal, light, direction, distance, uv,
                                      scene_.light_choices(last_.instance, k_even_world));
  return power_heuristic(last_.pdf_solid_angle, pdf_next_event);
}

/// Lamps in front of what the ray met: they shine and let the ray through.
template <KernelProfile profile, bool recording>
void Kernel<profile, recording>::add_lamps(const Ray& ray, float t_end) {
  const LightSet& lights = scene_.lights();
  if (!lights.has_visible_lamps()) return;
  // Lamps that face their receiver turn to the last scattering vertex, from which distances are counted too.
  const Vec3 origin = distance_before_ > 0.0f && last_.pdf_solid_angle > 0.0f ? last_.p_world : ray.origin;
  const float before = origin == ray.origin ? 0.0f : distance_before_;
  lights.for_each_lamp(
      origin, ray.direction, before + ray.t_min, before + t_end, bounces_.ray_kind, [&](const LightHit& hit) {
        if (bounces_.total - 1 > hit.traits->max_bounces || !meets(hit.traits->linked)) return;
        const float weight = emission_weight(hit.light, ray.direction, hit.distance_m, hit.uv, *hit.traits);
        if (weight > 0.0f)
          add_met(throughput_ * scene_.light_radiance(hit, path_counts()) * weight, LightSource::lamp,
                  hit.traits->group);
      });
}

template <KernelProfile profile, bool recording>
void Kernel<profile, recording>::add_background(const Vec3& direction) {
  if (recording && only_transparent_) passes()->missed(direction);
  if (settings_.film_transparent && only_transparent_) {
    estimate_.transparency += average(throughput_);
    if (PassRecorder* const p = passes()) p->see_through(direction, throughput_, path_counts());
    return;
  }
  scene_.lights().for_each_infinite(direction, bounces_.ray_kind, [&](const LightHit& hit) {
    // As in Cycles, suns with shadow linking are not even seen by the camera.
    const bool counts =
        bounces_.total - 1 <= hit.traits->max_bounces && hit.traits->linked.blockers == 0 && meets(hit.traits->linked);
    const float weight = counts ? emission_weight(hit.light, direction, k_infinity, hit.uv, *hit.traits) : 0.0f;
    if (!(weight > 0.0f) && !(recording && passes()->waits_for_world())) return;
    const Color radiance = throughput_ * scene_.light_radiance(hit, path_counts());
    const LightSource source = scene_.source_of(hit.light);
    if constexpr (recording)
      if (passes()->waits_for_world() && source == LightSource::background)
        passes()->met_world(radiance, weight > 0.0f);
    if (weight > 0.0f) add_met(radiance * weight, source, hit.traits->group);
  });
}

template <KernelProfile profile, bool recording>
void Kernel<profile, recording>::add_surface_emission(const SurfaceHit& hit, const SurfaceBinding& binding,
                                                      const Vec3& direction, float distance, const Color& emission) {
  if (is_black(emission) || !meets(scene_.emission_links(hit.instance))) return;
  float weight = 1.0f;
  if (last_.weighed && binding.samples_emission) {
    const LightIndex light = scene_.light_at(hit);
    if (light != k_no_light)
      weight = emission_weight(light, direction, distance, hit.barycentric, scene_.lights().traits(light));
  }
  add_met(throughput_ * emission * weight, LightSource::surface, scene_.instance(hit.instance).light_group);
}

/// What the scattered ray meets of lights with shadow linking.
template <KernelProfile profile, bool recording>
void Kernel<profile, recording>::add_shadow_linked(const Ray& ray) {
  for_each_shadow_linked(scene_, ray, last_.instance, path_counts(), [&](const LinkedLightPoint& met) {
    float weight = 1.0f;
    if (met.traits) {
      if (bounces_.total - 1 > met.traits->max_bounces) return;
      weight = emission_weight(met.light, ray.direction, met.distance_m, met.uv, *met.traits);
    }
    if (!(weight > 0.0f)) return;
    const Color seen = throughput_ * met.radiance * visibility(met.shadow, met.linked.blockers);
    if (!is_black(seen)) add_met(seen * weight, met.source, met.group);
  });
}

template <KernelProfile profile, bool recording>
Color Kernel<profile, recording>::visibility(const Ray& ray, uint8_t blockers) {
  ++counts_.rays;
  PathCounts counts = path_counts();
  counts.ray_kind = k_ray_shadow;
  ++counts.depth;
  return segment_transmittance<k_transparency>(scene_, ray, counts, settings_.bounces.transparent, nullptr, blockers);
}

template <KernelProfile profile, bool recording>
void Kernel<profile, recording>::next_event(const ShadingPoint& point, const SurfaceHit& hit, const Bsdf& bsdf,
                                            const Vec3& receiver_normal, const EventNumbers& numbers) {
  const LightSet& lights = scene_.lights();
  const LightSample light =
      lights.sample(hit.p_world, receiver_normal, numbers.light, scene_.light_choices(hit.instance, k_even_world));
  if (!light || !(light.pdf_solid_angle > 0.0f) || bounces_.total > light.traits->max_bounces ||
      !scene_.reaches(light.traits->linked.receivers, hit.instance))
    return;
  [[maybe_unused]] EvalParts parts;
  BsdfEval scattered = eval(bsdf, point.wi_world, light.direction_world, parts);
  if (light.traits->hidden_from & k_visible_scattered)
    scattered.f_cos *= share_that_sees(bsdf, point.wi_world, light.direction_world, light.traits->hidden_from,
                                       lights.kind(light.light) == LightKind::triangle);
  if (is_black(scattered.f_cos)) return;
  PathCounts seen_as = path_counts();
  ++seen_as.depth;  // as a ray that goes on from here
  const Color radiance = scene_.sample_radiance(light, seen_as);
  const bool hit_by_rays = !light.is_delta && light.traits->hit_by_rays;
  const float weight = hit_by_rays ? power_heuristic(light.pdf_solid_angle, scattered.pdf_solid_angle) : 1.0f;
  const Color arriving = throughput_ * scattered.f_cos * radiance;
  std::optional<Color> seen_through;  // the shadow ray's answer, once known
  if constexpr (recording)
    if (passes()->receiving()) {
      Color unshadowed = arriving * (1.0f / light.pdf_solid_angle);
      if (is_black(unshadowed)) return;
      if (light.traits->shadows) {
        // It survives whenever the contribution does, which is as much or less.
        const float survival = max_component(abs(unshadowed)) * shadow_survival_scale_;
        if (numbers.shadow_roulette >= survival) return;
        if (survival < 1.0f) unshadowed /= survival;
      }
      seen_through = light.traits->shadows ? visibility(shadow_ray(scene_, hit, light), light.traits->linked.blockers)
                                           : Color(1.0f);
      passes()->received(unshadowed * *seen_through, unshadowed);
    }
  Color contribution = arriving * (weight / light.pdf_solid_angle);
  if (is_black(contribution)) return;
  if (light.traits->shadows) {
    const float survival = max_component(abs(contribution)) * shadow_survival_scale_;
    if (survival < 1.0f) {
      if (numbers.shadow_roulette >= survival) return;
      contribution /= survival;
    }
    contribution *=
        seen_through ? *seen_through : visibility(shadow_ray(scene_, hit, light), light.traits->linked.blockers);
  }
  const Color added = add(contribution, bounces_.total > 0);
  if constexpr (recording)
    if (!is_black(added))
      passes()->lit(added, hit.instance, bsdf, point.wi_world, light.direction_world, scene_.source_of(light.light),
                    light.traits->group, parts);
}

template <KernelProfile profile, bool recording>
PathEstimate Kernel<profile, recording>::run(const CameraRay& camera_ray) {
  ++counts_.paths;
  Ray ray{camera_ray.origin, camera_ray.t_min, camera_ray.direction, camera_ray.t_max, k_visible_camera};
  RayCone cone{camera_ray.width_m, camera_ray.spread};
  last_.p_world = camera_ray.origin;
  ShadingPoint point;
  Bsdf bsdf;
  Roulette roulette;
  for (uint32_t event_index = 0;; ++event_index) {
    Hit geometry_hit;
    ++counts_.rays;
    const bool found = scene_.geometry().intersect(ray, geometry_hit);
    add_lamps(ray, found ? geometry_hit.t : ray.t_max);
    if (!found) {
      if (recording && passes()->waits_for_ray()) passes()->next_ray(k_infinity, nullptr);
      add_background(ray.direction);
      break;
    }
    if (recording && passes()->meets_world()) passes()->hide_world(ray.direction, throughput_, path_counts());
    SurfaceHit hit = scene_.geometry().surface(geometry_hit);
    const SurfaceBinding& binding = scene_.binding(hit.instance, hit.material_slot);
    const Program& program = *binding.program;
    if (recording && passes()->waits_for_ray()) passes()->next_ray(geometry_hit.t, &program);
    const float distance = distance_before_ + geometry_hit.t;
    if (roulette.lost && !program.traits().emits) break;
    scene_.fill_shading_point(hit, binding, -ray.direction, geometry_hit.t, cone, path_counts(), point);

    BsdfSample scattered;
    [[maybe_unused]] EvalParts parts;  // of `scattered`
    float u_roulette = -1.0f;          // none: a path that ends with the next light plays no roulette on its way there
    if (bounces_.last || roulette.lost) {
      if (program.traits().emits)
        add_surface_emission(hit, binding, ray.direction, distance, program.emission(point, scene_.textures()));
      if (roulette.lost || !k_transparency || !program.traits().may_be_transparent) break;
      throughput_ /= roulette.survival;
      scattered.weight = program.transparency(point, scene_.textures());
      scattered.wo_world = ray.direction;
      scattered.event = k_scatter_transparent | k_scatter_delta;
    } else {
      if (recording && only_transparent_ && passes()->evaluates(program))
        passes()->evaluate(program, point, bsdf);
      else
        program.evaluate(point, scene_.textures(), bsdf);
      if (bounces_.ray_kind & k_ray_diffuse)
        bsdf.drop_glossy(!settings_.caustics_reflective, !settings_.caustics_refractive);
      if (program.traits().subsurface && bounces_.diffuse > 0) bsdf.drop_subsurface_after_diffuse();
      if (only_transparent_) {
        if (const InstanceShading& seen = scene_.instance(hit.instance); seen.holdout) {
          see_hole(estimate_, scene_, seen, settings_.film_transparent, throughput_, ray.direction, path_counts());
          break;
        }
        if (program.traits().holdout) estimate_.transparency += average(throughput_ * bsdf.holdout());
        if (PassRecorder* const p = passes()) p->visible(hit, binding, point, bsdf, throughput_);
      }
      // What the camera sees directly: no lobe may be so rare that it shows as dots.
      if (bounces_.ray_kind & k_ray_camera) bsdf.set_least_share(k_camera_least_share);
      if (program.traits().emits) add_surface_emission(hit, binding, ray.direction, distance, bsdf.emission());
      if (recording && passes()->following())
        passes()->follow(point, bsdf, throughput_, geometry_hit.t - ray.t_min, roulette.survival);
      if (bsdf.empty()) break;
      throughput_ /= roulette.survival;
      const EventNumbers numbers(sampler_, event_index);
      const Vec3 receiver_normal = light_receiver_normal(bsdf, point.ng_world);
      if (bsdf.has_non_delta() && !scene_.lights().empty(k_even_world))
        next_event(point, hit, bsdf, receiver_normal, numbers);
      scattered = sample(bsdf, point.wi_world, numbers, parts);
      if (recording && only_transparent_) passes()->sampled(hit, point, bsdf, scattered, parts.picked);
      if (recording && passes()->following()) passes()->followed(scattered, bsdf, throughput_);
      u_roulette = numbers.roulette;
      if (scattered.event == k_scatter_none) break;
      Vec3 scattered_normal = receiver_normal;
      if (scattered.event & k_scatter_subsurface) {
        // On from where the walk under the surface comes out: the next event, by the exit's lobe.
        const Lobe entered = bsdf.lobes()[static_cast<size_t>(scattered.lobe)];
        SubsurfaceExit exit;
        if (!walk_subsurface(scene_, hit, entered, point.wi_world, sampler_, event_index, counts_.rays, exit)) break;
        throughput_ *= scattered.weight * exit.weight;
        hit = exit.surface;
        fill_subsurface_exit(scene_, exit, entered, cone, path_counts(), point, bsdf);
        const EventNumbers exit_numbers(sampler_, ++event_index);
        if constexpr (recording) passes()->pass_under();
        scattered_normal = point.ng_world;
        if (!scene_.lights().empty(k_even_world)) next_event(point, hit, bsdf, scattered_normal, exit_numbers);
        scattered = sample(bsdf, point.wi_world, exit_numbers, parts);
        if (scattered.event == k_scatter_none) break;
        u_roulette = exit_numbers.roulette;
      }
      if (scattered.event & k_scatter_portal) {
        // What comes next is met by this ray alone: from here no light is looked for.
        const Vec3& exit = portal_exit(bsdf.lobes()[static_cast<size_t>(scattered.lobe)]);
        last_ = {exit, scattered.wo_world, scattered.pdf_solid_angle, false, hit.instance};
      } else if (!(scattered.event & k_scatter_transparent)) {
        last_ = {hit.p_world, scattered_normal, scattered.pdf_solid_angle, !(scattered.event & k_scatter_delta),
                 hit.instance};
        only_transparent_ = only_transparent_ && counts_as_transparent(settings_, scattered);
        if (recording && !only_transparent_) passes()->scattered(hit.instance, bsdf, point.wi_world, scattered, &parts);
      }
    }
    throughput_ *= scattered.weight;
    if (is_black(throughput_)) break;

    if (!bounces_.advance(scattered.event, settings_.bounces)) break;
    if constexpr (recording)
      if (!(scattered.event & k_scatter_transparent)) passes()->leave(scattered);
    if (scattered.event & k_scatter_transparent) {
      distance_before_ = scattered.event & k_scatter_portal ? 0.0f : distance;
    } else {
      distance_before_ = 0.0f;
    }

    // Going straight on through a transparent surface is no bounce to play for.
    roulette = {};
    if (event_index > 0 && u_roulette >= 0.0f && !(scattered.event & k_scatter_transparent)) {
      roulette = Roulette(throughput_, u_roulette, k_safe_throughput);
      if (roulette.lost && !scene_.rays_meet_light()) {
        if (recording && passes()->meets_world()) passes()->hide_world(scattered.wo_world, throughput_, path_counts());
        break;
      }
    }

    const float t_max = bounces_.ray_kind & k_ray_camera ? ray.t_max - geometry_hit.t : k_infinity;
    cone.width_m += cone.spread * geometry_hit.t;
    ray =
        ray_from_surface(hit.p_world, hit.p_error, hit.ng_world, scattered.wo_world, bounces_.ray_kind & k_visible_all);
    ray.t_max = t_max;
    if (scattered.event & k_scatter_portal) {
      ray.t_max = k_infinity;
      ray.origin = start_beyond_portal(bsdf.lobes()[static_cast<size_t>(scattered.lobe)], hit.p_world, ray.origin);
    }
    if (scene_.profile().shadow_linking && !(scattered.event & k_scatter_transparent)) add_shadow_linked(ray);
  }
  return estimate_;
}

template class Kernel<KernelProfile::solid, false>;
template class Kernel<KernelProfile::solid, true>;
template class Kernel<KernelProfile::surfaces, false>;
template class Kernel<KernelProfile::surfaces, true>;

}  // namespace lambent::path_tracer
