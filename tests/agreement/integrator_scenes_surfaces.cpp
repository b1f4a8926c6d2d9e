// Scenes of materials: nodes, mixtures, textures, normals, transparency.
#include "tests/agreement/integrator_scene_parts.h"

namespace lambent::test {

std::vector<IntegratorCase> surface_cases() {
  std::vector<IntegratorCase> cases;
  cases.push_back({"surface_coarse_smooth_ball", lit_corner(diffuse(Color(0.8f)), 4, true), k_round});
  cases.push_back({"surface_coarse_smooth_glossy_ball", lit_corner(glossy(0.4f), 4, true), k_round});
  cases.push_back({"surface_coarse_smooth_glass_ball", lit_corner(glass(0.0f), 5, true), k_round_delta});
  cases.push_back({"surface_coarse_smooth_rough_glass_ball", lit_corner(glass(0.3f), 5, true), k_round_delta});

  GraphMaker bumpy;
  {
    const int coordinates = bumpy.add("TexCoord", {});
    const int noise =
        bumpy.add("TexNoise", {{"Vector", Link{coordinates, "Object"}}, {"Scale", 3.0f}, {"Detail", 0.0f}});
    const int bump = bumpy.add("Bump", {{"Height", Link{noise, "Fac"}}, {"Strength", 1.0f}, {"Distance", 0.5f}});
    bumpy.add("BsdfDiffuse", {{"Color", rgb(0.8f, 0.8f, 0.8f)}, {"Normal", Link{bump, "Normal"}}});
  }
  cases.push_back({"surface_bump", lit_corner(bumpy.surface()), k_round});
  GraphMaker bumpy_gloss;
  {
    const int coordinates = bumpy_gloss.add("TexCoord", {});
    const int noise =
        bumpy_gloss.add("TexNoise", {{"Vector", Link{coordinates, "Object"}}, {"Scale", 3.0f}, {"Detail", 0.0f}});
    const int bump = bumpy_gloss.add("Bump", {{"Height", Link{noise, "Fac"}}, {"Strength", 1.0f}, {"Distance", 0.3f}});
    bumpy_gloss.add("BsdfGlossy",
                    {{"Color", rgb(0.8f, 0.8f, 0.8f)}, {"Roughness", 0.4f}, {"Normal", Link{bump, "Normal"}}},
                    {{"distribution", std::string("GGX")}});
  }
  cases.push_back({"surface_bump_glossy", lit_corner(bumpy_gloss.surface()), k_round_delta});

  // Moved vertices; with bump on top; and lit by itself.
  for (const DisplacementMethod method : {DisplacementMethod::displacement, DisplacementMethod::both}) {
    GraphMaker rough;
    const int coordinates = rough.add("TexCoord", {});
    const int noise =
        rough.add("TexNoise", {{"Vector", Link{coordinates, "Object"}}, {"Scale", 3.0f}, {"Detail", 0.0f}});
    const int height = rough.add("Displacement", {{"Height", Link{noise, "Fac"}}, {"Scale", 0.6f}},
                                 {{"space", std::string("OBJECT")}});
    const bool both = method == DisplacementMethod::both;
    if (both)
      rough.add("BsdfDiffuse", {{"Color", rgb(0.8f, 0.8f, 0.8f)}});
    else
      rough.add("Emission", {{"Color", rgb(1.0f, 0.8f, 0.6f)}, {"Strength", 0.7f}});
    description::Graph graph = rough.surface(both ? "BSDF" : "Emission");
    graph.displacement = Link{height, "Displacement"};
    graph.displacement_method = method;
    cases.push_back(
        {both ? "surface_displaced_with_bump" : "surface_displaced_emitter", lit_corner(graph, 16, true), k_round});
  }

  GraphMaker two_sided;
  {
    const int geometry = two_sided.add("NewGeometry", {});
    const int red = two_sided.add("BsdfDiffuse", {{"Color", rgb(0.8f, 0.1f, 0.1f)}});
    const int blue = two_sided.add("BsdfGlossy", {{"Color", rgb(0.1f, 0.2f, 0.8f)}, {"Roughness", 0.5f}},
                                   {{"distribution", std::string("GGX")}});
    two_sided.add(
        "MixShader",
        {{"Fac", Link{geometry, "Backfacing"}}, {"Shader", Link{red, "BSDF"}}, {"Shader_001", Link{blue, "BSDF"}}});
  }
  SceneMaker sheet = lit_corner(diffuse(Color(0.7f)));
  sheet.material("two", two_sided.surface("Shader"));
  quad(sheet, "sheet", {-1.2f, -0.9f, -2.6f}, {-0.4f, -0.8f, -3.6f}, {-0.4f, 0.6f, -3.4f}, "two");
  cases.push_back({"surface_two_sided", sheet, k_round});

  const auto layered = [](const std::string& type, const std::string& socket) {
    GraphMaker graph;
    const int weight = type == "Fresnel" ? graph.add(type, {{"IOR", 1.6f}}) : graph.add(type, {{"Blend", 0.4f}});
    const int base = graph.add("BsdfDiffuse", {{"Color", rgb(0.2f, 0.5f, 0.7f)}});
    const int coat = graph.add("BsdfGlossy", {{"Color", rgb(0.9f, 0.9f, 0.9f)}, {"Roughness", 0.4f}},
                               {{"distribution", std::string("GGX")}});
    graph.add("MixShader",
              {{"Fac", Link{weight, socket}}, {"Shader", Link{base, "BSDF"}}, {"Shader_001", Link{coat, "BSDF"}}});
    return graph.surface("Shader");
  };
  cases.push_back({"surface_layer_weight", lit_corner(layered("LayerWeight", "Facing")), k_round});
  cases.push_back({"surface_fresnel", lit_corner(layered("Fresnel", "Fac")), k_round});
  {
    // Seen through a view-dependent mixture with delta lobes.
    GraphMaker graph;
    const int weight = graph.add("LayerWeight", {{"Blend", 0.5f}});
    const int base =
        graph.add("BsdfRefraction", {{"Color", rgb(0.9f, 0.9f, 0.9f)}, {"Roughness", 0.0f}, {"IOR", 1.4f}});
    const int coat = graph.add("BsdfGlossy", {{"Color", rgb(0.9f, 0.9f, 0.9f)}, {"Roughness", 0.0f}},
                               {{"distribution", std::string("SHARP")}});
    graph.add("MixShader",
              {{"Fac", Link{weight, "Fresnel"}}, {"Shader", Link{base, "BSDF"}}, {"Shader_001", Link{coat, "BSDF"}}});
    cases.push_back({"surface_fresnel_delta", lit_corner(graph.surface("Shader")), k_round_delta});
  }
  {
    GraphMaker graph;
    const int path = graph.add("LightPath", {});
    const int seen = graph.add("BsdfDiffuse", {{"Color", rgb(0.2f, 0.7f, 0.2f)}});
    const int other = graph.add("BsdfDiffuse", {{"Color", rgb(0.9f, 0.2f, 0.2f)}});
    graph.add(
        "MixShader",
        {{"Fac", Link{path, "Is Camera Ray"}}, {"Shader", Link{other, "BSDF"}}, {"Shader_001", Link{seen, "BSDF"}}});
    cases.push_back({"surface_light_path", lit_corner(graph.surface("Shader")), {"BPT", "VCM"}});
  }
  {
    // The usual trick for glass without caustics: transparent for shadow rays.
    GraphMaker graph;
    const int path = graph.add("LightPath", {});
    const int glass_node = graph.add("BsdfGlass", {{"Color", rgb(0.9f, 0.9f, 0.9f)}, {"Roughness", 0.0f}});
    const int clear = graph.add("BsdfTransparent", {{"Color", rgb(0.8f, 0.9f, 0.8f)}});
    graph.add("MixShader", {{"Fac", Link{path, "Is Shadow Ray"}},
                            {"Shader", Link{glass_node, "BSDF"}},
                            {"Shader_001", Link{clear, "BSDF"}}});
    SceneMaker maker = corner(graph.surface("Shader"));
    maker.light("l", lamp(LightType::point, 100.0f), Transform::translation({0.9f, 1.8f, -2.6f}));
    maker.world(background(Color(0.15f, 0.2f, 0.25f)));
    cases.push_back({"surface_transparent_for_shadow_rays", maker, {"BPT", "VCM"}});
    // A pane of it between lamp and floor: light walks end there, next event passes.
    SceneMaker pane = corridor();
    pane.material("pane", maker.description().materials.at("ball")->graph);
    quad(pane, "pane", {-2.4f, 0.9f, -2.2f}, {2.4f, 0.9f, -2.2f}, {2.4f, 2.9f, -2.2f}, "pane");
    pane.light("l", lamp(LightType::point, 60.0f), k_above);
    cases.push_back({"surface_pane_transparent_for_shadow_rays", pane, {"BPT", "VCM"}});
  }
  {
    // A lamp whose emission depends on the path.
    SceneMaker maker = corner(diffuse(Color(0.7f)));
    GraphMaker graph;
    const int path = graph.add("LightPath", {});
    const int strength =
        graph.add("Math", {{"Value", Link{path, "Ray Depth"}}, {"Value_001", 3.0f}, {"Value_002", 1.0f}},
                  {{"operation", std::string("MULTIPLY_ADD")}});
    graph.add("Emission", {{"Color", rgb(1, 1, 1)}, {"Strength", Link{strength, "Value"}}});
    Light light = area(AreaShape::square, 1.5f, 1.5f, 30.0f);
    light.graph = graph.surface("Emission");
    maker.light("l", light, aimed({0.6f, 2.3f, -2.6f}, {0.2f, -1, -3.4f}));
    cases.push_back({"surface_light_path_lamp", maker, {"BPT", "VCM"}});
  }
  SceneMaker sheets = lit_corridor();
  sheets.material("t", transparent(Color(0.7f, 0.8f, 0.9f)))
      .material("half", combined("MixShader", transparent(Color(0.9f)), diffuse(Color(0.8f))));
  quad(sheets, "t", {-2, 0.5f, -2.4f}, {2, 0.5f, -2.4f}, {2, 2.9f, -2.2f}, "t");
  quad(sheets, "half", {-2, 0.3f, -2.7f}, {2, 0.3f, -2.7f}, {2, 2.9f, -2.7f}, "half");
  cases.push_back({"surface_transparent_shadows", sheets, k_all});
  // Lamps that rays do not meet: else those find what no shadow ray does, and each integrator has its own mix of both.
  SceneMaker opaque = corridor();
  Graph half = combined("MixShader", transparent(Color(0.9f)), diffuse(Color(0.8f)));
  half.transparent_shadow = false;
  opaque.material("half", half);
  quad(opaque, "half", {-2, 0.3f, -2.7f}, {2, 0.3f, -2.7f}, {2, 2.9f, -2.7f}, "half");
  opaque.light("p", lamp(LightType::point, 60.0f), k_above);
  cases.push_back({"surface_transparent_but_for_shadows", opaque, k_all});

  SceneMaker instances = corner(diffuse(Color(0.7f)));
  instances.light("l", area(AreaShape::square, 1.5f, 1.5f, 60.0f), aimed({0.6f, 2.3f, -2.6f}, {0.2f, -1, -3.4f}));
  instances.material("i", glossy(0.4f)).material("e", emission(Color(0.3f, 0.6f, 1.0f), 3.0f));
  std::vector<Transform> placed, shining;
  for (int i = 0; i < 6; ++i) {
    const float x = -1.3f + 0.5f * static_cast<float>(i);
    placed.push_back(aimed({x, 0.6f, -4.2f}, {0, 1, -2}) * Transform::scale({0.4f, 0.4f, i % 2 ? 0.4f : -0.2f}));
    shining.push_back(aimed({x, -0.8f, -4.0f}, {x, 0.2f * x, -2}) * Transform::scale({0.1f, 0.2f, 0.1f}));
  }
  const std::vector<Vec3> corners{{-0.5f, -0.5f, 0}, {0.5f, -0.5f, 0}, {0.5f, 0.5f, 0}, {-0.5f, 0.5f, 0.3f}};
  instances.mesh("i", corners, {{0, 1, 2}, {0, 2, 3}}, "i", placed);
  instances.mesh("e", corners, {{0, 1, 2}, {0, 2, 3}}, "e", shining);
  cases.push_back({"surface_instances", instances, k_round});

  // Ray visibility: what some rays do not see. Lamps without size, so that shadow rays alone decide about light.
  const auto hidden = [&](const std::string& name, Graph ball, auto&& change,
                          const std::vector<std::string>& integrators = {"BPT", "VCM"}) {
    SceneMaker maker = corner(std::move(ball));
    maker.light("l", lamp(LightType::point, 100.0f), Transform::translation({0.9f, 1.8f, -2.6f}));
    change(maker.object("ball").visibility);
    cases.push_back({"visibility_" + name, maker, integrators});
  };
  hidden(
      "no_camera", diffuse(Color(0.7f)), [](Visibility& v) { v.camera = false; }, k_round);
  hidden("no_diffuse", diffuse(Color(0.7f)), [](Visibility& v) { v.diffuse = false; });
  hidden("no_glossy", glossy(0.4f), [](Visibility& v) { v.glossy = false; });
  hidden("no_transmission", glass(0.3f), [](Visibility& v) { v.transmission = false; });
  hidden("no_shadow", diffuse(Color(0.7f)), [](Visibility& v) { v.shadow = false; });
  hidden("only_camera", diffuse(Color(0.7f)), [](Visibility& v) { v = {true, false, false, false, false, false}; });
  {
    // A half mirror half matt floor under an object that its glossy rays do not see.
    SceneMaker maker = corner(diffuse(Color(0.7f, 0.2f, 0.2f)));
    maker.material("white", combined("MixShader", diffuse(Color(0.8f)), glossy(0.3f)));
    maker.light("l", lamp(LightType::point, 100.0f), Transform::translation({0.9f, 1.8f, -2.6f}));
    maker.object("ball").visibility.glossy = false;
    cases.push_back({"visibility_no_glossy_above_mixed_floor", maker, {"BPT", "VCM"}});
  }
  for (const auto& [name, visibility] : {std::pair{"camera", Visibility{false, true, true, true, true, true}},
                                         {"diffuse", Visibility{true, false, true, true, true, true}},
                                         {"glossy", Visibility{true, true, false, true, true, true}},
                                         {"transmission", Visibility{true, true, true, false, true, true}}}) {
    SceneMaker maker = lit_corner(combined("MixShader", diffuse(Color(0.8f)), glass(0.3f)));
    maker.material("white", combined("MixShader", diffuse(Color(0.8f)), glossy(0.4f)));
    maker.object("l").visibility = visibility;
    cases.push_back({std::string("visibility_lamp_hidden_from_") + name, maker, {"BPT", "VCM"}});
    SceneMaker mesh = corner(combined("MixShader", diffuse(Color(0.8f)), glass(0.3f)));
    mesh.material("e", emission(Color(1.0f, 0.8f, 0.6f), 6.0f));
    quad(mesh, "e", {0, 2.3f, -3}, {1.2f, 2.3f, -3}, {1.2f, 2.3f, -2}, "e");
    mesh.object("e").visibility = visibility;
    cases.push_back({std::string("visibility_mesh_lamp_hidden_from_") + name, mesh, {"BPT", "VCM"}});
  }
  return cases;
}

std::vector<IntegratorCase> gloss_cases() {
  std::vector<IntegratorCase> cases;
  const auto add = [&](const std::string& name, SceneMaker maker) {
    cases.push_back({"gloss_" + name, std::move(maker), {"VPL", "PPM"}});
  };
  const auto over_diffuse = [](float roughness) {
    return combined("MixShader", diffuse(Color(0.8f, 0.5f, 0.3f)), glossy(roughness));
  };
  add("floor", lit_corridor(glossy(0.2f)));
  add("everywhere", lit_corridor(glossy(0.3f), glossy(0.3f)));
  add("over_diffuse", lit_corridor(over_diffuse(0.2f), over_diffuse(0.3f)));
  add("of_two_widths", lit_corridor(combined("MixShader", glossy(0.25f), glossy(0.8f)), over_diffuse(0.3f)));
  add("before_mirrors", lit_corridor(glossy(0.3f), glossy(0.0f)));
  add("with_a_mirror", lit_corridor(combined("MixShader", glossy(0.3f), glossy(0.0f)), over_diffuse(0.3f)));
  add("of_glass", lit_corridor(glass(0.3f), over_diffuse(0.3f)));
  // Lights that no ray meets, and some that next events hardly find.
  SceneMaker points = corridor(glossy(0.3f), over_diffuse(0.3f));
  points.light("p", lamp(LightType::point, 60.0f), k_above);
  points.light("s", lamp(LightType::sun, 0.5f), aimed({1, 1, 3}, {0, 0, 0}));
  add("under_point_and_sun", points);
  SceneMaker world = corridor(glossy(0.2f), over_diffuse(0.3f));
  add("under_a_world", world.world(uneven_world()));
  SceneMaker even = corridor(over_diffuse(0.2f), glossy(0.3f));
  add("under_an_even_world", even.world(background(Color(0.4f, 0.5f, 0.6f))));
  SceneMaker mesh = corridor(over_diffuse(0.2f), over_diffuse(0.3f));
  mesh.material("e", emission(Color(1.0f, 0.8f, 0.6f), 6.0f));
  quad(mesh, "e", {-0.5f, 2.0f, -2.5f}, {0.5f, 2.0f, -2.5f}, {0.5f, 2.0f, -1.5f}, "e");
  add("under_a_mesh", mesh);
  for (const int limit : {1, 2}) {
    SceneMaker limited = lit_corridor(over_diffuse(0.2f), over_diffuse(0.3f));
    limited.settings.glossy_bounces = limit;
    limited.settings.diffuse_bounces = 2 - limit;
    add("limited_" + std::to_string(limit), limited);
    SceneMaker total = lit_corridor(over_diffuse(0.2f), glossy(0.3f));
    total.settings.max_bounces = limit;
    add("limited_in_all_" + std::to_string(limit), total);
  }
  return cases;
}

}  // namespace lambent::test
