#include "engine/scene/profile.h"

#include <utility>

namespace lambent {

const char* profile_name(KernelProfile profile) { return profile == KernelProfile::solid ? "solid" : "surfaces"; }

namespace {
std::vector<std::string> select(const SceneProfile& profile, bool value) {
  const std::pair<bool, const char*> features[] = {
      {profile.transparency, "transparent surfaces"},
      {profile.differentials, "pixel footprints"},
      {profile.emissive_meshes, "emissive meshes"},
      {profile.environment, "environment light"},
      {profile.lamps, "lamps"},
      {profile.textures, "image textures"},
      {profile.depth_of_field, "depth of field"},
      {profile.subsurface, "subsurface scattering"},
      {profile.light_linking, "light linking"},
      {profile.shadow_linking, "shadow linking"},
  };
  std::vector<std::string> names;
  for (const auto& [present, name] : features)
    if (present == value) names.emplace_back(name);
  return names;
}
}  // namespace

std::vector<std::string> modelled(const SceneProfile& profile) { return select(profile, true); }
std::vector<std::string> not_modelled(const SceneProfile& profile) { return select(profile, false); }

}  // namespace lambent
