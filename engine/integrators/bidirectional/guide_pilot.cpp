#include "engine/integrators/bidirectional/guide_pilot.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>

#include "engine/base/hash.h"
#include "engine/base/parallel.h"
#include "engine/integrators/bidirectional/pilot_parts.h"

namespace lambent::bidirectional {

namespace {

constexpr int k_regions = 32, k_light_leaves = 128;
static_assert(k_light_leaves <= k_record_places);
/// What a region's own tries are mixed with: so many tries that brought what they bring on average over all regions.
constexpr double k_prior_tries = 8.0;
constexpr int k_light_walks = 512, k_piece = 128;
/// Camera walks that teach: half as many as pixels within these; half of that to judge what was learned.
constexpr int k_least_camera = 512, k_most_camera = 4096;
constexpr ConnectionPicks k_lessons{16, 4}, k_trials{8, 2};  ///< connections of each
/// The picture's parts, by as many, over which the light that is seen is averaged: one sample alone would say little.
constexpr int k_blocks = 16;
/// What one connection is taken to bring at most, over what its part of the picture sees: rarer ones teach chance.
constexpr double k_most_share = 64.0;
/// Connections of a camera walk at most; and the time of one, in rays of the walks.
constexpr double k_most_picks = 32.0, k_rays_of_pick = 1.3;
/// Where later vertices would have fewer, they connect to the own walk, whose vertices are in the nearest caches.
constexpr int k_least_later_picks = 2;
/// Of the variance of a pick, what is left however many there are, since all pick from one pool of some hundred
/// vertices: from how errors of neighbouring pixels were correlated on the door ajar (0.02 to 0.04).
constexpr double k_left_by_pool = 0.03;

/// What one camera walk saw, and what each connection brought of it.
struct View {
  int block = 0;
  double seen = 0.0;
  ConnectionLog log;
};

template <KernelProfile profile>
class GuidePilot {
 public:
  GuidePilot(const Scene& scene, const IntegratorSettings& settings, const Pass& like, Film& film,
             const CancelFlag& cancel, RayCounts& counts)
      : scene_(scene),
        settings_(settings_of_pilots(settings)),
        pass_(like),
        film_(film),
        cancel_(cancel),
        counts_(counts) {
    settings_.light_threshold = 0.0f;
    pass_.set.merging = false;
    pass_.guide = nullptr;
    pass_.pool = nullptr;
    const double pixels = static_cast<double>(film.region().width) * film.region().height;
    camera_walks_ =
        static_cast<int>(std::clamp(0.5 * pixels, 1.0 * k_least_camera, 1.0 * k_most_camera)) / k_piece * k_piece;
  }

  LearnedGuide learn() {
    trace_light();
    if (cancel_.cancelled()) return {};
    std::vector<VertexPool::Vertex> vertices;
    for (const auto& walk : walks_) {
      counts_.rays += walk->rays();
      for (int i = 0; i < walk->size(); ++i)
        if ((*walk)[i].bsdf.has_non_delta()) vertices.push_back({walk.get(), i, 0.0f});
    }
    if (vertices.empty()) return {};
    for (VertexPool::Vertex& vertex : vertices)
      vertex.scale = static_cast<float>(vertices.size()) / static_cast<float>(k_light_walks);
    pool_.set(std::move(vertices), k_lessons);
    pass_.pool = &pool_;
    const std::vector<View> views = look(camera_walks_, 0);
    if (cancel_.cancelled()) return {};
    LearnedGuide learned;
    learned.guide = guide_from(views);
    if (!learned.guide.empty()) learned.picks = picks_worth_their_time(learned.guide);
    return cancel_.cancelled() ? LearnedGuide{} : std::move(learned);
  }

 private:
  void trace_light() {
    walks_.resize(k_light_walks);
    tbb::parallel_for(0, k_light_walks / k_piece, [&](int piece) {
      for (int i = piece * k_piece; i < (piece + 1) * k_piece && !cancel_.cancelled(); ++i) {
        auto& walk = walks_[static_cast<size_t>(i)] =
            std::make_unique<LightWalk>(scene_, walk_settings(settings_, pass_));
        walk->trace(Sampler(seed_, 0, 0, static_cast<uint32_t>(i)));
      }
    });
  }

  /// Camera walks, two of each pixel, joined to the pool. Those without light to compare with are left out.
  std::vector<View> look(int walks, int round) {
    const Rectangle& region = film_.region();
    std::vector<View> views(static_cast<size_t>(walks));
    std::mutex counts_mutex;
    rays_ = 0;
    tbb::parallel_for(0, walks / k_piece, [&](int piece) {
      Kernel<profile> kernel(scene_, settings_, pass_, film_);
      for (int i = piece * k_piece; i < (piece + 1) * k_piece && !cancel_.cancelled(); ++i) {
        View& view = views[static_cast<size_t>(i)];
        const auto [x, y] = spread_pixel(region, i / 2);
        view.block = (y - region.y) * k_blocks / region.height * k_blocks + (x - region.x) * k_blocks / region.width;
        const Sampler sampler(seed_ + static_cast<uint32_t>(round), x, y, static_cast<uint32_t>(i));
        kernel.note_connected(&view.log);
        kernel.light_sample(sampler, nullptr, /*silent=*/true);
        view.seen = static_cast<double>(luminance(abs(see_pixel(kernel, scene_, sampler, x, y).radiance)));
      }
      const std::lock_guard lock(counts_mutex);
      const RayCounts traced = kernel.take_counts();
      counts_ += traced;
      rays_ += traced.rays;
    });
    return views;
  }

  /// By block, what views see on average.
  static std::array<double, k_blocks * k_blocks> light_of(const std::vector<View>& views) {
    std::array<double, k_blocks * k_blocks> light{}, samples{};
    for (const View& view : views) {
      if (!std::isfinite(view.seen)) continue;
      light[static_cast<size_t>(view.block)] += view.seen;
      samples[static_cast<size_t>(view.block)] += 1.0;
    }
    for (size_t i = 0; i < light.size(); ++i) light[i] /= std::max(samples[i], 1.0);
    return light;
  }

  ConnectionGuide guide_from(const std::vector<View>& views) const {
    const float radius = scene_.lights().scene_radius();
    std::vector<PlaceTree::Place> places;
    for (const View& view : views)
      for (const ConnectionLog::From& from : view.log.from)
        if (from.first) places.push_back({from.p_world, from.ng_world});
    if (places.empty()) return {};
    PlaceTree camera(std::move(places), radius, k_regions);
    places.clear();
    for (const VertexPool::Vertex& vertex : pool_.vertices())
      places.push_back({(*vertex).surface.p_world, (*vertex).surface.ng_world});
    PlaceTree light(std::move(places), radius, k_light_leaves);

    const size_t leaves = static_cast<size_t>(light.leaves()), first_regions = static_cast<size_t>(camera.leaves());
    const size_t regions =
        first_regions + static_cast<size_t>(ConnectionGuide::later_regions(static_cast<int>(leaves)));
    std::vector<size_t> leaf_of;
    std::vector<double> flux_of, flux(leaves), vertices(leaves);
    for (const VertexPool::Vertex& vertex : pool_.vertices()) {
      leaf_of.push_back(static_cast<size_t>(light.leaf_at((*vertex).surface.p_world, (*vertex).surface.ng_world)));
      flux_of.push_back(static_cast<double>(luminance(abs((*vertex).throughput))));
      flux[leaf_of.back()] += flux_of.back();
      vertices[leaf_of.back()] += 1.0;
    }
    // Squares of what a watt brings, as shares of what is seen: the best probability is the root of their mean.
    struct Tries {
      double count = 0.0, squares = 0.0;
    };
    std::vector<Tries> tries(regions * leaves), of_first(leaves), of_later(leaves);
    const auto light_seen = light_of(views);
    for (const View& view : views) {
      const double seen = light_seen[static_cast<size_t>(view.block)];
      if (!(seen > 0.0)) continue;
      for (const ConnectionLog::From& from : view.log.from) {
        const size_t region =
            static_cast<size_t>(from.first ? camera.leaf_at(from.p_world, from.ng_world)
                                           : camera.leaves() + light.leaf_at(from.p_world, from.ng_world) /
                                                                   ConnectionGuide::k_leaves_of_later);
        std::vector<Tries>& of_all = from.first ? of_first : of_later;
        const double picks = from.first ? k_lessons.first : k_lessons.later;
        for (const auto& [number, brought] : from.brought) {
          if (!(flux_of[number] > 0.0)) continue;
          const double share = std::min(static_cast<double>(brought) * picks / seen, k_most_share);
          for (Tries* at : {&tries[region * leaves + leaf_of[number]], &of_all[leaf_of[number]]}) {
            at->count += 1.0;
            at->squares += sqr(share / flux_of[number]);
          }
        }
      }
    }
    std::vector<double> worth(regions * leaves);
    for (size_t i = 0; i < worth.size(); ++i) {
      const Tries& all = (i < first_regions * leaves ? of_first : of_later)[i % leaves];
      const double prior = all.count > 0.0 ? all.squares / all.count : 0.0;
      worth[i] = std::sqrt((tries[i].squares + k_prior_tries * prior) / (tries[i].count + k_prior_tries));
    }
    return ConnectionGuide(std::move(camera), std::move(light), std::move(worth), flux, vertices, k_light_walks);
  }

  /// As many as lower the noise most for their time: the noise of choosing a vertex against that of all else.
  ConnectionPicks picks_worth_their_time(const ConnectionGuide& guide) {
    std::vector<PoolCandidate> candidates;
    double worth = 0.0;
    for (size_t i = 0; i < walks_.size(); ++i) {
      guide.place(*walks_[i]);
      candidates.push_back({static_cast<int>(i), 0, guide.worth(*walks_[i])});
      worth += candidates.back().worth;
    }
    std::vector<VertexPool::Vertex> vertices;
    for (const ChosenWalk& chosen : choose_walks(candidates, pool_.vertices().size(), 0.5f))
      take_vertices(guide, *walks_[static_cast<size_t>(chosen.x)], chosen, worth / k_light_walks, vertices);
    if (vertices.empty()) return {};
    pool_.set(std::move(vertices), k_trials, guide);
    pass_.guide = &guide;
    const std::vector<View> views = look(camera_walks_ / 2, 1);
    const auto light_seen = light_of(views);
    // Variances of a single pick, by what it is a pick of, and of all else.
    double of_first = 0.0, of_later = 0.0, of_rest = 0.0, rest_before = 0.0;
    double later_vertices = 0.0;
    for (size_t i = 0; i < views.size(); ++i) {
      const View& view = views[i];
      const double seen = light_seen[static_cast<size_t>(view.block)];
      double rest = seen > 0.0 ? view.seen / seen : 0.0;
      for (const ConnectionLog::From& from : view.log.from) {
        const double picks = from.first ? k_trials.first : k_trials.later;
        double sum = 0.0, squares = 0.0;
        for (const auto& [number, brought] : from.brought) {
          const double share = seen > 0.0 ? std::min(static_cast<double>(brought) * picks / seen, k_most_share) : 0.0;
          sum += share;
          squares += sqr(share);
        }
        (from.first ? of_first : of_later) += (squares - sqr(sum) / picks) / (picks - 1.0);
        later_vertices += from.first ? 0.0 : 1.0;
        rest -= sum / picks;
      }
      rest = std::min(std::fabs(rest), k_most_share);
      if (i % 2 == 1) of_rest += sqr(rest - rest_before);
      rest_before = rest;
    }
    later_vertices /= static_cast<double>(views.size());
    const double rays = static_cast<double>(rays_) / static_cast<double>(views.size()) -
                        0.5 * (k_trials.first + k_trials.later * later_vertices);
    of_rest += k_left_by_pool * (of_first + of_later);
    // (rest + first / p + later / q) (rays + p's rays + q's rays) is least there.
    const auto best = [&](double of_pick, double picking_vertices) {
      if (!(of_pick > 0.0)) return 1;
      const double picks = std::sqrt(of_pick / std::max(of_rest, 1e-6 * of_pick) * std::max(rays, 1.0) /
                                     (k_rays_of_pick * picking_vertices));
      return static_cast<int>(std::lround(std::clamp(picks, 1.0, k_most_picks)));
    };
    const int later = best(of_later, later_vertices);
    return {best(of_first, 1.0), later < k_least_later_picks ? 0 : later};
  }

  const Scene& scene_;
  IntegratorSettings settings_;
  Pass pass_;
  Film& film_;
  const CancelFlag& cancel_;
  RayCounts& counts_;
  const uint32_t seed_ = hash_u32(settings_.seed ^ 0x2545f491u);
  int camera_walks_ = 0;
  uint64_t rays_ = 0;  ///< of the views last taken
  std::vector<std::unique_ptr<LightWalk>> walks_;
  VertexPool pool_;
};

}  // namespace

template <KernelProfile profile>
LearnedGuide learn_guide(const Scene& scene, const IntegratorSettings& settings, const Pass& like, Film& film,
                         const CancelFlag& cancel, RayCounts& counts) {
  const Rectangle& region = film.region();
  if (region.width <= 0 || region.height <= 0 || !(scene.lights().flux() > 0.0)) return {};
  return with_threads(settings.threads,
                      [&] { return GuidePilot<profile>(scene, settings, like, film, cancel, counts).learn(); });
}

template LearnedGuide learn_guide<KernelProfile::solid>(const Scene&, const IntegratorSettings&, const Pass&, Film&,
                                                        const CancelFlag&, RayCounts&);
template LearnedGuide learn_guide<KernelProfile::surfaces>(const Scene&, const IntegratorSettings&, const Pass&, Film&,
                                                           const CancelFlag&, RayCounts&);

}  // namespace lambent::bidirectional
