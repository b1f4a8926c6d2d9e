// Definitions of the nodes with values: inputs, colours, arithmetic, vectors. Textures: compile_textures.cpp.
// Long because it is one table: a few lines a node.
#include <algorithm>

#include "engine/shading/compile_textures.h"
#include "engine/shading/compiler.h"
#include "engine/shading/noise.h"

namespace lambent {
namespace {

using S = const std::string&;

TypedValue number_of(const Value& v) { return {v, SocketKind::number}; }
TypedValue color_of(const Value& v) { return {v, SocketKind::color}; }
TypedValue vector_of(const Value& v) { return {v, SocketKind::vector}; }

// --- Inputs of the scene
// -----------------------------------------------------------------------------------------------

TypedValue value_node(Compiler& c, int n, S, int shift) {
  return number_of(c.number(n, "Value", c.property(n, "value", 0.0f), shift));
}
TypedValue rgb_node(Compiler& c, int n, S, int shift) { return color_of(c.color(n, "Color", Color(0.5f), shift)); }

TypedValue texture_coordinate(Compiler& c, int n, S socket, int shift) {
  Expressions& e = c.expressions();
  if (c.flag(n, "from_instancer", false) && (socket == "UV" || socket == "Generated"))
    c.warn_unsupported(n, "coordinates of the instancer are taken of the object itself");
  if (socket == "UV") return vector_of(c.uv(shift));
  if (socket == "Generated") return vector_of(c.generated(shift));
  if (socket == "Normal") return vector_of(e.operation(Op::object_normal, 0, {}, 3));
  if (socket == "Object") {
    if (!c.text(n, "object", "").empty())
      c.warn_unsupported(n, "coordinates of another object are taken of the object itself");
    return vector_of(c.object_position(shift));
  }
  if (socket == "Reflection") return vector_of(e.operation(Op::reflection, 0, {}, 3));
  if (socket == "Camera") return vector_of(e.operation(Op::camera_position, 0, {}, 3));
  if (socket == "Window") {
    if (shift) c.program().traits.needs_differentials = true;
    return vector_of(e.operation(Op::window_position, shift, {}, 3));
  }
  c.warn_unsupported(n, socket + " coordinates are replaced by Generated ones");
  return vector_of(c.generated(shift));
}

TypedValue uv_map(Compiler& c, int n, S, int shift) {
  if (c.is_world()) return vector_of(c.uv(shift));
  return vector_of(c.expressions().part(c.attribute(AttributeRequest::Kind::uv, c.text(n, "uv_map", ""), shift), 0, 3));
}

TypedValue attribute_outputs(Compiler& c, const Value& rgba, S socket) {
  Expressions& e = c.expressions();
  if (socket == "Alpha") return number_of(e.part(rgba, 3, 1));
  const Value rgb = e.part(rgba, 0, 3);
  if (socket == "Fac") return number_of(e.operation(Op::average, 0, {rgb}, 1));
  return socket == "Vector" ? vector_of(rgb) : color_of(rgb);
}
TypedValue vertex_color(Compiler& c, int n, S socket, int shift) {
  return attribute_outputs(c, c.attribute(AttributeRequest::Kind::color, c.text(n, "layer_name", ""), shift), socket);
}
TypedValue attribute_node(Compiler& c, int n, S socket, int shift) {
  const std::string kind = c.text(n, "attribute_type", "GEOMETRY"), name = c.text(n, "attribute_name", "");
  if (kind == "OBJECT" || kind == "INSTANCER")
    return attribute_outputs(
        c, c.attribute(AttributeRequest::Kind::object, kind == "OBJECT" ? name : kind + ":" + name, 0), socket);
  if (kind != "GEOMETRY") c.warn_unsupported(n, "attributes of kind '" + kind + "' are looked for on the mesh");
  if (socket == "Fac") {
    Expressions& e = c.expressions();
    const Value x = e.part(c.attribute(AttributeRequest::Kind::number, name, shift), 0, 1);
    if (!c.follows(500)) return number_of(x);
    // Cycles from 5.0 on takes the mean of three such numbers, whose last bit hashes tell.
    return number_of(e.operation(Op::average, 1, {e.operation(Op::combine, 0, {x, x, x}, 3)}, 1));
  }
  return attribute_outputs(c, c.attribute(AttributeRequest::Kind::named, name, shift), socket);
}

TypedValue geometry(Compiler& c, int n, S socket, int shift) {
  Expressions& e = c.expressions();
  if (socket == "Position") return vector_of(c.position(shift));
  if (socket == "Normal") return vector_of(c.normal(shift));
  if (socket == "Tangent") return vector_of(c.tangent(0));
  if (socket == "True Normal") return vector_of(e.operation(Op::true_normal, 0, {}, 3));
  if (socket == "Incoming") return vector_of(e.operation(Op::incoming, 0, {}, 3));
  if (socket == "Parametric") return vector_of(e.operation(Op::parametric, 0, {}, 3));
  if (socket == "Backfacing") return number_of(e.operation(Op::backfacing, 0, {}, 1));
  // Clients work these out, since triangles do not tell edges.
  const char* name = socket == "Pointiness" ? ".pointiness" : ".random_per_island";
  return number_of(e.part(c.attribute(AttributeRequest::Kind::number, name, shift), 0, 1));
}

TypedValue light_path(Compiler& c, int n, S socket, int) {
  static const std::map<std::string, LightPathField> fields{{"Is Camera Ray", LightPathField::camera},
                                                            {"Is Shadow Ray", LightPathField::shadow},
                                                            {"Is Diffuse Ray", LightPathField::diffuse},
                                                            {"Is Glossy Ray", LightPathField::glossy},
                                                            {"Is Singular Ray", LightPathField::singular},
                                                            {"Is Reflection Ray", LightPathField::reflection},
                                                            {"Is Transmission Ray", LightPathField::transmission},
                                                            {"Is Volume Scatter Ray", LightPathField::volume_scatter},
                                                            {"Ray Length", LightPathField::length},
                                                            {"Ray Depth", LightPathField::depth},
                                                            {"Diffuse Depth", LightPathField::diffuse_depth},
                                                            {"Glossy Depth", LightPathField::glossy_depth},
                                                            {"Transparent Depth", LightPathField::transparent_depth},
                                                            {"Transmission Depth", LightPathField::transmission_depth}};
  const auto field = fields.find(socket);
  if (field == fields.end()) {
    c.warn_unsupported(n, "'" + socket + "' is taken as 0");
    return number_of(c.expressions().number(0.0f));
  }
  return number_of(c.expressions().operation(Op::light_path, static_cast<int>(field->second), {}, 1));
}

TypedValue object_information(Compiler& c, int n, S socket, int) {
  Expressions& e = c.expressions();
  if (socket == "Location") return vector_of(e.operation(Op::object_location, 0, {}, 3));
  if (socket == "Object Index") return number_of(e.operation(Op::object_index, 0, {}, 1));
  if (socket == "Material Index") return number_of(e.operation(Op::material_index, 0, {}, 1));
  if (socket == "Random") return number_of(e.operation(Op::object_random, 0, {}, 1));
  const Value color = e.operation(Op::object_color, 0, {}, 4);
  return socket == "Alpha" ? number_of(e.part(color, 3, 1)) : color_of(e.part(color, 0, 3));
}

TypedValue camera_data(Compiler& c, int, S socket, int) {
  Expressions& e = c.expressions();
  if (socket == "View Distance") return number_of(e.operation(Op::view_distance, 0, {}, 1));
  if (socket == "View Z Depth") return number_of(e.operation(Op::view_depth, 0, {}, 1));
  return vector_of(e.operation(Op::view_vector, 0, {}, 3));
}

TypedValue wireframe(Compiler& c, int n, S, int shift) {
  const bool in_pixels = c.flag(n, "use_pixel_size", false);
  if (in_pixels) c.program().traits.needs_differentials = true;
  return number_of(c.expressions().operation(Op::wireframe, in_pixels, {c.number(n, "Size", 0.01f, shift)}, 1));
}

TypedValue light_falloff(Compiler& c, int n, S socket, int shift) {
  return number_of(c.expressions().operation(Op::light_falloff,
                                             socket == "Linear"     ? 1
                                             : socket == "Constant" ? 2
                                                                    : 0,
                                             {c.number(n, "Strength", 100, shift), c.number(n, "Smooth", 0, shift)},
                                             1));
}

// Nodes whose outputs are 0 on what Lambent renders: strands, particles, points and volumes of other kinds.
TypedValue nothing(Compiler& c, int, S, int) { return number_of(c.expressions().number(0.0f)); }
TypedValue no_color(Compiler& c, int n, S, int) {
  c.warn_unsupported(n, "it has no meaning in path tracing, black takes its place");
  return color_of(c.expressions().vector(Vec3(0.0f)));
}
TypedValue particle_information(Compiler& c, int, S socket, int) {
  c.program().traits.reads_particle = true;
  const auto field = [&](ParticleField what, int width) {
    return c.expressions().operation(Op::particle, static_cast<int>(what), {}, width);
  };
  if (socket == "Location") return vector_of(field(ParticleField::location, 3));
  if (socket == "Velocity") return vector_of(field(ParticleField::velocity, 3));
  if (socket == "Angular Velocity") return vector_of(field(ParticleField::angular_velocity, 3));
  return number_of(field(socket == "Index"      ? ParticleField::index
                         : socket == "Age"      ? ParticleField::age
                         : socket == "Lifetime" ? ParticleField::lifetime
                         : socket == "Size"     ? ParticleField::size
                                                : ParticleField::random,
                         1));
}

// What needs rays from within a shader.
TypedValue ambient_occlusion(Compiler& c, int n, S socket, int shift) {
  Expressions& e = c.expressions();
  const uint32_t variant = (c.flag(n, "inside", false) ? 1u : 0u) | (c.flag(n, "only_local", false) ? 2u : 0u);
  const Value open = e.operation(Op::ambient_occlusion, variant,
                                 {c.vector_or(n, "Normal", 0, &Compiler::normal), c.number(n, "Distance", 1.0f, 0),
                                  e.number(c.property(n, "samples", 16.0f))},
                                 1);
  if (socket == "AO") return number_of(open);
  return color_of(e.operation(Op::scale_color, 0, {c.color(n, "Color", Color(1.0f), shift), open}, 3));
}
TypedValue bevel(Compiler& c, int n, S, int) {
  Expressions& e = c.expressions();
  std::vector<Value> arguments{c.number(n, "Radius", 0.05f, 0), e.number(c.property(n, "samples", 4.0f))};
  const bool given = c.is_linked(n, "Normal");
  if (given) arguments.push_back(c.vector_or(n, "Normal", 0, &Compiler::normal));
  return vector_of(e.operation(Op::bevel, given ? 1u : 0u, arguments, 3));
}

/// Outputs "Attribute_ITEM" and, of colours, "Attribute_ITEM_Alpha"; the input "Value_ITEM" has the name.
TypedValue met_attribute(Compiler& c, int n, S socket, const Value& cast) {
  Expressions& e = c.expressions();
  constexpr std::string_view k_prefix = "Attribute_";
  std::string item = socket.starts_with(k_prefix) ? socket.substr(k_prefix.size()) : "";
  const bool alpha = item.ends_with("_Alpha");
  item = item.substr(0, item.find('_'));
  const std::string* text = c.input_text(n, ("Value_" + item).c_str());
  const std::string name = text ? *text : "";  // which no attribute has
  std::vector<std::string>& names = c.program().met_attributes;
  const auto found = std::find(names.begin(), names.end(), name);
  const auto index = static_cast<uint32_t>(found - names.begin());
  if (found == names.end()) names.push_back(name);
  const Value met = e.operation(Op::met_attribute, 0, {e.part(cast, 0, 1), e.part(cast, 9, 4)}, 5, index);
  if (alpha) return number_of(e.part(met, 3, 1));
  // Of which type the item is, sockets do not tell.
  const std::string type = c.text(n, ("type_" + item).c_str(), "RGBA");
  if (type == "FLOAT") return number_of(e.part(met, 4, 1));
  return type == "VECTOR" ? vector_of(e.part(met, 0, 3)) : color_of(e.part(met, 0, 3));
}

TypedValue raycast(Compiler& c, int n, S socket, int) {
  Expressions& e = c.expressions();
  const Value cast = e.operation(Op::raycast, c.flag(n, "only_local", false) ? 1 : 0,
                                 {c.vector_or(n, "Position", 0, &Compiler::position),
                                  c.vector_or(n, "Direction", 0, &Compiler::normal), c.number(n, "Length", 1.0f, 0)},
                                 13);
  if (socket == "Is Hit") return number_of(e.part(cast, 0, 1));
  if (socket == "Self Hit") return number_of(e.part(cast, 1, 1));
  if (socket == "Hit Distance") return number_of(e.part(cast, 2, 1));
  if (socket == "Hit Position") return vector_of(e.part(cast, 3, 3));
  if (socket == "Hit Normal") return vector_of(e.part(cast, 6, 3));
  return met_attribute(c, n, socket, cast);
}

TypedValue tangent_node(Compiler& c, int n, S, int) {
  Expressions& e = c.expressions();
  if (c.text(n, "direction_type", "RADIAL") == "UV_MAP") {
    const Value t = c.attribute(AttributeRequest::Kind::tangent, c.text(n, "uv_map", ""), 0);
    return vector_of(e.operation(Op::world_tangent, 0, {e.part(t, 0, 3)}, 3));
  }
  const Value radial = e.operation(Op::radial_tangent, c.choice(n, "axis", {"X", "Y", "Z"}), {c.generated(0)}, 3);
  return vector_of(e.operation(Op::world_tangent, 1, {radial}, 3));
}

// --- Colours
// -------------------------------------------------------------------------------------------------------------

const std::vector<const char*>& blend_names() {  // in the order of Blend
  static const std::vector<const char*> names{"MIX",      "ADD",        "MULTIPLY",     "SCREEN",     "OVERLAY",
                                              "SUBTRACT", "DIVIDE",     "DIFFERENCE",   "DARKEN",     "LIGHTEN",
                                              "DODGE",    "BURN",       "HUE",          "SATURATION", "VALUE",
                                              "COLOR",    "SOFT_LIGHT", "LINEAR_LIGHT", "EXCLUSION"};
  return names;
}
Value clamped(Compiler& c, const Value& x) {
  return c.expressions().operation(Op::clamp, 0, {x, c.expressions().number(0.0f), c.expressions().number(1.0f)}, 1);
}

TypedValue mix_rgb(Compiler& c, int n, S, int shift) {
  Expressions& e = c.expressions();
  const Value factor = clamped(c, c.number(n, "Fac", 0.5f, shift));
  Value mixed =
      e.operation(Op::blend, c.choice(n, "blend_type", blend_names()),
                  {factor, c.color(n, "Color1", Color(0.5f), shift), c.color(n, "Color2", Color(0.5f), shift)}, 3);
  if (c.flag(n, "use_clamp", false)) mixed = e.operation(Op::clamp_color, 0, {mixed}, 3);
  return color_of(mixed);
}

TypedValue mix_node(Compiler& c, int n, S socket, int shift) {
  Expressions& e = c.expressions();
  const bool clamp_factor = c.flag(n, "clamp_factor", true);
  const auto factor = [&] {
    const Value f = c.number(n, "Factor_Float", 0.5f, shift);
    return clamp_factor ? clamped(c, f) : f;
  };
  if (socket == "Result_Float")
    return number_of(e.operation(Op::mix_float, 0,
                                 {factor(), c.number(n, "A_Float", 0, shift), c.number(n, "B_Float", 0, shift)}, 1));
  if (socket == "Result_Vector") {
    const Value a = c.vector(n, "A_Vector", Vec3(0.0f), shift), b = c.vector(n, "B_Vector", Vec3(0.0f), shift);
    if (c.text(n, "factor_mode", "UNIFORM") == "UNIFORM")
      return vector_of(e.operation(Op::mix_vector, 0, {factor(), a, b}, 3));
    Value f = c.vector(n, "Factor_Vector", Vec3(0.5f), shift);
    if (clamp_factor) f = e.operation(Op::clamp_color, 0, {f}, 3);
    return vector_of(e.operation(Op::mix_vector_by_vector, 0, {f, a, b}, 3));
  }
  Value mixed =
      e.operation(Op::blend, c.choice(n, "blend_type", blend_names()),
                  {factor(), c.color(n, "A_Color", Color(0.5f), shift), c.color(n, "B_Color", Color(0.5f), shift)}, 3);
  if (c.flag(n, "clamp_result", false)) mixed = e.operation(Op::clamp_color, 0, {mixed}, 3);
  return color_of(mixed);
}

TypedValue invert(Compiler& c, int n, S, int shift) {
  return color_of(c.expressions().operation(
      Op::invert, 0, {c.number(n, "Fac", 1, shift), c.color(n, "Color", Color(0.0f), shift)}, 3));
}
TypedValue gamma(Compiler& c, int n, S, int shift) {
  return color_of(c.expressions().operation(
      Op::gamma, 0, {c.color(n, "Color", Color(1.0f), shift), c.number(n, "Gamma", 1, shift)}, 3));
}
TypedValue bright_contrast(Compiler& c, int n, S, int shift) {
  return color_of(c.expressions().operation(
      Op::bright_contrast, 0,
      {c.color(n, "Color", Color(1.0f), shift), c.number(n, "Bright", 0, shift), c.number(n, "Contrast", 0, shift)},
      3));
}
TypedValue hue_saturation(Compiler& c, int n, S, int shift) {
  return color_of(c.expressions().operation(
      Op::hue_saturation, 0,
      {c.number(n, "Hue", 0.5f, shift), c.number(n, "Saturation", 1, shift), c.number(n, "Value", 1, shift),
       c.number(n, "Fac", 1, shift), c.color(n, "Color", Color(0.8f), shift)},
      3));
}
TypedValue rgb_to_bw(Compiler& c, int n, S, int shift) {
  return number_of(c.expressions().operation(Op::luminance, 0, {c.color(n, "Color", Color(0.5f), shift)}, 1));
}

Value converted(Compiler& c, const Value& color, ColorModel model) {
  return c.expressions().operation(Op::convert_color, static_cast<int>(model), {color}, 3);
}
TypedValue separate_color(Compiler& c, int n, S socket, int shift) {
  Value color = c.color(n, "Color", Color(0.8f), shift);
  const std::string mode = c.text(n, "mode", "RGB");
  if (mode == "HSV") color = converted(c, color, ColorModel::rgb_to_hsv);
  if (mode == "HSL") color = converted(c, color, ColorModel::rgb_to_hsl);
  return number_of(c.expressions().part(color, socket == "Red" ? 0 : socket == "Green" ? 1 : 2, 1));
}
TypedValue combine_color(Compiler& c, int n, S, int shift) {
  Value color = c.expressions().operation(
      Op::combine, 0, {c.number(n, "Red", 0, shift), c.number(n, "Green", 0, shift), c.number(n, "Blue", 0, shift)}, 3);
  const std::string mode = c.text(n, "mode", "RGB");
  if (mode == "HSV") color = converted(c, color, ColorModel::hsv_to_rgb);
  if (mode == "HSL") color = converted(c, color, ColorModel::hsl_to_rgb);
  return color_of(color);
}
TypedValue separate_rgb(Compiler& c, int n, S socket, int shift) {
  return number_of(c.expressions().part(c.color(n, "Image", Color(0.8f), shift),
                                        socket == "R"   ? 0
                                        : socket == "G" ? 1
                                                        : 2,
                                        1));
}
TypedValue combine_rgb(Compiler& c, int n, S, int shift) {
  return color_of(c.expressions().operation(
      Op::combine, 0, {c.number(n, "R", 0, shift), c.number(n, "G", 0, shift), c.number(n, "B", 0, shift)}, 3));
}
TypedValue separate_hsv(Compiler& c, int n, S socket, int shift) {
  const Value hsv = converted(c, c.color(n, "Color", Color(0.8f), shift), ColorModel::rgb_to_hsv);
  return number_of(c.expressions().part(hsv, socket == "H" ? 0 : socket == "S" ? 1 : 2, 1));
}
TypedValue combine_hsv(Compiler& c, int n, S, int shift) {
  const Value hsv = c.expressions().operation(
      Op::combine, 0, {c.number(n, "H", 0, shift), c.number(n, "S", 0, shift), c.number(n, "V", 0, shift)}, 3);
  return color_of(converted(c, hsv, ColorModel::hsv_to_rgb));
}
TypedValue separate_xyz(Compiler& c, int n, S socket, int shift) {
  return number_of(c.expressions().part(c.vector(n, "Vector", Vec3(0.0f), shift),
                                        socket == "X"   ? 0
                                        : socket == "Y" ? 1
                                                        : 2,
                                        1));
}
TypedValue combine_xyz(Compiler& c, int n, S, int shift) {
  return vector_of(c.expressions().operation(
      Op::combine, 0, {c.number(n, "X", 0, shift), c.number(n, "Y", 0, shift), c.number(n, "Z", 0, shift)}, 3));
}
TypedValue blackbody(Compiler& c, int n, S, int shift) {
  return color_of(c.computed_color(Op::blackbody, {c.number(n, "Temperature", 1500, shift)}));
}

TypedValue wavelength(Compiler& c, int n, S, int shift) {
  return color_of(c.computed_color(Op::wavelength, {c.number(n, "Wavelength", 500, shift)}));
}

// Rows of the tables that ramps and curves are sampled into: as many as the Blender hands to its Cycles.
int table_rows(Compiler& c, int n) {
  return std::clamp(static_cast<int>(c.property(n, "table_rows", 256.0f)), 2, 4096);
}

TypedValue color_ramp(Compiler& c, int n, S socket, int shift) {
  const int rows = table_rows(c, n);
  auto stops = c.node(n).ramp;
  std::stable_sort(stops.begin(), stops.end(), [](const auto& a, const auto& b) { return a[0] < b[0]; });
  if (stops.empty()) stops = {{0, 0, 0, 0, 1}, {1, 1, 1, 1, 1}};
  const int mode = c.choice(n, "ramp_interpolation", {"LINEAR", "CONSTANT", "EASE"});
  std::vector<float> table;
  for (int row = 0; row < rows; ++row) {
    const float x = static_cast<float>(row) / (rows - 1);
    size_t next = 0;
    while (next < stops.size() && stops[next][0] <= x) ++next;
    for (int k = 1; k <= 4; ++k) {
      if (next == 0 || next == stops.size() || mode == 1) {
        table.push_back(stops[next == 0 ? 0 : next - 1][k]);
        continue;
      }
      float t = (x - stops[next - 1][0]) / (stops[next][0] - stops[next - 1][0]);
      if (mode == 2) t = t * t * (3.0f - 2.0f * t);
      table.push_back(lerp(stops[next - 1][k], stops[next][k], t));
    }
  }
  const auto index = static_cast<uint32_t>(c.program().tables.size());
  c.program().tables.push_back(std::move(table));
  const Value rgba = c.expressions().operation(Op::ramp, mode == 1, {c.number(n, "Fac", 0.5f, shift)}, 4, index);
  return socket == "Alpha" ? number_of(c.expressions().part(rgba, 3, 1)) : color_of(c.expressions().part(rgba, 0, 3));
}

// Height of a sampled curve (interleaved x, y, ascending) at x; straight beyond its ends.
float curve_at(const std::vector<float>& curve, float x) {
  const size_t points = curve.size() / 2;
  if (points == 0) return x;
  if (points == 1) return curve[1];
  size_t next = 1;
  while (next + 1 < points && curve[2 * next] < x) ++next;
  const float x0 = curve[2 * next - 2], x1 = curve[2 * next];
  const float t = x1 > x0 ? (x - x0) / (x1 - x0) : 0.0f;
  return lerp(curve[2 * next - 1], curve[2 * next + 1], t);
}

TypedValue curves(Compiler& c, int n, const char* input, const char* factor, const std::vector<int>& order,
                  int combined, SocketKind kind, int shift) {
  const int rows = table_rows(c, n);
  const auto& sampled = c.node(n).curves;
  float low = 0.0f, high = 1.0f;
  for (const auto& curve : sampled)
    if (curve.size() >= 4) low = std::min(low, curve[0]), high = std::max(high, curve[curve.size() - 2]);
  std::vector<float> table;
  for (int row = 0; row < rows; ++row) {
    const float x = lerp(low, high, static_cast<float>(row) / (rows - 1));
    for (const int channel : order) {
      float y = x;
      if (combined >= 0 && combined < static_cast<int>(sampled.size())) y = curve_at(sampled[combined], y);
      if (channel < static_cast<int>(sampled.size())) y = curve_at(sampled[channel], y);
      table.push_back(y);
    }
  }
  table.push_back(low);
  table.push_back(high);
  const bool straight = c.text(n, "extend", "EXTRAPOLATED") == "EXTRAPOLATED";
  const auto index = static_cast<uint32_t>(c.program().tables.size());
  c.program().tables.push_back(std::move(table));
  return {c.expressions().operation(Op::curves, straight,
                                    {c.number(n, factor, 1, shift), c.vector(n, input, Vec3(0.0f), shift)}, 3, index),
          kind};
}
// Blender stores R, G, B and then the combined curve, which is applied first.
TypedValue rgb_curves(Compiler& c, int n, S, int shift) {
  return curves(c, n, "Color", "Fac", {0, 1, 2}, 3, SocketKind::color, shift);
}
TypedValue vector_curves(Compiler& c, int n, S, int shift) {
  return curves(c, n, "Vector", "Fac", {0, 1, 2}, -1, SocketKind::vector, shift);
}
// The one curve goes into all three channels.
TypedValue float_curve(Compiler& c, int n, S, int shift) {
  const TypedValue curved = curves(c, n, "Value", "Factor", {0, 0, 0}, -1, SocketKind::vector, shift);
  return number_of(c.expressions().part(curved.value, 0, 1));
}

// --- Arithmetic
// ----------------------------------------------------------------------------------------------------------

TypedValue math(Compiler& c, int n, S, int shift) {
  static const std::vector<const char*> names{
      "ADD",          "SUBTRACT",     "MULTIPLY", "DIVIDE",     "MULTIPLY_ADD",   "POWER",     "LOGARITHM",
      "SQRT",         "INVERSE_SQRT", "ABSOLUTE", "EXPONENT",   "MINIMUM",        "MAXIMUM",   "LESS_THAN",
      "GREATER_THAN", "SIGN",         "COMPARE",  "SMOOTH_MIN", "SMOOTH_MAX",     "ROUND",     "FLOOR",
      "CEIL",         "TRUNC",        "FRACT",    "MODULO",     "FLOORED_MODULO", "WRAP",      "SNAP",
      "PINGPONG",     "SINE",         "COSINE",   "TANGENT",    "ARCSINE",        "ARCCOSINE", "ARCTANGENT",
      "ARCTAN2",      "SINH",         "COSH",     "TANH",       "RADIANS",        "DEGREES"};
  Value result = c.expressions().operation(
      Op::math, c.choice(n, "operation", names),
      {c.number(n, "Value", 0.5f, shift), c.number(n, "Value_001", 0.5f, shift), c.number(n, "Value_002", 0, shift)},
      1);
  if (c.flag(n, "use_clamp", false)) result = clamped(c, result);
  return number_of(result);
}

TypedValue vector_math(Compiler& c, int n, S socket, int shift) {
  static const std::vector<const char*> names{
      "ADD",     "SUBTRACT",    "MULTIPLY",    "DIVIDE",   "MULTIPLY_ADD", "CROSS_PRODUCT", "PROJECT",   "REFLECT",
      "REFRACT", "FACEFORWARD", "DOT_PRODUCT", "DISTANCE", "LENGTH",       "SCALE",         "NORMALIZE", "ABSOLUTE",
      "POWER",   "SIGN",        "MINIMUM",     "MAXIMUM",  "FLOOR",        "CEIL",          "FRACTION",  "MODULO",
      "WRAP",    "SNAP",        "SINE",        "COSINE",   "TANGENT",      "ROUND"};
  Expressions& e = c.expressions();
  const int operation = c.choice(n, "operation", names);
  const Value a = c.vector(n, "Vector", Vec3(0.0f), shift), b = c.vector(n, "Vector_001", Vec3(0.0f), shift);
  if (socket == "Value") return number_of(e.operation(Op::vector_math_float, operation, {a, b}, 1));
  return vector_of(e.operation(Op::vector_math, operation,
                               {a, b, c.vector(n, "Vector_002", Vec3(0.0f), shift), c.number(n, "Scale", 1, shift)},
                               3));
}

TypedValue map_range(Compiler& c, int n, S socket, int shift) {
  Expressions& e = c.expressions();
  const int type = c.choice(n, "interpolation_type", {"LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP"});
  const bool clamp = c.flag(n, "clamp", true) && type < 2;
  if (socket == "Vector") {
    const Value low = c.vector(n, "To_Min_FLOAT3", Vec3(0.0f), shift),
                high = c.vector(n, "To_Max_FLOAT3", Vec3(1.0f), shift);
    Value mapped = e.operation(
        Op::map_range_vector, type,
        {c.vector(n, "Vector", Vec3(0.0f), shift), c.vector(n, "From_Min_FLOAT3", Vec3(0.0f), shift),
         c.vector(n, "From_Max_FLOAT3", Vec3(1.0f), shift), low, high, c.vector(n, "Steps_FLOAT3", Vec3(4.0f), shift)},
        3);
    if (clamp) {
      std::vector<Value> parts;
      for (int k = 0; k < 3; ++k)
        parts.push_back(
            e.operation(Op::clamp_range, 0, {e.part(mapped, k, 1), e.part(low, k, 1), e.part(high, k, 1)}, 1));
      mapped = e.operation(Op::combine, 0, parts, 3);
    }
    return vector_of(mapped);
  }
  const Value low = c.number(n, "To Min", 0, shift), high = c.number(n, "To Max", 1, shift);
  Value mapped = e.operation(Op::map_range, type,
                             {c.number(n, "Value", 1, shift), c.number(n, "From Min", 0, shift),
                              c.number(n, "From Max", 1, shift), low, high, c.number(n, "Steps", 4, shift)},
                             1);
  if (clamp) mapped = e.operation(Op::clamp_range, 0, {mapped, low, high}, 1);
  return number_of(mapped);
}

TypedValue clamp_node(Compiler& c, int n, S, int shift) {
  const Op op = c.text(n, "clamp_type", "MINMAX") == "RANGE" ? Op::clamp_range : Op::clamp;
  return number_of(c.expressions().operation(
      op, 0, {c.number(n, "Value", 1, shift), c.number(n, "Min", 0, shift), c.number(n, "Max", 1, shift)}, 1));
}

// --- Vectors
// -------------------------------------------------------------------------------------------------------------

TypedValue mapping(Compiler& c, int n, S, int shift) {
  return vector_of(
      c.expressions().operation(Op::mapping, c.choice(n, "vector_type", {"POINT", "TEXTURE", "VECTOR", "NORMAL"}),
                                {c.vector(n, "Vector", Vec3(0.0f), shift), c.vector(n, "Location", Vec3(0.0f), shift),
                                 c.vector(n, "Rotation", Vec3(0.0f), shift), c.vector(n, "Scale", Vec3(1.0f), shift)},
                                3));
}

TypedValue vector_rotate(Compiler& c, int n, S, int shift) {
  const int type = c.choice(n, "rotation_type", {"AXIS_ANGLE", "X_AXIS", "Y_AXIS", "Z_AXIS", "EULER_XYZ"});
  return vector_of(
      c.expressions().operation(Op::vector_rotate, type | (c.flag(n, "invert", false) ? 16 : 0),
                                {c.vector(n, "Vector", Vec3(0.0f), shift), c.vector(n, "Center", Vec3(0.0f), shift),
                                 c.vector(n, "Axis", Vec3(0, 0, 1), shift), c.number(n, "Angle", 0, shift),
                                 c.vector(n, "Rotation", Vec3(0.0f), shift)},
                                3));
}

TypedValue vector_transform(Compiler& c, int n, S, int shift) {
  const Value v = c.vector(n, "Vector", Vec3(0.5f), shift);
  const int from = c.choice(n, "convert_from", {"WORLD", "OBJECT", "CAMERA"});
  const int to = c.choice(n, "convert_to", {"OBJECT", "WORLD", "CAMERA"});
  constexpr int k_spaces[] = {1, 0, 2};
  const int kind = c.choice(n, "vector_type", {"VECTOR", "POINT", "NORMAL"});
  // Normals: Cycles before 4.0 takes them for directions.
  const int rule = kind == 2 && c.follows(400) ? 3 : kind;
  return vector_of(c.expressions().operation(Op::vector_transform, from + 3 * k_spaces[to] + 9 * rule, {v}, 3));
}

TypedValue normal_node(Compiler& c, int n, S socket, int shift) {
  Vec3 stored(0, 0, 1);
  if (const auto found = c.node(n).properties.find("direction"); found != c.node(n).properties.end())
    if (const auto* v = std::get_if<GraphNumbers>(&found->second); v && v->size() >= 3)
      stored = normalize(Vec3((*v)[0], (*v)[1], (*v)[2]));
  const Value direction = c.expressions().vector(stored);
  if (socket == "Normal") return vector_of(direction);
  return number_of(
      c.expressions().operation(Op::normal_dot, 0, {direction, c.vector(n, "Normal", Vec3(0, 0, 1), shift)}, 1));
}

TypedValue fresnel(Compiler& c, int n, S, int shift) {
  return number_of(c.expressions().operation(
      Op::fresnel, 0, {c.number(n, "IOR", 1.45f, shift), c.vector_or(n, "Normal", 0, &Compiler::normal)}, 1));
}
TypedValue layer_weight(Compiler& c, int n, S socket, int shift) {
  return number_of(c.expressions().operation(
      socket == "Fresnel" ? Op::layer_weight_fresnel : Op::layer_weight_facing, 0,
      {c.number(n, "Blend", 0.5f, shift), c.vector_or(n, "Normal", 0, &Compiler::normal)}, 1));
}

TypedValue normal_map(Compiler& c, int n, S, int) {
  const int space = c.choice(n, "space", {"TANGENT", "OBJECT", "WORLD", "BLENDER_OBJECT", "BLENDER_WORLD"});
  std::vector<Value> arguments{c.color(n, "Color", Color(0.5f, 0.5f, 1.0f), 0), c.number(n, "Strength", 1, 0),
                               c.normal(0)};
  if (space == 0) arguments.push_back(c.attribute(AttributeRequest::Kind::tangent, c.text(n, "uv_map", ""), 0));
  const bool newer = c.follows(400), directx = c.text(n, "convention", "OPENGL") == "DIRECTX";
  const bool original = c.displaces() && c.follows(500) && space == 0 && c.text(n, "base", "ORIGINAL") == "ORIGINAL";
  if (original) arguments.push_back(c.attribute(AttributeRequest::Kind::undisplaced_normal, "", 0));
  const int variant = space + (newer ? k_normal_map_newer : 0) + (directx ? k_normal_map_directx : 0) +
                      (original ? k_normal_map_original : 0);
  return vector_of(c.expressions().operation(Op::normal_map, variant, arguments, 3));
}

TypedValue bump(Compiler& c, int n, S, int) {
  const Value normal = c.vector_or(n, "Normal", 0, &Compiler::normal);
  if (!c.is_linked(n, "Height")) return vector_of(normal);
  const Value h = c.number(n, "Height", 1, 0), hx = c.number(n, "Height", 1, 1), hy = c.number(n, "Height", 1, 2);
  if (h == hx && h == hy) return vector_of(normal);
  c.program().traits.needs_differentials = true;
  const Value width = c.number(n, "Filter Width", 1.0f, 0);
  c.filter_bumps(c.expressions().is_constant(width) ? *c.expressions().constant(width) : 1.0f);
  return vector_of(c.expressions().operation(
      Op::bump, (c.flag(n, "invert", false) ? k_bump_inverted : 0) | (c.follows(400) ? k_bump_newer : 0),
      {normal, c.number(n, "Strength", 1, 0), c.number(n, "Distance", 1, 0), h, hx, hy}, 3));
}

// Op::vector_transform's variant for vectors from object to world space and back.
constexpr int k_object_to_world = 1, k_world_to_object = 3;

TypedValue displacement(Compiler& c, int n, S, int shift) {
  Expressions& e = c.expressions();
  const Value height =
      e.operation(Op::math, static_cast<int>(MathOperation::subtract),
                  {c.number(n, "Height", 0, shift), c.number(n, "Midlevel", 0.5f, shift), e.number(0)}, 1);
  const Value scaled = e.operation(Op::math, static_cast<int>(MathOperation::multiply),
                                   {height, c.number(n, "Scale", 1, shift), e.number(0)}, 1);
  if (e.is_number(scaled, 0.0f)) return vector_of(e.vector(Vec3(0.0f)));
  const bool given = c.is_linked(n, "Normal"), world = c.text(n, "space", "WORLD") == "WORLD";
  const Value normal = given   ? c.vector(n, "Normal", Vec3(0, 0, 1), shift)
                       : world ? e.operation(Op::normal, 0, {}, 3)
                               : e.operation(Op::object_normal, 0, {}, 3);
  if (world) return vector_of(e.operation(Op::scale_color, 0, {normal, scaled}, 3));
  const Value along = given ? e.operation(Op::object_normal_of, 0, {normal}, 3) : normal;
  return vector_of(
      e.operation(Op::vector_transform, k_object_to_world, {e.operation(Op::scale_color, 0, {along, scaled}, 3)}, 3));
}

TypedValue vector_displacement(Compiler& c, int n, S, int shift) {
  Expressions& e = c.expressions();
  const auto vector_operation = [&](VectorOperation operation, const Value& a, const Value& b) {
    return e.operation(Op::vector_math, static_cast<int>(operation), {a, b, e.vector(Vec3(0.0f)), e.number(1.0f)}, 3);
  };
  const Value middle = c.number(n, "Midlevel", 0, shift);
  const Value above = vector_operation(VectorOperation::subtract, c.vector(n, "Vector", Vec3(0.0f), shift),
                                       e.operation(Op::combine, 0, {middle, middle, middle}, 3));
  Value offset = e.operation(Op::scale_color, 0, {above, c.number(n, "Scale", 1, shift)}, 3);
  const std::string space = c.text(n, "space", "TANGENT");
  if (space == "TANGENT") {  // along the tangent, the normal and the bitangent
    const Value t = c.attribute(AttributeRequest::Kind::tangent, "", 0);
    const Value normal = e.operation(Op::object_normal, 0, {}, 3);
    const Value tangent = vector_operation(
        VectorOperation::normalize, e.operation(Op::vector_transform, k_world_to_object, {e.part(t, 0, 3)}, 3), normal);
    const Value across =
        vector_operation(VectorOperation::normalize, vector_operation(VectorOperation::cross, normal, tangent), normal);
    const Value bitangent = e.operation(Op::scale_color, 0, {across, e.part(t, 3, 1)}, 3);
    const auto scaled = [&](const Value& axis, int k) {
      return e.operation(Op::scale_color, 0, {axis, e.part(offset, k, 1)}, 3);
    };
    offset = vector_operation(VectorOperation::add,
                              vector_operation(VectorOperation::add, scaled(tangent, 0), scaled(normal, 1)),
                              scaled(bitangent, 2));
  }
  if (space != "WORLD") offset = e.operation(Op::vector_transform, k_object_to_world, {offset}, 3);
  return vector_of(offset);
}

}  // namespace

const std::map<std::string, ValueNode>& value_stand_ins() {
  static const std::map<std::string, ValueNode> nodes{{"ShaderToRGB", no_color}};
  return nodes;
}

const std::map<std::string, ValueNode>& value_nodes() {
  static const std::map<std::string, ValueNode> nodes = [] {
    std::map<std::string, ValueNode> all{{"Value", value_node},
                                         {"RGB", rgb_node},
                                         {"TexCoord", texture_coordinate},
                                         {"UVMap", uv_map},
                                         {"VertexColor", vertex_color},
                                         {"Attribute", attribute_node},
                                         {"AmbientOcclusion", ambient_occlusion},
                                         {"Bevel", bevel},
                                         {"Raycast", raycast},
                                         {"NewGeometry", geometry},
                                         {"LightPath", light_path},
                                         {"ObjectInfo", object_information},
                                         {"ParticleInfo", particle_information},
                                         {"CameraData", camera_data},
                                         {"Tangent", tangent_node},
                                         {"MixRGB", mix_rgb},
                                         {"Mix", mix_node},
                                         {"Invert", invert},
                                         {"Gamma", gamma},
                                         {"BrightContrast", bright_contrast},
                                         {"HueSaturation", hue_saturation},
                                         {"RGBToBW", rgb_to_bw},
                                         {"SeparateColor", separate_color},
                                         {"CombineColor", combine_color},
                                         {"SeparateRGB", separate_rgb},
                                         {"CombineRGB", combine_rgb},
                                         {"SeparateHSV", separate_hsv},
                                         {"CombineHSV", combine_hsv},
                                         {"SeparateXYZ", separate_xyz},
                                         {"CombineXYZ", combine_xyz},
                                         {"Blackbody", blackbody},
                                         {"ValToRGB", color_ramp},
                                         {"RGBCurve", rgb_curves},
                                         {"VectorCurve", vector_curves},
                                         {"FloatCurve", float_curve},
                                         {"Math", math},
                                         {"VectorMath", vector_math},
                                         {"MapRange", map_range},
                                         {"Clamp", clamp_node},
                                         {"Mapping", mapping},
                                         {"VectorRotate", vector_rotate},
                                         {"VectorTransform", vector_transform},
                                         {"Normal", normal_node},
                                         {"Fresnel", fresnel},
                                         {"LayerWeight", layer_weight},
                                         {"NormalMap", normal_map},
                                         {"Bump", bump},
                                         {"Displacement", displacement},
                                         {"VectorDisplacement", vector_displacement},
                                         {"Wavelength", wavelength},
                                         {"Wireframe", wireframe},
                                         {"LightFalloff", light_falloff},
                                         {"HairInfo", nothing},
                                         {"PointInfo", nothing},
                                         {"VolumeInfo", nothing},
                                         {"UVAlongStroke", nothing}};
    for (const auto& [type, definition] : value_stand_ins()) all.emplace(type, definition);
    for (const auto& [type, definition] : texture_nodes()) all.emplace(type, definition);
    return all;
  }();
  return nodes;
}

}  // namespace lambent
