#include "engine/path/subsurface_walk.h"

#include <bit>
#include <cmath>

#include "engine/base/hash.h"
#include "engine/path/subsurface_probe.h"
#include "engine/sampling/dimension.h"
#include "engine/sampling/warp.h"
#include "engine/shading/microfacet.h"
#include "engine/shading/subsurface.h"

namespace lambent {
namespace {

constexpr int k_most_events = 256;
/// From this event on an anisotropic medium is replaced by the isotropic one that is similar to it.
constexpr int k_similar_from = 10;
/// A walk starts this far, in mean free paths, under the surface at most: rays start below it by what rounding adds.
constexpr float k_most_depth = 1.0f / 32.0f;

/// Uniform numbers in [0, 1), as many as a walk needs: more than a sampler has dimensions for.
class Numbers {
 public:
  explicit Numbers(uint64_t seed) : state_(seed) {}
  float next() {
    state_ += 0x9e3779b97f4a7c15ull;
    return unit_float(static_cast<uint32_t>(hash_u64(state_) >> 32));
  }

 private:
  uint64_t state_;
};

Color exponential(const Color& x) { return Color(std::exp(x.x), std::exp(x.y), std::exp(x.z)); }

/// Density, or probability for walks that met the surface, of a step by channel. @param stretch of the extinction
Color step_density(const Color& extinction, float stretch, float t, bool met) {
  const Color stretched = extinction * stretch;
  const Color transmittance = exponential(stretched * -t);
  return met ? transmittance : stretched * transmittance;
}

float henyey_greenstein(float cosine, float g) {
  const float base = 1.0f + g * g - 2.0f * g * cosine;
  return 0.25f * k_inv_pi * (1.0f - g * g) / (base * std::sqrt(base));
}
float sample_henyey_greenstein(float g, float u) {
  if (std::fabs(g) < 1e-3f) return 1.0f - 2.0f * u;
  const float part = (1.0f - g * g) / (1.0f - g + 2.0f * g * u);
  return std::clamp((1.0f + g * g - part * part) / (2.0f * g), -1.0f, 1.0f);
}

/// Dwivedi's directions: towards the axis, so that walks come back to the surface.
struct Guide {
  float length;    ///< diffusion length in mean free paths, above 1
  float log_term;  ///< ln((length + 1) / (length − 1))

  explicit Guide(float albedo) {
    // d'Eon & Křivánek 2020, "Zero-Variance Theory for Efficient Subsurface Scattering", eq. 67
    length = 1.0f / std::sqrt(1.0f - std::pow(albedo, 2.44294f - 0.0215813f * albedo + 0.578637f / albedo));
    length = std::max(length, 1.0f + 1e-4f);
    log_term = std::log((length + 1.0f) / (length - 1.0f));
  }
  float sample(float u) const { return std::clamp(length - (length + 1.0f) * std::exp(-u * log_term), -1.0f, 1.0f); }
  float density(float cosine) const { return 0.5f * k_inv_pi / ((length - cosine) * log_term); }
};

Vec3 around(const Vec3& axis, float cosine, float u) {
  const float sine = safe_sqrt(1.0f - cosine * cosine), angle = 2.0f * k_pi * u;
  return Frame::from_normal(axis).to_world({sine * std::cos(angle), sine * std::sin(angle), cosine});
}

/// Direction under the surface; false if there is none.
bool enter(const Lobe& lobe, const Vec3& wi, Vec2 u, Vec3& direction) {
  const Frame frame = Frame::from_normal(lobe.n);
  bool diffuse = lobe.subsurface != SubsurfaceMethod::refractive && lobe.subsurface != SubsurfaceMethod::van_de_hulst;
  if (lobe.subsurface == SubsurfaceMethod::skin) {
    diffuse = u.x < 0.5f;
    u.x = diffuse ? 2.0f * u.x : 2.0f * u.x - 1.0f;
  }
  if (diffuse) {
    direction = -frame.to_world(sample_cosine_hemisphere(u));
    return true;
  }
  const Vec3 local = frame.to_local(wi);
  if (!(local.z > 0.0f)) return false;
  const float alpha = std::max(lobe.alpha_x, k_delta_alpha);
  const Vec3 m = Microfacets(Distribution::ggx, alpha, alpha).sample_normal(local, u);
  const float cosine = dot(local, m), inverse = 1.0f / lobe.eta;
  const float inside = safe_sqrt(1.0f - inverse * inverse * (1.0f - cosine * cosine));
  direction = frame.to_world(m * (inverse * cosine - inside) - local * inverse);
  return true;
}

}  // namespace

bool walk_subsurface(const Scene& scene, const SurfaceHit& entry, const Lobe& lobe, const Vec3& wi,
                     const Sampler& sampler, uint32_t bounce, uint64_t& rays, SubsurfaceExit& exit) {
  if (lobe.subsurface == SubsurfaceMethod::burley)
    return probe_subsurface(scene, entry, lobe, wi, sampler, bounce, rays, exit);
  Vec3 direction;
  if (!enter(lobe, wi, sampler.get_2d(bounce_dimension(bounce, k_dimension_subsurface_offset)), direction))
    return false;
  direction = normalize(direction);
  const float side = dot(entry.ng_world, wi) < 0.0f ? -1.0f : 1.0f;
  if (!(dot(entry.ng_world, direction) * side < 0.0f)) return false;

  SubsurfaceMedium medium = subsurface_medium(lobe, entry.p_error / k_most_depth);
  Color weight = medium.weight;
  for (int k = 0; k < 3; ++k) weight[k] = lobe.f0[k] > 0.0f ? weight[k] / lobe.f0[k] : 0.0f;  // events bring it
  const Guide guide(max_component(medium.albedo));
  float anisotropy = medium.anisotropy;
  float guided_share = 1.0f - std::max(0.5f, std::pow(std::fabs(anisotropy), 0.125f));
  const Vec3& outside = lobe.n;

  Numbers numbers(std::bit_cast<uint32_t>(sampler.get_1d(bounce_dimension(bounce, k_dimension_subsurface_channel))) +
                  (uint64_t(std::bit_cast<uint32_t>(direction.x)) << 32));
  const Vec3 start = offset_origin(entry.p_world, entry.p_error, entry.ng_world, direction);
  Vec3 position = start;
  float opposite = -1.0f;  // depth of the object's other side under the entry, m; negative: none is near
  for (int event = 0; event < k_most_events; ++event) {
    if (event == k_similar_from) {
      for (int k = 0; k < 3; ++k) {
        const float scattering = medium.extinction[k] * medium.albedo[k] * (1.0f - anisotropy);
        const float absorption = medium.extinction[k] * (1.0f - medium.albedo[k]);
        medium.extinction[k] = absorption + scattering;
        medium.albedo[k] = scattering / medium.extinction[k];
      }
      anisotropy = 0.0f;
      guided_share = 0.75f;
    }
    // The channel that the step's length is chosen for.
    Color channel = abs(weight * medium.albedo);
    const float sum = channel.x + channel.y + channel.z;
    if (!(sum > 0.0f) || !std::isfinite(sum)) return false;
    channel *= 1.0f / sum;
    float u_channel = numbers.next();
    int chosen = 0;
    while (chosen < 2 && u_channel >= channel[chosen]) u_channel -= channel[chosen++];
    float extinction = medium.extinction[chosen];

    float cosine = 0.0f, phase = 0.0f, backward_share = 0.0f;
    if (event > 0) {
      const bool guided = numbers.next() < guided_share;
      bool backward = false;
      if (opposite >= 0.0f) {
        const float depth = std::clamp(dot(start - position, outside), 0.0f, opposite);
        backward_share =
            1.0f / (1.0f + std::exp((opposite - 2.0f * depth) * average(medium.extinction) / guide.length));
        backward = numbers.next() < backward_share;
      }
      const float u = numbers.next(), u_angle = numbers.next();
      if (guided) {
        cosine = backward ? -guide.sample(u) : guide.sample(u);
        const Vec3 turned = around(outside, cosine, u_angle);
        phase = henyey_greenstein(dot(direction, turned), anisotropy);
        direction = turned;
        extinction *= 1.0f + (backward ? cosine : -cosine) / guide.length;
      } else {
        const float turn = sample_henyey_greenstein(anisotropy, u);
        direction = around(direction, turn, u_angle);
        phase = henyey_greenstein(turn, anisotropy);
        cosine = dot(direction, outside);
      }
      direction = normalize(direction);
    }

    float t = -std::log(1.0f - numbers.next()) / extinction;
    // The first ray looks further, for the object's other side.
    Ray ray{position, 0.0f, direction, t, k_visible_all};
    if (event == 0) ray.t_max = std::max(t, 10.0f / min_component(medium.extinction));
    Hit hit;
    bool met = scene.geometry().intersect_instance(ray, entry.instance, hit, &rays);
    if (event == 0 && met) {
      opposite = std::max(dot(direction, outside) * -hit.t, 0.0f);
      met = hit.t < t;
    }
    if (met) t = hit.t;
    position = position + direction * t;

    Color density = step_density(medium.extinction, 1.0f, t, met);
    Color value = density;
    if (!met) value *= medium.albedo;
    if (event > 0) {
      // All ways in which the step could have been chosen (balance heuristic); the phase function cancels from most.
      const float forward = guide.density(cosine) / phase, backward = guide.density(-cosine) / phase;
      const Color guided =
          step_density(medium.extinction, 1.0f - cosine / guide.length, t, met) * (forward * (1.0f - backward_share)) +
          step_density(medium.extinction, 1.0f + cosine / guide.length, t, met) * (backward * backward_share);
      density = lerp(density, guided, guided_share);
    }
    const float chosen_density = channel.x * density.x + channel.y * density.y + channel.z * density.z;
    if (!(chosen_density > 0.0f)) return false;
    weight *= value * (1.0f / chosen_density);
    if (met) {
      if (!is_finite(weight)) return false;
      exit.surface = scene.geometry().surface(hit);
      exit.direction_world = direction;
      exit.weight = weight;
      exit.spread_m = 1.0f / min_component(medium.extinction);
      return true;
    }
    if (max_component(abs(weight)) < 1e-6f) return false;
  }
  return false;
}

void fill_subsurface_exit(const Scene& scene, const SubsurfaceExit& exit, const Lobe& lobe, const RayCone& cone,
                          const PathCounts& counts, ShadingPoint& point, Bsdf& bsdf) {
  const SurfaceBinding& binding = scene.binding(exit.surface.instance, exit.surface.material_slot);
  scene.fill_shading_point(exit.surface, binding, exit.direction_world, 0.0f, cone, counts, point);
  Lobe leaving;
  leaving.kind = lobe.macro_fresnel ? LobeKind::principled_exit : LobeKind::diffuse;
  leaving.n = point.ns_world;
  if (binding.program->traits().subsurface_normal) {
    // Where the exit is bumped: the mean normal of its subsurface lobes.
    binding.program->evaluate(point, scene.textures(), bsdf);
    Vec3 n(0.0f);
    for (const Lobe& there : bsdf.lobes())
      if (there.kind == LobeKind::subsurface) n = n + there.n * average(there.weight);
    if (length_squared(n) > 0.0f) leaving.n = normalize(n);
  }
  // Where the walk came from does not matter to what leaves.
  point.wi_world = point.ng_world;
  bsdf.begin(point);
  bsdf.add(leaving);
}

}  // namespace lambent
