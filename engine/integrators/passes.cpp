#include "engine/integrators/passes.h"

#include <algorithm>
#include <cmath>

#include "engine/base/check.h"
#include "engine/base/hash.h"
#include "engine/path/surface.h"
#include "engine/path/transmittance.h"
#include "engine/sampling/warp.h"
#include "engine/scene/shadow_ray.h"

namespace lambent {

namespace {

constexpr float k_no_depth = 1e10f;
/// One sample in so many traces a ray for ambient occlusion that serves nothing else, and samples what a surface
/// receives where the integrator does not. The numbers of numbers() make up for the fewer samples.
constexpr uint32_t k_occlusion_step = 2, k_received_step = 4;
/// Where a path stands that leaves the first surface to ask what it receives.
constexpr PathCounts k_counts_behind_first{k_ray_shadow, 1, 0, 0, 0, 0};

bool is_diffuse(uint8_t event) { return event & k_scatter_diffuse; }

/// Number, counted from x_1 = 0, of the diffuse event from which on all are glossy or singular, at least one of them;
/// -1: the path makes no caustic.
int caustic_receiver(const PathSignature& path) {
  int i = path.vertices - 1;
  if (i < 1 || path.events.count != path.vertices || path.vertices > 16) return -1;
  while (i >= 1 && !is_diffuse(path.events[i])) --i;
  return i == path.vertices - 1 ? -1 : i;
}

/// Whether the lobe's own samples are by the cosine at the shading normal.
bool scatters_by_cosine(const Lobe& lobe, const ShadingPoint& point) {
  switch (lobe.kind) {
    case LobeKind::diffuse:
    case LobeKind::oren_nayar:
    case LobeKind::principled_diffuse:
    case LobeKind::principled_retro:
    case LobeKind::principled_sheen:
      return lobe.n == point.ns_world && dot(lobe.n, point.wi_world) > 0.0f;
    default:
      return false;
  }
}

/// @param parts of the evaluation of the pair, or null
ClassShares class_shares(const Bsdf& bsdf, const Vec3& wi_world, const Vec3& wo_world, const EvalParts* parts) {
  return parts && parts->known ? parts->class_shares() : bsdf.class_shares(wi_world, wo_world, Transport::radiance);
}

/// Of all lobes, by their weights.
Vec3 mean_normal(const Bsdf& bsdf, const ShadingPoint& point) {
  Vec3 sum(0.0f);
  int count = 0;
  const Lobe* last = nullptr;
  for (const Lobe& lobe : bsdf.lobes())
    if (!goes_straight(lobe.kind)) {
      sum += lobe.n * average(lobe.weight);
      last = &lobe;
      ++count;
    }
  const Vec3 n = count == 1 ? last->n : normalize(sum);
  return length_squared(n) > 0.0f && is_finite(n) ? n : point.ns_world;
}

}  // namespace

// --- The camera walk -----------------------------------------------------------------------------------------------

PassRecorder::PassRecorder(const PassPlan& plan, const Scene& scene)
    : plan_(plan),
      scene_(scene),
      light_(plan.light_),
      data_(plan.data_),
      slots_(plan.slots_),
      classes_(plan.classes_),
      events_wanted_(plan.events_),
      wants_aovs_(!plan.aovs_.empty()),
      wants_features_(plan.data_slots_.features),
      looks_(!plan.looked_at_.empty()) {}

PassRecorder::PassRecorder(const PassPlan& plan, const Scene& scene, OtherPicture picture)
    : plan_(plan),
      scene_(scene),
      light_(plan.other_light(picture)),
      data_(PassPlan::k_none),
      slots_(plan.other_slots_[static_cast<size_t>(picture)]),
      mattes_(picture == OtherPicture::catcher_lit) {}

uint32_t PassRecorder::pixel_hash() const {
  if (hashed_x_ != x_ || hashed_y_ != y_) {
    pixel_hash_ =
        hash_combine(hash_combine(plan_.settings_.seed, static_cast<uint32_t>(x_)), static_cast<uint32_t>(y_));
    hashed_x_ = x_;
    hashed_y_ = y_;
  }
  return pixel_hash_;
}

float PassRecorder::random() {
  if (!random_begun_) {
    random_state_ = hash_combine(pixel_hash(), sample_);
    random_begun_ = true;
  }
  random_state_ = hash_combine(random_state_, 1);
  return unit_float(random_state_);
}

/// Multiples of irrational numbers, shifted by hashing: the first two fill the square evenly (Roberts 2018, "The
/// Unreasonable Effectiveness of Quasirandom Sequences": R2), the third is the golden section's.
Vec3 PassRecorder::numbers(Own what, uint32_t step) const {
  constexpr uint32_t k_kinds = 3;
  const uint32_t shift = hash_combine(pixel_hash(), surfaces_ * k_kinds + static_cast<uint32_t>(what));
  const uint32_t index = sample_ / step;
  return {unit_float(shift + index * 3242174889u), unit_float(hash_combine(shift, 1) + index * 2447445414u),
          unit_float(hash_combine(shift, 2) + index * 2654435769u)};
}

void PassRecorder::start_clock() {
  if (plan_.data_slots_.time >= 0 || plan_.data_slots_.render_time >= 0) start_ = std::chrono::steady_clock::now();
}

void PassRecorder::begin(int x, int y, uint32_t sample) {
  own_.assign(static_cast<size_t>(plan_.layout_.sample_floats), 0.0f);
  begin(x, y, sample, own_);
}

void PassRecorder::begin(int x, int y, uint32_t sample, std::span<float> floats) {
  DCHECK(floats.size() == static_cast<size_t>(plan_.layout_.sample_floats));
  values_ = floats.data();
  x_ = x;
  y_ = y;
  sample_ = sample;
  surfaces_ = 0;
  random_begun_ = false;
  vertices_ = 0;
  events_ = {};
  saw_surface_ = on_matte_ = met_other_ = false;
  receiving_ = meets_world_ = world_hidden_ = false;
  occlusion_ = Occlusion::done;
  following_ = wants_features_;
  shown_ = stands_for_ = 1.0f;
  if (sample == 0 && looks_) [[unlikely]]
    look(x, y);
}

/// What has no mean is that of the middle of the pixel: the first surface there that is opaque enough.
void PassRecorder::look(int x, int y) {
  for (const PassPlan::Pass& pass : plan_.looked_at_)
    if (pass.kind == PassKind::depth) *at(pass) = k_no_depth;
  const CameraRay middle =
      scene_.camera().sample_ray({static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f}, {0.5f, 0.5f});
  Ray ray{middle.origin, middle.t_min, middle.direction, middle.t_max, k_visible_camera};
  RayCone cone{middle.width_m, middle.spread};
  PathCounts counts;
  ShadingPoint point;
  Bsdf bsdf;
  Hit found;
  for (; counts.transparent <= plan_.settings_.transparent_bounces; ++counts.transparent) {
    if (!scene_.geometry().intersect(ray, found)) return;
    const SurfaceHit hit = scene_.geometry().surface(found);
    if (scene_.instance(hit.instance).holdout) return;
    const SurfaceBinding& binding = scene_.binding(hit.instance, hit.material_slot);
    scene_.fill_shading_point(hit, binding, -ray.direction, found.t, cone, counts, point);
    binding.program->evaluate(point, scene_.textures(), bsdf);
    if (opaque_enough(binding, bsdf)) {
      for (const PassPlan::Pass& pass : plan_.looked_at_) look_at(pass, point);
      return;
    }
    cone.width_m += cone.spread * found.t;
    ray = ray_from_surface(hit.p_world, hit.p_error, hit.ng_world, ray.direction, k_visible_camera);
  }
}

void PassRecorder::look_at(const PassPlan::Pass& pass, const ShadingPoint& point) {
  float* to = at(pass);
  if (pass.kind == PassKind::depth) {
    *to = scene_.view().camera_from_world.point(point.p_world).z;
  } else if (pass.kind == PassKind::position) {
    const Vec3 p = point.p_world + point.origin_shift;
    std::copy_n(&p.x, 3, to);
  } else if (pass.kind == PassKind::object_index) {
    *to = static_cast<float>(point.object_pass_index);
  } else if (pass.kind == PassKind::material_index) {
    *to = static_cast<float>(point.material_pass_index);
  }
}

bool PassRecorder::opaque_enough(const SurfaceBinding& binding, const Bsdf& bsdf) const {
  return !binding.program->traits().may_be_transparent ||
         1.0f - average(bsdf.transparency()) >= plan_.settings_.alpha_threshold;
}

void PassRecorder::evaluate(const Program& program, const ShadingPoint& point, Bsdf& bsdf) {
  aov_values_.resize(static_cast<size_t>(program.aov_count()));
  program.evaluate_with_aovs(point, scene_.textures(), bsdf, aov_values_);
}

void PassRecorder::visible(const SurfaceHit& hit, const SurfaceBinding& binding, const ShadingPoint& point,
                           const Bsdf& bsdf, const Color& throughput) {
  if (data_.empty()) return;
  ++surfaces_;
  const PassPlan::DataSlots& slots = plan_.data_slots_;
  const float seen = average(throughput);
  const float cover = seen * (1.0f - average(bsdf.transparency()));
  if (slots.albedos) add_colors(point, bsdf, throughput);
  if (slots.sharp) add_sharp(point, bsdf, throughput);
  // What is seen of the mist's opposite; finish() turns it round.
  if (slots.mist >= 0) values_[slots.mist] += (1.0f - mist(point)) * cover;
  if (cover > 0.0f) {
    if (slots.ambient_occlusion >= 0) occlusion(hit, point, bsdf, cover);
    if (!plan_.ids_.empty()) add_ids(binding, point, cover);
  }
  for (const PassPlan::Pass& pass : plan_.mattes_)
    if (scene_.in_matte(point.object_index, pass.matte)) *at(pass) += cover;
  if (evaluates(*binding.program) && cover != 0.0f) add_aovs(*binding.program, cover);
  receiving_ = shared_ && slots.shadow >= 0;
  if (slots.shadow >= 0 && !shared_ && samples_for_passes(k_received_step))
    sample_received(hit, point, bsdf, throughput);
  if (!saw_surface_ && opaque_enough(binding, bsdf)) {
    if (slots.first_surface) first_surface(hit, point, bsdf, seen);
    saw_surface_ = true;
  }
}

[[gnu::always_inline]] inline void PassRecorder::add_colors(const ShadingPoint& point, const Bsdf& bsdf,
                                                            const Color& throughput) {
  const PassPlan::DataSlots& slots = plan_.data_slots_;
  if (const std::optional<LobeClass> only = bsdf.class_of_only_lobe()) {
    const Color albedo = bsdf.albedo(point.wi_world);
    add_if(slots.colors[static_cast<size_t>(*only)], throughput * albedo);
    return;
  }
  const ClassAlbedos albedos = bsdf.class_albedos(point.wi_world);
  for (size_t c = 0; c < slots.colors.size(); ++c)
    if (slots.colors[c] >= 0 && !is_black(albedos.of[c])) add_to(slots.colors[c], throughput * albedos.of[c]);
}

void PassRecorder::add_sharp(const ShadingPoint& point, const Bsdf& bsdf, const Color& throughput) {
  const PassPlan::DataSlots& slots = plan_.data_slots_;
  const SpecularFeatures found = specular_features(bsdf, point.wi_world);
  add_if(slots.denoising_specular_albedo, throughput * found.albedo);
  if (slots.denoising_roughness >= 0) values_[slots.denoising_roughness] += found.roughness * average(throughput);
}

[[gnu::always_inline]] inline float PassRecorder::mist(const ShadingPoint& point) const {
  const Vec3 p = scene_.view().camera_from_world.point(point.p_world);
  const float distance = scene_.view().perspective ? length(p) : std::fabs(p.z);
  const float exponent = plan_.settings_.mist_exponent;
  const float mist = std::clamp((distance - plan_.settings_.mist_start_m) * plan_.data_slots_.mist_per_m, 0.0f, 1.0f);
  return exponent == 2.0f ? mist * mist : exponent == 1.0f ? mist : std::pow(mist, exponent);
}

/// @param cover above 0
[[gnu::always_inline]] inline void PassRecorder::add_ids(const SurfaceBinding& binding, const ShadingPoint& point,
                                                         float cover) {
  const std::vector<PassKind>& kinds = plan_.ids_;
  const auto& of_object = scene_.ids(point.object_index);
  const auto id_of = [&](PassKind kind) {
    return kind == PassKind::cryptomatte_material ? binding.material_id
           : kind == PassKind::cryptomatte_object ? of_object.object
                                                  : of_object.asset;
  };
  const auto is_it = [&](const float* ids) {
    for (size_t k = 0; k < kinds.size(); ++k)
      if (ids[k] != id_of(kinds[k])) return false;
    return true;
  };
  float* thing = values_ + plan_.layout_.id_sample;
  for (int i = 1; i < k_ids_a_sample && thing[0] > 0.0f && !is_it(thing + 1); ++i) thing += 1 + kinds.size();
  if (!(thing[0] > 0.0f))
    for (size_t k = 0; k < kinds.size(); ++k) thing[1 + k] = id_of(kinds[k]);
  thing[0] += cover;
}

/// What evaluate() found at the surface.
[[gnu::always_inline]] inline void PassRecorder::add_aovs(const Program& program, float cover) {
  if (aovs_of_ != &program) {
    aovs_of_ = &program;
    aov_numbers_.clear();
    for (const PassPlan::Pass& pass : plan_.aovs_) aov_numbers_.push_back(program.find_aov(pass.aov));
  }
  for (size_t i = 0; i < aov_numbers_.size(); ++i) {
    if (aov_numbers_[i] < 0) continue;
    const AovValue& value = aov_values_[static_cast<size_t>(aov_numbers_[i])];
    const PassPlan::Pass& pass = plan_.aovs_[i];
    if (pass.kind == PassKind::aov_value) {
      *at(pass) += value.number * cover;
    } else {
      add_to(pass, value.color * cover);
      at(pass)[3] += cover;
    }
  }
}

[[gnu::always_inline]] inline void PassRecorder::first_surface(const SurfaceHit& hit, const ShadingPoint& point,
                                                               const Bsdf& bsdf, float seen) {
  const PassPlan::DataSlots& slots = plan_.data_slots_;
  if (slots.vector >= 0) {
    // As in Cycles every sample that got here counts alike, whatever stands before.
    add_motion(scene_.motion()->vector_px(hit, scene_.geometry().instance(hit.instance)));
  }
  if (slots.vector_weight >= 0) values_[slots.vector_weight] = 1.0f;
  if (slots.normal >= 0) add_to(slots.normal, mean_normal(bsdf, point) * seen);
  if (slots.uv >= 0) {
    if (uv_of_ != hit.mesh) {
      uv_of_ = hit.mesh;
      uv_number_ = hit.mesh->find_uv({});
    }
    if (uv_number_ < 0) return;
    const Vec4 value = hit.mesh->attribute(uv_number_, hit.primitive, hit.barycentric);
    add_to(slots.uv, Vec3(value.x, value.y, 1.0f) * seen);
  }
}

void PassRecorder::missed(const Vec3& direction_world) {
  if (data_.empty() || !plan_.data_slots_.world_moves || saw_surface_) return;
  add_motion(scene_.motion()->vector_px(direction_world));
  values_[plan_.data_slots_.vector_weight] = 1.0f;
}

[[gnu::always_inline]] inline void PassRecorder::add_motion(const Vec4& motion_px) {
  if (std::isfinite(motion_px.x + motion_px.y + motion_px.z + motion_px.w))
    std::copy_n(&motion_px.x, 4, values_ + plan_.data_slots_.vector);
}

/// Of what a ray from the point, by the cosine, meets nothing within the distance that the world asks for.
[[gnu::always_inline]] inline void PassRecorder::occlusion(const SurfaceHit& hit, const ShadingPoint& point,
                                                           const Bsdf& bsdf, float cover) {
  occlusion_cover_ = cover;
  values_[plan_.data_slots_.ambient_occlusion + 2] += cover;
  if (shared_ && scene_.profile().alike_for_shadows && !bsdf.empty())
    occlusion_ = Occlusion::scattering;
  else
    occlude(hit, point);
}

void PassRecorder::occlude(const SurfaceHit& hit, const ShadingPoint& point) {
  // Where the next ray often serves, the others are few.
  const uint32_t step = shared_ ? 1 : k_occlusion_step;
  if (!samples_for_passes(step)) return;
  const Vec3 u = numbers(Own::occlusion, step);
  const Vec3 direction = Frame::from_normal(point.ns_world).to_world(sample_cosine_hemisphere({u.x, u.y}));
  float found = 0.0f;  // below the surface
  if (dot(direction, point.ng_world) > 0.0f) {
    const Vec3 origin = offset_origin(hit.p_world, hit.p_error, hit.ng_world, direction);
    found = open({origin, 0.0f, direction, plan_.settings_.ambient_occlusion_distance_m, k_visible_shadow});
  }
  add_occlusion(found, static_cast<float>(step));
}

void PassRecorder::sampled(const SurfaceHit& hit, const ShadingPoint& point, const Bsdf& bsdf, const BsdfSample& sample,
                           int picked) {
  if (occlusion_ != Occlusion::scattering) return;
  occlusion_ = Occlusion::done;
  if (bsdf.lobes().size() == 1) picked = 0;
  // Which lobe is picked does not depend on where it scatters to.
  if (picked < 0 || !scatters_by_cosine(bsdf.lobes()[static_cast<size_t>(picked)], point)) {
    occlude(hit, point);
  } else if (sample.event == k_scatter_none) {  // below the surface
    add_occlusion(0.0f);
  } else {
    occlusion_ = Occlusion::next_ray;
    occlusion_ray_ = ray_from_surface(hit.p_world, hit.p_error, hit.ng_world, sample.wo_world, k_visible_shadow);
    occlusion_ray_.t_max = plan_.settings_.ambient_occlusion_distance_m;
  }
}

/// @param weight how many samples it stands for
void PassRecorder::add_occlusion(float open, float weight) {
  float* const sums = values_ + plan_.data_slots_.ambient_occlusion;
  sums[0] += weight * occlusion_cover_ * open;
  sums[1] += weight * occlusion_cover_;
}

/// How much of the light along the ray gets there.
float PassRecorder::open(const Ray& ray) const { return average(transmittance(ray)); }

void PassRecorder::next_ray(float t, const Program* met) {
  occlusion_ = Occlusion::done;
  const bool free = !met || t > occlusion_ray_.t_max;
  add_occlusion(free ? 1.0f : lets_through(met->traits(), k_ray_shadow) ? open(occlusion_ray_) : 0.0f);
}

/// As rays from what the camera sees meet it.
Color PassRecorder::transmittance(const Ray& ray, uint8_t blockers) const {
  const auto& trace = scene_.profile().transparency ? segment_transmittance<true> : segment_transmittance<false>;
  return trace(scene_, ray, k_counts_behind_first, plan_.settings_.transparent_bounces, nullptr, blockers);
}

/// One sampled light with and without what stands before it, and an even world.
void PassRecorder::sample_received(const SurfaceHit& hit, const ShadingPoint& point, const Bsdf& bsdf,
                                   const Color& throughput) {
  if (!bsdf.has_non_delta()) return;
  if (scene_.lights().has_even_world()) receive_world(hit, point, bsdf, throughput);
  if (scene_.lights().empty(EvenWorld::left_to_scattering)) return;
  const Vec3 u = numbers(Own::light, k_received_step);
  const LightSample light = scene_.lights().sample(hit.p_world, light_receiver_normal(bsdf, point.ng_world), {u.x, u.y},
                                                   scene_.light_choices(hit.instance, EvenWorld::left_to_scattering));
  if (!light || !(light.pdf_solid_angle > 0.0f) || !scene_.reaches(light.traits->linked.receivers, hit.instance))
    return;
  Color f = bsdf.eval(point.wi_world, light.direction_world, Transport::radiance, ReversePdf::no).f_cos;
  if (light.traits->hidden_from & k_visible_scattered)
    f *= share_that_sees(bsdf, point.wi_world, light.direction_world, light.traits->hidden_from,
                         scene_.lights().kind(light.light) == LightKind::triangle);
  const Color unshadowed =
      throughput * f * scene_.sample_radiance(light, k_counts_behind_first) * (1.0f / light.pdf_solid_angle);
  if (is_black(unshadowed)) return;
  if (light.traits->shadows)
    received(unshadowed * transmittance(shadow_ray(scene_, hit, light), light.traits->linked.blockers), unshadowed);
  else
    received(unshadowed, unshadowed);
}

/// A world that looks alike from all sides, by a ray that the surface scatters (LightSet: nothing finds it better).
void PassRecorder::receive_world(const SurfaceHit& hit, const ShadingPoint& point, const Bsdf& bsdf,
                                 const Color& throughput) {
  const Vec3 u = numbers(Own::world, k_received_step);
  const BsdfSample sample = bsdf.sample(point.wi_world, u.z, {u.x, u.y}, Transport::radiance, ReversePdf::no);
  constexpr uint8_t k_others = k_scatter_delta | k_scatter_transparent | k_scatter_subsurface | k_scatter_portal;
  if (sample.event == k_scatter_none || (sample.event & k_others)) return;
  BounceState bounces;
  bounces.advance(sample.event, EventCounts{});
  const PathCounts counts{bounces.ray_kind, 1, bounces.diffuse, bounces.glossy, bounces.transmission, 0};
  Color unshadowed(0.0f);
  scene_.lights().for_each_infinite(sample.wo_world, counts.ray_kind, [&](const LightHit& light) {
    if (scene_.source_of(light.light) == LightSource::background)
      unshadowed += throughput * sample.weight * scene_.light_radiance(light, counts);
  });
  if (is_black(unshadowed)) return;
  const Ray ray = ray_from_surface(hit.p_world, hit.p_error, hit.ng_world, sample.wo_world, k_visible_shadow);
  received(unshadowed * transmittance(ray), unshadowed);
}

void PassRecorder::hide_world(const Vec3& direction_world, const Color& throughput, const PathCounts& counts) {
  world_hidden_ = true;
  scene_.lights().for_each_infinite(direction_world, counts.ray_kind, [&](const LightHit& hit) {
    if (scene_.source_of(hit.light) == LightSource::background)
      received(Color(0.0f), throughput * scene_.light_radiance(hit, counts));
  });
}

void PassRecorder::scattered(uint32_t instance, const Bsdf& bsdf, const Vec3& wi_world, const BsdfSample& sample,
                             const EvalParts* parts) {
  if (mattes_) {
    if (vertices_ == 0) on_matte_ = scene_.instance(instance).matte;
    met_other_ = met_other_ || scene_.instance(instance).holdout;
  }
  const bool delta = sample.event & k_scatter_delta;
  const bool asks_class = classes_ && vertices_ == 0;
  if (delta) {
    if (asks_class) first_only_ = sample.event & k_scatter_transmission ? LobeClass::transmission : LobeClass::glossy;
    if (events_wanted_) events_.append(sample.event);
  } else if (bsdf.lobes().size() == 1) {
    const LobeFacts& facts = bsdf.facts_of_only_lobe(wi_world, sample.wo_world);
    if (asks_class) first_only_ = facts.one;
    if (events_wanted_) events_.append(facts.event);
  } else {
    if (asks_class) {
      first_only_.reset();
      first_ = class_shares(bsdf, wi_world, sample.wo_world, parts);
    }
    if (events_wanted_) events_.append(event_of_several(bsdf, wi_world, sample.wo_world, parts));
  }
  ++vertices_;
}

uint8_t PassRecorder::event_of_several(const Bsdf& bsdf, const Vec3& wi_world, const Vec3& wo_world,
                                       const EvalParts* parts) {
  if (parts && parts->known) {
    const EventShares& pdf = parts->pdf;
    const float total = pdf.diffuse + pdf.glossy + pdf.transmission;
    if (total > 0.0f && std::isfinite(total)) {
      if (pdf.diffuse == total) return k_scatter_diffuse;
      if (pdf.glossy == total) return k_scatter_glossy;
      return event_by_share(pdf, random() * total);
    }
  }
  if (const std::optional<uint8_t> only = bsdf.only_event(wi_world, wo_world)) return *only;
  return event_by_share(bsdf, wi_world, wo_world, random());
}

void PassRecorder::met(const Color& value, LightSource source, uint16_t group) {
  add(value, {vertices_, vertices_ > 0 ? &first_ : nullptr, events_, source, group, Technique::emission_hit,
              on_matte_ && met_other_, first_only_});
}

void PassRecorder::see_through(const Vec3& direction_world, const Color& throughput, const PathCounts& counts) {
  if (slots_.environment < 0 && slots_.groups.empty() && slots_.by_rule.empty() && !following_) return;
  scene_.lights().for_each_infinite(direction_world, counts.ray_kind, [&](const LightHit& hit) {
    const Color value = throughput * scene_.light_radiance(hit, counts);
    const Color exposed = value * plan_.settings_.exposure;
    const PathSignature path{0, nullptr, {}, scene_.source_of(hit.light), hit.traits->group, Technique::emission_hit};
    if (path.source == LightSource::background) add_if(slots_.environment, exposed);
    if (path.group < slots_.groups.size()) add_if(slots_.groups[path.group], exposed);
    for (const PassPlan::Pass& pass : slots_.by_rule) {
      Color part;
      const bool shown = pass.kind == PassKind::environment || pass.group;
      if (shown && takes(pass, path, value, part)) add_to(pass, part * plan_.settings_.exposure);
    }
    if (following_ && path.source == LightSource::background) follow_light(value);
  });
}

bool PassRecorder::meets_other(const LightWalk& walk, int depth) const {
  for (int i = 0; i < walk.size() && walk[i].depth <= depth; ++i)
    if (scene_.instance(walk[i].surface.instance).holdout) return true;
  return false;
}

[[gnu::always_inline]] inline void PassRecorder::add_joined(const Color& value, uint32_t instance, const Bsdf& bsdf,
                                                            const Vec3& wi_world, const Vec3& wo_world,
                                                            Technique technique, const EventSequence& light_side,
                                                            LightSource source, uint16_t group, const LightWalk* walk,
                                                            const EvalParts* parts) {
  if (light_.empty()) return;
  PathSignature path{vertices_ + 1 + light_side.count, &first_, {}, source, group, technique};
  if (mattes_) {
    const InstanceShading& here = scene_.instance(instance);
    path.brought = (vertices_ == 0 ? here.matte : on_matte_) &&
                   (met_other_ || here.holdout || (walk && meets_other(*walk, light_side.count)));
  }
  ClassShares here;
  path.first_only = first_only_;
  const bool asks_class = classes_ && vertices_ == 0;
  // Paths of one event make no caustics.
  const bool asks_events = events_wanted_ && (plan_.expressions_ || path.vertices > 1);
  uint8_t event = k_scatter_none;
  if (bsdf.lobes().size() == 1) {
    const LobeFacts& facts = bsdf.facts_of_only_lobe(wi_world, wo_world);
    if (asks_class) path.first_only = facts.one;
    event = facts.event;
  } else {
    if (asks_class) {
      path.first_only.reset();
      here = class_shares(bsdf, wi_world, wo_world, parts);
      path.first = &here;
    }
    if (asks_events) event = event_of_several(bsdf, wi_world, wo_world, parts);
  }
  if (asks_events) {
    path.events = events_;
    path.events.append(event);
    path.events.append_packed(light_side.bits, light_side.count);
  }
  add(value, path);
}

void PassRecorder::joined(const Color& value, uint32_t instance, const Bsdf& bsdf, const Vec3& wi_world,
                          const Vec3& wo_world, Technique technique, const EventSequence& light_side,
                          LightSource source, uint16_t group, const LightWalk* walk, const EvalParts* parts) {
  add_joined(value, instance, bsdf, wi_world, wo_world, technique, light_side, source, group, walk, parts);
}

void PassRecorder::lit(const Color& value, uint32_t instance, const Bsdf& bsdf, const Vec3& wi_world,
                       const Vec3& wo_world, LightSource source, uint16_t group, const EvalParts& parts) {
  add_joined(value, instance, bsdf, wi_world, wo_world, Technique::next_event, {}, source, group, nullptr, &parts);
}

void PassRecorder::add_other(OtherPicture picture, const Color& radiance, float cover, const PassRecorder* parts) {
  others_[static_cast<size_t>(picture)] = radiance;
  if (picture == OtherPicture::catcher_lit) cover_ = cover;
  if (!parts) return;
  for (const PassPlan::Pass& pass : parts->light_) {
    const float* from = parts->values_ + pass.sample;
    add_to(pass, {from[0], from[1], from[2]});
  }
}

/// All of it to this sample.
void PassRecorder::finish_time() {
  const PassPlan::DataSlots& slots = plan_.data_slots_;
  const std::chrono::steady_clock::time_point before = start_;
  start_clock();
  const float microseconds = std::chrono::duration<float, std::micro>(start_ - before).count();
  if (slots.time >= 0) values_[slots.time] = microseconds;
  if (slots.render_time >= 0) values_[slots.render_time] = 1e-3f * microseconds;
}

void PassRecorder::finish(const Vec4& picture, const Color& behind, bool last) {
  const float all[4] = {picture.x, picture.y, picture.z, picture.w};
  std::copy_n(all, 4, values_);
  if (occlusion_ == Occlusion::next_ray) add_occlusion(open(occlusion_ray_));
  for (const PassPlan::Pass& pass : plan_.pictures_) std::copy_n(all, pass.kind == PassKind::noisy ? 4 : 3, at(pass));
  for (const PassPlan::Pass& pass : plan_.late_) {
    if (pass.kind == PassKind::without_shadow) add_to(pass, other(OtherPicture::without_shadows));
    if (pass.kind == PassKind::catcher_lit) add_to(pass, other(OtherPicture::catcher_lit));
    if (pass.kind == PassKind::catcher_bare) add_to(pass, other(OtherPicture::catcher_bare));
    if (pass.kind == PassKind::catcher_cover) *at(pass) = cover_;
    if (pass.kind == PassKind::catcher_behind) add_to(pass, behind);
  }
  const PassPlan::DataSlots& slots = plan_.data_slots_;
  if (slots.mist >= 0) values_[slots.mist] = 1.0f - values_[slots.mist];
  if (last && (slots.time >= 0 || slots.render_time >= 0)) finish_time();
  for (const PassPlan::Copy& copy : plan_.copies_) std::copy_n(values_ + copy.from, copy.floats, values_ + copy.to);
}

// --- Where values go -----------------------------------------------------------------------------------------------

bool PassRecorder::takes(const PassPlan::Pass& pass, const PathSignature& path, const Color& value, Color& part) {
  const auto of_class = [&](LobeClass c) {
    part = path.share(c, value);
    return !is_black(part);
  };
  const int n = path.vertices;
  part = value;
  switch (pass.kind) {
    case PassKind::diffuse_direct:
      return n == 1 && of_class(LobeClass::diffuse);
    case PassKind::diffuse_indirect:
      return n > 1 && of_class(LobeClass::diffuse);
    case PassKind::glossy_direct:
      return n == 1 && of_class(LobeClass::glossy);
    case PassKind::glossy_indirect:
      return n > 1 && of_class(LobeClass::glossy);
    case PassKind::transmission_direct:
      return n == 1 && of_class(LobeClass::transmission);
    case PassKind::transmission_indirect:
      return n > 1 && of_class(LobeClass::transmission);
    case PassKind::emission:
      return n == 0 && path.source != LightSource::background;
    case PassKind::environment:
      return n == 0 && path.source == LightSource::background;
    case PassKind::light_group:
      return path.group == pass.group;
    case PassKind::matte_light:
      return path.brought;
    case PassKind::caustics_direct:
      // The receiver's own scattering counts by share, the events after it as they were chosen.
      return caustic_receiver(path) == 0 && of_class(LobeClass::diffuse);
    case PassKind::caustics_indirect:
      return caustic_receiver(path) > 0;
    case PassKind::technique_unidirectional:
      return path.technique == Technique::emission_hit || path.technique == Technique::next_event;
    case PassKind::technique_connection:
      return path.technique == Technique::connection || path.technique == Technique::light_tracing;
    case PassKind::technique_merging:
      return path.technique == Technique::merging;
    case PassKind::light_path:
      return pass.expression->matches(path.events, path.source, path.group);
    default:  // the whole picture, or what a light group is in it
      return !pass.group || path.group == *pass.group;
  }
}

[[gnu::always_inline]] inline void PassRecorder::add(const Color& radiance, const PathSignature& path) {
  const Color value = radiance * plan_.settings_.exposure;
  if (path.vertices == 0) {
    add_if(path.source == LightSource::background ? slots_.environment : slots_.emission, value);
  } else {
    const std::array<int, k_lobe_classes>& classes = path.vertices == 1 ? slots_.direct : slots_.indirect;
    if (path.first_only)
      add_if(classes[static_cast<size_t>(*path.first_only)], value);
    else
      for (size_t c = 0; c < classes.size(); ++c)
        if (classes[c] >= 0) add_to(classes[c], value * path.first->of[c]);
  }
  if (path.group < slots_.groups.size()) add_if(slots_.groups[path.group], value);
  add_if(slots_.techniques[static_cast<size_t>(path.technique)], value);
  if (path.vertices > 1 && (slots_.caustics_direct >= 0 || slots_.caustics_indirect >= 0)) {
    const int receiver = caustic_receiver(path);
    // The receiver's own scattering counts by share, the events after it as they were chosen.
    if (receiver > 0) add_if(slots_.caustics_indirect, value);
    if (receiver == 0) add_if(slots_.caustics_direct, path.share(LobeClass::diffuse, value));
  }
  if (!slots_.by_rule.empty()) [[unlikely]]
    add_by_rule(radiance, path);
}

/// @param path by value, so that what calls this need not have it in memory
[[gnu::noinline]] void PassRecorder::add_by_rule(const Color& radiance, PathSignature path) {
  for (const PassPlan::Pass& pass : slots_.by_rule) {
    Color part;
    if (takes(pass, path, radiance, part)) add_to(pass, part * plan_.settings_.exposure);
  }
}

}  // namespace lambent
