// Cost of a shading point: filling the lobes, evaluating a pair of directions, sampling. One thread.
#include <benchmark/benchmark.h>

#include "engine/sampling/sampler.h"
#include "engine/shading/graph.h"

namespace lambent {
namespace {

GraphNode make_node(const std::string& type, std::map<std::string, GraphValue> inputs = {}) {
  GraphNode node;
  node.name = node.type = type;
  node.inputs = std::move(inputs);
  return node;
}

std::shared_ptr<const Program> compile(std::vector<GraphNode> nodes) {
  ShaderGraph graph;
  graph.nodes = std::move(nodes);
  graph.surface = GraphLink{static_cast<int>(graph.nodes.size()) - 1, "BSDF"};
  Report report;
  return compile_material(graph, "benchmark", {}, report);
}

// Seven textures mixed by each other, over a diffuse surface.
std::shared_ptr<const Program> heavy() {
  const GraphLink at{0, "Object"};
  const auto mix = [](GraphLink factor, GraphLink a, GraphLink b) {
    return make_node("MixRGB", {{"Fac", factor}, {"Color1", a}, {"Color2", b}});
  };
  return compile(
      {make_node("TexCoord"),
       make_node("TexNoise",
                 {{"Vector", at}, {"Scale", 3.0f}, {"Detail", 8.0f}, {"Roughness", 0.6f}, {"Distortion", 0.5f}}),
       make_node("TexNoise", {{"Vector", at}, {"Scale", 20.0f}, {"Detail", 4.0f}}),
       make_node("TexVoronoi", {{"Vector", at}, {"Scale", 6.0f}}),
       make_node("TexVoronoi", {{"Vector", at}, {"Scale", 11.0f}}),
       make_node("TexMusgrave", {{"Vector", at}, {"Scale", 5.0f}, {"Detail", 6.0f}}),
       make_node("TexBrick", {{"Vector", at}, {"Scale", 4.0f}}),
       make_node("TexWave", {{"Vector", at}, {"Scale", 2.0f}, {"Distortion", 3.0f}, {"Detail", 3.0f}}),
       make_node("TexMagic", {{"Vector", at}, {"Scale", 3.0f}}),
       mix(GraphLink{4, "Distance"}, GraphLink{1, "Color"}, GraphLink{3, "Color"}),
       mix(GraphLink{5, "Fac"}, GraphLink{8, "Color"}, GraphLink{1, "Color"}),
       mix(GraphLink{7, "Fac"}, GraphLink{6, "Color"}, GraphLink{10, "Color"}),
       mix(GraphLink{2, "Fac"}, GraphLink{9, "Color"}, GraphLink{11, "Color"}),
       make_node("BsdfDiffuse", {{"Color", GraphLink{12, "Color"}}})});
}

std::shared_ptr<const Program> material(int which) {
  switch (which) {
    case 0:
      return compile({make_node("BsdfDiffuse")});
    case 1:
      return compile({make_node("BsdfPrincipled")});
    case 2:  // the same lobes, but interpreted: the roughness depends on the point
      return compile(
          {make_node("NewGeometry"), make_node("BsdfPrincipled", {{"Roughness", GraphLink{0, "Backfacing"}}})});
    case 3:
      return compile({make_node("BsdfGlass", {{"Roughness", 0.3f}})});
    case 4:  // as bmw27's paint
      return compile({make_node("LayerWeight", {{"Blend", 0.2f}}), make_node("BsdfDiffuse"),
                      make_node("BsdfGlossy", {{"Roughness", 0.2f}}),
                      make_node("MixShader", {{"Fac", GraphLink{0, "Fresnel"}},
                                              {"Shader", GraphLink{1, "BSDF"}},
                                              {"Shader_001", GraphLink{2, "BSDF"}}})});
    case 6:
      return compile({make_node("TexCoord"), make_node("TexVoronoi", {{"Vector", GraphLink{0, "Object"}}}),
                      make_node("BsdfDiffuse", {{"Color", GraphLink{1, "Color"}}})});
    case 7:  // the material of tests/scenes/make_procedural.py
      return heavy();
    default:
      return compile({make_node("TexCoord"), make_node("TexNoise", {{"Vector", GraphLink{0, "Object"}}}),
                      make_node("BsdfDiffuse", {{"Color", GraphLink{1, "Color"}}})});
  }
}
constexpr const char* k_names[] = {"diffuse", "principled constant", "principled varying", "glass", "paint", "noise",
                                   "voronoi", "heavy procedural"};

ShadingPoint make_point() {
  ShadingPoint point;
  point.wi_world = normalize(Vec3(0.3f, 0.2f, 0.8f));
  return point;
}

void fill_lobes(benchmark::State& state) {
  const auto program = material(static_cast<int>(state.range(0)));
  ShadingPoint point = make_point();
  Bsdf bsdf;
  for (auto _ : state) {
    point.p_world.x += 1e-3f;  // patterns cost differently from place to place
    program->evaluate(point, nullptr, bsdf);
    benchmark::DoNotOptimize(bsdf);
  }
  state.SetLabel(k_names[state.range(0)]);
}
BENCHMARK(fill_lobes)->DenseRange(0, 7);

void evaluate(benchmark::State& state) {
  const auto program = material(static_cast<int>(state.range(0)));
  const ShadingPoint point = make_point();
  Bsdf bsdf;
  program->evaluate(point, nullptr, bsdf);
  const auto reverse = state.range(1) ? ReversePdf::yes : ReversePdf::no;
  Vec3 wo = normalize(Vec3(-0.2f, 0.4f, 0.7f));
  for (auto _ : state) {
    benchmark::DoNotOptimize(wo);
    benchmark::DoNotOptimize(bsdf.eval(point.wi_world, wo, Transport::radiance, reverse));
  }
  state.SetLabel(std::string(k_names[state.range(0)]) + (state.range(1) ? ", reverse density" : ""));
}
BENCHMARK(evaluate)->ArgsProduct({{0, 1, 3, 4}, {0, 1}});

void sample(benchmark::State& state) {
  const auto program = material(static_cast<int>(state.range(0)));
  const ShadingPoint point = make_point();
  Bsdf bsdf;
  program->evaluate(point, nullptr, bsdf);
  RandomStream random(1);
  for (auto _ : state) {
    const float choice = random.next_1d();
    benchmark::DoNotOptimize(
        bsdf.sample(point.wi_world, choice, random.next_2d(), Transport::radiance, ReversePdf::no));
  }
  state.SetLabel(k_names[state.range(0)]);
}
BENCHMARK(sample)->Arg(0)->Arg(1)->Arg(3)->Arg(4);

}  // namespace
}  // namespace lambent

BENCHMARK_MAIN();
