#include "engine/lights/lamp_bvh.h"

#include <gtest/gtest.h>

#include "engine/sampling/sampler.h"
#include "engine/sampling/warp.h"

namespace lambent {
namespace {

Transform rotated_x(float angle, const Vec3& at) {
  const float c = std::cos(angle), s = std::sin(angle);
  const float rows[12] = {1, 0, 0, at.x, 0, c, -s, at.y, 0, s, c, at.z};
  return Transform::from_rows(rows);
}

TEST(LampBvh, finds_the_nearest_of_many_lamps) {
  std::vector<Lamp> lamps;
  std::vector<LightIndex> all;
  RandomStream random(5);
  for (int i = 0; i < 500; ++i) {
    AnalyticLight light;
    light.kind = i % 2 ? LightKind::area : LightKind::point;
    light.radius_m = 0.1f;
    light.size_m = Vec2(0.3f);
    light.world_from_light =
        rotated_x(6.0f * random.next_1d(), Vec3(random.next_1d(), random.next_1d(), random.next_1d()) * 5.0f);
    if (i % 5 == 0) light.traits.hidden_from = 1u;
    lamps.emplace_back(light);
    all.push_back(static_cast<LightIndex>(i));
  }
  const LampBvh bvh(lamps, all);
  int found = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 o(random.next_1d() * 5, random.next_1d() * 5, random.next_1d() * 5),
        w = sample_uniform_sphere(random.next_2d());
    for (const uint32_t kinds : {1u, 2u}) {
      std::vector<LightIndex> expected, visited;
      for (LightIndex k = 0; k < 500; ++k) {
        LightHit hit;
        if (!(lamps[k].traits().hidden_from & kinds) && lamps[k].intersect(o, w, 0.01f, 4.0f, hit))
          expected.push_back(k);
      }
      bvh.traverse(lamps, o, w, 0.01f, 4.0f, kinds, [&](const LightHit& hit) {
        visited.push_back(hit.light);
        return 4.0f;
      });
      std::sort(visited.begin(), visited.end());
      ASSERT_EQ(visited, expected);
      found += static_cast<int>(expected.size());
    }
  }
  EXPECT_GT(found, 1000);
}

}  // namespace
}  // namespace lambent
