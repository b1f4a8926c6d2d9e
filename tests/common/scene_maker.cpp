#include "tests/common/scene_maker.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <thread>

namespace lambent::test {

using namespace description;

namespace {

template <typename T>
ArrayPointer array(ElementType type, std::vector<uint64_t> shape, const std::vector<T>& elements) {
  return make_array(type, std::move(shape), elements.data());
}

ArrayPointer transform_array(const std::vector<Transform>& transforms) {
  std::vector<float> rows;
  for (const Transform& transform : transforms)
    for (const auto& row : transform.m) rows.insert(rows.end(), row, row + 4);
  return array(ElementType::f32, {transforms.size(), 3, 4}, rows);
}

}  // namespace

SceneMaker::SceneMaker(int width, int height, int64_t samples) {
  settings.width = width;
  settings.height = height;
  settings.samples = samples;
  settings.camera = "camera";
  settings.pixel_filter = PixelFilter::box;
  settings.tile_size_px = 16;
  settings.max_bounces = 64;
  settings.diffuse_bounces = settings.glossy_bounces = settings.transmission_bounces = 64;
  camera.name = "camera";
  camera.clip_near_m = 1e-3f;
}

SceneMaker& SceneMaker::material(const std::string& id, Graph graph) {
  scene_.materials[id] = std::make_shared<Material>(Material{id, std::move(graph), 0});
  return *this;
}

SceneMaker& SceneMaker::mesh(const std::string& id, const std::vector<Vec3>& positions,
                             const std::vector<std::array<uint32_t, 3>>& triangles, const std::string& material_id,
                             const std::vector<Transform>& transforms) {
  Mesh mesh;
  mesh.name = id;
  mesh.positions = array(ElementType::f32, {positions.size(), 3}, positions);
  mesh.triangles = array(ElementType::u32, {triangles.size(), 3}, triangles);
  scene_.meshes[id] = std::make_shared<Mesh>(std::move(mesh));
  Object object;
  object.name = id;
  object.mesh = id;
  object.transforms = transform_array(transforms.empty() ? std::vector<Transform>(1) : transforms);
  object.materials = {material_id};
  scene_.objects[id] = std::make_shared<Object>(std::move(object));
  return *this;
}

SceneMaker& SceneMaker::sphere(const std::string& id, const Vec3& center, float radius, int rings,
                               const std::string& material_id, bool smooth) {
  const int segments = 2 * rings;
  std::vector<Vec3> positions;
  std::vector<std::array<uint32_t, 3>> triangles;
  for (int ring = 0; ring <= rings; ++ring)
    for (int segment = 0; segment < segments; ++segment) {
      const double theta = M_PI * ring / rings, phi = 2 * M_PI * segment / segments;
      positions.push_back(
          center + Vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)) * radius);
    }
  for (int ring = 0; ring < rings; ++ring)
    for (int segment = 0; segment < segments; ++segment) {
      const uint32_t a = ring * segments + segment, b = ring * segments + (segment + 1) % segments;
      const uint32_t c = a + segments, d = b + segments;
      if (ring > 0) triangles.push_back({a, c, b});
      if (ring < rings - 1) triangles.push_back({b, c, d});
    }
  mesh(id, positions, triangles, material_id);
  if (smooth) {
    Mesh with_normals = *scene_.meshes[id];
    for (Vec3& p : positions) p = normalize(p - center);
    with_normals.normals = array(ElementType::f32, {positions.size(), 3}, positions);
    with_normals.normals_domain = Domain::vertex;
    scene_.meshes[id] = std::make_shared<Mesh>(std::move(with_normals));
  }
  return *this;
}

SceneMaker& SceneMaker::replace_mesh(const std::string& id, Mesh mesh) {
  scene_.meshes[id] = std::make_shared<Mesh>(std::move(mesh));
  return *this;
}

SceneMaker& SceneMaker::light(const std::string& id, Light light, const Transform& world_from_light) {
  light.name = id;
  scene_.lights[id] = std::make_shared<Light>(std::move(light));
  Object object;
  object.name = id;
  object.light = id;
  object.transforms = transform_array({world_from_light});
  scene_.objects[id] = std::make_shared<Object>(std::move(object));
  return *this;
}

SceneMaker& SceneMaker::world(Graph graph) {
  World world;
  world.name = "world";
  world.graph = std::move(graph);
  scene_.worlds["world"] = std::make_shared<World>(std::move(world));
  settings.world = "world";
  return *this;
}

SceneMaker& SceneMaker::object(const std::string& id, Object object) {
  scene_.objects[id] = std::make_shared<Object>(std::move(object));
  return *this;
}

Object& SceneMaker::object(const std::string& id) {
  auto own = std::make_shared<Object>(*scene_.objects.at(id));
  scene_.objects[id] = own;
  return *own;
}

SceneMaker& SceneMaker::scale_and_move(float scale, const Vec3& offset) {
  const auto place = [&](Transform t) {
    for (int i = 0; i < 3; ++i) t.m[i][3] = t.m[i][3] * scale + offset[i];
    return t;
  };
  for (auto& [id, pointer] : scene_.objects) {
    Object object = *pointer;
    const std::span<const float> rows = object.transforms->as<float>();
    std::vector<Transform> transforms;
    for (size_t i = 0; i + 12 <= rows.size(); i += 12) {
      Transform t = place(Transform::from_rows(&rows[i]));
      if (object.light.empty())
        for (auto& row : t.m)
          for (int j = 0; j < 3; ++j) row[j] *= scale;
      transforms.push_back(t);
    }
    object.transforms = transform_array(transforms);
    pointer = std::make_shared<Object>(std::move(object));
  }
  for (auto& [id, pointer] : scene_.lights) {
    Light light = *pointer;
    light.radius_m *= scale;
    light.size_m *= scale;
    if (light.type != LightType::sun) light.energy *= scale * scale;
    pointer = std::make_shared<Light>(std::move(light));
  }
  camera.transform = place(camera.transform);
  camera.clip_near_m *= scale;
  camera.clip_far_m *= scale;
  camera.ortho_scale *= scale;
  if (camera.depth_of_field) camera.depth_of_field->focus_distance_m *= scale;
  return *this;
}

Transaction SceneMaker::transaction(int64_t epoch) const {
  Transaction transaction;
  transaction.epoch = epoch;
  transaction.edits.push_back(Clear{});
  for (const auto& [id, value] : scene_.meshes) transaction.edits.push_back(Upsert{id, *value});
  for (const auto& [id, value] : scene_.materials) transaction.edits.push_back(Upsert{id, *value});
  for (const auto& [id, value] : scene_.lights) transaction.edits.push_back(Upsert{id, *value});
  for (const auto& [id, value] : scene_.objects) transaction.edits.push_back(Upsert{id, *value});
  for (const auto& [id, value] : scene_.worlds) transaction.edits.push_back(Upsert{id, *value});
  transaction.edits.push_back(Upsert{"camera", camera});
  transaction.edits.push_back(Upsert{"render", settings});
  return transaction;
}

Graph single(const std::string& type, std::map<std::string, SocketValue> inputs,
             std::map<std::string, SocketValue> properties) {
  Graph graph;
  Node node;
  node.name = type;
  node.type = type;
  node.inputs = std::move(inputs);
  node.properties = std::move(properties);
  graph.nodes.push_back(std::move(node));
  graph.surface = Link{0, type == "Background" ? "Background" : type == "Emission" ? "Emission" : "BSDF"};
  return graph;
}

namespace {
Numbers numbers(const Color& c) { return {c.x, c.y, c.z, 1.0f}; }
}  // namespace

Graph diffuse(const Color& color, float roughness) {
  return single("BsdfDiffuse", {{"Color", numbers(color)}, {"Roughness", roughness}});
}
Graph emission(const Color& color, float strength) {
  return single("Emission", {{"Color", numbers(color)}, {"Strength", strength}});
}
Graph background(const Color& color) { return single("Background", {{"Color", numbers(color)}, {"Strength", 1.0f}}); }
Graph transparent(const Color& color) { return single("BsdfTransparent", {{"Color", numbers(color)}}); }

Graph diffuse_emitter(const Color& albedo, const Color& emitted) {
  Graph graph = diffuse(albedo);
  graph.nodes.push_back(emission(emitted, 1.0f).nodes[0]);
  Node add;
  add.name = add.type = "AddShader";
  add.inputs = {{"Shader", Link{0, "BSDF"}}, {"Shader_001", Link{1, "Emission"}}};
  graph.nodes.push_back(std::move(add));
  graph.surface = Link{2, "Shader"};
  return graph;
}

SceneMaker room(int64_t samples) {
  SceneMaker maker(48, 40, samples);
  maker.material("white", diffuse(Color(0.7f)))
      .material("red", diffuse(Color(0.7f, 0.1f, 0.1f)))
      .material("glass", single("BsdfGlass", {{"Color", Numbers{1, 1, 1, 1}}, {"Roughness", 0.0f}, {"IOR", 1.5f}}))
      .material("metal", single("BsdfGlossy", {{"Color", Numbers{0.9f, 0.8f, 0.6f, 1}}, {"Roughness", 0.2f}},
                                {{"distribution", std::string("GGX")}}))
      .material("lamp", emission(Color(1.0f, 0.9f, 0.8f), 5.0f));
  maker.mesh("floor", {{-3, -1, 0}, {3, -1, 0}, {3, -1, -6}, {-3, -1, -6}}, {{0, 1, 2}, {0, 2, 3}}, "white");
  maker.mesh("back", {{-3, -1, -6}, {3, -1, -6}, {3, 3, -6}, {-3, 3, -6}}, {{0, 1, 2}, {0, 2, 3}}, "red");
  maker.mesh("sheet", {{-1, 2.5f, -3}, {1, 2.5f, -3}, {1, 2.5f, -5}, {-1, 2.5f, -5}}, {{0, 1, 2}, {0, 2, 3}}, "lamp");
  maker.sphere("ball", Vec3(-0.7f, -0.4f, -3.5f), 0.6f, 24, "glass");
  maker.sphere("metal", Vec3(0.8f, -0.5f, -4.0f), 0.5f, 24, "metal");
  Light light;
  light.energy = 60.0f;
  light.radius_m = 0.1f;
  maker.light("l", light, Transform::translation({2, 2, -2}));
  maker.world(background(Color(0.05f, 0.06f, 0.1f)));
  return maker;
}

Transform aimed(const Vec3& position, const Vec3& target) {
  const Vec3 z = normalize(position - target);
  const Vec3 x = normalize(cross(std::fabs(z.y) < 0.9f ? Vec3(0, 1, 0) : Vec3(1, 0, 0), z));
  const Vec3 y = cross(z, x);
  const float rows[12] = {x.x, y.x, z.x, position.x, x.y, y.y, z.y, position.y, x.z, y.z, z.z, position.z};
  return Transform::from_rows(rows);
}

Picture render(const Transaction& transaction, int threads, RenderOutcome* outcome, Report* report) {
  EngineOptions options;
  options.threads = threads;
  RenderOutcome result;
  SessionEvents events;
  events.done = [&](const RenderOutcome& done) { result = done; };
  events.report = [&](int64_t, const Report& found) {
    if (report) report->append(found);
  };
  Session session(Engine::create(options), events);
  session.apply(transaction);
  session.start(transaction.epoch);
  session.wait();
  if (outcome)
    *outcome = result;
  else
    EXPECT_EQ(result.status, RenderStatus::finished) << result.message;
  return session.picture();
}

Picture render_interrupted(const SceneMaker& maker, int64_t samples) {
  const std::string path =
      fmt::format("{}lambent_{}_{}.checkpoint", testing::TempDir(), getpid(), maker.settings.integrator);
  const auto engine = Engine::create({});
  RenderOutcome outcome;
  SessionEvents events;
  events.done = [&](const RenderOutcome& done) { outcome = done; };
  {
    Session first(engine, events);
    first.apply(maker.transaction());
    first.start(1);
    while (first.progress().samples < samples) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    first.cancel();
    first.wait();
    EXPECT_EQ(outcome.status, RenderStatus::cancelled);
    EXPECT_LT(outcome.samples, maker.settings.samples) << "it was done before it could be stopped";
    const Status saved = first.save_checkpoint(path);
    EXPECT_TRUE(static_cast<bool>(saved)) << saved.error();
  }
  Session second(engine, events);
  second.apply(maker.transaction());
  EXPECT_TRUE(static_cast<bool>(second.load_checkpoint(path)));
  second.start(2);
  second.wait();
  EXPECT_EQ(outcome.status, RenderStatus::finished) << outcome.message;
  std::filesystem::remove(path);
  return second.picture();
}

Mean mean(const Picture& picture) {
  Imath::V3d sum(0.0);
  double gray_sum = 0, gray_squares = 0;
  const size_t count = static_cast<size_t>(picture.width) * picture.height;
  for (size_t i = 0; i < count && 4 * i + 3 < picture.pixels.size(); ++i) {
    const Imath::V3d c(picture.pixels[4 * i], picture.pixels[4 * i + 1], picture.pixels[4 * i + 2]);
    sum += c;
    const double gray = (c.x + c.y + c.z) / 3;
    gray_sum += gray;
    gray_squares += gray * gray;
  }
  const double n = static_cast<double>(count);
  const double variance = std::max(0.0, gray_squares / n - (gray_sum / n) * (gray_sum / n));
  return {Color(Vec3(sum / n)), std::sqrt(variance / n)};
}

}  // namespace lambent::test
