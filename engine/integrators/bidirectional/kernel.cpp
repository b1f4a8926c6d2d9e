#include "engine/integrators/bidirectional/kernel.h"

#include <algorithm>
#include <cmath>

#include "engine/path/mis.h"
#include "engine/path/roulette.h"
#include "engine/path/subsurface_walk.h"
#include "engine/path/surface.h"
#include "engine/path/transmittance.h"

namespace lambent::bidirectional {

namespace {

constexpr float k_tan_one_degree = 0.017455065f;

}  // namespace

LightWalkSettings walk_settings(const IntegratorSettings& settings, const Pass& pass) {
  const BounceLimits& limits = settings.bounces;
  return {pass.counts.max_light_vertices,
          limits.total,
          limits.diffuse,
          limits.glossy,
          limits.transmission,
          limits.transparent,
          settings.caustics_reflective,
          settings.caustics_refractive,
          even_world(pass.set),
          pass.aim,
          pass.set.weighted() && pass.set.next_event,
          settings.passes && settings.passes->wants_events()};
}

template <KernelProfile profile>
Kernel<profile>::Kernel(const Scene& scene, const IntegratorSettings& settings, const Pass& pass, Film& film, int plane)
    : scene_(scene),
      settings_(settings),
      pass_(pass),
      at_gloss_(pass.set.at_gloss()),
      film_(film),
      plane_(plane),
      walk_(scene, walk_settings(settings, pass)) {
  if (settings_.passes) passes_.emplace(*settings_.passes, scene);
  if (settings_.passes && pass_.set.camera_scatters && pass_.set.next_event && pass_.set.emission) passes_->share();
  if (settings_.parts) passes_.emplace(*settings_.parts, scene, settings_.picture);
  if (settings.light_threshold > 0.0f) threshold_scale_ = std::fabs(settings.exposure) / settings.light_threshold;
}

// --- What techniques share -----------------------------------------------------------------------------------------

template <KernelProfile profile>
MergeReach Kernel<profile>::reach_at(const Vec3& p_first_hit) const {
  MergeReach reach;
  if (!pass_.set.merging) return reach;
  const float radius = std::min(pass_.radius_scale * scene_.footprint_at(p_first_hit).width_m, pass_.radius_limit_m);
  reach.area = k_pi * radius * radius;
  if (pass_.correlation_aware) {
    const float accepted = k_tan_one_degree * length(p_first_hit - scene_.camera().origin());
    reach.acceptance_area = k_pi * accepted * accepted;
  }
  return reach;
}

template <KernelProfile profile>
uint8_t Kernel<profile>::likeliest_event(const Bsdf& bsdf, const Vec3& wi, const Vec3& wo) {
  const EventShares shares = bsdf.event_shares(wi, wo);
  if (shares.transmission > shares.diffuse + shares.glossy) return k_scatter_glossy | k_scatter_transmission;
  return shares.glossy > shares.diffuse ? k_scatter_glossy : k_scatter_diffuse;
}

template <KernelProfile profile>
Color Kernel<profile>::add(const Color& contribution, Technique technique, float weight, LightIndex light,
                           bool indirect) {
  if (settings_.observer) {
    const bool joined = technique == Technique::connection || technique == Technique::merging;
    settings_.observer->on_contribution({{static_cast<float>(pixel_x_) + 0.5f, static_cast<float>(pixel_y_) + 0.5f},
                                         contribution,
                                         weight,
                                         technique,
                                         pdfs_.n,
                                         joined ? m_ + 1 : pdfs_.n,
                                         events_,
                                         light,
                                         first_instance_});
  }
  Color weighted = contribution * weight;
  const float limit = indirect ? settings_.clamp_indirect : settings_.clamp_direct;
  if (limit > 0.0f) {
    const float sum = std::fabs(weighted.x) + std::fabs(weighted.y) + std::fabs(weighted.z);
    if (sum > limit) weighted *= limit / sum;
  }
  estimate_.radiance += weighted;
  return weighted;
}

/// Light that the camera walk met.
template <KernelProfile profile>
void Kernel<profile>::add_met(const Color& contribution, float weight, LightIndex light, LightSource source,
                              uint16_t group) {
  const Color added = add(contribution, Technique::emission_hit, weight, light, bounces_.total > 1);
  if (passes_) passes_->met(added, source, group);
}

template <KernelProfile profile>
Color Kernel<profile>::visibility(const Ray& ray, uint32_t ray_kind, int transparent_before, bool* depended,
                                  uint8_t blockers) {
  ++counts_.rays;
  PathCounts counts = path_counts();
  counts.ray_kind = ray_kind;
  if (ray_kind != k_ray_camera) ++counts.depth;
  counts.transparent = transparent_before;
  return segment_transmittance<k_transparency>(scene_, ray, counts, settings_.bounces.transparent, depended, blockers);
}

template <KernelProfile profile>
void Kernel<profile>::append_light(PathPdfs& pdfs, int index, const LightWalk& walk, const LightVertex& vertex,
                                   const LightScatter& scatter) const {
  const int depth = vertex.depth;
  const LightWalkPdfs& walked = walk.pdfs();
  pdfs.n = index + depth - 1;
  pdfs.light[index] = vertex.own_area;
  constexpr uint8_t k_light = k_light_arrives | k_light_scatters;
  pdfs.flags[index] = k_connectible | k_light;
  int place = vertex.place;
  for (int d = depth - 1, i = index + 1; d >= 1; --d, ++i) {
    if (pass_.guided()) {
      pdfs.connections[i - 1] = later_connections(place, walked.place[d]);
      place = walked.place[d];
    }
    pdfs.light[i] = walked.own[d];
    pdfs.camera[i] = walked.other[d];
    pdfs.flags[i] = static_cast<uint8_t>((walked.connectible[d] ? k_connectible : 0) | k_light);
  }
  if (depth > 1) pdfs.camera[index + 1] = scatter.to_light * vertex.previous_per_solid_angle;
  pdfs.next_event = depth > 1 ? walked.next_event : vertex.next_event;
  pdfs.scatter = !walk.can_be_hit() ? 0.0f : depth > 1 ? walked.other[0] : scatter.to_light;
  pdfs.light_conditional = depth > 1 ? walked.conditional : vertex.conditional;
}

// --- Emission that the camera walk meets ---------------------------------------------------------------------------

template <KernelProfile profile>
float Kernel<profile>::emission_weight(LightIndex light, const Vec3& n_light, const Vec3& direction, float distance,
                                       const Vec2& uv, const LightTraits& traits) {
  pdfs_.n = m_;
  if (m_ == 0) return 1.0f;
  if (!finds_emission()) return 0.0f;
  if (!pass_.set.emission && gloss_ == 0) return 1.0f;
  if (!traits.hit_by_rays && last_.connectible) return 0.0f;  // found by next event alone
  pdfs_.scatter = last_.pdf_solid_angle;
  pdfs_.next_event = last_.connectible ? scene_.lights().pdf_solid_angle(
                                             last_.p_world, last_.receiver_normal, light, direction, distance, uv,
                                             scene_.light_choices(last_.instance, even_world(pass_.set)))
                                       : 0.0f;
  const float cosine = std::fabs(dot(last_.ng_world, direction));
  pdfs_.light[m_] = depended_ || !(pdfs_.flags[m_] & k_light_begins)
                        ? 0.0f
                        : cosine * light_walk_density(scene_.lights(), pass_.aim, light, n_light, last_.p_world,
                                                      -direction, distance, &pdfs_.light_conditional);
  pdfs_.light_conditional *= cosine;
  return weigh(pdfs_, Technique::emission_hit, m_, reach_, gloss_ > 0 ? LobeWidth::narrow : LobeWidth::any);
}

/// What denoisers are given to see has the weights of the path tracer's rays, so that it is the same in all
/// integrators.
template <KernelProfile profile>
float Kernel<profile>::follow_weight(LightIndex light, const Vec3& direction, float distance, const Vec2& uv,
                                     const LightTraits& traits) const {
  if (!last_.connectible) return 1.0f;
  if (!traits.hit_by_rays) return 0.0f;
  return power_heuristic(
      last_.pdf_solid_angle,
      scene_.lights().pdf_solid_angle(last_.p_world, last_.receiver_normal, light, direction, distance, uv,
                                      scene_.light_choices(last_.instance, EvenWorld::left_to_scattering)));
}

/// Lamps in front of what the ray met: they shine and let the ray through.
template <KernelProfile profile>
void Kernel<profile>::add_lamps(const Ray& ray, float t_end) {
  const LightSet& lights = scene_.lights();
  if (!lights.has_visible_lamps() || !(finds_emission() || following())) return;
  // Lamps that face their receiver turn to the last scattering vertex, from which distances are counted too.
  const Vec3 origin = distance_before_ > 0.0f && m_ > 0 ? last_.p_world : ray.origin;
  const float before = origin == ray.origin ? 0.0f : distance_before_;
  lights.for_each_lamp(
      origin, ray.direction, before + ray.t_min, before + t_end, bounces_.ray_kind, [&](const LightHit& hit) {
        if (bounces_.total - 1 > hit.traits->max_bounces || !meets(hit.traits->linked)) return;
        const float weight =
            emission_weight(hit.light, hit.n_light_world, ray.direction, hit.distance_m, hit.uv, *hit.traits);
        if (!(weight > 0.0f) && !following()) return;
        const Color radiance = throughput_ * scene_.light_radiance(hit, path_counts());
        if (following())
          passes_->follow_light(radiance *
                                follow_weight(hit.light, ray.direction, hit.distance_m, hit.uv, *hit.traits));
        if (weight > 0.0f) add_met(radiance, weight, hit.light, LightSource::lamp, hit.traits->group);
      });
}

template <KernelProfile profile>
void Kernel<profile>::add_background(const Vec3& direction) {
  if (passes_ && only_transparent_) passes_->missed(direction);
  if (settings_.film_transparent && only_transparent_) {
    estimate_.transparency += average(throughput_);
    if (passes_) passes_->see_through(direction, throughput_, path_counts());
    return;
  }
  if (!(finds_emission() || following())) return;
  scene_.lights().for_each_infinite(direction, bounces_.ray_kind, [&](const LightHit& hit) {
    // As in Cycles, suns with shadow linking are not even seen by the camera.
    const bool counts =
        bounces_.total - 1 <= hit.traits->max_bounces && hit.traits->linked.blockers == 0 && meets(hit.traits->linked);
    const bool received = passes_ && passes_->waits_for_world();
    if (!counts && !received) return;
    const float weight =
        counts ? emission_weight(hit.light, hit.n_light_world, direction, k_infinity, hit.uv, *hit.traits) : 0.0f;
    if (!(weight > 0.0f) && !received && !following()) return;
    const Color radiance = throughput_ * scene_.light_radiance(hit, path_counts());
    const LightSource source = scene_.source_of(hit.light);
    if (following() && counts)
      passes_->follow_light(radiance * follow_weight(hit.light, direction, k_infinity, hit.uv, *hit.traits));
    if (received && source == LightSource::background) passes_->met_world(radiance, counts);
    if (weight > 0.0f) add_met(radiance, weight, hit.light, source, hit.traits->group);
  });
}

template <KernelProfile profile>
void Kernel<profile>::add_surface_emission(const SurfaceHit& hit, const SurfaceBinding& binding, const Vec3& direction,
                                           float distance, const Color& emission) {
  if (is_black(emission) || !meets(scene_.emission_links(hit.instance))) return;
  if (!(finds_emission() || following())) return;
  pdfs_.n = m_;
  float weight = finds_emission() ? 1.0f : 0.0f;
  float followed = 1.0f;
  LightIndex light = k_no_light;
  if (m_ > 0 && binding.samples_emission) {
    light = scene_.light_at(hit);
    if (following() && light != k_no_light)
      followed = follow_weight(light, direction, distance, hit.barycentric, scene_.lights().traits(light));
    const Vec3 n_light = dot(hit.ng_world, direction) > 0.0f ? -hit.ng_world : hit.ng_world;
    if (light != k_no_light)
      weight = emission_weight(light, n_light, direction, distance, hit.barycentric, scene_.lights().traits(light));
  }
  if (following()) passes_->follow_light(throughput_ * emission * followed);
  if (weight > 0.0f)
    add_met(throughput_ * emission, weight, light, LightSource::surface, scene_.instance(hit.instance).light_group);
}

/// What the scattered ray meets of lights with shadow linking.
template <KernelProfile profile>
void Kernel<profile>::add_shadow_linked(const Ray& ray) {
  if (!(finds_emission() || following())) return;
  for_each_shadow_linked(scene_, ray, last_.instance, path_counts(), [&](const LinkedLightPoint& met) {
    if (met.traits && bounces_.total - 1 > met.traits->max_bounces) return;
    bool depended = false;
    const Color seen = throughput_ * met.radiance *
                       visibility(met.shadow, k_ray_shadow, bounces_.transparent, &depended, met.linked.blockers);
    if (is_black(seen)) return;
    pdfs_.n = m_;
    float weight = finds_emission() ? 1.0f : 0.0f;
    if (following())
      passes_->follow_light(
          seen * (met.traits ? follow_weight(met.light, ray.direction, met.distance_m, met.uv, *met.traits) : 1.0f));
    if (met.traits) {
      depended_ = depended;
      weight = emission_weight(met.light, met.n_light_world, ray.direction, met.distance_m, met.uv, *met.traits);
      depended_ = false;
    }
    if (weight > 0.0f) add_met(seen, weight, met.light, met.source, met.group);
  });
}

// --- The camera walk -----------------------------------------------------------------------------------------------

template <KernelProfile profile>
PathEstimate Kernel<profile>::camera_sample(const Sampler& sampler, const CameraRay& camera_ray, int x, int y) {
  ++counts_.paths;
  estimate_ = {};
  throughput_ = Color(1.0f);
  bounces_ = {};
  last_ = {};
  reach_ = {};
  m_ = 0;
  pixel_x_ = x;
  pixel_y_ = y;
  first_instance_ = ~0u;
  events_ = {};
  distance_before_ = 0.0f;
  depended_ = false;
  only_transparent_ = only_sharp_ = true;
  gloss_ = 0;
  follows_alone_ = false;
  pdfs_.n = 0;
  first_ = region_ = 0;
  last_.p_world = camera_ray.origin;
  Ray ray{camera_ray.origin, camera_ray.t_min, camera_ray.direction, camera_ray.t_max, k_visible_camera};
  RayCone cone{camera_ray.width_m, camera_ray.spread};
  ShadingPoint point;
  point.time = camera_ray.time;
  Bsdf bsdf;
  Roulette roulette;
  for (uint32_t event_index = 0;; ++event_index) {
    Hit geometry_hit;
    ++counts_.rays;
    const bool found = scene_.geometry().intersect(ray, geometry_hit);
    add_lamps(ray, found ? geometry_hit.t : ray.t_max);
    if (!found) {
      if (passes_ && passes_->waits_for_ray()) passes_->next_ray(k_infinity, nullptr);
      add_background(ray.direction);
      break;
    }
    SurfaceHit hit = scene_.geometry().surface(geometry_hit);
    const SurfaceBinding& binding = scene_.binding(hit.instance, hit.material_slot);
    const Program& program = *binding.program;
    if (passes_) {
      if (passes_->meets_world()) passes_->hide_world(ray.direction, throughput_, path_counts());
      if (passes_->waits_for_ray()) passes_->next_ray(geometry_hit.t, &program);
    }
    const float distance = distance_before_ + geometry_hit.t;
    if (roulette.lost && !program.traits().emits) break;
    scene_.fill_shading_point(hit, binding, -ray.direction, geometry_hit.t, cone, path_counts(), point);

    BsdfSample scattered;
    float u_roulette = -1.0f;  // none: a path that ends with the next light plays no roulette on its way there
    if (bounces_.last || roulette.lost) {
      if (program.traits().emits)
        add_surface_emission(hit, binding, ray.direction, distance, program.emission(point, scene_.textures()));
      if (roulette.lost || !k_transparency || !program.traits().may_be_transparent) break;
      throughput_ /= roulette.survival;
      scattered.weight = program.transparency(point, scene_.textures());
      scattered.wo_world = ray.direction;
      scattered.event = k_scatter_transparent | k_scatter_delta;
    } else {
      if (passes_ && only_transparent_ && passes_->evaluates(program))
        passes_->evaluate(program, point, bsdf);
      else
        program.evaluate(point, scene_.textures(), bsdf);
      uint8_t light_flags = light_walk_flags(scene_, hit, program);
      if (caustics_drop_lobes(bsdf, settings_)) {
        light_flags &= static_cast<uint8_t>(~k_light_scatters);
        if (bounces_.ray_kind & k_ray_diffuse)
          bsdf.drop_glossy(!settings_.caustics_reflective, !settings_.caustics_refractive);
      }
      if (program.traits().subsurface && bsdf.has_subsurface_after_diffuse()) {
        light_flags &= static_cast<uint8_t>(~k_light_scatters);
        if (bounces_.diffuse > 0) bsdf.drop_subsurface_after_diffuse();
      }
      if (only_transparent_) {
        if (const InstanceShading& seen = scene_.instance(hit.instance); seen.holdout) {
          see_hole(estimate_, scene_, seen, settings_.film_transparent, throughput_, ray.direction, path_counts());
          break;
        }
        if (program.traits().holdout) estimate_.transparency += average(throughput_ * bsdf.holdout());
        if (passes_) passes_->visible(hit, binding, point, bsdf, throughput_);
      }
      if (m_ == 0) {
        bsdf.set_least_share(k_camera_least_share);
        first_instance_ = hit.instance;
      }
      if (program.traits().emits) add_surface_emission(hit, binding, ray.direction, distance, bsdf.emission());
      if (following()) passes_->follow(point, bsdf, throughput_, geometry_hit.t - ray.t_min, roulette.survival);
      if (bsdf.empty()) break;
      throughput_ /= roulette.survival;
      const EventNumbers numbers(sampler, event_index);

      const int i = m_ + 1;
      const float cosine = std::fabs(dot(point.ng_world, ray.direction));
      const float per_area = inverse_square(distance);
      pdfs_.reserve(i + 1);
      if (m_ == 0) {
        pdfs_.camera[i] = cosine * scene_.camera().connect(hit.p_world, camera_ray.origin).importance_px2_per_m2;
        reach_ = reach_at(hit.p_world);
      } else {
        pdfs_.camera[i] = last_.pdf_solid_angle * cosine * per_area;
      }
      pdfs_.flags[i] = k_connectible | light_flags;
      const float to_previous = m_ > 0 && !depended_ ? std::fabs(dot(last_.ng_world, ray.direction)) * per_area : 0.0f;
      const Vec3 normal = light_receiver_normal(bsdf, point.ng_world);
      bool gloss = pass_.set.passes_gloss && !follows_alone_ && bsdf.has_narrow();
      // Light that comes straight to narrow lobes here is none that came so to those before.
      if (gloss && gloss_ > 0) pdfs_.flags[gloss_] &= static_cast<uint8_t>(~k_connectible);
      const Here here{point, hit, bsdf, normal, i, to_previous, place(hit), gloss, numbers};
      if (!follows_alone_) join(here, sampler, event_index);
      scattered = sample(bsdf, point.wi_world, numbers);
      if (passes_ && only_transparent_) passes_->sampled(hit, point, bsdf, scattered, parts_.picked);
      if (following()) passes_->followed(scattered, bsdf, throughput_);
      u_roulette = numbers.roulette;
      if (scattered.event == k_scatter_none || (follows_alone_ && !following())) break;
      Vec3 receiver_normal = normal;
      float previous_per_solid_angle = to_previous;
      int here_place = here.place;
      if (scattered.event & k_scatter_subsurface) {
        // On from where the walk under the surface comes out: vertex x_i in place of this one (subsurface_walk.h).
        const Lobe entered = bsdf.lobes()[static_cast<size_t>(scattered.lobe)];
        SubsurfaceExit exit;
        if (!walk_subsurface(scene_, hit, entered, point.wi_world, sampler, event_index, counts_.rays, exit)) break;
        throughput_ *= scattered.weight * exit.weight;
        hit = exit.surface;
        fill_subsurface_exit(scene_, exit, entered, cone, path_counts(), point, bsdf);
        const EventNumbers exit_numbers(sampler, ++event_index);
        const SurfaceBinding& exit_binding = scene_.binding(hit.instance, hit.material_slot);
        light_flags = static_cast<uint8_t>(light_walk_flags(scene_, hit, *exit_binding.program) & ~k_light_scatters);
        pdfs_.flags[i] = k_connectible | light_flags;
        // A density of the walk's order; only weights that light walks beyond it share depend on it.
        if (m_ > 0) pdfs_.camera[i] = 1.0f / (4.0f * k_pi * exit.spread_m * exit.spread_m);
        receiver_normal = point.ng_world;
        previous_per_solid_angle = 0.0f;
        if (passes_) passes_->pass_under();
        here_place = place(hit);
        gloss = false;
        const Here there{point,      hit,   bsdf,        receiver_normal, i, previous_per_solid_angle,
                         here_place, gloss, exit_numbers};
        join(there, sampler, event_index);
        scattered = sample(bsdf, point.wi_world, exit_numbers);
        u_roulette = exit_numbers.roulette;
        if (scattered.event == k_scatter_none) break;
      }
      if (scattered.event & k_scatter_portal) {
        // A vertex that only camera walks have: light arrives at none, and none comes here from the next.
        const Vec3& exit = portal_exit(bsdf.lobes()[static_cast<size_t>(scattered.lobe)]);
        if (i > 1) pdfs_.light[i - 1] = 0.0f;
        pdfs_.flags[i] = 0;
        events_.append(k_scatter_glossy | k_scatter_transmission | k_scatter_delta);
        m_ = i;
        last_ = {exit,  scattered.wo_world, scattered.wo_world, scattered.pdf_solid_angle,
                 false, hit.instance,       here_place};
      } else if (!(scattered.event & k_scatter_transparent)) {
        const bool delta = scattered.event & k_scatter_delta;
        const bool narrow = gloss && !delta && keep_width(bsdf, point.wi_world, scattered) == LobeWidth::narrow;
        if (!pass_.set.camera_scatters && !delta && !narrow && !follow_alone(u_roulette)) break;
        if (narrow) gloss_ = i;
        if (delta && gloss_ > 0) pdfs_.flags[gloss_] |= k_connectible;
        if (i > 1) {
          pdfs_.light[i - 1] = scattered.pdf_reverse_solid_angle * previous_per_solid_angle;
          if (delta && program.traits().view_dependent && (pass_.set.weighted() || gloss_ > 0) &&
              !walk_.has_delta_lobe(hit, binding, scattered.wo_world,
                                    bsdf.lobes()[static_cast<size_t>(scattered.lobe)].kind, scratch_))
            pdfs_.light[i - 1] = 0.0f;
        }
        pdfs_.flags[i] = static_cast<uint8_t>((delta ? 0 : k_connectible) | light_flags);
        events_.append(scattered.event);
        only_transparent_ = only_transparent_ && counts_as_transparent(settings_, scattered);
        if (passes_ && !only_transparent_ && !follows_alone_)
          passes_->scattered(hit.instance, bsdf, point.wi_world, scattered, &parts_);
        m_ = i;
        only_sharp_ = only_sharp_ && (delta || narrow);
        last_ = {hit.p_world, point.ng_world, receiver_normal, scattered.pdf_solid_angle,
                 !delta,      hit.instance,   here_place};
      }
    }
    throughput_ *= scattered.weight;
    if (is_black(throughput_)) break;

    if (!bounces_.advance(scattered.event, settings_.bounces)) break;
    if (passes_ && !(scattered.event & k_scatter_transparent)) passes_->leave(scattered);
    if (scattered.event & k_scatter_portal) {
      distance_before_ = 0.0f;
      depended_ = true;  // as if the way to the next vertex depended on the camera's: no light walk has it
    } else if (scattered.event & k_scatter_transparent) {
      distance_before_ = distance;
      depended_ = depended_ || program.traits().path_dependent;
    } else {
      distance_before_ = 0.0f;
      depended_ = false;
    }

    roulette = {};
    if (event_index > 0 && u_roulette >= 0.0f && !only_transparent_) {
      roulette = Roulette(throughput_, u_roulette);
      if (roulette.lost && !(finds_emission() && scene_.rays_meet_light())) {
        if (passes_ && passes_->meets_world()) passes_->hide_world(scattered.wo_world, throughput_, path_counts());
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

template class Kernel<KernelProfile::solid>;
template class Kernel<KernelProfile::surfaces>;

}  // namespace lambent::bidirectional
