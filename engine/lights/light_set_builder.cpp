#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "engine/lights/light_set.h"

namespace lambent {

LightSetBuilder::LightSetBuilder() = default;
LightSetBuilder::~LightSetBuilder() = default;

void LightSetBuilder::set_scene_bounds(const Bounds3& bounds) { bounds_ = bounds; }

LightIndex LightSetBuilder::add(AnalyticLight light) {
  lamps_.push_back(std::move(light));
  return static_cast<LightIndex>(lamps_.size() - 1);
}

uint32_t LightSetBuilder::add_emission(SurfaceEmission emission) {
  emissions_.push_back(std::move(emission));
  return static_cast<uint32_t>(emissions_.size() - 1);
}

void LightSetBuilder::add_mesh(uint32_t instance, std::string name, std::vector<EmissiveTriangle> triangles) {
  meshes_.push_back({instance, std::move(name), std::move(triangles)});
}

uint8_t LightSetBuilder::add_receivers(uint64_t sets) {
  const auto found = std::find(receivers_.begin(), receivers_.end(), sets);
  if (found == receivers_.end() && receivers_.size() >= std::numeric_limits<uint8_t>::max()) return 0;
  const auto number = found - receivers_.begin() + 1;
  if (found == receivers_.end()) receivers_.push_back(sets);
  return static_cast<uint8_t>(number);
}

void LightSetBuilder::set_environment(EnvironmentLight environment) {
  environment_ = std::make_unique<EnvironmentLight>(std::move(environment));
}

namespace {

/// What the tree must know of a triangle; intensity 0 if it cannot be sampled.
LightCluster cluster_of(const EmissiveTriangle& t, const SurfaceEmission& emission) {
  LightCluster cluster;
  const Vec3d a(t.a), edge_b = Vec3d(t.b) - a, edge_c = Vec3d(t.c) - a;
  const Vec3d normal = edge_b.cross(edge_c);
  const double twice_area = std::sqrt(normal.dot(normal));
  const double radiance = std::fabs(static_cast<double>(luminance(emission.radiance)));
  cluster.intensity = 0.5 * twice_area * radiance * std::fabs(static_cast<double>(t.importance_scale));
  if (!(cluster.intensity > 0.0) || !std::isfinite(cluster.intensity) || !(emission.front || emission.back)) {
    cluster.intensity = 0.0;
    return cluster;
  }
  // The smallest sphere would be a little smaller; this one is centred where the light is.
  const Vec3d center = a + (edge_b + edge_c) * (1.0 / 3.0);
  const auto distance = [&](const Vec3& v) { return (Vec3d(v) - center).length(); };
  cluster.center = Vec3(center);
  cluster.radius = static_cast<float>(std::max({distance(t.a), distance(t.b), distance(t.c)}));
  const Vec3 n(normal * (1.0 / twice_area));
  cluster.axis = emission.front ? n : -n;
  cluster.two_sided = emission.front && emission.back;
  return cluster;
}

/// Area that float can work with: not zero, and not so small or large that its square leaves the range.
bool has_area(const EmissiveTriangle& t) {
  const Vec3d edge_b = Vec3d(t.b) - Vec3d(t.a), edge_c = Vec3d(t.c) - Vec3d(t.a);
  const double twice_area = edge_b.cross(edge_c).length();
  const double longest = std::max({edge_b.length(), edge_c.length(), (edge_c - edge_b).length()});
  // A sliver thinner than float coordinates can tell from a line has no normal.
  return twice_area > 1e-36 && twice_area < 1e36 && twice_area > 1e-7 * longest * longest;
}

}  // namespace

std::shared_ptr<LightSet> LightSetBuilder::build(Report& report) {
  auto set = std::make_shared<LightSet>();

  // Scene sphere.
  if (bounds_.isEmpty()) {
    set->scene_radius_ = 1.0f;
  } else {
    set->scene_center_ = bounds_.center();
    set->scene_radius_ = std::max(0.5f * length(bounds_.size()), 1e-18f);
  }

  // Lamps. Those that define no light keep their number but shine nowhere.
  std::vector<LightCluster> clusters;  // the lamps, then the triangles
  std::vector<LightIndex> sized, suns;
  clusters.reserve(lamps_.size());
  for (size_t i = 0; i < lamps_.size(); ++i) {
    std::string problem = Lamp::validate(lamps_[i]);
    if (problem.empty()) {
      Lamp lamp(lamps_[i]);
      if (!lamp.has_finite_radiance())
        problem = "Light \"" + lamps_[i].name + "\": its power over its area is too large to compute with";
      set->lamps_.push_back(std::move(lamp));
    } else {
      AnalyticLight nothing;
      nothing.energy = Color(0.0f);
      set->lamps_.emplace_back(nothing);
    }
    if (!problem.empty()) {
      report.warning("invalid_light", lamps_[i].name, problem + "; it is left out");
      clusters.emplace_back();
      continue;
    }
    const Lamp& lamp = set->lamps_.back();
    const LightIndex index = static_cast<LightIndex>(i);
    if (lamp.is_infinite()) {
      clusters.emplace_back();
      if (lamp.irradiance() > 0.0) suns.push_back(index);
    } else {
      clusters.push_back(lamp.cluster());
      const bool shines = clusters.back().intensity > 0.0;
      if (shines && !lamp.is_delta() && lamp.traits().hit_by_rays) sized.push_back(index);
    }
  }

  // Triangles: valid ones, in the order given.
  size_t given = 0;
  for (const Mesh& mesh : meshes_) given += mesh.triangles.size();
  clusters.resize(lamps_.size() + given);
  std::vector<LightSet::Triangle> triangles(given);
  LightCluster* triangle_clusters = clusters.data() + lamps_.size();
  size_t offset = 0;
  uint32_t last_instance = 0;
  for (const Mesh& mesh : meshes_) {
    std::atomic<size_t> without_area{0};
    tbb::parallel_for(size_t{0}, mesh.triangles.size(), [&](size_t i) {
      const EmissiveTriangle& t = mesh.triangles[i];
      triangles[offset + i] = {t.a, t.b - t.a, t.c - t.a, t.emission, mesh.instance, t.triangle};
      if (!is_finite(t.a) || !is_finite(t.b) || !is_finite(t.c) || !has_area(t))
        without_area.fetch_add(1, std::memory_order_relaxed);
      else if (t.emission < emissions_.size())
        triangle_clusters[offset + i] = cluster_of(t, emissions_[t.emission]);
    });
    if (without_area > 0)
      report.info("degenerate_emitter", mesh.name,
                  "Object \"" + mesh.name + "\": " + std::to_string(without_area) + " of its " +
                      std::to_string(mesh.triangles.size()) +
                      " emissive triangles have no area or no finite corners; they give no light");
    offset += mesh.triangles.size();
    last_instance = std::max(last_instance, mesh.instance);
  }
  set->first_triangle_ = static_cast<LightIndex>(lamps_.size());

  // The tree; then triangles are numbered in its order, so that neighbours in the tree are neighbours in memory.
  set->tree_ = LightTree(clusters);
  std::vector<uint32_t> new_number(clusters.size(), k_no_light);
  for (size_t i = 0; i < lamps_.size(); ++i) new_number[i] = static_cast<uint32_t>(i);
  set->triangles_.reserve(set->tree_.size());
  for (const uint32_t emitter : set->tree_.leaf_order()) {
    if (emitter < set->first_triangle_) continue;
    new_number[emitter] = set->first_triangle_ + static_cast<uint32_t>(set->triangles_.size());
    set->triangles_.push_back(triangles[emitter - set->first_triangle_]);
  }
  set->triangles_.shrink_to_fit();
  set->environment_ = set->first_triangle_ + static_cast<LightIndex>(set->triangles_.size());
  set->tree_.renumber(new_number, set->environment_);

  // For receivers that some lights do not reach, trees of the others.
  const auto reaches = [](const LightTraits& traits, uint64_t sets) {
    return traits.linked.receivers == 0 || (sets >> (traits.linked.receivers - 1) & 1u) != 0;
  };
  for (const uint64_t sets : receivers_) {
    std::vector<LightCluster> reaching = clusters;
    for (size_t i = 0; i < reaching.size(); ++i) {
      const LightTraits* traits = i < lamps_.size() ? &lamps_[i].traits : nullptr;
      if (!traits && triangles[i - lamps_.size()].emission < emissions_.size())
        traits = &emissions_[triangles[i - lamps_.size()].emission].traits;
      if (traits && !reaches(*traits, sets)) reaching[i].intensity = 0.0;
    }
    LightSet::Pool& pool = set->pools_.emplace_back();
    pool.tree = LightTree(reaching);
    pool.tree.renumber(new_number, set->environment_);
  }
  set->emissions_ = std::move(emissions_);

  // From the caller's numbers to lights.
  if (!meshes_.empty()) set->instances_.resize(static_cast<size_t>(last_instance) + 1);
  for (const Mesh& mesh : meshes_) {
    if (mesh.triangles.empty()) continue;
    const auto [low, high] = std::minmax_element(mesh.triangles.begin(), mesh.triangles.end(),
                                                 [](const auto& a, const auto& b) { return a.triangle < b.triangle; });
    LightSet::InstanceRange& range = set->instances_[mesh.instance];
    range = {low->triangle, high->triangle - low->triangle + 1, set->table_.size()};
    set->table_.resize(set->table_.size() + range.count, k_no_light);
  }
  for (size_t i = 0; i < set->triangles_.size(); ++i) {
    const LightSet::Triangle& t = set->triangles_[i];
    const LightSet::InstanceRange& range = set->instances_[t.instance];
    set->table_[range.offset + (t.triangle - range.first)] = set->first_triangle_ + static_cast<LightIndex>(i);
  }

  // Infinite lights, measured in the tree's unit.
  double environment_irradiance = 0.0;
  if (environment_) {
    set->environment_light_ = std::make_unique<Environment>(std::move(*environment_));
    environment_irradiance = std::numbers::pi * set->environment_light_->mean_luminance();
  }
  double unit = set->tree_.empty() ? 0.0 : set->tree_.intensity_unit();
  double radius_squared = static_cast<double>(set->scene_radius_) * static_cast<double>(set->scene_radius_);
  if (set->tree_.empty()) {
    unit = environment_irradiance;
    for (const LightIndex sun : suns) unit = std::max(unit, set->lamps_[sun].irradiance());
  }
  std::vector<double> flux{set->tree_.empty() ? 0.0 : std::numbers::pi * unit};
  const auto add_infinite = [&](LightIndex light, double irradiance, double light_flux, bool hit) {
    if (hit) set->infinite_.push_back(light);
    if (!(irradiance > 0.0)) return;
    set->infinite_sampled_.push_back(light);
    set->infinite_irradiance_.push_back(
        static_cast<float>(std::clamp(irradiance / unit, 1e-30, static_cast<double>(LightSet::k_largest_importance))));
    flux.push_back(light_flux);
  };
  for (const LightIndex sun : suns) {
    const Lamp& lamp = set->lamps_[sun];
    const double irradiance = lamp.irradiance();
    add_infinite(sun, irradiance, irradiance * std::numbers::pi * radius_squared,
                 !lamp.is_delta() && lamp.traits().hit_by_rays);
  }
  if (set->environment_light_) {
    const EnvironmentLight& light = set->environment_light_->light();
    const bool shines = environment_irradiance > 0.0 || light.traits.program || !is_black(light.radiance);
    add_infinite(set->environment_, environment_irradiance,
                 4.0 * std::numbers::pi * environment_irradiance * radius_squared, shines && light.traits.hit_by_rays);
    set->has_even_world_ =
        environment_irradiance > 0.0 && light.traits.hit_by_rays && set->environment_light_->is_even();
  }
  for (size_t k = 0; k < receivers_.size(); ++k) {
    LightSet::Pool& pool = set->pools_[k];
    const double scale = pool.tree.empty() || set->tree_.empty() ? 1.0 : unit / pool.tree.intensity_unit();
    for (size_t i = 0; i < set->infinite_sampled_.size(); ++i) {
      const LightIndex light = set->infinite_sampled_[i];
      if (!reaches(set->traits(light), receivers_[k])) continue;
      pool.infinite.push_back(light);
      pool.irradiance.push_back(
          static_cast<float>(std::clamp(static_cast<double>(set->infinite_irradiance_[i]) * scale, 1e-30,
                                        static_cast<double>(LightSet::k_largest_importance))));
    }
  }
  double total = 0.0;
  for (const double f : flux) total += f;
  if (total > 0.0) {
    double running = 0.0;
    for (const double f : flux) set->emission_cdf_.push_back(static_cast<float>((running += f) / total));
    set->emission_cdf_.back() = 1.0f;
    set->flux_ = total;
  }

  set->lamp_bvh_ = LampBvh(set->lamps_, std::move(sized));
  set->sampled_ = set->tree_.size() + set->infinite_sampled_.size();
  lamps_.clear();
  meshes_.clear();
  receivers_.clear();
  emissions_.clear();
  environment_.reset();
  bounds_ = Bounds3();
  return set;
}

}  // namespace lambent
