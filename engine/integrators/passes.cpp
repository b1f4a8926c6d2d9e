#include "engine/integrators/passes.h"

#include <algorithm>
#include <cmath>

#include "engine/base/hash.h"
#include "engine/path/shadow_ray.h"
#include "engine/path/surface.h"
#include "engine/path/transmittance.h"
#include "engine/sampling/warp.h"

namespace lambent {

namespace {

constexpr float k_no_depth = 1e10f;
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

}  // namespace

// --- The camera walk -----------------------------------------------------------------------------------------------

PassRecorder::PassRecorder(const PassPlan& plan, const Scene& scene)
    : plan_(plan),
      scene_(scene),
      light_(plan.light_),
      data_(plan.data_),
      values_(static_cast<size_t>(plan.layout_.sample_floats), 0.0f),
      classes_(plan.classes_),
      events_wanted_(plan.events_) {}

PassRecorder::PassRecorder(const PassPlan& plan, const Scene& scene, OtherPicture picture)
    : plan_(plan),
      scene_(scene),
      light_(plan.other_light(picture)),
      data_(PassPlan::k_none),
      values_(static_cast<size_t>(plan.layout_.sample_floats), 0.0f),
      mattes_(picture == OtherPicture::catcher_lit) {}

float PassRecorder::random() {
  random_state_ = hash_combine(random_state_, 1);
  return unit_float(random_state_);
}

void PassRecorder::begin(int x, int y, uint32_t sample) {
  if (plan_.timed_ && !data_.empty()) start_ = std::chrono::steady_clock::now();
  std::fill(values_.begin(), values_.end(), 0.0f);
  random_state_ = hash_combine(
      hash_combine(hash_combine(plan_.settings_.seed, static_cast<uint32_t>(x)), static_cast<uint32_t>(y)), sample);
  vertices_ = 0;
  events_ = {};
  saw_surface_ = on_matte_ = met_other_ = false;
  if (sample == 0 && plan_.looks_ && !data_.empty()) look(x, y);
}

/// What has no mean is that of the middle of the pixel: the first surface there that is opaque enough.
void PassRecorder::look(int x, int y) {
  for (const PassPlan::Pass& pass : data_)
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
      for (const PassPlan::Pass& pass : data_) look_at(pass, point);
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

void PassRecorder::visible(const SurfaceHit& hit, const SurfaceBinding& binding, const ShadingPoint& point,
                           const Bsdf& bsdf, const Color& throughput) {
  const float opacity = 1.0f - average(bsdf.transparency());
  const float seen = average(throughput);
  const bool first = !saw_surface_ && opaque_enough(binding, bsdf);
  mean_normal_.reset();
  for (const PassPlan::Pass& pass : data_) {
    switch (pass.kind) {
      case PassKind::diffuse_color:
        add_to(pass, throughput * bsdf.class_albedo(LobeClass::diffuse, point.wi_world));
        break;
      case PassKind::glossy_color:
        add_to(pass, throughput * bsdf.class_albedo(LobeClass::glossy, point.wi_world));
        break;
      case PassKind::transmission_color:
        add_to(pass, throughput * bsdf.class_albedo(LobeClass::transmission, point.wi_world));
        break;
      case PassKind::denoising_albedo:
        add_to(pass, throughput * (bsdf.emission() + bsdf.albedo(point.wi_world) - bsdf.transparency()));
        break;
      case PassKind::mist: {
        // What is seen of the mist's opposite; finish() turns it round.
        const Vec3 p = scene_.view().camera_from_world.point(point.p_world);
        const float distance = scene_.view().perspective ? length(p) : std::fabs(p.z);
        const float depth = plan_.settings_.mist_depth_m;
        float mist = std::clamp((distance - plan_.settings_.mist_start_m) / (depth > 0.0f ? depth : 1e-6f), 0.0f, 1.0f);
        mist = std::pow(mist, plan_.settings_.mist_exponent);
        *at(pass) += (1.0f - mist) * seen * opacity;
        break;
      }
      case PassKind::ambient_occlusion:
        if (opacity > 0.0f) add_to(pass, Color(occlusion(hit, point) * seen * opacity));
        break;
      case PassKind::shadow: {
        Color shadowed(0.0f), unshadowed(0.0f);
        received(hit, point, bsdf, shadowed, unshadowed);
        add_to(pass, throughput * shadowed);
        add_to(pass.divisor, throughput * unshadowed);
        break;
      }
      case PassKind::aov_color:
      case PassKind::aov_value: {
        const int aov = binding.program->find_aov(pass.aov);
        float* to = at(pass);
        const float weight = seen * opacity;
        if (aov < 0 || weight == 0.0f) break;
        if (pass.kind == PassKind::aov_color) to[3] += weight;
        const Color value =
            binding.program->aov(aov, pass.kind == PassKind::aov_value, point, scene_.textures()) * weight;
        to[0] += value.x;
        if (pass.kind == PassKind::aov_value) break;
        to[1] += value.y;
        to[2] += value.z;
        break;
      }
      case PassKind::matte:
        if (scene_.in_matte(point.object_index, pass.matte)) *at(pass) += seen * opacity;
        break;
      case PassKind::cryptomatte_object:
        add_id(pass, scene_.ids(point.object_index).object, seen * opacity);
        break;
      case PassKind::cryptomatte_asset:
        add_id(pass, scene_.ids(point.object_index).asset, seen * opacity);
        break;
      case PassKind::cryptomatte_material:
        add_id(pass, binding.material_id, seen * opacity);
        break;
      default:
        if (first) first_surface(pass, hit, point, bsdf, seen);
    }
  }
  saw_surface_ = saw_surface_ || first;
}

void PassRecorder::first_surface(const PassPlan::Pass& pass, const SurfaceHit& hit, const ShadingPoint& point,
                                 const Bsdf& bsdf, float seen) {
  float* to = at(pass);
  const auto put = [&](const Vec3& v) {
    to[0] = v.x;
    to[1] = v.y;
    to[2] = v.z;
  };
  const auto mean_normal = [&] {
    if (mean_normal_) return *mean_normal_;
    Vec3 sum(0.0f);
    for (const Lobe& lobe : bsdf.lobes())
      if (lobe.kind != LobeKind::transparent && lobe.kind != LobeKind::portal) sum += lobe.n * average(lobe.weight);
    const Vec3 n = normalize(sum);
    mean_normal_ = length_squared(n) > 0.0f && is_finite(n) ? n : point.ns_world;
    return *mean_normal_;
  };
  switch (pass.kind) {
    case PassKind::vector: {
      // As in Cycles every sample that got here counts alike, whatever stands before.
      const Vec4 motion = scene_.motion()->vector_px(hit, scene_.geometry().instance(hit.instance));
      if (!std::isfinite(motion.x + motion.y + motion.z + motion.w)) break;
      std::copy_n(&motion.x, 4, to);
      break;
    }
    case PassKind::vector_weight:
      *to = 1.0f;
      break;
    case PassKind::denoising_depth:
      *to = length(point.p_world - scene_.camera().origin()) * seen;
      break;
    case PassKind::normal:
      put(mean_normal() * seen);
      break;
    case PassKind::denoising_normal:
      if (!bsdf.empty()) put(scene_.view().camera_from_world.vector(mean_normal()) * seen);
      break;
    case PassKind::uv: {
      const int uv = hit.mesh->find_uv({});
      if (uv < 0) break;
      const Vec4 value = hit.mesh->attribute(uv, hit.primitive, hit.barycentric);
      put(Vec3(value.x, value.y, 1.0f) * seen);
      break;
    }
    default:
      break;
  }
}

/// Whether a ray from the point, by the cosine, meets nothing within the distance that the world asks for.
float PassRecorder::occlusion(const SurfaceHit& hit, const ShadingPoint& point) {
  const Vec2 u(random(), random());
  const Vec3 direction = Frame::from_normal(point.ns_world).to_world(sample_cosine_hemisphere(u));
  if (!(dot(direction, point.ng_world) > 0.0f)) return 0.0f;
  const Vec3 origin = offset_origin(hit.p_world, hit.p_error, hit.ng_world, direction);
  const Ray ray{origin, 0.0f, direction, plan_.settings_.ambient_occlusion_distance_m, k_visible_shadow};
  return average(transmittance(ray));
}

/// As rays from what the camera sees meet it.
Color PassRecorder::transmittance(const Ray& ray, uint8_t blockers) const {
  const auto& trace = scene_.profile().transparency ? segment_transmittance<true> : segment_transmittance<false>;
  return trace(scene_, ray, k_counts_behind_first, plan_.settings_.transparent_bounces, nullptr, blockers);
}

/// One sampled light with and without what stands before it.
void PassRecorder::received(const SurfaceHit& hit, const ShadingPoint& point, const Bsdf& bsdf, Color& shadowed,
                            Color& unshadowed) {
  if (!bsdf.has_non_delta() || scene_.lights().empty()) return;
  const Vec2 u(random(), random());
  const LightSample light = scene_.lights().sample(hit.p_world, light_receiver_normal(bsdf, point.ng_world), u,
                                                   scene_.light_choices(hit.instance, EvenWorld::sampled));
  if (!light || !(light.pdf_solid_angle > 0.0f) || !scene_.reaches(light.traits->linked.receivers, hit.instance))
    return;
  const Color f = bsdf.eval(point.wi_world, light.direction_world, Transport::radiance, ReversePdf::no).f_cos;
  unshadowed = f * scene_.sample_radiance(light, k_counts_behind_first) * (1.0f / light.pdf_solid_angle);
  if (is_black(unshadowed)) return;
  shadowed = unshadowed;
  if (light.traits->shadows) shadowed *= transmittance(shadow_ray(scene_, hit, light), light.traits->linked.blockers);
}

void PassRecorder::scattered(uint32_t instance, const Bsdf& bsdf, const Vec3& wi_world, const BsdfSample& sample) {
  if (mattes_) {
    if (vertices_ == 0) on_matte_ = scene_.instance(instance).matte;
    met_other_ = met_other_ || scene_.instance(instance).holdout;
  }
  const bool delta = sample.event & k_scatter_delta;
  if (classes_ && vertices_ == 0)
    first_ =
        delta ? ClassShares::all_of(sample.event & k_scatter_transmission ? LobeClass::transmission : LobeClass::glossy)
              : bsdf.class_shares(wi_world, sample.wo_world, Transport::radiance);
  if (events_wanted_) events_.append(delta ? sample.event : event_at(bsdf, wi_world, sample.wo_world));
  ++vertices_;
}

uint8_t PassRecorder::event_at(const Bsdf& bsdf, const Vec3& wi_world, const Vec3& wo_world) {
  return event_by_share(bsdf, wi_world, wo_world, random());
}

void PassRecorder::met(const Color& value, LightSource source, uint16_t group) {
  add(value, {vertices_, vertices_ > 0 ? &first_ : nullptr, events_, source, group, Technique::emission_hit,
              on_matte_ && met_other_});
  if (source == LightSource::background && vertices_ == 0) add_background_albedo(value);
}

void PassRecorder::see_through(const Vec3& direction_world, const Color& throughput, const PathCounts& counts) {
  scene_.lights().for_each_infinite(direction_world, counts.ray_kind, [&](const LightHit& hit) {
    const Color value = throughput * scene_.light_radiance(hit, counts);
    const PathSignature path{0, nullptr, {}, scene_.source_of(hit.light), hit.traits->group, Technique::emission_hit};
    for (const PassPlan::Pass& pass : light_) {
      Color part;
      const bool shown = pass.kind == PassKind::environment || pass.group;
      if (shown && takes(pass, path, value, part)) add_to(pass, part * plan_.settings_.exposure);
    }
    if (path.source == LightSource::background) add_background_albedo(value);
  });
}

void PassRecorder::add_background_albedo(const Color& value) {
  for (const PassPlan::Pass& pass : data_)
    if (pass.kind == PassKind::denoising_albedo) add_to(pass, value);
}

bool PassRecorder::meets_other(const LightWalk& walk, int depth) const {
  for (int i = 0; i < walk.size() && walk[i].depth <= depth; ++i)
    if (scene_.instance(walk[i].surface.instance).holdout) return true;
  return false;
}

void PassRecorder::joined(const Color& value, uint32_t instance, const Bsdf& bsdf, const Vec3& wi_world,
                          const Vec3& wo_world, Technique technique, const EventSequence& light_side,
                          LightSource source, uint16_t group, const LightWalk* walk) {
  if (light_.empty()) return;
  PathSignature path{vertices_ + 1 + light_side.count, &first_, {}, source, group, technique};
  if (mattes_) {
    const InstanceShading& here = scene_.instance(instance);
    path.brought = (vertices_ == 0 ? here.matte : on_matte_) &&
                   (met_other_ || here.holdout || (walk && meets_other(*walk, light_side.count)));
  }
  ClassShares here;
  if (classes_ && vertices_ == 0) {
    here = bsdf.class_shares(wi_world, wo_world, Transport::radiance);
    path.first = &here;
  }
  if (events_wanted_) {
    path.events = events_;
    path.events.append(event_at(bsdf, wi_world, wo_world));
    path.events.append_packed(light_side.bits, light_side.count);
  }
  add(value, path);
}

void PassRecorder::add_other(OtherPicture picture, const Color& radiance, float cover, const PassRecorder* parts) {
  others_[static_cast<size_t>(picture)] = radiance;
  if (picture == OtherPicture::catcher_lit) cover_ = cover;
  if (!parts) return;
  for (const PassPlan::Pass& pass : parts->light_) {
    const float* from = parts->values_.data() + pass.sample;
    add_to(pass, {from[0], from[1], from[2]});
  }
}

std::span<const float> PassRecorder::finish(const Vec4& picture, const Color& behind) {
  const float all[4] = {picture.x, picture.y, picture.z, picture.w};
  std::copy_n(all, 4, values_.begin());
  for (const PassPlan::Pass& pass : plan_.pictures_) std::copy_n(all, pass.kind == PassKind::noisy ? 4 : 3, at(pass));
  for (const PassPlan::Pass& pass : plan_.late_) {
    if (pass.kind == PassKind::mist) *at(pass) = 1.0f - *at(pass);
    if (pass.kind == PassKind::without_shadow) add_to(pass, other(OtherPicture::without_shadows));
    if (pass.kind == PassKind::catcher_lit) add_to(pass, other(OtherPicture::catcher_lit));
    if (pass.kind == PassKind::catcher_bare) add_to(pass, other(OtherPicture::catcher_bare));
    if (pass.kind == PassKind::catcher_cover) *at(pass) = cover_;
    if (pass.kind == PassKind::catcher_behind) add_to(pass, behind);
    if (pass.kind == PassKind::time)
      *at(pass) = std::chrono::duration<float, std::micro>(std::chrono::steady_clock::now() - start_).count();
  }
  // What is not finite in a pass (a broken UV map) does not cost the picture its sample.
  if (!all_finite(std::span(values_).subspan(4)))
    for (size_t i = 4; i < values_.size(); ++i)
      if (!std::isfinite(values_[i])) values_[i] = 0.0f;
  return values_;
}

// --- Where values go -----------------------------------------------------------------------------------------------

bool PassRecorder::takes(const PassPlan::Pass& pass, const PathSignature& path, const Color& value, Color& part) {
  const auto of_class = [&](LobeClass c) {
    part = value * path.first->of[static_cast<int>(c)];
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

void PassRecorder::add(const Color& value, const PathSignature& path) {
  for (const PassPlan::Pass& pass : light_) {
    Color part;
    if (!pass.picture && takes(pass, path, value, part)) add_to(pass, part * plan_.settings_.exposure);
  }
}

void PassRecorder::add_to(int sample_float, const Color& value) {
  float* to = values_.data() + sample_float;
  to[0] += value.x;
  to[1] += value.y;
  to[2] += value.z;
}

void PassRecorder::add_id(const PassPlan::Pass& pass, float id, float weight) {
  if (!(weight > 0.0f)) return;
  float* slot = at(pass);
  for (int i = 0; i < k_ids_a_sample; ++i, slot += 2) {
    if (slot[1] > 0.0f && slot[0] != id && i + 1 < k_ids_a_sample) continue;
    if (!(slot[1] > 0.0f)) slot[0] = id;
    slot[1] += weight;
    return;
  }
}

}  // namespace lambent
