// Images are read when a visible point asks, which changes nothing but when that happens.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <thread>

#include "tests/common/scene_maker.h"

namespace lambent::test {
namespace {

using description::Link;

/// A PPM of size x size pixels, the last `missing` bytes of which are not there.
description::Image image_of(int size, size_t missing = 0) {
  std::string bytes = "P6\n" + std::to_string(size) + " " + std::to_string(size) + "\n255\n";
  const size_t header = bytes.size(), count = static_cast<size_t>(size) * static_cast<size_t>(size) * 3;
  bytes.resize(header + count);
  for (size_t i = 0; i < count; ++i) bytes[header + i] = static_cast<char>((i * 7) >> 4);
  bytes.resize(bytes.size() - missing);
  description::Image image;
  image.encoded = make_array(ElementType::u8, {bytes.size()}, bytes.data());
  image.extension = ".ppm";
  image.colorspace = "Non-Color";
  return image;
}

description::Graph shows(const std::string& image) {
  description::Graph graph = diffuse(Color(0.8f));
  graph.nodes.push_back({"Texture", "TexImage", {}, {{"image", image}}, {}, {}});
  graph.nodes.push_back({"Coordinates", "TexCoord", {}, {}, {}, {}});
  graph.nodes[1].inputs["Vector"] = Link{2, "Object"};
  graph.nodes[0].inputs["Color"] = Link{1, "Color"};
  return graph;
}

/// A sheet in front of the camera with image "seen", and one behind it with "hidden", under an even sky.
SceneMaker two_sheets(int samples) {
  SceneMaker maker(24, 24, samples);
  maker.material("seen", shows("seen")).material("hidden", shows("hidden"));
  for (const float z : {-2.0f, 2.0f})
    maker.mesh(z < 0 ? "front" : "back", {{-9, -9, z}, {9, -9, z}, {9, 9, z}, {-9, 9, z}}, {{0, 1, 2}, {0, 2, 3}},
               z < 0 ? "seen" : "hidden");
  maker.world(background(Color(1.0f)));
  return maker;
}

description::Transaction with_images(const SceneMaker& maker, description::Image seen, description::Image hidden) {
  description::Transaction transaction = maker.transaction();
  seen.name = "seen picture";
  hidden.name = "hidden picture";
  transaction.edits.push_back(description::Upsert{"seen", std::move(seen)});
  transaction.edits.push_back(description::Upsert{"hidden", std::move(hidden)});
  return transaction;
}

TEST(DeferredImages, only_what_a_ray_meets_is_decoded) {
  SceneMaker maker = two_sheets(1);
  RenderOutcome outcome;
  maker.settings.max_bounces = maker.settings.diffuse_bounces = 0;
  render(with_images(maker, image_of(256), image_of(512)), 0, &outcome);
  EXPECT_EQ(outcome.statistics.memory.textures, size_t{256 * 256 * 3});
  maker.settings.max_bounces = maker.settings.diffuse_bounces = 2;
  render(with_images(maker, image_of(256), image_of(512)), 0, &outcome);
  EXPECT_EQ(outcome.statistics.memory.textures, size_t{(256 * 256 + 512 * 512) * 3});
}

TEST(DeferredImages, one_that_breaks_while_rendering_is_pink_and_named_in_this_and_the_next_render) {
  SceneMaker maker = two_sheets(4);
  maker.settings.max_bounces = maker.settings.diffuse_bounces = 0;
  std::vector<Message> messages;
  SessionEvents events;
  events.report = [&](int64_t, const Report& report) {
    for (const Message& message : report.messages()) messages.push_back(message);
  };
  Session session(Engine::create({}), events);
  session.apply(with_images(maker, image_of(256, 10000), image_of(512)));
  for (int64_t epoch = 1; epoch <= 2; ++epoch) {
    messages.clear();
    session.start(epoch);
    session.wait();
    ASSERT_EQ(messages.size(), 1u) << "render " << epoch;
    EXPECT_EQ(messages[0].code, "corrupt_texture");
    EXPECT_NE(messages[0].text.find("Image 'seen picture'"), std::string::npos) << messages[0].text;
    const Color seen = mean(session.picture()).value;
    EXPECT_GT(seen.x, 0.1f);
    EXPECT_EQ(seen.y, 0.0f);
  }
}

TEST(DeferredImages, a_render_cancelled_while_an_image_is_decoded_continues_to_the_same_picture) {
  const description::Image large = image_of(5000), small = image_of(64);
  const std::string path = testing::TempDir() + "lambent_deferred_" + std::to_string(getpid()) + ".checkpoint";
  for (const char* integrator : {"PT", "VCM"}) {
    SceneMaker maker = two_sheets(3);
    maker.settings.integrator = integrator;
    maker.settings.max_bounces = maker.settings.diffuse_bounces = 3;
    const description::Transaction transaction = with_images(maker, large, small);
    const Picture whole = render(transaction);
    const auto engine = Engine::create({});
    for (const int wait_ms : {2, 10, 30}) {
      RenderOutcome outcome;
      SessionEvents events;
      events.done = [&](const RenderOutcome& done) { outcome = done; };
      Session first(engine, events), second(engine, events);
      first.apply(transaction);
      first.start(1);
      while (first.progress().stage != Stage::rendering && first.progress().stage != Stage::idle)
        std::this_thread::sleep_for(std::chrono::microseconds(200));
      std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
      first.cancel();
      first.wait();
      if (outcome.status == RenderStatus::finished) continue;
      const Status saved = first.save_checkpoint(path);
      ASSERT_TRUE(static_cast<bool>(saved)) << saved.error();
      second.apply(transaction);
      second.load_checkpoint(path);
      second.start(1);
      second.wait();
      ASSERT_EQ(outcome.status, RenderStatus::finished) << outcome.message;
      EXPECT_TRUE(second.picture().pixels == whole.pixels) << integrator << " stopped after " << wait_ms << " ms";
      std::filesystem::remove(path);
    }
  }
}

}  // namespace
}  // namespace lambent::test
