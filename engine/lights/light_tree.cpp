#include "engine/lights/light_tree.h"

#include <algorithm>

#include "engine/lights/light_tree_lanes.h"

namespace lambent {

namespace {

/// Within half its radius a cluster counts as that far away: evenly spread through the sphere, its lights give 3 / r²
/// at the centre on average; spread over a surface, more.
constexpr float k_near = 0.25f;

}  // namespace

/// Irradiance estimates of the four children: intensity · cos' / d², bounds of Conty Estevez & Kulla 2018 in the form
/// of pbrt-v4's LightBounds::Importance.
void LightTree::weigh(const Node& node, const Vec3& p, const Vec3& n, float out[k_width]) const {
  const Lanes zero = all(0.0f), one = all(1.0f);
  const Lanes x = load<Lanes>(node.x) - p.x, y = load<Lanes>(node.y) - p.y, z = load<Lanes>(node.z) - p.z;
  const Lanes radius = from_halves(node.radius);
  const Lanes d_squared = x * x + y * y + z * z, r_squared = radius * radius;
  const Lanes safe_d_squared = larger(d_squared, all(min_distance_squared_));
  const Lanes per_d = one / root(safe_d_squared);
  // Half angle under which the bounding sphere is seen; from inside, all directions.
  const Lanes sin_squared_b = smaller(r_squared * (per_d * per_d), one);
  const auto outside = d_squared > r_squared;
  const Lanes cos_b = outside ? root(one - sin_squared_b) : -one;
  const Lanes sin_b = outside ? root(sin_squared_b) : zero;
  // Angle at the lights, between their axis and the direction to the receiver.
  const Lanes along_axis = x * from_fixed(node.axis[0]) + y * from_fixed(node.axis[1]) + z * from_fixed(node.axis[2]);
  Lanes cos_w = clamped_cos(along_axis * (per_d * (-1.0f / k_fixed)));
  const Lanes packed_e = from_fixed(node.cos_emission);
  const auto two_sided = packed_e < zero;
  cos_w = two_sided ? larger(cos_w, -cos_w) : cos_w;
  const Lanes cos_e = (two_sided ? -one - packed_e : packed_e) * (1.0f / k_fixed);
  const Lanes sin_w = sin_of_cos(cos_w);
  const Lanes cos_o = from_fixed(node.cos_normals) * (1.0f / k_fixed);
  const Lanes sin_o = sin_of_cos(cos_o);
  const Lanes cos_x = cos_of_difference(cos_w, sin_w, cos_o, sin_o);
  const Lanes sin_x = sin_of_difference(cos_w, sin_w, cos_o, sin_o);
  const Lanes cos_light = cos_of_difference(cos_x, sin_x, cos_b, sin_b);
  Lanes estimate =
      from_halves(node.importance) * larger(cos_light, all(k_rounding)) / larger(safe_d_squared, r_squared * k_near);
  // Axes and cosines are rounded: what may be just lit keeps a little importance.
  estimate = cos_light > cos_e - k_rounding ? estimate : zero;
  if (length_squared(n) > 0.0f) {
    const Lanes cos_i = clamped_cos((x * n.x + y * n.y + z * n.z) * per_d);
    const Lanes cos_receiver = cos_of_difference(cos_i, sin_of_cos(cos_i), cos_b, sin_b);
    estimate = estimate * larger(cos_receiver, zero);
  }
  std::memcpy(out, &estimate, sizeof(estimate));
}

namespace {

/// Child of a node chosen by weights: which, its share, and u stretched to [0, 1) again.
struct Pick {
  int child = -1;
  float prob = 0.0f;
};

Pick pick(const float weights[4], ReusedNumber& u) {
  const float total = (weights[0] + weights[1]) + (weights[2] + weights[3]);
  if (!(total > 0.0f)) return {};
  const double target = u.value() * static_cast<double>(total);
  double before = 0.0;
  int last = -1;
  for (int i = 0; i < 4; ++i) {
    if (!(weights[i] > 0.0f)) continue;
    last = i;
    const auto weight = static_cast<double>(weights[i]);
    if (target < before + weight) {
      u.set((target - before) / weight);
      return {i, weights[i] / total};
    }
    before += weight;
  }
  u.set(1.0);  // the float sum rounded above the sum of its parts
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

LightTree::Choice LightTree::sample(const Vec3& p, const Vec3& n, ReusedNumber& u) const {
  Choice choice;
  if (nodes_.empty()) return choice;
  choice.prob = 1.0f;
  if (size_ == 1) {
    choice.emitter = nodes_[0].child[0] & ~k_leaf;
    return choice;
  }
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
  if (size_ == 1) return 1.0f;
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

LightTree::Choice LightTree::sample_by_intensity(ReusedNumber& u) const {
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

void LightTree::scale_importance(std::span<const float> factors) {
  constexpr float k_least = 1e-37f;           // not denormal, as of intensities
  for (size_t i = nodes_.size(); i-- > 0;) {  // children come after their parents
    Node& node = nodes_[i];
    for (int slot = 0; slot < k_width; ++slot) {
      const uint32_t child = node.child[slot];
      if (child == k_none) continue;
      float importance = 0.0f;
      if (const uint32_t emitter = child & ~k_leaf; child & k_leaf)
        importance = unpack(node.importance[slot]) * (emitter < factors.size() ? factors[emitter] : 1.0f);
      else
        for (int k = 0; k < k_width; ++k) importance += unpack(nodes_[child].importance[k]);
      node.importance[slot] = pack_up(std::max(importance, k_least));
    }
  }
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

}  // namespace lambent
