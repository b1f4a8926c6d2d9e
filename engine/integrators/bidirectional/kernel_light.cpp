// The kernel's light walks: what they bring to the lens, spread over pixels, and the photons they leave.
#include <algorithm>
#include <cmath>

#include "engine/integrators/bidirectional/joined_limits.h"
#include "engine/integrators/bidirectional/kernel.h"

namespace lambent::bidirectional {

namespace {

/// Below this density, px⁻², a pixel's share of a splat is added by chance.
constexpr float k_thin_share = 0.05f;

}  // namespace

template <KernelProfile profile>
void Kernel<profile>::connect_to_lens(const LightWalk& walk, const LightVertex& vertex, const Vec2& u_lens,
                                      float u_roulette) {
  if (vertex.depth < pass_.set.first_light_tracing || !vertex.bsdf.has_non_delta()) return;
  const CameraConnection lens = scene_.camera().project(vertex.surface.p_world, u_lens);
  if (!lens.valid || vertex.depth - 1 > walk.traits().max_bounces) return;
  const Rectangle& region = film_.region();
  const float reach = settings_.filter.radius_px();
  if (lens.raster_px.x + reach <= static_cast<float>(region.x) ||
      lens.raster_px.y + reach <= static_cast<float>(region.y) ||
      lens.raster_px.x - reach >= static_cast<float>(region.x + region.width) ||
      lens.raster_px.y - reach >= static_cast<float>(region.y + region.height))
    return;
  if (!(scene_.geometry().instance(vertex.surface.instance).visibility & k_visible_camera)) return;
  if (scene_.instance(vertex.surface.instance).holdout) return;
  const bool near = vertex.depth >= 2 && limits_are_near(settings_.bounces, {}, vertex.counts, 1);
  LightScatter at_light;
  if (!walk.scatter(vertex, lens.direction_world, true, near, scratch_, at_light)) return;
  Color contribution = vertex.throughput * at_light.f_cos * lens.importance_px2_per_m2;
  if (near) contribution *= share_within_limits(settings_.bounces, {}, vertex.counts, nullptr, &at_light.shares);
  if (is_black(contribution) || loses_at_any_weight(contribution / pass_.counts.light_paths, u_roulette)) return;

  float weight = 1.0f;
  lens_pdfs_.n = vertex.depth;
  if (pass_.set.weighted()) {
    lens_pdfs_.reserve(vertex.depth);
    append_light(lens_pdfs_, 1, walk, vertex, at_light);
    if (pass_.guided() && vertex.depth > 1) {
      const uint16_t before = walk.pdfs().place[static_cast<size_t>(vertex.depth) - 1];
      lens_pdfs_.connections[1] = connections(true, pass_.guide->region_at(vertex.surface), before);
    }
    lens_pdfs_.camera[1] = lens.importance_px2_per_m2 * std::fabs(dot(vertex.ng_world, lens.direction_world));
    weight = weigh(lens_pdfs_, Technique::light_tracing, 0, reach_at(vertex.surface.p_world));
  }
  if (!(weight > 0.0f)) return;
  const float survival = max_component(abs(contribution)) * weight / pass_.counts.light_paths * threshold_scale_;
  if (survival < 1.0f) {
    if (u_roulette >= survival) return;
    contribution /= survival;
    u_roulette /= survival;  // uniform again
  }
  const Vec3 origin =
      offset_origin(vertex.surface.p_world, vertex.surface.p_error, vertex.surface.ng_world, lens.direction_world);
  const Ray ray{origin, 0.0f, lens.direction_world, lens.t_visible_m, k_visible_camera};
  contribution *= visibility(ray, k_ray_camera, vertex.counts.transparent);
  if (is_black(contribution)) return;
  if (settings_.observer) {
    EventSequence events;
    events.append(likeliest_event(vertex.bsdf, vertex.wi_world, lens.direction_world));
    events.append_packed(vertex.events, vertex.depth - 1);
    settings_.observer->on_contribution({lens.raster_px, contribution / pass_.counts.light_paths, weight,
                                         Technique::light_tracing, lens_pdfs_.n, 0, events, walk.light(),
                                         vertex.surface.instance});
  }
  contribution *= weight * settings_.exposure;
  if (settings_.clamp_direct > 0.0f || settings_.clamp_indirect > 0.0f) {
    const float limit = (vertex.depth > 1 ? settings_.clamp_indirect : settings_.clamp_direct) *
                        pass_.counts.light_paths * settings_.exposure;
    const float sum = std::fabs(contribution.x) + std::fabs(contribution.y) + std::fabs(contribution.z);
    if (limit > 0.0f && sum > limit) contribution *= limit / sum;
  }
  splat_parts_.assign(1, {plane_, contribution});
  if (passes_ && passes_->wants_light()) part_splat(walk, vertex, lens.direction_world, contribution);
  splat(lens.raster_px, u_roulette);
}

/// What the passes of light get of it.
template <KernelProfile profile>
void Kernel<profile>::part_splat(const LightWalk& walk, const LightVertex& vertex, const Vec3& direction_world,
                                 const Color& contribution) {
  ClassShares first;
  if (passes_->wants_classes())
    first = vertex.bsdf.class_shares(vertex.wi_world, direction_world, Transport::importance);
  PathSignature signature{
      vertex.depth, &first, {}, scene_.source_of(walk.light()), walk.traits().group, Technique::light_tracing};
  if (passes_->wants_mattes())
    signature.brought = scene_.instance(vertex.surface.instance).matte && passes_->meets_other(walk, vertex.depth - 1);
  if (passes_->wants_events()) {
    signature.events.append(passes_->event_at(vertex.bsdf, vertex.wi_world, direction_world));
    signature.events.append_packed(vertex.events, vertex.depth - 1);
  }
  passes_->splatted(contribution, signature,
                    [&](int plane, const Color& part) { splat_parts_.emplace_back(plane, part); });
}

/// Every pixel whose filter covers the place gets its share; thin shares (the filter's tails) by chance, for less work.
template <KernelProfile profile>
void Kernel<profile>::splat(const Vec2& raster_px, float u) {
  const float reach = settings_.filter.radius_px();
  const auto weigh_axis = [&](float at, int first, int end, std::vector<float>& weights) {
    weights.clear();
    for (int i = first; i < end; ++i)
      weights.push_back(settings_.filter.density_axis(at - static_cast<float>(i) - 0.5f));
  };
  const Rectangle& region = film_.region();
  const auto first_of = [&](float at, int low) { return std::max(static_cast<int>(std::floor(at - reach)), low); };
  const auto end_of = [&](float at, int high) { return std::min(static_cast<int>(std::floor(at + reach)) + 1, high); };
  const int x0 = first_of(raster_px.x, region.x), x1 = end_of(raster_px.x, region.x + region.width);
  const int y0 = first_of(raster_px.y, region.y), y1 = end_of(raster_px.y, region.y + region.height);
  weigh_axis(raster_px.x, x0, x1, splat_x_);
  weigh_axis(raster_px.y, y0, y1, splat_y_);
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      float density = splat_x_[static_cast<size_t>(x - x0)] * splat_y_[static_cast<size_t>(y - y0)];
      if (density < k_thin_share) {
        u += k_golden;
        u -= std::floor(u);
        if (u * k_thin_share >= density) continue;
        density = k_thin_share;
      }
      for (const auto& [plane, part] : splat_parts_) splats_.push_back({x, y, plane, part * density});
    }
}

template <KernelProfile profile>
void Kernel<profile>::give_splats() {
  for (const Splat& splat : splats_) film_.splat(splat.x, splat.y, splat.value, splat.plane);
  splats_.clear();
}

template <KernelProfile profile>
void Kernel<profile>::light_sample(const Sampler& sampler, PhotonBatch* batch, bool silent) {
  forget_connections();
  const uint64_t rays_before = walk_.rays();
  walk_.trace(sampler);
  counts_.rays += walk_.rays() - rays_before;
  if (pass_.guide) pass_.guide->place(walk_);
  if (pass_.set.light_tracing && !silent) {
    m_ = 0;
    bounces_ = {};
    for (int i = 0; i < walk_.size(); ++i) {
      const uint32_t event = static_cast<uint32_t>(i);
      const Vec2 u_lens = scene_.profile().depth_of_field
                              ? sampler.get_2d(light_bounce_dimension(event, k_dimension_lens_connection))
                              : Vec2(0.0f);
      connect_to_lens(walk_, walk_[i], u_lens,
                      sampler.get_1d(light_bounce_dimension(event, k_dimension_shadow_roulette)));
    }
  }
  if (batch) batch->add(walk_, pass_.set.first_merge_light);
}

// The class as a whole is instantiated in kernel.cpp.
template void Kernel<KernelProfile::solid>::connect_to_lens(const LightWalk&, const LightVertex&, const Vec2&, float);
template void Kernel<KernelProfile::solid>::part_splat(const LightWalk&, const LightVertex&, const Vec3&, const Color&);
template void Kernel<KernelProfile::solid>::splat(const Vec2&, float);
template void Kernel<KernelProfile::solid>::give_splats();
template void Kernel<KernelProfile::surfaces>::give_splats();
template void Kernel<KernelProfile::solid>::light_sample(const Sampler&, PhotonBatch*, bool);
template void Kernel<KernelProfile::surfaces>::connect_to_lens(const LightWalk&, const LightVertex&, const Vec2&,
                                                               float);
template void Kernel<KernelProfile::surfaces>::part_splat(const LightWalk&, const LightVertex&, const Vec3&,
                                                          const Color&);
template void Kernel<KernelProfile::surfaces>::splat(const Vec2&, float);
template void Kernel<KernelProfile::surfaces>::light_sample(const Sampler&, PhotonBatch*, bool);

}  // namespace lambent::bidirectional
