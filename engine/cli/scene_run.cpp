#include "engine/cli/scene_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>

#include "engine/cli/interruption.h"

namespace lambent {
namespace {

using description::SceneDescription;
using description::Settings;
using namespace std::chrono_literals;

/// The id of the camera with that id or name; empty, with a message, if there is none.
std::string find_camera(const SceneDescription& scene, const std::string& wanted) {
  if (scene.cameras.contains(wanted)) return wanted;
  std::string known;
  for (const auto& [id, camera] : scene.cameras) {
    if (camera->name == wanted) return id;
    known += fmt::format(" '{}'", camera->name.empty() ? id : camera->name);
  }
  say(fmt::format("--camera '{}': the scene has no such camera{}", wanted, known.empty() ? "" : ", only" + known));
  return {};
}

/// Edits that make all of `scene` but its settings.
description::Transaction edits_of(const SceneDescription& scene) {
  description::Transaction transaction;
  const auto add = [&](const auto& table) {
    for (const auto& [id, value] : table) transaction.edits.emplace_back(description::Upsert{id, *value});
  };
  add(scene.meshes);
  add(scene.images);
  add(scene.materials);
  add(scene.lights);
  add(scene.objects);
  add(scene.cameras);
  add(scene.worlds);
  return transaction;
}

EngineOptions engine_options(int threads) {
  EngineOptions options;
  options.threads = threads;
  return options;
}

}  // namespace

void add_scene_options(CLI::App& app, SceneChoices& choices) {
  app.add_option("scene", choices.scene, "Saved scene (*.lambent)")->required();
  app.add_option("--threads", choices.threads, "Render threads; 0: all cores")->check(CLI::Range(0, 4096));
  app.add_option("--seed", choices.seed, "Seed of the random numbers");
  app.add_option("--region", choices.region, "x0 y0 x1 y1 in pixels, exclusive end, row 0 at the bottom")->expected(4);
  app.add_option("--resolution", choices.resolution, "Width and height in pixels")
      ->expected(2)
      ->check(CLI::Range(1, 65536));
  app.add_option("--camera", choices.camera, "Name or id of the camera");
}

bool known_integrator(const std::string& name) {
  const std::vector<std::string> integrators = available_integrators();
  if (std::find(integrators.begin(), integrators.end(), name) != integrators.end()) return true;
  say(fmt::format("There is no integrator '{}', only {}", name, fmt::join(integrators, " ")));
  return false;
}

std::optional<Settings> settings_of(const SceneDescription& scene, const SceneChoices& choices) {
  Settings settings = *scene.settings;
  if (choices.samples) settings.samples = *choices.samples;
  if (choices.time_limit_s) settings.time_limit_s = *choices.time_limit_s;
  if (choices.seed) settings.seed = *choices.seed;
  settings.threads = choices.threads;
  if (!choices.integrator.empty()) settings.integrator = choices.integrator;
  if (!known_integrator(settings.integrator)) return std::nullopt;
  if (!choices.camera.empty() && (settings.camera = find_camera(scene, choices.camera)).empty()) return std::nullopt;
  if (!choices.resolution.empty()) {
    settings.width = choices.resolution[0];
    settings.height = choices.resolution[1];
    settings.region.reset();  // it was in pixels of the other size
  }
  if (!choices.region.empty()) {
    const std::vector<int>& r = choices.region;
    if (r[0] < 0 || r[1] < 0 || r[0] >= r[2] || r[1] >= r[3] || r[2] > settings.width || r[3] > settings.height) {
      say(fmt::format(
          "--region {} {} {} {}: it must be x0 y0 x1 y1 with x0 < x1 <= {} and y0 < y1 <= {}, row 0 at the bottom",
          r[0], r[1], r[2], r[3], settings.width, settings.height));
      return std::nullopt;
    }
    settings.region = {r[0], r[1], r[2], r[3]};
  }
  return settings;
}

SceneRun::SceneRun(const SceneDescription& scene, int threads)
    : session_(Engine::create(engine_options(threads)), [this] {
        SessionEvents events;
        events.report = [this](int64_t, const Report& found) { report_.append(found); };
        events.done = [this](const RenderOutcome& outcome) { set(outcome); };
        return events;
      }()) {
  session_.apply(edits_of(scene));
}

RenderOutcome SceneRun::render(Settings settings, const std::function<void()>& poll) {
  description::Transaction transaction;
  transaction.epoch = ++epoch_;
  transaction.edits.emplace_back(description::Upsert{"render", std::move(settings)});
  session_.apply(std::move(transaction));
  outcome_.reset();
  session_.start(epoch_);
  bool told = false;
  std::optional<RenderOutcome> outcome;
  while (!(outcome = wait_shortly())) {
    if (interrupted() && !told) {
      session_.cancel();
      told = true;
    }
    poll();
  }
  session_.wait();
  return *outcome;
}

void SceneRun::set(const RenderOutcome& outcome) {
  const std::lock_guard lock(mutex_);
  outcome_ = outcome;
  changed_.notify_all();
}

std::optional<RenderOutcome> SceneRun::wait_shortly() {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, 100ms, [&] { return outcome_.has_value(); });
  return outcome_;
}

}  // namespace lambent
