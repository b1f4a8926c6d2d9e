// The compiler's input and entry points. ShaderGraph mirrors description::Graph (shading may not include description/);
// scene/ converts, field by field.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/assets/texture_system.h"
#include "engine/base/report.h"
#include "engine/shading/program.h"

namespace lambent {

/// Output `socket` of node `node` (an index into ShaderGraph::nodes).
struct GraphLink {
  int node = -1;
  std::string socket;
};
using GraphNumbers = std::vector<float>;  ///< 2 to 4 numbers
using GraphValue = std::variant<float, bool, std::string, GraphNumbers, GraphLink>;

struct GraphNode {
  std::string name;
  std::string type;  ///< Blender's bl_idname without "ShaderNode"
  std::map<std::string, GraphValue> inputs;
  std::map<std::string, GraphValue> properties;  ///< never a GraphLink
  std::vector<std::array<float, 5>> ramp;        ///< ColorRamp: position, r, g, b, a
  std::vector<std::vector<float>> curves;        ///< curve nodes: interleaved x, y
};

/// What a displacement does: turn normals, move the mesh's vertices, or both.
enum class DisplacementMethod : uint8_t { bump, displacement, both };

/// Links may dangle or form cycles: the compiler reports them and uses default values.
struct ShaderGraph {
  std::vector<GraphNode> nodes;
  std::optional<GraphLink> surface, displacement, volume;
  std::vector<int> aovs;            ///< nodes of type OutputAOV
  int cycles_version = 304;         ///< whose rules the nodes follow: 100 · major + minor
  bool bump_map_correction = true;  ///< bumped diffuse surfaces darken towards the smooth surface's terminator
  bool transparent_shadow = true;   ///< surfaces: shadow rays go through what is transparent
  DisplacementMethod displacement_method = DisplacementMethod::bump;
  /// Rows of the matrix from linear Rec. 709, as nodes compute colours, to the scene's linear space; none: that is it.
  std::optional<std::array<float, 9>> scene_from_computed;
};

/// Texture of an image id; null if there is no such image (reported by the compiler, pink).
using ImageResolver = std::function<TextureHandle(const std::string& image_id)>;

/// Compiles a material's surface output. Never null and never throws: what cannot be compiled is named in the report
/// and replaced by the nearest stand-in. A graph without surface output gives a program that absorbs all light, as in
/// Cycles. @param material_name the user's, for messages.
std::shared_ptr<const Program> compile_material(const ShaderGraph& graph, const std::string& material_name,
                                                const ImageResolver& images, Report& report);
/// Compiles what moves the vertices of meshes with a material: Program::displacement(). Null if nothing does.
std::shared_ptr<const Program> compile_displacement(const ShaderGraph& graph, const std::string& material_name,
                                                    const ImageResolver& images, Report& report);
/// Compiles a world: its emission() is the radiance seen along -wi_world.
std::shared_ptr<const Program> compile_world(const ShaderGraph& graph, const std::string& world_name,
                                             const ImageResolver& images, Report& report);
/// Compiles a light's own node graph: its emission() multiplies the light's radiance. A graph without surface output
/// gives 1.
std::shared_ptr<const Program> compile_light(const ShaderGraph& graph, const std::string& light_name,
                                             const ImageResolver& images, Report& report);
/// The material of slots without one: diffuse, 0.8 grey (Blender's default).
std::shared_ptr<const Program> default_material();

/// Node types that compile without a message, sorted; announced as a capability.
std::vector<std::string> supported_node_types();

}  // namespace lambent
