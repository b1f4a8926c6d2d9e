#include "engine/shading/compile_textures.h"

#include "engine/shading/sky.h"

namespace lambent {
namespace {

using S = const std::string&;

TypedValue number_of(const Value& v) { return {v, SocketKind::number}; }
TypedValue color_of(const Value& v) { return {v, SocketKind::color}; }

TypedValue color_and_alpha(Compiler& c, const Value& rgba, bool alpha) {
  return alpha ? number_of(c.expressions().part(rgba, 3, 1)) : color_of(c.expressions().part(rgba, 0, 3));
}

TypedValue image(Compiler& c, int n, S socket, int shift) {
  static constexpr Projection k_projections[] = {Projection::flat, Projection::box, Projection::sphere,
                                                 Projection::tube};
  const Projection projection = k_projections[c.choice(n, "projection", {"FLAT", "BOX", "SPHERE", "TUBE"})];
  const uint32_t texture = c.texture(n, projection);
  const Value at = c.vector_or(n, "Vector", shift, &Compiler::uv);
  return color_and_alpha(c, c.expressions().operation(Op::texture_image, 0, {at}, 4, texture), socket == "Alpha");
}

TypedValue environment(Compiler& c, int n, S, int shift) {
  const bool ball = c.choice(n, "projection", {"EQUIRECTANGULAR", "MIRROR_BALL"}) == 1;
  const uint32_t texture = c.texture(n, ball ? Projection::mirror_ball : Projection::equirectangular);
  const Value at = c.vector_or(n, "Vector", shift, &Compiler::position);
  return color_and_alpha(c, c.expressions().operation(Op::texture_environment, 0, {at}, 4, texture), false);
}

TypedValue noise(Compiler& c, int n, S socket, int shift) {
  Expressions& e = c.expressions();
  const int dimensions = c.choice(n, "noise_dimensions", {"3D", "1D", "2D", "4D"});
  static constexpr int k_dimensions[] = {3, 1, 2, 4};
  const std::string type = c.text(n, "noise_type", "FBM");
  if (type != "FBM") c.warn_unsupported(n, "noise type '" + type + "' is rendered as fractal Brownian motion");
  // Before 4.0 the result was always normalised; later the node says.
  const bool normalize = c.flag(n, "normalize", true);
  const bool color = socket == "Color";
  const Value result = e.operation(
      Op::noise, k_dimensions[dimensions] | (normalize ? 0 : 8) | (color ? 16 : 0),
      {c.vector_or(n, "Vector", shift, &Compiler::generated), c.number(n, "W", 0, shift),
       c.number(n, "Scale", 5, shift), c.number(n, "Detail", 2, shift), c.number(n, "Roughness", 0.5f, shift),
       c.number(n, "Lacunarity", 2, shift), c.number(n, "Distortion", 0, shift)},
      4);
  return color_and_alpha(c, result, !color);
}

TypedValue checker(Compiler& c, int n, S socket, int shift) {
  const Value result = c.expressions().operation(
      Op::checker, 0,
      {c.vector_or(n, "Vector", shift, &Compiler::generated), c.color(n, "Color1", Color(0.8f), shift),
       c.color(n, "Color2", Color(0.2f), shift), c.number(n, "Scale", 5, shift)},
      4);
  return color_and_alpha(c, result, socket != "Color");
}

TypedValue gradient(Compiler& c, int n, S socket, int shift) {
  static const std::vector<const char*> types{"LINEAR",    "QUADRATIC",        "EASING", "DIAGONAL",
                                              "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL"};
  const Value f = c.expressions().operation(Op::gradient, c.choice(n, "gradient_type", types),
                                            {c.vector_or(n, "Vector", shift, &Compiler::generated)}, 1);
  return socket != "Color" ? number_of(f) : color_of(c.to_vector(number_of(f)));
}

TypedValue sky(Compiler& c, int n, S, int shift) {
  const std::string type = c.text(n, "sky_type", "NISHITA");
  std::vector<float> table;
  if (type == "PREETHAM" || type == "HOSEK_WILKIE") {
    if (type == "HOSEK_WILKIE") c.warn_unsupported(n, "Hosek and Wilkie's sky is rendered as Preetham's");
    Vec3 sun(0, 0, 1);
    const auto& properties = c.node(n).properties;
    if (const auto found = properties.find("sun_direction"); found != properties.end())
      if (const auto* v = std::get_if<GraphNumbers>(&found->second); v && v->size() >= 3)
        sun = {(*v)[0], (*v)[1], (*v)[2]};
    table = make_preetham_sky(sun, c.property(n, "turbidity", 2.2f));
  } else {
    if (type != "NISHITA" && type != "SINGLE_SCATTERING")
      c.warn_unsupported(n, "the sky model '" + type + "' is rendered as single scattering");
    NishitaSky nishita;
    nishita.sun_elevation_rad = c.property(n, "sun_elevation", nishita.sun_elevation_rad);
    nishita.sun_rotation_rad = c.property(n, "sun_rotation", 0.0f);
    nishita.sun_angle_rad = c.property(n, "sun_size", nishita.sun_angle_rad);
    nishita.sun_intensity = c.property(n, "sun_intensity", 1.0f);
    nishita.sun_disc = c.flag(n, "sun_disc", true);
    nishita.altitude_m = c.property(n, "altitude", 0.0f);
    nishita.air_density = c.property(n, "air_density", 1.0f);
    // Renamed in 5.0
    nishita.dust_density = c.property(n, "dust_density", c.property(n, "aerosol_density", 1.0f));
    nishita.ozone_density = c.property(n, "ozone_density", 1.0f);
    if (nishita.sun_disc && !c.is_linked(n, "Vector") && c.is_world()) {
      ProgramTraits& traits = c.program().traits;
      traits.sun_direction_world = sun_direction(nishita.sun_elevation_rad, nishita.sun_rotation_rad);
      traits.sun_angle_rad = nishita.sun_angle_rad;
    }
    table = make_nishita_sky(nishita);
  }
  const auto index = static_cast<uint32_t>(c.program().tables.size());
  c.program().tables.push_back(std::move(table));
  return color_of(
      c.expressions().operation(Op::sky, 0, {c.vector_or(n, "Vector", shift, &Compiler::generated)}, 3, index));
}

}  // namespace

const std::map<std::string, ValueNode>& texture_nodes() {
  static const std::map<std::string, ValueNode> nodes{{"TexImage", image},       {"TexEnvironment", environment},
                                                      {"TexNoise", noise},       {"TexChecker", checker},
                                                      {"TexGradient", gradient}, {"TexSky", sky}};
  return nodes;
}

}  // namespace lambent
