#include "engine/scene/light_visibility.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "engine/base/frame.h"
#include "engine/sampling/sampler.h"
#include "engine/sampling/warp.h"
#include "engine/scene/shadow_ray.h"

namespace lambent {
namespace {

constexpr int k_rows = 32, k_columns = 64;  ///< walks: a grid over the picture
constexpr int k_vertices = 4;               ///< of a walk
constexpr int k_lights_per_vertex = 3;
constexpr float k_straight_on = 0.25f;  ///< share of walks that go on behind the surface: through glass, leaves, holes
constexpr size_t k_most_clusters = 512;
constexpr float k_prior = 2.0f;  ///< receivers that are taken to have seen a light before any has tried
constexpr float k_least_share =
    0.1f;  ///< where only one place sees the light, its noise grows by less than this divides

struct Counts {
  uint32_t chosen = 0, seen = 0;
};

struct Walks {
  const Geometry& geometry;
  const Camera& camera;
  const LightSet& lights;
  const std::vector<uint32_t>& cluster_of;

  void walk(Ray ray, RandomStream& random, std::vector<Counts>& counts) const {
    for (int vertex = 0; vertex < k_vertices; ++vertex) {
      Hit hit;
      if (!geometry.intersect(ray, hit)) return;
      const SurfaceHit surface = geometry.surface(hit);
      const Vec3 n = dot(surface.ng_world, ray.direction) > 0.0f ? -surface.ng_world : surface.ng_world;
      for (int k = 0; k < k_lights_per_vertex; ++k) {
        const LightSample light = lights.sample(surface.p_world, n, random.next_2d(), EvenWorld::left_to_scattering);
        if (!light || light.is_infinite || light.light >= cluster_of.size()) continue;
        Counts& count = counts[cluster_of[light.light]];
        ++count.chosen;
        count.seen += !light.traits->shadows ||
                      !geometry.occluded(shadow_ray(geometry, lights, surface, light), [](const Hit&) { return true; });
      }
      Vec3 direction = ray.direction;
      if (random.next_1d() >= k_straight_on)
        direction = normalize(Frame::from_normal(n).to_world(sample_cosine_hemisphere(random.next_2d())));
      ray = ray_from_surface(surface.p_world, surface.p_error, surface.ng_world, direction, k_visible_scattered);
    }
  }

  /// One row of the grid.
  std::vector<Counts> row(int y, size_t clusters) const {
    std::vector<Counts> counts(clusters);
    RandomStream random(static_cast<uint64_t>(y));
    for (int x = 0; x < k_columns; ++x) {
      const Vec2 in_cell = random.next_2d(), u_lens = random.next_2d();
      const Vec2 raster((static_cast<float>(x) + in_cell.x) / k_columns * static_cast<float>(camera.width_px()),
                        (static_cast<float>(y) + in_cell.y) / k_rows * static_cast<float>(camera.height_px()));
      const CameraRay start = camera.sample_ray(raster, u_lens);
      walk({start.origin, start.t_min, start.direction, start.t_max, k_visible_camera}, random, counts);
    }
    return counts;
  }
};

}  // namespace

std::vector<float> learn_light_visibility(const Geometry& geometry, const Camera& camera, const LightSet& lights,
                                          const CancelFlag& cancel) {
  if (lights.tree().size() < 2 || geometry.instance_count() == 0) return {};
  const std::vector<uint32_t> order = lights.tree().leaf_order();
  const size_t a_cluster = (order.size() + k_most_clusters - 1) / k_most_clusters;
  std::vector<uint32_t> cluster_of(*std::max_element(order.begin(), order.end()) + size_t{1}, 0);
  for (size_t i = 0; i < order.size(); ++i) cluster_of[order[i]] = static_cast<uint32_t>(i / a_cluster);
  const size_t clusters = (order.size() - 1) / a_cluster + 1;

  const Walks walks{geometry, camera, lights, cluster_of};
  std::array<std::vector<Counts>, k_rows> rows;
  tbb::parallel_for(0, k_rows, [&](int y) {
    const DenormalsFlushed flushed;
    if (!cancel.cancelled()) rows[static_cast<size_t>(y)] = walks.row(y, clusters);
  });
  if (cancel.cancelled()) return {};

  std::vector<float> share_of_cluster(clusters);
  for (size_t c = 0; c < clusters; ++c) {
    Counts sum;
    for (const std::vector<Counts>& counts : rows) {
      sum.chosen += counts[c].chosen;
      sum.seen += counts[c].seen;
    }
    const float share = (static_cast<float>(sum.seen) + k_prior) / (static_cast<float>(sum.chosen) + k_prior);
    share_of_cluster[c] = std::max(share, k_least_share);
  }
  std::vector<float> shares(cluster_of.size(), 1.0f);
  for (const uint32_t light : order) shares[light] = share_of_cluster[cluster_of[light]];
  return shares;
}

}  // namespace lambent
