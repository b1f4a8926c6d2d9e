// Light vertices that all camera walks of a pass share, chosen from the light walks of the sample before.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "engine/integrators/bidirectional/place_tree.h"
#include "engine/path/light_walk.h"

namespace lambent::bidirectional {

/// What connecting parts of what camera walks meet ("regions") to light vertices is worth, for each watt that arrives
/// at these, by where both lie and face. Regions come in two sorts: of what the camera sees first, and of what its
/// walks meet later, which are some neighbouring leaves of the light's each. Immutable once built; threads share it.
///
/// Weights ask for both by the surfaces' own normals, so that they do not depend on the side from which a walk came.
class ConnectionGuide {
 public:
  /// There is nothing to choose by.
  ConnectionGuide() = default;
  /// @param worth [region][light leaf], any scale: regions of what is seen first, then of what is met later
  /// @param flux, vertices by light leaf: W and number of vertices of `walks` light walks
  ConnectionGuide(PlaceTree camera, PlaceTree light, std::vector<double> worth, const std::vector<double>& flux,
                  const std::vector<double>& vertices, int walks);

  static constexpr int k_leaves_of_later = 4;

  bool empty() const { return worth_.empty(); }
  int regions() const { return first_regions() + later_regions(); }
  int first_regions() const { return camera_.leaves(); }
  int later_regions() const { return later_regions(light_.leaves()); }
  static int later_regions(int light_leaves) { return (light_leaves + k_leaves_of_later - 1) / k_leaves_of_later; }
  int light_leaves() const { return light_.leaves(); }
  /// Of a vertex that is not the first to connect.
  int later_region(int light_leaf) const { return first_regions() + light_leaf / k_leaves_of_later; }
  int region_at(const SurfaceHit& surface) const { return camera_.leaf_at(surface.p_world, surface.ng_world); }
  int light_leaf_at(const SurfaceHit& surface) const { return light_.leaf_at(surface.p_world, surface.ng_world); }
  /// To all of the picture; never 0.
  float worth_per_watt(int light_leaf) const { return all_[static_cast<size_t>(light_leaf)]; }
  float worth_per_watt(int region, int light_leaf) const { return worth_[index(region, light_leaf)]; }
  /// How often a pick of that region chooses a vertex of the leaf's usual flux, for each such vertex of a light walk.
  float chosen(int region, int light_leaf) const { return chosen_[index(region, light_leaf)]; }

  /// Tells the vertices of a walk where they lie (LightVertex::place).
  void place(LightWalk& walk) const;
  /// What connecting to a vertex, its place known, is worth to all of the picture.
  double worth(const LightVertex& vertex) const;
  /// Of all of a walk's vertices.
  double worth(const LightWalk& walk) const;

 private:
  size_t index(int region, int light_leaf) const {
    return static_cast<size_t>(region) * all_.size() + static_cast<size_t>(light_leaf);
  }
  PlaceTree camera_, light_;
  std::vector<float> worth_, chosen_;  ///< [region][light leaf]
  std::vector<float> all_;             ///< [light leaf]
};

/// Connections of the first vertex of a camera walk that connects, and of each later one; 0: to the own light walk.
struct ConnectionPicks {
  int first = 1, later = 1;
};

/// The vertices, chosen by what they are worth to all of the picture; from these each region chooses by what they are
/// worth to it. Without bias for any worth that is not 0: what is chosen less often weighs more.
class VertexPool {
 public:
  struct Vertex {
    const LightWalk* walk = nullptr;
    int index = 0;
    float scale = 1.0f;  ///< what a connection to it weighs if it is the only pick and all are as likely
    const LightVertex& operator*() const { return (*walk)[index]; }
  };
  struct Pick {
    size_t number = 0;
    float scale = 1.0f;  ///< what the connection weighs
  };

  bool empty() const { return vertices_.empty(); }
  void clear() { vertices_.clear(); }
  const Vertex& operator[](size_t number) const { return vertices_[number]; }
  const std::vector<Vertex>& vertices() const { return vertices_; }
  /// @param picks connections of a camera walk that share the light
  void set(std::vector<Vertex> vertices, const ConnectionPicks& picks) {
    vertices_ = std::move(vertices);
    picks_ = picks;
    below_.clear();
  }
  void set(std::vector<Vertex> vertices, const ConnectionPicks& picks, const ConnectionGuide& guide);
  int picks(bool first) const { return first ? picks_.first : picks_.later; }

  /// One of `picks`.
  Pick pick(int region, float u, int picks) const {
    const size_t size = vertices_.size();
    if (below_.empty()) {
      const size_t number = std::min(static_cast<size_t>(u * static_cast<float>(size)), size - 1);
      return {number, vertices_[number].scale / static_cast<float>(picks)};
    }
    const float* below = below_.data() + static_cast<size_t>(region) * size;
    const size_t number = std::min(static_cast<size_t>(std::upper_bound(below, below + size, u) - below), size - 1);
    const float probability = below[number] - (number > 0 ? below[number - 1] : 0.0f);
    return {number, vertices_[number].scale / (static_cast<float>(picks) * static_cast<float>(size) * probability)};
  }

 private:
  std::vector<Vertex> vertices_;
  std::vector<float> below_;  ///< [region][number]: probability of that one or one before; empty: all are as likely
  ConnectionPicks picks_;
};

/// A light walk that the pool may take vertices of.
struct PoolCandidate {
  int x = 0, y = 0;  ///< the pixel whose sample's it was
  double worth = 0.0;
};

/// One that it does.
struct ChosenWalk {
  int x = 0, y = 0;
  std::vector<double> at;  ///< ascending: chosen are the vertices at which the sum of worths passes these
};

/// Chooses `count` vertices by steps of equal worth from a place that u in [0, 1) gives; returns their walks.
std::vector<ChosenWalk> choose_walks(std::span<const PoolCandidate> candidates, size_t count, float u);
/// Appends the chosen vertices of a walk that was traced again and knows its places.
/// @param per_worth sum of the candidates' worths over their number: what a vertex weighs, times its worth
void take_vertices(const ConnectionGuide& guide, const LightWalk& walk, const ChosenWalk& chosen, double per_worth,
                   std::vector<VertexPool::Vertex>& taken);

}  // namespace lambent::bidirectional
