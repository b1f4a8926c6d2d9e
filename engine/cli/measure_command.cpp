// `lambent measure`.
#include <fmt/format.h>

#include <ctime>
#include <filesystem>
#include <set>

#include "engine/base/atomic_file.h"
#include "engine/cli/commands.h"
#include "engine/cli/curve_plot.h"
#include "engine/cli/error_curves.h"
#include "engine/cli/image_comparison.h"
#include "engine/cli/interruption.h"
#include "engine/cli/scene_run.h"
#include "engine/description/scene_file.h"
#include "engine/film/picture_writer.h"

namespace lambent {
namespace {

using description::Settings;

struct MeasureOptions {
  SceneChoices choices;
  std::string output, reference, baseline = "PT", clock = "cpu";
  std::vector<std::string> integrators, with;
  std::vector<double> times_s;
  std::vector<int64_t> samples;
  std::string reference_integrator = "PT";
  double reference_time_s = 0.0;
  int seeds = 1;
  bool pictures = false, quiet = false;
};

/// How long or with how many samples a point is rendered.
struct Limit {
  double time_s = 0.0;
  int64_t samples = 0;
  std::string text() const { return samples ? fmt::format("{} samples", samples) : fmt::format("{} s", time_s); }
  std::string file_text() const { return samples ? fmt::format("{}spp", samples) : fmt::format("{}s", time_s); }
};

double process_cpu_s() {
  timespec time{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// The part of a picture that was rendered, its first three components, row 0 at the top.
ImageLayer layer_of(const Picture& picture) {
  size_t components = 0;
  for (const Channel& channel : picture.channels) components += channel.components;
  const Rectangle& window = picture.rendered;
  ImageLayer layer{window.width, window.height, {"R", "G", "B"}, {}};
  for (int y = window.y + window.height - 1; y >= window.y; --y)
    for (int x = window.x; x < window.x + window.width; ++x) {
      const float* pixel = &picture.pixels[(static_cast<size_t>(y) * picture.width + x) * components];
      layer.pixels.insert(layer.pixels.end(), pixel, pixel + 3);
    }
  return layer;
}

/// A window (rows from the bottom) of an image as large as the picture.
ImageLayer crop(const ImageLayer& image, const Rectangle& window) {
  const size_t channels = image.channels.size();
  ImageLayer part{window.width, window.height, image.channels, {}};
  for (int row = 0; row < window.height; ++row) {
    const int y = image.height - window.y - window.height + row;
    const float* from = &image.pixels[(static_cast<size_t>(y) * image.width + window.x) * channels];
    part.pixels.insert(part.pixels.end(), from, from + window.width * channels);
  }
  return part;
}

bool write_text(const std::string& path, const std::string& text) {
  AtomicFile file(path);
  file.write(text);
  const Status written = file.commit();
  if (!written) say(written.error());
  return bool(written);
}

/// One run of the command: its scene, reference and points.
class Measurement {
 public:
  Measurement(const MeasureOptions& options, SceneRun& run, const Settings& settings)
      : options_(options), run_(run), settings_(settings) {}

  /// Each step returns an exit code; 0: go on.
  int load_reference();
  int measure();
  int conclude();

 private:
  Settings settings_for(const std::string& integrator, const Limit& limit, uint32_t seed) const;
  /// Renders; 0, or the exit code if it failed or was interrupted. Ends as finished after `cpu_limit_s` of processor
  /// time, 0: no limit.
  int render(const Settings& settings, double cpu_limit_s, RenderOutcome& outcome);
  int add_point(const std::string& integrator, const Limit& limit, int number);
  bool write_picture_of(const std::string& path, const Settings& settings, const RenderOutcome& outcome);
  std::vector<std::string> names() const;
  std::string in_folder(const std::string& name) const {
    return (std::filesystem::path(options_.output) / name).string();
  }

  const MeasureOptions& options_;
  SceneRun& run_;
  const Settings& settings_;
  ImageLayer reference_;
  std::vector<CurvePoint> points_;
  bool built_ = false;
};

Settings Measurement::settings_for(const std::string& integrator, const Limit& limit, uint32_t seed) const {
  Settings settings = settings_;
  settings.integrator = integrator;
  settings.samples = limit.samples;
  settings.time_limit_s = limit.time_s;
  settings.seed = seed;
  settings.passes.clear();
  return settings;
}

int Measurement::render(const Settings& settings, double cpu_limit_s, RenderOutcome& outcome) {
  const double start_s = process_cpu_s();
  bool over = false;
  outcome = run_.render(settings, [&] {
    if (over || cpu_limit_s <= 0.0 || process_cpu_s() - start_s < cpu_limit_s) return;
    run_.session().cancel();
    over = true;
  });
  if (outcome.status == RenderStatus::finished) return 0;
  if (outcome.status == RenderStatus::cancelled && over && !interrupted()) return 0;
  if (outcome.status == RenderStatus::cancelled) {
    say("Interrupted.");
    return k_interrupted;
  }
  say(outcome.message);
  return 1;
}

bool Measurement::write_picture_of(const std::string& path, const Settings& settings, const RenderOutcome& outcome) {
  const Picture picture = run_.session().picture();
  PictureView view{picture.width, picture.height, picture.rendered, picture.channels, picture.pixels, picture.metadata};
  view.metadata["lambent/integrator"] = settings.integrator;
  view.metadata["lambent/samples"] = fmt::format("{}", outcome.samples);
  view.metadata["lambent/seed"] = fmt::format("{}", settings.seed);
  view.metadata["lambent/render_time_s"] = fmt::format("{:.3f}", outcome.statistics.render_s);
  const Status written = write_picture(path, view);
  if (!written) say(written.error());
  return bool(written);
}

int Measurement::load_reference() {
  if (!std::filesystem::exists(options_.reference)) {
    if (options_.reference_time_s <= 0.0) {
      say(fmt::format("--reference '{}': there is no such file; with --reference-time it is rendered and kept",
                      options_.reference));
      return 2;
    }
    // Another seed than that of any point, so that errors are independent of the reference's.
    const Settings settings =
        settings_for(options_.reference_integrator, {options_.reference_time_s, 0}, ~settings_.seed);
    if (!options_.quiet)
      say(fmt::format("rendering the reference with {} for {} s", settings.integrator, settings.time_limit_s));
    RenderOutcome outcome;
    if (const int code = render(settings, 0.0, outcome)) return code;
    built_ = true;
    if (!write_picture_of(options_.reference, settings, outcome)) return 1;
  }
  auto image = read_image_layer(options_.reference, "");
  if (!image) {
    say(image.error());
    return 1;
  }
  if (image->width != settings_.width || image->height != settings_.height || image->channels.size() != 3) {
    say(fmt::format("The reference '{}' is {} x {} px with {} colours, the picture {} x {} with 3", options_.reference,
                    image->width, image->height, image->channels.size(), settings_.width, settings_.height));
    return 1;
  }
  reference_ = std::move(*image);
  return 0;
}

int Measurement::add_point(const std::string& integrator, const Limit& limit, int number) {
  Settings settings = settings_for(integrator, limit, settings_.seed + static_cast<uint32_t>(number));
  double cpu_limit_s = 0.0;
  if (options_.clock == "cpu") std::swap(cpu_limit_s, settings.time_limit_s);
  const double cpu_before_s = process_cpu_s();
  RenderOutcome outcome;
  if (const int code = render(settings, cpu_limit_s, outcome)) return code;
  CurvePoint point{integrator,    limit.time_s,    limit.samples,
                   settings.seed, outcome.samples, outcome.statistics.render_s};
  point.cpu_s = process_cpu_s() - cpu_before_s;
  const Picture picture = run_.session().picture();
  const ImageComparison found = compare_images(layer_of(picture), crop(reference_, picture.rendered), {});
  point.rel_mse = found.rel_mse;
  point.rel_mse_trimmed = found.rel_mse_trimmed;
  point.smape = found.smape;
  point.non_finite = found.non_finite;
  points_.push_back(point);
  if (!options_.quiet)
    say(fmt::format("{:4} {}: relMSE {:.4g} (trimmed {:.4g}), SMAPE {:.4g} ({} samples, {:.2f} s, CPU {:.2f} s){}",
                    integrator, limit.text(), point.rel_mse, point.rel_mse_trimmed, point.smape, point.samples,
                    point.render_s, point.cpu_s,
                    point.non_finite ? fmt::format(", {} pixels are not finite", point.non_finite) : ""));
  if (options_.pictures && number == 0)
    if (!write_picture_of(in_folder(fmt::format("{}_{}.exr", integrator, limit.file_text())), settings, outcome))
      return 1;
  return write_text(in_folder("curves.csv"), csv_text(points_)) ? 0 : 1;
}

int Measurement::measure() {
  std::vector<Limit> limits;
  for (const double time_s : options_.times_s) limits.push_back({time_s, 0});
  for (const int64_t samples : options_.samples) limits.push_back({0.0, samples});
  if (!built_ && !limits.empty()) {  // so that no point's CPU time holds the building of the scene
    RenderOutcome outcome;
    if (const int code = render(settings_for(options_.integrators.front(), {0.0, 1}, settings_.seed), 0.0, outcome))
      return code;
    print_messages(run_.report(), options_.quiet);
  }
  for (const Limit& limit : limits)  // integrators in turn, so that a busy moment of the machine hits all
    for (int number = 0; number < options_.seeds; ++number)
      for (const std::string& integrator : options_.integrators)
        if (const int code = add_point(integrator, limit, number)) return code;
  return 0;
}

std::vector<std::string> Measurement::names() const {
  std::vector<std::string> names;
  for (const CurvePoint& point : points_)
    if (std::find(names.begin(), names.end(), point.integrator) == names.end()) names.push_back(point.integrator);
  return names;
}

int Measurement::conclude() {
  for (const std::string& path : options_.with) {
    const auto more = read_csv(path);
    if (!more) {
      say(more.error());
      return 1;
    }
    points_.insert(points_.end(), more->begin(), more->end());
  }
  const Clock clock = options_.clock == "cpu" ? Clock::cpu : Clock::render;
  const std::string unit = clock == Clock::cpu ? "CPU s" : "s";
  const Diagram diagrams[] = {
      {"relMSE without the worst 0.1%", "rendering time, " + unit,
       curves_of(points_, clock, ErrorMeasure::rel_mse_trimmed)},
      {"SMAPE", "rendering time, " + unit, curves_of(points_, clock, ErrorMeasure::smape)},
  };
  if (const Status written = plot(diagrams, names()).write_png(in_folder("curves.png")); !written) {
    say(written.error());
    return 1;
  }
  const std::vector<ErrorCurve>& curves = diagrams[0].curves;
  const auto is_baseline = [&](const ErrorCurve& curve) { return curve.integrator == options_.baseline; };
  const auto baseline = std::find_if(curves.begin(), curves.end(), is_baseline);
  std::string table = "integrator,baseline,time_s,error_ratio,error,time_ratio,bound\n";
  for (const ErrorCurve& curve : curves) {
    if (baseline == curves.end()) {
      fmt::print("{:6} trimmed relMSE {:.4g} after {:.3g} {}\n", curve.integrator, curve.error.back(),
                 curve.time_s.back(), unit);
      continue;
    }
    const SpeedUp found = speed_up(curve, *baseline);
    static constexpr const char* k_bounds[] = {"", "at least ", "at most "};
    const char* bound = k_bounds[size_t(found.time_bound)];
    fmt::print(
        "{:6} trimmed relMSE {:.4g} after {:.3g} {}; error of {} at {:.3g} s: {}; its time to relMSE {:.3g}: {}{:.3g} "
        "times\n",
        curve.integrator, curve.error.back(), curve.time_s.back(), unit, options_.baseline, found.time_s,
        found.error_ratio ? fmt::format("{:.3g} times", *found.error_ratio) : "not measured", found.error, bound,
        found.time_ratio);
    table += fmt::format("{},{},{:.4g},{},{:.4g},{:.4g},{}\n", curve.integrator, options_.baseline, found.time_s,
                         found.error_ratio ? fmt::format("{:.4g}", *found.error_ratio) : "", found.error,
                         found.time_ratio, bound);
  }
  return write_text(in_folder("speed_ups.csv"), table) ? 0 : 1;
}

int measure(const MeasureOptions& given) {
  MeasureOptions options = given;
  if (options.times_s.empty() && options.samples.empty() && options.with.empty()) {
    say("There is nothing to measure: give --times, --samples or --with");
    return 2;
  }
  if (options.integrators.empty()) options.integrators = available_integrators();
  for (const std::string& name : options.integrators)
    if (!known_integrator(name)) return 2;
  if (options.reference_time_s > 0.0 && !known_integrator(options.reference_integrator)) return 2;
  catch_interrupts();
  Report loading;
  const auto scene = description::load_scene_file(options.choices.scene, loading);
  print_messages(loading, options.quiet);
  if (!scene) {
    say(scene.error());
    return 1;
  }
  options.choices.integrator = options.integrators.front();  // the saved one need not be among those of this program
  const std::optional<Settings> settings = settings_of(*scene, options.choices);
  if (!settings) return 2;
  std::error_code error;
  std::filesystem::create_directories(options.output, error);
  if (error) {
    say(fmt::format("The folder '{}' cannot be made: {}", options.output, error.message()));
    return 1;
  }
  SceneRun run(*scene, options.choices.threads);
  Measurement measurement(options, run, *settings);
  if (const int code = measurement.load_reference()) return code;
  const int code = measurement.measure();
  if (code != 0 && code != k_interrupted) return code;
  const int concluded = measurement.conclude();  // what was measured before an interrupt counts
  return code ? code : concluded;
}

}  // namespace

Command add_measure_command(CLI::App& program) {
  const auto options = std::make_shared<MeasureOptions>();
  CLI::App* app = program.add_subcommand("measure", "Measure integrators: error against time, as curves and speed-ups");
  add_scene_options(*app, options->choices);
  app->add_option("-o,--output", options->output, "Folder for curves.csv, curves.png and speed_ups.csv")->required();
  app->add_option("--reference", options->reference,
                  "Converged picture of the same size; where the file is missing it is rendered, see --reference-time")
      ->required();
  app->add_option("--reference-time", options->reference_time_s,
                  "Seconds to render a missing reference for, then keep it")
      ->check(CLI::PositiveNumber);
  app->add_option("--reference-integrator", options->reference_integrator, "Integrator of that render")
      ->capture_default_str();
  app->add_option("--integrators", options->integrators, "Integrators to measure; default: all")
      ->allow_extra_args(false)
      ->delimiter(',');
  app->add_option("--times", options->times_s, "Seconds of rendering by --clock, a point each")
      ->allow_extra_args(false)
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
  app->add_option("--samples", options->samples, "Samples per pixel, a point each")
      ->allow_extra_args(false)
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
  app->add_option("--seeds", options->seeds, "Renders of each point; their errors are averaged")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  app->add_option("--baseline", options->baseline, "Integrator that speed-ups are ratios to")->capture_default_str();
  app->add_option("--clock", options->clock,
                  "Time that limits and curves are in: cpu (of all threads) or render (wall)")
      ->check(CLI::IsMember({"cpu", "render"}))
      ->capture_default_str();
  app->add_option("--with", options->with, "Further curves to draw and compare: CSVs such as this command writes")
      ->allow_extra_args(false)
      ->delimiter(',');
  app->add_flag("--pictures", options->pictures, "Keep each point's picture in the folder");
  app->add_flag("--quiet", options->quiet, "Print results and errors only");
  return {app, [options] { return measure(*options); }};
}

}  // namespace lambent
