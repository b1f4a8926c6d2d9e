// What a scene needs modelled: OR-ed upward from materials, lights and objects; selects the smallest kernel that covers
// it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace lambent {

/// Compiled kernels, each covering the one before (a chain, not a power set).
enum class KernelProfile : uint8_t {
  solid,     ///< opaque surfaces: a shadow ray is one occlusion query
  surfaces,  ///< also surfaces that let light straight through: shadow rays ask them, paths go on through them
};

inline constexpr KernelProfile k_largest_profile = KernelProfile::surfaces;

/// A bit is here because it changes control flow; everything else is data.
struct SceneProfile {
  bool transparency = false;   ///< some material may be transparent
  bool differentials = false;  ///< some material asks for pixel footprints
  bool emissive_meshes = false;
  bool environment = false;  ///< the world emits
  bool lamps = false;        ///< lights other than meshes and the world
  bool textures = false;
  bool depth_of_field = false;
  bool subsurface = false;        ///< some material scatters under its surface
  bool light_linking = false;     ///< some light does not reach everything
  bool shadow_linking = false;    ///< some light is not blocked by everything
  bool alike_for_shadows = true;  ///< what rays from diffuse surfaces see is what shadow rays see

  KernelProfile kernel() const { return transparency ? KernelProfile::surfaces : KernelProfile::solid; }
};

/// "solid" or "surfaces".
const char* profile_name(KernelProfile profile);
/// For the statistics: what was and what was not modelled.
std::vector<std::string> modelled(const SceneProfile& profile);
std::vector<std::string> not_modelled(const SceneProfile& profile);

}  // namespace lambent
