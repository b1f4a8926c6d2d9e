#include "engine/assets/texture_system.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <pthread.h>
#include <time.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <thread>

#include "engine/assets/color_space.h"
#include "engine/base/check.h"
#include "engine/base/memory.h"

namespace lambent {
namespace {

using testing::HasSubstr;

class TextureTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("lambent_texture_test_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // Rows from the top, as files have them.
  std::string write(const std::string& name, int width, int height, int channels, const std::vector<uint8_t>& pixels) {
    const std::string path = (folder_ / name).string();
    auto output = OIIO::ImageOutput::create(path);
    OIIO::ImageSpec spec(width, height, channels, OIIO::TypeDesc::UINT8);
    if (channels == 4) spec.attribute("oiio:UnassociatedAlpha", 1);
    EXPECT_TRUE(output && output->open(path, spec) && output->write_image(OIIO::TypeDesc::UINT8, pixels.data()));
    output->close();
    return path;
  }
  TextureHandle load(const std::string& path, const std::string& colorspace = "Non-Color",
                     ImageAlpha alpha = ImageAlpha::straight) {
    ImageSource source;
    source.name = "picture";
    source.path = path;
    source.colorspace = colorspace;
    source.alpha = alpha;
    return textures_.add_image(source, report_);
  }
  Texel at(const TextureHandle& texture, float u, float v,
           TextureInterpolation interpolation = TextureInterpolation::closest,
           TextureExtension extension = TextureExtension::repeat, bool straight = false) {
    TextureLookup lookup;
    lookup.uv = {u, v};
    lookup.interpolation = interpolation;
    lookup.extension = extension;
    lookup.straight_color = straight;
    return textures_.lookup(*texture, lookup);
  }

  std::filesystem::path folder_;
  TextureSystem textures_;
  Report report_;
};

TEST_F(TextureTest, v_zero_is_the_bottom_row) {
  const TextureHandle texture = load(write("a.png", 1, 2, 3, {255, 0, 0, 0, 0, 255}));
  EXPECT_EQ(at(texture, 0.5f, 0.25f).color, Color(0, 0, 1));
  EXPECT_EQ(at(texture, 0.5f, 0.75f).color, Color(1, 0, 0));
}

TEST_F(TextureTest, srgb_is_decoded_and_data_is_not) {
  const std::string path = write("a.png", 1, 1, 3, {128, 128, 128});
  EXPECT_NEAR(at(load(path, "sRGB"), 0.5f, 0.5f).color.x, linear_from_srgb(128 / 255.0f), 1e-6f);
  EXPECT_NEAR(at(load(path, "Non-Color"), 0.5f, 0.5f).color.x, 128 / 255.0f, 1e-6f);
}

TEST_F(TextureTest, linear_interpolation_is_half_way_between_texels) {
  const TextureHandle texture = load(write("a.png", 2, 1, 3, {0, 0, 0, 255, 255, 255}));
  EXPECT_NEAR(at(texture, 0.5f, 0.5f, TextureInterpolation::linear).color.x, 0.5f, 1e-5f);
  EXPECT_NEAR(at(texture, 0.25f, 0.5f, TextureInterpolation::linear).color.x, 0.0f, 1e-5f);
}

TEST_F(TextureTest, cubic_interpolation_keeps_a_constant_and_smooths_a_step) {
  const TextureHandle texture = load(write("a.png", 2, 1, 3, {0, 0, 0, 255, 255, 255}));
  const float middle = at(texture, 0.25f, 0.5f, TextureInterpolation::cubic, TextureExtension::extend).color.x;
  EXPECT_NEAR(middle, 1.0f / 6.0f, 1e-4f);  // B-spline weights 1/6, 4/6, 1/6 on 0, 0, 1
}

TEST_F(TextureTest, extensions_repeat_extend_clip_and_mirror) {
  const TextureHandle texture = load(write("a.png", 2, 1, 3, {0, 0, 0, 255, 255, 255}));
  const auto value = [&](TextureExtension extension, float u) {
    return at(texture, u, 0.5f, TextureInterpolation::closest, extension);
  };
  EXPECT_EQ(value(TextureExtension::repeat, 1.25f).color.x, 0.0f);
  EXPECT_EQ(value(TextureExtension::repeat, -0.25f).color.x, 1.0f);
  EXPECT_EQ(value(TextureExtension::extend, 5.0f).color.x, 1.0f);
  EXPECT_EQ(value(TextureExtension::clip, 1.25f).alpha, 0.0f);
  EXPECT_EQ(value(TextureExtension::mirror, 1.25f).color.x, 1.0f);
}

TEST_F(TextureTest, straight_alpha_is_associated_and_divided_out_when_asked) {
  const TextureHandle texture = load(write("a.png", 1, 1, 4, {200, 100, 50, 51}));
  const Texel premultiplied = at(texture, 0.5f, 0.5f);
  EXPECT_NEAR(premultiplied.alpha, 0.2f, 1e-5f);
  EXPECT_NEAR(premultiplied.color.x, 200 / 255.0f, 1e-5f) << "data keeps its alpha apart";
  const TextureHandle color = load((folder_ / "a.png").string(), "sRGB");
  EXPECT_NEAR(at(color, 0.5f, 0.5f).color.x, linear_from_srgb(40 / 255.0f), 1e-5f);
  EXPECT_NEAR(at(color, 0.5f, 0.5f, TextureInterpolation::closest, TextureExtension::repeat, true).color.x,
              linear_from_srgb(200 / 255.0f), 5e-3f);
}

TEST_F(TextureTest, alpha_modes_none_and_channel_packed_leave_the_colour_alone) {
  const std::string path = write("a.png", 1, 1, 4, {200, 100, 50, 51});
  const Texel none = at(load(path, "sRGB", ImageAlpha::none), 0.5f, 0.5f);
  EXPECT_EQ(none.alpha, 1.0f);
  EXPECT_NEAR(none.color.x, linear_from_srgb(200 / 255.0f), 1e-5f);
  const Texel packed = at(load(path, "sRGB", ImageAlpha::channel_packed), 0.5f, 0.5f);
  EXPECT_NEAR(packed.alpha, 0.2f, 1e-5f);
  EXPECT_NEAR(packed.color.x, linear_from_srgb(200 / 255.0f), 1e-5f);
}

TEST_F(TextureTest, grey_images_have_three_equal_channels) {
  const Color color = at(load(write("a.png", 1, 1, 1, {51})), 0.5f, 0.5f).color;
  EXPECT_NEAR(color.x, 0.2f, 1e-6f);
  EXPECT_EQ(color, Color(color.x));
}

TEST_F(TextureTest, a_missing_file_is_pink_and_named) {
  const TextureHandle texture = load((folder_ / "nothing.png").string());
  EXPECT_EQ(at(texture, 0.1f, 0.2f).color, Color(1, 0, 1));
  EXPECT_EQ(at(texture, 0.1f, 0.2f).alpha, 1.0f);
  ASSERT_EQ(report_.messages().size(), 1u);
  EXPECT_EQ(report_.messages()[0].code, "missing_texture");
  EXPECT_THAT(report_.messages()[0].text, HasSubstr("picture"));
  EXPECT_THAT(report_.messages()[0].text, HasSubstr("nothing.png"));
}

TEST_F(TextureTest, corrupt_and_truncated_files_are_pink_and_named) {
  const std::string good = write("good.png", 64, 64, 3, std::vector<uint8_t>(64 * 64 * 3, 77));
  std::ifstream in(good, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  for (const auto& [name, content] : {std::pair<std::string, std::string>{"garbage.png", "this is not an image"},
                                      {"empty.exr", ""},
                                      {"cut.png", bytes.substr(0, bytes.size() / 2)}}) {
    const std::string path = (folder_ / name).string();
    std::ofstream(path, std::ios::binary) << content;
    const TextureHandle texture = load(path);
    ASSERT_TRUE(texture);
    EXPECT_EQ(at(texture, 0.5f, 0.5f).color, Color(1, 0, 1)) << name;
  }
  EXPECT_EQ(report_.messages().size(), 3u);
}

TEST_F(TextureTest, a_deferred_image_is_read_when_first_asked_for_and_is_the_same_whoever_asks) {
  std::vector<uint8_t> pixels;
  for (int i = 0; i < 500 * 400 * 3; ++i) pixels.push_back(static_cast<uint8_t>((i * 37) >> 3));
  ImageSource source;
  source.path = write("a.png", 500, 400, 3, pixels);
  TextureSystem other;
  const TextureHandle eager = other.add_image(source, report_);
  const TextureHandle deferred = textures_.defer(textures_.reserve(source, report_));
  EXPECT_EQ(textures_.defer(textures_.reserve(source, report_)), deferred);
  EXPECT_EQ(textures_.bytes(), 0u);
  std::vector<std::future<std::vector<Color>>> readers;
  for (int reader = 0; reader < 8; ++reader)
    readers.push_back(std::async(std::launch::async, [&] {
      std::vector<Color> colors;
      for (int i = 0; i < 1000; ++i) {
        TextureLookup lookup;
        lookup.uv = {0.001f * static_cast<float>(i), 0.37f + 0.003f * static_cast<float>(i)};
        colors.push_back(textures_.lookup(*deferred, lookup).color);
      }
      return colors;
    }));
  for (auto& reader : readers) {
    const std::vector<Color> colors = reader.get();
    for (int i = 0; i < 1000; ++i) {
      TextureLookup lookup;
      lookup.uv = {0.001f * static_cast<float>(i), 0.37f + 0.003f * static_cast<float>(i)};
      ASSERT_EQ(colors[static_cast<size_t>(i)], other.lookup(*eager, lookup).color);
    }
  }
  EXPECT_EQ(texture_average(*deferred), texture_average(*eager));
  EXPECT_EQ(textures_.bytes(), other.bytes());
  EXPECT_TRUE(textures_.take_problems().messages().empty());
}

TEST_F(TextureTest, what_is_wrong_with_a_deferred_image_is_pink_and_named_once_it_is_read) {
  const std::string good = write("good.png", 64, 64, 3, std::vector<uint8_t>(64 * 64 * 3, 77));
  std::ifstream in(good, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const std::string path = (folder_ / "cut.png").string();
  std::ofstream(path, std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  ImageSource source;
  source.name = "picture";
  source.path = path;
  const TextureHandle cut = textures_.defer(textures_.reserve(source, report_));
  source.path = good;
  const TextureHandle changed = textures_.defer(textures_.reserve(source, report_));
  write("good.png", 32, 64, 3, std::vector<uint8_t>(32 * 64 * 3, 77));
  // OpenImageIO 3 sees by the header that the file is cut, older ones when its pixels are read.
  std::vector<Message> messages = report_.messages();
  EXPECT_EQ(texture_problem(*cut).message.empty(), messages.empty());
  EXPECT_EQ(at(cut, 0.5f, 0.5f).color, Color(1, 0, 1));
  EXPECT_EQ(at(changed, 0.5f, 0.5f).color, Color(1, 0, 1));
  for (const Message& message : textures_.take_problems().messages()) messages.push_back(message);
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_THAT(messages[0].text, HasSubstr("Image 'picture'"));
  EXPECT_THAT(messages[0].text, HasSubstr("cut.png"));
  EXPECT_THAT(messages[1].text, HasSubstr("changed while it was in use"));
  EXPECT_EQ(texture_problem(*cut).message, messages[0].text);
  EXPECT_TRUE(textures_.take_problems().messages().empty());
  EXPECT_EQ(textures_.bytes(), 0u);
}

TEST_F(TextureTest, packed_bytes_give_what_the_file_gives) {
  const std::string path = write("a.png", 1, 2, 3, {255, 0, 0, 0, 0, 255});
  std::ifstream in(path, std::ios::binary);
  const std::vector<uint8_t> bytes((std::istreambuf_iterator<char>(in)), {});
  ImageSource source;
  source.name = "packed";
  source.encoded = bytes;
  source.extension = ".png";
  source.content_hash = "of these bytes";
  source.colorspace = "Non-Color";
  const TextureHandle texture = textures_.add_image(source, report_);
  EXPECT_EQ(at(texture, 0.5f, 0.25f).color, Color(0, 0, 1));
  EXPECT_TRUE(report_.messages().empty());
}

TEST_F(TextureTest, float_pixels_keep_their_range_and_lose_nan) {
  const float pixels[] = {7.5f, 0.25f, -1.0f, std::numeric_limits<float>::quiet_NaN(), 1.0f, k_infinity};
  ImageSource source;
  source.name = "generated";
  source.pixels = pixels;
  source.width = 2, source.height = 1, source.channels = 3;
  const TextureHandle texture = textures_.add_image(source, report_);
  EXPECT_EQ(at(texture, 0.25f, 0.5f).color, Color(7.5f, 0.25f, -1.0f));
  EXPECT_EQ(at(texture, 0.75f, 0.5f).color, Color(0.0f, 1.0f, 0.0f));
}

TEST_F(TextureTest, the_same_file_is_loaded_once_and_freed_with_its_last_handle) {
  const std::string path = write("a.png", 64, 64, 3, std::vector<uint8_t>(64 * 64 * 3, 9));
  TextureHandle first = load(path), second = load(path);
  EXPECT_EQ(first, second);
  EXPECT_EQ(textures_.bytes(), 64u * 64 * 3);
  first.reset();
  second.reset();
  EXPECT_EQ(textures_.bytes(), 0u);
}

TEST_F(TextureTest, coordinates_that_are_not_finite_or_huge_are_harmless) {
  const TextureHandle texture = load(write("a.png", 2, 2, 3, std::vector<uint8_t>(12, 255)));
  for (const float u : {std::numeric_limits<float>::quiet_NaN(), k_infinity, 1e30f, -1e30f})
    for (const auto interpolation :
         {TextureInterpolation::closest, TextureInterpolation::linear, TextureInterpolation::cubic})
      EXPECT_NEAR(at(texture, u, 0.5f, interpolation).color.x, 1.0f, 1e-5f);
}

TEST_F(TextureTest, an_image_over_the_memory_limit_goes_through_the_tile_cache_and_stays_within_it) {
  constexpr int k_size = 6000;
  std::vector<uint8_t> pixels(static_cast<size_t>(k_size) * k_size * 3);
  for (int y = 0; y < k_size; ++y)
    for (int x = 0; x < k_size; ++x) {
      uint8_t* p = pixels.data() + (static_cast<size_t>(y) * k_size + x) * 3;
      p[0] = static_cast<uint8_t>(255 * x / k_size), p[1] = static_cast<uint8_t>(255 * (k_size - 1 - y) / k_size),
      p[2] = 40;
    }
  const std::string path = write("large.tif", k_size, k_size, 3, pixels);
  TextureSystem::Options options;
  options.memory_limit_bytes = size_t{64} << 20;
  const TextureSystem small(options);
  ImageSource source;
  source.name = "large";
  source.path = path;
  source.colorspace = "Non-Color";
  const TextureHandle texture = const_cast<TextureSystem&>(small).add_image(source, report_);
  EXPECT_TRUE(report_.messages().empty());
  for (int i = 0; i < 400; ++i) {
    TextureLookup lookup;
    lookup.uv = {static_cast<float>(i % 20) / 20 + 0.02f, static_cast<float>(i / 20) / 20 + 0.02f};
    const Texel texel = small.lookup(*texture, lookup);
    EXPECT_NEAR(texel.color.x, lookup.uv.x, 0.006f);
    EXPECT_NEAR(texel.color.y, lookup.uv.y, 0.006f);
    lookup.duvdx = {0.02f, 0};  // of 120 texels: harmless where the file has no coarser level
    EXPECT_NEAR(small.lookup(*texture, lookup).color.x, lookup.uv.x, 0.02f);
  }
  EXPECT_LT(small.bytes(), size_t{64} << 20);
}

/// A grey ramp from left to right of the size that artists call 16k; a few MB as a file, 256 MB decoded.
class LargeTextureTest : public TextureTest {
 protected:
  static constexpr int k_size = 16384;

  void SetUp() override {
    TextureTest::SetUp();
    path_ = (folder_ / "large.png").string();
    auto output = OIIO::ImageOutput::create(path_);
    OIIO::ImageSpec spec(k_size, k_size, 1, OIIO::TypeDesc::UINT8);
    spec.attribute("png:compressionLevel", 1);
    ASSERT_TRUE(output && output->open(path_, spec));
    std::vector<uint8_t> row(k_size);
    for (int x = 0; x < k_size; ++x) row[x] = static_cast<uint8_t>(x / 64);
    for (int y = 0; y < k_size; ++y) ASSERT_TRUE(output->write_scanline(y, 0, OIIO::TypeDesc::UINT8, row.data()));
    ASSERT_TRUE(output->close());
  }
  ImageSource source() const {
    ImageSource result;
    result.name = "large";
    result.path = path_;
    result.colorspace = "Non-Color";
    return result;
  }

  std::string path_;
};

TEST_F(LargeTextureTest, one_that_exceeds_the_memory_limit_is_kept_smaller_with_a_warning) {
  constexpr size_t k_limit = size_t{128} << 20;
  TextureSystem::Options options;
  options.memory_limit_bytes = k_limit;
  TextureSystem small(options);
  const size_t before = peak_resident_bytes();
  const TextureHandle texture = small.add_image(source(), report_);
  EXPECT_LT(small.bytes(), k_limit);
  EXPECT_LT(peak_resident_bytes(), before + k_limit) << "while loading too";
  EXPECT_EQ(texture_size(*texture).width, k_size / 2);
  ASSERT_EQ(report_.messages().size(), 1u);
  EXPECT_EQ(report_.messages()[0].severity, Severity::warning);
  EXPECT_THAT(report_.messages()[0].text, HasSubstr("large.png' of 16384 x 16384 pixels"));
  EXPECT_THAT(report_.messages()[0].text, HasSubstr("used at 8192 x 8192"));
  for (int i = 0; i < 64; ++i) {
    TextureLookup lookup;
    lookup.uv = {(i + 0.5f) / 64, 0.3f};
    EXPECT_NEAR(small.lookup(*texture, lookup).color.x, (4 * i + 1.5f) / 255, 0.6f / 255);
  }
}

TEST_F(LargeTextureTest, cancelling_takes_effect_within_100_ms_of_decoding) {
  CancelFlag cancel;
  clockid_t clock;
  std::promise<void> started;
  double at_end_s = 0.0;
  TextureHandle texture;
  const auto seconds = [](clockid_t of) {
    timespec time{};
    clock_gettime(of, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  std::thread loader([&] {
    pthread_getcpuclockid(pthread_self(), &clock);
    started.set_value();
    texture = textures_.load(textures_.reserve(source(), report_), report_, cancel);
    at_end_s = seconds(CLOCK_THREAD_CPUTIME_ID);
  });
  started.get_future().wait();
  // By the loader's own clock, which other programs do not stretch
  while (seconds(clock) < 0.05) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  cancel.cancel();
  const double at_cancel_s = seconds(clock);
  loader.join();
  EXPECT_EQ(texture, nullptr) << "decoding the whole takes several times 50 ms";
  EXPECT_LT(at_end_s - at_cancel_s, 0.1);
  EXPECT_EQ(textures_.bytes(), 0u);
}

TEST_F(LargeTextureTest, a_thread_that_waits_for_a_deferred_image_is_interrupted_and_the_next_one_gets_it) {
  const TextureHandle texture = textures_.defer(textures_.reserve(source(), report_));
  TextureLookup lookup;
  lookup.uv = {0.7f, 0.3f};
  for (int threads = 1; threads <= 2; ++threads) {
    CancelFlag cancel;
    std::vector<std::future<bool>> interrupted;
    for (int i = 0; i < threads; ++i)
      interrupted.push_back(std::async(std::launch::async, [&] {
        const Interruptible interruptible(cancel);
        textures_.lookup(*texture, lookup);
        return render_context().interrupted;
      }));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    cancel.cancel();
    for (auto& one : interrupted) EXPECT_TRUE(one.get()) << "decoding the whole takes several times 20 ms";
    EXPECT_EQ(textures_.bytes(), 0u);
  }
  EXPECT_NEAR(textures_.lookup(*texture, lookup).color.x, 0.7f, 0.01f);
  EXPECT_FALSE(render_context().interrupted);
}

TEST_F(TextureTest, which_image_is_kept_smaller_follows_from_the_order_of_reservations) {
  TextureSystem::Options options;
  options.memory_limit_bytes = (size_t{32} << 20) + 1500 * 1500 * 3;
  TextureSystem small(options);
  std::vector<PendingTexture> reserved;
  for (const char* name : {"a.png", "b.png"}) {
    ImageSource source;
    source.path = write(name, 1000, 1500, 3, std::vector<uint8_t>(1000 * 1500 * 3, 9));
    reserved.push_back(small.reserve(source, report_));
  }
  const TextureHandle second = small.load(std::move(reserved[1]), report_, CancelFlag());
  const TextureHandle first = small.load(std::move(reserved[0]), report_, CancelFlag());
  EXPECT_EQ(texture_size(*first).height, 1500);
  EXPECT_EQ(texture_size(*second).height, 750);
}

}  // namespace
}  // namespace lambent
