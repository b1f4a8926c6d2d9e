#include "engine/integrators/integrator.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/integrators/bidirectional/bidirectional.h"
#include "engine/integrators/bidirectional/pilot.h"
#include "engine/integrators/path_tracer/path_tracer.h"

namespace lambent {

std::vector<std::string> integrator_names() {
  std::vector<std::string> names{"PT"};
  for (const NamedTechniques& family : k_bidirectional) names.emplace_back(family.name);
  return names;
}

Result<std::unique_ptr<Integrator>> make_integrator(const std::string& name, std::shared_ptr<const Scene> scene,
                                                    const IntegratorSettings& settings) {
  if (name == "PT") return make_path_tracer(std::move(scene), settings);
  if (const TechniqueSet* set = find_techniques(name)) return make_bidirectional(std::move(scene), settings, *set);
  return Error{fmt::format("There is no integrator '{}' in this version; it offers {}", name,
                           fmt::join(integrator_names(), ", "))};
}

void report_lost_light(const std::string& name, const Scene& scene, Report& report) {
  const TechniqueSet* set = find_techniques(name);
  if (!set) return;
  if (scene.profile().subsurface && !set->camera_scatters)
    report.warning("lost_light", name,
                   set->merging || set->shared_lights
                       ? fmt::format("{} does not find what light from under surfaces shines on.", name)
                       : fmt::format("{} does not find light from under surfaces: there they are black.", name));
  if (set->next_event) return;
  // Rounding keeps aims from being narrower than a thousandth of the scene.
  constexpr float k_hardly_met = 1e4f;
  if (scene.lights().emits_from_afar()) {
    const float distance = bidirectional::typical_distance(scene, bidirectional::points_seen(scene));
    const float size = distance > 0.0f ? scene.lights().scene_radius() / distance : 0.0f;
    if (size > k_hardly_met)
      report.warning(
          "lost_light", name,
          fmt::format("{} hardly finds the light of suns and world: the scene is {:.0f} times larger than the "
                      "distance to what the camera sees. PT, BPT and VCM do; or move what lies so far away.",
                      name, static_cast<double>(size)));
  }
  std::vector<std::string> lost = scene.lights_without_walks();
  if (lost.empty()) return;
  constexpr size_t k_most_names = 8;
  const size_t more = lost.size() > k_most_names ? lost.size() - k_most_names : 0;
  lost.resize(lost.size() - more);
  report.warning("lost_light", name,
                 fmt::format("{} does not find the light of '{}'{}: it casts no shadows, is hidden from some rays or "
                             "depends on the Light Path node. PT, BPT and VCM do.",
                             name, fmt::join(lost, "', '"), more ? fmt::format(" and {} more", more) : ""));
}

void report_merge_radius(const std::string& name, float merge_radius_px, int side_px, Report& report) {
  const TechniqueSet* set = find_techniques(name);
  if (!set || !set->merging) return;
  const bool merges = merge_radius_px > 0.0f && std::isfinite(merge_radius_px);
  if (!merges && !set->light_tracing)  // VCM is BPT then
    report.warning(
        "merge_radius", name,
        fmt::format("{} finds by merging what others find by other means, and does not merge within a radius "
                    "of {} pixels: that light is missing.",
                    name, merge_radius_px));
  if (merges && merge_radius_px > static_cast<float>(side_px))
    report.warning(
        "merge_radius", name,
        fmt::format("{} merges within a radius of {} pixels, more than the picture has: its light is blurred "
                    "away and takes long to find.",
                    name, merge_radius_px));
}

int first_light_tracing(const std::string& name) {
  const TechniqueSet* set = find_techniques(name);
  return set && set->light_tracing ? set->first_light_tracing : 1;
}

double splat_unit(const std::string& name, const Scene& scene, float exposure) {
  const TechniqueSet* set = find_techniques(name);
  if (!set || !set->light_tracing) return 0.0;
  // Radiance of a scene-sized diffuse wall that gets all light, and room for 256 times that.
  double radius = scene.lights().scene_radius();
  // The flux from afar grows with the scene. That of lamps does not: where something lies a long way off it would count
  // for so little that what they light is out of the film's range.
  if (!scene.lights().emits_from_afar()) {
    constexpr double k_largest_over_distance = 1e4;
    const double distance = bidirectional::typical_distance(scene, bidirectional::points_seen(scene));
    if (distance > 0.0) radius = std::min(radius, k_largest_over_distance * distance);
  }
  const double unit =
      256.0 * scene.lights().flux() / (std::numbers::pi * radius * radius) * std::fabs(static_cast<double>(exposure));
  return unit > 0.0 && std::isfinite(unit) ? unit : 1.0;
}

std::array<IntegratorSettings, k_other_pictures> for_other_pictures(const IntegratorSettings& settings) {
  IntegratorSettings plain = settings;
  plain.passes = nullptr;
  plain.others = {};
  plain.observer = nullptr;
  IntegratorSettings of_catchers = plain;
  of_catchers.film_transparent = true;
  std::array<IntegratorSettings, k_other_pictures> all{plain, of_catchers, of_catchers};
  for (size_t i = 0; i < all.size(); ++i) {
    all[i].picture = static_cast<OtherPicture>(i);
    if (settings.passes && settings.passes->wants_parts(all[i].picture)) all[i].parts = settings.passes;
  }
  return all;
}

}  // namespace lambent
