// The C++ API of the engine: edit, start, stop, progress, tiles. What the daemon and the command line stand on.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/report.h"
#include "engine/base/result.h"
#include "engine/description/description.h"
#include "engine/film/rectangle.h"

namespace lambent {

class Engine;
class ContributionObserver;

/// The newest pixels of one tile, normalised by their sample counts.
struct TileSnapshot {
  int64_t epoch = 0;
  Rectangle rectangle;
  int64_t samples = 0;
  bool final = false;  ///< no newer pixels will come for this render
  std::vector<Channel> channels;
  std::vector<float> pixels;  ///< float[height][width][sum of components], row 0 at the bottom
};

enum class Stage : uint8_t { idle, updating, building, rendering };

struct Progress {
  int64_t epoch = 0;
  Stage stage = Stage::idle;
  int64_t samples = 0, samples_total = 0;  ///< samples that every pixel has; 0 total: unlimited
  int64_t tiles = 0, tiles_total = 0;      ///< of the current pass
  double elapsed_s = 0.0;
  std::optional<double> remaining_s;
  std::vector<Rectangle> active_tiles;
};

struct MemoryUse {
  size_t geometry = 0, bvh = 0, textures = 0, film = 0, lights = 0, shading = 0;
};

struct Statistics {
  double update_s = 0, build_s = 0, render_s = 0, first_tile_s = 0;
  uint64_t rays = 0, paths = 0, non_finite = 0;
  uint64_t triangles = 0, unique_triangles = 0, instances = 0, emitters = 0;
  std::string profile;
  std::vector<std::string> modelled, not_modelled;
  MemoryUse memory;
};

enum class RenderStatus : uint8_t { finished, cancelled, failed };

struct RenderOutcome {
  int64_t epoch = 0;
  RenderStatus status = RenderStatus::finished;
  int64_t samples = 0;
  std::string message;
  Statistics statistics;
};

/// Called from engine threads, never concurrently for one session, never with a lock held that Session's methods take.
struct SessionEvents {
  std::function<void(int64_t epoch, const Report&)> report;  ///< what building the scene found
  std::function<void()> tiles_ready;                         ///< take_tiles() has something; at most once until taken
  std::function<void(int64_t epoch)> stopped;                ///< nothing is rendered any more; only final tiles follow
  std::function<void(const RenderOutcome&)> done;            ///< after the last final tile became available
};

/// A full-frame image: float[height][width][components], row 0 at the bottom.
struct Picture {
  int width = 0, height = 0;
  Rectangle rendered;  ///< what of it was rendered; the rest is 0
  std::vector<Channel> channels;
  std::vector<float> pixels;
  std::map<std::string, std::string> metadata;
};

/// One client's scene and its render. Methods are called from one thread at a time; rendering happens in the engine's
/// threads.
class Session {
 public:
  Session(std::shared_ptr<Engine> engine, SessionEvents events);
  ~Session();  ///< cancels and waits
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Applies edits to the description (cheap: values are shared). A running render keeps its own snapshot.
  void apply(description::Transaction transaction);
  const description::SceneDescription& scene() const;

  /// Shows every contribution of the bidirectional integrators' next renders to `observer` (path/contribution.h), for
  /// debugging light transport; null: nobody looks, which costs nothing.
  void observe(std::shared_ptr<ContributionObserver> observer);

  /// Builds what changed and renders, in the background; supersedes a running render (which ends as cancelled).
  /// @param repeat_tiles final tiles are all that hold anything; else only those that take_tiles() has not given with
  ///   all their channels and the same pixels before
  void start(int64_t epoch, bool repeat_tiles = true);
  /// Stops within 100 ms at any stage (`stopped` is called); the tiles so far become final, then `done` is called.
  /// Returns at once.
  void cancel();
  /// Blocks until no render is running.
  void wait();

  Progress progress() const;
  /// Dirty tiles, oldest first, at most `limit`, and fewer where they are large, so that it takes a few ms; each tile's
  /// newest pixels only.
  /// @param channels names of what tiles that are not final hold; empty: everything, as final ones do
  std::vector<TileSnapshot> take_tiles(size_t limit, const std::vector<std::string>& channels = {});
  /// Whether take_tiles() has more, or will have without anything being rendered: workers read final tiles ahead, and
  /// `tiles_ready` is called when one is there.
  bool tiles_left() const;
  /// The whole picture so far (as of the newest finished tiles).
  Picture picture() const;
  /// Saves / restores the accumulated samples of the current render, so that it continues bit-identically.
  Status save_checkpoint(const std::string& path) const;
  /// To be called before start(); the render continues from the checkpoint if it belongs to the same settings.
  Status load_checkpoint(const std::string& path);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

struct EngineOptions {
  int threads = 0;                 ///< 0: all cores
  size_t texture_cache_bytes = 0;  ///< for one session's textures; 0: a quarter of this machine's memory
};

/// Shared by all sessions of a process: worker threads, which serve running sessions' tiles in turn, and options.
class Engine {
 public:
  static std::shared_ptr<Engine> create(const EngineOptions& options);
  virtual ~Engine() = default;
  virtual int thread_count() const = 0;
};

/// Names that `settings.integrator` may have.
std::vector<std::string> available_integrators();
/// Kinds of passes that `settings.passes` may ask for; the combined one is always there.
std::vector<std::string> available_passes();
/// Node types that materials may use; others get a stand-in and a message. Defined by shading/.
std::vector<std::string> supported_node_types();

}  // namespace lambent
