// A compiled program: instructions over registers of floats, constants, and tables. Built by the compiler, run by
// program.cpp.
#pragma once

#include <string>
#include <vector>

#include "engine/assets/texture_system.h"
#include "engine/shading/closures.h"
#include "engine/shading/program.h"
#include "engine/shading/voronoi.h"

namespace lambent {

/// What an instruction computes. Results: f a float, v three floats, c4 four (colour and alpha or factor).
enum class Op : uint8_t {
  // Inputs. `variant` 0, 1, 2: at the point, one pixel footprint along x, along y (for bump).
  position,
  normal,
  true_normal,
  incoming,
  default_tangent,
  bitangent,  // v; unit, along the second coordinate of the parameterisation
  parametric,
  backfacing,
  attribute,  // c4; data: index of the request
  object_position,
  object_normal,
  object_location,
  reflection,
  light_path,  // f; variant: LightPathField
  object_index,
  material_index,
  object_random,
  particle,  // f or v; variant: ParticleField
  view_distance,
  view_vector,      // v; unit, in the camera's space
  view_depth,       // f; along the camera's axis
  camera_position,  // v; in the camera's space
  window_position,  // v; variant as for position
  object_color,     // c4
  wireframe,        // f(size); variant: 1 in pixels
  light_falloff,    // f(strength, smooth); variant: 0 quadratic, 1 linear, 2 constant
  // Arithmetic
  math,               // f(a, b, c); variant: MathOperation
  vector_math,        // v(a, b, c, scale); variant: VectorOperation
  vector_math_float,  // f
  blend,              // v(factor, a, b); variant: Blend
  mix_float,
  mix_vector,
  mix_vector_by_vector,  // (factor, a, b)
  clamp,
  clamp_range,
  clamp_color,  // clamp_color: v in [0, 1]
  map_range,
  map_range_vector,  // variant: MapRange
  mapping,           // v(vector, location, rotation, scale); variant: MappingType
  vector_rotate,     // v(vector, center, axis, angle, euler); variant: RotateType
  vector_transform,  // v; variant: from + 3 · to + 9 · kind (vector, point, normal); spaces: world, object, camera
  combine,           // v(x, y, z)
  convert_color,     // v; variant: ColorModel
  luminance,
  average,
  length,
  scale_color,  // v(color, f)
  multiply,     // f(a, b): weights of closures
  mix_weight_first,
  mix_weight_second,  // f(weight, factor): weight·(1 − clamped factor), weight·clamped factor
  invert,
  gamma,
  bright_contrast,
  hue_saturation,
  ramp,    // c4(factor); data: table
  curves,  // v(factor, color); data: table; variant: 1 extrapolates
  // Shading
  ambient_occlusion,  // f(normal, distance, samples); variant: 1 inside + 2 own object
  bevel,              // v(radius, samples[, normal]); variant: 1 with that normal
  raycast,  // 13(position, direction, length): hit, self, distance, position, normal, place; variant: 1 own object
  met_attribute,  // 5(hit, place of a raycast): rgba, number; data: in ProgramData::met_attributes
  fresnel,
  layer_weight_fresnel,
  layer_weight_facing,
  normal_map,      // v(color, strength[, tangent c4]); variant: NormalSpace
  bump,            // v(normal, strength, distance, h, hx, hy); variant: 1 inverts
  normal_dot,      // f(a, b)
  radial_tangent,  // v(generated); variant: axis
  world_tangent,   // v(tangent); variant 0: of an attribute, in world space, 1: in object space
  blackbody,
  wavelength,
  object_normal_of,  // v(normal): from world to object space, unit
  // Textures
  texture_image,        // c4(vector); data: texture
  texture_environment,  // c4(vector); data: texture
  voxels,               // c4(coordinates, resolution): channels as stored; data: texture; variant: VoxelInterpolation
  noise,                // c4: colour and value
  musgrave,             // f; variant: dimensions + 8 · type
  voronoi,              // 8: distance, colour, position; data: index in voronois
  wave,                 // f; variant: shape + 8 · profile
  magic,                // v
  brick,                // c4: colour and mortar
  gabor,                // v: value, phase, intensity; variant: 1 in three dimensions
  white_noise,          // v; variant: dimensions
  checker,
  gradient,
  radial_tiling,
  sky,  // v(direction); data: table
  ies,  // f(direction); data: table
  // Closures
  closure  // data: closure
};

enum class VoxelInterpolation : uint8_t { linear, closest, cubic };
enum class ParticleField : uint8_t { random, index, age, lifetime, size, location, velocity, angular_velocity };

enum class LightPathField : uint8_t {
  camera,
  shadow,
  diffuse,
  glossy,
  singular,
  reflection,
  transmission,
  volume_scatter,
  length,
  depth,
  diffuse_depth,
  glossy_depth,
  transparent_depth,
  transmission_depth
};

enum class MathOperation : uint8_t {
  add,
  subtract,
  multiply,
  divide,
  multiply_add,
  power,
  logarithm,
  sqrt,
  inverse_sqrt,
  absolute,
  exponent,
  minimum,
  maximum,
  less_than,
  greater_than,
  sign,
  compare,
  smooth_min,
  smooth_max,
  round,
  floor,
  ceil,
  truncate,
  fraction,
  modulo,
  floored_modulo,
  wrap,
  snap,
  pingpong,
  sine,
  cosine,
  tangent,
  arcsine,
  arccosine,
  arctangent,
  arctan2,
  sinh,
  cosh,
  tanh,
  radians,
  degrees
};

enum class VectorOperation : uint8_t {
  add,
  subtract,
  multiply,
  divide,
  multiply_add,
  cross,
  project,
  reflect,
  refract,
  faceforward,
  dot,
  distance,
  length,
  scale,
  normalize,
  absolute,
  power,
  sign,
  minimum,
  maximum,
  floor,
  ceil,
  fraction,
  modulo,
  wrap,
  snap,
  sine,
  cosine,
  tangent,
  round
};

enum class MapRange : uint8_t { linear, stepped, smoothstep, smootherstep };
enum class MappingType : uint8_t { point, texture, vector, normal };
enum class RotateType : uint8_t { axis_angle, x, y, z, euler };
enum class ColorModel : uint8_t { rgb_to_hsv, hsv_to_rgb, rgb_to_hsl, hsl_to_rgb };
enum class NormalSpace : uint8_t { tangent, object, world, blender_object, blender_world };
/// Bits of a bump's variant: heights are depths; normals are not bent towards the view (Cycles from 4.0 on); in object
/// space, with two more operands, the steps between the points of the heights.
inline constexpr int k_bump_inverted = 1, k_bump_newer = 2, k_bump_object = 4;
/// Added to a normal map's space in its variant: strength acts on the colour (tangent space, Cycles from 4.0 on); green
/// points down; about the normal that is one more operand instead of the displaced surface's.
inline constexpr int k_normal_map_newer = 8, k_normal_map_directx = 16, k_normal_map_original = 32;
enum class GradientType : uint8_t { linear, quadratic, easing, diagonal, spherical, quadratic_sphere, radial };
enum class ImageProjection : uint8_t { flat, box, sphere, tube, equirectangular, mirror_ball };

/// Register offsets are >= 0; constants are ~index into ProgramData::constants.
using Operand = int32_t;

struct Instruction {
  Op op;
  uint8_t variant = 0;
  uint16_t out = 0;
  uint32_t operands = 0;  ///< first, in ProgramData::operands
  uint32_t data = 0;
  friend bool operator==(const Instruction&, const Instruction&) = default;
};

struct TextureUse {
  TextureHandle texture;
  TextureInterpolation interpolation = TextureInterpolation::linear;
  TextureExtension extension = TextureExtension::repeat;
  ImageProjection projection = ImageProjection::flat;
  float projection_blend = 0.0f;
  bool straight_color = false;
  friend bool operator==(const TextureUse&, const TextureUse&) = default;
};

struct ClosureUse {
  ClosureKind kind;
  GlossModel model = GlossModel::ggx;
  bool has_normal = false, has_coat_normal = false, has_tangent = false;
  bool bumped_by_displacement = false;  ///< its normal is the displacement's bump
  bool has_shading_normal = false;      ///< it has a normal of its own, and there is the displacement's bump besides
  bool raw_diffuse_normal =
      false;  ///< only lobes that mirror have their normals bent towards the view (Cycles from 4.0)
  /// Operands: weight, then normal, coat normal, tangent, shading normal as present, then one per parameter (floats).
  bool constant = false;            ///< parameters are: `front` and `back` are ready
  bool may_be_transparent = false;  ///< some of its lobes may be transparent
  LobeTemplates front, back;
  int parameter_count = 0;
};

/// One of the sequences that a program is compiled into.
struct Code {
  std::vector<Instruction> instructions;
  int register_floats = 0;
};

class ProgramData {
 public:
  Code surface, transparency, emission;
  /// AOV output nodes by name, and what computes them with the surface: two emission closures each, its colour and its
  /// number three times, from `first_aov_closure` on (without code where they are always 0); for a colour by itself is
  /// what those sum.
  std::vector<std::string> aovs;
  Code surface_with_aovs;
  uint32_t first_aov_closure = 0;
  Code displacement;
  bool displaces_in_object_space = false;  ///< what `displacement` gives; else in world space
  bool world = false;
  std::vector<Operand> operands;
  std::vector<float> constants;
  std::vector<TextureUse> textures;
  std::vector<ClosureUse> closures;
  std::vector<std::vector<float>> tables;  ///< ramps: 256 · rgba; curves; skies; light profiles
  std::vector<VoronoiParameters> voronois;
  std::vector<AttributeRequest> requests;
  std::vector<std::string> met_attributes;  ///< names, of the surfaces that Raycast meets
  ProgramTraits traits;
  BumpShadowing bump_shadowing = BumpShadowing::cubic;
  bool correlated_masking = false;  ///< of microfacet lobes
  bool fitted_films = false;        ///< of lobes under thin films, of which metals are none
  float bump_filter_width = 1.0f;   ///< pixels between the points whose heights give slopes
};

inline constexpr int k_max_registers = 4096;  ///< floats: 16 KiB of stack

/// Widest result of an instruction, floats.
inline constexpr int k_max_width = 13;

/// Operands of one instruction.
struct Arguments {
  const ProgramData& program;
  const Operand* operand;
  const float* registers;

  const float* at(int i) const {
    const Operand o = operand[i];
    return o >= 0 ? registers + o : program.constants.data() + ~o;
  }
  float f(int i) const { return *at(i); }
  Vec3 v(int i) const {
    const float* p = at(i);
    return {p[0], p[1], p[2]};
  }
};

/// Writes a computed colour. @param wide in a gamut of any width: negative channels stay
inline void store_color(float* out, const Color& color, bool wide) {
  for (int k = 0; k < 3; ++k) out[k] = wide ? color[k] : std::max(color[k], 0.0f);
}
/// The instructions of textures: texture_instructions.cpp.
void run_texture_instruction(const ProgramData& program, const Instruction& instruction, const ShadingPoint& point,
                             const TextureSystem* textures, const Arguments& a, float* out);
/// Unit object-space normal of a world-space one.
Vec3 object_normal(const ShadingPoint& point, const Vec3& n);

/// Runs one value instruction (not Op::closure): also what folds constants.
/// @param registers of the program; @param point may be any for instructions that read no input.
void run_instruction(const ProgramData& program, const Instruction& instruction, const ShadingPoint& point,
                     const TextureSystem* textures, float* registers);

}  // namespace lambent
