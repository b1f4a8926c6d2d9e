#include "engine/description/json_codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/description/test_values.h"

namespace lambent::description {
namespace {

using testing::HasSubstr;

const ArrayResolver k_no_arrays = [](const std::string&) { return nullptr; };

/// The messages about `edit`, decoded alone, joined; "accepted" in front if it was.
std::string findings(const Json& edit, const ArrayResolver& arrays = k_no_arrays, const DecodeLimits& limits = {}) {
  Report report;
  const Json message{{"type", "transaction"}, {"epoch", 1}, {"edits", Json::array({edit})}};
  std::string text = decode_transaction(message, arrays, report, limits) ? "accepted" : "refused";
  for (const Message& found : report.messages()) text += " | " + found.text;
  return text;
}

std::string findings_of(const char* kind, const char* value) {
  return findings({{"op", "upsert"}, {"kind", kind}, {"id", "x"}, {"value", Json::parse(value)}});
}

TEST(JsonCodec, every_kind_with_every_member_survives_the_round_trip) {
  ArrayCollector collector;
  const Json first = encode_transaction(full_transaction(), collector);
  Report report;
  const Result<Json> parsed = parse_json(json_text(first));
  ASSERT_TRUE(parsed);
  const auto decoded = decode_transaction(*parsed, resolver_of(collector), report);
  ASSERT_TRUE(decoded) << report.messages().front().text;
  EXPECT_TRUE(report.messages().empty()) << report.messages().front().text;
  EXPECT_EQ(decoded->epoch, 42);
  ArrayCollector again;
  EXPECT_EQ(encode_transaction(*decoded, again), first);
  EXPECT_EQ(again.arrays().size(), collector.arrays().size());
}

TEST(JsonCodec, no_member_of_the_full_values_is_at_its_default) {
  // So the round trip above would notice a member that one direction forgets.
  ArrayCollector collector;
  const Json full = encode_transaction(full_transaction(), collector);
  const Json settings_default = encode_edit(Upsert{"render", Settings{}}, collector)["value"];
  const Json light_default = encode_edit(Upsert{"light", Light{}}, collector)["value"];
  for (const Json& edit : full["edits"]) {
    if (edit["op"] != "upsert") continue;
    const Json& reference = edit["kind"] == "settings" ? settings_default : light_default;
    if (edit["kind"] != "settings" && edit["kind"] != "light") continue;
    for (const auto& [name, value] : edit["value"].items())
      if (reference.contains(name)) {
        EXPECT_NE(value, reference[name]) << edit["kind"] << " " << name;
      }
  }
}

TEST(JsonCodec, absent_and_null_members_have_the_defaults_of_the_protocol) {
  Report report;
  const Json message = Json::parse(R"({"type":"transaction","epoch":3,"edits":[
    {"op":"upsert","kind":"settings","id":"render","value":{"world":null,"samples":null}},
    {"op":"upsert","kind":"light","id":"l","value":{"type":"spot"}}]})");
  const auto decoded = decode_transaction(message, k_no_arrays, report);
  ASSERT_TRUE(decoded);
  const auto& settings = std::get<Settings>(std::get<Upsert>(decoded->edits[0]).value);
  EXPECT_EQ(settings.samples, 128);
  EXPECT_EQ(settings.world, "");
  EXPECT_EQ(settings.integrator, "PT");
  EXPECT_EQ(settings.pixel_filter, PixelFilter::blackman_harris);
  const auto& light = std::get<Light>(std::get<Upsert>(decoded->edits[1]).value);
  EXPECT_EQ(light.type, LightType::spot);
  EXPECT_EQ(light.energy, 10.0f);
  EXPECT_EQ(light.max_bounces, 1024);
  EXPECT_FLOAT_EQ(light.spread_rad, k_pi);
}

TEST(JsonCodec, a_single_transform_becomes_an_array_of_one) {
  Report report;
  const Json message = Json::parse(R"({"epoch":3,"edits":[{"op":"upsert","kind":"object","id":"o","value":
    {"mesh":"m","transform":[1,0,0,5,0,1,0,6,0,0,1,7]}}]})");
  const auto decoded = decode_transaction(message, k_no_arrays, report);
  ASSERT_TRUE(decoded);
  const auto& object = std::get<Object>(std::get<Upsert>(decoded->edits[0]).value);
  EXPECT_EQ(object.transforms->shape, (std::vector<uint64_t>{1, 3, 4}));
  EXPECT_EQ(object.transforms->as<float>()[11], 7.0f);
}

TEST(JsonCodec, unknown_members_are_accepted_with_a_warning_that_names_datablock_and_member) {
  EXPECT_EQ(findings_of("light", R"({"name":"Key","type":"sun","colour":[1,1,1]})"),
            "accepted | light 'Key': 'colour' is not known to this version and was ignored.");
  EXPECT_THAT(
      findings_of("camera", R"({"name":"C","transform":[1,0,0,0,0,1,0,0,0,0,1,0],"depth_of_field":{"fstops":2}})"),
      HasSubstr("camera 'C': 'depth_of_field.fstops'"));
}

TEST(JsonCodec, wrong_values_are_refused_with_the_name_of_datablock_and_member) {
  const std::tuple<const char*, const char*, const char*> cases[] = {
      {"light", R"({"name":"Key","type":"laser"})", "light 'Key': 'type' is 'laser', not one of point spot sun area"},
      {"light", R"({"name":"Key"})", "'type' is missing"},
      {"light", R"({"type":"sun","energy":1e39})", "light 'x': 'energy' is too large for a 32-bit number"},
      {"light", R"({"type":"sun","energy":true})", "'energy' is a boolean, not a number"},
      {"light", R"({"type":"sun","color":[1,1]})", "'color' is not a list of 3 numbers"},
      {"light", R"({"type":"sun","max_bounces":-1})", "'max_bounces' is outside 0 to"},
      {"light", R"({"type":"sun","max_bounces":1.5})", "'max_bounces' is a fraction"},
      {"light", R"({"type":"sun","shadows":1})", "'shadows' is a number, not a boolean"},
      {"light", R"({"type":"sun","graph":{"nodes":[{"type":"A","inputs":{"C":{"link":[1,"x"]}}}]}})",
       "'graph.nodes[0].inputs.C' is not a link"},
      {"material", R"({"graph":{"nodes":[{}]}})", "'graph.nodes[0].type' is missing"},
      {"material", R"({"graph":{"nodes":[],"outputs":{"surface":[0,"BSDF"]}}})", "'graph.outputs.surface' is not"},
      {"material", R"({"graph":{"nodes":[{"type":"A","properties":{"ramp":[[0,1]]}}]}})", "properties.ramp"},
      {"material", R"({"graph":{"nodes":[{"type":"A","properties":{"curves":[[[0,1e40]]]}}]}})", "properties.curves"},
      {"mesh", R"({"name":"Cube","triangles":{"array":"00000000000000000000000000000000"}})", "'positions' is missing"},
      {"mesh", R"({"name":"Cube","positions":{"array":"00000000000000000000000000000000"},"triangles":{"array":"x"}})",
       "names the array 00000000000000000000000000000000, which was not sent"},
      {"object", R"({"transform":[1,0,0,0,0,1,0,0,0,0,1,0]})", "'mesh' or 'light' must name"},
      {"object", R"({"mesh":"m"})", "'transform' is missing (and so is 'transforms')"},
      {"object", R"({"mesh":"m","transform":[1,0,0,0,0,1,0,0,0,0,1,0],"light_linking":{"receives":[1]}})",
       "'light_linking.receives' holds a number, not a string"},
      {"settings", R"({"width":0})", "'width' is outside 1 to"},
      {"settings", R"({"width":100000,"height":100000})", "the limit is"},
      {"settings", R"({"width":10,"height":10,"region":[0,0,11,5]})", "reaches outside the frame"},
      {"settings", R"({"region":[5,0,5,5]})", "'region' is empty"},
      {"settings", R"({"samples":18446744073709551615})", "'samples' is outside"},
      {"settings", R"({"seed":1e300})", "'seed' is outside"},
      {"settings", R"({"passes":[1]})", "'passes[0]' is neither a kind nor an object"},
      {"settings", R"({"passes":[{"name":"A"}]})", "'passes[0].kind' is missing"},
      {"settings", R"({"metadata":{"a":1}})", "'metadata.a' is a number, not a string"},
      {"image", R"({"path":"/a.png","pixels":{"array":"00000000000000000000000000000000"}})", "was not sent"},
      {"planet", R"({})", "'kind' is 'planet'"},
  };
  for (const auto& [kind, value, expected] : cases) {
    const std::string found = findings_of(kind, value);
    EXPECT_THAT(found, HasSubstr(expected)) << kind << value;
    EXPECT_THAT(found, HasSubstr("refused")) << kind << value;
  }
}

TEST(JsonCodec, arrays_of_the_wrong_type_or_shape_are_refused) {
  ArrayCollector collector;
  const Json mesh = encode_edit(Upsert{"m", full_mesh()}, collector);
  const ArrayResolver arrays = resolver_of(collector);
  EXPECT_EQ(findings(mesh, arrays), "accepted");
  for (const char* member : {"positions", "triangles", "triangle_corners", "triangle_faces", "triangle_materials"}) {
    Json broken = mesh;
    broken["value"][member] = mesh["value"]["attributes"][0]["values"];
    EXPECT_THAT(findings(broken, arrays), HasSubstr("is an array f32[3][2], not")) << member;
  }
}

TEST(JsonCodec, anything_that_is_not_a_transaction_is_refused_without_an_exception) {
  for (const char* text :
       {"1", "[]", "{}", R"({"epoch":1})", R"({"epoch":-1,"edits":[]})", R"({"epoch":"1","edits":[]})",
        R"({"epoch":1,"edits":{}})", R"({"epoch":1,"edits":[1]})", R"({"epoch":1,"edits":[{}]})",
        R"({"epoch":1,"edits":[{"op":"upsert"}]})", R"({"epoch":1,"edits":[{"op":"delete"}]})",
        R"({"epoch":1,"edits":[{"op":"remove","kind":"mesh","id":""}]})"}) {
    Report report;
    EXPECT_FALSE(decode_transaction(Json::parse(text), k_no_arrays, report)) << text;
    EXPECT_TRUE(report.has_errors()) << text;
  }
}

TEST(JsonCodec, decoding_stops_when_it_is_abandoned) {
  std::atomic<bool> abandoned{true};
  DecodeLimits limits;
  limits.abandoned = &abandoned;
  EXPECT_THAT(findings({{"op", "clear"}}, k_no_arrays, limits), HasSubstr("abandoned"));
  abandoned = false;
  EXPECT_EQ(findings({{"op", "clear"}}, k_no_arrays, limits), "accepted");
}

TEST(Apply, edits_work_in_order_and_unchanged_values_keep_their_pointers) {
  SceneDescription scene;
  apply(full_transaction(), scene);
  EXPECT_EQ(scene.images.size(), 3u);
  EXPECT_EQ(scene.settings->width, 320);
  const auto mesh = scene.meshes.at("mesh");
  Transaction change;
  change.edits.emplace_back(Remove{Kind::material, "material"});
  change.edits.emplace_back(Remove{Kind::material, "none"});
  change.edits.emplace_back(Upsert{"b", Camera{}});
  change.edits.emplace_back(Remove{Kind::settings, "render"});
  apply(std::move(change), scene);
  EXPECT_EQ(scene.meshes.at("mesh"), mesh);
  EXPECT_TRUE(scene.materials.empty());
  EXPECT_EQ(scene.cameras.size(), 2u);
  EXPECT_EQ(scene.settings->width, Settings{}.width);
  Transaction clearing;
  clearing.edits.emplace_back(Upsert{"c", Camera{}});
  clearing.edits.emplace_back(Clear{});
  apply(std::move(clearing), scene);
  EXPECT_TRUE(scene.cameras.empty());
  EXPECT_TRUE(scene.meshes.empty());
}

}  // namespace
}  // namespace lambent::description
