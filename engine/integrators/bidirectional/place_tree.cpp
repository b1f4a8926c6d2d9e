#include "engine/integrators/bidirectional/place_tree.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace lambent::bidirectional {

namespace {

/// Normals against positions in radii of the scene, when a node looks for the axis along which its places differ most.
constexpr float k_normal_extent = 0.1f;

float along(const PlaceTree::Place& place, int axis) {
  return axis < 3 ? place.p_world[axis] : place.ng_world[axis - 3];
}

}  // namespace

PlaceTree::PlaceTree(std::vector<Place> places, float scene_radius_m, int most_leaves) : leaves_(0) {
  build(places, scene_radius_m > 0.0f ? 1.0f / scene_radius_m : 1.0f, most_leaves);
}

void PlaceTree::build(std::span<Place> places, float per_radius, int most_leaves) {
  const size_t at = nodes_.size();
  nodes_.emplace_back();
  int widest = 0;
  float extent = 0.0f;
  for (int axis = 0; axis < 6 && !places.empty(); ++axis) {
    const auto [low, high] = std::minmax_element(
        places.begin(), places.end(), [&](const Place& l, const Place& r) { return along(l, axis) < along(r, axis); });
    const float wide = (along(*high, axis) - along(*low, axis)) * (axis < 3 ? per_radius : k_normal_extent);
    if (wide > extent) {
      extent = wide;
      widest = axis;
    }
  }
  if (most_leaves < 2 || !(extent > 0.0f)) {
    nodes_[at].other = static_cast<uint32_t>(leaves_++);
    return;
  }
  std::sort(places.begin(), places.end(), [&](const Place& l, const Place& r) {
    return std::tuple(along(l, widest), l.p_world.x, l.p_world.y, l.p_world.z) <
           std::tuple(along(r, widest), r.p_world.x, r.p_world.y, r.p_world.z);
  });
  // At the middle, or right above it where half of them lie at the lowest place.
  float split = along(places[places.size() / 2], widest);
  if (split == along(places.front(), widest)) split = std::nextafter(split, k_infinity);
  const auto edge = std::partition_point(places.begin(), places.end(),
                                         [&](const Place& place) { return along(place, widest) < split; });
  const size_t left = static_cast<size_t>(edge - places.begin());
  nodes_[at].split = split;
  nodes_[at].axis = static_cast<uint8_t>(widest);
  build(places.first(left), per_radius, most_leaves / 2);
  nodes_[at].other = static_cast<uint32_t>(nodes_.size());
  build(places.subspan(left), per_radius, most_leaves / 2);
}

}  // namespace lambent::bidirectional
