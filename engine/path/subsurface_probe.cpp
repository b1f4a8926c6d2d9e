#include "engine/path/subsurface_probe.h"

#include <cmath>

#include "engine/base/frame.h"
#include "engine/base/trig.h"
#include "engine/sampling/dimension.h"
#include "engine/shading/subsurface.h"

namespace lambent {
namespace {

/// The object's surfaces on a probe's ray that are looked at.
constexpr int k_most_hits = 64;

/// Profiles are at least as wide, in errors of the entry's position: else probes would pass the surface they are on.
constexpr float k_least_scale = 32.0f;

/// Axes that probes go along: the normal half of the time, else a tangent.
struct ProbeAxes {
  Vec3 along, across_1, across_2;
  float prob_along, prob_1, prob_2;
};

/// @param u in [0, 1), rest of it is uniform again
ProbeAxes choose_axes(const Vec3& normal, float& u) {
  const Frame frame = Frame::from_normal(normal);
  if (u < 0.5f) {
    u *= 2.0f;
    return {normal, frame.s, frame.t, 0.5f, 0.25f, 0.25f};
  }
  const bool first = u < 0.75f;
  u = 4.0f * (u - (first ? 0.5f : 0.75f));
  if (first) return {frame.s, normal, frame.t, 0.25f, 0.5f, 0.25f};
  return {frame.t, frame.s, normal, 0.25f, 0.25f, 0.5f};
}

/// What a point is worth whose normal is `n`: its share of the power heuristic over the axes that could have found it,
/// over the density with which this one did.
float axis_weight(const ProbeAxes& axes, const Vec3& n) {
  const float along = axes.prob_along * std::fabs(dot(axes.along, n));
  const float sum = sqr(along) + sqr(axes.prob_1 * dot(axes.across_1, n)) + sqr(axes.prob_2 * dot(axes.across_2, n));
  return sum > 0.0f ? along / sum : 0.0f;
}

}  // namespace

bool probe_subsurface(const Scene& scene, const SurfaceHit& entry, const Lobe& lobe, const Vec3& wi,
                      const Sampler& sampler, uint32_t bounce, uint64_t& rays, SubsurfaceExit& exit) {
  Vec2 u = sampler.get_2d(bounce_dimension(bounce, k_dimension_subsurface_offset));
  float u_hit = sampler.get_1d(bounce_dimension(bounce, k_dimension_subsurface_channel));
  const ProbeAxes axes = choose_axes(entry.ng_world, u.y);

  // The channel whose profile says how far; those that do not scatter here have none.
  Color scale;
  float channels = 0.0f;
  for (int k = 0; k < 3; ++k) {
    scale[k] = lobe.weight[k] > 0.0f ? std::max(lobe.f90[k], entry.p_error * k_least_scale) : 0.0f;
    channels += scale[k] > 0.0f ? 1.0f : 0.0f;
  }
  if (!(channels > 0.0f)) return false;
  float u_channel = u.x * channels;
  int chosen = 0;
  while (chosen < 2 && (!(scale[chosen] > 0.0f) || u_channel >= 1.0f))
    u_channel -= scale[chosen++] > 0.0f ? 1.0f : 0.0f;
  while (!(scale[chosen] > 0.0f)) --chosen;  // rounding
  const auto profile = [&](float r) {
    Color density(0.0f);
    for (int k = 0; k < 3; ++k)
      if (scale[k] > 0.0f) density[k] = BurleyProfile(scale[k]).density(r);
    return density;
  };

  const BurleyProfile sampled(scale[chosen]);
  const float r_disk = sampled.sample(std::clamp(u_channel, 0.0f, 1.0f));
  const Color at_disk = profile(r_disk);
  const float pdf_disk = (at_disk.x + at_disk.y + at_disk.z) / channels;
  if (!(pdf_disk > 0.0f) || !std::isfinite(pdf_disk)) return false;
  const float height = safe_sqrt(sqr(sampled.reach_m()) - sqr(r_disk));
  const SinCos turn = sin_cos_turn(u.y);
  const Vec3 start =
      entry.p_world + axes.along * height + axes.across_1 * (r_disk * turn.cos) + axes.across_2 * (r_disk * turn.sin);
  Ray ray{start, 0.0f, axes.along * -1.0f, 2.0f * height, k_visible_all};
  if (!(ray.t_max > 0.0f) || !is_finite(start)) return false;

  float sum = 0.0f;
  for (int hits = 0; hits < k_most_hits; ++hits) {
    Hit hit;
    if (!scene.geometry().intersect_instance(ray, entry.instance, hit, &rays)) break;
    const SurfaceHit surface = scene.geometry().surface(hit);
    const Color weight =
        profile(length(surface.p_world - entry.p_world)) * (axis_weight(axes, surface.ng_world) / pdf_disk);
    const float importance = average(weight);
    if (!(importance > 0.0f) || !std::isfinite(importance)) continue;
    // One of the hits is kept, by its weight.
    sum += importance;
    const float prob = importance / sum;
    if (u_hit < prob) {
      exit.surface = surface;
      exit.weight = weight * (1.0f / importance);
      u_hit /= prob;
    } else {
      u_hit = (u_hit - prob) / (1.0f - prob);
    }
  }
  if (!(sum > 0.0f)) return false;
  exit.weight *= sum;
  const bool below = dot(entry.ng_world, wi) < 0.0f;
  exit.direction_world = below ? exit.surface.ng_world * -1.0f : exit.surface.ng_world;
  exit.spread_m = max_component(scale);
  return true;
}

}  // namespace lambent
