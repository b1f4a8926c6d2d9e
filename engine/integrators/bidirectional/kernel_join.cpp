// The kernel's techniques at a vertex of the camera walk: next event, connections and merging.
#include <algorithm>
#include <cmath>

#include "engine/integrators/bidirectional/grazing_reach.h"
#include "engine/integrators/bidirectional/joined_limits.h"
#include "engine/integrators/bidirectional/kernel.h"
#include "engine/path/surface.h"
#include "engine/scene/shadow_ray.h"

namespace lambent::bidirectional {

namespace {

/// Photons that one query looks at; where more lie around, a part stands for all.
constexpr size_t k_most_photons = 2048;
/// Photons on surfaces turned away further than this (cosine) lie around an edge or behind a thin wall.
constexpr float k_least_normal_agreement = 0.4f;

/// What a ray scattered by these lobes counts as, for the surfaces in its way.
uint32_t scattered_kind(const Bsdf& bsdf) {
  for (const Lobe& lobe : bsdf.lobes())
    if (lobe.kind <= LobeKind::translucent) return k_ray_diffuse;
  return k_ray_glossy;
}

}  // namespace

template <KernelProfile profile>
void Kernel<profile>::note_place(const Here& here) {
  if (!pass_.guided()) {
    if (only_sharp_) first_ = here.i;
    return;
  }
  if (here.i > 1)
    pdfs_.connections[here.i - 1] = only_sharp_            ? 1.0f  // that vertex does not connect
                                    : here.i - 1 == first_ ? connections(true, region_, here.place)
                                                           : later_connections(last_.place, here.place);
  if (!only_sharp_) return;
  first_ = here.i;
  region_ = pass_.guide->region_at(here.hit);
}

template <KernelProfile profile>
void Kernel<profile>::join(const Here& here, const Sampler& sampler, uint32_t event_index) {
  note_place(here);
  if (!here.bsdf.has_non_delta()) return;
  if (pass_.set.next_event && !scene_.lights().empty(even_world(pass_.set))) next_event(here);
  if (pass_.set.connections) {
    if (pass_.pool && pass_.pool->picks(here.i == first_) > 0)
      connect_to_pool(here, sampler, event_index);
    else
      connect(here, walk_, 1.0f);
  }
  if (pass_.set.shared_lights)
    for (const LightWalk* walk : pass_.shared_lights)
      connect(here, *walk, 1.0f / static_cast<float>(pass_.shared_lights.size()));
  if (pass_.set.merging && here.i >= pass_.set.first_merge_camera && pass_.photons) merge(here, sampler, event_index);
}

template <KernelProfile profile>
void Kernel<profile>::next_event(const Here& here) {
  const LightSet& lights = scene_.lights();
  const LightSample light = lights.sample(here.hit.p_world, here.receiver_normal, here.numbers.light,
                                          scene_.light_choices(here.hit.instance, even_world(pass_.set)));
  if (!light || !(light.pdf_solid_angle > 0.0f) || bounces_.total > light.traits->max_bounces ||
      !scene_.reaches(light.traits->linked.receivers, here.hit.instance))
    return;
  Chosen chosen{light, std::nullopt};
  next_event(here, chosen, here.joined());
  if (here.gloss) next_event(here, chosen, LobeWidth::narrow);
}

/// By the lobes of one width.
template <KernelProfile profile>
void Kernel<profile>::next_event(const Here& here, Chosen& chosen, LobeWidth width) {
  const LightSet& lights = scene_.lights();
  const LightSample& light = chosen.light;
  BsdfEval scattered = eval(here.bsdf, here.point.wi_world, light.direction_world, width);
  if (light.traits->hidden_from & k_visible_scattered)
    scattered.f_cos *= share_that_sees(here.bsdf, here.point.wi_world, light.direction_world, light.traits->hidden_from,
                                       lights.kind(light.light) == LightKind::triangle, width);
  if (is_black(scattered.f_cos)) return;
  PathCounts seen_as = path_counts();
  ++seen_as.depth;  // as a ray that goes on from here
  const Color radiance = scene_.sample_radiance(light, seen_as);
  Color contribution = throughput_ * scattered.f_cos * radiance * (1.0f / light.pdf_solid_angle);
  if (is_black(contribution)) return;
  const auto seen = [&] {
    if (!chosen.seen_through)
      chosen.seen_through = visibility(shadow_ray(scene_, here.hit, light), k_ray_shadow, bounces_.transparent,
                                       &chosen.depended, light.traits->linked.blockers);
    return *chosen.seen_through;
  };
  if (passes_ && passes_->receiving())
    passes_->received(light.traits->shadows ? contribution * seen() : contribution, contribution);

  if (light.traits->shadows && loses_at_any_weight(contribution, here.numbers.shadow_roulette)) return;

  const bool can_be_hit = !light.is_delta && light.traits->hit_by_rays;
  const bool triangle = lights.kind(light.light) == LightKind::triangle;
  const Vec3 n_light =
      triangle && dot(light.n_light_world, light.direction_world) > 0.0f ? -light.n_light_world : light.n_light_world;
  float weight = 1.0f;
  if (weighted(width)) {
    pdfs_.n = here.i;
    set_scatter(here, scattered);
    pdfs_.next_event = light.pdf_solid_angle;
    pdfs_.scatter = can_be_hit ? scattered.pdf_solid_angle : 0.0f;
    // Where camera walks cannot scatter (below the facet, above the smooth surface) light walks do not either.
    const float cosine =
        scattered.pdf_solid_angle > 0.0f ? std::fabs(dot(here.point.ng_world, light.direction_world)) : 0.0f;
    pdfs_.light[here.i] =
        !(pdfs_.flags[here.i] & k_light_begins)
            ? 0.0f
            : cosine * light_walk_density(lights, pass_.aim, light.light, n_light, here.hit.p_world,
                                          -light.direction_world, light.distance_m, &pdfs_.light_conditional);
    pdfs_.light_conditional *= cosine;
    weight = weigh(pdfs_, Technique::next_event, here.i, reach_, width);
  }
  if (!(weight > 0.0f)) return;
  if (light.traits->shadows) {
    const float survival = max_component(abs(contribution)) * weight * threshold_scale_;
    if (survival < 1.0f) {
      if (here.numbers.shadow_roulette >= survival) return;
      contribution /= survival;
    }
    contribution *= seen();
    if (is_black(contribution)) return;
    if (chosen.depended && weighted(width)) {
      pdfs_.light[here.i] = 0.0f;
      weight = weigh(pdfs_, Technique::next_event, here.i, reach_, width);
    }
  }
  pdfs_.n = here.i;
  const EventSequence walked = events_;
  if (settings_.observer) events_.append(likeliest_event(here.bsdf, here.point.wi_world, light.direction_world));
  const Color added = add(contribution, Technique::next_event, weight, light.light, bounces_.total > 0);
  events_ = walked;
  if (passes_)
    passes_->lit(added, here.hit.instance, here.bsdf, here.point.wi_world, light.direction_world,
                 scene_.source_of(light.light), light.traits->group, parts_);
}

template <KernelProfile profile>
void Kernel<profile>::connect(const Here& here, const LightWalk& walk, float scale) {
  for (int v = 0; v < walk.size(); ++v) {
    // One number for all: which rays are left out need not be independent.
    const float u = here.numbers.shadow_roulette + static_cast<float>(v) * k_golden;
    connect(here, walk, walk[v], scale, u - std::floor(u));
  }
}

template <KernelProfile profile>
void Kernel<profile>::connect_to_pool(const Here& here, const Sampler& sampler, uint32_t event_index) {
  const VertexPool& pool = *pass_.pool;
  const bool first = here.i == first_;
  const int picks = pool.picks(first);
  const int region = pass_.guide && !first ? pass_.guide->later_region(here.place) : region_;
  if (connected_) connected_->from.push_back({here.hit.p_world, here.hit.ng_world, first, {}});
  float u = sampler.get_1d(bounce_dimension(event_index, k_dimension_connection));
  float u_roulette = here.numbers.shadow_roulette;
  for (int k = 0; k < picks; ++k) {
    const VertexPool::Pick pick = pool.pick(region, u, picks);
    const VertexPool::Vertex& picked = pool[pick.number];
    const Color added = connect(here, *picked.walk, *picked, pick.scale, u_roulette);
    if (connected_)
      connected_->from.back().brought.emplace_back(static_cast<uint32_t>(pick.number), luminance(abs(added)));
    u += k_golden;
    u -= std::floor(u);
    u_roulette += k_golden;
    u_roulette -= std::floor(u_roulette);
  }
}

template <KernelProfile profile>
Color Kernel<profile>::connect(const Here& here, const LightWalk& walk, const LightVertex& vertex, float scale,
                               float u_roulette) {
  const EventCounts before = counts();
  if (!vertex.bsdf.has_non_delta()) return Color(0.0f);
  const int n = here.i + vertex.depth;
  if (n - 1 > settings_.bounces.total || n - 1 > walk.traits().max_bounces) return Color(0.0f);
  const int counted_at_light = vertex.depth >= 2 ? 1 : 0;
  if (before.transparent + vertex.counts.transparent > settings_.bounces.transparent) return Color(0.0f);
  const Vec3 offset = vertex.surface.p_world - here.hit.p_world;
  const float distance = length(offset);
  if (!(distance > 0.0f)) return Color(0.0f);
  const Vec3 direction = offset * (1.0f / distance);
  const BsdfEval scattered = eval(here.bsdf, here.point.wi_world, direction, here.joined());
  if (is_black(scattered.f_cos) || !(scattered.pdf_solid_angle > 0.0f)) return Color(0.0f);
  const bool near = limits_are_near(settings_.bounces, before, vertex.counts, 1 + counted_at_light);
  LightScatter at_light;
  if (!walk.scatter(vertex, -direction, false, near, scratch_, at_light)) return Color(0.0f);

  const float per_area = inverse_square(distance);
  Color contribution = throughput_ * scattered.f_cos * at_light.f_cos * vertex.throughput * (per_area * scale);
  if (near) {
    const EventShares at_camera = here.bsdf.event_shares(here.point.wi_world, direction, here.joined());
    contribution *= share_within_limits(settings_.bounces, before, vertex.counts, &at_camera,
                                        counted_at_light ? &at_light.shares : nullptr);
  }
  if (is_black(contribution) || !is_finite(contribution) || loses_at_any_weight(contribution, u_roulette))
    return Color(0.0f);

  float weight = 1.0f;
  pdfs_.n = n;
  if (pass_.set.weighted()) {
    pdfs_.reserve(n);
    set_scatter(here, scattered);
    pdfs_.light[here.i] = at_light.to_camera * std::fabs(dot(here.point.ng_world, direction)) * per_area;
    append_light(pdfs_, here.i + 1, walk, vertex, at_light);
    if (pass_.guided()) pdfs_.connections[here.i] = connections_from(here, vertex.place);
    pdfs_.camera[here.i + 1] = scattered.pdf_solid_angle * std::fabs(dot(vertex.ng_world, direction)) * per_area;
    weight = weigh(pdfs_, Technique::connection, here.i, reach_);
  }
  if (!(weight > 0.0f)) return Color(0.0f);
  const float survival = max_component(abs(contribution)) * weight * threshold_scale_;
  if (survival < 1.0f) {
    if (u_roulette >= survival) return Color(0.0f);
    contribution /= survival;
  }
  if (pass_.clamp_connection > 0.0f) {
    const float sum = std::fabs(contribution.x) + std::fabs(contribution.y) + std::fabs(contribution.z);
    if (sum > pass_.clamp_connection) contribution *= pass_.clamp_connection / sum;
  }
  const Vec3 origin = offset_origin(here.hit.p_world, here.hit.p_error, here.hit.ng_world, direction);
  const Vec3 target =
      offset_origin(vertex.surface.p_world, vertex.surface.p_error, vertex.surface.ng_world, -direction);
  const uint32_t kind = scattered_kind(here.bsdf);
  bool depended = false;
  contribution *= visibility(segment(origin, target, kind & k_visible_all), kind,
                             before.transparent + vertex.counts.transparent, &depended);
  if (depended && pass_.set.weighted()) {
    pdfs_.light[here.i] = 0.0f;
    weight = weigh(pdfs_, Technique::connection, here.i, reach_);
  }
  if (is_black(contribution)) return Color(0.0f);
  const EventSequence walked = events_;
  if (settings_.observer) {
    events_.append(likeliest_event(here.bsdf, here.point.wi_world, direction));
    events_.append(likeliest_event(vertex.bsdf, vertex.wi_world, -direction));
    events_.append_packed(vertex.events, vertex.depth - 1);
  }
  const Color added = add(contribution, Technique::connection, weight, walk.light(), true);
  events_ = walked;
  if (!passes_) return added;
  EventSequence light_side;
  light_side.append(passes_->wants_events() ? passes_->event_at(vertex.bsdf, vertex.wi_world, -direction)
                                            : static_cast<uint8_t>(k_scatter_diffuse));
  light_side.append_packed(vertex.events, vertex.depth - 1);
  passes_->joined(added, here.hit.instance, here.bsdf, here.point.wi_world, direction, Technique::connection,
                  light_side, scene_.source_of(walk.light()), walk.traits().group, &walk, &parts_);
  return added;
}

template <KernelProfile profile>
void Kernel<profile>::merge(const Here& here, const Sampler& sampler, uint32_t event_index) {
  const PhotonMap& photons = *pass_.photons;
  const bool grazes = any_without_cosine(here.bsdf);
  const float radius = std::sqrt(reach_.area * k_inv_pi), reach = grazes ? k_longest_reach * radius : radius;
  const float u = sampler.get_1d(bounce_dimension(event_index, k_dimension_connection));
  const float per_photon = 1.0f / (reach_.area * static_cast<float>(photons.paths()));
  const EventCounts before = counts();
  const Vec3& ng = here.point.ng_world;
  const auto merge_with = [&](const Photon& photon, float scale, LobeWidth width) {
    const PhotonRecord* record = &photons.record(photon.record);
    const int depth = record->depth, n = here.i + depth - 1;
    if (n - 1 > settings_.bounces.total) return;
    if (record->flags & k_record_limited) {
      const PhotonRecord* light = record;
      while (light->depth > 0) --light;
      if (n - 1 > scene_.lights().traits(light->light).max_bounces) return;
    }
    const float conditional = record->previous_per_solid_angle;  // used at depth 1
    const Vec3 wi = unpack_direction(photon.wi);
    const float cos_light = dot(ng, wi);
    if (std::fabs(dot(ng, unpack_direction(photon.normal))) < k_least_normal_agreement || std::fabs(cos_light) < 1e-6f)
      return;
    float per_cosine = 1.0f / std::fabs(cos_light);
    if (grazes) {
      const Vec3 offset = photon.p_world - here.hit.p_world;
      if (!(length_squared(offset) - sqr(dot(offset, wi)) < sqr(radius))) return;
      per_cosine = 1.0f / reach_across(std::fabs(cos_light));
    }
    const BsdfEval scattered = eval(here.bsdf, here.point.wi_world, wi, width);
    if (is_black(scattered.f_cos) || !(scattered.pdf_solid_angle > 0.0f)) return;
    Color contribution = throughput_ * scattered.f_cos * photon.flux.unpack() * (scale * per_photon * per_cosine);
    const EventCounts light_side{std::max(depth - 2, 0), record->counts.diffuse, record->counts.glossy,
                                 record->counts.transmission, record->counts.transparent};
    const int counted = depth >= 2 ? 1 : 0;
    if (limits_are_near(settings_.bounces, before, light_side, counted)) {
      const EventShares shares = here.bsdf.event_shares(here.point.wi_world, wi, width);
      contribution *= share_within_limits(settings_.bounces, before, light_side, counted ? &shares : nullptr, nullptr);
      if (is_black(contribution)) return;
    }

    pdfs_.n = n;
    float weight = 1.0f;
    if (weighted(width)) {
      pdfs_.reserve(n);
      set_scatter(here, scattered);
      pdfs_.light[here.i] = record->own;
      const float previous = record->previous_per_solid_angle;
      int place_before = 0;
      for (int d = depth - 1, i = here.i + 1; d >= 0; --d, ++i) {
        do --record;
        while (record->depth != d);
        if (d == 0) break;
        if (pass_.guided()) {
          const int there = record->flags >> k_record_place_shift;
          pdfs_.connections[i - 1] =
              d == depth - 1 ? connections_from(here, there) : later_connections(place_before, there);
          place_before = there;
        }
        pdfs_.light[i] = record->own;
        pdfs_.camera[i] = d == depth - 1 ? scattered.pdf_solid_angle * previous : record->other;
        pdfs_.flags[i] = static_cast<uint8_t>((record->flags & k_record_connectible ? k_connectible : 0) |
                                              k_light_arrives | k_light_scatters);
      }
      pdfs_.next_event = record->own;
      pdfs_.scatter = !(record->flags & k_record_can_be_hit) ? 0.0f
                      : depth > 1                            ? record->other
                                                             : scattered.pdf_solid_angle;
      pdfs_.light_conditional = depth > 1 ? record->previous_per_solid_angle : conditional;
      weight = weigh(pdfs_, Technique::merging, here.i, reach_, width);
    }
    if (!(weight > 0.0f)) return;
    const EventSequence walked = events_;
    if (settings_.observer) {
      events_.append(likeliest_event(here.bsdf, here.point.wi_world, wi));
      events_.count += depth - 1;  // photons do not keep theirs
    }
    const PhotonRecord* first = record;
    while ((settings_.observer || passes_) && first->depth != 0) --first;
    const LightIndex light = first->depth == 0 ? first->light : k_no_light;
    const Color added = add(contribution, Technique::merging, weight, light, true);
    events_ = walked;
    if (merged_ && n >= pass_.set.first_light_tracing) merged_->emplace_back(photon.record, luminance(abs(added)));
    if (!passes_ || light == k_no_light) return;
    EventSequence light_events;
    light_events.append_packed(passes_->wants_events() ? photons.events(photon.record) : 0, depth - 1);
    passes_->joined(added, here.hit.instance, here.bsdf, here.point.wi_world, wi, Technique::merging, light_events,
                    scene_.source_of(light), scene_.lights().traits(light).group, nullptr, &parts_);
  };
  photons.query(here.hit.p_world, reach, k_most_photons, u, [&](const Photon& photon, float scale) {
    for (LobeWidth width = here.joined();; width = LobeWidth::narrow) {
      merge_with(photon, scale, width);
      if (!here.gloss || width == LobeWidth::narrow || !photons.came_straight(photon)) break;
    }
  });
}

// The class as a whole is instantiated in kernel.cpp.
template void Kernel<KernelProfile::solid>::join(const Here&, const Sampler&, uint32_t);
template void Kernel<KernelProfile::solid>::note_place(const Here&);
template void Kernel<KernelProfile::solid>::next_event(const Here&);
template void Kernel<KernelProfile::solid>::next_event(const Here&, Chosen&, LobeWidth);
template void Kernel<KernelProfile::solid>::connect(const Here&, const LightWalk&, float);
template void Kernel<KernelProfile::solid>::connect_to_pool(const Here&, const Sampler&, uint32_t);
template Color Kernel<KernelProfile::solid>::connect(const Here&, const LightWalk&, const LightVertex&, float, float);
template void Kernel<KernelProfile::solid>::merge(const Here&, const Sampler&, uint32_t);
template void Kernel<KernelProfile::surfaces>::join(const Here&, const Sampler&, uint32_t);
template void Kernel<KernelProfile::surfaces>::note_place(const Here&);
template void Kernel<KernelProfile::surfaces>::next_event(const Here&);
template void Kernel<KernelProfile::surfaces>::next_event(const Here&, Chosen&, LobeWidth);
template void Kernel<KernelProfile::surfaces>::connect(const Here&, const LightWalk&, float);
template void Kernel<KernelProfile::surfaces>::connect_to_pool(const Here&, const Sampler&, uint32_t);
template Color Kernel<KernelProfile::surfaces>::connect(const Here&, const LightWalk&, const LightVertex&, float,
                                                        float);
template void Kernel<KernelProfile::surfaces>::merge(const Here&, const Sampler&, uint32_t);

}  // namespace lambent::bidirectional
