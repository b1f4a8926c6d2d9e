// What the user asked for, as plain values. Names, defaults, units and meanings are those of
// server/protocol/PROTOCOL.md, section "Edits"; this header is its C++ mirror.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/base/transform.h"
#include "engine/base/vec.h"
#include "engine/description/array.h"

namespace lambent::description {

// --- Shader graphs ------------------------------------------------------------------------------------------------

/// Socket `socket` of node `node` (an index into Graph::nodes).
struct Link {
  int node = -1;
  std::string socket;
  friend bool operator==(const Link&, const Link&) = default;
};
/// 2 to 4 numbers.
using Numbers = std::vector<float>;
using SocketValue = std::variant<float, bool, std::string, Numbers, Link>;

struct Node {
  std::string name;
  std::string type;  ///< Blender's bl_idname without "ShaderNode"
  std::map<std::string, SocketValue> inputs;
  std::map<std::string, SocketValue> properties;  ///< never Link
  std::vector<std::array<float, 5>> ramp;         ///< ColorRamp: position, r, g, b, a
  std::vector<std::vector<float>> curves;         ///< curve nodes: interleaved x, y
};

/// What a displacement does: turn normals, move the mesh's vertices, or both.
enum class DisplacementMethod : uint8_t { bump, displacement, both };

/// Invariant after validation: every Link names an existing node; links form no cycle is NOT guaranteed (the compiler
/// reports it).
struct Graph {
  std::vector<Node> nodes;
  std::optional<Link> surface, displacement, volume;
  std::vector<int> aovs;            ///< OutputAOV nodes: what shader AOV passes read
  int cycles_version = 304;         ///< whose rules shaders follow: 100 · major + minor
  bool bump_map_correction = true;  ///< bumped diffuse surfaces darken towards the smooth surface's terminator
  bool transparent_shadow = true;   ///< surfaces: shadow rays go through what is transparent
  DisplacementMethod displacement_method = DisplacementMethod::bump;
};

// --- Datablocks ---------------------------------------------------------------------------------------------------

enum class Domain : uint8_t { vertex, corner, face };
enum class AttributeRole : uint8_t { generic, uv, color };

struct Attribute {
  std::string name;
  Domain domain = Domain::corner;
  AttributeRole role = AttributeRole::generic;
  ArrayPointer values;  ///< f32[N][1..4]
};

/// Triangles with shared vertices and separate corners. Counts are validated when the scene is built.
struct Mesh {
  std::string name;
  ArrayPointer positions;           ///< f32[V][3], object space, metres
  ArrayPointer triangles;           ///< u32[T][3], vertex indices
  ArrayPointer triangle_corners;    ///< u32[T][3] or null: 3t+k
  ArrayPointer triangle_faces;      ///< u32[T] or null: t
  ArrayPointer triangle_materials;  ///< u16[T] or null: 0
  ArrayPointer normals;             ///< f32[N][3] or null: flat
  Domain normals_domain = Domain::corner;
  std::vector<Attribute> attributes;
  std::string active_uv, active_color;
  Vec3 texture_space_location{0.0f}, texture_space_size{1.0f};
};

enum class AlphaMode : uint8_t { straight, premultiplied, channel_packed, none };

struct Image {
  std::string name;
  std::string path;        ///< absolute; or
  ArrayPointer encoded;    ///< u8[n], a whole file; or
  std::string extension;   ///< of `encoded`, with the dot
  ArrayPointer pixels;     ///< f32[h][w][1..4], row 0 at the bottom
  std::string colorspace;  ///< empty: decided by the file
  AlphaMode alpha = AlphaMode::straight;
};

struct Material {
  std::string name;
  Graph graph;
  int pass_index = 0;
};

/// Which kinds of ray see an object.
struct Visibility {
  bool camera = true, diffuse = true, glossy = true, transmission = true, shadow = true, volume_scatter = true;
  friend bool operator==(const Visibility&, const Visibility&) = default;
};

struct World {
  std::string name;
  Graph graph;
  Visibility visibility;
  std::string light_group;
  int importance_resolution = 0;  ///< height of the importance map in texels; 0 automatic
};

enum class LightType : uint8_t { point, spot, sun, area };
enum class AreaShape : uint8_t { square, rectangle, disk, ellipse };

struct Light {
  std::string name;
  LightType type = LightType::point;
  Color color{1.0f};
  float energy = 10.0f;  ///< Blender's: W; sun: W/m²
  float exposure = 0.0f;
  bool normalize = true;
  float radius_m = 0.0f;                               ///< point, spot
  float angle_rad = 0.0f;                              ///< sun: whole angle
  float spot_size_rad = k_pi / 4, spot_blend = 0.15f;  ///< whole cone angle
  AreaShape shape = AreaShape::square;
  Vec2 size_m{1.0f, 1.0f};
  float spread_rad = k_pi;
  bool shadows = true;
  bool multiple_importance = true;
  int max_bounces = 1024;
  bool soft_falloff = true;  ///< point, spot: a disk that faces what it lights; false: a sphere
  int cycles_version = 304;  ///< whose lamps: 100 · major + minor (before 4.0 all had a soft falloff, then none)
  std::string light_group;
  std::optional<Graph> graph;
};

/// Light linking: objects of which lights shine on which, by names of sets that objects share.
struct LightLinking {
  std::string receivers, blockers;  ///< what this object's light reaches, and what blocks it; empty: everything
  std::vector<std::string> receives, blocks;  ///< sets of receivers and of blockers that this object is in
  bool any() const { return !receivers.empty() || !blockers.empty() || !receives.empty() || !blocks.empty(); }
};

/// Where an object is in another frame, for passes of motion.
struct ObjectStep {
  ArrayPointer transforms;  ///< f32[N][3][4] world_from_object, as many as the object has; null: all as now
  ArrayPointer positions;   ///< f32[V][3] of its mesh's vertices, object space; null: as now
};
/// The frames before and after. An object without it stands still.
struct ObjectMotion {
  ObjectStep previous, next;
};

/// N instances of one mesh or light.
struct Object {
  std::string name;
  std::string mesh, light;                            ///< id of one of them; the other empty
  ArrayPointer transforms;                            ///< f32[N][3][4] world_from_object
  std::vector<std::optional<std::string>> materials;  ///< id by slot
  Visibility visibility;
  ArrayPointer random_ids;  ///< u32[N] or null
  ArrayPointer particles;   ///< f32[N][13] or null: index (below 0: no particle), age, lifetime, size, location,
                            ///< velocity, angular velocity, of the particle that the instance stands for
  int pass_index = 0;
  std::array<float, 4> color{1, 1, 1, 1};
  std::map<std::string, std::array<float, 4>> attributes;  ///< what the shaders of all its faces may read by name
  std::string light_group;                                 ///< of what its shaders emit
  std::string asset;                                       ///< its name in the cryptomatte of assets; empty: its own
  bool holdout = false;                                    ///< the camera sees a hole there
  bool shadow_catcher = false;  ///< the camera sees the world there, darkened by the shadows that others throw on it
  bool matte = false;           ///< of shadow catchers: other light that comes by way of others shows too
  bool shadow_pass = false;     ///< its shadows are what passes of shadows take away: it casts none there
  std::vector<std::string> mattes;  ///< names of the passes of kind matte that show it
  LightLinking light_linking;
  std::optional<ObjectMotion> motion;
};

enum class CameraType : uint8_t { perspective, orthographic };
enum class SensorFit : uint8_t { automatic, horizontal, vertical };

struct DepthOfField {
  float focus_distance_m = 10.0f;
  float fstop = 2.8f;
  int blades = 0;  ///< fewer than 3: round
  float rotation_rad = 0.0f;
  float ratio = 1.0f;  ///< anamorphic: width over height of the bokeh is 1/ratio (Blender's aperture_ratio)
};

/// Where a camera is in another frame, for passes of motion.
struct CameraStep {
  Transform transform;  ///< world_from_camera
  float focal_length_mm = 50.0f;
};
struct CameraMotion {
  CameraStep previous, next;
};

struct Camera {
  std::string name;
  CameraType type = CameraType::perspective;
  Transform transform;  ///< world_from_camera: looks along -Z, Y up
  float focal_length_mm = 50.0f, sensor_width_mm = 36.0f, sensor_height_mm = 24.0f;
  SensorFit sensor_fit = SensorFit::automatic;
  float ortho_scale = 6.0f;
  Vec2 shift{0.0f, 0.0f};
  float clip_near_m = 0.1f, clip_far_m = 1000.0f;
  std::optional<DepthOfField> depth_of_field;
  std::optional<CameraMotion> motion;  ///< absent: it stands still
};

enum class PixelFilter : uint8_t { box, gaussian, blackman_harris };

/// A pass that the picture shall have. Kinds: PROTOCOL.md.
struct Pass {
  std::string name;  ///< of its channel, the client's choice
  std::string kind;
  std::string argument;  ///< what the kind asks for: a light group, an AOV, a number of levels, an expression
  friend bool operator==(const Pass&, const Pass&) = default;
};

enum class MistFalloff : uint8_t { linear, quadratic, inverse_quadratic };
struct Mist {
  float start_m = 5.0f, depth_m = 25.0f;
  MistFalloff falloff = MistFalloff::quadratic;
};

struct Settings {
  int width = 1920, height = 1080;
  std::optional<std::array<int, 4>> region;  ///< x0, y0, x1, y1: px, exclusive end, row 0 at the bottom
  Vec2 pixel_aspect{1.0f, 1.0f};
  std::string camera, world;  ///< ids
  std::string integrator = "PT";
  int64_t samples = 128;  ///< 0 unlimited
  double time_limit_s = 0.0;
  float noise_threshold = 0.0f;
  uint32_t seed = 0;
  int max_bounces = 12, diffuse_bounces = 4, glossy_bounces = 4, transmission_bounces = 12, transparent_bounces = 8,
      volume_bounces = 0;
  PixelFilter pixel_filter = PixelFilter::blackman_harris;
  float filter_width_px = 1.5f;
  bool film_transparent = false;
  bool film_transparent_glass = false;      ///< a transparent film is seen through glass, too
  float film_transparent_roughness = 0.1f;  ///< ... up to this roughness
  float exposure = 1.0f;
  float clamp_direct = 0.0f, clamp_indirect = 0.0f;
  float light_threshold = 0.01f;  ///< of the picture's value: shadow rays that matter less are traced by chance; 0 off
  bool caustics_reflective = true, caustics_refractive = true;
  float merge_radius_px = 2.0f;  ///< PPM, BPM, VCM: radius of the first pass, in pixels at the first hit; 0: no merging
  float merge_alpha = 0.75f;     ///< radius of pass k: times k^((alpha - 1) / 2); 1: fixed
  int shared_light_paths = 16;   ///< VPL: light paths of a pass that all pixels share
  float clamp_connection = 0.0f;  ///< VPL: largest sum of R, G, B that one connection adds; 0: no clamping
  int tile_size_px = 64;
  std::vector<Pass> passes;  ///< besides the combined one
  Mist mist;
  float ambient_occlusion_distance_m = 10.0f;
  float pass_alpha_threshold = 0.5f;  ///< what is less opaque than this does not hide what depth, indices... show
  int threads = 0;
  std::string ocio_config;
  std::string working_space;  ///< colour space of ocio_config that colours are in; empty: its scene_linear role's
  int frame = 1;
  std::map<std::string, std::string> metadata;
};

// --- The whole, and edits to it -------------------------------------------------------------------------------------

template <typename T>
using Table = std::map<std::string, std::shared_ptr<const T>>;

/// Everything, by id. Values are immutable and shared: an unchanged datablock keeps its pointer, which is how the scene
/// builder knows what changed.
struct SceneDescription {
  Table<Mesh> meshes;
  Table<Image> images;
  Table<Material> materials;
  Table<Light> lights;
  Table<Object> objects;
  Table<Camera> cameras;
  Table<World> worlds;
  std::shared_ptr<const Settings> settings = std::make_shared<Settings>();
};

using Value = std::variant<Mesh, Image, Material, Light, Object, Camera, World, Settings>;
enum class Kind : uint8_t { mesh, image, material, light, object, camera, world, settings };

struct Upsert {
  std::string id;
  Value value;
};
struct Remove {
  Kind kind;
  std::string id;
};
struct Clear {};
using Edit = std::variant<Upsert, Remove, Clear>;

struct Transaction {
  int64_t epoch = 0;
  std::vector<Edit> edits;
};

/// Applies the edits in order. Removing an id that does not exist does nothing.
void apply(Transaction transaction, SceneDescription& scene);

}  // namespace lambent::description
