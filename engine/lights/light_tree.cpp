#include "engine/lights/light_tree.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace lambent {

namespace {

// --- Packing

/// Upper half of a non-negative float, rounded up, and back.
uint16_t pack_up(float x) { return static_cast<uint16_t>((std::bit_cast<uint32_t>(x) + 0xffffu) >> 16); }
float unpack(uint16_t x) { return std::bit_cast<float>(static_cast<uint32_t>(x) << 16); }

constexpr float k_fixed = 32767.0f;
constexpr float k_rounding = 1e-4f;
int16_t pack_cos_down(float c) { return static_cast<int16_t>(std::floor(std::clamp(c, -1.0f, 1.0f) * k_fixed)); }

/// cos(a - b), 1 if a < b; angles in [0, pi] by cosine and sine.
float cos_of_difference(float cos_a, float sin_a, float cos_b, float sin_b) {
  return cos_a > cos_b ? 1.0f : cos_a * cos_b + sin_a * sin_b;
}
float sin_of_difference(float cos_a, float sin_a, float cos_b, float sin_b) {
  return cos_a > cos_b ? 0.0f : sin_a * cos_b - cos_a * sin_b;
}

}  // namespace

/// Irradiance estimates of the four children: intensity · cos' / d², bounds of Conty Estevez & Kulla 2018 in the form
/// of pbrt-v4's LightBounds::Importance. Written lane by lane without branches, so that it compiles to vector code.
void LightTree::weigh(const Node& node, const Vec3& p, const Vec3& n, float out[k_width]) const {
  const bool oriented = length_squared(n) > 0.0f;
  for (int i = 0; i < k_width; ++i) {
    const float x = node.x[i] - p.x, y = node.y[i] - p.y, z = node.z[i] - p.z;
    const float radius = std::bit_cast<float>(static_cast<uint32_t>(node.radius[i]) << 16);
    const float intensity = std::bit_cast<float>(static_cast<uint32_t>(node.intensity[i]) << 16);
    const float d_squared = x * x + y * y + z * z;
    const float r_squared = radius * radius;
    const float safe_d_squared = std::max(d_squared, min_distance_squared_);
    const float per_d = 1.0f / std::sqrt(safe_d_squared);
    // Half angle under which the bounding sphere is seen; from inside, all directions.
    const float sin_squared_b = std::min(r_squared * (per_d * per_d), 1.0f);
    const bool inside = !(d_squared > r_squared);
    const float cos_b = inside ? -1.0f : std::sqrt(1.0f - sin_squared_b);
    const float sin_b = inside ? 0.0f : std::sqrt(sin_squared_b);
    // Angle at the lights, between their axis and the direction to the receiver.
    float cos_w = -(x * static_cast<float>(node.axis[0][i]) + y * static_cast<float>(node.axis[1][i]) +
                    z * static_cast<float>(node.axis[2][i])) *
                  (per_d * (1.0f / k_fixed));
    const float packed_e = static_cast<float>(node.cos_emission[i]);
    cos_w = packed_e < 0.0f ? std::fabs(cos_w) : cos_w;
    const float cos_e = (packed_e < 0.0f ? -1.0f - packed_e : packed_e) * (1.0f / k_fixed);
    cos_w = std::min(std::max(cos_w, -1.0f), 1.0f);
    const float sin_w = std::sqrt(1.0f - cos_w * cos_w);
    const float cos_o = static_cast<float>(node.cos_normals[i]) * (1.0f / k_fixed);
    const float sin_o = std::sqrt(std::max(1.0f - cos_o * cos_o, 0.0f));
    const float cos_x = cos_of_difference(cos_w, sin_w, cos_o, sin_o);
    const float sin_x = sin_of_difference(cos_w, sin_w, cos_o, sin_o);
    const float cos_light = cos_of_difference(cos_x, sin_x, cos_b, sin_b);
    // Angle at the receiver.
    const float raw_i = (x * n.x + y * n.y + z * n.z) * per_d;
    const float cos_i = std::min(std::max(raw_i, -1.0f), 1.0f);
    const float sin_i = std::sqrt(1.0f - cos_i * cos_i);
    const float cos_receiver = oriented ? cos_of_difference(cos_i, sin_i, cos_b, sin_b) : 1.0f;
    // Axes and cosines are rounded: what may be just lit keeps a little importance.
    const bool lit = cos_light > cos_e - k_rounding && cos_receiver > 0.0f;
    const float estimate =
        intensity * std::max(cos_light, k_rounding) * cos_receiver / std::max(safe_d_squared, r_squared);
    out[i] = lit ? estimate : 0.0f;
  }
}

namespace {

/// Child of a node chosen by weights: which, its share, and u stretched to [0, 1) again.
struct Pick {
  int child = -1;
  float prob = 0.0f;
};

Pick pick(const float weights[4], double& u) {
  const float total = (weights[0] + weights[1]) + (weights[2] + weights[3]);
  if (!(total > 0.0f)) return {};
  const double target = u * static_cast<double>(total);
  double before = 0.0;
  int last = -1;
  for (int i = 0; i < 4; ++i) {
    if (!(weights[i] > 0.0f)) continue;
    last = i;
    const auto weight = static_cast<double>(weights[i]);
    if (target < before + weight) {
      u = std::min((target - before) / weight, 0x1.fffffffffffffp-1);
      return {i, weights[i] / total};
    }
    before += weight;
  }
  u = 0x1.fffffffffffffp-1;  // the float sum rounded above the sum of its parts
  return {last, weights[last] / total};
}

float share(const float weights[4], int child) {
  const float total = (weights[0] + weights[1]) + (weights[2] + weights[3]);
  return total > 0.0f ? weights[child] / total : 0.0f;
}

}  // namespace

float LightTree::importance(const Vec3& p, const Vec3& n) const {
  if (nodes_.empty()) return 0.0f;
  float weights[k_width];
  weigh(nodes_[0], p, n, weights);
  return (weights[0] + weights[1]) + (weights[2] + weights[3]);
}

LightTree::Choice LightTree::sample(const Vec3& p, const Vec3& n, double u) const {
  Choice choice;
  if (nodes_.empty()) return choice;
  choice.prob = 1.0f;
  for (uint32_t node = 0;;) {
    float weights[k_width];
    weigh(nodes_[node], p, n, weights);
    const Pick picked = pick(weights, u);
    if (picked.child < 0) return {};
    choice.prob *= picked.prob;
    const uint32_t child = nodes_[node].child[picked.child];
    if (child & k_leaf) {
      choice.emitter = child & ~k_leaf;
      return choice;
    }
    node = child;
  }
}

float LightTree::prob(const Vec3& p, const Vec3& n, uint32_t emitter) const {
  if (emitter >= path_.size() || path_[emitter] == k_none) return 0.0f;
  float prob = 1.0f;
  uint32_t path = path_[emitter];
  for (uint32_t node = 0;; path >>= 2) {
    float weights[k_width];
    weigh(nodes_[node], p, n, weights);
    const int slot = static_cast<int>(path & 3u);
    prob *= share(weights, slot);
    const uint32_t child = nodes_[node].child[slot];
    if ((child & k_leaf) || prob == 0.0f) return prob;
    node = child;
  }
}

LightTree::Choice LightTree::sample_by_intensity(double u) const {
  Choice choice;
  if (nodes_.empty()) return choice;
  choice.prob = 1.0f;
  for (uint32_t node = 0;;) {
    float weights[k_width];
    for (int i = 0; i < k_width; ++i) weights[i] = unpack(nodes_[node].intensity[i]);
    const Pick picked = pick(weights, u);
    choice.prob *= picked.prob;
    const uint32_t child = nodes_[node].child[picked.child];
    if (child & k_leaf) {
      choice.emitter = child & ~k_leaf;
      return choice;
    }
    node = child;
  }
}

float LightTree::prob_by_intensity(uint32_t emitter) const {
  if (emitter >= path_.size() || path_[emitter] == k_none) return 0.0f;
  float prob = 1.0f;
  uint32_t path = path_[emitter];
  for (uint32_t node = 0;; path >>= 2) {
    float weights[k_width];
    for (int i = 0; i < k_width; ++i) weights[i] = unpack(nodes_[node].intensity[i]);
    const int slot = static_cast<int>(path & 3u);
    prob *= share(weights, slot);
    const uint32_t child = nodes_[node].child[slot];
    if (child & k_leaf) return prob;
    node = child;
  }
}

size_t LightTree::bytes() const { return nodes_.capacity() * sizeof(Node) + path_.capacity() * sizeof(uint32_t); }

std::vector<uint32_t> LightTree::leaf_order() const {
  std::vector<uint32_t> order;
  order.reserve(size_);
  std::vector<uint32_t> stack;
  if (!nodes_.empty()) stack.push_back(0);
  while (!stack.empty()) {
    const uint32_t top = stack.back();
    stack.pop_back();
    if (top & k_leaf) {
      order.push_back(top & ~k_leaf);
      continue;
    }
    for (int i = k_width - 1; i >= 0; --i)
      if (nodes_[top].child[i] != k_none) stack.push_back(nodes_[top].child[i]);
  }
  return order;
}

void LightTree::renumber(std::span<const uint32_t> new_number, uint32_t count) {
  std::vector<uint32_t> paths(count, k_none);
  for (size_t i = 0; i < path_.size(); ++i)
    if (path_[i] != k_none) paths[new_number[i]] = path_[i];
  path_ = std::move(paths);
  for (Node& node : nodes_)
    for (uint32_t& link : node.child)
      if (link != k_none && (link & k_leaf)) link = new_number[link & ~k_leaf] | k_leaf;
}

// --- Construction

/// Builds a LightTree top down: binned splits by the surface area and orientation heuristic, two binary levels a node.
class LightTreeBuilder {
 public:
  LightTreeBuilder(LightTree& tree, std::span<const LightCluster> emitters) : tree_(tree) {
    items_.reserve(emitters.size());
    double total = 0.0;
    for (const LightCluster& e : emitters)
      if (e.intensity > 0.0) total += e.intensity;
    if (!(total > 0.0)) return;
    tree_.unit_ = total;
    for (size_t i = 0; i < emitters.size(); ++i) {
      const LightCluster& e = emitters[i];
      if (!(e.intensity > 0.0)) continue;
      // A light that is nothing beside the others keeps a trace of importance.
      const float intensity = std::max(static_cast<float>(e.intensity / total), 1e-37f);
      items_.push_back({e.center, e.radius, e.axis, intensity, e.cos_normals, e.cos_emission, static_cast<uint32_t>(i),
                        e.two_sided});
    }
    tree_.size_ = items_.size();
    tree_.path_.assign(emitters.size(), LightTree::k_none);
    const Range all{0, static_cast<uint32_t>(items_.size())};
    const Bounds3 box = bounds(all);
    // Closer than this to a light's centre, distance no longer matters: far below any picture's resolution.
    tree_.min_distance_squared_ = std::max(sqr(1e-9f * length(box.size())), 1e-30f);
    build(all, 0, 0, tree_.nodes_, tree_.depth_);
    tree_.nodes_.shrink_to_fit();
  }

 private:
  using Node = LightTree::Node;
  static constexpr int k_bins = 12;
  static constexpr int k_max_levels = 16;  // two bits each in a path
  static constexpr uint32_t k_parallel = 8192;

  struct Item {
    Vec3 center;
    float radius;
    Vec3 axis;
    float intensity;
    float cos_normals, cos_emission;
    uint32_t emitter;
    bool two_sided;
  };
  struct Range {
    uint32_t begin = 0, end = 0;
    uint32_t size() const { return end - begin; }
  };
  /// What the heuristic needs to know about a set of items.
  struct Bin {
    Vec3 low{std::numeric_limits<float>::max()}, high{std::numeric_limits<float>::lowest()};
    Vec3 axis{0.0f};  ///< sum of intensity-weighted axes
    float intensity = 0.0f;
    float spread = 0.0f;  ///< intensity-weighted sum of 1 - cos_normals
    uint32_t count = 0;

    void add(const Item& item) {
      const Vec3 r(item.radius);
      extend(item.center - r, item.center + r);
      // Two-sided axes point both ways: count them all in one hemisphere.
      const Vec3& a = item.axis;
      const bool flip = item.two_sided && (a.z < 0.0f || (a.z == 0.0f && (a.y < 0.0f || (a.y == 0.0f && a.x < 0.0f))));
      axis += a * (flip ? -item.intensity : item.intensity);
      intensity += item.intensity;
      spread += item.intensity * (1.0f - item.cos_normals);
      ++count;
    }
    void add(const Bin& bin) {
      if (bin.count == 0) return;
      extend(bin.low, bin.high);
      axis += bin.axis;
      intensity += bin.intensity;
      spread += bin.spread;
      count += bin.count;
    }
    void extend(const Vec3& a, const Vec3& b) {
      low = {std::min(low.x, a.x), std::min(low.y, a.y), std::min(low.z, a.z)};
      high = {std::max(high.x, b.x), std::max(high.y, b.y), std::max(high.z, b.z)};
    }
    /// Intensity times the measures of area and of directions (Conty Estevez & Kulla 2018, section 4.4). The cone is
    /// estimated from the resultant of the axes: evenly spread over a cap, it is (1 + cos) / 2.
    float cost() const {
      const Vec3 size = high - low;
      const float area = size.x * size.y + size.y * size.z + size.z * size.x;
      const float diagonal = length_squared(size);
      const float resultant = std::min(length(axis) / intensity, 1.0f);
      const float cos_cone = std::max(2.0f * resultant - 1.0f - spread / intensity, -1.0f);
      // Emission reaches a right angle beyond the cone; a share of the diagonal keeps flat and straight sets apart.
      const float directions = 1.0f + 2.0f * (1.0f - cos_cone);
      return intensity * (area + 0.05f * diagonal) * directions;
    }
  };

  Bounds3 bounds(const Range& range) const {
    Bounds3 box;
    for (uint32_t i = range.begin; i < range.end; ++i) {
      box.extendBy(items_[i].center - Vec3(items_[i].radius));
      box.extendBy(items_[i].center + Vec3(items_[i].radius));
    }
    return box;
  }

  /// Splits a range of at least 2 in two non-empty ones; neither gets more than `capacity` items.
  std::array<Range, 2> split(const Range& range, uint64_t capacity) {
    Vec3 low = items_[range.begin].center, high = low;
    for (uint32_t i = range.begin + 1; i < range.end; ++i) {
      const Vec3& c = items_[i].center;
      low = {std::min(low.x, c.x), std::min(low.y, c.y), std::min(low.z, c.z)};
      high = {std::max(high.x, c.x), std::max(high.y, c.y), std::max(high.z, c.z)};
    }
    const Vec3 size = high - low;
    const int longest = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
    const auto item_begin = items_.begin() + range.begin, item_end = items_.begin() + range.end;
    int best_axis = -1, best_bin = 0;
    float best_cost = k_infinity;
    for (int axis = 0; axis < 3; ++axis) {
      // Large sets: the longest axis alone decides nearly always, at a third of the work.
      if (!(size[axis] > 0.0f) || (range.size() > 65536 && axis != longest)) continue;
      std::array<Bin, k_bins> bins;
      const float scale = bin_scale(size[axis]);
      for (auto item = item_begin; item != item_end; ++item)
        bins[bin_of(item->center[axis], low[axis], scale)].add(*item);
      std::array<float, k_bins> cost_above;
      std::array<uint32_t, k_bins> count_above;
      Bin running;
      for (int b = k_bins - 1; b > 0; --b) {
        running.add(bins[b]);
        cost_above[b] = running.count > 0 ? running.cost() : 0.0f;
        count_above[b] = running.count;
      }
      running = {};
      for (int b = 1; b < k_bins; ++b) {
        running.add(bins[b - 1]);
        if (running.count == 0 || count_above[b] == 0 || running.count > capacity || count_above[b] > capacity)
          continue;
        // Thin boxes are made no thinner (the factor Kr of the paper).
        const float cost = (running.cost() + cost_above[b]) * (size[longest] / size[axis]);
        if (cost < best_cost) {
          best_cost = cost;
          best_axis = axis;
          best_bin = b;
        }
      }
    }
    uint32_t middle = 0;
    if (best_axis >= 0) {
      const float scale = bin_scale(size[best_axis]);
      const auto at = std::partition(item_begin, item_end, [&](const Item& item) {
        return bin_of(item.center[best_axis], low[best_axis], scale) < best_bin;
      });
      middle = static_cast<uint32_t>(at - items_.begin());
    } else {
      // All in one place, or too unbalanced: halves.
      middle = range.begin + range.size() / 2;
      std::nth_element(item_begin, items_.begin() + middle, item_end, [&](const Item& a, const Item& b) {
        const float x = a.center[longest], y = b.center[longest];
        return x != y ? x < y : a.emitter < b.emitter;
      });
    }
    return {Range{range.begin, middle}, Range{middle, range.end}};
  }

  static float bin_scale(float size) { return static_cast<float>(k_bins) / size; }
  static int bin_of(float x, float low, float scale) {
    return std::clamp(static_cast<int>((x - low) * scale), 0, k_bins - 1);
  }

  /// Writes the tight bounds of a range into a node's slot.
  void summarize(const Range& range, Node& node, int slot) const {
    Bin bin;
    for (uint32_t i = range.begin; i < range.end; ++i) bin.add(items_[i]);
    const Vec3 center = (bin.low + bin.high) * 0.5f;
    bool two_sided = false;
    for (uint32_t i = range.begin; i < range.end; ++i) two_sided = two_sided || items_[i].two_sided;
    const Vec3 axis = length_squared(bin.axis) > 0.0f ? normalize(bin.axis) : items_[range.begin].axis;
    // What is stored is rounded; bounds are measured from that.
    Vec3 stored_axis;
    for (int k = 0; k < 3; ++k) {
      node.axis[k][slot] = static_cast<int16_t>(std::lround(axis[k] * k_fixed));
      stored_axis[k] = static_cast<float>(node.axis[k][slot]) * (1.0f / k_fixed);
    }
    stored_axis = normalize(stored_axis);
    float radius = 0.0f, cos_cone = 1.0f, cos_emission = 1.0f;
    for (uint32_t i = range.begin; i < range.end; ++i) {
      const Item& item = items_[i];
      radius = std::max(radius, length(item.center - center) + item.radius);
      float c = dot(item.axis, stored_axis);
      if (two_sided) c = std::fabs(c);
      c = std::clamp(c, -1.0f, 1.0f);
      // cos(angle to the axis + half angle of the item's own cone), -1 beyond pi.
      const float s = safe_sqrt(1.0f - c * c), co = item.cos_normals, so = safe_sqrt(1.0f - co * co);
      cos_cone = std::min(cos_cone, c < -co ? -1.0f : c * co - s * so);
      cos_emission = std::min(cos_emission, item.cos_emission);
    }
    node.x[slot] = center.x;
    node.y[slot] = center.y;
    node.z[slot] = center.z;
    // The centre is rounded by up to 1 ulp of its coordinates.
    node.radius[slot] =
        pack_up(radius * 1.000001f + max_component(abs(center)) * 1e-7f * (range.size() > 1 ? 1.0f : 0.0f));
    node.intensity[slot] = pack_up(bin.intensity);
    // Sines are worse than cosines near the axis: 2e-4 is what rounding of the axis and of the cosine amount to there.
    node.cos_normals[slot] = pack_cos_down(cos_cone >= 1.0f - 1e-6f ? 1.0f : cos_cone - 1e-4f);
    const int16_t packed = pack_cos_down(std::max(cos_emission, 0.0f));
    node.cos_emission[slot] = two_sided ? static_cast<int16_t>(-1 - packed) : packed;
  }

  /// Appends the subtree of a range to `nodes`; its first node is the range's. Depth counts nodes on the longest path.
  void build(const Range& range, int level, uint32_t path, std::vector<Node>& nodes, int& depth) {
    const size_t self = nodes.size();
    nodes.emplace_back();
    std::array<Range, 4> parts{range};
    int count = 1;
    if (range.size() <= 4) {
      count = static_cast<int>(range.size());
      for (uint32_t i = 0; i < range.size(); ++i) parts[i] = {range.begin + i, range.begin + i + 1};
    } else {
      // What fits below: 4^levels items a child, twice that half way.
      const int below = k_max_levels - level - 1;
      const uint64_t capacity = uint64_t{1} << (2 * below);
      const auto halves = split(range, capacity * 2);
      parts[0] = halves[0];
      parts[1] = halves[1];
      count = 2;
      while (count < 4) {
        int largest = 0;
        for (int i = 1; i < count; ++i)
          if (parts[i].size() > parts[largest].size()) largest = i;
        const auto pieces = split(parts[largest], capacity);
        parts[largest] = pieces[0];
        parts[count++] = pieces[1];
      }
    }
    std::array<std::vector<Node>, 4> subtrees;
    std::array<int, 4> depths{};
    const bool parallel = range.size() > k_parallel;
    const auto child = [&](int i) {
      summarize(parts[i], nodes[self], i);
      const uint32_t child_path = path | static_cast<uint32_t>(i) << (2 * level);
      if (parts[i].size() > 1) {
        if (parallel) build(parts[i], level + 1, child_path, subtrees[i], depths[i]);
        return;
      }
      const uint32_t emitter = items_[parts[i].begin].emitter;
      nodes[self].child[i] = emitter | LightTree::k_leaf;
      tree_.path_[emitter] = child_path;
    };
    if (parallel)
      tbb::parallel_for(0, count, child);
    else
      for (int i = 0; i < count; ++i) child(i);
    for (int i = 0; i < count; ++i) {
      if (parts[i].size() <= 1) continue;
      const auto first = static_cast<uint32_t>(nodes.size());
      nodes[self].child[i] = first;
      if (!parallel) {
        build(parts[i], level + 1, path | static_cast<uint32_t>(i) << (2 * level), nodes, depths[i]);
        continue;
      }
      for (Node& node : subtrees[i]) {
        for (uint32_t& link : node.child)
          if (!(link & LightTree::k_leaf)) link += first;
        nodes.push_back(node);
      }
      subtrees[i] = {};
    }
    depth = 1 + *std::max_element(depths.begin(), depths.end());
  }

  LightTree& tree_;
  std::vector<Item> items_;
};

LightTree::LightTree(std::span<const LightCluster> emitters) { LightTreeBuilder(*this, emitters); }

}  // namespace lambent
