// Saved scenes, `*.lambent` (PROTOCOL.md, section "Saved scenes"): the frames that would make the scene on the wire.
#pragma once

#include <cstdint>
#include <string>

#include "engine/base/report.h"
#include "engine/base/result.h"
#include "engine/description/description.h"

namespace lambent::description {

/// Writes the scene to `path` under a temporary name in the same folder, then renames, so that `path` never holds half
/// a file. Returns the bytes written. Fails with a message that names the file when it cannot be written or when one
/// datablock has no place in a frame (its JSON is over 64 MiB).
Result<uint64_t> save_scene_file(const std::string& path, const SceneDescription& scene, const std::string& created_by);

struct SceneFileLimits {
  uint64_t payload_bytes = 0;  ///< of all arrays, decompressed; 0: three quarters of this machine's memory
};

/// Reads a saved scene. Messages about datablocks (unknown members and so on) go to `report`; a file that cannot be
/// read, is damaged or holds an invalid transaction fails with a message that names the file.
Result<SceneDescription> load_scene_file(const std::string& path, Report& report, const SceneFileLimits& limits = {});

}  // namespace lambent::description
