// The saved scenes under tests/scenes render as Blender's add-on meant them.
#include <gtest/gtest.h>

#include <filesystem>

#include "engine/description/scene_file.h"
#include "tests/common/scene_maker.h"

namespace lambent::test {
namespace {

/// The scene of tests/scenes/`name`.lambent as one transaction, `width` px wide with `samples` samples.
description::Transaction saved_scene(const std::string& name, int width, int64_t samples, Report& report) {
  const std::filesystem::path path =
      std::filesystem::path(LAMBENT_SOURCE_DIR) / "tests" / "scenes" / (name + ".lambent");
  const auto scene = description::load_scene_file(path.string(), report);
  EXPECT_TRUE(static_cast<bool>(scene)) << scene.error();
  description::Transaction transaction;
  transaction.epoch = 1;
  const auto add = [&](const auto& table) {
    for (const auto& [id, value] : table) transaction.edits.push_back(description::Upsert{id, *value});
  };
  add(scene->meshes);
  add(scene->images);
  add(scene->materials);
  add(scene->lights);
  add(scene->objects);
  add(scene->cameras);
  add(scene->worlds);
  description::Settings settings = *scene->settings;
  settings.height = settings.height * width / settings.width;
  settings.width = width;
  settings.samples = samples;
  transaction.edits.push_back(description::Upsert{"render", settings});
  return transaction;
}

TEST(SavedScene, every_one_loads_and_renders_without_a_warning) {
  for (const char* name : {"cornell", "lights", "furnace"}) {
    Report report;
    const description::Transaction transaction = saved_scene(name, 64, 8, report);
    RenderOutcome outcome;
    const Picture picture = render(transaction, 0, &outcome, &report);
    ASSERT_EQ(outcome.status, RenderStatus::finished) << name << ": " << outcome.message;
    EXPECT_EQ(outcome.statistics.non_finite, 0u) << name;
    EXPECT_GT(mean(picture).value.y, 0.01f) << name;
    for (const Message& message : report.messages()) EXPECT_EQ(message.severity, Severity::info) << message.text;
  }
}

}  // namespace
}  // namespace lambent::test
