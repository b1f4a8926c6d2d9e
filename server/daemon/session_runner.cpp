// The I/O thread's side: cancelling, streaming, progress. The worker's side is session_worker.cpp.
#include "server/daemon/session_runner.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/base/log.h"
#include "server/daemon/session_messages.h"

namespace lambent {
namespace {

/// Tiles are taken from the session only while less than this waits in the connection, so that what a slow client gets
/// is new.
constexpr uint64_t k_tile_room_bytes = uint64_t(4) << 20;
constexpr int64_t k_tiles_at_once = 8;
constexpr std::chrono::milliseconds k_progress_interval{100};
/// How long the end of a render waits for a client without credit to grant more for its final tiles.
constexpr std::chrono::seconds k_credit_patience{10};

}  // namespace

SessionRunner::SessionRunner(EventLoop& loop, std::shared_ptr<Engine> engine, protocol::Limits limits, std::string name,
                             std::weak_ptr<RunnerOutput> output, std::function<void()> finished)
    : loop_(loop),
      engine_(std::move(engine)),
      limits_(limits),
      name_(std::move(name)),
      output_(std::move(output)),
      finished_(std::move(finished)) {}

SessionRunner::~SessionRunner() { join(); }

std::shared_ptr<SessionRunner> SessionRunner::start(EventLoop& loop, std::shared_ptr<Engine> engine,
                                                    protocol::Limits limits, std::string name,
                                                    std::weak_ptr<RunnerOutput> output,
                                                    std::function<void()> finished) {
  const std::shared_ptr<SessionRunner> runner(
      new SessionRunner(loop, std::move(engine), limits, std::move(name), std::move(output), std::move(finished)));
  runner->worker_ = std::thread([runner = runner.get()] { runner->run(); });
  return runner;
}

void SessionRunner::join() {
  if (worker_.joinable()) worker_.join();
}

void SessionRunner::enqueue(Work work) {
  const std::lock_guard lock(queue_mutex_);
  queue_.push_back(std::move(work));
  queue_changed_.notify_one();
}

size_t SessionRunner::queued() const {
  const std::lock_guard lock(queue_mutex_);
  return queue_.size();
}

void SessionRunner::start_render(const protocol::RenderStart& start) {
  const int64_t epoch = start.epoch;
  if (epoch <= newest_start_) {
    if (const auto output = output_.lock())
      output->send(message_of(protocol::error(
          "epoch",
          fmt::format("The render of epoch {} was not started: epochs increase, and {} was started before.", epoch,
                      newest_start_),
          false, epoch)));
    return;
  }
  newest_start_ = epoch;
  queued_starts_.insert(epoch);
  enqueue({protocol::ClientMessage(start), nullptr, nullptr, {}});
}

void SessionRunner::cancel(int64_t epoch) {
  int64_t started = -1;
  {
    const std::lock_guard lock(epochs_mutex_);
    cancelled_through_ = std::max(cancelled_through_, epoch);
    started = started_epoch_;
    if (started <= epoch) cancel_wanted_ = true;
  }
  // Those that wait behind other work are answered now; the worker will skip them.
  while (!queued_starts_.empty() && *queued_starts_.begin() <= epoch) {
    const int64_t queued = *queued_starts_.begin();
    queued_starts_.erase(queued_starts_.begin());
    if (queued > started) answer_cancelled(queued);
  }
  service();
}

void SessionRunner::answer_cancelled(int64_t epoch) {
  RenderOutcome outcome;
  outcome.epoch = epoch;
  outcome.status = RenderStatus::cancelled;
  outcome.message = "Cancelled before it began.";
  if (const auto output = output_.lock()) output->send(render_done_message(outcome));
}

void SessionRunner::add_outcome(RenderOutcome outcome) {
  outcomes_.push_back(std::move(outcome));
  credit_waited_since_ = Clock::now();
  service();
}

void SessionRunner::add_credit(int64_t tiles) {
  credits_ = std::min(limits_.tile_credits, credits_ + std::min(tiles, limits_.tile_credits));
  credit_waited_since_ = Clock::now();
  service();
}

void SessionRunner::service() {
  if (retired_) return;
  bool drained = false;
  {
    const std::unique_lock gate(gate_, std::try_to_lock);
    if (!gate || !session_) return;  // the worker posts service() when it leaves the gate
    bool cancel_now = false;
    {
      const std::lock_guard lock(epochs_mutex_);
      cancel_now = std::exchange(cancel_wanted_, false) && started_epoch_ >= 0 && started_epoch_ <= cancelled_through_;
    }
    if (cancel_now) session_->cancel();
    send_stopped();
    drained = send_tiles();
  }
  send_outcomes(drained);
  schedule_progress();
}

/// Tells what the client waits for who cancelled. Before the first final tile, of which there may be many.
void SessionRunner::send_stopped() {
  {
    const std::lock_guard lock(epochs_mutex_);
    if (stopped_epoch_ <= told_stopped_) return;
    told_stopped_ = stopped_epoch_;
  }
  if (const auto output = output_.lock()) output->send(message_of(protocol::render_stopped(told_stopped_)));
}

/// Inside the gate. Sends tiles as far as credit and room allow, but only some at once, so that a cancel is heard soon;
/// true if the session has no more. A cancelled render has none until it has stopped: they will all be sent as final
/// ones.
bool SessionRunner::send_tiles() {
  const auto output = output_.lock();
  if (!output) return false;
  int64_t epoch = -1;
  std::vector<std::string> stream;
  {
    const std::lock_guard lock(epochs_mutex_);
    epoch = started_epoch_;
    stream = stream_;
    if (epoch <= cancelled_through_ && stopped_epoch_ < epoch) return false;
  }
  for (int64_t taken = 0;;) {
    while (!held_tiles_.empty() && (credits_ > 0 || held_tiles_.front().epoch < epoch)) {
      TileSnapshot tile = std::move(held_tiles_.front());
      held_tiles_.pop_front();
      if (tile.epoch < epoch) continue;  // of a render that was superseded
      --credits_;
      if (tile.final) send_stopped();
      output->send(tile_message(std::move(tile)));
    }
    if (!held_tiles_.empty() || output->pending_bytes() >= k_tile_room_bytes) return false;
    // Without credit one tile is taken only to learn whether the end of the render may be told.
    if (credits_ == 0 && outcomes_.empty()) return false;
    if (taken >= k_tiles_at_once) {
      to_service();
      return false;
    }
    const size_t limit = static_cast<size_t>(std::clamp<int64_t>(credits_, 1, k_tiles_at_once));
    std::vector<TileSnapshot> tiles = session_->take_tiles(limit, stream);
    if (tiles.empty()) return !session_->tiles_left();
    taken += static_cast<int64_t>(tiles.size());
    std::move(tiles.begin(), tiles.end(), std::back_inserter(held_tiles_));
  }
}

/// `render_done` follows the last final tile; that of a superseded render has none to wait for. A client that grants no
/// credit is told nevertheless after a while; its tiles stay in the session, which keeps the film until its next
/// render.
void SessionRunner::send_outcomes(bool drained) {
  const bool given_up = credits_ == 0 && Clock::now() - credit_waited_since_ >= k_credit_patience;
  std::vector<RenderOutcome> ready;
  int64_t started = -1;
  {
    const std::lock_guard lock(epochs_mutex_);
    started = started_epoch_;
    for (size_t i = 0; i < outcomes_.size();) {
      RenderOutcome& outcome = outcomes_[i];
      if (outcome.epoch >= started && !drained && !given_up) {
        ++i;
        continue;
      }
      finished_epoch_ = std::max(finished_epoch_, outcome.epoch);
      ready.push_back(std::move(outcome));
      outcomes_.erase(outcomes_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  const auto output = output_.lock();
  for (const RenderOutcome& outcome : ready) {
    static constexpr const char* k_names[] = {"finished", "was cancelled", "failed"};
    const Statistics& s = outcome.statistics;
    spdlog::info(
        "{}: render {} {}: {} samples, {} triangles, {} emitters; update {:.3f} s, build {:.3f} s, render {:.3f} s, "
        "first tile {:.3f} s, {} rays{}{}",
        name_, outcome.epoch, k_names[size_t(outcome.status)], outcome.samples, s.triangles, s.emitters, s.update_s,
        s.build_s, s.render_s, s.first_tile_s, s.rays, outcome.message.empty() ? "" : "; ", outcome.message);
    if (output) output->send(render_done_message(outcome, outcome.epoch >= started && !drained));
  }
}

void SessionRunner::schedule_progress() {
  if (progress_scheduled_ || retired_) return;
  progress_scheduled_ = true;
  loop_.after(k_progress_interval, [weak = weak_from_this()] {
    const auto self = weak.lock();
    if (!self || self->retired_) return;
    self->progress_scheduled_ = false;
    self->send_progress();
  });
}

void SessionRunner::send_progress() {
  const auto output = output_.lock();
  if (!output) return;
  bool rendering = false;
  {
    const std::lock_guard lock(epochs_mutex_);
    rendering = started_epoch_ > finished_epoch_;
  }
  if (!rendering) return;  // service() schedules it again when something happens
  if (!outcomes_.empty()) {
    service();  // nothing else may happen: a client without credit is told of the end after a while
    return;
  }
  Progress progress;
  {
    const std::unique_lock gate(gate_, std::try_to_lock);
    if (!gate || !session_) {
      schedule_progress();
      return;
    }
    progress = session_->progress();
  }
  if (progress.stage != Stage::idle && output->pending_bytes() < k_tile_room_bytes)
    output->send(progress_message(progress));
  schedule_progress();
}

void SessionRunner::retire() {
  if (retired_.exchange(true)) return;
  {
    const std::unique_lock gate(gate_, std::try_to_lock);
    if (gate && session_) session_->cancel();  // otherwise the worker does it when it leaves the gate
  }
  const std::lock_guard lock(queue_mutex_);
  queue_.clear();
  queue_changed_.notify_one();
}

}  // namespace lambent
