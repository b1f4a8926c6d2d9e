// Rays per second and build times. Medians over repetitions: --benchmark_repetitions=5.
#include <benchmark/benchmark.h>

#include "engine/geometry/shapes_for_tests.h"

namespace lambent {
namespace {

enum Placing { k_flattened, k_instanced };

/// Bumpy floor of about a million triangles, over which 64 spheres of 1,280 triangles float, in a closed box.
std::shared_ptr<const Geometry> make_scene(int placing, bool transparent, bool compact) {
  GeometryBuilder builder;
  Report report;
  GeometryOptions options;
  options.flatten = placing == k_flattened;
  options.compact = compact;
  std::vector<GeometryObject> objects{make_object(make_mesh(sheet_shape(707)), {rotation({1, 1, 0}, 0.1f)}),
                                      make_object(make_mesh(box_shape()), {Transform::scale(Vec3(1.5f))})};
  const auto sphere = icosphere_shape(3);
  for (int i = 0; i < 64; ++i) {
    const Transform place = Transform::translation({float(i % 8) * 0.25f - 0.9f, float(i / 8) * 0.25f - 0.9f, 0.5f}) *
                            Transform::scale(Vec3(0.1f));
    objects.push_back(make_object(make_mesh(sphere), {place}));
    objects.back().opaque = !transparent;
  }
  return *builder.build(objects, options, CancelFlag(), report);
}

/// Incoherent rays: a diffuse walk through the scene, recorded once.
std::vector<Ray> make_rays(const Geometry& geometry, size_t count) {
  TestRandom random;
  std::vector<Ray> rays;
  Ray ray;
  ray.origin = {0, 0, 1};
  ray.direction = {0.1f, 0.2f, -1};
  while (rays.size() < count) {
    rays.push_back(ray);
    Hit hit;
    if (!geometry.intersect(ray, hit)) std::abort();
    const SurfaceHit point = geometry.surface(hit);
    Vec3 direction = random.direction();
    if (dot(direction, point.ng_world) * dot(ray.direction, point.ng_world) > 0.0f) direction = -direction;
    ray = ray_from_surface(point.p_world, point.p_error, point.ng_world, direction, k_visible_all);
  }
  return rays;
}

constexpr size_t k_rays = 1 << 17;

void closest(benchmark::State& state) {
  const DenormalsFlushed denormals_flushed;
  const auto geometry = make_scene(int(state.range(0)), false, state.range(1) != 0);
  const auto rays = make_rays(*geometry, k_rays);
  size_t i = 0;
  for (auto _ : state) {
    Hit hit;
    benchmark::DoNotOptimize(geometry->intersect(rays[i++ % k_rays], hit));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(closest)->ArgNames({"instanced", "compact"})->Args({0, 0})->Args({1, 0})->Args({0, 1});

void closest_and_surface(benchmark::State& state) {
  const DenormalsFlushed denormals_flushed;
  const auto geometry = make_scene(int(state.range(0)), false, false);
  const auto rays = make_rays(*geometry, k_rays);
  size_t i = 0;
  for (auto _ : state) {
    Hit hit;
    if (geometry->intersect(rays[i++ % k_rays], hit)) benchmark::DoNotOptimize(geometry->surface(hit));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(closest_and_surface)->ArgName("instanced")->Arg(0)->Arg(1);

void shadow(benchmark::State& state) {
  const DenormalsFlushed denormals_flushed;
  const auto geometry = make_scene(int(state.range(0)), state.range(1) != 0, false);
  auto rays = make_rays(*geometry, k_rays);
  for (size_t i = 0; i + 1 < k_rays; ++i)
    rays[i] = segment(rays[i].origin, rays[(i * 7919) % k_rays].origin, k_visible_shadow);
  size_t i = 0;
  const bool visiting = state.range(1) != 0;
  for (auto _ : state) {
    const Ray& ray = rays[i++ % k_rays];
    if (visiting)
      benchmark::DoNotOptimize(geometry->occluded(ray, [](const Hit&) { return true; }));
    else
      benchmark::DoNotOptimize(geometry->occluded(ray));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(shadow)->ArgNames({"instanced", "transparent"})->Args({0, 0})->Args({1, 0})->Args({0, 1})->Args({1, 1});

void build_million_triangles(benchmark::State& state) {
  const auto mesh = make_mesh(sheet_shape(707));
  GeometryOptions options;
  options.flatten = state.range(0) == 0;
  options.compact = state.range(1) != 0;
  size_t bytes = 0;
  for (auto _ : state) {
    GeometryBuilder builder;
    Report report;
    const auto geometry = *builder.build({make_object(mesh)}, options, CancelFlag(), report);
    bytes = geometry->bvh_bytes();
  }
  state.counters["bvh_bytes_per_triangle"] = double(bytes) / mesh->triangle_count();
  state.counters["mesh_bytes_per_triangle"] = double(mesh->bytes()) / mesh->triangle_count();
}
BENCHMARK(build_million_triangles)
    ->ArgNames({"instanced", "compact"})
    ->Args({0, 0})
    ->Args({1, 0})
    ->Args({0, 1})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void build_100000_instances(benchmark::State& state) {
  const auto mesh = make_mesh(icosphere_shape(2));
  TestRandom random;
  std::vector<Transform> transforms;
  for (int i = 0; i < 100000; ++i) transforms.push_back(Transform::translation(random.direction() * 100.0f * random()));
  for (auto _ : state) {
    GeometryBuilder builder;
    Report report;
    benchmark::DoNotOptimize(*builder.build({make_object(mesh, transforms)}, {}, CancelFlag(), report));
  }
}
BENCHMARK(build_100000_instances)->Unit(benchmark::kMillisecond)->UseRealTime();

void create_million_triangle_mesh(benchmark::State& state) {
  const MeshInput input = mesh_input(sheet_shape(707));
  for (auto _ : state) {
    Report report;
    benchmark::DoNotOptimize(TriangleMesh::create(input, report));
  }
}
BENCHMARK(create_million_triangle_mesh)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace lambent

BENCHMARK_MAIN();
