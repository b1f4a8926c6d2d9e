#include "engine/integrators/path_tracer/path_tracer.h"

#include <algorithm>
#include <optional>

#include "engine/base/check.h"
#include "engine/integrators/path_tracer/kernel.h"

namespace lambent {

namespace {

template <KernelProfile profile>
class PathTracer final : public Integrator {
 public:
  PathTracer(std::shared_ptr<const Scene> scene, const IntegratorSettings& settings)
      : scene_(std::move(scene)),
        settings_(settings),
        other_settings_(for_other_pictures(settings)),
        has_others_(std::ranges::any_of(settings.others, [](const auto& other) { return other != nullptr; })) {}

  RayCounts render_tile(Film& film, int tile, int64_t target_samples, const CancelFlag& cancel) override {
    RayCounts counts;
    TileWriter writer(film, tile);
    const Rectangle& rectangle = film.tiles()[tile];
    const bool adaptive = film.settings().second_moments;
    std::optional<PassRecorder> passes;
    Parts parts;
    if (settings_.passes) {
      passes.emplace(*settings_.passes, *scene_);
      passes->share();
      passes->start_clock();
    }
    for (size_t i = 0; i < parts.size(); ++i)
      if (settings_.others[i] && other_settings_[i].parts)
        parts[i].emplace(*settings_.passes, *settings_.others[i], other_settings_[i].picture);
    for (int y = rectangle.y; y < rectangle.y + rectangle.height; ++y)
      for (int x = rectangle.x; x < rectangle.x + rectangle.width; ++x) {
        if (cancel.cancelled()) return counts;
        if (adaptive && !film.active(x, y)) continue;
        for (int64_t sample = film.sample_count(x, y); sample < target_samples; ++sample) {
          if (passes) passes->begin(x, y, static_cast<uint32_t>(sample), writer.next());
          const PathEstimate estimate =
              render_sample(x, y, static_cast<uint32_t>(sample), counts, passes ? &*passes : nullptr, parts);
          if (render_context().interrupted && cancel.cancelled()) return counts;  // not whole: as if it had not begun
          const Vec4 picture = picture_of(estimate, settings_.exposure);
          if (passes) {
            passes->finish(picture, estimate.behind * settings_.exposure, sample + 1 == target_samples);
            writer.add_next(x, y);
          } else {
            writer.add(x, y, picture);
          }
        }
      }
    return counts;
  }

 private:
  using Parts = std::array<std::optional<PassRecorder>, k_other_pictures>;

  PathEstimate render_sample(int x, int y, uint32_t sample, RayCounts& counts, PassRecorder* passes,
                             Parts& parts) const {
    RenderContext& context = render_context();
    context.pixel_x = x;
    context.pixel_y = y;
    context.sample = sample;
    const Sampler sampler(settings_.seed, x, y, sample);
    const Vec2 offset = settings_.filter.sample(sampler.get_2d(k_dimension_pixel_filter));
    const Vec2 raster(static_cast<float>(x) + 0.5f + offset.x, static_cast<float>(y) + 0.5f + offset.y);
    const Vec2 lens = scene_->profile().depth_of_field ? sampler.get_2d(k_dimension_lens) : Vec2(0.0f);
    const CameraRay ray = scene_->camera().sample_ray(raster, lens);
    const PathEstimate estimate = trace(*scene_, settings_, sampler, counts, passes, ray);
    if (passes && has_others_) render_others(x, y, sample, sampler, ray, counts, *passes, parts);
    return estimate;
  }

  void render_others(int x, int y, uint32_t sample, const Sampler& sampler, const CameraRay& ray, RayCounts& counts,
                     PassRecorder& passes, Parts& parts) const {
    for (size_t i = 0; i < settings_.others.size(); ++i) {
      if (!settings_.others[i]) continue;
      PassRecorder* const part = parts[i] ? &*parts[i] : nullptr;
      if (part) part->begin(x, y, sample);
      const PathEstimate of_other = trace(*settings_.others[i], other_settings_[i], sampler, counts, part, ray);
      passes.add_other(static_cast<OtherPicture>(i), of_other.radiance * settings_.exposure,
                       1.0f - of_other.transparency, part);
    }
  }

  static PathEstimate trace(const Scene& scene, const IntegratorSettings& settings, const Sampler& sampler,
                            RayCounts& counts, PassRecorder* passes, const CameraRay& ray) {
    if (passes) return path_tracer::Kernel<profile, true>(scene, settings, sampler, counts, passes).run(ray);
    return path_tracer::Kernel<profile, false>(scene, settings, sampler, counts, nullptr).run(ray);
  }

  const std::shared_ptr<const Scene> scene_;
  const IntegratorSettings settings_;
  const std::array<IntegratorSettings, k_other_pictures> other_settings_;
  const bool has_others_;  ///< some of settings_.others
};

}  // namespace

std::unique_ptr<Integrator> make_path_tracer(std::shared_ptr<const Scene> scene, const IntegratorSettings& settings) {
  CHECK(settings.profile >= scene->profile().kernel(), "the kernel must cover what the scene needs");
  if (settings.profile == KernelProfile::solid)
    return std::make_unique<PathTracer<KernelProfile::solid>>(std::move(scene), settings);
  return std::make_unique<PathTracer<KernelProfile::surfaces>>(std::move(scene), settings);
}

}  // namespace lambent
