// `lambent render`.
#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <optional>

#include "engine/base/memory.h"
#include "engine/cli/commands.h"
#include "engine/cli/interruption.h"
#include "engine/cli/progress_line.h"
#include "engine/cli/scene_run.h"
#include "engine/cli/technique_pictures.h"
#include "engine/description/scene_file.h"
#include "engine/film/picture_writer.h"

namespace lambent {
namespace {

using description::SceneDescription;
using description::Settings;

struct RenderOptions {
  SceneChoices choices;
  std::string output, checkpoint, fallback_folder, techniques;
  bool quiet = false, resume = false, half = false;
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
      {"lambent/scene_file", std::filesystem::absolute(options.choices.scene).string()},
      {"lambent/camera", camera == scene.cameras.end() ? settings.camera : camera->second->name},
      {"lambent/frame", fmt::format("{}", settings.frame)},
      {"lambent/render_time_s", fmt::format("{:.3f}", outcome.statistics.render_s)},
      {"lambent/build_time_s", fmt::format("{:.3f}", outcome.statistics.build_s)},
      {"lambent/status", outcome.status == RenderStatus::finished ? "finished" : "cancelled"},
  };
  for (const auto& [name, text] : entries) view.metadata[name] = text;
  view.half_colors = options.half;
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
  catch_interrupts();
  Report loading;
  const auto scene = description::load_scene_file(options.choices.scene, loading);
  print_messages(loading, options.quiet);
  if (!scene) {
    say(scene.error());
    return 1;
  }
  const std::optional<Settings> settings = settings_of(*scene, options.choices);
  if (!settings) return 2;

  SceneRun run(*scene, options.choices.threads);
  if (options.resume)
    if (Status loaded = run.session().load_checkpoint(options.checkpoint); !loaded) {
      say(loaded.error());
      return 1;
    }
  std::shared_ptr<TechniquePictures> techniques;
  if (!options.techniques.empty()) {
    if (settings->integrator == "PT") {
      say("--techniques: PT does not tell its techniques apart; choose an integrator of the bidirectional family");
      return 2;
    }
    techniques = std::make_shared<TechniquePictures>(settings->width, settings->height);
    run.session().observe(techniques);
  }
  ProgressLine line(stderr);
  const RenderOutcome outcome = run.render(*settings, [&] {
    if (!options.quiet) line.show(run.session().progress());
  });
  line.clear();
  print_messages(run.report(), options.quiet);
  if (outcome.status == RenderStatus::failed) {
    say(outcome.message);
    return 1;
  }
  const bool cancelled = outcome.status == RenderStatus::cancelled;
  const Picture picture = run.session().picture();
  if (picture.pixels.empty()) {
    say("Interrupted before there was a picture; nothing was written.");
    return cancelled ? k_interrupted : 1;
  }
  bool good = save(view_of(picture, options, *scene, *settings, outcome), options);
  if (techniques)
    if (Status written = techniques->write(options.techniques, outcome.samples, settings->exposure); !written) {
      say(written.error());
      good = false;
    }
  if (!options.checkpoint.empty())
    if (Status saved = run.session().save_checkpoint(options.checkpoint); !saved) {
      say(saved.error());
      good = false;
    }
  const Statistics& statistics = outcome.statistics;
  if (good && !options.quiet)
    std::fprintf(stderr,
                 "Saved: '%s' (%lld samples, scene %.2f s, render %.2f s, %.2f million rays, peak memory %s)%s\n",
                 options.output.c_str(), static_cast<long long>(outcome.samples), statistics.build_s,
                 statistics.render_s, static_cast<double>(statistics.rays) * 1e-6,
                 memory_text(peak_resident_bytes()).c_str(), cancelled ? ", interrupted" : "");
  if (!good) return 1;
  return cancelled ? k_interrupted : 0;
}

}  // namespace

Command add_render_command(CLI::App& program) {
  const auto options = std::make_shared<RenderOptions>();
  CLI::App* app = program.add_subcommand("render", "Render a saved scene");
  SceneChoices& choices = options->choices;
  add_scene_options(*app, choices);
  app->add_option("-o,--output", options->output, "Picture to write: .exr (all channels) or .png (sRGB)")->required();
  app->add_option("--samples", choices.samples, "Samples per pixel; 0: unlimited")->check(CLI::NonNegativeNumber);
  app->add_option("--time-limit", choices.time_limit_s, "Seconds; 0: none")->check(CLI::NonNegativeNumber);
  app->add_option("--integrator", choices.integrator, "One of those that `lambent info` lists");
  app->add_option("--checkpoint", options->checkpoint, "Save the samples to this file at the end");
  app->add_flag("--resume", options->resume, "Continue from the checkpoint");
  app->add_option(
      "--fallback-dir", options->fallback_folder,
      "Where the picture goes if it cannot be written to its place; default: the system's temporary folder");
  app->add_option("--techniques", options->techniques,
                  "Folder for pictures of what each technique contributes: by path length and numbers of vertices "
                  "(s, t), weighted and not, as PNG contact sheets and EXR, and the shares of merging and connection");
  app->add_flag("--half", options->half,
                "Colours of the .exr in 16 bits; depth, positions, vectors and ids stay in 32, as in Blender's files");
  app->add_flag("--quiet", options->quiet, "Print errors only");
  return {app, [options] { return render(*options); }};
}

}  // namespace lambent
