#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/shading/bsdf_set.h"
#include "engine/shading/color_math.h"
#include "engine/shading/compiler.h"
#include "engine/shading/expressions.h"
#include "engine/shading/graph.h"

namespace lambent {
namespace {

using testing::HasSubstr;

GraphNode make_node(const std::string& type, std::map<std::string, GraphValue> inputs = {},
                    std::map<std::string, GraphValue> properties = {}) {
  GraphNode node;
  node.name = type + " node";
  node.type = type;
  node.inputs = std::move(inputs);
  node.properties = std::move(properties);
  return node;
}

ShaderGraph make_graph(std::vector<GraphNode> nodes) {
  ShaderGraph graph;
  graph.nodes = std::move(nodes);
  graph.surface = GraphLink{static_cast<int>(graph.nodes.size()) - 1, "BSDF"};
  return graph;
}

GraphNumbers rgb(float r, float g, float b) { return {r, g, b, 1.0f}; }

ShadingPoint front_point() {
  ShadingPoint point;
  point.wi_world = normalize(Vec3(0.3f, 0.1f, 0.9f));
  return point;
}

struct Compiled {
  Report report;
  std::shared_ptr<const Program> program;
  explicit Compiled(const ShaderGraph& graph) : program(compile_material(graph, "Paint", {}, report)) {}
  Bsdf bsdf(const ShadingPoint& point = front_point()) const {
    Bsdf result;
    program->evaluate(point, nullptr, result);
    return result;
  }
  std::string messages() const {
    std::string all;
    for (const Message& message : report.messages()) all += message.code + ": " + message.text + "\n";
    return all;
  }
};

TEST(Expressions, constants_are_folded) {
  ProgramData program;
  Expressions e(program);
  const Value sum =
      e.operation(Op::math, static_cast<int>(MathOperation::add), {e.number(2), e.number(3), e.number(0)}, 1);
  ASSERT_TRUE(e.is_constant(sum));
  EXPECT_EQ(*e.constant(sum), 5.0f);
  EXPECT_TRUE(program.constants.empty());
}

TEST(Expressions, equal_operations_are_shared) {
  ProgramData program;
  Expressions e(program);
  const Value a = e.operation(Op::position, 0, {}, 3), b = e.operation(Op::position, 0, {}, 3);
  EXPECT_EQ(a, b);
  EXPECT_EQ(e.operation(Op::length, 0, {a}, 1), e.operation(Op::length, 0, {b}, 1));
  EXPECT_FALSE(e.operation(Op::position, 1, {}, 3) == a);
}

TEST(Expressions, only_what_a_closure_needs_is_generated) {
  ProgramData program;
  Expressions e(program);
  const Value needed = e.operation(Op::length, 0, {e.operation(Op::position, 0, {}, 3)}, 1);
  e.operation(Op::length, 0, {e.operation(Op::normal, 0, {}, 3)}, 1);
  program.closures.emplace_back();
  Code code;
  ASSERT_TRUE(e.generate({{0, {needed}}}, code));
  EXPECT_EQ(code.instructions.size(), 3u);  // position, length, closure
}

TEST(Expressions, registers_are_reused_after_their_last_reader) {
  ProgramData program;
  Expressions e(program);
  Value value = e.operation(Op::parametric, 0, {}, 3);
  for (int i = 0; i < 3000; ++i)
    value = e.operation(Op::vector_math, static_cast<int>(VectorOperation::add),
                        {value, e.vector({1, 0, 0}), e.vector(Vec3(0.0f)), e.number(0)}, 3);
  program.closures.emplace_back();
  Code code;
  ASSERT_TRUE(e.generate({{0, {e.number(1), value}}}, code));
  EXPECT_LE(code.register_floats, 6);
}

TEST(Compiler, a_constant_material_needs_no_value_instructions_and_has_its_lobes_ready) {
  const Compiled compiled(make_graph({make_node("BsdfDiffuse", {{"Color", rgb(0.2f, 0.4f, 0.6f)}})}));
  EXPECT_EQ(compiled.messages(), "");
  const Bsdf bsdf = compiled.bsdf();
  ASSERT_EQ(bsdf.lobes().size(), 1u);
  EXPECT_EQ(bsdf.lobes()[0].weight, Color(0.2f, 0.4f, 0.6f));
  EXPECT_TRUE(compiled.program->traits().scatters);
  EXPECT_FALSE(compiled.program->traits().emits);
  EXPECT_FALSE(compiled.program->traits().may_be_transparent);
}

TEST(Compiler, mixing_with_a_constant_zero_drops_the_unseen_shader) {
  const Compiled compiled(make_graph(
      {make_node("BsdfDiffuse"), make_node("Emission"),
       make_node("MixShader",
                 {{"Fac", 0.0f}, {"Shader", GraphLink{0, "BSDF"}}, {"Shader_001", GraphLink{1, "Emission"}}})}));
  EXPECT_FALSE(compiled.program->traits().emits);
  EXPECT_EQ(compiled.bsdf().lobes().size(), 1u);
}

TEST(Compiler, adding_shaders_may_exceed_energy_conservation) {
  const Compiled compiled(
      make_graph({make_node("BsdfDiffuse", {{"Color", rgb(0.8f, 0.8f, 0.8f)}}),
                  make_node("BsdfGlossy", {{"Color", rgb(0.8f, 0.8f, 0.8f)}}),
                  make_node("AddShader", {{"Shader", GraphLink{0, "BSDF"}}, {"Shader_001", GraphLink{1, "BSDF"}}})}));
  EXPECT_NEAR(compiled.bsdf().albedo({0, 0, 1}).x, 1.6f, 1e-5f);
}

TEST(Compiler, constant_emission_needs_no_program) {
  const Compiled compiled(make_graph({make_node("Emission", {{"Color", rgb(1, 0.5f, 0)}, {"Strength", 4.0f}})}));
  EXPECT_TRUE(compiled.program->traits().emits);
  EXPECT_TRUE(compiled.program->traits().constant_emission);
  EXPECT_EQ(compiled.program->traits().emission, Color(4, 2, 0));
  EXPECT_EQ(compiled.program->emission(front_point(), nullptr), Color(4, 2, 0));
  EXPECT_EQ(compiled.bsdf().emission(), Color(4, 2, 0));
}

TEST(Compiler, varying_emission_is_estimated_by_its_mean) {
  const Compiled compiled(make_graph({make_node("TexCoord"), make_node("TexGradient", {{"Vector", GraphLink{0, "UV"}}}),
                                      make_node("Emission", {{"Color", GraphLink{1, "Color"}}, {"Strength", 2.0f}})}));
  EXPECT_FALSE(compiled.program->traits().constant_emission);
  EXPECT_NEAR(compiled.program->traits().emission.x, 1.0f, 0.15f);
  ASSERT_EQ(compiled.program->attribute_requests().size(), 1u);
  EXPECT_EQ(compiled.program->attribute_requests()[0].kind, AttributeRequest::Kind::uv);
}

TEST(Compiler, transparency_is_what_is_left_of_alpha) {
  const Compiled compiled(make_graph({make_node("BsdfPrincipled", {{"Alpha", 0.25f}})}));
  EXPECT_TRUE(compiled.program->traits().may_be_transparent);
  EXPECT_NEAR(compiled.program->transparency(front_point(), nullptr).y, 0.75f, 1e-6f);
  EXPECT_NEAR(compiled.bsdf().transparency().y, 0.75f, 1e-6f);
}

TEST(Compiler, a_black_or_missing_surface_absorbs) {
  const Compiled compiled(ShaderGraph{});
  EXPECT_TRUE(compiled.bsdf().empty());
  EXPECT_FALSE(compiled.program->traits().scatters);
}

TEST(Compiler, loops_are_named_and_cut) {
  const Compiled compiled(make_graph({make_node("Math", {{"Value", GraphLink{1, "Value"}}}),
                                      make_node("Math", {{"Value", GraphLink{0, "Value"}}}),
                                      make_node("BsdfDiffuse", {{"Roughness", GraphLink{0, "Value"}}})}));
  EXPECT_THAT(compiled.messages(), HasSubstr("broken_graph"));
  EXPECT_THAT(compiled.messages(), HasSubstr("Math node"));
  EXPECT_EQ(compiled.bsdf().lobes().size(), 1u);
}

TEST(Compiler, shader_loops_and_dangling_links_are_named_and_cut) {
  ShaderGraph graph =
      make_graph({make_node("AddShader", {{"Shader", GraphLink{0, "Shader"}}, {"Shader_001", GraphLink{7, "BSDF"}}})});
  const Compiled compiled(graph);
  EXPECT_THAT(compiled.messages(), HasSubstr("loop"));
  EXPECT_THAT(compiled.messages(), HasSubstr("does not exist"));
}

TEST(Compiler, an_unknown_shader_is_named_and_not_black) {
  const Compiled compiled(make_graph({make_node("BsdfInvented", {{"Color", rgb(0.5f, 0.5f, 0.5f)}})}));
  EXPECT_THAT(compiled.messages(), HasSubstr("BsdfInvented"));
  EXPECT_THAT(compiled.messages(), HasSubstr("Paint"));
  EXPECT_NEAR(compiled.bsdf().albedo({0, 0, 1}).x, 0.5f, 1e-5f);
}

TEST(Compiler, an_unknown_value_node_is_named) {
  const Compiled compiled(
      make_graph({make_node("TexInvented"), make_node("BsdfDiffuse", {{"Color", GraphLink{0, "Color"}}})}));
  EXPECT_THAT(compiled.messages(), HasSubstr("TexInvented"));
  EXPECT_NEAR(compiled.bsdf().albedo({0, 0, 1}).x, 0.5f, 1e-5f);
}

TEST(Compiler, non_finite_inputs_are_named_and_replaced) {
  const Compiled compiled(
      make_graph({make_node("BsdfGlossy", {{"Roughness", std::numeric_limits<float>::quiet_NaN()}})}));
  EXPECT_THAT(compiled.messages(), HasSubstr("bad_value"));
  EXPECT_THAT(compiled.messages(), HasSubstr("Roughness"));
}

TEST(Compiler, a_missing_image_is_named_and_pink) {
  const Compiled compiled(make_graph({make_node("TexImage", {}, {{"image", std::string("wood")}}),
                                      make_node("Emission", {{"Color", GraphLink{0, "Color"}}})}));
  EXPECT_THAT(compiled.messages(), HasSubstr("wood"));
  EXPECT_EQ(compiled.program->emission(front_point(), nullptr), Color(1, 0, 1));
}

TEST(Compiler, bump_asks_for_differentials_and_turns_the_normal_against_the_slope) {
  const Compiled compiled(
      make_graph({make_node("TexCoord"), make_node("SeparateXYZ", {{"Vector", GraphLink{0, "Object"}}}),
                  make_node("Bump", {{"Height", GraphLink{1, "X"}}}),
                  make_node("BsdfDiffuse", {{"Normal", GraphLink{2, "Normal"}}})}));
  EXPECT_TRUE(compiled.program->traits().needs_differentials);
  ShadingPoint point;
  point.wi_world = normalize(Vec3(-0.5f, 0, 0.9f));  // sees the slope, so that the normal is valid as it is
  point.dpdx_world = {1e-3f, 0, 0};
  point.dpdy_world = {0, 1e-3f, 0};
  const Vec3 n = compiled.bsdf(point).lobes()[0].n;
  EXPECT_NEAR(n.x, -std::sqrt(0.5f), 1e-3f);
  EXPECT_NEAR(n.z, std::sqrt(0.5f), 1e-3f);
}

TEST(Compiler, slopes_do_not_depend_on_the_filter_of_bumps) {
  for (const float width : {1.0f, 0.1f, 3.0f}) {
    const Compiled compiled(
        make_graph({make_node("TexCoord"), make_node("SeparateXYZ", {{"Vector", GraphLink{0, "Object"}}}),
                    make_node("Bump", {{"Height", GraphLink{1, "X"}}, {"Filter Width", width}}),
                    make_node("BsdfDiffuse", {{"Normal", GraphLink{2, "Normal"}}})}));
    ShadingPoint point;
    point.wi_world = normalize(Vec3(-0.5f, 0, 0.9f));
    point.dpdx_world = {1e-3f, 0, 0};
    point.dpdy_world = {0, 1e-3f, 0};
    EXPECT_NEAR(compiled.bsdf(point).lobes()[0].n.x, -std::sqrt(0.5f), 1e-3f) << width;
  }
}

TEST(Compiler, nodes_follow_the_rules_of_the_version_of_cycles) {
  // A normal far from the view: bent before 4.0, but for what mirrors it stays
  ShaderGraph graph = make_graph(
      {make_node("NormalMap", {{"Color", GraphNumbers{1.0f, 0.5f, 0.6f}}}, {{"space", std::string("WORLD")}}),
       make_node("BsdfDiffuse", {{"Normal", GraphLink{0, "Normal"}}}),
       make_node("BsdfAnisotropic", {{"Roughness", 0.5f}, {"Normal", GraphLink{0, "Normal"}}}),
       make_node("AddShader", {{"Shader", GraphLink{1, "BSDF"}}, {"Shader_001", GraphLink{2, "BSDF"}}})});
  ShadingPoint point = front_point();
  point.wi_world = normalize(Vec3(-1.0f, 0, 0.15f));
  const Vec3 raw = normalize(Vec3(1.0f, 0.0f, 0.2f));
  for (const int version : {304, 502}) {
    graph.cycles_version = version;
    const Compiled compiled(graph);
    const Bsdf bsdf = compiled.bsdf(point);
    ASSERT_EQ(bsdf.lobes().size(), 2u);
    const Lobe& diffuse = bsdf.lobes()[0];
    const Lobe& glossy = bsdf.lobes()[1];
    EXPECT_EQ(length(diffuse.n - raw) < 1e-3f, version >= 400) << version;
    EXPECT_GT(length(glossy.n - raw), 1e-2f) << version;
    EXPECT_EQ(glossy.correlated_masking, version >= 305) << version;
  }
}

TEST(Compiler, random_walks_mean_what_the_version_of_cycles_means) {
  struct Case {
    int version;
    const char* falloff;
    SubsurfaceMethod method;
    float radius_m;
  };
  const float scaled = 2.0f * 0.25f * k_inv_pi;
  for (const Case& c : {Case{501, "RANDOM_WALK", SubsurfaceMethod::refractive, scaled},
                        Case{502, "RANDOM_WALK", SubsurfaceMethod::van_de_hulst, 2.0f},
                        Case{502, "RANDOM_WALK_LEGACY", SubsurfaceMethod::refractive, scaled}}) {
    ShaderGraph graph = make_graph({make_node("SubsurfaceScattering",
                                              {{"Color", GraphNumbers{0.5f, 0.5f, 0.5f}},
                                               {"Scale", 2.0f},
                                               {"Radius", GraphNumbers{1.0f, 1.0f, 1.0f}},
                                               {"Roughness", 1.0f}},
                                              {{"falloff", std::string(c.falloff)}})});
    graph.cycles_version = c.version;
    const Compiled compiled(graph);
    const Bsdf bsdf = compiled.bsdf(front_point());
    ASSERT_EQ(bsdf.lobes().size(), 1u);
    EXPECT_EQ(bsdf.lobes()[0].subsurface, c.method) << c.version << c.falloff;
    EXPECT_NEAR(bsdf.lobes()[0].f90.x, c.radius_m, 1e-5f) << c.version << c.falloff;
  }
}

TEST(Compiler, normal_maps_of_the_directx_convention_point_the_other_way) {
  const auto normal_with = [](const char* convention) {
    const Compiled compiled(
        make_graph({make_node("NormalMap", {{"Color", GraphNumbers{0.5f, 0.7f, 0.9f}}},
                              {{"space", std::string("WORLD")}, {"convention", std::string(convention)}}),
                    make_node("BsdfDiffuse", {{"Normal", GraphLink{0, "Normal"}}})}));
    return compiled.bsdf(front_point()).lobes()[0].n;
  };
  const Vec3 opengl = normal_with("OPENGL"), directx = normal_with("DIRECTX");
  EXPECT_GT(opengl.y, 0.1f);
  EXPECT_NEAR(directx.y, -opengl.y, 1e-5f);
}

TEST(Compiler, a_displacement_acts_as_bump_on_every_closure) {
  ShaderGraph graph = make_graph({make_node("TexCoord"), make_node("SeparateXYZ", {{"Vector", GraphLink{0, "Object"}}}),
                                  make_node("Displacement", {{"Height", GraphLink{1, "Y"}}, {"Scale", 1.0f}}),
                                  make_node("BsdfDiffuse")});
  graph.displacement = GraphLink{2, "Displacement"};
  const Compiled compiled(graph);
  ShadingPoint point;
  point.wi_world = normalize(Vec3(0, -0.5f, 0.9f));
  point.dpdx_world = {1e-3f, 0, 0};
  point.dpdy_world = {0, 1e-3f, 0};
  EXPECT_NEAR(compiled.bsdf(point).lobes()[0].n.y, -std::sqrt(0.5f), 1e-3f);
}

TEST(Compiler, a_displacement_shadows_closures_that_have_normals_of_their_own) {
  ShaderGraph graph = make_graph(
      {make_node("TexCoord"), make_node("SeparateXYZ", {{"Vector", GraphLink{0, "Object"}}}),
       make_node("Displacement", {{"Height", GraphLink{1, "Y"}}, {"Scale", 1.0f}}),
       make_node("NormalMap", {{"Color", GraphNumbers{0.5f, 0.5f, 1.0f}}}, {{"space", std::string("WORLD")}}),
       make_node("BsdfDiffuse", {{"Normal", GraphLink{3, "Normal"}}})});
  const Compiled smooth(graph);
  graph.displacement = GraphLink{2, "Displacement"};
  const Compiled bumped(graph);
  ShadingPoint point;
  point.wi_world = normalize(Vec3(0, -0.5f, 0.9f));
  point.dpdx_world = {1e-3f, 0, 0};
  point.dpdy_world = {0, 1e-3f, 0};
  EXPECT_EQ(smooth.bsdf(point).lobes()[0].n, bumped.bsdf(point).lobes()[0].n);
  const auto towards = [&](const Compiled& compiled, const Vec3& light) {
    return compiled.bsdf(point).eval(point.wi_world, normalize(light), Transport::radiance).f_cos.x;
  };
  // The bump looks towards -Y: light from there is as without it, light from beyond it is dimmed.
  EXPECT_NEAR(towards(bumped, {0, -0.7f, 0.7f}), towards(smooth, {0, -0.7f, 0.7f}), 1e-3f);
  EXPECT_LT(towards(bumped, {0, 0.6f, 0.8f}), 0.7f * towards(smooth, {0, 0.6f, 0.8f}));
}

TEST(Compiler, coordinates_of_the_object_do_not_depend_on_how_far_the_scene_was_moved) {
  // Positions and transforms are both relative to the shift.
  ShaderGraph coordinates, location;
  coordinates.nodes = {make_node("TexCoord"), make_node("Emission", {{"Color", GraphLink{0, "Object"}}})};
  location.nodes = {make_node("ObjectInfo"), make_node("Emission", {{"Color", GraphLink{0, "Location"}}})};
  coordinates.surface = location.surface = GraphLink{1, "Emission"};
  for (const float shift : {0.0f, 4096.0f}) {
    ShadingPoint point = front_point();
    const Transform world_from_object = Transform::translation({10.0f - shift, 20.0f, 30.0f}),
                    object_from_world = world_from_object.inverse();
    point.world_from_object = &world_from_object;
    point.object_from_world = &object_from_world;
    point.origin_shift = {shift, 0.0f, 0.0f};
    point.p_world = {11.0f - shift, 22.0f, 33.0f};
    EXPECT_EQ(Compiled(coordinates).program->emission(point, nullptr), Color(1, 2, 3));
    EXPECT_EQ(Compiled(location).program->emission(point, nullptr), Color(10, 20, 30));
  }
}

TEST(Compiler, glass_turns_its_index_round_behind_the_surface) {
  const Compiled compiled(make_graph({make_node("BsdfGlass", {{"IOR", 1.5f}})}));
  ShadingPoint point = front_point();
  EXPECT_NEAR(compiled.bsdf(point).lobes()[0].eta, 1.5f, 1e-6f);
  point.backfacing = true;
  EXPECT_NEAR(compiled.bsdf(point).lobes()[0].eta, 1.0f / 1.5f, 1e-6f);
}

TEST(Compiler, a_film_is_a_mode_of_its_own_and_costs_nothing_without_thickness) {
  const auto mode = [](const char* type, float thickness) {
    const Compiled compiled(make_graph({make_node(type, {{"Thin Film Thickness", thickness}})}));
    EXPECT_EQ(compiled.messages(), "");
    return compiled.bsdf().lobes()[0].fresnel;
  };
  EXPECT_EQ(mode("BsdfMetallic", 0.0f), FresnelMode::f82);
  EXPECT_EQ(mode("BsdfMetallic", 300.0f), FresnelMode::film_f82);
  EXPECT_EQ(mode("BsdfMetallic", 0.05f), FresnelMode::f82);
}

TEST(Compiler, a_smooth_pane_lets_light_straight_through_and_a_rough_one_does_not) {
  const auto pane = [](float roughness) {
    return Compiled(make_graph({make_node("BsdfPrincipled",
                                          {{"Base Color", rgb(1.0f, 1.0f, 1.0f)},
                                           {"Thin Wall", 1.0f},
                                           {"Transmission Weight", 1.0f},
                                           {"Roughness", roughness}},
                                          {{"generation", 2.0f}})}));
  };
  const Compiled smooth = pane(0.0f), rough = pane(0.5f);
  ASSERT_TRUE(smooth.program->traits().may_be_transparent);
  ShadingPoint point;  // seen straight on
  // Of an index of 1.5 one side reflects 4%, both with what goes to and fro between them 2·0.04 / (1 + 0.04)
  EXPECT_NEAR(smooth.program->transparency(point, nullptr).x, 1.0f - 0.08f / 1.04f, 1e-4f);
  EXPECT_NEAR(smooth.bsdf().transparency().x, 0.92f, 0.02f);
  EXPECT_EQ(rough.program->transparency(point, nullptr), Color(0.0f));
}

TEST(Compiler, a_portal_sends_rays_on_from_its_place_and_lets_no_light_through) {
  std::vector<GraphNode> nodes{make_node("CombineXYZ", {{"X", 5.0f}, {"Y", -2.0f}, {"Z", 1.0f}}),
                               make_node("BsdfRayPortal", {{"Position", GraphLink{0, "Vector"}},
                                                           {"Direction", GraphNumbers{0.0f, 3.0f, 0.0f}}})};
  const Compiled there(make_graph(nodes));
  EXPECT_EQ(there.messages(), "");
  EXPECT_TRUE(there.program->traits().portal);
  EXPECT_FALSE(there.program->traits().may_be_transparent);
  const Bsdf bsdf = there.bsdf();
  const Vec3 wi = normalize(Vec3(0.3f, 0.1f, 0.9f));
  const BsdfSample sample = bsdf.sample(wi, 0.5f, {0.5f, 0.5f}, Transport::radiance);
  ASSERT_TRUE(sample.event & k_scatter_portal);
  EXPECT_TRUE(sample.event & k_scatter_transparent);
  EXPECT_EQ(sample.wo_world, Vec3(0, 1, 0));
  EXPECT_EQ(bsdf.lobes()[static_cast<size_t>(sample.lobe)].tangent, Vec3(5, -2, 1));
  EXPECT_EQ(sample.pdf_reverse_solid_angle, 0.0f);
  // Without a place and a direction it is a hole.
  const Compiled hole(make_graph({make_node("BsdfRayPortal")}));
  const BsdfSample on = hole.bsdf().sample(wi, 0.5f, {0.5f, 0.5f}, Transport::radiance);
  ASSERT_TRUE(on.event & k_scatter_portal);
  EXPECT_NEAR(length(on.wo_world + wi), 0.0f, 1e-6f);
}

TEST(Compiler, a_world_sees_the_direction_of_the_ray) {
  ShaderGraph graph =
      make_graph({make_node("TexCoord"), make_node("Background", {{"Color", GraphLink{0, "Generated"}}})});
  Report report;
  const auto program = compile_world(graph, "Sky", {}, report);
  ShadingPoint point;
  point.wi_world = {0, 0, -1};  // the ray goes up
  EXPECT_EQ(program->emission(point, nullptr), Color(0, 0, 1));
}

TEST(Compiler, what_a_world_gives_to_aovs_is_said_to_be_left_out) {
  ShaderGraph graph = make_graph({make_node("OutputAOV", {{"Value", 1.0f}}), make_node("Background")});
  graph.aovs = {0};
  Report report;
  const auto program = compile_world(graph, "Sky", {}, report);
  EXPECT_EQ(program->find_aov(""), -1);
  ASSERT_EQ(report.messages().size(), 1u);
  EXPECT_EQ(report.messages()[0].object, "Sky");
}

TEST(Compiler, rays_are_cast_where_something_asks_and_make_a_program_depend_on_the_path) {
  const Compiled occluded(
      make_graph({make_node("AmbientOcclusion"), make_node("BsdfDiffuse", {{"Color", GraphLink{0, "Color"}}})}));
  EXPECT_TRUE(occluded.program->traits().casts_rays);
  EXPECT_TRUE(occluded.program->traits().path_dependent);
  EXPECT_EQ(occluded.bsdf().albedo({0, 0, 1}), Color(1.0f)) << "where there are no rays nothing is around";
  ShaderGraph graph = make_graph({make_node("AmbientOcclusion"),
                                  make_node("OutputAOV", {{"Value", GraphLink{0, "AO"}}}, {{"aov", std::string("ao")}}),
                                  make_node("BsdfDiffuse")});
  graph.aovs = {1};
  const Compiled shown(graph);
  EXPECT_TRUE(shown.program->traits().casts_rays) << "for the pass";
  EXPECT_FALSE(shown.program->traits().path_dependent);
  EXPECT_FALSE(Compiled(make_graph({make_node("BsdfDiffuse")})).program->traits().casts_rays);
}

TEST(Compiler, a_light_without_graph_multiplies_by_one) {
  Report report;
  EXPECT_EQ(compile_light(ShaderGraph{}, "Lamp", {}, report)->traits().emission, Color(1, 1, 1));
}

TEST(Compiler, supported_types_compile_without_a_message_for_their_defaults) {
  for (const std::string& type : supported_node_types()) {
    if (type.starts_with("Tex") &&
        (type == "TexImage" || type == "TexEnvironment" || type == "TexSky" || type == "TexIES"))
      continue;
    ShaderGraph graph = make_graph({make_node(type)});
    // Nodes that look their output up by name
    static const std::map<std::string, std::string> outputs{{"LightPath", "Ray Length"},
                                                            {"NewGeometry", "Position"},
                                                            {"ObjectInfo", "Random"},
                                                            {"TexCoord", "UV"},
                                                            {"CameraData", "View Distance"}};
    if (const auto output = outputs.find(type); output != outputs.end()) graph.surface->socket = output->second;
    const Compiled compiled(graph);
    EXPECT_EQ(compiled.messages(), "") << type;
  }
}

ProgramTraits traits_of(std::vector<GraphNode> nodes) {
  return Compiled(make_graph(std::move(nodes))).program->traits();
}

TEST(Compiler, lobes_that_read_the_view_are_view_dependent) {
  for (const auto& [type, socket] : std::vector<std::pair<std::string, std::string>>{{"LayerWeight", "Facing"},
                                                                                     {"LayerWeight", "Fresnel"},
                                                                                     {"Fresnel", "Fac"},
                                                                                     {"NewGeometry", "Incoming"},
                                                                                     {"TexCoord", "Reflection"}}) {
    const ProgramTraits traits =
        traits_of({make_node(type), make_node("BsdfDiffuse", {{"Color", GraphLink{0, socket}}})});
    EXPECT_TRUE(traits.view_dependent) << type << " " << socket;
    EXPECT_FALSE(traits.path_dependent) << type << " " << socket;
  }
  EXPECT_FALSE(traits_of({make_node("NewGeometry"), make_node("BsdfDiffuse", {{"Color", GraphLink{0, "Position"}}})})
                   .view_dependent);
}

TEST(Compiler, the_layers_of_principled_2_are_view_dependent_and_principled_1_is_not) {
  EXPECT_TRUE(traits_of({make_node("BsdfPrincipled", {}, {{"generation", 2.0f}})}).view_dependent);
  EXPECT_FALSE(traits_of({make_node("BsdfPrincipled", {}, {{"generation", 1.0f}})}).view_dependent);
}

TEST(Compiler, transparency_that_reads_the_view_is_view_dependent) {
  EXPECT_TRUE(traits_of({make_node("LayerWeight"), make_node("BsdfTransparent", {{"Color", GraphLink{0, "Facing"}}})})
                  .view_dependent);
}

TEST(Compiler, emission_that_reads_the_view_leaves_the_lobes_independent_of_it) {
  ShaderGraph graph = make_graph(
      {make_node("LayerWeight"), make_node("Emission", {{"Color", rgb(1, 1, 1)}, {"Strength", GraphLink{0, "Facing"}}}),
       make_node("BsdfDiffuse"),
       make_node("AddShader", {{"Shader", GraphLink{1, "Emission"}}, {"Shader_001", GraphLink{2, "BSDF"}}})});
  graph.surface = GraphLink{3, "Shader"};
  const Compiled compiled(graph);
  EXPECT_TRUE(compiled.program->traits().emits);
  EXPECT_FALSE(compiled.program->traits().view_dependent);
}

TEST(Compiler, light_path_makes_lobes_and_emission_path_dependent) {
  EXPECT_TRUE(traits_of({make_node("LightPath"), make_node("BsdfDiffuse", {{"Color", GraphLink{0, "Is Camera Ray"}}})})
                  .path_dependent);
  ShaderGraph graph =
      make_graph({make_node("LightPath"), make_node("Emission", {{"Strength", GraphLink{0, "Ray Depth"}}})});
  graph.surface = GraphLink{1, "Emission"};
  EXPECT_TRUE(Compiled(graph).program->traits().path_dependent);
  EXPECT_FALSE(traits_of({make_node("BsdfDiffuse")}).path_dependent);
}

TEST(Compiler, dead_parts_of_the_graph_do_not_count_for_the_traits) {
  // The mix is decided by a constant: the layered side, which reads path and view, is never compiled.
  ShaderGraph graph = make_graph(
      {make_node("LightPath"), make_node("LayerWeight"),
       make_node("BsdfGlossy", {{"Roughness", GraphLink{0, "Ray Length"}}, {"Color", GraphLink{1, "Facing"}}}),
       make_node("BsdfDiffuse"),
       make_node("MixShader",
                 {{"Fac", 1.0f}, {"Shader", GraphLink{2, "BSDF"}}, {"Shader_001", GraphLink{3, "BSDF"}}})});
  graph.surface = GraphLink{4, "Shader"};
  const ProgramTraits traits = Compiled(graph).program->traits();
  EXPECT_FALSE(traits.view_dependent);
  EXPECT_FALSE(traits.path_dependent);
}

TEST(Compiler, only_emission_that_may_be_negative_is_said_to_be) {
  const auto emits_negative = [](GraphNode source, const std::string& socket) {
    ShaderGraph graph = make_graph({std::move(source), make_node("Emission", {{"Color", GraphLink{0, socket}}})});
    graph.surface = GraphLink{1, "Emission"};
    return Compiled(graph).program->traits().emits_negative;
  };
  EXPECT_TRUE(emits_negative(make_node("NewGeometry"), "Position"));
  EXPECT_FALSE(emits_negative(make_node("TexNoise"), "Color"));
  EXPECT_TRUE(emits_negative(make_node("TexNoise", {}, {{"normalize", false}}), "Color"));
  EXPECT_FALSE(emits_negative(make_node("ValToRGB"), "Color"));
  EXPECT_TRUE(emits_negative(make_node("RGB", {{"Color", rgb(0.5f, -0.5f, 0.5f)}}), "Color"));
}

TEST(Compiler, both_generations_of_principled_reflect_their_base_colour) {
  for (const float generation : {1.0f, 2.0f}) {
    const Compiled compiled(
        make_graph({make_node("BsdfPrincipled", {{"Base Color", rgb(0.6f, 0.3f, 0.1f)}, {"Roughness", 0.5f}},
                              {{"generation", generation}})}));
    EXPECT_EQ(compiled.messages(), "");
    const Color albedo = compiled.bsdf().albedo({0, 0, 1});
    EXPECT_NEAR(albedo.x, 0.6f, 0.06f) << generation;
    EXPECT_NEAR(albedo.z, 0.1f, 0.06f) << generation;
  }
}

TEST(Compiler, subsurface_takes_its_colour) {
  const Compiled compiled(make_graph(
      {make_node("BsdfPrincipled", {{"Subsurface", 1.0f}, {"Subsurface Color", rgb(0, 0.7f, 0)}, {"Specular", 0.0f}},
                 {{"generation", 1.0f}})}));
  EXPECT_EQ(compiled.messages(), "");
  EXPECT_TRUE(compiled.program->traits().subsurface);
  EXPECT_NEAR(compiled.bsdf().albedo({0, 0, 1}).y, 0.7f, 0.02f);  // with an estimate of retro-reflection
  EXPECT_NEAR(compiled.bsdf().albedo({0, 0, 1}).x, 0.0f, 1e-4f);
}

Color emitted(const ShaderGraph& graph, const ShadingPoint& point = front_point()) {
  return Compiled(graph).program->emission(point, nullptr);
}

TEST(Compiler, computed_colours_are_in_the_scenes_space) {
  for (const auto& [type, input, x] :
       {std::tuple{"Blackbody", "Temperature", 2500.0f}, {"Wavelength", "Wavelength", 500.0f}}) {
    ShaderGraph graph = make_graph(
        {make_node(type, {{input, x}}), make_node("Emission", {{"Color", GraphLink{0, "Color"}}, {"Strength", 1.0f}})});
    const Color usual = emitted(graph);
    graph.scene_from_computed = {0.5f, 0.5f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 2.0f};
    const Color wide = emitted(graph);
    const Color given = type == std::string("Blackbody") ? blackbody_color(x) : wavelength_color(x);
    EXPECT_NEAR(wide.x, std::max(0.5f * (given.x + given.y), 0.0f), 1e-5f) << type;
    EXPECT_NEAR(wide.y, usual.y, 1e-5f) << type;
    EXPECT_NEAR(wide.z, 2.0f * std::max(given.z, 0.0f), 1e-5f) << type;
    EXPECT_GE(min_component(usual), 0.0f) << type;
    EXPECT_FALSE(Compiled(graph).program->traits().emits_negative) << type;
  }
  EXPECT_LT(wavelength_color(500.0f).x, 0.0f);  // what the test is about: Rec. 709 cannot show it, a wider space may
}

/// Meets a surface 2 m away, which has the attribute "rust" and no other, or nothing.
class RaysForTest final : public ShaderRays {
 public:
  explicit RaysForTest(bool meets) : meets_(meets) {}
  bool occluded(const ShadingPoint&, const Vec3&, float, bool) const override { return meets_; }
  int crossings(const ShadingPoint&, const Vec3&, const Vec3&, float, std::span<Crossing>) const override { return 0; }
  bool meets(const ShadingPoint&, const Vec3&, const Vec3&, float, bool, bool, Meeting& met) const override {
    met.distance_m = 2.0f;
    met.place = {7, 2500000000u, {0.25f, 0.5f}};
    return meets_;
  }
  MetAttribute attribute(const SurfacePlace& place, const std::string& name) const override {
    EXPECT_EQ(place.instance, 7u);
    EXPECT_EQ(place.primitive, 2500000000u);
    EXPECT_EQ(place.barycentric, Vec2(0.25f, 0.5f));
    return name == "rust" ? MetAttribute{{0.1f, 0.2f, 0.6f, 0.8f}, 0.3f} : MetAttribute{};
  }

 private:
  bool meets_;
};

TEST(Compiler, worlds_and_lights_have_no_attributes_to_read) {
  Report report;
  int tried = 0;
  for (const auto& [type, unused] : value_nodes())
    for (const char* output :
         {"Color", "Vector", "UV", "Generated", "Object", "Fac", "Alpha", "Tangent", "Normal", "Value"}) {
      const auto graph = [&](const char* closure) {
        return make_graph({make_node(type.c_str()), make_node(closure, {{"Color", GraphLink{0, output}}})});
      };
      EXPECT_TRUE(compile_world(graph("Background"), "W", {}, report)->attribute_requests().empty()) << type << output;
      EXPECT_TRUE(compile_light(graph("Emission"), "L", {}, report)->attribute_requests().empty()) << type << output;
      ++tried;
    }
  EXPECT_GT(tried, 500);
  const ShaderGraph graph =
      make_graph({make_node("VertexColor"), make_node("Background", {{"Color", GraphLink{0, "Color"}}})});
  EXPECT_EQ(compile_world(graph, "W", {}, report)->emission(front_point(), nullptr), Color(0.0f));
}

TEST(Compiler, raycast_reads_attributes_of_what_it_meets) {
  const auto shown = [](const char* type, const char* name, const char* output, bool meets) {
    const RaysForTest rays(meets);
    ShadingPoint point = front_point();
    point.rays = &rays;
    const ShaderGraph graph = make_graph(
        {make_node("NewGeometry"),
         make_node("Raycast", {{"Direction", GraphLink{0, "Normal"}}, {"Length", 3.0f}, {"Value_0", std::string(name)}},
                   {{"type_0", std::string(type)}}),
         make_node("Emission", {{"Color", GraphLink{1, output}}})});
    EXPECT_EQ(Compiled(graph).messages(), "");
    return emitted(graph, point);
  };
  EXPECT_EQ(shown("RGBA", "rust", "Attribute_0", true), Color(0.1f, 0.2f, 0.6f));
  EXPECT_EQ(shown("VECTOR", "rust", "Attribute_0", true), Color(0.1f, 0.2f, 0.6f));
  EXPECT_EQ(shown("FLOAT", "rust", "Attribute_0", true), Color(0.3f));
  EXPECT_EQ(shown("RGBA", "rust", "Attribute_0_Alpha", true), Color(0.8f));
  EXPECT_EQ(shown("RGBA", "none", "Attribute_0", true), Color(0.0f));
  EXPECT_EQ(shown("RGBA", "none", "Attribute_0_Alpha", true), Color(1.0f)) << "as Attribute nodes say of what is not";
  EXPECT_EQ(shown("RGBA", "rust", "Attribute_0", false), Color(0.0f));
  EXPECT_EQ(shown("RGBA", "rust", "Attribute_0_Alpha", false), Color(0.0f));
  EXPECT_EQ(shown("RGBA", "", "Attribute_0", true), Color(0.0f));
  EXPECT_EQ(shown("RGBA", "", "Attribute_0_Alpha", true), Color(1.0f));
  EXPECT_EQ(shown("RGBA", "rust", "Hit Distance", true), Color(2.0f));
}

TEST(Compiler, normals_and_tangents_of_scaled_objects_are_turned_as_in_the_cycles_of_the_scene) {
  const Transform world = Transform::scale({2.0f, 1.0f, 1.0f}), object = Transform::scale({0.5f, 1.0f, 1.0f});
  ShadingPoint point = front_point();
  point.world_from_object = &world;
  point.object_from_world = &object;
  const auto shown = [&](GraphNode node, const char* output, int version) {
    ShaderGraph graph = make_graph({std::move(node), make_node("Emission", {{"Color", GraphLink{0, output}}})});
    graph.cycles_version = version;
    return emitted(graph, point);
  };
  const GraphNode transform = make_node("VectorTransform", {{"Vector", GraphNumbers{1.0f, 1.0f, 0.0f}}},
                                        {{"vector_type", std::string("NORMAL")},
                                         {"convert_from", std::string("OBJECT")},
                                         {"convert_to", std::string("WORLD")}});
  const Vec3 as_direction = normalize(Vec3(2, 1, 0)), as_normal = normalize(Vec3(0.5f, 1, 0));
  EXPECT_NEAR(shown(transform, "Vector", 306).x, as_direction.x, 1e-6f);
  EXPECT_NEAR(shown(transform, "Vector", 400).x, as_normal.x, 1e-6f);
  // UV tangents too, in all versions.
  point.attributes[0] = AttributeValue::constant({as_direction.x, as_direction.y, 0.0f, 1.0f});
  const GraphNode tangent = make_node("Tangent", {}, {{"direction_type", std::string("UV_MAP")}});
  EXPECT_NEAR(shown(tangent, "Tangent", 304).x, as_normal.x, 1e-6f);
  EXPECT_NEAR(shown(tangent, "Tangent", 502).y, as_normal.y, 1e-6f);
}

TEST(Compiler, numbers_of_attributes_are_rounded_as_in_cycles_5) {
  ShadingPoint point = front_point();
  const float x = 0.1234567f;
  point.attributes[0] = AttributeValue::constant({x, x, x, 1.0f});
  ShaderGraph graph = make_graph({make_node("Attribute", {}, {{"attribute_name", std::string("a")}}),
                                  make_node("Emission", {{"Color", GraphLink{0, "Fac"}}})});
  EXPECT_EQ(emitted(graph, point).x, x);
  graph.cycles_version = 500;
  EXPECT_EQ(emitted(graph, point).x, (x + x + x) * (1.0f / 3.0f));
}

TEST(Compiler, point_density_is_nothing_on_surfaces_from_blender_4_on) {
  ShaderGraph graph = make_graph({make_node("TexPointDensity", {}, {{"image", std::string("voxels")}}),
                                  make_node("Emission", {{"Color", GraphLink{0, "Density"}}})});
  EXPECT_THAT(Compiled(graph).messages(), HasSubstr("voxels"));
  graph.cycles_version = 400;
  EXPECT_EQ(Compiled(graph).messages(), "");
  EXPECT_EQ(emitted(graph).x, 0.0f);
}

TEST(Compiler, particle_information_is_that_of_the_point) {
  const auto shown = [](const char* output, const ParticleState* particle) {
    ShadingPoint point = front_point();
    point.particle = particle;
    return emitted(make_graph({make_node("ParticleInfo"), make_node("Emission", {{"Color", GraphLink{0, output}}})}),
                   point);
  };
  ParticleState particle{3.0f, 4.0f, 50.0f, 0.25f, {1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  EXPECT_EQ(shown("Index", &particle).x, 3.0f);
  EXPECT_EQ(shown("Age", &particle).x, 4.0f);
  EXPECT_EQ(shown("Lifetime", &particle).x, 50.0f);
  EXPECT_EQ(shown("Size", &particle).x, 0.25f);
  EXPECT_EQ(shown("Location", &particle), Color(1, 2, 3));
  EXPECT_EQ(shown("Velocity", &particle), Color(4, 5, 6));
  EXPECT_EQ(shown("Angular Velocity", &particle), Color(7, 8, 9));
  EXPECT_EQ(shown("Location", nullptr), Color(0.0f));
  const float random = shown("Random", &particle).x;
  particle.index = 4.0f;
  EXPECT_NE(shown("Random", &particle).x, random);
}

TEST(Compiler, principled_hair_lies_along_the_first_edge_and_absorbs_what_its_colour_says) {
  const auto lobe_of = [](const std::string& meaning, std::map<std::string, GraphValue> inputs) {
    const Compiled compiled(
        make_graph({make_node("BsdfHairPrincipled", std::move(inputs), {{"parametrization", meaning}})}));
    EXPECT_EQ(compiled.messages(), "");
    ShadingPoint point = front_point();
    point.dpdu_world = {0.0f, 3.0f, 0.0f};
    Bsdf bsdf = compiled.bsdf(point);
    EXPECT_EQ(bsdf.lobes().size(), 1u);
    EXPECT_EQ(bsdf.lobes()[0].kind, LobeKind::hair_fibre);
    EXPECT_EQ(bsdf.lobes()[0].tangent, Vec3(0, 1, 0));
    return bsdf.lobes()[0];
  };
  EXPECT_EQ(lobe_of("ABSORPTION", {{"Absorption Coefficient", GraphNumbers{0.1f, 0.0f, 2.0f}}}).f0,
            Color(0.1f, 0.0f, 2.0f));
  // White hair absorbs nothing, black hair lets next to nothing through; and black is no reason to leave it out.
  EXPECT_EQ(max_component(lobe_of("COLOR", {{"Color", rgb(1, 1, 1)}}).f0), 0.0f);
  EXPECT_GT(lobe_of("COLOR", {{"Color", rgb(0, 0, 0)}}).f0.x, 10.0f);
  const Color blond = lobe_of("MELANIN", {{"Melanin", 0.2f}, {"Melanin Redness", 0.0f}}).f0;
  const float density = -std::log(0.8f);
  EXPECT_NEAR(blond.x, 0.506f * density, 1e-4f);
  EXPECT_NEAR(blond.z, 1.653f * density, 1e-4f);
  const Lobe coated =
      lobe_of("COLOR", {{"Coat", 0.25f}, {"Roughness", 0.4f}, {"Radial Roughness", 0.7f}, {"IOR", 1.4f}});
  EXPECT_FLOAT_EQ(coated.f90.x, 0.75f);
  EXPECT_FLOAT_EQ(coated.f90.y, 1.4f);
  EXPECT_FLOAT_EQ(coated.alpha_x, 0.4f);
  EXPECT_FLOAT_EQ(coated.alpha_y, 0.7f);
  // A hair's own number spreads roughness: at 0, by all that is asked for downwards.
  EXPECT_FLOAT_EQ(lobe_of("COLOR", {{"Roughness", 0.4f}, {"Random Roughness", 0.5f}}).alpha_x, 0.2f);
}

TEST(Compiler, huangs_hair_has_one_roughness_a_section_and_strengths) {
  const Compiled compiled(make_graph({make_node("BsdfHairPrincipled",
                                                {{"Roughness", 0.4f},
                                                 {"Radial Roughness", 0.9f},
                                                 {"Aspect Ratio", 0.6f},
                                                 {"R lobe", 0.1f},
                                                 {"TT lobe", 0.2f},
                                                 {"TRT lobe", 0.3f},
                                                 {"IOR", 1.4f},
                                                 {"Color", rgb(1, 1, 1)}},
                                                {{"model", std::string("HUANG")}})}));
  EXPECT_EQ(compiled.messages(), "");
  ASSERT_EQ(compiled.bsdf().lobes().size(), 1u);
  const Lobe lobe = compiled.bsdf().lobes()[0];
  EXPECT_EQ(lobe.kind, LobeKind::hair_microfacets);
  EXPECT_FLOAT_EQ(lobe.alpha_x, 0.4f);
  EXPECT_FLOAT_EQ(lobe.alpha_y, 0.6f);
  EXPECT_FLOAT_EQ(lobe.eta, 1.4f);
  EXPECT_EQ(lobe.f0, Color(0.0f));
  EXPECT_EQ(lobe.f90, Color(0.1f, 0.2f, 0.3f));
}

TEST(Compiler, films_follow_the_version_of_cycles) {
  ShaderGraph graph = make_graph(
      {make_node("BsdfPrincipled", {{"Metallic", 0.5f}, {"Thin Film Thickness", 400.0f}}, {{"generation", 2.0f}})});
  for (const int version : {405, 500}) {
    graph.cycles_version = version;
    const Compiled compiled(graph);
    int films = 0;
    const Bsdf bsdf = compiled.bsdf(front_point());
    for (const Lobe& lobe : bsdf.lobes()) {
      if (lobe.fresnel == FresnelMode::film_f82) films += 1;
      if (lobe.fresnel == FresnelMode::film_dielectric) films += 10;
      EXPECT_EQ(lobe.fitted_film, version < 500);
    }
    EXPECT_EQ(films, version < 500 ? 10 : 11);
  }
}

}  // namespace
}  // namespace lambent
