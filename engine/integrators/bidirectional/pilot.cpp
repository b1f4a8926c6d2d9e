#include "engine/integrators/bidirectional/pilot.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "engine/base/hash.h"

namespace lambent::bidirectional {

namespace {

constexpr int k_rounds = 3;
/// Light walks of a round: half as many as pixels within these, so that all of it costs about a sample of small
/// pictures and little of large ones. A quarter as many camera walks; half as many in the last round.
constexpr int k_least_walks = 512, k_most_walks = 16384;
constexpr int k_piece = 128;
/// Merge radius in widths of a pixel, at least; more where camera walks lie further apart.
constexpr float k_least_radius_px = 3.0f;
/// An aim is kept if it lowers the noise at least to this, on average.
constexpr double k_worthwhile = 0.5;
/// So many walks tell for sure whether it does.
constexpr double k_enough_walks = 300.0;
/// Of the sphere around the scene: the smallest target.
constexpr float k_least_target = 1e-3f;

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

template <KernelProfile profile>
EmissionAim learn(const Scene& scene, const IntegratorSettings& settings, const TechniqueSet& set, Film& film,
                  float footprint_m, const CancelFlag& cancel, RayCounts& counts) {
  const LightSet& lights = scene.lights();
  const Rectangle& region = film.region();
  const double pixels = static_cast<double>(region.width) * region.height;
  if (!(footprint_m > 0.0f) || !(pixels > 0.0) || !(lights.flux() > 0.0)) return {};

  IntegratorSettings quiet = settings;
  quiet.observer = nullptr;
  quiet.passes = nullptr;
  quiet.others = {};
  quiet.clamp_direct = quiet.clamp_indirect = 0.0f;
  // What merging brings stands for all that light walks bring: a photon weighs as if it were merged with in its pixel.
  Pass pass;
  pass.set = set;
  if (!set.weighted()) pass.set = k_techniques_ppm;
  pass.set.connections = pass.set.shared_lights = pass.set.light_tracing = false;
  pass.set.merging = true;
  pass.set.first_merge_camera = pass.set.first_merge_light = 1;
  pass.counts.max_light_vertices = std::clamp(settings.bounces.total, 0, 15) + 1;
  pass.counts.light_paths = static_cast<float>(pixels);
  pass.correlation_aware = false;

  const uint32_t seed = hash_u32(settings.seed ^ 0x5bd1e995u);
  EmissionAim aim;
  const int light_walks =
      static_cast<int>(std::clamp(0.5 * pixels, 1.0 * k_least_walks, 1.0 * k_most_walks)) / k_piece * k_piece;
  for (int round = 0; round < k_rounds; ++round) {
    const bool last = round + 1 == k_rounds;
    const int camera_walks = light_walks / (last ? 2 : 4);
    const EmissionAim used = std::move(aim);
    pass.aim = &used;
    const double spacing_px = std::sqrt(pixels / camera_walks);
    const float radius_px = std::max(k_least_radius_px, static_cast<float>(1.5 * spacing_px));
    pass.radius_scale = radius_px;
    pass.radius_limit_m = 3.0f * radius_px * footprint_m;
    pass.counts.merge_paths = static_cast<float>(pixels) / (k_pi * sqr(radius_px));

    const auto sampler_of = [&](int walk) { return Sampler(seed, 0, round, static_cast<uint32_t>(walk)); };
    std::vector<Piece> pieces(static_cast<size_t>(light_walks / k_piece));
    std::mutex counts_mutex;
    const auto add_counts = [&](Kernel<profile>& kernel) {
      const std::lock_guard lock(counts_mutex);
      counts += kernel.take_counts();
    };
    tbb::parallel_for(size_t{0}, pieces.size(), [&](size_t p) {
      Kernel<profile> kernel(scene, quiet, pass, film);
      Piece& piece = pieces[p];
      for (int i = 0; i < k_piece && !cancel.cancelled(); ++i) {
        Start start;
        start.record = static_cast<uint32_t>(piece.batch.records.size());
        kernel.light_sample(sampler_of(static_cast<int>(p) * k_piece + i), &piece.batch, /*silent=*/true);
        const LightWalk& walk = kernel.light_walk();
        if (walk.size() == 0) continue;
        const LightKind kind = lights.kind(walk.light());
        start.n_light = walk.start().n_light_world;
        start.direction = walk.start().direction_world;
        start.distance_m = length(walk[0].surface.p_world - walk.start().p_light_world);
        start.arrival = {walk.light(), kind == LightKind::sun || kind == LightKind::environment,
                         walk[0].surface.p_world, 0.0f};
        piece.starts.push_back(start);
      }
      add_counts(kernel);
    });
    if (cancel.cancelled()) return {};

    std::vector<Start> starts;
    std::vector<PhotonBatch*> batches;
    uint32_t before = 0;
    for (Piece& piece : pieces) {
      for (Start start : piece.starts) {
        start.record += before;
        starts.push_back(start);
      }
      before += static_cast<uint32_t>(piece.batch.records.size());
      batches.push_back(&piece.batch);
    }
    PhotonMap photons;
    const float radius_m = radius_px * footprint_m;
    photons.build(batches, std::min(2.0f * radius_m, 4.0f * lights.scene_radius()), scene.geometry().bounds_world(),
                  static_cast<uint64_t>(light_walks), settings.threads, cancel);
    pass.photons = &photons;

    // What of its sample's light each walk brought, in fixed point: sums do not depend on their order.
    constexpr float k_unit = 1 << 20;
    std::vector<std::atomic<uint64_t>> worth(starts.size());
    tbb::parallel_for(0, camera_walks / k_piece, [&](int p) {
      Kernel<profile> kernel(scene, quiet, pass, film);
      std::vector<std::pair<uint32_t, float>> merged;
      kernel.note_merged(&merged);
      for (int i = p * k_piece; i < (p + 1) * k_piece && !cancel.cancelled(); ++i) {
        // Evenly over the picture by two irrational steps (Roberts 2018, "The Unreasonable Effectiveness of
        // Quasirandom Sequences").
        const auto step = [&](double by, int extent) {
          return std::min(static_cast<int>((i * by - std::floor(i * by)) * extent), extent - 1);
        };
        const int x = region.x + step(0.7548776662466927, region.width);
        const int y = region.y + step(0.5698402909980532, region.height);
        const Sampler sampler(seed, x, y, static_cast<uint32_t>(round + 1));
        const Vec2 raster(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
        const Vec2 lens = scene.profile().depth_of_field ? sampler.get_2d(k_dimension_lens) : Vec2(0.0f);
        merged.clear();
        const PathEstimate estimate = kernel.camera_sample(sampler, scene.camera().sample_ray(raster, lens), x, y);
        const float seen = luminance(abs(estimate.radiance));
        for (const auto& [record, brought] : merged) {
          if (!(brought > 0.0f) || !(seen > 0.0f)) continue;
          const auto start = std::upper_bound(starts.begin(), starts.end(), record,
                                              [](uint32_t r, const Start& s) { return r < s.record; });
          worth[static_cast<size_t>(start - starts.begin()) - 1].fetch_add(
              static_cast<uint64_t>(std::min(brought / seen, 1.0f) * k_unit), std::memory_order_relaxed);
        }
      }
      add_counts(kernel);
    });
    if (cancel.cancelled()) return {};
    std::vector<EmissionArrival> arrivals;
    for (size_t i = 0; i < starts.size(); ++i) {
      starts[i].arrival.worth = static_cast<float>(worth[i].load(std::memory_order_relaxed));
      arrivals.push_back(starts[i].arrival);
    }
    aim = EmissionAim(arrivals, k_least_target * lights.scene_radius());
    pass.photons = nullptr;
    const Judgement judged = judge(lights, aim, starts);
    if (judged.noise > k_worthwhile && (last || judged.walks > k_enough_walks)) return {};
  }
  return aim;
}

}  // namespace

template <KernelProfile profile>
EmissionAim learn_aim(const Scene& scene, const IntegratorSettings& settings, const TechniqueSet& set, Film& film,
                      float footprint_m, const CancelFlag& cancel, RayCounts& counts) {
  const auto work = [&] { return learn<profile>(scene, settings, set, film, footprint_m, cancel, counts); };
  return settings.threads > 0 ? tbb::task_arena(settings.threads).execute(work) : work();
}

template EmissionAim learn_aim<KernelProfile::solid>(const Scene&, const IntegratorSettings&, const TechniqueSet&,
                                                     Film&, float, const CancelFlag&, RayCounts&);
template EmissionAim learn_aim<KernelProfile::surfaces>(const Scene&, const IntegratorSettings&, const TechniqueSet&,
                                                        Film&, float, const CancelFlag&, RayCounts&);

}  // namespace lambent::bidirectional
