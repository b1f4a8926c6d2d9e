// `lambent render`.
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <mutex>
#include <optional>

#include "engine/base/memory.h"
#include "engine/cli/commands.h"
#include "engine/cli/progress_line.h"
#include "engine/description/scene_file.h"
#include "engine/film/picture_writer.h"
#include "engine/session/session.h"

namespace lambent {
namespace {

using description::SceneDescription;
using description::Settings;
using namespace std::chrono_literals;

constexpr int k_interrupted = 130;  // as shells report SIGINT
constexpr int64_t k_epoch = 1;

struct RenderOptions {
  std::string scene, output, integrator, camera, checkpoint, fallback_folder;
  std::optional<int64_t> samples;
  std::optional<double> time_limit_s;
  std::optional<uint32_t> seed;
  std::vector<int> region, resolution;
  int threads = 0;
  bool quiet = false, resume = false;
};

std::atomic<int64_t> interrupted_at_ms{0};  ///< 0: not yet

/// The first interrupt stops in order, a second quits at once, without a picture. One Ctrl-C may arrive twice (from the
/// terminal and from a parent such as timeout(1)), so what comes together counts as one.
void on_interrupt(int) {
  constexpr int64_t k_together_ms = 300;
  timespec time{};
  ::clock_gettime(CLOCK_MONOTONIC, &time);
  const int64_t now_ms = int64_t(time.tv_sec) * 1000 + time.tv_nsec / 1'000'000;
  int64_t first_ms = 0;
  if (!interrupted_at_ms.compare_exchange_strong(first_ms, now_ms) && now_ms - first_ms > k_together_ms)
    ::_exit(k_interrupted);
}

void say(const std::string& text) { std::fprintf(stderr, "lambent: %s\n", text.c_str()); }

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

/// The scene's settings with the options in their place; empty, with a message, if one makes no sense.
std::optional<Settings> settings_of(const SceneDescription& scene, const RenderOptions& options) {
  Settings settings = *scene.settings;
  if (options.samples) settings.samples = *options.samples;
  if (options.time_limit_s) settings.time_limit_s = *options.time_limit_s;
  if (options.seed) settings.seed = *options.seed;
  settings.threads = options.threads;
  if (!options.integrator.empty()) settings.integrator = options.integrator;
  const std::vector<std::string> integrators = available_integrators();
  if (std::find(integrators.begin(), integrators.end(), settings.integrator) == integrators.end()) {
    say(fmt::format("There is no integrator '{}', only {}", settings.integrator, fmt::join(integrators, " ")));
    return std::nullopt;
  }
  if (!options.camera.empty() && (settings.camera = find_camera(scene, options.camera)).empty()) return std::nullopt;
  if (!options.resolution.empty()) {
    settings.width = options.resolution[0];
    settings.height = options.resolution[1];
    settings.region.reset();  // it was in pixels of the other size
  }
  if (!options.region.empty()) {
    const std::vector<int>& r = options.region;
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

/// Edits that make `scene` with other settings.
description::Transaction edits_of(const SceneDescription& scene, Settings settings) {
  description::Transaction transaction;
  transaction.epoch = k_epoch;
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
  transaction.edits.emplace_back(description::Upsert{"render", std::move(settings)});
  return transaction;
}

void print_messages(const Report& report, bool quiet) {
  static constexpr const char* k_names[] = {"info", "warning", "error"};
  for (const Message& message : report.messages())
    if (!quiet || message.severity == Severity::error)
      std::fprintf(stderr, "lambent: %s: %s\n", k_names[size_t(message.severity)], message.text.c_str());
  if (const size_t dropped = report.dropped(); dropped && !quiet) say(fmt::format("and {} more messages", dropped));
}

/// What a render tells its waiting thread.
class Finish {
 public:
  void set(const RenderOutcome& outcome) {
    const std::lock_guard lock(mutex_);
    outcome_ = outcome;
    changed_.notify_all();
  }
  std::optional<RenderOutcome> wait_for(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, time, [&] { return outcome_.has_value(); });
    return outcome_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<RenderOutcome> outcome_;
};

PictureView view_of(const Picture& picture, const RenderOptions& options, const SceneDescription& scene,
                    const Settings& settings, const RenderOutcome& outcome) {
  PictureView view{picture.width, picture.height, picture.rendered, picture.channels, picture.pixels, picture.metadata};
  const auto camera = scene.cameras.find(settings.camera);
  const std::pair<const char*, std::string> entries[] = {
      {"Software", std::string("Lambent ") + LAMBENT_VERSION},
      {"lambent/samples", fmt::format("{}", outcome.samples)},
      {"lambent/seed", fmt::format("{}", settings.seed)},
      {"lambent/integrator", settings.integrator},
      {"lambent/scene_file", std::filesystem::absolute(options.scene).string()},
      {"lambent/camera", camera == scene.cameras.end() ? settings.camera : camera->second->name},
      {"lambent/frame", fmt::format("{}", settings.frame)},
      {"lambent/render_time_s", fmt::format("{:.3f}", outcome.statistics.render_s)},
      {"lambent/build_time_s", fmt::format("{:.3f}", outcome.statistics.build_s)},
      {"lambent/status", outcome.status == RenderStatus::finished ? "finished" : "cancelled"},
  };
  for (const auto& [name, text] : entries) view.metadata[name] = text;
  return view;
}

/// Writes the picture, elsewhere if need be. False if it is not at its place.
bool save(const PictureView& view, const RenderOptions& options) {
  const Status written = write_picture(options.output, view);
  if (written) return true;
  say(written.error());
  // The pixels may have taken hours: keep them where there is room.
  std::error_code error;
  std::filesystem::path folder = options.fallback_folder;
  if (folder.empty()) folder = std::filesystem::temp_directory_path(error);
  const std::filesystem::path name = std::filesystem::path(options.output).filename();
  const std::filesystem::path elsewhere =
      folder / fmt::format("{}-{}{}", name.stem().string(), ::getpid(), name.extension().string());
  const Status kept = write_picture(elsewhere, view);
  say(kept ? fmt::format("The picture was kept as '{}'.", elsewhere.string()) : kept.error());
  return false;
}

int render(const RenderOptions& options) {
  if (!is_picture_path(options.output)) {
    say(fmt::format("-o '{}': the name must end in .exr or .png", options.output));
    return 2;
  }
  if (options.resume && options.checkpoint.empty()) {
    say("--resume needs --checkpoint FILE");
    return 2;
  }
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  Report loading;
  const auto scene = description::load_scene_file(options.scene, loading);
  print_messages(loading, options.quiet);
  if (!scene) {
    say(scene.error());
    return 1;
  }
  const std::optional<Settings> settings = settings_of(*scene, options);
  if (!settings) return 2;

  Finish finish;
  SessionEvents events;
  ProgressLine line(stderr);
  Report report;  // of the conductor thread until `done`
  events.report = [&](int64_t, const Report& found) { report.append(found); };
  events.done = [&](const RenderOutcome& outcome) { finish.set(outcome); };
  EngineOptions engine_options;
  engine_options.threads = options.threads;
  Session session(Engine::create(engine_options), std::move(events));
  session.apply(edits_of(*scene, *settings));
  if (options.resume)
    if (Status loaded = session.load_checkpoint(options.checkpoint); !loaded) {
      say(loaded.error());
      return 1;
    }
  session.start(k_epoch);
  std::optional<RenderOutcome> outcome;
  bool told = false;
  while (!(outcome = finish.wait_for(100ms))) {
    if (interrupted_at_ms != 0 && !told) {
      session.cancel();
      told = true;
    }
    if (!options.quiet) line.show(session.progress());
  }
  line.clear();
  session.wait();
  print_messages(report, options.quiet);
  if (outcome->status == RenderStatus::failed) {
    say(outcome->message);
    return 1;
  }
  const bool interrupted = outcome->status == RenderStatus::cancelled;
  const Picture picture = session.picture();
  if (picture.pixels.empty()) {
    say("Interrupted before there was a picture; nothing was written.");
    return interrupted ? k_interrupted : 1;
  }
  bool good = save(view_of(picture, options, *scene, *settings, *outcome), options);
  if (!options.checkpoint.empty())
    if (Status saved = session.save_checkpoint(options.checkpoint); !saved) {
      say(saved.error());
      good = false;
    }
  const Statistics& statistics = outcome->statistics;
  if (good && !options.quiet)
    std::fprintf(stderr,
                 "Saved: '%s' (%lld samples, scene %.2f s, render %.2f s, %.2f million rays, peak memory %s)%s\n",
                 options.output.c_str(), static_cast<long long>(outcome->samples), statistics.build_s,
                 statistics.render_s, static_cast<double>(statistics.rays) * 1e-6,
                 memory_text(peak_resident_bytes()).c_str(), interrupted ? ", interrupted" : "");
  if (!good) return 1;
  return interrupted ? k_interrupted : 0;
}

}  // namespace

Command add_render_command(CLI::App& program) {
  const auto options = std::make_shared<RenderOptions>();
  CLI::App* app = program.add_subcommand("render", "Render a saved scene");
  app->add_option("scene", options->scene, "Saved scene (*.lambent)")->required();
  app->add_option("-o,--output", options->output, "Picture to write: .exr (all channels) or .png (sRGB)")->required();
  app->add_option("--samples", options->samples, "Samples per pixel; 0: unlimited")->check(CLI::NonNegativeNumber);
  app->add_option("--time-limit", options->time_limit_s, "Seconds; 0: none")->check(CLI::NonNegativeNumber);
  app->add_option("--threads", options->threads, "Render threads; 0: all cores")->check(CLI::Range(0, 4096));
  app->add_option("--integrator", options->integrator, "One of those that `lambent info` lists");
  app->add_option("--seed", options->seed, "Seed of the random numbers");
  app->add_option("--region", options->region, "x0 y0 x1 y1 in pixels, exclusive end, row 0 at the bottom")
      ->expected(4);
  app->add_option("--resolution", options->resolution, "Width and height in pixels")
      ->expected(2)
      ->check(CLI::Range(1, 65536));
  app->add_option("--camera", options->camera, "Name or id of the camera");
  app->add_option("--checkpoint", options->checkpoint, "Save the samples to this file at the end");
  app->add_flag("--resume", options->resume, "Continue from the checkpoint");
  app->add_option(
      "--fallback-dir", options->fallback_folder,
      "Where the picture goes if it cannot be written to its place; default: the system's temporary folder");
  app->add_flag("--quiet", options->quiet, "Print errors only");
  return {app, [options] { return render(*options); }};
}

}  // namespace lambent
