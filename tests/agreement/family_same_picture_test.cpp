// What must not change a picture of the bidirectional family: threads, tiles, pauses, kernels, scale and place.
#include <gtest/gtest.h>

#include "tests/agreement/batches.h"
#include "tests/common/direct_render.h"

namespace lambent::test {
namespace {

class FamilySamePicture : public testing::TestWithParam<const char*> {
 public:
  SceneMaker room_for(int64_t samples) const {
    SceneMaker maker = room(samples);
    maker.settings.integrator = GetParam();
    maker.settings.max_bounces = 6;
    return maker;
  }
};

TEST_P(FamilySamePicture, whatever_the_number_of_threads_and_the_size_of_tiles) {
  SceneMaker maker = room_for(3);
  maker.settings.tile_size_px = 16;
  const Picture reference = render(maker.transaction(), 1);
  ASSERT_GT(mean(reference).value.x, 0.001f);
  for (const auto& [threads, tile] : {std::pair{2, 8}, {3, 16}, {8, 13}, {4, 64}}) {
    maker.settings.tile_size_px = tile;
    EXPECT_EQ(render(maker.transaction(), threads).pixels, reference.pixels) << threads << " threads, tile " << tile;
  }
}

TEST_P(FamilySamePicture, after_being_stopped_saved_and_continued) {
  SceneMaker maker = room_for(24);
  EXPECT_EQ(render_interrupted(maker, 3).pixels, render(maker.transaction()).pixels);
}

TEST_P(FamilySamePicture, after_being_continued_with_pixels_that_stop_where_samples_and_splats_are_quiet) {
  if (std::string_view(GetParam()) == "LT") return;  // all is splats there: pixels stop together or not at all
  SceneMaker maker = room_for(256);
  maker.settings.noise_threshold = 0.4f;
  RenderOutcome outcome;
  const Picture whole = render(maker.transaction(), 0, &outcome);
  EXPECT_LT(outcome.statistics.paths, 256u * 48 * 40) << "some pixels stopped";
  EXPECT_EQ(render_interrupted(maker, 20).pixels, whole.pixels);
}

TEST_P(FamilySamePicture, in_every_kernel_profile_that_covers_the_scene) {
  const std::shared_ptr<const Scene> scene = build_scene(room_for(2));
  ASSERT_EQ(scene->profile().kernel(), KernelProfile::solid) << "nothing in the room is transparent";
  EXPECT_EQ(render_directly(GetParam(), scene, {}, 2, KernelProfile::solid)->pixels(),
            render_directly(GetParam(), scene, {}, 2, KernelProfile::surfaces)->pixels());
}

INSTANTIATE_TEST_SUITE_P(, FamilySamePicture, testing::Values("LT", "VPL", "BPT", "PPM", "BPM", "VCM"),
                         [](const testing::TestParamInfo<const char*>& one) { return std::string(one.param); });

/// A scene scaled and moved gives the same expectations, and equal seeds mostly the same paths.
class FamilyScaleAndPlace : public testing::TestWithParam<const char*> {};

TEST_P(FamilyScaleAndPlace, do_not_change_the_picture) {
  constexpr int k_batches = 8;
  const std::pair<float, float> places[] = {{1e-6f, 0.0f}, {1e-4f, 0.0f},    {1e-2f, 0.0f},     {1e3f, 0.0f},
                                            {1e6f, 0.0f},  {1.0f, 65536.0f}, {1.0f, 1048576.0f}};
  SceneMaker maker = room(1);
  maker.settings.max_bounces = 5;
  const BatchMeans reference = render_batches(maker, GetParam(), k_batches, 50);
  for (const auto& [scale, distance] : places) {
    SceneMaker placed = maker;
    placed.scale_and_move(scale, Vec3(distance, -distance, 0.5f * distance));
    expect_same(
        render_batches(placed, GetParam(), k_batches, 50), reference,
        static_cast<int>(4 * std::size(places) * reference.names.size()),
        std::string(GetParam()) + " at scale " + std::to_string(scale) + " and distance " + std::to_string(distance));
  }
}

INSTANTIATE_TEST_SUITE_P(, FamilyScaleAndPlace, testing::Values("LT", "BPT", "PPM", "VCM"),
                         [](const testing::TestParamInfo<const char*>& one) { return std::string(one.param); });

}  // namespace
}  // namespace lambent::test
