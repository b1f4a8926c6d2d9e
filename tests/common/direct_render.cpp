#include "tests/common/direct_render.h"

#include <gtest/gtest.h>

#include "engine/scene/scene_builder.h"

namespace lambent::test {

std::shared_ptr<const Scene> build_scene(const SceneMaker& maker) {
  description::SceneDescription description;
  description::apply(maker.transaction(), description);
  Report report;
  CancelFlag cancel;
  SceneBuilder builder({});
  Result<std::shared_ptr<const Scene>> scene = builder.build(description, cancel, report);
  EXPECT_TRUE(static_cast<bool>(scene)) << scene.error();
  return *scene;
}

std::shared_ptr<Film> render_directly(const std::string& name, const std::shared_ptr<const Scene>& scene,
                                      IntegratorSettings settings, int64_t samples,
                                      std::optional<KernelProfile> profile) {
  settings.profile = profile.value_or(scene->profile().kernel());
  settings.threads = 1;
  FilmSettings film_settings;
  film_settings.width = scene->camera().width_px();
  film_settings.height = scene->camera().height_px();
  film_settings.tile_size_px = 16;
  film_settings.splat_unit = splat_unit(name, *scene, settings.exposure);
  const std::shared_ptr<Film> film = *Film::create(film_settings);
  const std::unique_ptr<Integrator> integrator = std::move(*make_integrator(name, scene, settings));
  const CancelFlag cancel;
  integrator->prepare(*film);
  for (int64_t sample = 0, target; sample < samples; sample = target) {
    const int stages = integrator->stages(sample);
    target = stages > 0 ? sample + 1 : samples;
    for (int stage = 0; stage < stages; ++stage)
      for (int piece = 0, pieces = integrator->begin_stage(*film, sample, stage); piece < pieces; ++piece)
        integrator->run_piece(*film, sample, stage, piece, cancel);
    for (int tile = 0; tile < film->tiles().count(); ++tile) integrator->render_tile(*film, tile, target, cancel);
  }
  return film;
}

}  // namespace lambent::test
