// A stand-in for engine/session, linked in its place: renders known pixels in known time, so that the daemon's
// behaviour can be tested without the engine. What it does is said by the scene's settings.metadata:
//   build_ms, tile_ms   time of building and of each tile (polled for cancelling every millisecond)
//   stop_ms             time from a cancel while tiles are rendered to the end
//   stubborn_ms         time at the start of building that does not notice a cancel
//   fail                the render fails with this message
//   report              the build reports this warning about an object 'Cube'
//   throw               start() throws
#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>

#include "engine/session/session.h"
#include "tests/protocol/stand_in_pixels.h"

namespace lambent {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

class StandInEngine : public Engine {
 public:
  int thread_count() const override { return 1; }
};

}  // namespace

/// What a render does, taken from the scene when it starts.
struct Plan {
  int64_t epoch = 0, samples = 0;
  int build_ms = 0, stop_ms = 0, stubborn_ms = 0, tile_ms = 0;
  std::string fail, report;
};

struct Session::State {
  SessionEvents events;
  description::SceneDescription scene;
  std::thread thread;
  std::atomic<bool> cancelled{false};

  mutable std::mutex mutex;
  Progress progress;
  bool running = false, complete = false;
  int width = 0, height = 0, side = 64;
  std::vector<int64_t> tile_samples;
  std::set<int> dirty;

  int columns() const { return (width + side - 1) / side; }
  Rectangle rectangle(int tile) const {
    const int x = tile % columns() * side, y = tile / columns() * side;
    return {x, y, std::min(side, width - x), std::min(side, height - y)};
  }

  int milliseconds(const char* name) const {
    const auto found = scene.settings->metadata.find(name);
    return found == scene.settings->metadata.end() ? 0 : std::atoi(found->second.c_str());
  }
  std::string text(const char* name) const {
    const auto found = scene.settings->metadata.find(name);
    return found == scene.settings->metadata.end() ? "" : found->second;
  }

  /// False if cancelled.
  bool pass_time(int ms) const {
    const auto end = Clock::now() + std::chrono::milliseconds(ms);
    while (Clock::now() < end && !cancelled) std::this_thread::sleep_for(1ms);
    return !cancelled;
  }

  void set_stage(Stage stage) {
    const std::lock_guard lock(mutex);
    progress.stage = stage;
  }

  void stop() {
    cancelled = true;
    if (thread.joinable()) thread.join();
    cancelled = false;
  }

  RenderStatus render(const Plan& plan) {
    std::this_thread::sleep_for(std::chrono::milliseconds(plan.stubborn_ms));
    if (!pass_time(plan.build_ms)) return RenderStatus::cancelled;
    Report report;
    if (!plan.report.empty()) report.warning("missing_texture", "Cube", plan.report);
    if (events.report) events.report(plan.epoch, report);
    set_stage(Stage::rendering);
    for (int64_t sample = 1; plan.samples == 0 || sample <= plan.samples; ++sample) {
      for (int tile = 0; tile < static_cast<int>(tile_samples.size()); ++tile) {
        if (!pass_time(plan.tile_ms)) {
          std::this_thread::sleep_for(std::chrono::milliseconds(plan.stop_ms));
          return RenderStatus::cancelled;
        }
        bool tell = false;
        {
          const std::lock_guard lock(mutex);
          tile_samples[tile] = sample;
          progress.tiles = tile + 1;
          tell = dirty.empty();
          dirty.insert(tile);
        }
        if (tell && events.tiles_ready) events.tiles_ready();
      }
      const std::lock_guard lock(mutex);
      progress.samples = sample;
    }
    return RenderStatus::finished;
  }

  void conduct(const Plan& plan) {
    RenderOutcome outcome;
    outcome.epoch = plan.epoch;
    outcome.message = plan.fail;
    outcome.status = render(plan);
    if (events.stopped) events.stopped(plan.epoch);
    if (!outcome.message.empty()) outcome.status = RenderStatus::failed;
    {
      const std::lock_guard lock(mutex);
      progress.stage = Stage::idle;
      complete = true;
      outcome.samples = progress.samples;
      for (int tile = 0; tile < static_cast<int>(tile_samples.size()); ++tile)
        if (tile_samples[tile] > 0) dirty.insert(tile);
    }
    if (events.tiles_ready) events.tiles_ready();
    if (events.done) events.done(outcome);
  }
};

Session::Session(std::shared_ptr<Engine>, SessionEvents events) : state_(std::make_unique<State>()) {
  state_->events = std::move(events);
}
Session::~Session() { state_->stop(); }

void Session::apply(description::Transaction transaction) { description::apply(std::move(transaction), state_->scene); }
const description::SceneDescription& Session::scene() const { return state_->scene; }

void Session::start(int64_t epoch, bool) {
  state_->stop();
  if (!state_->text("throw").empty()) throw std::runtime_error(state_->text("throw"));
  const description::Settings& settings = *state_->scene.settings;
  {
    const std::lock_guard lock(state_->mutex);
    state_->width = settings.width;
    state_->height = settings.height;
    state_->side = settings.tile_size_px;
    const int rows = (settings.height + state_->side - 1) / state_->side;
    state_->tile_samples.assign(static_cast<size_t>(state_->columns()) * rows, 0);
    state_->dirty.clear();
    state_->complete = false;
    state_->progress = {};
    state_->progress.epoch = epoch;
    state_->progress.stage = Stage::building;
    state_->progress.samples_total = settings.samples;
    state_->progress.tiles_total = static_cast<int64_t>(state_->tile_samples.size());
  }
  const Plan plan{epoch,
                  settings.samples,
                  state_->milliseconds("build_ms"),
                  state_->milliseconds("stop_ms"),
                  state_->milliseconds("stubborn_ms"),
                  state_->milliseconds("tile_ms"),
                  state_->text("fail"),
                  state_->text("report")};
  state_->thread = std::thread([state = state_.get(), plan] { state->conduct(plan); });
}

void Session::cancel() { state_->cancelled = true; }
void Session::wait() {
  if (state_->thread.joinable()) state_->thread.join();
}

Progress Session::progress() const {
  const std::lock_guard lock(state_->mutex);
  return state_->progress;
}

std::vector<TileSnapshot> Session::take_tiles(size_t limit, const std::vector<std::string>&) {
  std::vector<TileSnapshot> tiles;
  const std::lock_guard lock(state_->mutex);
  while (tiles.size() < limit && !state_->dirty.empty()) {
    const int index = *state_->dirty.begin();
    state_->dirty.erase(state_->dirty.begin());
    TileSnapshot tile;
    tile.epoch = state_->progress.epoch;
    tile.rectangle = state_->rectangle(index);
    tile.samples = state_->tile_samples[index];
    tile.final = state_->complete;
    tile.channels = {{"combined", 4}};
    for (int y = 0; y < tile.rectangle.height; ++y)
      for (int x = 0; x < tile.rectangle.width; ++x)
        for (int c = 0; c < 4; ++c)
          tile.pixels.push_back(stand_in_pixel(tile.rectangle.x + x, tile.rectangle.y + y, c));
    tiles.push_back(std::move(tile));
  }
  return tiles;
}

bool Session::tiles_left() const {
  const std::lock_guard lock(state_->mutex);
  return state_->complete && !state_->dirty.empty();
}

Picture Session::picture() const { return {}; }
Status Session::save_checkpoint(const std::string&) const { return Error{"The stand-in has no checkpoints."}; }
Status Session::load_checkpoint(const std::string&) { return Ok{}; }

std::shared_ptr<Engine> Engine::create(const EngineOptions&) { return std::make_shared<StandInEngine>(); }
std::vector<std::string> available_integrators() { return {"PT"}; }
std::vector<std::string> available_passes() { return {"combined"}; }
std::vector<std::string> supported_node_types() { return {"BsdfDiffuse", "Emission"}; }

}  // namespace lambent
