#include "engine/integrators/bidirectional/pilot.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "engine/base/hash.h"
#include "engine/base/parallel.h"
#include "engine/integrators/bidirectional/pilot_parts.h"

namespace lambent::bidirectional {

namespace {

constexpr int k_rounds = 3;
/// Light walks of a round: half as many as pixels within these, so that all of it costs about a sample of small
/// pictures and little of large ones. A quarter as many camera walks; half as many in the last round.
constexpr int k_least_walks = 512, k_most_walks = 16384;
constexpr int k_piece = 128;
/// Longer paths teach little, and each merge costs as much as its path is long.
constexpr int k_most_bounces = 16;
/// Merge radius in widths of a pixel, at least; more where camera walks lie further apart.
constexpr float k_least_radius_px = 3.0f;
/// An aim is kept if it lowers the noise at least to this, on average. Walks that arrive cost more: a sample took 1.05
/// to 1.25 times as long.
constexpr double k_worthwhile = 0.65;
/// So many walks tell for sure that one that leaves more noise than this will not become worth while in later rounds,
/// which lower it by a fifth at most.
constexpr double k_enough_walks = 300.0, k_hopeless = 0.8;
/// Of the sphere around the scene: the smallest target.
constexpr float k_least_target = 1e-3f;
/// A scene is far larger than what is seen if its radius is so many times the distance to that.
constexpr float k_far_larger = 10.0f;

/// A light walk.
struct Start {
  EmissionArrival arrival;
  Vec3 n_light{0.0f}, direction{0.0f};
  float distance_m = 0.0f;
  uint32_t record = 0;  ///< its first, in its piece and then in the map
};

struct Piece {
  PhotonBatch batch;
  std::vector<Start> starts;
};

/// Where walks are worth something, the mean of the noise with the aim over that without it; and of how many walks.
struct Judgement {
  double noise = 1.0, walks = 0.0;
};

Judgement judge(const LightSet& lights, const EmissionAim& aim, const std::vector<Start>& starts) {
  double sum = 0.0, worth = 0.0, squares = 0.0;
  for (const Start& start : starts) {
    const EmissionArrival& a = start.arrival;
    if (!(a.worth > 0.0f)) continue;
    const auto density = [&](const EmissionAim* by) {
      return static_cast<double>(
          light_walk_density(lights, by, a.light, start.n_light, a.p_world, start.direction, start.distance_m));
    };
    const double w = static_cast<double>(a.worth), aimed = density(&aim);
    worth += w;
    squares += sqr(w);
    sum += aimed > 0.0 ? w * std::min(density(nullptr) / aimed, 2.0) : w;
  }
  return worth > 0.0 ? Judgement{sum / worth, sqr(worth) / squares} : Judgement{};
}

/// One run of the rounds.
template <KernelProfile profile>
class Pilot {
 public:
  Pilot(const Scene& scene, const IntegratorSettings& settings, const TechniqueSet& set, Film& film, float footprint_m,
        const CancelFlag& cancel, RayCounts& counts)
      : scene_(scene),
        lights_(scene.lights()),
        settings_(settings_of_pilots(settings)),
        film_(film),
        region_(film.region()),
        footprint_m_(footprint_m),
        cancel_(cancel),
        counts_(counts),
        pixels_(static_cast<double>(region_.width) * region_.height),
        light_walks_(static_cast<int>(std::clamp(0.5 * pixels_, 1.0 * k_least_walks, 1.0 * k_most_walks)) / k_piece *
                     k_piece),
        camera_walks_(light_walks_ / 2),
        seed_(hash_u32(settings.seed ^ 0x5bd1e995u)) {
    settings_.bounces.total = std::clamp(settings.bounces.total, 0, k_most_bounces);
    // What merging brings stands for all that light walks bring.
    pass_.set = set.weighted() ? set : k_techniques_ppm;
    pass_.set.passes_gloss = set.passes_gloss;
    pass_.set.connections = pass_.set.shared_lights = pass_.set.light_tracing = false;
    pass_.set.merging = true;
    pass_.set.first_merge_camera = pass_.set.first_merge_light = 1;
    pass_.counts.max_light_vertices = std::min(settings_.bounces.total + 1, k_most_bounces);
    pass_.counts.light_paths = static_cast<float>(pixels_);
    pass_.counts.shared_scatter = 1.0f;  // light that comes by further bounces is not for an aim to find
    pass_.correlation_aware = false;
  }

  EmissionAim learn() {
    const EmissionAim first = first_aim();
    if (!first.empty()) light_walks_ = k_most_walks;  // most still miss
    EmissionAim aim = first;
    for (int round = 0; round < k_rounds; ++round) {
      const bool last = round + 1 == k_rounds;
      pass_.aim = &aim;
      std::vector<Start> starts = run_round(round, camera_walks_ / (last ? 1 : 2));
      if (cancel_.cancelled()) return {};
      std::vector<EmissionArrival> arrivals;
      for (const Start& start : starts) arrivals.push_back(start.arrival);
      aim = EmissionAim(arrivals, k_least_target * lights_.scene_radius());
      if (aim.empty()) aim = first;
      const Judgement judged = judge(lights_, aim, starts);
      if (judged.walks == 0.0 && !first.empty()) continue;  // nothing was learned
      if (judged.noise > (last ? k_worthwhile : k_hopeless) && (last || judged.walks > k_enough_walks)) return {};
    }
    return aim;
  }

 private:
  /// Where nearly all of the scene lies far from what is seen, hardly a walk from a sun or world arrives there by
  /// itself.
  EmissionAim first_aim() const {
    std::vector<Vec3> seen = points_seen(scene_);
    const float far = k_far_larger * typical_distance(scene_, seen);
    if (seen.empty() || !(lights_.scene_radius() > far)) return {};
    std::erase_if(seen, [&](const Vec3& p) { return length(p - scene_.camera().origin()) > far; });
    std::vector<EmissionArrival> arrivals;
    for (size_t i = 0; i < seen.size(); ++i) {
      const Sampler sampler(seed_, 1, 0, static_cast<uint32_t>(i));
      const EmissionSample start =
          lights_.sample_emission(sampler.get_2d(k_dimension_emitter), sampler.get_2d(k_dimension_emitter_direction));
      if (start && lights_.is_infinite(start.light)) arrivals.push_back({start.light, true, seen[i], 1.0f});
    }
    return EmissionAim(arrivals, k_least_target * lights_.scene_radius());
  }

  /// Returns the light walks with what each was worth.
  std::vector<Start> run_round(int round, int camera_walks) {
    const float radius_px = std::max(k_least_radius_px, static_cast<float>(1.5 * std::sqrt(pixels_ / camera_walks)));
    pass_.radius_scale = radius_px;
    pass_.radius_limit_m = 3.0f * radius_px * footprint_m_;
    // A photon weighs as if it were merged with in its pixel alone.
    pass_.counts.merge_paths = static_cast<float>(pixels_) / (k_pi * sqr(radius_px));

    std::vector<Piece> pieces(static_cast<size_t>(light_walks_ / k_piece));
    tbb::parallel_for(size_t{0}, pieces.size(), [&](size_t p) { trace_lights(round, static_cast<int>(p), pieces[p]); });
    std::vector<Start> starts;
    std::vector<PhotonBatch*> batches;
    uint32_t records = 0;
    for (Piece& piece : pieces) {
      for (Start start : piece.starts) {
        start.record += records;
        starts.push_back(start);
      }
      records += static_cast<uint32_t>(piece.batch.records.size());
      batches.push_back(&piece.batch);
    }
    PhotonMap photons;
    photons.build(batches, std::min(2.0f * radius_px * footprint_m_, 4.0f * lights_.scene_radius()),
                  scene_.geometry().bounds_world(), static_cast<uint64_t>(light_walks_), settings_.threads, cancel_);
    pass_.photons = &photons;
    // In fixed point, so that sums do not depend on their order.
    std::vector<std::atomic<uint64_t>> worth(starts.size());
    tbb::parallel_for(0, camera_walks / k_piece, [&](int p) { trace_camera(round, p, camera_walks, starts, worth); });
    pass_.photons = nullptr;
    for (size_t i = 0; i < starts.size(); ++i)
      starts[i].arrival.worth = static_cast<float>(worth[i].load(std::memory_order_relaxed));
    return starts;
  }

  void trace_lights(int round, int number, Piece& piece) {
    Kernel<profile> kernel(scene_, settings_, pass_, film_);
    for (int i = number * k_piece; i < (number + 1) * k_piece && !cancel_.cancelled(); ++i) {
      Start start;
      start.record = static_cast<uint32_t>(piece.batch.records.size());
      kernel.light_sample(Sampler(seed_, 0, round, static_cast<uint32_t>(i)), &piece.batch, /*silent=*/true);
      const LightWalk& walk = kernel.light_walk();
      if (walk.size() == 0) continue;
      start.n_light = walk.start().n_light_world;
      start.direction = walk.start().direction_world;
      start.distance_m = length(walk[0].surface.p_world - walk.start().p_light_world);
      start.arrival = {walk.light(), lights_.is_infinite(walk.light()), walk[0].surface.p_world, 0.0f};
      piece.starts.push_back(start);
    }
    add_counts(kernel);
  }

  /// Adds to each light walk what part of a sample's light it brought.
  void trace_camera(int round, int number, int camera_walks, const std::vector<Start>& starts,
                    std::vector<std::atomic<uint64_t>>& worth) {
    constexpr float k_unit = 1 << 20;
    Kernel<profile> kernel(scene_, settings_, pass_, film_);
    std::vector<std::pair<uint32_t, float>> merged;
    kernel.note_merged(&merged);
    for (int i = number * k_piece; i < (number + 1) * k_piece && !cancel_.cancelled(); ++i) {
      const auto [x, y] = spread_pixel(region_, i);
      const Sampler sampler(seed_, x, y, static_cast<uint32_t>(round + 1));
      merged.clear();
      const PathEstimate estimate = see_pixel(kernel, scene_, sampler, x, y);
      const float seen = luminance(abs(estimate.radiance));
      for (const auto& [record, brought] : merged) {
        if (!(brought > 0.0f) || !(seen > 0.0f)) continue;
        const auto next = std::upper_bound(starts.begin(), starts.end(), record,
                                           [](uint32_t r, const Start& s) { return r < s.record; });
        worth[static_cast<size_t>(next - starts.begin()) - 1].fetch_add(
            static_cast<uint64_t>(std::min(brought / seen, 1.0f) * k_unit), std::memory_order_relaxed);
      }
    }
    add_counts(kernel);
  }

  void add_counts(Kernel<profile>& kernel) {
    const std::lock_guard lock(counts_mutex_);
    counts_ += kernel.take_counts();
  }

  const Scene& scene_;
  const LightSet& lights_;
  IntegratorSettings settings_;
  Film& film_;
  const Rectangle region_;
  const float footprint_m_;
  const CancelFlag& cancel_;
  RayCounts& counts_;
  std::mutex counts_mutex_;
  const double pixels_;
  int light_walks_;
  const int camera_walks_;  ///< of the last round
  const uint32_t seed_;
  Pass pass_;
};

}  // namespace

std::vector<Vec3> points_seen(const Scene& scene) {
  constexpr int k_side = 16;
  std::vector<Vec3> points;
  const Camera& camera = scene.camera();
  for (int i = 0; i < k_side * k_side; ++i) {
    const Vec2 raster((static_cast<float>(i % k_side) + 0.5f) / k_side * static_cast<float>(camera.width_px()),
                      (static_cast<float>(i / k_side) + 0.5f) / k_side * static_cast<float>(camera.height_px()));
    const CameraRay ray = camera.sample_ray(raster, {0.5f, 0.5f});
    Hit hit;
    if (scene.geometry().intersect({ray.origin, ray.t_min, ray.direction, ray.t_max, k_visible_camera}, hit))
      points.push_back(scene.geometry().surface(hit).p_world);
  }
  return points;
}

float typical_distance(const Scene& scene, std::span<const Vec3> points) {
  std::vector<float> distances;
  for (const Vec3& p : points) distances.push_back(length(p - scene.camera().origin()));
  if (distances.empty()) return 0.0f;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

template <KernelProfile profile>
EmissionAim learn_aim(const Scene& scene, const IntegratorSettings& settings, const TechniqueSet& set, Film& film,
                      float footprint_m, const CancelFlag& cancel, RayCounts& counts) {
  const Rectangle& region = film.region();
  if (!(footprint_m > 0.0f) || region.width <= 0 || region.height <= 0 || !(scene.lights().flux() > 0.0)) return {};
  return with_threads(settings.threads,
                      [&] { return Pilot<profile>(scene, settings, set, film, footprint_m, cancel, counts).learn(); });
}

template EmissionAim learn_aim<KernelProfile::solid>(const Scene&, const IntegratorSettings&, const TechniqueSet&,
                                                     Film&, float, const CancelFlag&, RayCounts&);
template EmissionAim learn_aim<KernelProfile::surfaces>(const Scene&, const IntegratorSettings&, const TechniqueSet&,
                                                        Film&, float, const CancelFlag&, RayCounts&);

}  // namespace lambent::bidirectional
