#include "engine/integrators/bidirectional/vertex_pool.h"

#include <cmath>

#include "engine/base/check.h"

namespace lambent::bidirectional {

namespace {

/// Of the mean, what vertices without any worth are still given: worth is learned from few connections.
constexpr double k_least_worth = 0.05;

}  // namespace

ConnectionGuide::ConnectionGuide(PlaceTree camera, PlaceTree light, std::vector<double> worth,
                                 const std::vector<double>& flux, const std::vector<double>& vertices, int walks)
    : camera_(std::move(camera)), light_(std::move(light)) {
  const size_t leaves = static_cast<size_t>(light_.leaves()), regions = static_cast<size_t>(this->regions());
  CHECK(worth.size() == regions * leaves, "there is a worth for each region and leaf");
  double mean = 0.0;
  for (const double w : worth) mean += w / static_cast<double>(worth.size());
  if (!(mean > 0.0) || !std::isfinite(mean)) return;
  all_.assign(leaves, 0.0f);
  worth_.resize(worth.size());
  chosen_.resize(worth.size());
  for (size_t region = 0; region < regions; ++region) {
    double of_walk = 0.0;
    for (size_t leaf = 0; leaf < leaves; ++leaf) {
      double& w = worth[region * leaves + leaf];
      w = k_least_worth + (1.0 - k_least_worth) * w / mean;
      of_walk += flux[leaf] * w / walks;
      all_[leaf] += static_cast<float>(w / static_cast<double>(regions));
    }
    for (size_t leaf = 0; leaf < leaves; ++leaf) {
      const size_t i = region * leaves + leaf;
      const double usual = vertices[leaf] > 0.0 ? flux[leaf] / vertices[leaf] : 0.0;
      worth_[i] = static_cast<float>(worth[i]);
      chosen_[i] = of_walk > 0.0 ? static_cast<float>(usual * worth[i] / of_walk) : 1.0f;
    }
  }
}

void ConnectionGuide::place(LightWalk& walk) const {
  for (int i = 0; i < walk.size(); ++i) walk.set_place(i, static_cast<uint16_t>(light_leaf_at(walk[i].surface)));
}

double ConnectionGuide::worth(const LightVertex& vertex) const {
  if (!vertex.bsdf.has_non_delta()) return 0.0;
  const double worth =
      static_cast<double>(luminance(abs(vertex.throughput))) * static_cast<double>(worth_per_watt(vertex.place));
  return std::isfinite(worth) ? worth : 0.0;
}

double ConnectionGuide::worth(const LightWalk& walk) const {
  double sum = 0.0;
  for (int i = 0; i < walk.size(); ++i) sum += worth(walk[i]);
  return sum;
}

void VertexPool::set(std::vector<Vertex> vertices, const ConnectionPicks& picks, const ConnectionGuide& guide) {
  set(std::move(vertices), picks);
  const int regions = picks_.later > 0 ? guide.regions() : guide.first_regions();  // that choose
  below_.reserve(vertices_.size() * static_cast<size_t>(regions));
  std::vector<double> likely(vertices_.size());
  for (int region = 0; region < regions; ++region) {
    double all = 0.0, sum = 0.0;
    for (size_t i = 0; i < vertices_.size(); ++i) {
      const int leaf = (*vertices_[i]).place;
      // The pool has them by what they are worth to all.
      likely[i] =
          static_cast<double>(guide.worth_per_watt(region, leaf)) / static_cast<double>(guide.worth_per_watt(leaf));
      all += likely[i];
    }
    for (const double one : likely) below_.push_back(static_cast<float>((sum += one) / all));
  }
}

std::vector<ChosenWalk> choose_walks(std::span<const PoolCandidate> candidates, size_t count, float u) {
  double all = 0.0;
  for (const PoolCandidate& candidate : candidates) all += candidate.worth;
  std::vector<ChosenWalk> chosen;
  if (!(all > 0.0) || !std::isfinite(all)) return chosen;
  const double step = all / static_cast<double>(count);
  double next = step * static_cast<double>(u), low = 0.0;
  for (const PoolCandidate& candidate : candidates) {
    const double high = low + candidate.worth;
    if (next < high) {
      ChosenWalk& walk = chosen.emplace_back(ChosenWalk{candidate.x, candidate.y, {}});
      for (; next < high; next += step) walk.at.push_back(next - low);
    }
    low = high;
  }
  return chosen;
}

void take_vertices(const ConnectionGuide& guide, const LightWalk& walk, const ChosenWalk& chosen, double per_worth,
                   std::vector<VertexPool::Vertex>& taken) {
  double sum = 0.0;
  size_t next = 0;
  VertexPool::Vertex last;
  for (int i = 0; i < walk.size(); ++i) {
    const double worth = guide.worth(walk[i]);
    if (!(worth > 0.0)) continue;
    last = {&walk, i, static_cast<float>(per_worth / worth)};
    sum += worth;
    for (; next < chosen.at.size() && chosen.at[next] < sum; ++next) taken.push_back(last);
  }
  for (; last.walk && next < chosen.at.size(); ++next) taken.push_back(last);  // where the sum was rounded
}

}  // namespace lambent::bidirectional
