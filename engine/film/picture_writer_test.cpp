#include "engine/film/picture_writer.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

namespace lambent {
namespace {

using testing::HasSubstr;

class PictureWriter : public testing::Test {
 protected:
  PictureWriter() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              ("lambent_picture_" + std::string(test->name()) + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    // 4 x 3, combined and depth: combined.R is x, G is y from the bottom, B is 2, A is 1; depth is 10 x + y.
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 4; ++x)
        for (const float value : {float(x), float(y), 2.0f, 1.0f, 10.0f * x + y}) pixels_.push_back(value);
    view_.width = 4;
    view_.height = 3;
    view_.rendered = {0, 0, 4, 3};
    view_.channels = channels_;
    view_.pixels = pixels_;
    view_.metadata = {{"Samples", "16"}};
  }
  ~PictureWriter() override { std::filesystem::remove_all(folder_); }
  std::string path(const char* name) const { return folder_ / name; }
  size_t file_count() const { return std::distance(std::filesystem::directory_iterator(folder_), {}); }

  std::filesystem::path folder_;
  std::vector<Channel> channels_{{"combined", 4}, {"depth", 1, "Z"}};
  std::vector<float> pixels_;
  PictureView view_;
};

TEST_F(PictureWriter, exr_holds_every_channel_bit_for_bit_and_the_metadata) {
  ASSERT_TRUE(write_picture(path("a.exr"), view_));
  auto input = OIIO::ImageInput::open(path("a.exr"));
  ASSERT_TRUE(input);
  const OIIO::ImageSpec& spec = input->spec();
  EXPECT_EQ(spec.get_string_attribute("Samples"), "16");
  std::vector<float> read(4 * 3 * 5);
  ASSERT_TRUE(input->read_image(0, 0, 0, 5, OIIO::TypeDesc::FLOAT, read.data()));
  const std::vector<std::string> names{"R", "G", "B", "A", "depth.Z"};
  for (int channel = 0; channel < 5; ++channel) {
    const int at = spec.channelindex(names[channel]);
    ASSERT_GE(at, 0) << names[channel];
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 4; ++x)
        EXPECT_EQ(read[((2 - y) * 4 + x) * 5 + at], pixels_[(y * 4 + x) * 5 + channel]) << names[channel] << x << y;
  }
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(PictureWriter, half_is_for_colours_alone) {
  channels_.push_back({"light", 3, "RGB"});
  channels_.push_back({"crypto", 4, "rgba"});
  std::vector<float> pixels;
  for (int i = 0; i < 12; ++i) {
    pixels.insert(pixels.end(), pixels_.begin() + 5 * i, pixels_.begin() + 5 * i + 5);
    for (const float value : {1e9f, 1.0f / 3.0f, -1e9f, 1e9f, 1.0f / 3.0f, 2.0f, 3.0f}) pixels.push_back(value);
  }
  view_.channels = channels_;
  view_.pixels = pixels;
  view_.half_colors = true;
  view_.rendered = {1, 0, 3, 2};
  ASSERT_TRUE(write_picture(path("a.exr"), view_));
  auto input = OIIO::ImageInput::open(path("a.exr"));
  ASSERT_TRUE(input);
  const OIIO::ImageSpec& spec = input->spec();
  std::vector<float> read(3 * 2 * 12);
  ASSERT_TRUE(input->read_image(0, 0, 0, 12, OIIO::TypeDesc::FLOAT, read.data()));
  const auto at = [&](const char* name, int x, int y) {
    const int channel = spec.channelindex(name);
    EXPECT_GE(channel, 0) << name;
    return read[static_cast<size_t>(((1 - y) * 3 + x - 1) * 12 + channel)];
  };
  for (const char* name : {"R", "A", "light.G"})
    EXPECT_EQ(spec.channelformat(spec.channelindex(name)), OIIO::TypeDesc::HALF) << name;
  for (const char* name : {"depth.Z", "crypto.r", "crypto.a"})
    EXPECT_EQ(spec.channelformat(spec.channelindex(name)), OIIO::TypeDesc::FLOAT) << name;
  for (int y = 0; y < 2; ++y)
    for (int x = 1; x < 4; ++x) {
      EXPECT_EQ(at("R", x, y), float(x));
      EXPECT_EQ(at("G", x, y), float(y));
      EXPECT_EQ(at("depth.Z", x, y), 10.0f * x + y);
      EXPECT_EQ(at("light.R", x, y), 65504.0f);
      EXPECT_NEAR(at("light.G", x, y), 1.0f / 3.0f, 2e-4f);
      EXPECT_EQ(at("light.B", x, y), -65504.0f);
      EXPECT_EQ(at("crypto.g", x, y), 1.0f / 3.0f);
    }
}

TEST_F(PictureWriter, exr_of_a_region_has_the_region_as_data_window) {
  view_.rendered = {1, 0, 2, 1};  // the bottom row
  ASSERT_TRUE(write_picture(path("a.exr"), view_));
  auto input = OIIO::ImageInput::open(path("a.exr"));
  ASSERT_TRUE(input);
  const OIIO::ImageSpec& spec = input->spec();
  EXPECT_EQ(spec.x, 1);
  EXPECT_EQ(spec.y, 2);
  EXPECT_EQ(spec.width, 2);
  EXPECT_EQ(spec.height, 1);
  EXPECT_EQ(spec.full_width, 4);
  EXPECT_EQ(spec.full_height, 3);
  std::vector<float> read(2 * 5);
  ASSERT_TRUE(input->read_image(0, 0, 0, 5, OIIO::TypeDesc::FLOAT, read.data()));
  EXPECT_EQ(read[spec.channelindex("R")], 1.0f);
  EXPECT_EQ(read[5 + spec.channelindex("R")], 2.0f);
}

TEST_F(PictureWriter, png_is_srgb_with_straight_alpha) {
  const Channel combined{"combined", 4};
  const float pixel[] = {0.107f, 0.0f, 0.5f, 0.5f};  // straight: 0.214, 0, 1
  view_ = {1, 1, {0, 0, 1, 1}, {&combined, 1}, pixel, {}};
  ASSERT_TRUE(write_picture(path("a.PNG"), view_));
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  auto input = OIIO::ImageInput::open(path("a.PNG"), &config);
  ASSERT_TRUE(input);
  uint8_t read[4];
  ASSERT_TRUE(input->read_image(0, 0, 0, 4, OIIO::TypeDesc::UINT8, read));
  EXPECT_NEAR(read[0], 127, 1);  // sRGB of 0.214
  EXPECT_EQ(read[1], 0);
  EXPECT_EQ(read[2], 255);
  EXPECT_EQ(read[3], 128);
}

TEST_F(PictureWriter, a_full_disk_is_an_error_that_names_the_file_and_leaves_no_half) {
  // A limit on the size of files fails a write in its middle, as a full disk does.
  std::ofstream(path("a.exr")) << "old";
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 100;
  ::setrlimit(RLIMIT_FSIZE, &small);
  const Status written = write_picture(path("a.exr"), view_);
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error(), HasSubstr("a.exr"));
  EXPECT_EQ(file_count(), 1u);
  EXPECT_EQ(std::filesystem::file_size(path("a.exr")), 3u);
}

TEST_F(PictureWriter, what_cannot_be_written_is_refused_by_name) {
  EXPECT_THAT(write_picture(path("a.tga"), view_).error(), HasSubstr("a.tga"));
  EXPECT_THAT(write_picture(path("no/such/a.exr"), view_).error(), HasSubstr("no/such/a.exr"));
  view_.rendered = {0, 0, 5, 3};
  EXPECT_FALSE(write_picture(path("a.exr"), view_));
}

}  // namespace
}  // namespace lambent
