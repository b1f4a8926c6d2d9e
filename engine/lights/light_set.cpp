#include "engine/lights/light_set.h"

#include <cmath>

#include "engine/sampling/warp.h"

namespace lambent {

namespace {

/// SphericalTriangle's weights of the first two vertices from weights of the second and third.
Vec2 first_two(const Vec2& uv) { return {1.0f - uv.x - uv.y, uv.x}; }

}  // namespace

LightSet::LightSet() = default;
LightSet::~LightSet() = default;

size_t LightSet::bytes() const {
  const auto of = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  size_t pools = of(pools_);
  for (const Pool& pool : pools_) pools += pool.tree.bytes() + of(pool.infinite) + of(pool.irradiance);
  return pools + of(lamps_) + of(triangles_) + of(emissions_) + of(instances_) + of(table_) + of(infinite_) +
         of(infinite_sampled_) + of(infinite_irradiance_) + of(emission_cdf_) + tree_.bytes() + lamp_bvh_.bytes() +
         (environment_light_ ? environment_light_->bytes() : 0);
}

LightKind LightSet::kind(LightIndex light) const {
  if (light < first_triangle_) return lamps_[light].kind();
  return light < environment_ ? LightKind::triangle : LightKind::environment;
}

bool LightSet::is_infinite(LightIndex light) const {
  return light == environment_ || (light < first_triangle_ && lamps_[light].is_infinite());
}

bool LightSet::is_delta(LightIndex light) const { return light < first_triangle_ && lamps_[light].is_delta(); }

const LightTraits& LightSet::traits(LightIndex light) const {
  if (light < first_triangle_) return lamps_[light].traits();
  if (light < environment_) return emissions_[triangles_[light - first_triangle_].emission].traits;
  return environment_light_->light().traits;
}

// --- Selection

float LightSet::infinite_importance(const PoolView& pool, size_t i, const Vec3& n, EvenWorld even_world) const {
  const LightIndex light = pool.infinite[i];
  if (light == environment_ && leaves_world(even_world)) return 0.0f;
  if (light >= first_triangle_ || length_squared(n) == 0.0f) return pool.irradiance[i];
  return pool.irradiance[i] * lamps_[light].largest_cos(n);
}

/// Weights of the groups for a receiver: the tree, then the infinite lights. Half of the probability is spread evenly
/// over the groups that can contribute, so that a group whose estimate ignores occlusion cannot starve another.
struct LightSet::Groups {
  float total = 0.0f, tree = 0.0f;
  int contributing = 0;

  float prob(float weight) const {
    if (!(weight > 0.0f)) return 0.0f;
    return contributing == 1 ? 1.0f : 0.5f / static_cast<float>(contributing) + 0.5f * (weight / total);
  }
};

LightSet::Groups LightSet::weigh_groups(const PoolView& pool, const Vec3& p, const Vec3& n,
                                        EvenWorld even_world) const {
  Groups groups;
  const auto add = [&](float weight) {
    groups.total += weight;
    groups.contributing += weight > 0.0f ? 1 : 0;
  };
  if (!pool.tree.empty()) {
    // Alone, its estimate does not matter; beside others it does.
    const bool alone = pool.infinite.size() == (leaves_world(even_world) ? 1u : 0u);
    groups.tree = alone ? 1.0f : std::min(pool.tree.importance(p, n), k_largest_importance);
    add(groups.tree);
  }
  for (size_t i = 0; i < pool.infinite.size(); ++i) add(infinite_importance(pool, i, n, even_world));
  return groups;
}

LightSet::Selection LightSet::select(const Vec3& p, const Vec3& n, ReusedNumber& u, LightChoices choices) const {
  const PoolView pool = pool_of(choices);
  const Groups groups = weigh_groups(pool, p, n, choices.even_world);
  if (groups.contributing == 0) return {};
  double before = 0.0;
  if (const float prob = groups.prob(groups.tree); prob > 0.0f) {
    if (u.value() < static_cast<double>(prob) || groups.contributing == 1) {
      u.stretch(0.0, static_cast<double>(prob));
      const LightTree::Choice choice = pool.tree.sample(p, n, u);
      return choice.prob > 0.0f ? Selection{light_of_emitter(choice.emitter), prob * choice.prob} : Selection{};
    }
    before = static_cast<double>(prob);
  }
  Selection last;
  for (size_t i = 0; i < pool.infinite.size(); ++i) {
    const float prob = groups.prob(infinite_importance(pool, i, n, choices.even_world));
    if (!(prob > 0.0f)) continue;
    last = {pool.infinite[i], prob};
    if (u.value() < before + static_cast<double>(prob)) break;
    before += static_cast<double>(prob);
  }
  if (last.prob > 0.0f) u.stretch(before, static_cast<double>(last.prob));
  return last;
}

float LightSet::prob_selection(const Vec3& p, const Vec3& n, LightIndex light, LightChoices choices) const {
  if (light == k_no_light || light > environment_) return 0.0f;
  if (light == environment_ && leaves_world(choices.even_world)) return 0.0f;
  const PoolView pool = pool_of(choices);
  const Groups groups = weigh_groups(pool, p, n, choices.even_world);
  if (!is_infinite(light)) {
    const float prob = groups.prob(groups.tree);
    return prob > 0.0f ? prob * pool.tree.prob(p, n, emitter_of_light(light)) : 0.0f;
  }
  for (size_t i = 0; i < pool.infinite.size(); ++i)
    if (pool.infinite[i] == light) return groups.prob(infinite_importance(pool, i, n, choices.even_world));
  return 0.0f;
}

void LightSet::scale_importance(std::span<const float> factors) {
  if (factors.empty()) return;
  tree_.scale_importance(factors);
  for (Pool& pool : pools_) pool.tree.scale_importance(factors);
}

// --- Sampling for a receiver

bool LightSet::sample_triangle_light(const Vec3& p, const Vec2& u, LightSample& sample) const {
  const Triangle& t = triangles_[sample.light - first_triangle_];
  const SurfaceEmission& emission = emissions_[t.emission];
  const SphericalTriangle triangle(p, t.a, t.a + t.edge_b, t.a + t.edge_c);
  const Vec2 weights = triangle.sample(u);
  sample.uv = {weights.y, 1.0f - weights.x - weights.y};
  sample.p_light_world = t.a + t.edge_b * sample.uv.x + t.edge_c * sample.uv.y;
  const Vec3 to_light = sample.p_light_world - p;
  sample.distance_m = length(to_light);
  if (!(sample.distance_m > 0.0f)) return false;
  sample.direction_world = to_light * (1.0f / sample.distance_m);
  sample.n_light_world = normalize(cross(t.edge_b, t.edge_c));
  sample.pdf_solid_angle = triangle.pdf_solid_angle(weights);
  sample.instance = t.instance;
  sample.triangle = t.triangle;
  const bool front = dot(sample.direction_world, sample.n_light_world) < 0.0f;
  if (!(front ? emission.front : emission.back)) return false;
  sample.radiance = emission.radiance;
  sample.traits = &emission.traits;
  return sample.pdf_solid_angle > 0.0f;
}

LightSample LightSet::sample(const Vec3& p, const Vec3& n, const Vec2& u_light, LightChoices choices) const {
  LightSample sample;
  ReusedNumber u_first(u_light);
  const Selection selection = select(p, n, u_first, choices);
  const Vec2 u(u_first.rest(), u_light.y);
  if (selection.light == k_no_light) return sample;
  sample.light = selection.light;
  sample.prob_selection = selection.prob;
  if (is_triangle(selection.light)) {
    if (!sample_triangle_light(p, u, sample)) return {};
  } else if (selection.light == environment_) {
    const EnvironmentLight& light = environment_light_->light();
    sample.is_infinite = true;
    sample.direction_world = environment_light_->sample(n, u, sample.pdf_solid_angle);
    sample.distance_m = k_infinity;
    sample.n_light_world = -sample.direction_world;
    sample.radiance = light.radiance;
    sample.traits = &light.traits;
  } else {
    const Lamp& lamp = lamps_[selection.light];
    const LampSample point = lamp.sample(p, u);
    sample.is_delta = lamp.is_delta();
    sample.is_infinite = lamp.is_infinite();
    sample.direction_world = point.direction;
    sample.distance_m = point.distance;
    sample.p_light_world = point.p;
    sample.n_light_world = point.n;
    sample.uv = point.uv;
    sample.radiance = point.radiance;
    sample.pdf_solid_angle = point.pdf_solid_angle;
    sample.traits = &lamp.traits();
  }
  sample.pdf_solid_angle *= selection.prob;
  if (!(sample.pdf_solid_angle > 0.0f) || !std::isfinite(sample.pdf_solid_angle) ||
      (is_black(sample.radiance) && !sample.traits->program))
    return {};
  return sample;
}

float LightSet::pdf_solid_angle_on_light(const Vec3& p, const Vec3& n, LightIndex light, const Vec3& direction,
                                         float distance, const Vec2& uv) const {
  if (is_triangle(light)) {
    const Triangle& t = triangles_[light - first_triangle_];
    const SurfaceEmission& emission = emissions_[t.emission];
    if (!emission.front || !emission.back) {
      const bool front = dot(direction, cross(t.edge_b, t.edge_c)) < 0.0f;
      if (!(front ? emission.front : emission.back)) return 0.0f;
    }
    return SphericalTriangle(p, t.a, t.a + t.edge_b, t.a + t.edge_c).pdf_solid_angle(first_two(uv));
  }
  if (light == environment_) return environment_light_->pdf_solid_angle(n, direction);
  return lamps_[light].pdf_solid_angle(p, direction, distance);
}

float LightSet::pdf_solid_angle(const Vec3& p, const Vec3& n, LightIndex light, const Vec3& direction, float distance,
                                const Vec2& uv, LightChoices choices) const {
  const float prob = prob_selection(p, n, light, choices);
  if (!(prob > 0.0f)) return 0.0f;
  const float pdf = prob * pdf_solid_angle_on_light(p, n, light, direction, distance, uv);
  return std::isfinite(pdf) ? pdf : 0.0f;
}

// --- Hits

LightHit LightSet::intersect(const Vec3& origin, const Vec3& direction, float t_min, float t_max,
                             uint32_t ray_kinds) const {
  LightHit nearest;
  lamp_bvh_.traverse(lamps_, origin, direction, t_min, t_max, ray_kinds, [&](LightHit&& hit) {
    // Of lamps at the same distance the one with the lower number, whatever the order of traversal.
    if (hit.distance_m < nearest.distance_m || (hit.distance_m == nearest.distance_m && hit.light < nearest.light))
      nearest = hit;
    return std::nextafter(nearest.distance_m, k_infinity);
  });
  return nearest;
}

LightHit LightSet::infinite_hit(LightIndex light, const Vec3& direction, uint32_t ray_kinds) const {
  LightHit hit;
  const LightTraits& light_traits = traits(light);
  if (light_traits.hidden_from & ray_kinds) return hit;
  if (light == environment_) {
    hit.radiance = environment_light_->light().radiance;
    hit.direction_world = direction;
    hit.n_light_world = -direction;
  } else if (!lamps_[light].intersect_infinite(direction, hit)) {
    return hit;
  }
  hit.light = light;
  hit.traits = &light_traits;
  return hit;
}

LightIndex LightSet::find_triangle(uint32_t instance, uint32_t triangle) const {
  if (instance >= instances_.size()) return k_no_light;
  const InstanceRange& range = instances_[instance];
  if (triangle - range.first >= range.count) return k_no_light;
  return table_[range.offset + (triangle - range.first)];
}

// --- From the lights

float LightSet::prob_emission(LightIndex light) const {
  const auto share = [&](size_t group) { return emission_cdf_[group] - (group > 0 ? emission_cdf_[group - 1] : 0.0f); };
  for (size_t i = 0; i < infinite_sampled_.size(); ++i)
    if (infinite_sampled_[i] == light) return share(i + 1);
  const uint32_t emitter = emitter_of_light(light);
  return emitter == k_no_light || emission_cdf_.empty() ? 0.0f : share(0) * tree_.prob_by_intensity(emitter);
}

LightSet::Emitter LightSet::select_emitter(ReusedNumber& u, const EmissionAim* aim) const {
  if (emission_cdf_.empty()) return {};
  if (aim && u.value() < static_cast<double>(EmissionAim::k_share)) {
    u.stretch(0.0, static_cast<double>(EmissionAim::k_share));
    const EmissionAim::Choice choice = aim->choose(u);
    LightIndex light = aim->light_of(choice.row);
    if (light == k_no_light && !tree_.empty()) light = light_of_emitter(tree_.sample_by_intensity(u).emitter);
    const float prob = light <= environment_ ? prob_emission(light) : 0.0f;
    return prob > 0.0f ? Emitter{light, prob, choice.target} : Emitter{};
  }
  if (aim) u.stretch(static_cast<double>(EmissionAim::k_share), 1.0 - static_cast<double>(EmissionAim::k_share));
  size_t group = 0;
  while (group + 1 < emission_cdf_.size() && u.value() >= static_cast<double>(emission_cdf_[group])) ++group;
  const float below = group > 0 ? emission_cdf_[group - 1] : 0.0f;
  const float width = emission_cdf_[group] - below;
  if (!(width > 0.0f)) return {};
  u.stretch(static_cast<double>(below), static_cast<double>(width));
  if (group > 0) return {infinite_sampled_[group - 1], width, nullptr};
  const LightTree::Choice choice = tree_.sample_by_intensity(u);
  return {light_of_emitter(choice.emitter), width * choice.prob, nullptr};
}

EmissionSample LightSet::sample_emission(const Vec2& u_emitter, const Vec2& u_direction, const EmissionAim* aim) const {
  if (aim && aim->empty()) aim = nullptr;
  EmissionSample sample;
  ReusedNumber u_first(u_emitter);
  const Emitter emitter = select_emitter(u_first, aim);
  if (emitter.light == k_no_light) return sample;
  const LightIndex light = emitter.light;
  const Vec2 u_position(u_first.rest(), u_emitter.y);
  sample.traits = &traits(light);
  bool valid = true;
  if (is_triangle(light)) {
    const Triangle& t = triangles_[light - first_triangle_];
    const SurfaceEmission& emission = emissions_[t.emission];
    const Vec2 weights = sample_triangle(u_position);
    sample.uv = {weights.y, 1.0f - weights.x - weights.y};
    sample.p_light_world = t.a + t.edge_b * sample.uv.x + t.edge_c * sample.uv.y;
    sample.n_light_world = normalize(cross(t.edge_b, t.edge_c));
    if (emitter.target) {
      sample.direction_world = emitter.target->sample_direction(sample.p_light_world, u_direction);
      sample.cos_light = dot(sample.n_light_world, sample.direction_world);
      if (sample.cos_light < 0.0f) sample.n_light_world = -sample.n_light_world;
      sample.cos_light = std::fabs(sample.cos_light);
    } else {
      // The side by the first number, which is then stretched to serve again.
      const bool both = emission.front && emission.back;
      const bool front = both ? u_direction.x < 0.5f : emission.front;
      const Vec2 u(both ? std::min(front ? 2.0f * u_direction.x : 2.0f * u_direction.x - 1.0f, k_one_minus_epsilon)
                        : u_direction.x,
                   u_direction.y);
      if (!front) sample.n_light_world = -sample.n_light_world;
      const Vec3 local = sample_cosine_hemisphere(u);
      sample.direction_world = Frame::from_normal(sample.n_light_world).to_world(local);
      sample.cos_light = local.z;
    }
    sample.radiance = emission.radiance;
    sample.instance = t.instance;
    sample.triangle = t.triangle;
  } else if (light == environment_) {
    float pdf_direction = 0.0f;
    const Vec3 towards = environment_light_->sample(Vec3(0.0f), u_direction, pdf_direction);
    sample.direction_world = -towards;
    sample.n_light_world = -towards;
    sample.p_light_world = start_of_infinite_ray(-towards, u_position, emitter.target, scene_center_, scene_radius_);
    sample.radiance = environment_light_->light().radiance;
    sample.is_infinite = true;
  } else {
    valid =
        lamps_[light].sample_emission(u_position, u_direction, scene_center_, scene_radius_, emitter.target, sample);
  }
  EmissionPdf pdf = pdf_on_light(light, sample.n_light_world, sample.direction_world);
  pdf.prob_selection = emitter.prob;
  if (aim) add_aimed(light, sample.direction_world, sample.p_light_world, *aim, pdf);
  sample.prob_selection = pdf.prob_selection;
  sample.pdf_area = pdf.pdf_area;
  sample.pdf_direction_solid_angle = pdf.pdf_direction_solid_angle;
  const float product = sample.pdf_area * sample.pdf_direction_solid_angle;
  if (!valid || !(product > 0.0f) || !std::isfinite(product)) return {};
  sample.light = light;
  return sample;
}

EmissionPdf LightSet::pdf_on_light(LightIndex light, const Vec3& n_light, const Vec3& direction) const {
  EmissionPdf pdf;
  if (is_triangle(light)) {
    const Triangle& t = triangles_[light - first_triangle_];
    const SurfaceEmission& emission = emissions_[t.emission];
    const Vec3 normal = cross(t.edge_b, t.edge_c);
    pdf.pdf_area = 2.0f / length(normal);
    const bool emits = dot(n_light, normal) > 0.0f ? emission.front : emission.back;
    const float cosine = pdf_solid_angle_cosine_hemisphere(dot(n_light, direction));
    pdf.pdf_direction_solid_angle = emits ? cosine * (emission.front && emission.back ? 0.5f : 1.0f) : 0.0f;
  } else if (light == environment_) {
    pdf.pdf_area = 1.0f / (k_pi * scene_radius_ * scene_radius_);
    pdf.pdf_direction_solid_angle = environment_light_->pdf_solid_angle(Vec3(0.0f), -direction);
  } else {
    pdf = lamps_[light].pdf_emission(direction, scene_radius_);
  }
  return pdf;
}

/// From densities without an aim to those with it: the choice of the light, and of what is aimed given the light.
void LightSet::add_aimed(LightIndex light, const Vec3& direction, const Vec3& p_ray, const EmissionAim& aim,
                         EmissionPdf& pdf) const {
  const LightKind kind = this->kind(light);
  const bool infinite = is_infinite(light);
  // What only emission in other directions could have been sampled for stays so.
  if (!(pdf.pdf_direction_solid_angle > 0.0f)) return;
  const bool round = kind == LightKind::point || kind == LightKind::spot;
  const Vec3 origin = round ? lamps_[light].center() : p_ray;
  float& aimed = infinite ? pdf.pdf_area : pdf.pdf_direction_solid_angle;
  float prob = (1.0f - EmissionAim::k_share) * pdf.prob_selection;
  float density = prob * aimed;
  const auto add_row = [&](int row, float prob_of_light) {
    const float share = EmissionAim::k_share * prob_of_light;
    prob += share * aim.prob(row);
    density += share * (infinite ? aim.density_of_line(row, origin, direction)
                                 : aim.density_of_direction(row, origin, direction));
  };
  if (const int row = aim.row_of(light); row != EmissionAim::k_no_row) add_row(row, 1.0f);
  if (const int rest = aim.row_of_rest(); rest != EmissionAim::k_no_row && !infinite)
    add_row(rest, tree_.prob_by_intensity(emitter_of_light(light)));
  pdf.prob_selection = prob;
  aimed = density / prob;
}

EmissionPdf LightSet::pdf_emission(LightIndex light, const Vec3& n_light, const Vec3& direction, const Vec3& p_ray,
                                   const EmissionAim* aim) const {
  if (light == k_no_light || light > environment_) return {};
  const float prob = prob_emission(light);
  if (!(prob > 0.0f)) return {};
  if (light < first_triangle_ && lamps_[light].is_sphere() && !(dot(direction, p_ray - lamps_[light].center()) > 0.0f))
    return {};
  EmissionPdf pdf = pdf_on_light(light, n_light, direction);
  pdf.prob_selection = prob;
  if (aim && !aim->empty()) add_aimed(light, direction, p_ray, *aim, pdf);
  return pdf;
}

}  // namespace lambent
