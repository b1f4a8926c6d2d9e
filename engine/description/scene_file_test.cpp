#include "engine/description/scene_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "engine/description/frame.h"
#include "engine/description/test_values.h"

namespace lambent::description {
namespace {

using testing::HasSubstr;

class SceneFile : public testing::Test {
 protected:
  SceneFile() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              ("lambent_scene_file_" + std::string(test->name()) + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    path_ = folder_ / "scene.lambent";
  }
  ~SceneFile() override { std::filesystem::remove_all(folder_); }

  static SceneDescription full_scene() {
    SceneDescription scene;
    apply(full_transaction(), scene);
    return scene;
  }
  std::string content() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void write(const std::string& bytes) const { std::ofstream(path_, std::ios::binary) << bytes; }

  std::filesystem::path folder_, path_;
};

TEST_F(SceneFile, holds_the_whole_scene) {
  const SceneDescription scene = full_scene();
  const auto bytes = save_scene_file(path_, scene, "a test");
  ASSERT_TRUE(bytes) << bytes.error();
  EXPECT_EQ(*bytes, std::filesystem::file_size(path_));
  Report report;
  const auto loaded = load_scene_file(path_, report);
  ASSERT_TRUE(loaded) << loaded.error();
  EXPECT_TRUE(report.messages().empty());
  ArrayCollector before, after;
  EXPECT_EQ(encode_scene(*loaded, after), encode_scene(scene, before));
  ASSERT_EQ(after.arrays().size(), before.arrays().size());
  for (size_t i = 0; i < after.arrays().size(); ++i)
    EXPECT_EQ(array_hash(after.arrays()[i]->type, after.arrays()[i]->shape, after.arrays()[i]->data),
              before.arrays()[i]->hash);
}

TEST_F(SceneFile, arrays_larger_than_a_group_travel_in_several_frames) {
  SceneDescription scene;
  Mesh mesh;
  std::vector<float> positions(3 * 9'000'000);
  for (size_t i = 0; i < positions.size(); ++i) positions[i] = float(i % 1000);
  mesh.positions = array_of(ElementType::f32, {9'000'000, 3}, positions);
  mesh.triangles = array_of<uint32_t>(ElementType::u32, {1, 3}, {0, 1, 2});
  scene.meshes["m"] = std::make_shared<const Mesh>(mesh);
  ASSERT_TRUE(save_scene_file(path_, scene, "a test"));
  Report report;
  const auto loaded = load_scene_file(path_, report);
  ASSERT_TRUE(loaded) << loaded.error();
  EXPECT_EQ(loaded->meshes.at("m")->positions->hash, mesh.positions->hash);
  const auto limited = load_scene_file(path_, report, {1 << 20});
  ASSERT_FALSE(limited);
  EXPECT_THAT(limited.error(), HasSubstr("allowed"));
}

TEST_F(SceneFile, datablocks_beyond_the_limit_of_a_frame_travel_in_several_transactions) {
  SceneDescription scene = full_scene();
  constexpr int k_lights = 3000;
  for (int i = 0; i < k_lights; ++i) {
    Light light;
    light.name = std::to_string(i) + std::string(50'000, 'x');
    scene.lights["light " + std::to_string(i)] = std::make_shared<const Light>(light);
  }
  ASSERT_GT(k_lights * 50'000, int(2 * k_max_header_bytes));
  const auto bytes = save_scene_file(path_, scene, "a test");
  ASSERT_TRUE(bytes) << bytes.error();
  Report report;
  const auto loaded = load_scene_file(path_, report);
  ASSERT_TRUE(loaded) << loaded.error();
  ArrayCollector before, after;
  EXPECT_TRUE(encode_scene(*loaded, after) == encode_scene(scene, before));

  std::filesystem::resize_file(path_, *bytes - 100);
  EXPECT_FALSE(load_scene_file(path_, report)) << "the last transaction is not missed unseen";
}

TEST_F(SceneFile, a_failed_save_names_the_file_and_leaves_the_old_one_and_nothing_else) {
  write("old");
  const auto missing = save_scene_file(folder_ / "no" / "such.lambent", {}, "a test");
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error(), HasSubstr("such.lambent"));
  const auto full = save_scene_file("/dev/full/x.lambent", {}, "a test");
  EXPECT_FALSE(full);
  EXPECT_EQ(content(), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
}

TEST_F(SceneFile, damaged_files_are_refused_with_their_name) {
  ASSERT_TRUE(save_scene_file(path_, full_scene(), "a test"));
  const std::string good = content();
  Report report;
  for (const size_t length : {size_t(0), size_t(5), size_t(24), size_t(60), good.size() / 2, good.size() - 1}) {
    write(good.substr(0, length));
    const auto loaded = load_scene_file(path_, report);
    ASSERT_FALSE(loaded) << length;
    EXPECT_THAT(loaded.error(), HasSubstr(path_.string()));
  }
  std::mt19937 random(7);
  for (int round = 0; round < 300; ++round) {
    std::string bytes = good;
    bytes[random() % bytes.size()] ^= static_cast<char>(1u << (random() % 8));
    write(bytes);
    const auto loaded = load_scene_file(path_, report);  // may be accepted (a changed name); must not crash
    if (!loaded) {
      EXPECT_THAT(loaded.error(), HasSubstr(path_.string()));
    }
  }
}

TEST_F(SceneFile, a_payload_that_claims_more_than_the_limit_is_not_allocated) {
  const std::string start = encode_frame_start({{"type", "scene_file"}, {"protocol", 1}});
  write(start +
        encode_frame_start({{"type", "arrays"}, {"arrays", Json::array()}, {"payload_size", uint64_t(1) << 60}}, 4,
                           false, true) +
        "abcd");
  Report report;
  const auto loaded = load_scene_file(path_, report);
  ASSERT_FALSE(loaded);
  EXPECT_THAT(loaded.error(), HasSubstr("allowed"));
}

TEST_F(SceneFile, a_missing_file_and_a_folder_are_named) {
  Report report;
  EXPECT_THAT(load_scene_file(folder_ / "none.lambent", report).error(), HasSubstr("No such file"));
  EXPECT_THAT(load_scene_file(folder_, report).error(), HasSubstr(folder_.string()));
}

}  // namespace
}  // namespace lambent::description
