// What a SceneBuilder keeps between builds, and one build's work in progress. Private to scene/.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "engine/geometry/vertex_normals.h"
#include "engine/scene/scene_builder.h"
#include "engine/shading/graph.h"

namespace lambent {

using description::SceneDescription;

/// What was made from one immutable datablock, with the messages of making it (repeated in every build that uses it).
template <typename Source, typename Made>
struct Cached {
  std::shared_ptr<const Source> source;  ///< kept, so that its address is not used again
  Made made;
  Report report;
};
template <typename Source, typename Made>
using Cache = std::unordered_map<const Source*, Cached<Source, Made>>;

/// Calls visit(image id) for each image that a graph names.
template <typename Visit>
void for_each_image(const description::Graph& graph, Visit&& visit) {
  for (const description::Node& node : graph.nodes) {
    const auto found = node.properties.find("image");
    if (found == node.properties.end()) continue;
    if (const auto* id = std::get_if<std::string>(&found->second)) visit(*id);
  }
}

inline bool uses_images(const description::Graph& graph) {
  bool any = false;
  for_each_image(graph, [&](const std::string&) { any = true; });
  return any;
}

/// A mesh whose vertices some materials have moved, and everything that they went by.
struct DisplacedMesh {
  std::vector<std::shared_ptr<const Program>> programs;  ///< by material slot; null: does not move
  std::vector<bool> recomputed;                          ///< by slot: its normals are made anew
  CornerNormals corner_normals = CornerNormals::kept;
  std::vector<float> place;  ///< what the programs read of the object
  bool asks_the_same(const DisplacedMesh& other) const {
    return programs == other.programs && recomputed == other.recomputed && corner_normals == other.corner_normals;
  }

  std::shared_ptr<const TriangleMesh> mesh, shape;  ///< before and after; null shape: nothing moves
  std::vector<uint32_t> not_finite;                 ///< by slot: vertices that stay for that reason
  Report report;
  bool used = false;  ///< in this build
};

struct SceneBuilder::State {
  /// The compiler's input of a graph, in the scene's colours.
  ShaderGraph graph(const description::Graph& described) const {
    ShaderGraph made = shader_graph(described);
    made.scene_from_computed = textures->scene_from_computed();
    return made;
  }

  SceneBuilderOptions options;
  std::shared_ptr<TextureSystem> textures;
  std::string ocio_config, working_space;
  Cache<description::Mesh, std::shared_ptr<const TriangleMesh>> meshes;
  Cache<description::Image, TextureHandle> images;
  description::Table<description::Image> image_table;  ///< that the programs below were compiled with
  Cache<description::Material, std::shared_ptr<const Program>> materials;
  Cache<description::Material, std::shared_ptr<const Program>> displacements;  ///< null: none
  std::unordered_map<const TriangleMesh*, std::vector<std::unique_ptr<DisplacedMesh>>> displaced_meshes;
  Cache<description::World, std::shared_ptr<const Program>> worlds;
  Cache<description::Light, std::shared_ptr<const Program>> lights;
  std::pair<std::shared_ptr<const Program>, EnvironmentLight> world_map;  ///< the last world's importance map
  GeometryBuilder geometry;

  /// One build: what it makes and reads.
  struct Build {
    const SceneDescription& description;
    const CancelFlag& cancel;
    Report& report;
    std::shared_ptr<Scene> scene;
    /// Objects that have a usable mesh, in the order of GeometryObject.
    std::vector<std::pair<const description::Object*, uint32_t>> mesh_objects;  ///< and number among all objects
    std::vector<GeometryObject> geometry_objects;
    std::vector<uint32_t> first_bindings;  ///< by geometry object
    std::unordered_map<const description::Object*, std::shared_ptr<const TriangleMesh>> displaced;
    bool ids = false;                                            ///< some pass asks for ids of names
    std::map<std::string, uint8_t> receiver_sets, blocker_sets;  ///< LinkSets by the names that lights give
    LinkSets links_of(const description::Object& object) const;
  };

  void prepare_textures(const SceneDescription& description);
  void load_images(Build& build);
  bool fetch_images(const Build& build, const Program& program);
  void forget_programs_with_images();
  TextureHandle image(Build& build, const std::string& id);
  std::shared_ptr<const Program> material(Build& build, const std::string& id, const std::string& object);
  std::shared_ptr<const TriangleMesh> mesh(const std::shared_ptr<const description::Mesh>& source);
  bool collect_meshes(Build& build);
  bool displace_meshes(Build& build);
  std::shared_ptr<const Program> displacement(Build& build, const std::string& material_id);
  std::unique_ptr<DisplacedMesh> asked_displacement(Build& build, const description::Object& object,
                                                    const std::shared_ptr<const TriangleMesh>& mesh);
  void displace(Build& build, const description::Object& object, DisplacedMesh& displaced);
  /// The mesh that an object shows, displaced if its materials ask for it.
  std::shared_ptr<const TriangleMesh> shape_of(Build& build, const description::Object& object,
                                               const std::shared_ptr<const description::Mesh>& source) {
    const auto found = build.displaced.find(&object);
    return found == build.displaced.end() ? mesh(source) : found->second;
  }
  void place_objects(Build& build);
  static AttributeIndices bind_attributes(const Program& program, const description::Object& object,
                                          const TriangleMesh& mesh, std::vector<Vec4>& object_values);
  uint32_t bind_materials(Build& build, const description::Object& object, const TriangleMesh& mesh);
  void add_instances(Build& build);
  void add_motion(Build& build);  ///< scene_motion.cpp
  static void add_particles(Scene& scene, std::span<const float> rows, uint32_t first, size_t count);
  /// Number of a light group, new ones included; 0 for no name.
  static uint16_t light_group(Build& build, const std::string& name);
  void link_lights(Build& build);
  void build_lights(Build& build);
  void add_lamps(Build& build, LightSetBuilder& lights);
  void add_emissive_meshes(Build& build, LightSetBuilder& lights);
  void add_world(Build& build, LightSetBuilder& lights);
  void find_profile(Build& build);
  ImageResolver resolver(Build& build) {
    return [this, &build](const std::string& id) { return image(build, id); };
  }
};

}  // namespace lambent
