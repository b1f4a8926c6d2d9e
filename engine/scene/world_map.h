// The world's importance map: its radiance tabulated over directions.
#pragma once

#include "engine/base/cancel.h"
#include "engine/lights/light.h"
#include "engine/shading/program.h"

namespace lambent {

/// Evaluates the world program at the centres of a latitude-longitude grid of height x 2·height texels, in parallel,
/// and returns its luminances and solid-angle weighted average; a sun's disc (ProgramTraits) apart. Incomplete if
/// cancelled.
EnvironmentLight world_importance_map(const Program& world, const TextureSystem* textures, int height,
                                      const CancelFlag& cancel);

}  // namespace lambent
