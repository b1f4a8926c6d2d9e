// Parts of a scene's surfaces, by where they lie and face.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/base/vec.h"

namespace lambent::bidirectional {

/// A k-d tree over some places; its leaves hold about equally many of them. Immutable once built; threads share it.
class PlaceTree {
 public:
  struct Place {
    Vec3 p_world{0.0f}, ng_world{0.0f};
  };
  /// One leaf that holds everything.
  PlaceTree() : nodes_(1) {}
  /// @param most_leaves a power of two. Fewer where places do not differ
  PlaceTree(std::vector<Place> places, float scene_radius_m, int most_leaves);

  int leaves() const { return leaves_; }
  /// Its number, from 0. Of any place, also where none was.
  int leaf_at(const Vec3& p_world, const Vec3& ng_world) const {
    const Node* node = nodes_.data();
    while (node->axis != k_leaf) {
      const float x = node->axis < 3 ? p_world[node->axis] : ng_world[node->axis - 3];
      node = x < node->split ? node + 1 : nodes_.data() + node->other;
    }
    return static_cast<int>(node->other);
  }

 private:
  struct Node {
    float split = 0.0f;
    uint32_t other = 0;     ///< the right child, the left one follows; leaves: their number
    uint8_t axis = k_leaf;  ///< 0 to 2: position, 3 to 5: normal
  };
  static constexpr uint8_t k_leaf = 6;
  void build(std::span<Place> places, float per_radius, int most_leaves);

  std::vector<Node> nodes_;
  int leaves_ = 1;
};

}  // namespace lambent::bidirectional
