// Builds light trees: top down, binned splits by the surface area and orientation heuristic (Conty Estevez & Kulla
// 2018, section 4.4), two binary levels a node.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "engine/lights/light_tree.h"
#include "engine/lights/light_tree_lanes.h"

namespace lambent {

class LightTreeBuilder {
 public:
  LightTreeBuilder(LightTree& tree, std::span<const LightCluster> emitters) : tree_(tree) {
    double total = 0.0;
    for (const LightCluster& e : emitters)
      if (e.intensity > 0.0) total += e.intensity;
    if (!(total > 0.0)) return;
    tree_.unit_ = total;
    items_.reserve(emitters.size());
    for (size_t i = 0; i < emitters.size(); ++i)
      if (emitters[i].intensity > 0.0) items_.push_back(item_of(emitters[i], static_cast<uint32_t>(i), total));
    tree_.size_ = items_.size();
    tree_.path_.assign(emitters.size(), LightTree::k_none);
    const Range all_items{0, static_cast<uint32_t>(items_.size())};
    Bin bin;
    for (const Item& item : items_) bin.add(item);
    // Closer than this to a light's centre, distance no longer matters: far below any picture's resolution.
    tree_.min_distance_squared_ = std::max(sqr(1e-9f * length(vec(bin.high - bin.low))), 1e-30f);
    build(all_items, 0, 0, tree_.nodes_, tree_.depth_);
    tree_.nodes_.shrink_to_fit();
  }

 private:
  using Node = LightTree::Node;
  static constexpr int k_bins = 12;
  static constexpr int k_max_levels = 16;  // two bits each in a path
  static constexpr uint32_t k_parallel = 8192;
  // Sets larger than this are split along their longest axis: it wins nearly always, at a third of the work.
  static constexpr uint32_t k_one_axis = 1024;

  struct Item {
    Lanes center;  ///< x, y, z, radius
    Lanes axis;    ///< x, y, z, intensity
    float cos_normals, cos_emission;
    uint32_t emitter;
    bool two_sided;
  };
  struct Range {
    uint32_t begin = 0, end = 0;
    uint32_t size() const { return end - begin; }
  };

  static Vec3 vec(const Lanes& v) { return {v[0], v[1], v[2]}; }

  static Item item_of(const LightCluster& e, uint32_t emitter, double total) {
    // A light that is nothing beside the others keeps a trace of importance.
    const float intensity = std::max(static_cast<float>(e.intensity / total), 1e-37f);
    // Two-sided axes point both ways: take the one in a fixed hemisphere, so that sums of axes mean something.
    Vec3 a = e.axis;
    if (e.two_sided && (a.z < 0.0f || (a.z == 0.0f && (a.y < 0.0f || (a.y == 0.0f && a.x < 0.0f))))) a = -a;
    return {Lanes{e.center.x, e.center.y, e.center.z, e.radius},
            Lanes{a.x, a.y, a.z, intensity},
            e.cos_normals,
            e.cos_emission,
            emitter,
            e.two_sided};
  }

  /// What the heuristic needs to know about a set of items. The last lane of low and high is unused.
  struct Bin {
    Lanes low = all(std::numeric_limits<float>::max()), high = all(std::numeric_limits<float>::lowest());
    Lanes axis = all(0.0f);  ///< sum of intensity-weighted axes; last lane: of intensities
    float spread = 0.0f;     ///< intensity-weighted sum of 1 - cos_normals
    uint32_t count = 0;

    void add(const Item& item) {
      const float intensity = item.axis[3];
      const Lanes radius = all(item.center[3]);
      low = smaller(low, item.center - radius);
      high = larger(high, item.center + radius);
      axis += Lanes{item.axis[0], item.axis[1], item.axis[2], 1.0f} * intensity;
      spread += intensity * (1.0f - item.cos_normals);
      ++count;
    }
    void add(const Bin& bin) {
      low = smaller(low, bin.low);
      high = larger(high, bin.high);
      axis += bin.axis;
      spread += bin.spread;
      count += bin.count;
    }
    float intensity() const { return axis[3]; }
    /// Intensity times the measures of area and of directions. The cone of axes is estimated from their resultant:
    /// spread evenly over a cap, it is (1 + cos) / 2.
    float cost() const {
      const Vec3 size = vec(high - low);
      const float area = size.x * size.y + size.y * size.z + size.z * size.x;
      const float resultant = std::min(length(vec(axis)) / intensity(), 1.0f);
      const float cos_cone = std::max(2.0f * resultant - 1.0f - spread / intensity(), -1.0f);
      // Emission reaches a right angle beyond the cone; a share of the diagonal keeps flat and straight sets apart.
      return intensity() * (area + 0.05f * length_squared(size)) * (1.0f + 2.0f * (1.0f - cos_cone));
    }
  };

  /// Lower corner and size of the box around the centres of a range.
  std::pair<Lanes, Lanes> extent_of_centers(const Range& range) const {
    Lanes low = items_[range.begin].center, high = low;
    for (uint32_t i = range.begin + 1; i < range.end; ++i) {
      low = smaller(low, items_[i].center);
      high = larger(high, items_[i].center);
    }
    return {low, high - low};
  }
  static int longest_of(const Lanes& size) {
    return size[0] >= size[1] && size[0] >= size[2] ? 0 : (size[1] >= size[2] ? 1 : 2);
  }

  static float bin_scale(float size) { return static_cast<float>(k_bins) / size; }
  static int bin_of(float x, float low, float scale) {
    return std::clamp(static_cast<int>((x - low) * scale), 0, k_bins - 1);
  }

  /// Splits a range of at least 2 in two non-empty ones; neither gets more than `capacity` items.
  std::array<Range, 2> split(const Range& range, uint64_t capacity) {
    const auto [low, size] = extent_of_centers(range);
    const int longest = longest_of(size);
    int best_axis = -1, best_bin = 0;
    float best_cost = k_infinity;
    for (int axis = 0; axis < 3; ++axis) {
      // A scale that overflows: all but in one place.
      if (!(size[axis] > 0.0f) || !std::isfinite(bin_scale(size[axis]))) continue;
      if (range.size() > k_one_axis && axis != longest) continue;
      std::array<Bin, k_bins> bins;
      const float scale = bin_scale(size[axis]), start = low[axis];
      for (uint32_t i = range.begin; i < range.end; ++i)
        bins[bin_of(items_[i].center[axis], start, scale)].add(items_[i]);
      std::array<float, k_bins> cost_above{};
      std::array<uint32_t, k_bins> count_above{};
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
    // All in one place, or too unbalanced: halves.
    if (best_axis < 0) return halve(range, range.begin + range.size() / 2, longest);
    const float scale = bin_scale(size[best_axis]), start = low[best_axis];
    const auto at = std::partition(items_.begin() + range.begin, items_.begin() + range.end, [&](const Item& item) {
      return bin_of(item.center[best_axis], start, scale) < best_bin;
    });
    const auto middle = static_cast<uint32_t>(at - items_.begin());
    return {Range{range.begin, middle}, Range{middle, range.end}};
  }

  /// The items before `middle` along an axis, and the others.
  std::array<Range, 2> halve(const Range& range, uint32_t middle, int axis) {
    const auto begin = items_.begin();
    std::nth_element(begin + range.begin, begin + middle, begin + range.end, [&](const Item& a, const Item& b) {
      const float x = a.center[axis], y = b.center[axis];
      return x != y ? x < y : a.emitter < b.emitter;
    });
    return {Range{range.begin, middle}, Range{middle, range.end}};
  }

  /// Divides a range into the children of a node; returns how many.
  int divide(const Range& range, int level, std::array<Range, 4>& parts) {
    if (range.size() <= 4) {
      for (uint32_t i = 0; i < range.size(); ++i) parts[i] = {range.begin + i, range.begin + i + 1};
      return static_cast<int>(range.size());
    }
    if (range.size() <= 16) {
      // The last two levels are filled rather than shaped: their choices are (nearly) exact, and full nodes save
      // memory. As few children as possible are nodes of up to four, the others single emitters.
      const uint32_t inner = (range.size() - 2) / 3, in_inner = range.size() - (4 - inner);
      uint32_t begin = range.begin;
      for (uint32_t i = 0; i < 4; ++i) {
        const uint32_t size = i < inner ? in_inner / inner + (i < in_inner % inner ? 1 : 0) : 1;
        const Range rest{begin, range.end};
        if (size < rest.size()) halve(rest, begin + size, longest_of(extent_of_centers(rest).second));
        parts[i] = {begin, begin + size};
        begin += size;
      }
      return 4;
    }
    // What fits below: 4^levels items a child, twice that half way.
    const uint64_t capacity = uint64_t{1} << (2 * (k_max_levels - level - 1));
    const auto halves = split(range, capacity * 2);
    parts[0] = halves[0];
    parts[1] = halves[1];
    for (int count = 2; count < 4; ++count) {
      int largest = 0;
      for (int i = 1; i < count; ++i)
        if (parts[i].size() > parts[largest].size()) largest = i;
      const auto pieces = split(parts[largest], capacity);
      parts[largest] = pieces[0];
      parts[count] = pieces[1];
    }
    return 4;
  }

  /// Writes the bounds of a range into a node's slot.
  void summarize(const Range& range, Node& node, int slot) const {
    Bin bin;
    bool two_sided = false;
    for (uint32_t i = range.begin; i < range.end; ++i) {
      bin.add(items_[i]);
      two_sided = two_sided || items_[i].two_sided;
    }
    const Vec3 center = vec((bin.low + bin.high) * 0.5f), sum = vec(bin.axis);
    const Vec3 axis = length_squared(sum) > 0.0f ? normalize(sum) : vec(items_[range.begin].axis);
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
      const Vec3 offset = vec(item.center) - center;
      // Without length()'s guards: a sphere whose square over- or underflows cannot be told from its radius here.
      radius = std::max(radius, std::sqrt(length_squared(offset)) + item.center[3]);
      float c = dot(vec(item.axis), stored_axis);
      if (two_sided) c = std::fabs(c);
      c = std::clamp(c, -1.0f, 1.0f);
      // cos(angle to the axis + half angle of the item's own cone), -1 beyond pi.
      const float co = item.cos_normals;
      const float sum_cos = co == 1.0f ? c : c * co - safe_sqrt(1.0f - c * c) * safe_sqrt(1.0f - co * co);
      cos_cone = std::min(cos_cone, c < -co ? -1.0f : sum_cos);
      cos_emission = std::min(cos_emission, item.cos_emission);
    }
    node.x[slot] = center.x;
    node.y[slot] = center.y;
    node.z[slot] = center.z;
    // The centre of several is rounded by up to an ulp of its coordinates.
    const float slack = range.size() > 1 ? max_component(abs(center)) * 1e-7f : 0.0f;
    node.radius[slot] = pack_up(radius * 1.000001f + slack);
    node.intensity[slot] = node.importance[slot] = pack_up(bin.intensity());
    node.cos_normals[slot] = pack_cos_down(cos_cone >= 1.0f - 1e-6f ? 1.0f : cos_cone - k_rounding);
    const int16_t packed = pack_cos_down(std::max(cos_emission, 0.0f));
    node.cos_emission[slot] = two_sided ? static_cast<int16_t>(-1 - packed) : packed;
  }

  /// Appends the subtree of a range to `nodes`; its first node is the range's. Depth counts nodes on the longest path.
  void build(const Range& range, int level, uint32_t path, std::vector<Node>& nodes, int& depth) {
    const size_t self = nodes.size();
    nodes.emplace_back();
    std::array<Range, 4> parts;
    const int count = divide(range, level, parts);
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
