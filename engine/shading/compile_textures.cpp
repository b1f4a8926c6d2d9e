#include "engine/shading/compile_textures.h"

#include <algorithm>

#include "engine/shading/hosek_sky.h"
#include "engine/shading/light_profile.h"
#include "engine/shading/noise.h"
#include "engine/shading/sky.h"

namespace lambent {
namespace {

using S = const std::string&;

TypedValue number_of(const Value& v) { return {v, SocketKind::number}; }
TypedValue color_of(const Value& v) { return {v, SocketKind::color}; }
TypedValue vector_of(const Value& v) { return {v, SocketKind::vector}; }

TypedValue color_and_alpha(Compiler& c, const Value& rgba, bool alpha) {
  return alpha ? number_of(c.expressions().part(rgba, 3, 1)) : color_of(c.expressions().part(rgba, 0, 3));
}

TypedValue image(Compiler& c, int n, S socket, int shift) {
  static constexpr ImageProjection k_projections[] = {ImageProjection::flat, ImageProjection::box,
                                                      ImageProjection::sphere, ImageProjection::tube};
  const ImageProjection projection = k_projections[c.choice(n, "projection", {"FLAT", "BOX", "SPHERE", "TUBE"})];
  const uint32_t texture = c.texture(n, projection);
  const Value at = c.vector_or(n, "Vector", shift, &Compiler::uv);
  return color_and_alpha(c, c.expressions().operation(Op::texture_image, 0, {at}, 4, texture), socket == "Alpha");
}

TypedValue environment(Compiler& c, int n, S, int shift) {
  const bool ball = c.choice(n, "projection", {"EQUIRECTANGULAR", "MIRROR_BALL"}) == 1;
  const uint32_t texture = c.texture(n, ball ? ImageProjection::mirror_ball : ImageProjection::equirectangular);
  const Value at = c.vector_or(n, "Vector", shift, &Compiler::position);
  return color_and_alpha(c, c.expressions().operation(Op::texture_environment, 0, {at}, 4, texture), false);
}

constexpr int k_dimensions[] = {3, 1, 2, 4};
int dimensions_of(Compiler& c, int n, const char* property) {
  return k_dimensions[c.choice(n, property, {"3D", "1D", "2D", "4D"})];
}
Value coordinates(Compiler& c, int n, int shift) { return c.vector_or(n, "Vector", shift, &Compiler::generated); }
TypedValue as_output(Compiler& c, const Value& number, S socket) {
  return socket == "Color" ? color_of(c.to_vector(number_of(number))) : number_of(number);
}

const std::vector<const char*>& fractal_types() {  // in the order of FractalType
  static const std::vector<const char*> names{"FBM", "MULTIFRACTAL", "HYBRID_MULTIFRACTAL", "RIDGED_MULTIFRACTAL",
                                              "HETERO_TERRAIN"};
  return names;
}

TypedValue noise(Compiler& c, int n, S socket, int shift) {
  Expressions& e = c.expressions();
  const int type = c.choice(n, "noise_type", fractal_types());
  // Before 4.0 the result was always normalised; later the node says.
  const bool normalize = c.flag(n, "normalize", true);
  const bool color = socket == "Color";
  Value roughness = c.number(n, "Roughness", 0.5f, shift);
  // Before 4.0, which the missing property tells
  if (!c.node(n).properties.contains("normalize"))
    roughness = e.operation(Op::clamp, 0, {roughness, e.number(0.0f), e.number(1.0f)}, 1);
  const Value result = e.operation(
      Op::noise, dimensions_of(c, n, "noise_dimensions") | (normalize ? 0 : 8) | (color ? 16 : 0) | (type << 5),
      {coordinates(c, n, shift), c.number(n, "W", 0, shift), c.number(n, "Scale", 5, shift),
       c.number(n, "Detail", 2, shift), roughness, c.number(n, "Lacunarity", 2, shift), c.number(n, "Offset", 0, shift),
       c.number(n, "Gain", 1, shift), c.number(n, "Distortion", 0, shift)},
      4, c.follows(402));
  return color_and_alpha(c, result, !color);
}

TypedValue musgrave(Compiler& c, int n, S, int shift) {
  const int type = c.choice(n, "musgrave_type", fractal_types());
  return number_of(c.expressions().operation(
      Op::musgrave, dimensions_of(c, n, "musgrave_dimensions") | (type << 3),
      {coordinates(c, n, shift), c.number(n, "W", 0, shift), c.number(n, "Scale", 5, shift),
       c.number(n, "Detail", 2, shift), c.number(n, "Dimension", 2, shift), c.number(n, "Lacunarity", 2, shift),
       c.number(n, "Offset", 0, shift), c.number(n, "Gain", 1, shift)},
      1));
}

TypedValue voronoi(Compiler& c, int n, S socket, int shift) {
  VoronoiParameters parameters;
  parameters.dimensions = dimensions_of(c, n, "voronoi_dimensions");
  parameters.feature = static_cast<VoronoiFeature>(
      c.choice(n, "feature", {"F1", "F2", "SMOOTH_F1", "DISTANCE_TO_EDGE", "N_SPHERE_RADIUS"}));
  parameters.metric =
      static_cast<VoronoiMetric>(c.choice(n, "distance", {"EUCLIDEAN", "MANHATTAN", "CHEBYCHEV", "MINKOWSKI"}));
  parameters.octaves = c.node(n).properties.contains("normalize");
  parameters.normalize = c.flag(n, "normalize", false);
  parameters.cell_hashes = c.follows(500);
  // One evaluation gives all outputs: the colour costs most of it, where it is wanted.
  parameters.color = c.output_used(n, "Color") || socket == "Color";
  auto& known = c.program().voronois;
  const auto found = std::find(known.begin(), known.end(), parameters);
  const auto index = static_cast<uint32_t>(found - known.begin());
  if (found == known.end()) known.push_back(parameters);
  Expressions& e = c.expressions();
  const Value result = e.operation(
      Op::voronoi, 0,
      {coordinates(c, n, shift), c.number(n, "W", 0, shift), c.number(n, "Scale", 5, shift),
       c.number(n, "Detail", 0, shift), c.number(n, "Roughness", 0.5f, shift), c.number(n, "Lacunarity", 2, shift),
       c.number(n, "Smoothness", 1, shift), c.number(n, "Exponent", 0.5f, shift), c.number(n, "Randomness", 1, shift)},
      8, index);
  if (socket == "Color") return color_of(e.part(result, 1, 3));
  if (socket == "Position") return vector_of(e.part(result, 4, 3));
  return number_of(e.part(result, socket == "W" ? 7 : 0, 1));
}

TypedValue wave(Compiler& c, int n, S socket, int shift) {
  const bool rings = c.choice(n, "wave_type", {"BANDS", "RINGS"}) == 1;
  const int direction = rings ? 4 + c.choice(n, "rings_direction", {"X", "Y", "Z", "SPHERICAL"})
                              : c.choice(n, "bands_direction", {"X", "Y", "Z", "DIAGONAL"});
  const int profile = c.choice(n, "wave_profile", {"SIN", "SAW", "TRI"});
  const Value f = c.expressions().operation(
      Op::wave, direction | (profile << 3),
      {coordinates(c, n, shift), c.number(n, "Scale", 5, shift), c.number(n, "Distortion", 0, shift),
       c.number(n, "Detail", 2, shift), c.number(n, "Detail Scale", 1, shift),
       c.number(n, "Detail Roughness", 0.5f, shift), c.number(n, "Phase Offset", 0, shift)},
      1);
  return as_output(c, f, socket);
}

TypedValue magic(Compiler& c, int n, S socket, int shift) {
  Expressions& e = c.expressions();
  const int depth = std::clamp(static_cast<int>(c.property(n, "turbulence_depth", 2.0f)), 0, 10);
  const Value color =
      e.operation(Op::magic, depth,
                  {coordinates(c, n, shift), c.number(n, "Scale", 5, shift), c.number(n, "Distortion", 1, shift)}, 3);
  return socket == "Color" ? color_of(color) : number_of(e.operation(Op::average, 0, {color}, 1));
}

TypedValue brick(Compiler& c, int n, S socket, int shift) {
  Expressions& e = c.expressions();
  const Value result = e.operation(
      Op::brick, 0,
      {coordinates(c, n, shift), c.color(n, "Color1", Color(0.8f), shift), c.color(n, "Color2", Color(0.2f), shift),
       c.color(n, "Mortar", Color(0.0f), shift), c.number(n, "Scale", 5, shift),
       c.number(n, "Mortar Size", 0.02f, shift), c.number(n, "Mortar Smooth", 0.1f, shift),
       c.number(n, "Bias", 0, shift), c.number(n, "Brick Width", 0.5f, shift), c.number(n, "Row Height", 0.25f, shift),
       e.number(c.property(n, "offset", 0.5f)), e.number(c.property(n, "offset_frequency", 2)),
       e.number(c.property(n, "squash", 1.0f)), e.number(c.property(n, "squash_frequency", 2))},
      4);
  return color_and_alpha(c, result, socket != "Color");
}

TypedValue gabor(Compiler& c, int n, S socket, int shift) {
  Expressions& e = c.expressions();
  const Value result =
      e.operation(Op::gabor, c.choice(n, "gabor_type", {"2D", "3D"}),
                  {coordinates(c, n, shift), c.number(n, "Scale", 5, shift), c.number(n, "Frequency", 2, shift),
                   c.number(n, "Anisotropy", 1, shift), c.number(n, "Orientation 2D", k_pi / 4.0f, shift),
                   c.vector(n, "Orientation 3D", Vec3(1.41421356f, 1.41421356f, 0.0f), shift)},
                  3);
  return number_of(e.part(result, socket == "Phase" ? 1 : socket == "Intensity" ? 2 : 0, 1));
}

TypedValue white_noise(Compiler& c, int n, S socket, int shift) {
  const Value result =
      c.expressions().operation(Op::white_noise, dimensions_of(c, n, "noise_dimensions"),
                                {c.vector(n, "Vector", Vec3(0.0f), shift), c.number(n, "W", 0, shift)}, 3);
  return socket == "Color" ? color_of(result) : number_of(c.expressions().part(result, 0, 1));
}

TypedValue light_profile_node(Compiler& c, int n, S, int shift) {
  Expressions& e = c.expressions();
  const Value strength = c.number(n, "Strength", 1, shift);
  const Result<std::vector<float>> table = read_light_profile(c.text(n, "profile", ""));
  if (!table) {
    c.warn_unsupported(n, "its light profile cannot be used (" + table.error() + "), 100 takes its place as in Cycles");
    return number_of(e.operation(Op::multiply, 0, {e.number(100.0f), strength}, 1));
  }
  const auto index = static_cast<uint32_t>(c.program().tables.size());
  c.program().tables.push_back(*table);
  return number_of(
      e.operation(Op::ies, 0, {c.vector_or(n, "Vector", shift, &Compiler::object_normal), strength}, 1, index));
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

TypedValue radial_tiling_node(Compiler& c, int n, S socket, int shift) {
  Expressions& e = c.expressions();
  const Value tile = e.operation(
      Op::radial_tiling, c.flag(n, "normalize", true) ? 1 : 0,
      {c.vector(n, "Vector", Vec3(0.0f), shift), c.number(n, "Sides", 5, shift), c.number(n, "Roundness", 0, shift)},
      6);
  if (socket == "Segment ID") return number_of(e.part(tile, 3, 1));
  if (socket == "Segment Width") return number_of(e.part(tile, 4, 1));
  if (socket == "Segment Rotation") return number_of(e.part(tile, 5, 1));
  return vector_of(e.part(tile, 0, 3));
}

TypedValue point_density(Compiler& c, int n, S socket, int shift) {
  Expressions& e = c.expressions();
  const bool density = socket == "Density";
  // Cycles from 4.0 on has it in volumes only.
  if (c.follows(400) || c.text(n, "image", "").empty())
    return density ? number_of(e.number(0.0f)) : color_of(e.vector(Vec3(0.0f)));
  Value at = c.vector_or(n, "Vector", shift, &Compiler::position);
  if (c.text(n, "space", "OBJECT") == "WORLD") {
    const auto row = [&](const char* name) {
      const auto& properties = c.node(n).properties;
      const auto found = properties.find(name);
      const auto* r = found == properties.end() ? nullptr : std::get_if<GraphNumbers>(&found->second);
      if (!r || r->size() != 4) return e.number(0.0f);
      const Value product = e.operation(Op::vector_math_float, static_cast<int>(VectorOperation::dot),
                                        {at, e.vector(Vec3((*r)[0], (*r)[1], (*r)[2]))}, 1);
      return e.operation(Op::math, static_cast<int>(MathOperation::add), {product, e.number((*r)[3]), e.number(0.0f)},
                         1);
    };
    at = e.operation(Op::combine, 0, {row("row_0"), row("row_1"), row("row_2")}, 3);
  } else {
    constexpr int k_point_to_object = 3 + 9;  // Cycles goes from the object's space to its bounds in volumes only
    at = e.operation(Op::vector_transform, k_point_to_object, {at}, 3);
  }
  const std::string interpolation = c.text(n, "interpolation", "Linear");
  const uint32_t texture = c.texture(n, ImageProjection::flat);
  c.program().textures[texture].interpolation = TextureInterpolation::closest;
  const Value found = e.operation(Op::voxels,
                                  static_cast<int>(interpolation == "Closest" ? VoxelInterpolation::closest
                                                   : interpolation == "Cubic" ? VoxelInterpolation::cubic
                                                                              : VoxelInterpolation::linear),
                                  {at, e.number(c.property(n, "resolution", 1.0f))}, 4, texture);
  return density ? number_of(e.part(found, 3, 1)) : color_of(e.part(found, 0, 3));
}

TypedValue sky_node(Compiler& c, int n, S, int shift) {
  const std::string type = c.text(n, "sky_type", "NISHITA");
  std::vector<float> table;
  if (type == "PREETHAM" || type == "HOSEK_WILKIE") {
    Vec3 sun(0, 0, 1);
    const auto& properties = c.node(n).properties;
    if (const auto found = properties.find("sun_direction"); found != properties.end())
      if (const auto* v = std::get_if<GraphNumbers>(&found->second); v && v->size() >= 3)
        sun = {(*v)[0], (*v)[1], (*v)[2]};
    const float turbidity = c.property(n, "turbidity", 2.2f);
    table = type == "PREETHAM" ? make_preetham_sky(sun, turbidity)
                               : make_hosek_sky(sun, turbidity, c.property(n, "ground_albedo", 0.3f));
  } else {
    AtmosphereSky sky;
    if (type == "SINGLE_SCATTERING")
      sky.model = AtmosphereSky::Model::single_scattering;
    else if (type != "NISHITA")
      sky.model = AtmosphereSky::Model::multiple_scattering;
    if (type != "NISHITA" && type != "SINGLE_SCATTERING" && type != "MULTIPLE_SCATTERING")
      c.warn_unsupported(n, "the sky model '" + type + "' is rendered as multiple scattering");
    sky.sun_elevation_rad = c.property(n, "sun_elevation", sky.sun_elevation_rad);
    sky.sun_rotation_rad = c.property(n, "sun_rotation", 0.0f);
    sky.sun_angle_rad = c.property(n, "sun_size", sky.sun_angle_rad);
    sky.sun_intensity = c.property(n, "sun_intensity", 1.0f);
    sky.sun_disc = c.flag(n, "sun_disc", true);
    sky.altitude_m = c.property(n, "altitude", 0.0f);
    sky.air_density = c.property(n, "air_density", 1.0f);
    // Renamed in 5.0
    sky.dust_density = c.property(n, "dust_density", c.property(n, "aerosol_density", 1.0f));
    sky.ozone_density = c.property(n, "ozone_density", 1.0f);
    if (sky.sun_disc && !c.is_linked(n, "Vector") && c.is_world()) {
      ProgramTraits& traits = c.program().traits;
      traits.sun_direction_world = sun_direction(sky.sun_elevation_rad, sky.sun_rotation_rad);
      traits.sun_angle_rad = sky.sun_angle_rad;
    }
    table = make_atmosphere_sky(sky);
  }
  const auto index = static_cast<uint32_t>(c.program().tables.size());
  c.program().tables.push_back(std::move(table));
  return color_of(c.computed_color(Op::sky, {c.vector_or(n, "Vector", shift, &Compiler::generated)}, index));
}

}  // namespace

const std::map<std::string, ValueNode>& texture_nodes() {
  static const std::map<std::string, ValueNode> nodes{{"TexImage", image},
                                                      {"TexPointDensity", point_density},
                                                      {"TexEnvironment", environment},
                                                      {"TexNoise", noise},
                                                      {"TexChecker", checker},
                                                      {"TexGradient", gradient},
                                                      {"TexSky", sky_node},
                                                      {"TexVoronoi", voronoi},
                                                      {"TexMusgrave", musgrave},
                                                      {"TexWave", wave},
                                                      {"TexMagic", magic},
                                                      {"TexBrick", brick},
                                                      {"TexWhiteNoise", white_noise},
                                                      {"TexGabor", gabor},
                                                      {"TexIES", light_profile_node},
                                                      {"RadialTiling", radial_tiling_node}};
  return nodes;
}

}  // namespace lambent
