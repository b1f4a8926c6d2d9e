// Which lamps a ray meets, among many.
#pragma once

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "engine/lights/lamp.h"

namespace lambent {

/// Finds the lamp that a ray meets first, among many. Immutable. 32 bytes a lamp.
class LampBvh {
 public:
  LampBvh() = default;
  /// Of the given lamps (indices into `lamps`).
  LampBvh(std::span<const Lamp> lamps, std::vector<LightIndex> sized);

  bool empty() const { return order_.empty(); }
  size_t bytes() const { return order_.capacity() * sizeof(order_[0]) + nodes_.capacity() * sizeof(Node); }

  /// Calls visit(LightHit&&) for every lamp that the ray meets in (t_min, t_max); visit returns the t_max to go on
  /// with.
  template <typename Visit>
  void traverse(std::span<const Lamp> lamps, const Vec3& origin, const Vec3& direction, float t_min, float t_max,
                uint32_t ray_kinds, Visit&& visit) const {
    if (nodes_.empty()) return;
    const Vec3 inverse(1.0f / direction.x, 1.0f / direction.y, 1.0f / direction.z);
    uint32_t stack[k_max_depth];
    int depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const Node& node = nodes_[stack[--depth]];
      if (!meets(node.bounds, origin, inverse, t_min, t_max)) continue;
      if (node.count == 0) {
        stack[depth++] = node.first;
        stack[depth++] = node.first + 1;
        continue;
      }
      for (uint32_t i = node.first; i < node.first + node.count; ++i) {
        const Lamp& lamp = lamps[order_[i]];
        LightHit hit;
        if ((lamp.traits().hidden_from & ray_kinds) || !lamp.intersect(origin, direction, t_min, t_max, hit)) continue;
        hit.light = order_[i];
        hit.traits = &lamp.traits();
        t_max = visit(std::move(hit));
      }
    }
  }

 private:
  static constexpr int k_max_depth = 64;  // median splits: depth is the logarithm of the number of lamps

  struct Node {
    Bounds3 bounds;
    uint32_t first = 0;  ///< leaf: position in order_; inner: left child, the right one follows
    uint32_t count = 0;  ///< 0: inner
  };
  static bool meets(const Bounds3& box, const Vec3& origin, const Vec3& inverse, float t_min, float t_max) {
    for (int axis = 0; axis < 3; ++axis) {
      const float a = (box.min[axis] - origin[axis]) * inverse[axis],
                  b = (box.max[axis] - origin[axis]) * inverse[axis];
      // Written so that a NaN (0 · infinity, a ray within a slab's face) does not reject.
      t_min = std::min(a, b) > t_min ? std::min(a, b) : t_min;
      t_max = std::max(a, b) < t_max ? std::max(a, b) : t_max;
    }
    return !(t_min > t_max * (1.0f + 1e-6f));
  }
  void build(std::span<const Lamp> lamps, uint32_t node, uint32_t first, uint32_t count);

  std::vector<LightIndex> order_;
  std::vector<Node> nodes_;
};

}  // namespace lambent
