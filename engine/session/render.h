// One render of one scene: passes of tiles on the worker pool.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <vector>

#include "engine/base/cancel.h"
#include "engine/film/film.h"
#include "engine/integrators/integrator.h"
#include "engine/session/worker_pool.h"

namespace lambent {

struct RenderGoal {
  int64_t samples = 0;           ///< 0: unlimited
  double time_limit_s = 0.0;     ///< from the start of rendering; 0: none
  float noise_threshold = 0.0f;  ///< 0: off
  int threads = 0;               ///< 0: all workers
};

/// Serves the tiles of one film to workers, pass after pass. A tile's next pass waits for its previous one, and only
/// with a noise threshold does a pass wait for the whole one before: so no worker idles at the end of a pass.
class Render final : public WorkSource {
 public:
  /// @param tile_finished called by workers after each tile of a pass
  Render(WorkerPool& pool, std::shared_ptr<Film> film, std::unique_ptr<Integrator> integrator, const RenderGoal& goal,
         const CancelFlag& cancel, std::function<void()> tile_finished);

  enum class End { finished, cancelled };
  /// Blocks until the goal is reached or the flag set.
  End run();
  /// Has run() look at the flag at once. Any thread.
  void wake();

  // For progress; callable from any thread while run() runs.
  int64_t pass_target() const;  ///< samples that pixels have once the current pass is done
  int64_t tiles_done_in_pass() const;
  std::vector<Rectangle> active_tiles() const;
  RayCounts counts() const;
  double first_tile_s() const;  ///< since run() began; 0 before
  /// Fraction done in [0, 1] by samples or time, whichever is further; negative if the goal is unlimited.
  double fraction_done() const;

  bool work(int worker) override;
  int worker_limit() const override { return goal_.threads; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Piece {
    int stage = -1;  ///< of Integrator::stages(), its piece in `tile`; -1: a tile
    int tile = 0;
    int64_t target = 0;
  };
  double elapsed_s() const;
  bool next_piece(Piece& piece);  ///< false: nothing to start now. With mutex_ held
  bool next_stage_piece(Piece& piece, bool& wait);
  void begin_next_pass();  ///< with mutex_ held
  void finish(const Piece& piece, const RayCounts& counts);

  WorkerPool& pool_;
  const std::shared_ptr<Film> film_;
  const std::unique_ptr<Integrator> integrator_;
  const RenderGoal goal_;
  const CancelFlag& cancel_;
  const std::function<void()> tile_finished_;
  Clock::time_point start_ = Clock::now();
  CancelFlag stop_tiles_;  ///< cancelled or out of time

  mutable std::mutex mutex_;
  std::condition_variable finished_;
  std::vector<char> tile_busy_;
  int64_t target_ = 0;                                       ///< samples after the pass being handed out
  int64_t before_pass_ = 0;                                  ///< and before it
  double pass_start_s_ = 0.0;                                ///< when it began, since run() began
  int next_tile_ = 0;                                        ///< of that pass
  int busy_ = 0;                                             ///< tiles and pieces being worked on
  int stage_ = 0, stage_pieces_ = 0, next_stage_piece_ = 0;  ///< stage under way; Integrator::stages(): the tiles
  int done_in_pass_ = 0;                                     ///< tiles finished since the pass began
  bool exhausted_ = false;                                   ///< nothing more to hand out
  double first_tile_s_ = 0.0;
  RayCounts counts_;
};

}  // namespace lambent
