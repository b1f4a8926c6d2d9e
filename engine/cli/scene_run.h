// A saved scene rendered through a Session, with the options that commands share.
#pragma once

#include <CLI/CLI.hpp>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "engine/description/description.h"
#include "engine/session/session.h"

namespace lambent {

/// What the user chose in place of a saved scene's own settings.
struct SceneChoices {
  std::string scene;  ///< file
  std::string integrator, camera;
  std::optional<int64_t> samples;
  std::optional<double> time_limit_s;
  std::optional<uint32_t> seed;
  std::vector<int> region, resolution;
  int threads = 0;
};

/// Adds the positional `scene` and --threads, --seed, --region, --resolution and --camera.
void add_scene_options(CLI::App& app, SceneChoices& choices);

/// Whether this program has the integrator; says so if not.
bool known_integrator(const std::string& name);

/// The scene's settings with the choices in their place; empty, with a message, if one makes no sense.
std::optional<description::Settings> settings_of(const description::SceneDescription& scene,
                                                 const SceneChoices& choices);

/// A session of one scene, rendered any number of times with different settings; the scene is built once.
class SceneRun {
 public:
  /// `threads`: 0 for all cores.
  SceneRun(const description::SceneDescription& scene, int threads);

  Session& session() { return session_; }
  /// What building the scene found, so far.
  const Report& report() const { return report_; }

  /// Renders, blocking until the render ended. `poll` is called about ten times a second from this thread meanwhile.
  /// The first interrupt (`interruption.h`) cancels the render.
  RenderOutcome render(description::Settings settings, const std::function<void()>& poll);

 private:
  void set(const RenderOutcome& outcome);
  std::optional<RenderOutcome> wait_shortly();

  Report report_;  ///< of the session's thread until a render's end
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<RenderOutcome> outcome_;
  int64_t epoch_ = 0;
  Session session_;
};

}  // namespace lambent
