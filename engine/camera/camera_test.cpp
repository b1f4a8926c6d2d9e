#include "engine/camera/camera.h"

#include <gtest/gtest.h>

#include "engine/base/frame.h"
#include "engine/sampling/sampler.h"

namespace lambent {
namespace {

Transform looking() {
  // Rotated about an axis, scaled (which must not matter) and moved.
  const float c = std::cos(0.7f), s = std::sin(0.7f);
  const float rows[12] = {2 * c, -2 * s * 0.8f, 2 * s * 0.6f, 1.0f, 2 * s, 2 * c * 0.8f, -2 * c * 0.6f, -2.0f,
                          0,     1.2f,          1.6f,         3.0f};
  return Transform::from_rows(rows);
}

Transform sheared() {
  Transform t = looking();
  for (int i = 0; i < 3; ++i) t.m[i][0] += 0.5f * t.m[i][1];
  return t;
}

Camera make(const CameraSpec& spec) {
  auto camera = Camera::create(spec);
  EXPECT_TRUE(camera) << (camera ? "" : camera.error());
  return *camera;
}

std::vector<CameraSpec> variants() {
  std::vector<CameraSpec> specs;
  for (const Projection projection : {Projection::perspective, Projection::orthographic})
    for (const bool lens : {false, true})
      for (const bool shear : {false, true}) {
        CameraSpec spec;
        spec.projection = projection;
        spec.world_from_camera = shear ? sheared() : looking();
        spec.width_px = 640;
        spec.height_px = 360;
        spec.pixel_aspect = {1.0f, 1.5f};
        spec.shift = {0.1f, -0.2f};
        spec.focal_length_mm = 35;
        spec.depth_of_field = lens;
        spec.fstop = projection == Projection::perspective ? 0.05f : 4.0f;
        spec.focus_distance_m = 3.0f;
        spec.blades = 5;
        spec.rotation_rad = 0.4f;
        spec.aperture_ratio = 1.5f;
        spec.clip_near_m = 0.2f;
        specs.push_back(spec);
      }
  return specs;
}

TEST(Camera, project_inverts_sample_ray) {
  for (const CameraSpec& spec : variants()) {
    const Camera camera = make(spec);
    RandomStream random(1);
    for (int i = 0; i < 2000; ++i) {
      const Vec2 raster(random.next_1d() * 640, random.next_1d() * 360), u = random.next_2d();
      const CameraRay ray = camera.sample_ray(raster, u);
      ASSERT_NEAR(length(ray.direction), 1.0f, 1e-6f);
      const float t = lerp(ray.t_min, std::min(ray.t_max, 20.0f), random.next_1d());
      const Vec3 p = ray.origin + ray.direction * t;
      const CameraConnection connection = camera.project(p, u);
      ASSERT_TRUE(connection.valid);
      ASSERT_NEAR(connection.raster_px.x, raster.x, 2e-2f);
      ASSERT_NEAR(connection.raster_px.y, raster.y, 2e-2f);
      // p is rounded to about 1e-6 of its distance from the origin.
      ASSERT_NEAR(length(connection.direction_world + ray.direction), 0.0f, 1e-6f + 1e-5f / t);
      ASSERT_NEAR(length(connection.p_lens_world - ray.origin), 0.0f, 1e-4f);
      const CameraPdf pdf = camera.pdf(ray.origin, ray.direction);
      ASSERT_TRUE(pdf.valid);
      ASSERT_EQ(pdf.delta_lens, !spec.depth_of_field);
      ASSERT_NEAR(pdf.raster_px.x, raster.x, 2e-2f);
      ASSERT_NEAR(pdf.raster_px.y, raster.y, 2e-2f);
    }
  }
}

// J measured: how much raster area corresponds to a small square at p that faces the lens.
TEST(Camera, importance_is_the_raster_area_per_area_at_the_point) {
  for (const CameraSpec& spec : variants()) {
    const Camera camera = make(spec);
    RandomStream random(2);
    for (int i = 0; i < 200; ++i) {
      const Vec2 raster(random.next_1d() * 640, random.next_1d() * 360), u = random.next_2d();
      const CameraRay ray = camera.sample_ray(raster, u);
      const Vec3 p = ray.origin + ray.direction * 5.0f;
      const Frame frame = Frame::from_normal(ray.direction);
      const float h = 0.05f;
      const Vec2 x0 = camera.project(p - frame.s * h, u).raster_px, x1 = camera.project(p + frame.s * h, u).raster_px;
      const Vec2 y0 = camera.project(p - frame.t * h, u).raster_px, y1 = camera.project(p + frame.t * h, u).raster_px;
      const Vec2 dx = (x1 - x0) * (0.5f / h), dy = (y1 - y0) * (0.5f / h);
      const float measured = std::fabs(dx.x * dy.y - dx.y * dy.x);
      const CameraConnection connection = camera.project(p, u);
      ASSERT_NEAR(connection.importance_px2_per_m2 / measured, 1.0f, 3e-3f);
      // We · cos / (d² pdf_lens) = J; orthographic cameras without lens have their density on the image plane instead.
      const CameraPdf pdf = camera.pdf(ray.origin, ray.direction);
      ASSERT_NEAR(pdf.importance * pdf.cos_lens / (pdf.pdf_lens_area * pdf.pdf_direction_solid_angle), 1.0f, 1e-5f);
      if (spec.projection == Projection::perspective) {
        ASSERT_NEAR(pdf.pdf_direction_solid_angle / 25.0f / connection.importance_px2_per_m2, 1.0f, 1e-3f);
      } else if (!spec.depth_of_field) {
        ASSERT_NEAR(pdf.importance / connection.importance_px2_per_m2, 1.0f, 1e-4f);
      }
      // The ray cone covers one pixel.
      const float extent = ray.width_m + ray.spread * 5.0f;
      if (!spec.depth_of_field) {
        ASSERT_NEAR(extent * extent * measured, 1.0f, spec.projection == Projection::perspective ? 1e-2f : 0.15f);
      }
    }
  }
}

// Light arriving at the frame from a plane at depth 4 with a patch on it, once from the camera and once from the patch.
TEST(Camera, both_transport_directions_measure_the_same_light) {
  for (const CameraSpec& spec : variants()) {
    const Camera camera = make(spec);
    const Vec3 center = camera.sample_ray({320, 180}, {0.5f, 0.5f}).origin + camera.optical_axis() * 4.0f;
    const Frame frame = Frame::from_normal(normalize(Vec3(0.3f, -0.2f, 1.0f)));  // not facing the camera
    const float half = 0.6f;
    const int n = 200000;
    double from_camera = 0.0, from_light = 0.0;
    for (int i = 0; i < n; ++i) {
      const Sampler sampler(0, 0, 0, static_cast<uint32_t>(i));
      const Vec2 ur = sampler.get_2d(0), ul = sampler.get_2d(1), up = sampler.get_2d(2);
      const CameraRay ray = camera.sample_ray({ur.x * 640, ur.y * 360}, ul);
      const float t = dot(center - ray.origin, frame.n) / dot(ray.direction, frame.n);
      const Vec3 q = frame.to_local(ray.origin + ray.direction * t - center);
      if (t >= ray.t_min && t <= ray.t_max && std::fabs(q.x) < half && std::fabs(q.y) < half)
        from_camera += 640.0 * 360.0 / n;
      const Vec3 p = center + frame.s * ((2 * up.x - 1) * half) + frame.t * ((2 * up.y - 1) * half);
      const CameraConnection c = camera.project(p, ul);
      if (c.valid && c.raster_px.x >= 0 && c.raster_px.x < 640 && c.raster_px.y >= 0 && c.raster_px.y < 360)
        from_light += static_cast<double>(c.importance_px2_per_m2 * std::fabs(dot(c.direction_world, frame.n))) * 4 *
                      static_cast<double>(half * half) / n;
    }
    EXPECT_GT(from_camera, 50.0);
    // Five standard errors of counting hits; stratification only makes it better.
    const double share = from_camera / (640.0 * 360.0);
    EXPECT_NEAR(from_light / from_camera, 1.0, 5.0 * std::sqrt((1.0 - share) / (share * n)));
  }
}

TEST(Camera, sensor_fit_decides_which_side_spans_the_sensor) {
  CameraSpec spec;
  spec.focal_length_mm = 36;
  spec.width_px = 200;
  spec.height_px = 100;
  const auto slope_at = [&](float x, float y) {
    const Vec3 d = make(spec).sample_ray({x, y}, {0.5f, 0.5f}).direction;
    return Vec2(d.x / -d.z, d.y / -d.z);
  };
  EXPECT_NEAR(slope_at(200, 50).x, 0.5f, 1e-6f);
  EXPECT_NEAR(slope_at(200, 100).y, 0.25f, 1e-6f);
  spec.sensor_fit = SensorFit::vertical;  // sensor height 24
  EXPECT_NEAR(slope_at(100, 100).y, 12.0f / 36.0f, 1e-6f);
  EXPECT_NEAR(slope_at(200, 100).x, 24.0f / 36.0f, 1e-6f);
  spec.sensor_fit = SensorFit::automatic;
  spec.width_px = 100;
  spec.height_px = 200;  // automatic fits the longer side to the sensor's width
  EXPECT_NEAR(slope_at(50, 200).y, 0.5f, 1e-6f);
  EXPECT_NEAR(slope_at(100, 200).x, 0.25f, 1e-6f);
  spec.sensor_fit = SensorFit::horizontal;
  EXPECT_NEAR(slope_at(100, 200).x, 0.5f, 1e-6f);
  EXPECT_NEAR(slope_at(100, 200).y, 1.0f, 1e-6f);
  spec.shift = {0.25f, 0.5f};
  EXPECT_NEAR(slope_at(50, 100).x, 0.25f, 1e-6f);
  EXPECT_NEAR(slope_at(50, 100).y, 0.5f, 1e-6f);
  spec.pixel_aspect = {4.0f, 1.0f};
  EXPECT_NEAR(slope_at(50, 200).y - slope_at(50, 100).y, 0.25f, 1e-6f);
}

TEST(Camera, orthographic_scale_spans_the_fitted_side) {
  CameraSpec spec;
  spec.projection = Projection::orthographic;
  spec.ortho_scale = 8;
  spec.width_px = 100;
  spec.height_px = 50;
  spec.shift = {0.5f, 0};
  const CameraRay ray = make(spec).sample_ray({100, 50}, {0.5f, 0.5f});
  EXPECT_NEAR(length(ray.origin - Vec3(8, 2, -0.1f)), 0.0f, 1e-6f);
  EXPECT_NEAR(length(ray.direction - Vec3(0, 0, -1)), 0.0f, 1e-6f);
  EXPECT_NEAR(ray.t_max, 999.9f, 1e-3f);
  EXPECT_NEAR(ray.width_m, 0.08f, 1e-6f);
}

TEST(Camera, points_in_focus_are_sharp_and_the_blur_is_that_of_the_f_stop) {
  CameraSpec spec;
  spec.depth_of_field = true;
  spec.fstop = 0.5f;
  spec.focus_distance_m = 5.0f;
  const Camera camera = make(spec);
  EXPECT_NEAR(camera.lens_radius_m(), 0.05f, 1e-7f);
  RandomStream random(4);
  float largest = 0.0f;
  for (int i = 0; i < 1000; ++i) {
    const CameraRay ray = camera.sample_ray({1500, 200}, random.next_2d());
    const Vec3 focus = ray.origin + ray.direction * (5.0f / -ray.direction.z);
    const Vec3 center = camera.sample_ray({1500, 200}, {0.5f, 0.5f}).direction;
    EXPECT_NEAR(length(focus - center * (5.0f / -center.z)), 0.0f, 1e-5f);
    const Vec3 twice = ray.origin + ray.direction * (10.0f / -ray.direction.z);
    largest = std::max(largest, length(twice - center * (10.0f / -center.z)));
  }
  EXPECT_NEAR(largest, 0.05f, 0.002f);  // circle of confusion at twice the distance: the lens itself
}

TEST(Camera, clipping_is_measured_along_the_axis) {
  CameraSpec spec;
  spec.clip_near_m = 1.0f;
  spec.clip_far_m = 10.0f;
  const Camera camera = make(spec);
  const CameraRay ray = camera.sample_ray({0, 0}, {0.5f, 0.5f});
  EXPECT_NEAR((ray.direction * ray.t_min).z, -1.0f, 1e-5f);
  EXPECT_NEAR((ray.direction * ray.t_max).z, -10.0f, 1e-4f);
  EXPECT_FALSE(camera.project(ray.direction * (ray.t_min * 0.99f), {0.5f, 0.5f}).valid);
  EXPECT_TRUE(camera.project(ray.direction * (ray.t_min * 1.01f), {0.5f, 0.5f}).valid);
  EXPECT_FALSE(camera.project(ray.direction * (ray.t_max * 1.01f), {0.5f, 0.5f}).valid);
  EXPECT_FALSE(camera.project(-ray.direction, {0.5f, 0.5f}).valid);
  EXPECT_FALSE(camera.project({0, 0, 0}, {0.5f, 0.5f}).valid);
}

TEST(Camera, tiny_and_huge_cameras_see_the_same_picture) {
  for (const float scale : {1e-6f, 1e6f}) {
    CameraSpec spec;
    spec.clip_near_m = 0.1f * scale;
    spec.clip_far_m = 1000.0f * scale;
    spec.world_from_camera = Transform::translation({scale, 2 * scale, 3 * scale});
    const CameraConnection c = make(spec).project(Vec3(1.5f, 2.2f, -1.0f) * scale, {0.5f, 0.5f});
    spec = {};
    spec.world_from_camera = Transform::translation({1, 2, 3});
    const CameraConnection reference = make(spec).project({1.5f, 2.2f, -1.0f}, {0.5f, 0.5f});
    ASSERT_TRUE(c.valid && reference.valid);
    EXPECT_NEAR(c.raster_px.x, reference.raster_px.x, 1e-2f);
    EXPECT_NEAR(c.importance_px2_per_m2 * scale * scale / reference.importance_px2_per_m2, 1.0f, 1e-4f);
  }
}

TEST(Camera, impossible_descriptions_are_refused_by_name) {
  const auto refused = [](auto&& change, const char* word) {
    CameraSpec spec;
    spec.name = "Shot 12";
    spec.depth_of_field = true;
    change(spec);
    const auto camera = Camera::create(spec);
    ASSERT_FALSE(camera);
    EXPECT_NE(camera.error().find("Shot 12"), std::string::npos);
    EXPECT_NE(camera.error().find(word), std::string::npos) << camera.error();
  };
  refused([](CameraSpec& s) { s.focal_length_mm = 0; }, "focal length");
  refused([](CameraSpec& s) { s.sensor_width_mm = NAN; }, "sensor");
  refused([](CameraSpec& s) { s.world_from_camera = Transform::scale({1, 0, 1}); }, "singular");
  refused([](CameraSpec& s) { s.world_from_camera = Transform::translation({NAN, 0, 0}); }, "finite");
  refused([](CameraSpec& s) { s.clip_far_m = 0.01f; }, "clipping");
  refused([](CameraSpec& s) { s.width_px = 0; }, "pixels");
  refused([](CameraSpec& s) { s.pixel_aspect.y = 0; }, "aspect");
  refused(
      [](CameraSpec& s) {
        s.projection = Projection::orthographic;
        s.ortho_scale = 0;
      },
      "scale");
}

TEST(Camera, with_an_impossible_lens_everything_is_in_focus) {
  const auto sharp = [](auto&& change, const char* word) {
    CameraSpec spec;
    spec.depth_of_field = true;
    EXPECT_TRUE(lens_problem(spec).empty());
    EXPECT_NE(make(spec).sample_ray({10, 10}, {0.9f, 0.3f}).origin, Vec3(0.0f));
    change(spec);
    EXPECT_NE(lens_problem(spec).find(word), std::string::npos) << lens_problem(spec);
    EXPECT_EQ(make(spec).sample_ray({10, 10}, {0.9f, 0.3f}).origin, Vec3(0.0f));
  };
  sharp([](CameraSpec& s) { s.fstop = 0; }, "f-stop");
  sharp([](CameraSpec& s) { s.focus_distance_m = -1; }, "focus");
  sharp([](CameraSpec& s) { s.aperture_ratio = NAN; }, "ratio");
  sharp([](CameraSpec& s) { s.rotation_rad = INFINITY; }, "rotation");
}

}  // namespace
}  // namespace lambent
