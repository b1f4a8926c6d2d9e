#include "engine/lights/emission_aim.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "engine/base/frame.h"
#include "engine/sampling/warp.h"

namespace lambent {

namespace {

/// A part is not divided into parts of fewer arrivals than this (counted by how evenly their worth is spread): the few
/// that happened to be found say little of where others go.
constexpr double k_least_arrivals = 12.0;
/// Squared radii are enlarged by this much where a ray is tested, so that rounding loses no ray that was aimed there:
/// its density would be far too low, its light far too bright.
constexpr float k_slack = 1.0f + 2e-4f;

/// Arrivals that one sphere holds.
struct Part {
  std::vector<EmissionArrival> arrivals;
  double worth = 0.0;
  Bounds3 bounds;
  bool whole = false;  ///< no division pays

  double arrivals_that_count() const {
    double squares = 0.0;
    for (const EmissionArrival& a : arrivals) squares += sqr(static_cast<double>(a.worth));
    return squares > 0.0 ? sqr(worth) / squares : 0.0;
  }
  double radius_squared() const { return 0.25 * static_cast<double>(length_squared(bounds.max - bounds.min)); }
  /// What a division is to lower: noise goes as worth over density.
  double cost() const { return worth * radius_squared(); }
};

Part part_of(std::vector<EmissionArrival> arrivals) {
  Part part;
  for (const EmissionArrival& a : arrivals) {
    part.worth += static_cast<double>(a.worth);
    part.bounds.extendBy(a.p_world);
  }
  part.arrivals = std::move(arrivals);
  return part;
}

/// The best of some planes across each axis; the second part is empty where none pays.
std::pair<Part, Part> divide(const Part& part) {
  constexpr int k_planes = 7;
  std::pair<Part, Part> best;
  double least = 0.8 * part.cost();
  for (int axis = 0; axis < 3; ++axis) {
    const float low = part.bounds.min[axis], extent = part.bounds.max[axis] - low;
    for (int plane = 1; plane <= k_planes; ++plane) {
      const float at = low + extent * static_cast<float>(plane) / (k_planes + 1);
      std::array<std::vector<EmissionArrival>, 2> sides;
      for (const EmissionArrival& a : part.arrivals) sides[a.p_world[axis] < at ? 0 : 1].push_back(a);
      std::pair<Part, Part> parts(part_of(std::move(sides[0])), part_of(std::move(sides[1])));
      const double cost = parts.first.cost() + parts.second.cost();
      if (cost < least && parts.first.arrivals_that_count() >= k_least_arrivals &&
          parts.second.arrivals_that_count() >= k_least_arrivals) {
        least = cost;
        best = std::move(parts);
      }
    }
  }
  return best;
}

/// Lights by what their arrivals are worth, the best first.
std::vector<std::pair<LightIndex, double>> lights_by_worth(std::span<const EmissionArrival> arrivals) {
  std::vector<std::pair<LightIndex, double>> worth;
  for (const EmissionArrival& a : arrivals) worth.emplace_back(a.light, static_cast<double>(a.worth));
  std::stable_sort(worth.begin(), worth.end(), [](const auto& l, const auto& r) { return l.first < r.first; });
  std::vector<std::pair<LightIndex, double>> sums;
  for (const auto& [light, w] : worth) {
    if (sums.empty() || sums.back().first != light) sums.emplace_back(light, 0.0);
    sums.back().second += w;
  }
  std::stable_sort(sums.begin(), sums.end(), [](const auto& l, const auto& r) { return l.second > r.second; });
  return sums;
}

}  // namespace

Vec3 EmissionTarget::sample_line(const Vec3& direction, const Vec2& u) const {
  const Frame frame = Frame::from_normal(direction);
  const Vec2 d = sample_disk(u) * radius_m;
  return center_world + frame.s * d.x + frame.t * d.y;
}

Vec3 EmissionTarget::sample_direction(const Vec3& p_world, const Vec2& u) const {
  const Vec3 to_center = center_world - p_world;
  const float d_squared = length_squared(to_center), r_squared = sqr(radius_m);
  if (!(d_squared > r_squared)) return sample_uniform_sphere(u);
  const Vec3 local = sample_cone(u, one_minus_cos_of_sine_squared(r_squared / d_squared));
  return Frame::from_normal(to_center * (1.0f / std::sqrt(d_squared))).to_world(local);
}

EmissionAim::EmissionAim(std::span<const EmissionArrival> arrivals, float least_radius_m) {
  std::vector<EmissionArrival> used;
  for (const EmissionArrival& a : arrivals)
    if (a.worth > 0.0f && std::isfinite(a.worth) && is_finite(a.p_world)) used.push_back(a);
  if (used.empty()) return;

  // Rows: the lights worth most; the last is for all finite lights where some of them have none.
  const auto by_worth = lights_by_worth(used);
  for (const auto& [light, worth] : by_worth)
    if (lights_.size() + 1 < k_most_rows) lights_.push_back(light);
  const auto has_row = [&](LightIndex light) { return row_of(light) != k_no_row; };
  if (std::ranges::any_of(used, [&](const EmissionArrival& a) { return !a.infinite && !has_row(a.light); })) {
    rest_ = static_cast<int>(lights_.size());
    lights_.push_back(k_no_light);
  }
  std::erase_if(used, [&](const EmissionArrival& a) { return a.infinite && !has_row(a.light); });

  std::vector<Part> parts;
  parts.push_back(part_of(std::move(used)));
  while (parts.size() < k_most_targets) {
    const auto costliest = std::max_element(parts.begin(), parts.end(), [](const Part& l, const Part& r) {
      return (l.whole ? -1.0 : l.cost()) < (r.whole ? -1.0 : r.cost());
    });
    if (costliest->whole) break;
    auto [first, second] = divide(*costliest);
    if (second.arrivals.empty()) {
      costliest->whole = true;
      continue;
    }
    *costliest = std::move(first);
    parts.push_back(std::move(second));
  }

  const size_t rows = lights_.size(), targets = parts.size();
  std::vector<double> worth(rows * targets);
  for (size_t t = 0; t < targets; ++t) {
    const Vec3 center = (parts[t].bounds.min + parts[t].bounds.max) * 0.5f;
    float radius = 0.0f;
    for (const EmissionArrival& a : parts[t].arrivals) {
      radius = std::max(radius, length(a.p_world - center));
      const int row = row_of(a.light);
      worth[static_cast<size_t>(row != k_no_row ? row : rest_) * targets + t] += static_cast<double>(a.worth);
    }
    // Others arrive a little beyond those that were found: the more so the fewer were.
    radius *= 1.0f + 1.0f / static_cast<float>(std::sqrt(std::max(parts[t].arrivals_that_count(), 1.0)));
    targets_.push_back({center, std::max(radius, least_radius_m)});
  }
  double total = 0.0;
  for (const double w : worth) total += w;
  double running = 0.0;
  prob_rows_.assign(rows, 0.0f);
  blocks_.assign((targets + 3) / 4, {all(0.0f), all(0.0f), all(0.0f), all(-1.0f)});
  prob_blocks_.assign(rows * blocks_.size(), all(0.0f));
  for (size_t t = 0; t < targets; ++t) {
    Block& block = blocks_[t / 4];
    block.x[t % 4] = targets_[t].center_world.x;
    block.y[t % 4] = targets_[t].center_world.y;
    block.z[t % 4] = targets_[t].center_world.z;
    block.radius_squared[t % 4] = sqr(targets_[t].radius_m);
  }
  for (size_t i = 0; i < worth.size(); ++i) {
    running += worth[i] / total;
    cdf_.push_back(running);
    const size_t row = i / targets, t = i % targets;
    const float prob = static_cast<float>(worth[i] / total);
    prob_rows_[row] += prob;
    prob_blocks_[row * blocks_.size() + t / 4][t % 4] = prob;
  }
}

int EmissionAim::row_of(LightIndex light) const {
  for (size_t i = 0; i < lights_.size(); ++i)
    if (lights_[i] == light && light != k_no_light) return static_cast<int>(i);
  return k_no_row;
}

EmissionAim::Choice EmissionAim::choose(ReusedNumber& u) const {
  const double at = u.value() * cdf_.back();
  size_t i = static_cast<size_t>(std::upper_bound(cdf_.begin(), cdf_.end(), at) - cdf_.begin());
  i = std::min(i, cdf_.size() - 1);
  const double begin = i > 0 ? cdf_[i - 1] : 0.0;
  u.set(cdf_[i] > begin ? (at - begin) / (cdf_[i] - begin) : 0.0);
  return {static_cast<int>(i / targets_.size()), &targets_[i % targets_.size()]};
}

struct EmissionAim::Aimed {
  LaneMask inside, meets;  ///< the sphere holds the point; the line meets it
  Lanes along, distance_squared;
};

inline EmissionAim::Aimed EmissionAim::aimed(const Block& block, const Vec3& p, const Vec3& direction) {
  const Lanes x = block.x - all(p.x), y = block.y - all(p.y), z = block.z - all(p.z);
  const Lanes along = x * all(direction.x) + y * all(direction.y) + z * all(direction.z);
  const Lanes across_x = x - along * all(direction.x), across_y = y - along * all(direction.y),
              across_z = z - along * all(direction.z);
  const Lanes distance_squared = x * x + y * y + z * z;
  return {distance_squared <= block.radius_squared,
          across_x * across_x + across_y * across_y + across_z * across_z <= block.radius_squared * all(k_slack), along,
          distance_squared};
}

float EmissionAim::density_of_line(int row, const Vec3& p_world, const Vec3& direction) const {
  const Lanes* prob = prob_blocks_.data() + static_cast<size_t>(row) * blocks_.size();
  Lanes sum = all(0.0f);
  for (const Block& block : blocks_) {
    const Lanes p = *prob++;
    const Aimed is = aimed(block, p_world, direction);
    sum += is.meets ? p / (all(k_pi) * block.radius_squared) : all(0.0f);
  }
  return sum_of(sum);
}

float EmissionAim::density_of_direction(int row, const Vec3& origin_world, const Vec3& direction) const {
  const Lanes* prob = prob_blocks_.data() + static_cast<size_t>(row) * blocks_.size();
  Lanes sum = all(0.0f);
  for (const Block& block : blocks_) {
    const Lanes p = *prob++;
    const Aimed is = aimed(block, origin_world, direction);
    const LaneMask ahead = is.meets & (is.along > all(0.0f));
    if (!any_of(ahead | is.inside)) continue;
    // As one_minus_cos_of_sine_squared.
    const Lanes sin_squared = smaller(block.radius_squared / is.distance_squared, all(1.0f));
    const Lanes one_minus_cos = sin_squared / (all(1.0f) + root(all(1.0f) - sin_squared));
    const Lanes density = is.inside ? all(k_pdf_solid_angle_uniform_sphere) : all(0.5f * k_inv_pi) / one_minus_cos;
    sum += ahead | is.inside ? p * density : all(0.0f);
  }
  return sum_of(sum);
}

}  // namespace lambent
