#include "engine/path/light_walk.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/base/hash.h"
#include "engine/path/surface.h"
#include "engine/path/transmittance.h"
#include "engine/sampling/dimension.h"
#include "engine/shading/closures.h"

namespace lambent {

namespace {

/// Rays of a light walk: those that light itself casts are as shadow rays see the scene, the others as scattered ones.
uint32_t mask_at(int depth) { return depth == 1 ? k_visible_shadow : k_visible_diffuse; }

}  // namespace

float light_walk_density(const LightSet& lights, const EmissionAim* aim, LightIndex light, const Vec3& n_light,
                         const Vec3& p_receiver, const Vec3& direction, float distance, float* conditional) {
  if (conditional) *conditional = 0.0f;
  if (light == k_no_light || !lights.traits(light).starts_walks) return 0.0f;
  const LightKind kind = lights.kind(light);
  const bool infinite = lights.is_infinite(light);
  const Vec3 p_ray = infinite ? p_receiver : p_receiver - direction * distance;
  const EmissionPdf pdf = lights.pdf_emission(light, n_light, direction, p_ray, aim);
  if (infinite) {
    if (conditional) *conditional = pdf.pdf_area;
    return pdf.prob_selection * pdf.pdf_area * pdf.pdf_direction_solid_angle;
  }
  const float per_area = pdf.pdf_direction_solid_angle * inverse_square(distance);
  if (conditional) *conditional = per_area;
  if (lights.is_delta(light)) return pdf.prob_selection * per_area;
  const bool flat = kind == LightKind::triangle || kind == LightKind::area;
  const float cos_light = flat ? std::fabs(dot(n_light, direction)) : 1.0f;
  const float density = pdf.prob_selection * pdf.pdf_area * (pdf.pdf_direction_solid_angle / cos_light);
  return std::isfinite(density) ? density : 0.0f;
}

uint8_t light_walk_flags(const Scene& scene, const SurfaceHit& surface, const Program& program) {
  const uint32_t visibility = scene.geometry().instance(surface.instance).visibility;
  if (!(visibility & k_visible_diffuse)) return 0;
  const bool scatters = (visibility & k_visible_scattered) == k_visible_scattered && !program.traits().path_dependent;
  return static_cast<uint8_t>(k_light_arrives | (scatters ? k_light_scatters : 0) |
                              (visibility & k_visible_shadow ? k_light_begins : 0));
}

LightWalk::LightWalk(const Scene& scene, const LightWalkSettings& settings) : scene_(scene), settings_(settings) {
  const size_t room = static_cast<size_t>(settings.max_vertices) + 2;
  pdfs_.own.resize(room);
  pdfs_.other.resize(room);
  pdfs_.connectible.resize(room);
  pdfs_.place.resize(room);
  vertices_.reserve(std::min<size_t>(room, 16));
}

LightVertex& LightWalk::next_vertex() {
  if (count_ == static_cast<int>(vertices_.size())) vertices_.emplace_back();
  return vertices_[static_cast<size_t>(count_)];
}

void LightWalk::trace(const Sampler& sampler, float time) {
  count_ = 0;
  const LightSet& lights = scene_.lights();
  const EmissionSample& start = start_ =
      lights.sample_emission(sampler.get_2d(light_path_dimension(k_dimension_emitter)),
                             sampler.get_2d(light_path_dimension(k_dimension_emitter_direction)), settings_.aim);
  if (!start || !start.traits->starts_walks) return;
  const Color radiance = scene_.emitted_radiance(start);
  const float start_pdf = start.prob_selection * start.pdf_area * start.pdf_direction_solid_angle;
  Color throughput = radiance * (start.cos_light / start_pdf);
  if (is_black(throughput) || !is_finite(throughput)) return;
  can_be_hit_ = start.traits->hit_by_rays && !start.is_delta_position && !start.is_delta_direction;

  Ray ray{start.p_light_world, 0.0f, start.direction_world, k_infinity, mask_at(1)};
  if (lights.kind(start.light) == LightKind::triangle) {
    const SurfaceHit on_light = scene_.geometry().surface(start.instance, start.triangle, start.uv);
    ray = ray_from_surface(on_light.p_world, on_light.p_error, on_light.ng_world, start.direction_world, mask_at(1));
  }
  // Distances are counted from the vertex before, through transparent surfaces.
  Vec3 ng_before(0.0f);
  float pdf_direction = 0.0f;  // of the direction chosen at the vertex before
  float relative = 1.0f;       // throughput over that at the start: what roulette goes by
  float passed = 0.0f;         // through transparent surfaces since the vertex before
  EventCounts counts;
  uint64_t events = 0;
  int depth = 1;
  ShadingPoint point;
  point.time = time;
  Bsdf& bsdf = seen_.bsdf;
  for (uint32_t event_index = 0;; ++event_index) {
    Hit hit;
    ++rays_;
    if (!scene_.geometry().intersect(ray, hit)) return;
    LightVertex& vertex = next_vertex();
    vertex.surface = scene_.geometry().surface(hit);
    const SurfaceHit& surface = vertex.surface;
    // Light linking: nothing scatters at surfaces that the light does not reach, and those that do not block it let the
    // walk through. Where it might scatter or go through it does one by chance.
    bool reached = true, passes = false;
    if (depth == 1 && start.traits->linked.any()) {
      reached = scene_.reaches(start.traits->linked.receivers, surface.instance);
      passes = !scene_.blocks(start.traits->linked.blockers, surface.instance);
    }
    const auto pass = [&] {
      passed += hit.t;
      ray = ray_from_surface(surface.p_world, surface.p_error, surface.ng_world, ray.direction, mask_at(1));
    };
    if (!reached && passes) {
      pass();
      continue;
    }
    vertex.binding = &scene_.binding(surface.instance, surface.material_slot);
    const Program& program = *vertex.binding->program;
    if (!reached && !program.traits().may_be_transparent) return;
    vertex.wi_world = -ray.direction;
    vertex.ng_world = dot(surface.ng_world, vertex.wi_world) < 0.0f ? -surface.ng_world : surface.ng_world;
    const float distance = passed + hit.t;
    const float cos_here = std::fabs(dot(surface.ng_world, ray.direction));
    Color clear(1.0f);  // of what stands before a lamp that faces the surface, behind the start of the ray
    if (const float behind = depth == 1 ? start.behind_m(distance) : 0.0f; behind > 0.0f) {
      ++rays_;
      const Ray back{start.p_light_world, 0.0f, -start.direction_world, behind, ray.mask};
      const PathCounts seen_as{k_ray_shadow, 1, 0, 0, 0, 0};
      clear = segment_transmittance<true>(scene_, back, seen_as, settings_.transparent, nullptr,
                                          start.traits->linked.blockers);
      if (is_black(clear) && !program.traits().may_be_transparent && !passes) return;
    }
    vertex.depth = depth;
    vertex.time = time;
    vertex.throughput = throughput * clear;
    vertex.counts = counts;
    vertex.events = events;
    if (depth > 1) {
      vertex.own_area = pdf_direction * cos_here * inverse_square(distance);
      vertex.previous_per_solid_angle = std::fabs(dot(ng_before, ray.direction)) * inverse_square(distance);
    }

    const uint8_t flags = light_walk_flags(scene_, surface, program);
    if (!(flags & k_light_arrives)) {
      if (!passes) return;
      pass();
      continue;
    }
    bool scatters = flags & k_light_scatters;
    if (scatters) {
      PathCounts seen_as{k_ray_diffuse, counts.total + 1,    counts.diffuse + 1,
                         counts.glossy, counts.transmission, counts.transparent};
      scene_.fill_shading_point(surface, *vertex.binding, vertex.wi_world, distance,
                                scene_.footprint_at(surface.p_world), seen_as, point);
      program.evaluate(point, scene_.textures(), vertex.bsdf);
      scatters = !caustics_drop_lobes(vertex.bsdf, settings_) &&
                 !(program.traits().subsurface && vertex.bsdf.has_subsurface_after_diffuse());
    }
    if (!scatters) {
      point.ng_world = vertex.ng_world;
      point.ns_world = vertex.ng_world;
      vertex.bsdf.begin(point);
    }
    if (depth == 1) {
      vertex.own_area = light_walk_density(lights, settings_.aim, start.light, start.n_light_world, surface.p_world,
                                           start.direction_world, distance, &vertex.conditional) *
                        cos_here;
      vertex.conditional *= cos_here;
      vertex.next_event = 0.0f;
    }
    if (depth == 1 && settings_.want_next_event) {
      const Vec3 receiver_normal = light_receiver_normal(vertex.bsdf, vertex.ng_world);
      const LightIndex light = start.light;
      const LightChoices choices = scene_.light_choices(surface.instance, settings_.even_world);
      vertex.next_event = lights.is_delta(light)
                              ? lights.prob_selection(surface.p_world, receiver_normal, light, choices)
                              : lights.pdf_solid_angle(surface.p_world, receiver_normal, light, vertex.wi_world,
                                                       distance, start.uv, choices);
    }
    if (!(vertex.own_area > 0.0f) && !passes) return;
    if (vertex.own_area > 0.0f && reached) ++count_;
    scatters = scatters && vertex.own_area > 0.0f && !vertex.bsdf.empty();
    if (!scatters && !passes) return;

    const uint32_t base = event_index;
    float u_lobe = sampler.get_1d(light_bounce_dimension(base, k_dimension_lobe));
    if (passes) {
      if (scatters) {
        throughput *= 2.0f;
        u_lobe *= 2.0f;
      }
      if (!scatters || u_lobe >= 1.0f) {
        pass();
        continue;
      }
    }
    const BsdfSample sampled =
        vertex.bsdf.sample(vertex.wi_world, u_lobe, sampler.get_2d(light_bounce_dimension(base, k_dimension_direction)),
                           Transport::importance);
    // Light that goes under the surface or through a portal is found by camera walks alone.
    if (sampled.event == k_scatter_none || (sampled.event & (k_scatter_subsurface | k_scatter_portal))) return;
    const uint32_t visible = mask_at(2);
    if (sampled.event & k_scatter_transparent) {
      if (passes) return;  // counted above, for all of the light
      if (depth == 1 && !lets_through(program.traits(), k_ray_shadow)) return;
      counts.add(sampled.event);
      if (counts.transparent > settings_.transparent) return;
      throughput *= sampled.weight;
      passed = distance;
      ray = ray_from_surface(surface.p_world, surface.p_error, surface.ng_world, ray.direction,
                             depth == 1 ? mask_at(1) : visible);
      if (is_black(throughput)) return;
      continue;
    }
    if (!reached || is_black(clear)) return;
    throughput *= clear;

    // The pair of directions as a camera walk sees it.
    const bool delta = sampled.event & k_scatter_delta;
    Color weight = sampled.weight;
    float to_camera = sampled.pdf_solid_angle, to_light = sampled.pdf_reverse_solid_angle;
    if (!same_from(vertex, sampled.wo_world)) {
      evaluate_from(vertex, sampled.wo_world, seen_);
      BsdfEval seen;
      if (delta) {
        int lobe = sampled.lobe;
        const auto kind = vertex.bsdf.lobes()[static_cast<size_t>(lobe)].kind;
        const std::span<const Lobe> lobes = bsdf.lobes();
        if (lobe >= static_cast<int>(lobes.size()) || lobes[static_cast<size_t>(lobe)].kind != kind)
          lobe = static_cast<int>(
              std::find_if(lobes.begin(), lobes.end(), [&](const Lobe& l) { return l.kind == kind; }) - lobes.begin());
        seen = bsdf.eval_delta(lobe, sampled.wo_world, vertex.wi_world, Transport::radiance);
        // From a delta in the light's direction to one in the camera's (lobe_functions.h, delta_value).
        if ((sampled.event & k_scatter_transmission) && !is_black(seen.f_cos)) {
          const Vec3& n = lobes[static_cast<size_t>(lobe)].n;
          seen.f_cos *= std::fabs(dot(n, vertex.wi_world) / dot(n, sampled.wo_world)) / sqr(sampled.eta);
        }
      } else {
        seen = bsdf.eval(sampled.wo_world, vertex.wi_world, Transport::radiance, ReversePdf::yes);
      }
      const float cos_light = std::fabs(dot(vertex.ng_world, vertex.wi_world));
      const float adjoint = cos_light > 1e-6f ? std::fabs(dot(vertex.ng_world, sampled.wo_world)) / cos_light : 0.0f;
      weight = seen.f_cos * (adjoint / sampled.pdf_solid_angle);
      to_camera = seen.pdf_reverse_solid_angle;
      to_light = seen.pdf_solid_angle;
      if (!(to_light > 0.0f) || !(to_camera > 0.0f) || !is_finite(weight)) return;
    }
    pdfs_.own[static_cast<size_t>(depth)] = vertex.own_area;
    pdfs_.connectible[static_cast<size_t>(depth)] = !delta;
    if (depth == 1) {
      pdfs_.next_event = vertex.next_event;
      pdfs_.conditional = vertex.conditional;
    }
    pdfs_.other[static_cast<size_t>(depth) - 1] = depth == 1 ? to_light : to_light * vertex.previous_per_solid_angle;

    // Limits.
    if (depth >= 2) counts.add(sampled.event);
    if (!counts.within(settings_) || depth >= settings_.max_vertices) return;
    uint8_t event = sampled.event;
    // Of one lobe alone it is what was sampled.
    if (settings_.events_by_share && !(event & k_scatter_delta) && vertex.bsdf.lobes().size() > 1)
      event = event_by_share(vertex.bsdf, vertex.wi_world, sampled.wo_world,
                             unit_float(hash_combine(std::bit_cast<uint32_t>(sampled.wo_world.x), event_index)));
    events = events << 4 | (event & 15u);

    throughput *= weight;
    relative *= max_component(abs(weight));
    if (is_black(throughput)) return;
    const float survival = std::min(1.0f, std::sqrt(relative));
    if (survival < 1.0f) {
      if (sampler.get_1d(light_bounce_dimension(base, k_dimension_roulette)) >= survival) return;
      throughput /= survival;
      relative /= survival;
    }
    ng_before = surface.ng_world;
    pdf_direction = to_camera;
    passed = 0.0f;
    ++depth;
    ray = ray_from_surface(surface.p_world, surface.p_error, surface.ng_world, sampled.wo_world, visible);
  }
}

bool LightWalk::same_from(const LightVertex& vertex, const Vec3& direction) const {
  if (vertex.binding->program->traits().view_dependent) return false;
  if (dot(vertex.ng_world, direction) <= 0.0f) return false;  // the other side may be made otherwise
  const Vec3 ns =
      dot(vertex.surface.ng_world, vertex.ng_world) < 0.0f ? -vertex.surface.ns_world : vertex.surface.ns_world;
  for (const Lobe& lobe : vertex.bsdf.lobes())
    if (lobe.n != vertex.ng_world && lobe.kind != LobeKind::transparent &&
        (lobe.n != ns || valid_reflection_normal(vertex.ng_world, direction, ns) != ns))
      return false;
  return true;
}

void LightWalk::evaluate_from(const LightVertex& vertex, const Vec3& direction, Scratch& scratch) const {
  scratch.point.time = vertex.time;
  const PathCounts seen_as{k_ray_diffuse, 1, 1, 0, 0, 0};  // programs that ask are not evaluated from here
  scene_.fill_shading_point(vertex.surface, *vertex.binding, direction, 0.0f,
                            scene_.footprint_at(vertex.surface.p_world), seen_as, scratch.point);
  vertex.binding->program->evaluate(scratch.point, scene_.textures(), scratch.bsdf);
}

bool LightWalk::has_delta_lobe(const SurfaceHit& surface, const SurfaceBinding& binding, const Vec3& wi_world,
                               LobeKind kind, Scratch& scratch) const {
  scene_.fill_shading_point(surface, binding, wi_world, 0.0f, scene_.footprint_at(surface.p_world),
                            {k_ray_diffuse, 1, 1, 0, 0, 0}, scratch.point);
  binding.program->evaluate(scratch.point, scene_.textures(), scratch.bsdf);
  return std::ranges::any_of(scratch.bsdf.lobes(), [&](const Lobe& lobe) { return lobe.kind == kind; });
}

bool LightWalk::scatter(const LightVertex& vertex, const Vec3& direction, bool first_hit, bool want_shares,
                        Scratch& scratch, LightScatter& result) const {
  if (!vertex.bsdf.has_non_delta()) return false;
  const bool as_stored = same_from(vertex, direction) && (!first_hit || vertex.bsdf.lobes().size() == 1);
  if (as_stored) {
    const BsdfEval eval = vertex.bsdf.eval(vertex.wi_world, direction, Transport::importance);
    result.f_cos = eval.f_cos;
    result.to_camera = eval.pdf_solid_angle;
    result.to_light = eval.pdf_reverse_solid_angle;
    if (want_shares) result.shares = vertex.bsdf.event_shares(vertex.wi_world, direction);
  } else {
    evaluate_from(vertex, direction, scratch);
    if (first_hit) scratch.bsdf.set_least_share(k_camera_least_share);
    const BsdfEval eval = scratch.bsdf.eval(direction, vertex.wi_world, Transport::radiance);
    const float cos_light = std::fabs(dot(vertex.ng_world, vertex.wi_world));
    if (!(cos_light > 1e-6f)) return false;
    result.f_cos = eval.f_cos * (std::fabs(dot(vertex.ng_world, direction)) / cos_light);
    result.to_camera = eval.pdf_reverse_solid_angle;
    result.to_light = eval.pdf_solid_angle;
    if (want_shares) result.shares = scratch.bsdf.event_shares(direction, vertex.wi_world);
  }
  // Directions that only evaluation knows (below the facet, above the smooth surface) belong to camera walks.
  return result.to_camera > 0.0f && result.to_light > 0.0f && !is_black(result.f_cos);
}

}  // namespace lambent
