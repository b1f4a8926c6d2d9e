// Owners of Embree's device and scenes. Internal to geometry/.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "engine/base/cancel.h"
#include "engine/base/result.h"
#include "engine/geometry/embree_api.h"

namespace lambent::embree {

/// Embree's device, its memory account and its last error. Shared by all scenes made on it.
class Device {
 public:
  static Result<std::shared_ptr<Device>> create();
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  RTCDevice get() const { return device_; }
  /// Bytes that all scenes of the device hold.
  size_t bytes() const { return static_cast<size_t>(std::max<ssize_t>(bytes_.load(std::memory_order_relaxed), 0)); }
  /// More than this makes a build fail with an Error; 0: no limit.
  void set_memory_limit(size_t bytes) { limit_.store(bytes, std::memory_order_relaxed); }

  /// What went wrong on the calling thread since the last call; `Ok` if nothing.
  Status check(const std::string& what);

 private:
  Device() = default;
  RTCDevice device_ = nullptr;
  std::atomic<ssize_t> bytes_{0};
  std::atomic<size_t> limit_{0};
  std::mutex mutex_;
  std::string last_message_;
};

/// A scene and the device it lives on.
class Scene {
 public:
  /// `filter`: any_hit_visiting will be used. `compact`: less memory.
  Scene(std::shared_ptr<Device> device, bool filter, bool compact);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  RTCScene get() const { return scene_; }
  Device& device() const { return *device_; }
  /// Builds; the Error is "cancelled" if the flag was set meanwhile. `what` is named in other errors.
  Status commit(const CancelFlag& cancel, const std::string& what);

 private:
  std::shared_ptr<Device> device_;
  RTCScene scene_;
};

/// A committed triangle geometry over shared arrays float[V][3] and uint32[T][3]. The caller releases it.
RTCGeometry new_triangles(RTCDevice device, const float* positions, uint32_t vertex_count, const uint32_t* indices,
                          uint32_t triangle_count, uint32_t mask);

}  // namespace lambent::embree
