// Descriptions to scenes, incrementally: what did not change is shared with the scene built before.
#pragma once

#include <memory>

#include "engine/base/cancel.h"
#include "engine/base/report.h"
#include "engine/base/result.h"
#include "engine/description/description.h"
#include "engine/scene/scene.h"

namespace lambent {

struct SceneBuilderOptions {
  size_t texture_cache_bytes = size_t{1} << 30;
};

/// One per session. A datablock counts as unchanged if its pointer in the description is. Not thread-safe.
class SceneBuilder {
 public:
  explicit SceneBuilder(const SceneBuilderOptions& options);
  ~SceneBuilder();
  SceneBuilder(const SceneBuilder&) = delete;
  SceneBuilder& operator=(const SceneBuilder&) = delete;

  /// Builds a snapshot. What is wrong with a datablock is reported by its name and stood in for. Error: no camera, a
  /// camera that defines no picture, out of memory, or "cancelled" (within 100 ms of the flag; what was built is kept).
  Result<std::shared_ptr<const Scene>> build(const description::SceneDescription& description, const CancelFlag& cancel,
                                             Report& report);

 private:
  struct State;
  Result<std::shared_ptr<const Scene>> build_scene(const description::SceneDescription& description,
                                                   const CancelFlag& cancel, Report& report);
  std::unique_ptr<State> state_;
};

}  // namespace lambent
