// A light walk's densities and flux against their definition: recomputed in double precision from the scene's own
// lights, programs and camera, as a camera walk along the same path sees them.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/path/light_walk.h"
#include "engine/path/surface.h"
#include "tests/common/direct_render.h"

namespace lambent::test {
namespace {

using description::LightType;
using description::Numbers;

/// A box open to the front with a ball in it. `kind` says which light shines.
SceneMaker lit_box(const std::string& kind, description::Graph ball) {
  SceneMaker maker(16, 16, 1);
  maker.material("white", diffuse(Color(0.7f))).material("ball", std::move(ball));
  maker.mesh("floor", {{-2, -1, -1}, {2, -1, -1}, {2, -1, -5}, {-2, -1, -5}}, {{0, 1, 2}, {0, 2, 3}}, "white");
  maker.mesh("back", {{-2, -1, -5}, {2, -1, -5}, {2, 2, -5}, {-2, 2, -5}}, {{0, 1, 2}, {0, 2, 3}}, "white");
  maker.sphere("ball", {0.2f, -0.3f, -3.4f}, 0.7f, 12, "ball", true);
  description::Light light;
  light.energy = 50.0f;
  Transform at = aimed({0.6f, 2.0f, -2.5f}, {0.2f, -0.5f, -3.4f});
  if (kind == "point_with_radius") light.radius_m = 0.3f;
  if (kind == "spot") light.type = LightType::spot, light.spot_size_rad = 1.5f;
  if (kind == "sun" || kind == "sun_with_angle") {
    light.type = LightType::sun;
    at = aimed({1, 3, 3}, {0, 0, 0});
    if (kind != "sun") light.angle_rad = 0.3f;
  }
  if (kind.starts_with("area")) light.type = LightType::area;
  if (kind == "area_disk") light.shape = description::AreaShape::disk;
  if (kind == "area_spread") light.spread_rad = 1.5f;
  if (kind == "mesh") {
    maker.material("e", emission(Color(1.0f), 5.0f));
    maker.mesh("e", {{0, 1.9f, -3}, {1, 1.9f, -3}, {0.5f, 2.0f, -2}}, {{0, 1, 2}}, "e");
  } else if (kind == "environment") {
    maker.world(background(Color(0.4f)));
  } else {
    maker.light("l", light, at);
  }
  return maker;
}

struct DensityCase {
  std::string name, light;
  description::Graph ball;
};

std::vector<DensityCase> density_cases() {
  std::vector<DensityCase> cases;
  for (const char* light : {"point", "point_with_radius", "spot", "sun", "sun_with_angle", "area", "area_disk",
                            "area_spread", "mesh", "environment"})
    cases.push_back({light, light, diffuse(Color(0.6f))});
  const Numbers white{0.9f, 0.9f, 0.9f, 1};
  cases.push_back({"rough_glass", "area",
                   single("BsdfGlass", {{"Color", white}, {"Roughness", 0.3f}, {"IOR", 1.45f}},
                          {{"distribution", std::string("GGX")}})});
  cases.push_back({"glass", "area", single("BsdfGlass", {{"Color", white}, {"Roughness", 0.0f}, {"IOR", 1.45f}})});
  cases.push_back(
      {"gloss", "area",
       single("BsdfGlossy", {{"Color", white}, {"Roughness", 0.4f}}, {{"distribution", std::string("GGX")}})});
  cases.push_back({"principled", "area",
                   single("BsdfPrincipled", {{"Base Color", white}, {"Roughness", 0.4f}, {"Clearcoat", 0.5f}},
                          {{"generation", 1.0f}})});
  return cases;
}

class LightWalkDensities : public testing::TestWithParam<size_t> {};

/// Relative difference allowed between float and double products of a few terms; reverse densities of narrow lobes are
/// differences of nearly equal numbers.
constexpr double k_rounding = 2e-3;

TEST_P(LightWalkDensities, are_their_definition) {
  static const std::vector<DensityCase> cases = density_cases();
  const DensityCase& one = cases[GetParam()];
  const std::shared_ptr<const Scene> scene = build_scene(lit_box(one.light, one.ball));
  const LightSet& lights = scene->lights();
  LightWalkSettings settings;
  settings.max_vertices = 6;
  LightWalk walk(*scene, settings);
  ShadingPoint point;
  Bsdf bsdf;
  int compared = 0, arrived = 0;
  for (uint32_t sample = 0; sample < 4000; ++sample) {
    walk.trace(Sampler(5, 3, 4, sample));
    if (walk.size() == 0) continue;
    const LightVertex& first = walk[0];
    ++arrived;
    // The light's end, by what a camera walk at x_n knows: position, direction, distance.
    const Vec3 direction = first.wi_world;
    const double cosine = std::fabs(static_cast<double>(dot(first.ng_world, direction)));
    if (!lights.is_delta(walk.light())) {
      double distance = static_cast<double>(k_infinity);
      Vec2 uv(0.0f, 0.0f);
      Vec3 n_light = -direction;
      bool met = false;
      const LightKind kind = lights.kind(walk.light());
      if (kind == LightKind::triangle) {
        Hit hit;
        const Ray ray = ray_from_surface(first.surface.p_world, first.surface.p_error, first.surface.ng_world,
                                         direction, k_visible_all);
        met = scene->geometry().intersect(ray, hit);
        if (met) {
          const SurfaceHit surface = scene->geometry().surface(hit);
          met = scene->light_at(surface) == walk.light();
          distance = static_cast<double>(hit.t);
          uv = surface.barycentric;
          n_light = dot(surface.ng_world, direction) > 0.0f ? -surface.ng_world : surface.ng_world;
        }
      } else if (kind == LightKind::sun || kind == LightKind::environment) {
        met = true;
      } else {
        const LightHit hit = lights.intersect(first.surface.p_world, direction, 0.0f, k_infinity, k_ray_diffuse);
        met = hit.light == walk.light();
        distance = static_cast<double>(hit.distance_m);
        uv = hit.uv;
        n_light = hit.n_light_world;
      }
      // A ray from within rounding of the light's rim may miss it.
      if (!met) continue;
      const EmissionPdf pdf = lights.pdf_emission(walk.light(), n_light, -direction,
                                                  first.surface.p_world + direction * static_cast<float>(distance));
      double own = static_cast<double>(pdf.prob_selection) * static_cast<double>(pdf.pdf_area) *
                   static_cast<double>(pdf.pdf_direction_solid_angle) * cosine;
      // Positions on flat lights are per area of the light; others per area across the ray.
      if (kind == LightKind::triangle || kind == LightKind::area)
        own /= std::fabs(static_cast<double>(dot(n_light, direction)));
      ASSERT_NEAR(static_cast<double>(first.own_area), own, k_rounding * own) << one.name << " sample " << sample;
      const Vec3 receiver = light_receiver_normal(first.bsdf, first.ng_world);
      const double next_event = static_cast<double>(lights.pdf_solid_angle(
          first.surface.p_world, receiver, walk.light(), direction, static_cast<float>(distance), uv));
      ASSERT_NEAR(static_cast<double>(first.next_event), next_event, 0.01 * next_event) << one.name << " " << sample;
    }
    // Vertices between: as a camera walk that comes from the deeper one sees them.
    for (int i = 0; i + 1 < walk.size(); ++i) {
      const LightVertex &here = walk[i], &next = walk[i + 1];
      if (next.depth != here.depth + 1) continue;
      const Vec3 offset = next.surface.p_world - here.surface.p_world;
      const double distance = static_cast<double>(length(offset));
      const Vec3 out = normalize(offset);
      scene->fill_shading_point(here.surface, *here.binding, out, 0.0f, scene->footprint_at(here.surface.p_world),
                                {k_ray_diffuse, 1, 1, 0, 0, 0}, point);
      here.binding->program->evaluate(point, scene->textures(), bsdf);
      const size_t depth = static_cast<size_t>(here.depth);
      if (!walk.pdfs().connectible[depth]) continue;
      const BsdfEval eval = bsdf.eval(out, here.wi_world, Transport::radiance);
      const double own = static_cast<double>(eval.pdf_reverse_solid_angle) *
                         std::fabs(static_cast<double>(dot(next.ng_world, out))) / (distance * distance);
      ASSERT_NEAR(static_cast<double>(next.own_area), own, 0.01 * own) << one.name << " sample " << sample;
      // c of the vertex before, or of the light.
      const double before = static_cast<double>(here.depth == 1 ? 1.0f : here.previous_per_solid_angle);
      const double other = static_cast<double>(eval.pdf_solid_angle) * before;
      ASSERT_NEAR(static_cast<double>(walk.pdfs().other[depth - 1]), other, 0.01 * other) << one.name << " " << sample;
      ++compared;
    }
  }
  EXPECT_GT(arrived, 300) << one.name;
  EXPECT_GT(compared, 100) << one.name;
}

INSTANTIATE_TEST_SUITE_P(, LightWalkDensities, testing::Range(size_t{0}, density_cases().size()),
                         [](const testing::TestParamInfo<size_t>& one) { return density_cases()[one.param].name; });

/// The camera's density c_1 is that with which light tracing sees it: J from both directions.
TEST(CameraDensity, of_a_ray_is_the_importance_of_the_connection_back) {
  for (const bool orthographic : {false, true})
    for (const bool lens : {false, true}) {
      SceneMaker maker = lit_box("area", diffuse(Color(0.5f)));
      if (orthographic) maker.camera.type = description::CameraType::orthographic, maker.camera.ortho_scale = 2.0f;
      if (lens) maker.camera.depth_of_field = description::DepthOfField{3.0f, 0.2f, 5, 0.2f, 1.3f};
      const std::shared_ptr<const Scene> scene = build_scene(maker);
      const Camera& camera = scene->camera();
      RandomStream random(8);
      for (int i = 0; i < 2000; ++i) {
        const Vec2 raster(16.0f * random.next_1d(), 16.0f * random.next_1d()), u = random.next_2d();
        const CameraRay ray = camera.sample_ray(raster, u);
        const float t = 1.0f + 3.0f * random.next_1d();
        const CameraConnection back = camera.connect(ray.origin + ray.direction * t, ray.origin);
        ASSERT_TRUE(back.valid);
        ASSERT_NEAR(back.raster_px.x, raster.x, 2e-3f);
        ASSERT_NEAR(back.raster_px.y, raster.y, 2e-3f);
        // J by differences: how the point of a plane across the ray moves with the raster position, the lens point
        // kept.
        const auto point_at = [&](const Vec2& r) {
          const CameraRay moved = camera.sample_ray(r, u);
          const Vec3 p = ray.origin + ray.direction * t;
          return moved.origin +
                 moved.direction * (dot(p - moved.origin, ray.direction) / dot(moved.direction, ray.direction));
        };
        const float h = 0.05f;
        const Vec3 dx = (point_at({raster.x + h, raster.y}) - point_at({raster.x - h, raster.y})) * (0.5f / h);
        const Vec3 dy = (point_at({raster.x, raster.y + h}) - point_at({raster.x, raster.y - h})) * (0.5f / h);
        const float importance = 1.0f / length(cross(dx, dy));
        ASSERT_NEAR(back.importance_px2_per_m2, importance, 0.01f * importance)
            << (orthographic ? "orthographic" : "perspective") << (lens ? " with lens" : "");
      }
    }
}

}  // namespace
}  // namespace lambent::test
