// What the scenes of integrator_scenes.h are made of.
#pragma once

#include "tests/agreement/integrator_scenes.h"

namespace lambent::test {

using namespace description;

inline const std::vector<std::string> k_all{"BPT", "VCM", "LT", "PPM", "BPM"};
/// VPL's few lights, shared by all pixels, need many batches to settle: some scenes only.
inline const std::vector<std::string> k_all_and_vpl{"BPT", "VCM", "LT", "VPL", "PPM", "BPM"};
inline const std::vector<std::string> k_flat_delta{"BPT", "VCM", "PPM",
                                                   "BPM"};  ///< flat, seen or lit through delta surfaces
inline const std::vector<std::string> k_round{"BPT", "VCM", "LT"};
inline const std::vector<std::string> k_round_delta{"BPT",
                                                    "VCM"};  ///< or where LT has spikes: rough glass, narrow gloss
inline const std::vector<std::string> k_camera_scatters{"BPT", "VCM",
                                                        "BPM"};  ///< all of what light from under surfaces does

inline Numbers rgb(float r, float g, float b) { return {r, g, b, 1.0f}; }

/// A graph of several nodes; the last one added is the surface.
class GraphMaker {
 public:
  int add(const std::string& type, std::map<std::string, SocketValue> inputs,
          std::map<std::string, SocketValue> properties = {}) {
    Node node;
    node.name = type + std::to_string(graph_.nodes.size());
    node.type = type;
    node.inputs = std::move(inputs);
    node.properties = std::move(properties);
    graph_.nodes.push_back(std::move(node));
    return static_cast<int>(graph_.nodes.size()) - 1;
  }
  Graph surface(const std::string& socket = "BSDF") {
    graph_.surface = Link{static_cast<int>(graph_.nodes.size()) - 1, socket};
    return graph_;
  }

 private:
  Graph graph_;
};

inline Graph glossy(float roughness, float anisotropy = 0.0f, Color color = Color(0.8f, 0.7f, 0.6f)) {
  return single("BsdfGlossy",
                {{"Color", rgb(color.x, color.y, color.z)}, {"Roughness", roughness}, {"Anisotropy", anisotropy}},
                {{"distribution", std::string("GGX")}});
}
inline Graph glass(float roughness) {
  return single("BsdfGlass", {{"Color", rgb(0.9f, 0.95f, 1.0f)}, {"Roughness", roughness}, {"IOR", 1.45f}},
                {{"distribution", std::string("GGX")}});
}
/// Two closures of one or no input each, mixed or added.
inline Graph combined(const std::string& type, Graph first, Graph second, SocketValue factor = 0.5f) {
  GraphMaker graph;
  const int a = graph.add(first.nodes[0].type, first.nodes[0].inputs, first.nodes[0].properties);
  const int b = graph.add(second.nodes[0].type, second.nodes[0].inputs, second.nodes[0].properties);
  std::map<std::string, SocketValue> inputs{{"Shader", Link{a, first.surface->socket}},
                                            {"Shader_001", Link{b, second.surface->socket}}};
  if (type == "MixShader") inputs["Fac"] = factor;
  graph.add(type, inputs);
  return graph.surface("Shader");
}

inline SceneMaker& quad(SceneMaker& maker, const std::string& id, const Vec3& a, const Vec3& b, const Vec3& c,
                        const std::string& material) {
  return maker.mesh(id, {a, b, c, a + c - b}, {{0, 1, 2}, {0, 2, 3}}, material);
}

inline SceneMaker frame() {
  SceneMaker maker(32, 32, 1);
  maker.settings.max_bounces = maker.settings.diffuse_bounces = maker.settings.glossy_bounces =
      maker.settings.transmission_bounces = 4;
  maker.settings.light_threshold = 0.0f;
  maker.settings.tile_size_px = 16;
  maker.settings.shared_light_paths = 64;
  maker.settings.merge_radius_px = 1.0f;
  return maker;
}

/// A floor that fills the picture, 4 m away, between two walls outside of it: what merging renders without bias.
inline SceneMaker corridor(Graph floor = diffuse(Color(0.7f, 0.6f, 0.5f)),
                           Graph wall = diffuse(Color(0.5f, 0.6f, 0.7f))) {
  SceneMaker maker = frame();
  maker.material("floor", std::move(floor)).material("wall", std::move(wall));
  quad(maker, "floor", {-2.5f, -3, -4}, {2.5f, -3, -4}, {2.5f, 3, -4}, "floor");
  quad(maker, "left", {-2.5f, -3, -4}, {-2.5f, 3, -4}, {-2.5f, 3, -1}, "wall");
  quad(maker, "right", {2.5f, -3, -4}, {2.5f, -3, -1}, {2.5f, 3, -1}, "wall");
  return maker;
}

/// A ball in a corner: curved, seen against floor and walls.
inline SceneMaker corner(Graph ball, int rings = 12, bool smooth = false) {
  SceneMaker maker = frame();
  maker.settings.merge_radius_px = 0.25f;
  maker.material("ball", std::move(ball))
      .material("white", diffuse(Color(0.7f)))
      .material("red", diffuse(Color(0.7f, 0.3f, 0.2f)));
  quad(maker, "floor", {-1.6f, -1, -1}, {2, -1, -1}, {2, -1, -5}, "white");
  quad(maker, "back", {-1.6f, -1, -5}, {2, -1, -5}, {2, 2.5f, -5}, "white");
  quad(maker, "left", {-1.6f, -1, -1}, {-1.6f, -1, -5}, {-1.6f, 2.5f, -5}, "red");
  maker.sphere("ball", Vec3(0.1f, -0.3f, -3.4f), 0.7f, rings, "ball", smooth);
  return maker;
}

inline Light lamp(LightType type, float energy) {
  Light light;
  light.type = type;
  light.energy = energy;
  light.color = Color(1.0f, 0.9f, 0.8f);
  return light;
}
inline Light area(AreaShape shape, float width, float height, float energy, float spread = k_pi) {
  Light light = lamp(LightType::area, energy);
  light.shape = shape;
  light.size_m = {width, height};
  light.spread_rad = spread;
  return light;
}
/// Beside the corridor's picture, 2.5 m above the floor.
inline const Transform k_above = aimed({-0.5f, 2.0f, -1.5f}, {0.3f, 0, -4});

inline SceneMaker lit_corner(Graph ball, int rings = 12, bool smooth = false) {
  SceneMaker maker = corner(std::move(ball), rings, smooth);
  maker.light("l", area(AreaShape::square, 1.5f, 1.5f, 60.0f), aimed({0.6f, 2.3f, -2.6f}, {0.2f, -1, -3.4f}));
  return maker.world(background(Color(0.15f, 0.2f, 0.25f)));
}
inline SceneMaker lit_corridor(Graph floor = diffuse(Color(0.7f, 0.6f, 0.5f)),
                               Graph wall = diffuse(Color(0.5f, 0.6f, 0.7f))) {
  SceneMaker maker = corridor(std::move(floor), std::move(wall));
  maker.light("l", area(AreaShape::square, 1.0f, 1.0f, 60.0f), k_above);
  return maker;
}

}  // namespace lambent::test
