// `lambent info`.
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <set>

#include "engine/cli/commands.h"
#include "engine/description/scene_file.h"
#include "engine/session/session.h"

namespace lambent {
namespace {

using description::SceneDescription;

std::string name_of(const auto& table, const std::string& id) {
  const auto found = table.find(id);
  if (found == table.end()) return id.empty() ? "none" : fmt::format("'{}' (missing)", id);
  return fmt::format("'{}'", found->second->name.empty() ? id : found->second->name);
}

int describe_scene(const std::string& path) {
  Report report;
  const auto scene = description::load_scene_file(path, report);
  for (const Message& message : report.messages()) std::fprintf(stderr, "lambent: %s\n", message.text.c_str());
  if (!scene) {
    std::fprintf(stderr, "lambent: %s\n", scene.error().c_str());
    return 1;
  }
  uint64_t unique_triangles = 0, triangles = 0, instances = 0, array_bytes = 0;
  std::set<std::string> seen;
  const auto count_array = [&](const ArrayPointer& array) {
    if (array && seen.insert(array->hash).second) array_bytes += array->byte_count();
  };
  for (const auto& [id, mesh] : scene->meshes) {
    unique_triangles += mesh->triangles->rows();
    for (const ArrayPointer& array : {mesh->positions, mesh->triangles, mesh->triangle_corners, mesh->triangle_faces,
                                      mesh->triangle_materials, mesh->normals})
      count_array(array);
    for (const auto& attribute : mesh->attributes) count_array(attribute.values);
  }
  for (const auto& [id, image] : scene->images) {
    count_array(image->encoded);
    count_array(image->pixels);
  }
  for (const auto& [id, object] : scene->objects) {
    instances += object->transforms->rows();
    count_array(object->transforms);
    count_array(object->random_ids);
    if (const auto mesh = scene->meshes.find(object->mesh); mesh != scene->meshes.end())
      triangles += mesh->second->triangles->rows() * object->transforms->rows();
  }
  std::set<std::string> node_types;
  for (const auto& [id, material] : scene->materials)
    for (const auto& node : material->graph.nodes) node_types.insert(node.type);
  for (const auto& [id, world] : scene->worlds)
    for (const auto& node : world->graph.nodes) node_types.insert(node.type);

  const description::Settings& settings = *scene->settings;
  fmt::print("saved scene   {} ({} bytes, arrays {} bytes)\n", path, std::filesystem::file_size(path), array_bytes);
  fmt::print("meshes        {} ({} triangles)\n", scene->meshes.size(), unique_triangles);
  fmt::print("objects       {} ({} instances, {} triangles)\n", scene->objects.size(), instances, triangles);
  fmt::print("lights        {}\nmaterials     {}\nimages        {}\ncameras       {}\nworlds        {}\n",
             scene->lights.size(), scene->materials.size(), scene->images.size(), scene->cameras.size(),
             scene->worlds.size());
  fmt::print("node types    {}\n", fmt::join(node_types, " "));
  fmt::print("frame         {} x {} px, frame {}\n", settings.width, settings.height, settings.frame);
  if (settings.region) fmt::print("region        {}\n", fmt::join(*settings.region, " "));
  fmt::print("camera        {}\nworld         {}\n", name_of(scene->cameras, settings.camera),
             name_of(scene->worlds, settings.world));
  fmt::print("integrator    {} (this program has {})\n", settings.integrator, fmt::join(available_integrators(), " "));
  fmt::print(
      "samples       {}\ntime limit    {} s\nnoise         {}\nseed          {}\nbounces       {} (diffuse {}, glossy "
      "{}, transmission {}, transparent {})\n",
      settings.samples, settings.time_limit_s, settings.noise_threshold, settings.seed, settings.max_bounces,
      settings.diffuse_bounces, settings.glossy_bounces, settings.transmission_bounces, settings.transparent_bounces);
  std::string passes = "combined";
  for (const description::Pass& pass : settings.passes) passes += " " + pass.name;
  fmt::print("passes        {}\n", passes);
  for (const auto& [name, value] : settings.metadata) fmt::print("metadata      {}: {}\n", name, value);
  return 0;
}

int describe_image(const std::string& path) {
  const auto input = OIIO::ImageInput::open(path);
  if (!input) {
    std::fprintf(stderr, "lambent: The file '%s' cannot be read: %s\n", path.c_str(), OIIO::geterror().c_str());
    return 1;
  }
  for (int part = 0; input->seek_subimage(part, 0); ++part) {
    const OIIO::ImageSpec& spec = input->spec();
    if (part > 0) fmt::print("\npart          {}\n", part);
    fmt::print("image         {} ({})\n", path, input->format_name());
    fmt::print("frame         {} x {} px\n", spec.full_width, spec.full_height);
    if (spec.x != spec.full_x || spec.y != spec.full_y || spec.width != spec.full_width ||
        spec.height != spec.full_height)
      fmt::print("data window   {} x {} px at ({}, {}) from the upper left\n", spec.width, spec.height,
                 spec.x - spec.full_x, spec.y - spec.full_y);
    fmt::print("channels      {}\n", fmt::join(spec.channelnames, " "));
    for (const auto& attribute : spec.extra_attribs)
      fmt::print("metadata      {}: {}\n", attribute.name().string(), attribute.get_string());
  }
  return 0;
}

}  // namespace

Command add_info_command(CLI::App& program) {
  const auto path = std::make_shared<std::string>();
  CLI::App* app = program.add_subcommand("info", "Describe a saved scene or an image");
  app->add_option("file", *path, "Saved scene (*.lambent) or image")->required();
  return {app, [path] { return path->ends_with(".lambent") ? describe_scene(*path) : describe_image(*path); }};
}

}  // namespace lambent
