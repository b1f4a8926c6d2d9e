#include "engine/session/render.h"

#include <algorithm>

#include "engine/base/check.h"
#include "engine/film/adaptive.h"
#include "engine/session/pass_length.h"

namespace lambent {

Render::Render(WorkerPool& pool, std::shared_ptr<Film> film, std::unique_ptr<Integrator> integrator,
               const RenderGoal& goal, const CancelFlag& cancel, std::function<void()> tile_finished)
    : pool_(pool),
      film_(std::move(film)),
      integrator_(std::move(integrator)),
      goal_(goal),
      cancel_(cancel),
      tile_finished_(std::move(tile_finished)),
      tile_busy_(static_cast<size_t>(film_->tiles().count()), 0) {
  integrator_->prepare(*film_);
  target_ = before_pass_ = film_->min_sample_count();
  begin_next_pass();
}

double Render::elapsed_s() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

void Render::begin_next_pass() {
  if (is_adaptive_check(goal_.noise_threshold, target_) && film_->stop_converged(goal_.noise_threshold, target_) == 0)
    exhausted_ = true;
  const bool one_by_one = integrator_->stages(target_) > 0;
  const double now_s = elapsed_s();
  const double sample_s =
      target_ > before_pass_ ? (now_s - pass_start_s_) / static_cast<double>(target_ - before_pass_) : 0.0;
  const int64_t next = one_by_one && (goal_.samples == 0 || target_ < goal_.samples)
                           ? target_ + 1
                           : next_pass_target(target_, goal_.samples, sample_s);
  if (next <= target_ || tile_busy_.empty()) exhausted_ = true;
  if (exhausted_) return;
  before_pass_ = target_;
  pass_start_s_ = now_s;
  target_ = next;
  next_tile_ = 0;
  done_in_pass_ = 0;
  stage_ = next_stage_piece_ = 0;
  if (one_by_one) stage_pieces_ = integrator_->begin_stage(*film_, target_ - 1, stage_);
}

/// A piece of a stage; false if there is none to start, which is to wait for the others or to go on with the tiles.
bool Render::next_stage_piece(Piece& piece, bool& wait) {
  wait = false;
  while (stage_ < integrator_->stages(target_ - 1)) {
    if (next_stage_piece_ < stage_pieces_) {
      piece = {stage_, next_stage_piece_++, target_};
      ++busy_;
      return true;
    }
    wait = busy_ > 0;
    if (wait) return false;
    next_stage_piece_ = 0;
    if (++stage_ < integrator_->stages(target_ - 1))
      stage_pieces_ = integrator_->begin_stage(*film_, target_ - 1, stage_);
  }
  return false;
}

bool Render::next_piece(Piece& piece) {
  if (exhausted_ || stop_tiles_.cancelled()) return false;
  const int count = static_cast<int>(tile_busy_.size());
  const bool in_step = goal_.noise_threshold > 0.0f || integrator_->stages(target_ - 1) > 0;
  if (next_tile_ == count) {
    if (in_step && busy_ > 0) return false;  // what stops, and what passes leave to the next, is decided in between
    begin_next_pass();
    if (exhausted_) return false;
  }
  bool wait;
  if (next_stage_piece(piece, wait)) return true;
  if (wait) return false;
  if (goal_.noise_threshold > 0.0f)
    while (next_tile_ < count && !film_->tile_active(next_tile_)) ++next_tile_, ++done_in_pass_;
  if (next_tile_ == count) return next_piece(piece);
  if (tile_busy_[next_tile_]) return false;  // still in its previous pass
  piece = {-1, next_tile_++, target_};
  tile_busy_[piece.tile] = 1;
  ++busy_;
  return true;
}

bool Render::work(int) {
  Piece piece;
  {
    const std::lock_guard lock(mutex_);
    if (!next_piece(piece)) {
      if (busy_ == 0) finished_.notify_all();
      return false;
    }
  }
  const Interruptible interruptible(stop_tiles_);
  finish(piece, piece.stage < 0
                    ? integrator_->render_tile(*film_, piece.tile, piece.target, stop_tiles_)
                    : integrator_->run_piece(*film_, piece.target - 1, piece.stage, piece.tile, stop_tiles_));
  return true;
}

void Render::finish(const Piece& piece, const RayCounts& counts) {
  {
    const std::lock_guard lock(mutex_);
    counts_ += counts;
    --busy_;
    if (piece.stage < 0) {
      tile_busy_[piece.tile] = 0;
      if (piece.target == target_) ++done_in_pass_;
      if (first_tile_s_ == 0.0) first_tile_s_ = elapsed_s();
    }
    if (busy_ == 0 && (exhausted_ || stop_tiles_.cancelled())) finished_.notify_all();
  }
  pool_.wake();
  if (piece.stage < 0) tile_finished_();
}

void Render::wake() {
  if (cancel_.cancelled()) stop_tiles_.cancel();
  finished_.notify_all();
}

Render::End Render::run() {
  using namespace std::chrono_literals;
  {
    const std::lock_guard lock(mutex_);  // progress is asked for already
    start_ = Clock::now();
  }
  pool_.add(this);
  {
    std::unique_lock lock(mutex_);
    for (;;) {
      if (cancel_.cancelled() || (goal_.time_limit_s > 0.0 && elapsed_s() >= goal_.time_limit_s)) stop_tiles_.cancel();
      if (busy_ == 0 && (exhausted_ || stop_tiles_.cancelled())) break;
      finished_.wait_for(lock, 10ms);
    }
  }
  pool_.remove(this);
  return cancel_.cancelled() ? End::cancelled : End::finished;
}

int64_t Render::pass_target() const {
  const std::lock_guard lock(mutex_);
  return target_;
}

int64_t Render::tiles_done_in_pass() const {
  const std::lock_guard lock(mutex_);
  return done_in_pass_;
}

std::vector<Rectangle> Render::active_tiles() const {
  const std::lock_guard lock(mutex_);
  std::vector<Rectangle> tiles;
  for (size_t i = 0; i < tile_busy_.size(); ++i)
    if (tile_busy_[i]) tiles.push_back(film_->tiles()[static_cast<int>(i)]);
  return tiles;
}

RayCounts Render::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

double Render::first_tile_s() const {
  const std::lock_guard lock(mutex_);
  return first_tile_s_;
}

double Render::fraction_done() const {
  const std::lock_guard lock(mutex_);
  double fraction = -1.0;
  const double tiles = std::max<double>(1.0, static_cast<double>(tile_busy_.size()));
  if (goal_.samples > 0) {
    fraction =
        (static_cast<double>(before_pass_) + static_cast<double>(target_ - before_pass_) * done_in_pass_ / tiles) /
        static_cast<double>(goal_.samples);
  }
  if (goal_.time_limit_s > 0.0) fraction = std::max(fraction, elapsed_s() / goal_.time_limit_s);
  return std::min(fraction, 1.0);
}

}  // namespace lambent
