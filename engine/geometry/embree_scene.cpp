#include "engine/geometry/embree_scene.h"

#include <fmt/format.h>

namespace lambent::embree {

Result<std::shared_ptr<Device>> Device::create() {
  std::shared_ptr<Device> device(new Device);
  // No "threads" setting: it would limit TBB in the whole process.
  device->device_ = rtcNewDevice(nullptr);
  if (!device->device_)
    return Error{fmt::format("Embree cannot start (error {}): is this processor supported?",
                             static_cast<int>(rtcGetDeviceError(nullptr)))};
  if (rtcGetDeviceProperty(device->device_, RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED) == 0 ||
      rtcGetDeviceProperty(device->device_, RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED) == 0)
    return Error{"This build of Embree lacks ray masks or filter functions, which object visibility needs."};
  rtcSetDeviceErrorFunction(
      device->device_,
      [](void* self, RTCError, const char* message) {
        auto* failing = static_cast<Device*>(self);
        const std::lock_guard lock(failing->mutex_);
        failing->last_message_ = message ? message : "";
      },
      device.get());
  rtcSetDeviceMemoryMonitorFunction(
      device->device_,
      [](void* self, ssize_t bytes, bool post) {
        auto* counting = static_cast<Device*>(self);
        const ssize_t total = counting->bytes_.fetch_add(bytes, std::memory_order_relaxed) + bytes;
        const size_t limit = counting->limit_.load(std::memory_order_relaxed);
        if (bytes <= 0 || post || limit == 0 || total <= static_cast<ssize_t>(limit)) return true;
        // Refused beforehand: it is not allocated and will not be reported as freed.
        counting->bytes_.fetch_sub(bytes, std::memory_order_relaxed);
        return false;
      },
      device.get());
  return device;
}

Device::~Device() {
  if (device_) rtcReleaseDevice(device_);
}

Status Device::check(const std::string& what) {
  const RTCError error = rtcGetDeviceError(device_);
  if (error == RTC_ERROR_NONE) return Ok{};
  if (error == RTC_ERROR_CANCELLED) return Error{"cancelled"};
  const std::lock_guard lock(mutex_);
  if (error == RTC_ERROR_OUT_OF_MEMORY)
    return Error{fmt::format("Not enough memory for the acceleration structure of {} ({} MB in use by now).", what,
                             bytes() >> 20)};
  return Error{fmt::format("Embree failed on {}: {}", what, last_message_)};
}

Scene::Scene(std::shared_ptr<Device> device, bool filter, bool compact)
    : device_(std::move(device)), scene_(rtcNewScene(device_->get())) {
  // Robust: watertight triangle tests, conservative box tests. Without it rays leak through edges.
  int flags = RTC_SCENE_FLAG_ROBUST;
  if (filter) flags |= k_scene_flag_query_filter;
  if (compact) flags |= RTC_SCENE_FLAG_COMPACT;
  rtcSetSceneFlags(scene_, static_cast<RTCSceneFlags>(flags));
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_MEDIUM);
}

Scene::~Scene() {
  if (scene_) rtcReleaseScene(scene_);
}

Status Scene::commit(const CancelFlag& cancel, const std::string& what) {
  if (!scene_) return device_->check(what);
  rtcSetSceneProgressMonitorFunction(
      scene_, [](void* flag, double) { return !static_cast<const CancelFlag*>(flag)->cancelled(); },
      const_cast<CancelFlag*>(&cancel));
  rtcCommitScene(scene_);
  rtcSetSceneProgressMonitorFunction(scene_, nullptr, nullptr);
  return device_->check(what);
}

RTCGeometry new_triangles(RTCDevice device, const float* positions, uint32_t vertex_count, const uint32_t* indices,
                          uint32_t triangle_count, uint32_t mask) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions, 0, 3 * sizeof(float),
                             vertex_count);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices, 0, 3 * sizeof(uint32_t),
                             triangle_count);
  rtcSetGeometryMask(geometry, mask);
  rtcCommitGeometry(geometry);
  return geometry;
}

}  // namespace lambent::embree
