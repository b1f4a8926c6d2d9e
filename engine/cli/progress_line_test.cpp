#include "engine/cli/progress_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace lambent {
namespace {

using testing::HasSubstr;

TEST(ProgressLine, times_and_sizes_are_written_for_people) {
  EXPECT_EQ(clock_text(0), "00:00");
  EXPECT_EQ(clock_text(65.4), "01:05");
  EXPECT_EQ(clock_text(3723), "1:02:03");
  EXPECT_EQ(clock_text(-1), "--:--");
  EXPECT_EQ(memory_text(size_t(512) << 20), "512.00M");
  EXPECT_EQ(memory_text(size_t(3) << 29), "1.50G");
}

TEST(ProgressLine, shows_a_bar_and_never_exceeds_the_width) {
  Progress progress;
  progress.stage = Stage::rendering;
  progress.samples = 32;
  progress.samples_total = 128;
  progress.tiles = 3;
  progress.tiles_total = 60;
  progress.elapsed_s = 10;
  progress.remaining_s = 30;
  const std::string text = progress_text(progress, 1 << 20, 120);
  EXPECT_THAT(text, HasSubstr(" 25% Sample 32/128, Tile 3/60 | 00:10 elapsed, 00:30 remaining | Mem:1.00M"));
  for (int width = 21; width < 140; ++width)
    EXPECT_LT(static_cast<int>(progress_text(progress, 1 << 20, width).size()), width);
}

TEST(ProgressLine, an_unlimited_render_has_no_bar) {
  Progress progress;
  progress.stage = Stage::rendering;
  progress.samples = 7;
  EXPECT_THAT(progress_text(progress, 0, 120), testing::StartsWith("Sample 7, Tile"));
}

}  // namespace
}  // namespace lambent
