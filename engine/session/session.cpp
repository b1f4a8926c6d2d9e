#include "engine/session/session.h"

#include <algorithm>
#include <array>
#include <condition_variable>
#include <exception>
#include <functional>
#include <future>
#include <iterator>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "engine/base/cancel.h"
#include "engine/base/log.h"
#include "engine/base/memory.h"
#include "engine/integrators/integrator.h"
#include "engine/integrators/passes.h"
#include "engine/scene/scene_builder.h"
#include "engine/session/cryptomatte.h"
#include "engine/session/final_tiles.h"
#include "engine/session/render.h"
#include "engine/session/tile_size.h"
#include "engine/session/worker_pool.h"

namespace lambent {

namespace {

using Clock = std::chrono::steady_clock;

/// Of pixels that take_tiles() reads in one call.
constexpr size_t k_taken_bytes = size_t(2) << 20;

/// How many tiles of these channels may be read while someone waits: about as many as k_taken_bytes hold.
size_t tiles_at_once(size_t limit, int tile_size_px, const std::vector<Channel>& channels) {
  size_t floats = 0;
  for (const Channel& channel : channels) floats += static_cast<size_t>(channel.components);
  const size_t side = static_cast<size_t>(tile_size_px), bytes = side * side * floats * sizeof(float);
  return std::min(limit, std::max<size_t>(k_taken_bytes / std::max<size_t>(bytes, 1), 1));
}

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

class PooledEngine final : public Engine {
 public:
  explicit PooledEngine(const EngineOptions& engine_options) : options(engine_options), pool(engine_options.threads) {}
  int thread_count() const override { return pool.thread_count(); }

  const EngineOptions options;
  WorkerPool pool;
};

IntegratorSettings integrator_settings(const description::Settings& settings, const Scene& scene) {
  IntegratorSettings result;
  result.seed = settings.seed;
  result.bounces = {settings.max_bounces, settings.diffuse_bounces, settings.glossy_bounces,
                    settings.transmission_bounces, settings.transparent_bounces};
  switch (settings.pixel_filter) {
    case description::PixelFilter::box:
      result.filter = PixelFilter(FilterKind::box);
      break;
    case description::PixelFilter::gaussian:
      result.filter = PixelFilter(FilterKind::gaussian, settings.filter_width_px);
      break;
    case description::PixelFilter::blackman_harris:
      result.filter = PixelFilter(FilterKind::blackman_harris, settings.filter_width_px);
      break;
  }
  result.film_transparent = settings.film_transparent;
  if (settings.film_transparent && settings.film_transparent_glass)
    result.see_through_alpha = settings.film_transparent_roughness > 0.0f
                                   ? settings.film_transparent_roughness * settings.film_transparent_roughness
                                   : 0.0f;
  result.exposure = settings.exposure;
  result.clamp_direct = settings.clamp_direct;
  result.clamp_indirect = settings.clamp_indirect;
  result.light_threshold = settings.light_threshold;
  result.caustics_reflective = settings.caustics_reflective;
  result.caustics_refractive = settings.caustics_refractive;
  result.merge_radius_px = settings.merge_radius_px;
  result.merge_alpha = settings.merge_alpha;
  result.shared_light_paths = settings.shared_light_paths;
  result.clamp_connection = settings.clamp_connection;
  result.threads = settings.threads;
  result.profile = scene.profile().kernel();
  return result;
}

std::shared_ptr<const PassPlan> pass_plan(const description::Settings& settings, const Scene& scene, Report& report) {
  if (settings.passes.empty() && !scene.has_shadow_catchers()) return nullptr;
  std::vector<PassRequest> requests;
  for (const description::Pass& pass : settings.passes) requests.push_back({pass.name, pass.kind, pass.argument});
  PassSettings options;
  options.mist_start_m = settings.mist.start_m;
  options.mist_depth_m = settings.mist.depth_m;
  options.mist_exponent = settings.mist.falloff == description::MistFalloff::linear      ? 1.0f
                          : settings.mist.falloff == description::MistFalloff::quadratic ? 2.0f
                                                                                         : 0.5f;
  options.ambient_occlusion_distance_m = settings.ambient_occlusion_distance_m;
  options.alpha_threshold = settings.pass_alpha_threshold;
  options.transparent_bounces = settings.transparent_bounces;
  options.exposure = settings.exposure;
  options.film_transparent = settings.film_transparent;
  options.seed = settings.seed;
  options.first_light_tracing = first_light_tracing(settings.integrator);
  return PassPlan::create(requests, scene, options, report);
}

void hide_from_all_but_the_camera(description::Object& object) {
  const bool camera = object.visibility.camera;
  object.visibility = {};
  object.visibility.camera = camera;
  object.visibility.diffuse = object.visibility.glossy = object.visibility.transmission = false;
  object.visibility.shadow = object.visibility.volume_scatter = false;
}

/// The scene in which the camera sees shadow catchers alone: they are surfaces, and all else cuts holes.
/// @param bare nothing but lights has an effect on them. What emits is a light, and shades them all the same.
description::SceneDescription shadow_catchers_of(const description::SceneDescription& scene, bool bare,
                                                 const std::set<std::string>& emissive_objects) {
  description::SceneDescription result = scene;
  for (auto& [id, object] : result.objects) {
    if (object->mesh.empty()) continue;
    const auto changed = std::make_shared<description::Object>(*object);
    changed->holdout = object->holdout || !object->shadow_catcher;
    changed->shadow_catcher = false;
    if (bare && changed->holdout && !emissive_objects.contains(object->name)) hide_from_all_but_the_camera(*changed);
    object = changed;
  }
  return result;
}

/// The scene in which what casts the shadows of shadow passes is seen by the camera alone.
description::SceneDescription without_shadows_of(const description::SceneDescription& scene, Report& report) {
  description::SceneDescription result = scene;
  bool any = false;
  for (auto& [id, object] : result.objects) {
    if (!object->shadow_pass) continue;
    any = true;
    const auto changed = std::make_shared<description::Object>(*object);
    hide_from_all_but_the_camera(*changed);
    object = changed;
  }
  if (!any)
    report.warning("pass", "shadow passes",
                   "Passes of shadows take none away: there is no object whose shadows are chosen for them.");
  return result;
}

/// @param threads that render
FilmSettings film_settings(const description::Settings& settings, const Scene& scene, const PassPlan* passes,
                           int threads) {
  FilmSettings result;
  if (passes) result.channels = passes->channels();
  result.samples_asked = settings.samples;
  result.width = settings.width;
  result.height = settings.height;
  if (settings.region) {
    const auto& [x0, y0, x1, y1] = *settings.region;
    result.region = {x0, y0, x1 - x0, y1 - y0};
  }
  const Rectangle whole{0, 0, settings.width, settings.height};
  result.tile_size_px = tile_size_px(settings.region ? result.region : whole, settings.tile_size_px, threads);
  // A sample that sees the film through glass may weigh more than 1, and its alpha less than 0.
  result.allow_negative = scene.subtracts_light() || (settings.film_transparent && settings.film_transparent_glass);
  result.second_moments = settings.noise_threshold > 0.0f;
  result.splat_unit = splat_unit(settings.integrator, scene, settings.exposure);
  return result;
}

/// What the samples of a checkpoint belong to. Only settings that change them: the scene itself is the user's promise.
std::string render_identity(const description::Settings& settings) {
  std::string passes;  // the film knows their names and forms
  for (const description::Pass& pass : settings.passes) passes += fmt::format(" {} '{}'", pass.kind, pass.argument);
  return fmt::format(
      "{} seed {} filter {} {} size {}x{} bounces {} {} {} {} {} transparent {} {} exposure {} camera {} passes{}",
      settings.integrator, settings.seed, static_cast<int>(settings.pixel_filter), settings.filter_width_px,
      settings.width, settings.height, settings.max_bounces, settings.diffuse_bounces, settings.glossy_bounces,
      settings.transmission_bounces, settings.transparent_bounces, settings.film_transparent,
      settings.film_transparent_glass ? settings.film_transparent_roughness : -1.0f, settings.exposure, settings.camera,
      passes);
}

}  // namespace

/// One render from start() to done. Shared by the session's caller and its conductor thread.
struct Run {
  int64_t epoch = 0;
  description::SceneDescription scene;
  double update_s = 0.0;  ///< what the transactions before it took to apply
  std::shared_ptr<ContributionObserver> observer;
  bool repeat_tiles = true;
  std::shared_ptr<Run> before;  ///< to be freed, which takes long where a film is large: while the scene is built
  CancelFlag cancel;
  Clock::time_point start = Clock::now();

  mutable std::mutex mutex;       ///< guards what follows
  Stage stage = Stage::updating;  ///< idle: nothing is rendered any more, there are no tiles until they are final
  std::shared_ptr<Film> film;
  std::shared_ptr<Render> render;
  std::vector<char> taken_whole;            ///< by tile: what was taken last had all channels
  std::unique_ptr<FinalTiles> final_tiles;  ///< no newer pixels will come
  bool tiles_told = false;                  ///< tiles_ready was called and nothing taken since
};

struct Session::State {
  std::shared_ptr<PooledEngine> engine;
  SessionEvents events;
  description::SceneDescription description;
  SceneBuilder builder;  ///< used by one build at a time: the one in `building`, if that is valid
  std::future<void> building;
  std::string checkpoint_to_load;
  std::shared_ptr<ContributionObserver> observer;
  double update_s = 0.0;  ///< since the last start()

  mutable std::mutex mutex;
  std::condition_variable idle;
  std::shared_ptr<Run> run;  ///< the newest, running or not
  bool running = false;
  std::thread conductor;

  State(std::shared_ptr<PooledEngine> shared_engine, SessionEvents session_events)
      : engine(std::move(shared_engine)),
        events(std::move(session_events)),
        builder({engine->options.texture_cache_bytes ? engine->options.texture_cache_bytes : physical_bytes() / 4}) {}

  std::shared_ptr<Run> current() const {
    const std::lock_guard lock(mutex);
    return run;
  }

  void cancel() {
    const std::shared_ptr<Run> of = current();
    if (!of) return;
    of->cancel.cancel();
    const std::lock_guard lock(of->mutex);
    if (of->render) of->render->wake();
  }

  void stop_and_wait() {
    cancel();
    if (conductor.joinable()) conductor.join();
  }

  void tell_tiles(Run& of) {
    {
      const std::lock_guard lock(of.mutex);
      if (of.tiles_told) return;
      of.tiles_told = true;
    }
    if (events.tiles_ready) events.tiles_ready();
  }

  void make_final(Run& of);
  void conduct(const std::shared_ptr<Run>& of);
  RenderOutcome render(const std::shared_ptr<Run>& of);
  std::optional<Result<std::shared_ptr<const Scene>>> build(const std::shared_ptr<Run>& of,
                                                            const description::SceneDescription& scene, Report& report);
};

/// Builds the scene; nullopt if cancelled. Some steps cannot be interrupted (decoding one large image): a cancelled
/// build then finishes in the background, and the next one waits for it, while the client already has its answer.
std::optional<Result<std::shared_ptr<const Scene>>> Session::State::build(const std::shared_ptr<Run>& of,
                                                                          const description::SceneDescription& scene,
                                                                          Report& report) {
  using namespace std::chrono_literals;
  constexpr auto patience = 50ms;  // for an orderly end after cancelling
  const auto wait = [&](std::future<void>& future) {
    while (future.wait_for(5ms) != std::future_status::ready)
      if (of->cancel.cancelled() && future.wait_for(patience) != std::future_status::ready) return false;
    return true;
  };
  if (building.valid() && !wait(building)) return std::nullopt;
  struct Work {
    description::SceneDescription description;
    Report report;
    std::optional<Result<std::shared_ptr<const Scene>>> scene;
  };
  const auto work = std::make_shared<Work>();
  work->description = scene;
  building = std::async(std::launch::async, [this, of, work, before = std::move(of->before)]() mutable {
    before.reset();
    work->scene = builder.build(work->description, of->cancel, work->report);
  });
  if (!wait(building)) return std::nullopt;
  building.get();  // rethrows what a library threw
  report.append(work->report);
  if (of->cancel.cancelled()) return std::nullopt;
  return std::move(work->scene);
}

/// With the run's lock held: what was rendered will not change any more.
void Session::State::make_final(Run& of) {
  of.tiles_told = false;
  if (!of.film) return;
  const size_t all = static_cast<size_t>(of.film->tiles().count());
  for (const int changed : of.film->take_dirty(all)) of.taken_whole[static_cast<size_t>(changed)] = 0;
  of.film->mark_filled_dirty();
  std::vector<int> tiles = of.film->take_dirty(all);
  if (!of.repeat_tiles && !of.film->takes_splats())  // which may have come anywhere since
    std::erase_if(tiles, [&](int tile) { return of.taken_whole[static_cast<size_t>(tile)]; });
  of.final_tiles =
      std::make_unique<FinalTiles>(engine->pool, of.film, std::move(tiles), [this, &of] { tell_tiles(of); });
}

void Session::State::conduct(const std::shared_ptr<Run>& run_pointer) {
  Run& of = *run_pointer;
  RenderOutcome outcome;
  try {
    outcome = render(run_pointer);
  } catch (const std::exception& exception) {  // a library's, such as out of memory
    outcome.status = RenderStatus::failed;
    outcome.message = std::string("The render failed: ") + exception.what();
  }
  outcome.epoch = of.epoch;
  {
    const std::lock_guard lock(of.mutex);
    of.stage = Stage::idle;
  }
  if (events.stopped) events.stopped(of.epoch);
  {
    const std::lock_guard lock(of.mutex);
    make_final(of);
  }
  if (of.film) tell_tiles(of);
  spdlog::info("Render {}: {}, {} samples in {:.2f} s (scene {:.2f} s){}{}", of.epoch,
               outcome.status == RenderStatus::finished    ? "finished"
               : outcome.status == RenderStatus::cancelled ? "cancelled"
                                                           : "failed",
               outcome.samples, outcome.statistics.render_s, outcome.statistics.build_s,
               outcome.message.empty() ? "" : ": ", outcome.message);
  if (events.done) events.done(outcome);
  {
    const std::lock_guard lock(mutex);
    running = false;
  }
  idle.notify_all();
}

RenderOutcome Session::State::render(const std::shared_ptr<Run>& run_pointer) {
  Run& of = *run_pointer;
  const description::Settings& settings = *of.scene.settings;
  RenderOutcome outcome;
  outcome.statistics.update_s = of.update_s;
  const auto fail = [&](std::string message) {
    outcome.status = of.cancel.cancelled() ? RenderStatus::cancelled : RenderStatus::failed;
    if (outcome.status == RenderStatus::failed) outcome.message = std::move(message);
    return outcome;
  };

  {
    const std::lock_guard lock(of.mutex);
    of.stage = Stage::building;
  }
  Report report;
  const Clock::time_point build_start = Clock::now();
  const std::optional<Result<std::shared_ptr<const Scene>>> built = build(run_pointer, of.scene, report);
  outcome.statistics.build_s = seconds_since(build_start);
  std::shared_ptr<const PassPlan> passes;
  if (built && *built) {
    passes = pass_plan(settings, ***built, report);
    report_lost_light(settings.integrator, ***built, report);
    report_merge_radius(settings.integrator, settings.merge_radius_px, std::max(settings.width, settings.height),
                        report);
  }
  std::array<std::shared_ptr<const Scene>, k_other_pictures> others;
  for (size_t i = 0; i < others.size(); ++i) {
    const auto picture = static_cast<OtherPicture>(i);
    if (!passes || !passes->wants(picture)) continue;
    Report again;  // of what has been reported
    const auto other =
        build(run_pointer,
              picture == OtherPicture::without_shadows
                  ? without_shadows_of(of.scene, report)
                  : shadow_catchers_of(of.scene, picture == OtherPicture::catcher_bare, (**built)->emissive_objects()),
              again);
    if (!other) return fail({});
    if (!*other) return fail(other->error());
    others[i] = **other;
  }
  if (events.report && !of.cancel.cancelled()) events.report(of.epoch, report);
  if (!built) return fail({});
  const Result<std::shared_ptr<const Scene>>& scene = *built;
  if (!scene) return fail(scene.error());

  const int workers = engine->thread_count();
  const int threads = settings.threads > 0 ? std::min(settings.threads, workers) : workers;
  Result<std::shared_ptr<Film>> film = Film::create(film_settings(settings, **scene, passes.get(), threads));
  if (!film) return fail(film.error());
  IntegratorSettings integrator_options = integrator_settings(settings, **scene);
  integrator_options.observer = of.observer;
  integrator_options.passes = passes;
  integrator_options.others = others;
  Result<std::unique_ptr<Integrator>> integrator = make_integrator(settings.integrator, *scene, integrator_options);
  if (!integrator) return fail(integrator.error());
  if (!checkpoint_to_load.empty()) {
    const Status loaded = (*film)->load(checkpoint_to_load, render_identity(settings));
    checkpoint_to_load.clear();
    if (!loaded) return fail(loaded.error());
  }

  const RenderGoal goal{settings.samples, settings.time_limit_s, settings.noise_threshold, settings.threads};
  const auto work =
      std::make_shared<Render>(engine->pool, *film, std::move(*integrator), goal, of.cancel, [&] { tell_tiles(of); });
  {
    const std::lock_guard lock(of.mutex);
    of.film = *film;
    of.taken_whole.assign(static_cast<size_t>((*film)->tiles().count()), 0);
    of.render = work;
    of.stage = Stage::rendering;
  }
  const Clock::time_point render_start = Clock::now();
  const double before_render_s = std::chrono::duration<double>(render_start - of.start).count();
  outcome.status = work->run() == Render::End::cancelled ? RenderStatus::cancelled : RenderStatus::finished;
  // Images are read when a point asks: what is wrong with them may come up only now.
  if (const TextureSystem* textures = (*scene)->textures(); textures && events.report) {
    const Report late = textures->take_problems();
    if (!late.messages().empty()) events.report(of.epoch, late);
  }

  Statistics& statistics = outcome.statistics;
  statistics.render_s = seconds_since(render_start);
  statistics.first_tile_s = before_render_s + work->first_tile_s();
  statistics.rays = work->counts().rays;
  statistics.paths = work->counts().paths;
  statistics.non_finite = (*film)->rejected_count();
  const SceneStatistics counts = (*scene)->statistics();
  statistics.triangles = counts.triangles;
  statistics.unique_triangles = counts.unique_triangles;
  statistics.instances = counts.instances;
  statistics.emitters = counts.emitters;
  statistics.profile = profile_name((*scene)->profile().kernel());
  statistics.modelled = modelled((*scene)->profile());
  statistics.not_modelled = not_modelled((*scene)->profile());
  statistics.memory = {counts.geometry_bytes, counts.bvh_bytes,    counts.texture_bytes, 0,
                       counts.light_bytes,    counts.shading_bytes};
  statistics.memory.film = (*film)->bytes();
  outcome.samples = (*film)->min_sample_count();
  for (const RejectedSample& rejected : (*film)->rejected_samples())
    spdlog::warn(
        "Render {}: pixel ({}, {}) sample {} was not finite or negative and was left out; replay with --region "
        "{} {} {} {} --samples {} --seed {}",
        of.epoch, rejected.x, rejected.y, rejected.sample, rejected.x, rejected.y, rejected.x + 1, rejected.y + 1,
        rejected.sample + 1, settings.seed);
  return outcome;
}

Session::Session(std::shared_ptr<Engine> engine, SessionEvents events)
    : state_(std::make_unique<State>(std::static_pointer_cast<PooledEngine>(std::move(engine)), std::move(events))) {}

Session::~Session() { state_->stop_and_wait(); }

void Session::apply(description::Transaction transaction) {
  const Clock::time_point start = Clock::now();
  description::apply(std::move(transaction), state_->description);
  state_->update_s += seconds_since(start);
}

const description::SceneDescription& Session::scene() const { return state_->description; }

void Session::observe(std::shared_ptr<ContributionObserver> observer) { state_->observer = std::move(observer); }

void Session::start(int64_t epoch, bool repeat_tiles) {
  state_->stop_and_wait();
  auto run = std::make_shared<Run>();
  run->epoch = epoch;
  run->repeat_tiles = repeat_tiles;
  run->scene = state_->description;
  run->observer = state_->observer;
  run->update_s = std::exchange(state_->update_s, 0.0);
  {
    const std::lock_guard lock(state_->mutex);
    run->before = std::exchange(state_->run, run);
    state_->running = true;
  }
  state_->conductor = std::thread([state = state_.get(), run] { state->conduct(run); });
}

void Session::cancel() { state_->cancel(); }

void Session::wait() {
  std::unique_lock lock(state_->mutex);
  state_->idle.wait(lock, [&] { return !state_->running; });
}

Progress Session::progress() const {
  Progress progress;
  const std::shared_ptr<Run> run = state_->current();
  if (!run) return progress;
  const std::lock_guard lock(run->mutex);
  progress.epoch = run->epoch;
  progress.stage = run->stage;
  progress.elapsed_s = seconds_since(run->start);
  progress.samples_total = run->scene.settings->samples;
  if (!run->film || !run->render) return progress;
  progress.samples = run->film->min_sample_count();
  progress.tiles_total = run->film->tiles().count();
  progress.tiles = run->final_tiles ? progress.tiles_total : run->render->tiles_done_in_pass();
  progress.active_tiles = run->render->active_tiles();
  const double fraction = run->render->fraction_done();
  if (fraction > 0.0) progress.remaining_s = progress.elapsed_s * (1.0 - fraction) / fraction;
  return progress;
}

std::vector<TileSnapshot> Session::take_tiles(size_t limit, const std::vector<std::string>& names) {
  std::vector<TileSnapshot> tiles;
  const std::shared_ptr<Run> run = state_->current();
  if (!run) return tiles;
  std::shared_ptr<Film> film;
  FinalTiles* final;
  std::vector<int> dirty;
  std::vector<bool> wanted;
  std::vector<Channel> channels;
  {
    const std::lock_guard lock(run->mutex);
    run->tiles_told = false;
    film = run->film;
    final = run->final_tiles.get();
    if (!film || (run->stage == Stage::idle && !final)) return tiles;
    channels = film->channels();
    if (!names.empty() && !final) {
      const auto is_named = [&](const Channel& channel) {
        return std::find(names.begin(), names.end(), channel.name) != names.end();
      };
      std::transform(channels.begin(), channels.end(), std::back_inserter(wanted), is_named);
      std::erase_if(channels, std::not_fn(is_named));
    }
    limit = tiles_at_once(limit, film->settings().tile_size_px, channels);
    // Under the lock: the end of a render takes them all, and these must not be taken for final ones.
    if (!final) dirty = film->take_dirty(limit);
    for (const int index : dirty)
      run->taken_whole[static_cast<size_t>(index)] = channels.size() == film->channels().size();
  }
  const auto add = [&](FilmTile tile) {
    tiles.push_back({run->epoch, tile.rectangle, tile.samples, final != nullptr, channels, std::move(tile.pixels)});
  };
  for (const int index : dirty) add(film->tile(index, wanted));
  while (final && tiles.size() < limit) {
    std::optional<FilmTile> tile = final->take();
    if (!tile) break;
    add(std::move(*tile));
  }
  return tiles;
}

bool Session::tiles_left() const {
  const std::shared_ptr<Run> run = state_->current();
  if (!run) return false;
  const std::lock_guard lock(run->mutex);
  return run->final_tiles && run->final_tiles->left();
}

Picture Session::picture() const {
  Picture picture;
  const std::shared_ptr<Run> run = state_->current();
  if (!run) return picture;
  std::shared_ptr<Film> film;
  {
    const std::lock_guard lock(run->mutex);
    film = run->film;
  }
  if (!film) return picture;
  const FilmSettings& settings = film->settings();
  picture.width = settings.width;
  picture.height = settings.height;
  picture.rendered = film->region();
  picture.channels = film->channels();
  const std::vector<float> region = film->pixels();
  if (picture.rendered == Rectangle{0, 0, settings.width, settings.height}) {
    picture.pixels = region;
  } else {
    const size_t row = static_cast<size_t>(film->components()) * picture.rendered.width;
    picture.pixels.assign(static_cast<size_t>(settings.width) * settings.height * film->components(), 0.0f);
    for (int y = 0; y < picture.rendered.height; ++y)
      std::copy_n(&region[y * row], row,
                  &picture.pixels[(static_cast<size_t>(y + picture.rendered.y) * settings.width + picture.rendered.x) *
                                  film->components()]);
  }
  picture.metadata = run->scene.settings->metadata;
  add_cryptomatte_metadata(run->scene, picture.metadata);
  return picture;
}

Status Session::save_checkpoint(const std::string& path) const {
  const std::shared_ptr<Run> run = state_->current();
  std::shared_ptr<Film> film;
  if (run) {
    const std::lock_guard lock(run->mutex);
    if (run->final_tiles) film = run->film;
  }
  if (!film) return Error{"There is no finished or stopped render to save as checkpoint '" + path + "'"};
  return film->save(path, render_identity(*run->scene.settings));
}

Status Session::load_checkpoint(const std::string& path) {
  state_->checkpoint_to_load = path;
  return Ok{};
}

std::shared_ptr<Engine> Engine::create(const EngineOptions& options) { return std::make_shared<PooledEngine>(options); }

std::vector<std::string> available_integrators() { return integrator_names(); }
std::vector<std::string> available_passes() {
  std::vector<std::string> names = pass_kind_names();
  names.insert(names.begin(), "combined");
  return names;
}

}  // namespace lambent
