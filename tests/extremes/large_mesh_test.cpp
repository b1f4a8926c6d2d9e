// Ten million triangles: they build, the memory is accounted, and cancelling takes effect at once.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "engine/geometry/shapes_for_tests.h"

namespace lambent {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::shared_ptr<const TriangleMesh> ten_million_triangles() {
  static const auto mesh = make_mesh(sheet_shape(2237));
  return mesh;
}

TEST(TenMillionTriangles, build_and_are_hit) {
  GeometryBuilder builder;
  Report report;
  const auto geometry = builder.build({make_object(ten_million_triangles())}, {}, CancelFlag(), report);
  ASSERT_TRUE(geometry) << geometry.error();
  EXPECT_GT((*geometry)->triangle_count(), 10'000'000u);
  EXPECT_GT((*geometry)->bvh_bytes(), size_t(300) << 20);
  Ray ray;
  ray.origin = {0.3f, 0.2f, 5};
  ray.direction = {0, 0, -1};
  Hit hit;
  EXPECT_TRUE((*geometry)->intersect(ray, hit));
  EXPECT_TRUE(report.messages().empty());
}

/// Seconds from setting the flag, `delay_ms` after the start, to the return of build().
double cancel_latency(bool flatten, int delay_ms) {
  GeometryBuilder builder;
  Report report;
  CancelFlag cancel;
  Clock::time_point cancelled_at;
  std::thread canceller([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(delay_ms));
    cancelled_at = Clock::now();
    cancel.cancel();
  });
  GeometryOptions options;
  options.flatten = flatten;
  const auto geometry = builder.build({make_object(ten_million_triangles(), {Transform::translation({1, 2, 3})})},
                                      options, cancel, report);
  const auto returned_at = Clock::now();
  canceller.join();
  EXPECT_EQ(geometry ? "built before it could be cancelled" : geometry.error(), "cancelled") << delay_ms << " ms";
  return std::chrono::duration<double>(returned_at - cancelled_at).count();
}

TEST(TenMillionTriangles, build_is_cancelled_within_100_ms_at_any_stage) {
  for (const bool flatten : {true, false})
    for (const int delay_ms : {0, 20, 60, 120, 250, 500, 1000}) {
      // A busy machine may keep a thread from running for longer: a stage is late if it is so three times.
      double latency_s = 1.0;
      for (int attempt = 0; attempt < 3 && latency_s > 0.1; ++attempt) latency_s = cancel_latency(flatten, delay_ms);
      EXPECT_LT(latency_s, 0.1) << "cancelled after " << delay_ms << " ms, flatten " << flatten;
    }
}

TEST(TenMillionTriangles, beyond_the_memory_limit_are_an_error_and_the_next_build_works) {
  GeometryBuilder builder;
  Report report;
  GeometryOptions options;
  options.memory_limit_bytes = size_t(64) << 20;
  const auto refused = builder.build({make_object(ten_million_triangles())}, options, CancelFlag(), report);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().find("memory"), std::string::npos) << refused.error();
  const auto small = builder.build({make_object(make_mesh(box_shape()))}, options, CancelFlag(), report);
  ASSERT_TRUE(small) << small.error();
}

TEST(MovingOneOfManyObjects, rebuilds_only_the_top_level) {
  const auto mesh = make_mesh(sheet_shape(700)), other = make_mesh(box_shape());  // 980,000 triangles
  GeometryBuilder builder;
  Report report;
  GeometryOptions options;
  options.flatten = false;
  const auto build = [&](float x) {
    const auto start = Clock::now();
    const auto geometry = builder.build({make_object(mesh), make_object(other, {Transform::translation({x, 0, 0})})},
                                        options, CancelFlag(), report);
    EXPECT_TRUE(geometry);
    return std::pair(*geometry, seconds_since(start));
  };
  const auto [first, first_s] = build(5);
  const auto [second, second_s] = build(6);
  EXPECT_LT(second_s, 0.1 * first_s);
  Ray ray;
  ray.origin = {6, 0, 5};
  ray.direction = {0, 0, -1};
  EXPECT_FALSE(first->occluded(ray) && !second->occluded(ray));
  EXPECT_TRUE(second->occluded(ray));
}

}  // namespace
}  // namespace lambent
