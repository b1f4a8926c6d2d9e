// Materials against what Cycles 3.4.1 returns for them: measure_cycles.py says what was measured and how.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "engine/sampling/sampler.h"
#include "engine/shading/graph.h"

namespace lambent {
namespace {

ShaderGraph graph_of(const nlohmann::json& nodes) {
  ShaderGraph graph;
  for (const auto& described : nodes) {
    GraphNode node;
    node.type = described["type"];
    node.name = node.type;
    for (const auto& [name, value] : described["inputs"].items()) {
      if (value.is_array() && value[0].is_string())
        node.inputs[name] = GraphLink{value[1].get<int>(), value[2].get<std::string>()};
      else if (value.is_array())
        node.inputs[name] = value.get<std::vector<float>>();
      else
        node.inputs[name] = value.get<float>();
    }
    for (const auto& [name, value] : described["properties"].items()) {
      if (value.is_string())
        node.properties[name] = value.get<std::string>();
      else if (value.is_array())
        node.properties[name] = value.get<std::vector<float>>();
      else
        node.properties[name] = value.get<float>();
    }
    if (node.type == "BsdfPrincipled") node.properties["generation"] = 1.0f;
    graph.nodes.push_back(std::move(node));
  }
  graph.surface = GraphLink{static_cast<int>(graph.nodes.size()) - 1, "Shader"};
  return graph;
}

Vec3 vector_of(const nlohmann::json& v) {
  return normalize(Vec3(v[0].get<float>(), v[1].get<float>(), v[2].get<float>()));
}

// The measured point: where measure_cycles.py looks.
ShadingPoint measured_point(const Program& program, const Vec3& wi) {
  ShadingPoint point;
  point.p_world = {2.5f, 0, 0};
  point.wi_world = wi;
  point.backfacing = wi.z < 0.0f;
  point.ng_world = point.ns_world = {0, 0, point.backfacing ? -1.0f : 1.0f};
  for (size_t i = 0; i < program.attribute_requests().size(); ++i)
    if (program.attribute_requests()[i].kind == AttributeRequest::Kind::generated)
      point.attributes[i] = AttributeValue::constant({0.75f, 0.5f, 0.5f, 1.0f});
  return point;
}

TEST(Cycles, materials_return_what_cycles_measured) {
  std::ifstream file(LAMBENT_FURNACE_FOLDER "/cycles_reference.json");
  ASSERT_TRUE(file);
  const nlohmann::json reference = nlohmann::json::parse(file);
  RandomStream random(17);
  int compared = 0;
  for (const auto& measured : reference["measurements"]) {
    Report report;
    const bool is_world = measured.contains("world");
    const auto program = is_world ? compile_world(graph_of(measured["nodes"]), "measured", {}, report)
                                  : compile_material(graph_of(measured["nodes"]), "measured", {}, report);
    const std::string name = measured["name"];
    const bool is_value = is_world || name.starts_with("value ");
    // Known differences, each for a reason:
    // - Cycles 3.4 walks random paths in the microsurface where Lambent scales single scattering: in a white world both
    //   reflect the same, but the walk spreads what bounces twice more evenly. Its reflection is compared with a sun up
    //   to a roughness of 0.8. Through its multiscatter glass a sun shines untinted and at the wrong angle, and
    //   Principled's has its colour in later bounces only: there only BsdfGlass in a white world is compared.
    const bool multiscatter =
        name.find("MULTI_GGX") != std::string::npos || name.find("multiscatter") != std::string::npos;
    const bool glass = name.find("glass") != std::string::npos;
    if (multiscatter && !measured["wo"].is_null() && (glass || name.ends_with("1.0"))) continue;
    if (name.starts_with("principled multiscatter glass")) continue;
    // - It samples clearcoat by another density than the one it claims, so that its white world is not the integral of
    //   its own lobe.
    const bool clearcoat = name.find("clearcoat") != std::string::npos;
    // - It samples anisotropic Beckmann with one alpha for both axes; only the value of the lobe is compared.
    if (name == "anisotropic BECKMANN" && measured["wo"].is_null()) continue;
    const Vec3 wi = vector_of(measured["wi"]);
    const ShadingPoint point = measured_point(*program, wi);
    Bsdf bsdf;
    program->evaluate(point, nullptr, bsdf);
    Color ours(0.0f);
    float error = 0.0f;
    if (is_value) {
      ours = program->emission(point, nullptr);
    } else if (!measured["wo"].is_null()) {
      ours = bsdf.eval(wi, vector_of(measured["wo"]), Transport::radiance).f_cos + bsdf.emission();
    } else {
      constexpr int k_samples = 20000;
      double sum[3] = {0, 0, 0}, squares = 0.0;
      for (int i = 0; i < k_samples; ++i) {
        const float choice = random.next_1d();
        const BsdfSample sample = bsdf.sample(wi, choice, random.next_2d(), Transport::radiance);
        if (sample.event == k_scatter_none) continue;
        for (int k = 0; k < 3; ++k) sum[k] += sample.weight[k];
        squares += sqr(max_component(sample.weight));
      }
      ours = Color(static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])) *
                 (1.0f / k_samples) +
             bsdf.emission();
      error = static_cast<float>(std::sqrt(squares / k_samples / k_samples));
    }
    const std::string lit = is_value                   ? ""
                            : measured["wo"].is_null() ? ", white world"
                                                       : ", sun " + measured["wo"].dump();
    for (int k = 0; k < 3; ++k) {
      const float theirs = measured["value"][k].get<float>(), noise = measured["error"][k].get<float>();
      float tolerance = 0.005f * theirs + 2e-4f + 4.0f * std::hypot(error, noise);
      if (multiscatter) tolerance += measured["wo"].is_null() && !glass ? 0.01f * theirs : 0.2f * theirs + 0.003f;
      // Nishita's sky is 0.1 to 1% brighter than Cycles', sun and ground 2.5%: the cause is not known
      if (is_world) tolerance += 0.03f * theirs;
      if (name.starts_with("value blackbody")) tolerance += 0.01f * theirs;  // Cycles' fit against Planck's law
      if (clearcoat && measured["wo"].is_null()) tolerance += 0.04f;
      // - It gives a sun behind facets that neither direction sees the value of the mirrored facet.
      if (ours[k] == 0.0f && theirs < 0.05f && !measured["wo"].is_null() &&
          wi.z * measured["wo"][2].get<float>() < 0.0f)
        continue;
      EXPECT_NEAR(ours[k], theirs, tolerance)
          << name << ", seen from " << measured["wi"].dump() << lit << ", channel " << k;
      ++compared;
    }
  }
  EXPECT_GT(compared, 1000);
}

}  // namespace
}  // namespace lambent
