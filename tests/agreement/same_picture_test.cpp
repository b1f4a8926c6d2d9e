// What must not change a picture: threads, tiles, order, pauses, kernels, scale and place.
#include <gtest/gtest.h>

#include "engine/base/cancel.h"
#include "engine/integrators/integrator.h"
#include "engine/scene/scene_builder.h"
#include "tests/common/scene_maker.h"

namespace lambent::test {
namespace {

TEST(SamePicture, whatever_the_number_of_threads_and_the_size_of_tiles) {
  SceneMaker maker = room(8);
  const Picture reference = render(maker.transaction(), 1);
  ASSERT_GT(mean(reference).value.x, 0.01f);
  for (const int threads : {2, 3, 8})
    for (const int tile : {7, 16, 64}) {
      maker.settings.tile_size_px = tile;
      EXPECT_EQ(render(maker.transaction(), threads).pixels, reference.pixels) << threads << " threads, tile " << tile;
    }
}

TEST(SamePicture, a_region_has_the_pixels_of_the_whole) {
  SceneMaker maker = room(4);
  const Picture whole = render(maker.transaction());
  maker.settings.region = {{11, 5, 30, 33}};
  const Picture part = render(maker.transaction());
  ASSERT_EQ(part.pixels.size(), whole.pixels.size());
  for (int y = 0; y < whole.height; ++y)
    for (int x = 0; x < whole.width; ++x) {
      const bool inside = x >= 11 && x < 30 && y >= 5 && y < 33;
      for (int c = 0; c < 4; ++c) {
        const size_t i = 4 * (static_cast<size_t>(y) * whole.width + x) + c;
        ASSERT_EQ(part.pixels[i], inside ? whole.pixels[i] : 0.0f) << x << " " << y;
      }
    }
}

TEST(SamePicture, after_being_stopped_saved_and_continued) {
  SceneMaker maker = room(64);
  EXPECT_EQ(render_interrupted(maker, 3).pixels, render(maker.transaction()).pixels);
}

TEST(SamePicture, in_every_kernel_profile_that_covers_the_scene) {
  const SceneMaker maker = room(4);
  description::SceneDescription description;
  description::apply(maker.transaction(), description);
  Report report;
  CancelFlag cancel;
  SceneBuilder builder({});
  const Result<std::shared_ptr<const Scene>> scene = builder.build(description, cancel, report);
  ASSERT_TRUE(static_cast<bool>(scene)) << scene.error();
  ASSERT_EQ((*scene)->profile().kernel(), KernelProfile::solid) << "nothing in the room is transparent";
  std::vector<std::vector<float>> pixels;
  for (const KernelProfile profile : {KernelProfile::solid, KernelProfile::surfaces}) {
    IntegratorSettings settings;
    settings.profile = profile;
    FilmSettings film_settings;
    film_settings.width = maker.settings.width;
    film_settings.height = maker.settings.height;
    const Result<std::shared_ptr<Film>> film = Film::create(film_settings);
    const Result<std::unique_ptr<Integrator>> integrator = make_integrator("PT", *scene, settings);
    for (int tile = 0; tile < (*film)->tiles().count(); ++tile) (*integrator)->render_tile(**film, tile, 4, cancel);
    pixels.push_back((*film)->pixels());
  }
  EXPECT_EQ(pixels[0], pixels[1]);
}

/// Mean of the room scaled and moved; the answer should be the same everywhere.
class ScaleAndPlace : public testing::TestWithParam<std::pair<float, float>> {};

TEST_P(ScaleAndPlace, do_not_change_the_picture) {
  const auto [scale, distance] = GetParam();
  SceneMaker maker = room(64);
  const Mean expected = mean(render(maker.transaction()));
  maker.scale_and_move(scale, Vec3(distance, -distance, 0.5f * distance));
  RenderOutcome outcome;
  const Mean found = mean(render(maker.transaction(), 0, &outcome));
  ASSERT_EQ(outcome.status, RenderStatus::finished) << outcome.message;
  EXPECT_EQ(outcome.statistics.non_finite, 0u);
  // The same random numbers follow almost the same paths: 1% covers the few that rounding sends elsewhere.
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.value[c], expected.value[c], 0.01f * expected.value[c]);
}

INSTANTIATE_TEST_SUITE_P(, ScaleAndPlace,
                         testing::Values(std::pair{1e-6f, 0.0f}, std::pair{1e-4f, 0.0f}, std::pair{1e-3f, 0.0f},
                                         std::pair{1e3f, 0.0f}, std::pair{1e6f, 0.0f}, std::pair{1.0f, 1024.0f},
                                         std::pair{1.0f, 65536.0f}, std::pair{1.0f, 1048576.0f},
                                         std::pair{1e3f, 1048576.0f}));

}  // namespace
}  // namespace lambent::test
