#include "engine/lights/lamp_bvh.h"

#include <algorithm>

namespace lambent {

LampBvh::LampBvh(std::span<const Lamp> lamps, std::vector<LightIndex> sized) : order_(std::move(sized)) {
  if (order_.empty()) return;
  nodes_.reserve(order_.size());
  nodes_.emplace_back();
  build(lamps, 0, 0, static_cast<uint32_t>(order_.size()));
}

void LampBvh::build(std::span<const Lamp> lamps, uint32_t node, uint32_t first, uint32_t count) {
  Bounds3 bounds, centers;
  for (uint32_t i = first; i < first + count; ++i) {
    bounds.extendBy(lamps[order_[i]].bounds());
    centers.extendBy(lamps[order_[i]].bounds().center());
  }
  // A flat lamp's box has no thickness; rounding must not let rays slip by.
  const Vec3 size = bounds.size();
  const Vec3 pad((max_component(size) + max_component(abs(bounds.center()))) * 1e-6f);
  bounds.min -= pad;
  bounds.max += pad;
  nodes_[node].bounds = bounds;
  if (count <= 2) {
    nodes_[node].first = first;
    nodes_[node].count = count;
    return;
  }
  const auto axis = static_cast<int>(centers.majorAxis());
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + count / 2, begin + count, [&](LightIndex a, LightIndex b) {
    const float x = lamps[a].bounds().center()[axis], y = lamps[b].bounds().center()[axis];
    return x != y ? x < y : a < b;
  });
  const auto left = static_cast<uint32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[node].first = left;
  nodes_[node].count = 0;
  build(lamps, left, first, count / 2);
  build(lamps, left + 1, first + count / 2, count - count / 2);
}

}  // namespace lambent
