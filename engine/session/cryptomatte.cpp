#include "engine/session/cryptomatte.h"

#include <fmt/format.h>

#include <bit>
#include <set>

#include "engine/base/name_id.h"
#include "engine/description/json_text.h"

namespace lambent {

namespace {

std::set<std::string> names_of(const description::SceneDescription& scene, const std::string& kind) {
  std::set<std::string> names;
  if (kind == "cryptomatte_material") {
    for (const auto& [id, material] : scene.materials) names.insert(material->name);
    return names;
  }
  for (const auto& [id, object] : scene.objects)
    if (!object->mesh.empty())
      names.insert(kind == "cryptomatte_asset" && !object->asset.empty() ? object->asset : object->name);
  return names;
}

}  // namespace

void add_cryptomatte_metadata(const description::SceneDescription& scene,
                              std::map<std::string, std::string>& metadata) {
  for (const description::Pass& pass : scene.settings->passes) {
    if (!pass.kind.starts_with("cryptomatte_")) continue;
    Json manifest = Json::object();
    for (const std::string& name : names_of(scene, pass.kind))
      manifest[name] = fmt::format("{:08x}", std::bit_cast<uint32_t>(name_id(name)));
    const std::string prefix = "cryptomatte/" + fmt::format("{:08x}", murmur3_32(pass.name)).substr(0, 7) + "/";
    metadata[prefix + "name"] = pass.name;
    metadata[prefix + "hash"] = "MurmurHash3_32";
    metadata[prefix + "conversion"] = "uint32_to_float32";
    metadata[prefix + "manifest"] = json_text(manifest);
  }
}

}  // namespace lambent
