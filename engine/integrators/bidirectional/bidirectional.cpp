#include "engine/integrators/bidirectional/bidirectional.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>

#include "engine/base/check.h"
#include "engine/base/hash.h"
#include "engine/integrators/bidirectional/guide_pilot.h"
#include "engine/integrators/bidirectional/kernel.h"
#include "engine/integrators/bidirectional/pilot.h"

namespace lambent {

namespace {

/// Light walks are cut after so many vertices; longer paths are left to techniques with more camera vertices.
constexpr int k_most_light_vertices = 100;
/// Light walks of a pass that leave photons at most: bounds the memory of large pictures.
constexpr uint64_t k_most_merge_paths = 1u << 20;
/// Light walks of a pass among which the pool is chosen at most, and how many vertices it has: few enough to stay in
/// the caches (1,024 instead of 128 were no less noisy).
constexpr uint64_t k_most_pool_paths = 1u << 16;
constexpr size_t k_least_pool = 64, k_most_pool = 256, k_candidates_of_vertex = 128;
constexpr size_t k_pool_piece = 64;
/// Merge radii and cells of the photon map over the radius at a typical first hit.
constexpr float k_largest_radius = 3.0f, k_cell_size = 2.0f;

/// Footprint of a pixel, m, at the median of what some rays over the picture meet first; 0 if they meet nothing.
float typical_footprint(const Scene& scene) {
  std::vector<float> widths;
  for (const Vec3& p : bidirectional::points_seen(scene)) widths.push_back(scene.footprint_at(p).width_m);
  if (widths.empty()) return 0.0f;
  std::nth_element(widths.begin(), widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2), widths.end());
  return widths[widths.size() / 2];
}

/// Radii that are not positive or no number merge nothing; an alpha beyond 0 to 1, with which radii would grow or
/// vanish, is the nearer end.
IntegratorSettings with_usable_merging(IntegratorSettings settings) {
  if (!(settings.merge_radius_px > 0.0f)) settings.merge_radius_px = 0.0f;
  settings.merge_alpha = std::isnan(settings.merge_alpha) ? 1.0f : std::clamp(settings.merge_alpha, 0.0f, 1.0f);
  return settings;
}

template <KernelProfile profile>
class Bidirectional final : public Integrator {
 public:
  Bidirectional(std::shared_ptr<const Scene> scene, const IntegratorSettings& settings, const TechniqueSet& set)
      : scene_(std::move(scene)),
        settings_(with_usable_merging(settings)),
        other_settings_(for_other_pictures(settings_)) {
    pass_.set = set;
    if (!(settings.merge_radius_px > 0.0f) && set.light_tracing) pass_.set.merging = false;
    pass_.counts.max_light_vertices = std::clamp(settings.bounces.total, 0, k_most_light_vertices - 1) + 1;
    pass_.clamp_connection = settings.clamp_connection;
    if (pass_.set.light_walks()) typical_footprint_m_ = typical_footprint(*scene_);
    pass_.aim = other_pass_.aim = &aim_;
    other_pass_.set = k_techniques_bpt;
    other_pass_.counts.max_light_vertices = pass_.counts.max_light_vertices;
  }

  void prepare(Film& film) override {
    first_sample_ = film.min_sample_count();
    pass_.counts.light_paths = static_cast<float>(film.region().width) * static_cast<float>(film.region().height);
    other_pass_.counts.light_paths = pass_.counts.light_paths;
    if (!film.takes_splats()) other_pass_.set.light_tracing = false;
    if (!keeps_walks()) return;
    tiles_ = std::vector<Tile>(static_cast<size_t>(film.tiles().count()));
    for (Tile& tile : tiles_) tile.batch.keep_events = settings_.passes && settings_.passes->wants_events();
    const Rectangle& region = film.region();
    const double pixels = static_cast<double>(region.width) * region.height;
    photon_share_ = static_cast<float>(std::min(1.0, static_cast<double>(k_most_merge_paths) / pixels));
    pool_share_ = static_cast<float>(std::min(1.0, static_cast<double>(k_most_pool_paths) / pixels));
    merge_paths_ = 0;
    for (int y = region.y; y < region.y + region.height; ++y)
      for (int x = region.x; x < region.x + region.width; ++x) merge_paths_ += leaves_photons(x, y);
    pass_.counts.merge_paths = static_cast<float>(merge_paths_);
  }

  int stages(int64_t sample) const override {
    return (learns_aim(sample) ? 1 : 0) + (keeps_walks() ? 3 : pass_.set.shared_lights ? 1 : 0);
  }

  int begin_stage(Film&, int64_t sample, int stage) override {
    if (learns_aim(sample) && stage-- == 0) return 1;
    if (pass_.set.shared_lights) return begin_shared();
    take_learned();
    if (!keeps_walks()) return 0;
    if (stage == 1) return has_pool() ? choose_pool(sample) : 0;
    if (stage == 2) {
      if (has_pool()) finish_pool();
      return pass_.set.merging ? 1 : 0;
    }
    const float shrink = std::pow(static_cast<float>(sample + 1), 0.5f * (settings_.merge_alpha - 1.0f));
    const float radius_scale = settings_.merge_radius_px * shrink;
    pass_.radius_scale = radius_scale;
    pass_.radius_limit_m =
        std::min(k_largest_radius * radius_scale * typical_footprint_m_, 4.0f * scene_->lights().scene_radius());
    // Photons and the pool come from the sample before, as a by-product; where it was not rendered here, its walks are
    // made again.
    missing_.clear();
    for (size_t i = 0; i < tiles_.size(); ++i)
      if (tiles_[i].complete_sample != sample - 1) missing_.push_back(static_cast<int>(i));
    return static_cast<int>(missing_.size());
  }

  RayCounts run_piece(Film& film, int64_t sample, int stage, int piece, const CancelFlag& cancel) override {
    if (learns_aim(sample) && stage-- == 0) {
      RayCounts counts;
      aim_ =
          bidirectional::learn_aim<profile>(*scene_, settings_, pass_.set, film, typical_footprint_m_, cancel, counts);
      if (pass_.set.connections)
        learning_ = bidirectional::learn_guide<profile>(*scene_, settings_, pass_, film, cancel, counts);
      return counts;
    }
    if (pass_.set.shared_lights) return trace_shared(sample);
    if (stage == 0) return trace_missing(film, sample - 1, missing_[static_cast<size_t>(piece)], cancel);
    if (stage == 1) return trace_chosen(sample, static_cast<size_t>(piece), cancel);
    std::vector<PhotonBatch*> batches;
    for (Tile& tile : tiles_) batches.push_back(&tile.batch);
    const float cell = k_cell_size * settings_.merge_radius_px * typical_footprint_m_;
    photons_.build(batches, std::min(cell, 4.0f * scene_->lights().scene_radius()), scene_->geometry().bounds_world(),
                   merge_paths_, settings_.threads, cancel);
    pass_.photons = &photons_;
    return {};
  }

  RayCounts render_tile(Film& film, int tile, int64_t target_samples, const CancelFlag& cancel) override {
    const KernelLoan loan(*this, film);
    Kernel& kernel = *loan.kernel;
    TileWriter writer(film, tile);
    Tile* kept = keeps_walks() ? &tiles_[static_cast<size_t>(tile)] : nullptr;
    if (kept) kept->clear();
    bool whole = true, one_each = true;
    uint64_t paths = 0;
    const Rectangle& rectangle = film.tiles()[tile];
    const bool adaptive = film.settings().second_moments;
    if (PassRecorder* const passes = kernel.passes()) passes->start_clock();
    for (int y = rectangle.y; y < rectangle.y + rectangle.height && whole; ++y)
      for (int x = rectangle.x; x < rectangle.x + rectangle.width; ++x) {
        if (cancel.cancelled()) {
          whole = false;
          break;
        }
        if (adaptive && !film.active(x, y)) {
          // A pixel that is done still leaves its walk: photons and pool stand for all of them, whoever else needs
          // them.
          if (kept) leave_walk(kernel, *kept, x, y, target_samples - 1);
          continue;
        }
        const int64_t first = film.sample_count(x, y);
        one_each = one_each && first == target_samples - 1;
        for (int64_t sample = first; sample < target_samples; ++sample) {
          const Sampler sampler(settings_.seed, x, y, static_cast<uint32_t>(sample));
          enter(x, y, sample);
          if (has_light_walks()) {
            kernel.light_sample(sampler, kept && leaves_photons(x, y) ? &kept->batch : nullptr, /*silent=*/false);
            if (kept) note_worth(kernel, *kept, x, y);
          }
          PassRecorder* const passes = kernel.passes();
          if (passes) passes->begin(x, y, static_cast<uint32_t>(sample), writer.next());
          const PathEstimate estimate = camera_sample(kernel, *scene_, sampler, x, y);
          const Vec4 picture = picture_of(estimate, settings_.exposure);
          bool any_other = false;
          for (size_t i = 0; passes && i < loan.others.size(); ++i) {
            if (!loan.others[i]) continue;
            any_other = true;
            // By connections alone, which find the same light: photons would need a map of their own.
            loan.others[i]->light_sample(sampler, nullptr, /*silent=*/false);
            PassRecorder* const parts = loan.others[i]->passes();
            if (parts) parts->begin(x, y, static_cast<uint32_t>(sample));
            const PathEstimate other = camera_sample(*loan.others[i], *settings_.others[i], sampler, x, y);
            passes->add_other(static_cast<OtherPicture>(i), other.radiance * settings_.exposure,
                              1.0f - other.transparency, parts);
          }
          if (render_context().interrupted && cancel.cancelled()) {  // not whole: as if it had not begun
            kernel.drop_splats();
            for (const auto& other : loan.others)
              if (other) other->drop_splats();
            whole = false;
            break;
          }
          kernel.give_splats();
          for (size_t i = 0; any_other && i < loan.others.size(); ++i)
            if (loan.others[i]) loan.others[i]->give_splats();
          if (any_other || has_light_walks()) ++paths;
          if (passes) {
            passes->finish(picture, estimate.behind * settings_.exposure, sample + 1 == target_samples);
            writer.add_next(x, y);
          } else {
            writer.add(x, y, picture);
          }
        }
      }
    if (kept) kept->complete_sample = whole && one_each ? target_samples - 1 : k_none;
    if (film.takes_splats()) film.add_light_paths(paths);
    RayCounts counts = kernel.take_counts();
    for (const auto& other : loan.others)
      if (other) counts += other->take_counts();
    return counts;
  }

 private:
  using Kernel = bidirectional::Kernel<profile>;
  /// A kernel, with its memory, for the time of one piece of work.
  struct KernelLoan {
    KernelLoan(Bidirectional& from, Film& film) : owner(from) {
      const std::lock_guard lock(owner.kernels_mutex_);
      const auto borrow = [](std::vector<std::unique_ptr<Kernel>>& kernels, auto&& make) {
        if (kernels.empty()) return make();
        std::unique_ptr<Kernel> idle = std::move(kernels.back());
        kernels.pop_back();
        return idle;
      };
      kernel = borrow(owner.kernels_,
                      [&] { return std::make_unique<Kernel>(*owner.scene_, owner.settings_, owner.pass_, film); });
      for (size_t i = 0; i < others.size(); ++i)
        if (owner.settings_.others[i])
          others[i] = borrow(owner.other_kernels_[i], [&] {
            return std::make_unique<Kernel>(*owner.settings_.others[i], owner.other_settings_[i], owner.other_pass_,
                                            film, owner.settings_.passes->plane(static_cast<OtherPicture>(i)));
          });
    }
    ~KernelLoan() {
      const std::lock_guard lock(owner.kernels_mutex_);
      owner.kernels_.push_back(std::move(kernel));
      for (size_t i = 0; i < others.size(); ++i)
        if (others[i]) owner.other_kernels_[i].push_back(std::move(others[i]));
    }
    Bidirectional& owner;
    std::unique_ptr<Kernel> kernel;
    std::array<std::unique_ptr<Kernel>, k_other_pictures> others;  ///< those there are
  };

  static constexpr int64_t k_none = -2;  // -1 is the sample whose photons the first pass merges with
  struct Tile {
    PhotonBatch batch;
    std::vector<bidirectional::PoolCandidate> walks;
    int64_t complete_sample = k_none;  ///< all of whose photons and walks are here
    void clear() {
      batch.clear();
      walks.clear();
    }
  };

  void enter(int x, int y, int64_t sample) const {
    RenderContext& context = render_context();
    context.pixel_x = x;
    context.pixel_y = y;
    context.sample = sample;
  }

  /// Before the first sample of this render, whichever that is: what is learned does not depend on it.
  bool learns_aim(int64_t sample) const { return sample == first_sample_ && pass_.set.light_walks(); }

  /// What stages() says depends on what was learned, and workers ask for it while one learns.
  void take_learned() {
    if (!learning_) return;
    learned_ = std::move(learning_);
    learning_.reset();
    if (!learned_->guide.empty()) pass_.guide = &learned_->guide;
    // Where one connection is enough, camera walks find nearly all of the light by themselves.
    if (learned_->picks.first <= 1) pass_.counts.shared_scatter = 1.0f;
  }

  bool has_pool() const { return pass_.guide != nullptr; }
  /// Whether the light walks of a sample serve the next.
  bool keeps_walks() const { return pass_.set.merging || (pass_.set.connections && (!learned_ || has_pool())); }
  bool is_candidate(int x, int y) const { return is_in_share(x, y, pool_share_); }
  void note_worth(Kernel& kernel, Tile& kept, int x, int y) const {
    if (has_pool() && is_candidate(x, y)) kept.walks.push_back({x, y, pass_.guide->worth(kernel.light_walk())});
  }
  /// Traces a walk for what it leaves to the next sample alone.
  void leave_walk(Kernel& kernel, Tile& kept, int x, int y, int64_t sample) const {
    const bool photons = leaves_photons(x, y);
    if (!photons && !(has_pool() && is_candidate(x, y))) return;
    enter(x, y, sample);
    kernel.light_sample(Sampler(settings_.seed, x, y, static_cast<uint32_t>(sample)), photons ? &kept.batch : nullptr,
                        /*silent=*/true);
    note_worth(kernel, kept, x, y);
  }

  /// Chooses light walks of the sample before by what they are worth. Returns in how many pieces they are traced again.
  int choose_pool(int64_t sample) {
    std::vector<bidirectional::PoolCandidate> candidates;
    for (const Tile& tile : tiles_) candidates.insert(candidates.end(), tile.walks.begin(), tile.walks.end());
    // What is chosen must not depend on tiles.
    std::ranges::sort(candidates, {}, [](const bidirectional::PoolCandidate& c) { return std::pair(c.y, c.x); });
    double worth = 0.0;
    for (const bidirectional::PoolCandidate& candidate : candidates) worth += candidate.worth;
    worth_of_walk_ = worth / static_cast<double>(candidates.size());
    const Sampler sampler(settings_.seed, 0, -2, static_cast<uint32_t>(sample));
    const size_t count = std::clamp(candidates.size() / k_candidates_of_vertex, k_least_pool, k_most_pool);
    chosen_ = bidirectional::choose_walks(candidates, count, sampler.get_1d(0));
    taken_.resize(chosen_.size());
    while (pool_walks_.size() < chosen_.size())
      pool_walks_.push_back(std::make_unique<LightWalk>(*scene_, bidirectional::walk_settings(settings_, pass_)));
    return static_cast<int>((chosen_.size() + k_pool_piece - 1) / k_pool_piece);
  }

  RayCounts trace_chosen(int64_t sample, size_t piece, const CancelFlag& cancel) {
    RayCounts counts;
    const size_t end = std::min((piece + 1) * k_pool_piece, chosen_.size());
    for (size_t i = piece * k_pool_piece; i < end; ++i) {
      taken_[i].clear();
      if (cancel.cancelled()) continue;
      LightWalk& walk = *pool_walks_[i];
      const uint64_t before = walk.rays();
      enter(chosen_[i].x, chosen_[i].y, sample - 1);
      walk.trace(Sampler(settings_.seed, chosen_[i].x, chosen_[i].y, static_cast<uint32_t>(sample - 1)));
      counts.rays += walk.rays() - before;
      pass_.guide->place(walk);
      bidirectional::take_vertices(*pass_.guide, walk, chosen_[i], worth_of_walk_, taken_[i]);
    }
    return counts;
  }

  void finish_pool() {
    std::vector<bidirectional::VertexPool::Vertex> vertices;
    for (const auto& some : taken_) vertices.insert(vertices.end(), some.begin(), some.end());
    pool_.set(std::move(vertices), learned_->picks, *pass_.guide);
    pass_.pool = pool_.empty() ? nullptr : &pool_;
  }

  bool has_light_walks() const { return pass_.set.connections || pass_.set.light_tracing || pass_.set.merging; }

  PathEstimate camera_sample(Kernel& kernel, const Scene& scene, const Sampler& sampler, int x, int y) const {
    const Vec2 offset = settings_.filter.sample(sampler.get_2d(k_dimension_pixel_filter));
    const Vec2 raster(static_cast<float>(x) + 0.5f + offset.x, static_cast<float>(y) + 0.5f + offset.y);
    const Vec2 lens = scene.profile().depth_of_field ? sampler.get_2d(k_dimension_lens) : Vec2(0.0f);
    return kernel.camera_sample(sampler, scene.camera().sample_ray(raster, lens), x, y);
  }

  /// A pixel's light walks leave photons if its hash is below the share that keeps their number bounded.
  bool leaves_photons(int x, int y) const { return pass_.set.merging && is_in_share(x, y, photon_share_); }
  static bool is_in_share(int x, int y, float share) {
    return share >= 1.0f ||
           unit_float(hash_combine(hash_u32(static_cast<uint32_t>(x)), static_cast<uint32_t>(y))) < share;
  }

  /// The light walks of a tile's sample, for what they leave to the next sample alone.
  RayCounts trace_missing(Film& film, int64_t sample, int tile, const CancelFlag& cancel) {
    const KernelLoan loan(*this, film);
    Kernel& kernel = *loan.kernel;
    Tile& kept = tiles_[static_cast<size_t>(tile)];
    kept.clear();
    const Rectangle& r = film.tiles()[tile];
    for (int y = r.y; y < r.y + r.height; ++y)
      for (int x = r.x; x < r.x + r.width; ++x) {
        if (cancel.cancelled()) return kernel.take_counts();
        leave_walk(kernel, kept, x, y, sample);
      }
    if (cancel.cancelled()) return kernel.take_counts();
    kept.complete_sample = sample;
    return kernel.take_counts();
  }

  int begin_shared() {
    const size_t walks = static_cast<size_t>(std::clamp(settings_.shared_light_paths, 1, 4096));
    while (shared_.size() < walks)
      shared_.push_back(std::make_unique<LightWalk>(*scene_, bidirectional::walk_settings(settings_, pass_)));
    return 1;
  }

  RayCounts trace_shared(int64_t sample) {
    RayCounts counts;
    shared_view_.clear();
    for (size_t i = 0; i < shared_.size(); ++i) {
      const uint64_t before = shared_[i]->rays();
      shared_[i]->trace(Sampler(settings_.seed, static_cast<int>(i), -1, static_cast<uint32_t>(sample)));
      counts.rays += shared_[i]->rays() - before;
      shared_view_.push_back(shared_[i].get());
    }
    pass_.shared_lights = shared_view_;
    return counts;
  }

  const std::shared_ptr<const Scene> scene_;
  const IntegratorSettings settings_;
  const std::array<IntegratorSettings, k_other_pictures> other_settings_;
  bidirectional::Pass pass_;
  bidirectional::Pass other_pass_;  ///< for the other pictures
  std::mutex kernels_mutex_;
  std::vector<std::unique_ptr<Kernel>> kernels_;  ///< that no thread uses
  std::array<std::vector<std::unique_ptr<Kernel>>, k_other_pictures> other_kernels_;
  int64_t first_sample_ = 0;
  EmissionAim aim_;
  std::vector<Tile> tiles_;
  std::vector<int> missing_;
  PhotonMap photons_;
  std::vector<std::unique_ptr<LightWalk>> shared_;
  std::vector<const LightWalk*> shared_view_;
  std::optional<bidirectional::LearnedGuide> learned_;   ///< none: not yet
  std::optional<bidirectional::LearnedGuide> learning_;  ///< by the one piece of a stage, until it is over
  std::vector<bidirectional::ChosenWalk> chosen_;
  std::vector<std::unique_ptr<LightWalk>> pool_walks_;                 ///< the chosen, traced again
  std::vector<std::vector<bidirectional::VertexPool::Vertex>> taken_;  ///< of each
  double worth_of_walk_ = 0.0;                                         ///< on average over the candidates
  bidirectional::VertexPool pool_;
  float pool_share_ = 1.0f;
  uint64_t merge_paths_ = 0;
  float photon_share_ = 1.0f;
  float typical_footprint_m_ = 0.0f;
};

}  // namespace

std::unique_ptr<Integrator> make_bidirectional(std::shared_ptr<const Scene> scene, const IntegratorSettings& settings,
                                               const TechniqueSet& set) {
  CHECK(settings.profile >= scene->profile().kernel(), "the kernel must cover what the scene needs");
  if (settings.profile == KernelProfile::solid)
    return std::make_unique<Bidirectional<KernelProfile::solid>>(std::move(scene), settings, set);
  return std::make_unique<Bidirectional<KernelProfile::surfaces>>(std::move(scene), settings, set);
}

}  // namespace lambent
