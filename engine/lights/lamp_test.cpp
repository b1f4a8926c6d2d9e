#include "engine/lights/lamp.h"

#include <gtest/gtest.h>

#include "engine/sampling/chi_square.h"
#include "engine/sampling/warp.h"

namespace lambent {
namespace {

constexpr int k_tests = 18;

/// Lamp of Blender's default orientation, `height` above the origin, shining down.
AnalyticLight lamp_at(LightKind kind, float height = 2.0f) {
  AnalyticLight light;
  light.name = "Lamp";
  light.kind = kind;
  light.energy = Color(100.0f);
  light.world_from_light = Transform::translation({0, 0, height});
  return light;
}

Transform rotated_x(float angle, const Vec3& at) {
  const float c = std::cos(angle), s = std::sin(angle);
  const float rows[12] = {1, 0, 0, at.x, 0, c, -s, at.y, 0, s, c, at.z};
  return Transform::from_rows(rows);
}

/// Irradiance at p on a surface with normal n, by sampling.
double irradiance(const Lamp& lamp, const Vec3& p, const Vec3& n, uint32_t samples = 1 << 16) {
  double sum = 0.0;
  for (uint32_t i = 0; i < samples; ++i) {
    const LampSample s = lamp.sample(p, Sampler(1, 0, 0, i).get_2d(0));
    if (s.pdf_solid_angle > 0.0f)
      sum += static_cast<double>(s.radiance.x) * static_cast<double>(std::max(dot(s.direction, n), 0.0f)) /
             static_cast<double>(s.pdf_solid_angle);
  }
  return sum / samples;
}

TEST(Lamp, directions_follow_the_density_of_the_rays_that_hit_it) {
  std::vector<std::pair<const char*, AnalyticLight>> lamps;
  const auto add = [&](const char* name, LightKind kind, auto&& change) {
    AnalyticLight light = lamp_at(kind);
    change(light);
    lamps.emplace_back(name, light);
  };
  add("sphere", LightKind::point, [](auto& l) { l.radius_m = 0.5f; });
  add("small sphere", LightKind::point, [](auto& l) { l.radius_m = 1e-4f; });
  add("sphere around the receiver", LightKind::point, [](auto& l) { l.radius_m = 5.0f; });
  add("spot", LightKind::spot, [](auto& l) {
    l.radius_m = 0.3f;
    l.spot_size_rad = 2.0f;
  });
  add("round lamp", LightKind::point, [](auto& l) {
    l.radius_m = 0.5f;
    l.sphere = true;
  });
  add("round lamp around the receiver", LightKind::point, [](auto& l) {
    l.radius_m = 5.0f;
    l.sphere = true;
  });
  add("elliptic round spot", LightKind::spot, [](auto& l) {
    l.radius_m = 0.3f;
    l.spot_size_rad = 2.0f;
    l.sphere = true;
    l.spot_cosine = false;
    const float rows[12] = {1.5f, 0, 0, 0, 0, 0.5f, 0, 0, 0, 0, 1, 2};
    l.world_from_light = Transform::from_rows(rows);
  });
  add("even sun", LightKind::sun, [](auto& l) {
    l.angle_rad = 2.0f;
    l.even_sun = true;
  });
  add("sun", LightKind::sun, [](auto& l) { l.angle_rad = 1.0f; });
  add("real sun", LightKind::sun, [](auto& l) { l.angle_rad = 0.0093f; });
  add("square", LightKind::area, [](auto&) {});
  add("tilted rectangle", LightKind::area, [](auto& l) {
    l.size_m = {2.0f, 0.5f};
    l.world_from_light = rotated_x(0.5f, {0, 0, 2});
  });
  add("disk", LightKind::area, [](auto& l) { l.round = true; });
  add("ellipse", LightKind::area, [](auto& l) {
    l.round = true;
    l.size_m = {2.0f, 0.5f};
  });
  add("spread", LightKind::area, [](auto& l) {
    l.size_m = Vec2(4.0f);
    l.spread_rad = 0.6f;
  });
  add("round spread", LightKind::area, [](auto& l) {
    l.size_m = Vec2(4.0f);
    l.round = true;
    l.spread_rad = 0.6f;
  });
  const Vec3 p(0.4f, 0.3f, 0.1f);
  for (const auto& [name, description] : lamps) {
    const Lamp lamp(description);
    // Cylinder coordinates around the first sampled direction, in terms of 1 - cos, cut to what is sampled.
    const Frame frame = Frame::from_normal(lamp.sample(p, {0.5f, 0.5f}).direction);
    const auto position = [&](const Vec3& w) {
      const Vec3 local = frame.to_local(w);
      const float sin_squared = local.x * local.x + local.y * local.y;
      return Vec2(local.z > 0 ? sin_squared / (1 + local.z) : 1 - local.z, std::atan2(local.y, local.x));
    };
    float high = 0.0f;
    RandomStream random(3);
    for (int i = 0; i < 100000; ++i) {
      const LampSample s = lamp.sample(p, random.next_2d());
      if (s.pdf_solid_angle > 0) high = std::max(high, position(s.direction).x);
    }
    high = std::min(high * 1.02f, 2.0f);
    int sampled = 0, total = 0;
    const auto result = chi_square_test_2d(
        {0, -k_pi}, {high, k_pi},
        [&](const Vec2& u) {
          const LampSample s = lamp.sample(p, u);
          ++total;
          if (!(s.pdf_solid_angle > 0) || is_black(s.radiance)) return Vec2(-1.0f);  // no ray hits black parts
          ++sampled;
          return position(s.direction);
        },
        [&](const Vec2& q) {
          const float h = q.x, r = safe_sqrt(h * (2 - h));
          const Vec3 w = frame.to_world({r * std::cos(q.y), r * std::sin(q.y), 1 - h});
          LightHit hit;
          if (lamp.is_infinite() ? !lamp.intersect_infinite(w, hit) : !lamp.intersect(p, w, 0, 1e6f, hit)) return 0.0f;
          return lamp.pdf_solid_angle(p, w, hit.distance_m);
        },
        100);
    EXPECT_GT(result.p_value, sidak_significance(k_tests))
        << name << " chi² " << result.statistic << " / " << result.degrees;
    EXPECT_NEAR(result.total_probability, static_cast<double>(sampled) / total, 4e-3) << name;
  }
}

TEST(Lamp, sampled_points_are_hit_with_the_same_radiance_and_density) {
  for (const LightKind kind : {LightKind::point, LightKind::spot, LightKind::area})
    for (const bool round : {false, true}) {
      AnalyticLight description = lamp_at(kind);
      description.sphere = round;
      description.spot_cosine = !round;
      description.radius_m = 0.5f;
      description.spot_size_rad = 1.5f;
      description.spread_rad = 2.5f;
      description.round = round;
      const Lamp lamp(description);
      RandomStream random(9);
      int hits = 0, samples = 0;
      for (int i = 0; i < 10000; ++i) {
        const Vec3 p(random.next_1d() * 2 - 1, random.next_1d() * 2 - 1, random.next_1d());
        const LampSample s = lamp.sample(p, random.next_2d());
        if (!(s.pdf_solid_angle > 0) || is_black(s.radiance)) continue;
        ++samples;
        LightHit hit;
        if (!lamp.intersect(p, s.direction, 0, 1e6f, hit)) continue;  // at the rim
        ++hits;
        ASSERT_NEAR(hit.distance_m, s.distance, 1e-4f);
        ASSERT_NEAR(hit.radiance.x / s.radiance.x, 1.0f, 1e-3f);
        ASSERT_NEAR(hit.uv.x, s.uv.x, 1e-3f);
        ASSERT_NEAR(lamp.pdf_solid_angle(p, s.direction, hit.distance_m) / s.pdf_solid_angle, 1.0f, 1e-3f);
      }
      EXPECT_GT(hits, samples * 0.999);
    }
}

// Lambert's formula for a polygon (Arvo 1995): E = L/2 sum gamma_i (n . Gamma_i).
double polygon_irradiance(const Vec3& p, const Vec3& n, const std::vector<Vec3>& vertices, double radiance) {
  double sum = 0.0;
  for (size_t i = 0; i < vertices.size(); ++i) {
    const Vec3d a = (Vec3d(vertices[i]) - Vec3d(p)).normalized(),
                b = (Vec3d(vertices[(i + 1) % vertices.size()]) - Vec3d(p)).normalized();
    const Vec3d c = a.cross(b);
    sum += std::atan2(c.length(), a.dot(b)) * c.normalized().dot(Vec3d(n));
  }
  return std::fabs(0.5 * radiance * sum);
}

TEST(Lamp, rectangle_irradiance_is_lamberts_formula_at_any_scale) {
  for (const float scale : {1e-6f, 1.0f, 1e6f}) {
    AnalyticLight description = lamp_at(LightKind::area, 0.7f * scale);
    description.size_m = Vec2(2.0f, 0.5f) * scale;
    const Lamp lamp(description);
    const Vec3 p = Vec3(0.3f, 0.6f, 0.0f) * scale, n(0, 0, 1);
    const double expected =
        polygon_irradiance(Vec3(0.3f, 0.6f, 0), n,
                           {{-1, -0.25f, 0.7f}, {1, -0.25f, 0.7f}, {1, 0.25f, 0.7f}, {-1, 0.25f, 0.7f}}, 1.0) *
        25.0 / static_cast<double>(scale * scale);
    EXPECT_NEAR(irradiance(lamp, p, n) / expected, 1.0, 2e-4);
  }
}

TEST(Lamp, coaxial_disk_irradiance_is_pi_l_r2_over_r2_plus_h2) {
  AnalyticLight area = lamp_at(LightKind::area, 0.8f);
  area.round = true;
  area.size_m = Vec2(2.0f);
  const double disk = std::numbers::pi / (1.0 + 0.64) * (100.0 / (4 * std::numbers::pi));
  EXPECT_NEAR(irradiance(Lamp(area), {0, 0, 0}, {0, 0, 1}) / disk, 1.0, 1e-3);
  // Point lamps with a radius are disks that face the receiver.
  AnalyticLight point = lamp_at(LightKind::point, 0.8f);
  point.radius_m = 1.0f;
  const double radiance = 100.0 / (4 * std::numbers::pi * std::numbers::pi);
  EXPECT_NEAR(irradiance(Lamp(point), {0, 0, 0}, {0, 0, 1}) / (radiance * std::numbers::pi / 1.64), 1.0, 1e-4);
}

TEST(Lamp, a_far_sphere_gives_the_irradiance_of_a_sphere) {
  AnalyticLight point = lamp_at(LightKind::point, 10.0f);
  point.radius_m = 0.01f;
  const Vec3 n = normalize(Vec3(0.5f, 0, 1));
  const double radiance = 100.0 / (4 * std::numbers::pi * std::numbers::pi * 1e-4);
  const double expected = std::numbers::pi * radiance * 1e-6 * static_cast<double>(n.z);  // pi L (r/d)² cos
  EXPECT_NEAR(irradiance(Lamp(point), {0, 0, 0}, n) / expected, 1.0, 1e-4);
}

TEST(Lamp, a_round_lamp_gives_the_irradiance_of_a_sphere_from_outside_and_of_an_even_sky_from_within) {
  AnalyticLight point = lamp_at(LightKind::point);
  point.sphere = true;
  const Vec3 n = normalize(Vec3(0.3f, 0, 1));
  for (const float radius : {1e-3f, 0.5f, 1.9f, 2.5f, 100.0f}) {
    point.radius_m = radius;
    const double r = static_cast<double>(radius), radiance = 100.0 / (4 * std::numbers::pi * std::numbers::pi * r * r);
    if (radius > 1.0f && radius < 2.0f) continue;  // partly below the horizon
    const double expected = radius < 2.0f
                                ? std::numbers::pi * radiance * r * r / 4 * static_cast<double>(n.z)  // pi L (r/d)² cos
                                : std::numbers::pi * radiance;
    EXPECT_NEAR(irradiance(Lamp(point), {0, 0, 0}, n) / expected, 1.0, 2e-3) << radius;
  }
}

TEST(Lamp, an_even_sun_gives_its_irradiance_at_any_angle) {
  AnalyticLight sun = lamp_at(LightKind::sun);
  sun.even_sun = true;
  for (const float angle : {0.0f, 1e-4f, 0.0093f, 1.0f, 3.0f, k_pi}) {
    sun.angle_rad = angle;
    EXPECT_NEAR(irradiance(Lamp(sun), {0, 0, 0}, {0, 0, 1}) / 100.0, 1.0, 2e-3) << angle;
    EXPECT_NEAR(Lamp(sun).irradiance() / 100.0, 1.0, 1e-3) << angle;
  }
}

TEST(Lamp, a_spot_falls_by_the_cosine_off_axis_only_where_it_is_asked_to_and_its_scale_makes_it_elliptic) {
  AnalyticLight spot = lamp_at(LightKind::spot);
  spot.spot_size_rad = 2.0f;
  spot.spot_blend = 0.0f;
  const auto at = [&](const Vec3& p) { return Lamp(spot).sample(p, {0.5f, 0.5f}).radiance.x; };
  const float on_axis = at({0, 0, 0}), cosine = 2.0f / std::sqrt(5.0f), falloff = 4.0f / 5.0f;
  EXPECT_NEAR(at({1, 0, 0}) / on_axis, cosine * falloff, 1e-5f);
  spot.spot_cosine = false;
  EXPECT_NEAR(at({1, 0, 0}) / on_axis, falloff, 1e-5f);
  const float rows[12] = {2, 0, 0, 0, 0, 0.5f, 0, 0, 0, 0, 1, 2};
  spot.world_from_light = Transform::from_rows(rows);
  // The cone's edge on the plane 2 m below: 2 tan(1) times the scale along each axis.
  const float edge = 2.0f * std::tan(1.0f);
  EXPECT_GT(at({1.98f * edge, 0, 0}), 0.0f);
  EXPECT_EQ(at({2.02f * edge, 0, 0}), 0.0f);
  EXPECT_GT(at({0, 0.49f * edge, 0}), 0.0f);
  EXPECT_EQ(at({0, 0.51f * edge, 0}), 0.0f);
}

// Irradiance of lamps of 100 W (suns 3 W/m²), 2 m above a plane, at distances x from below the lamp: measured with
// Cycles 3.4.1 at 65,536 samples a value.
TEST(Lamp, irradiance_is_what_cycles_measures) {
  struct Case {
    const char* name;
    AnalyticLight lamp;
    std::vector<std::pair<float, double>> measured;
  };
  std::vector<Case> cases;
  const auto add = [&](const char* name, LightKind kind, auto&& change,
                       std::vector<std::pair<float, double>> measured) {
    AnalyticLight light = lamp_at(kind);
    if (kind == LightKind::sun) light.energy = Color(3.0f);
    change(light);
    cases.push_back({name, light, std::move(measured)});
  };
  const float degree = k_pi / 180;
  add("point", LightKind::point, [](auto&) {}, {{0.0f, 1.98951}, {1.5f, 1.01859}});
  add("point, radius 0.5", LightKind::point, [](auto& l) { l.radius_m = 0.5f; }, {{0.0f, 1.87241}, {1.5f, 0.97942}});
  add("point, radius 3", LightKind::point, [](auto& l) { l.radius_m = 3.0f; }, {{0.0f, 0.61214}, {1.5f, 0.41746}});
  add("spot", LightKind::spot,
      [&](auto& l) {
        l.spot_size_rad = 60 * degree;
        l.spot_blend = 0.3f;
      },
      {{0.0f, 1.98951}, {0.5f, 1.76227}, {1.0f, 1.00882}, {1.1f, 0.18794}, {1.2f, 0.0}});
  add("spot, radius 0.3", LightKind::spot,
      [&](auto& l) {
        l.spot_size_rad = 60 * degree;
        l.spot_blend = 0.3f;
        l.radius_m = 0.3f;
      },
      {{0.0f, 1.93492}, {0.5f, 1.71731}, {1.0f, 0.72921}, {1.2f, 0.23890}});
  add("spot without blend", LightKind::spot,
      [&](auto& l) {
        l.spot_size_rad = 90 * degree;
        l.spot_blend = 0.0f;
      },
      {{0.0f, 1.98951}, {1.0f, 1.27324}});
  add("scaled spot", LightKind::spot,
      [&](auto& l) {
        l.spot_size_rad = 60 * degree;
        l.spot_blend = 0.3f;
        l.world_from_light = l.world_from_light * Transform::scale({2, 1, 1});
      },
      {{0.5f, 1.76227}, {1.0f, 1.00882}});
  add("sun", LightKind::sun, [](auto&) {}, {{0.0f, 2.99989}});
  add("sun of 60 degrees", LightKind::sun, [&](auto& l) { l.angle_rad = 60 * degree; }, {{0.0f, 2.78461}});
  add("tilted sun", LightKind::sun,
      [&](auto& l) {
        l.angle_rad = 60 * degree;
        l.world_from_light = rotated_x(30 * degree, {0, 0, 2});
      },
      {{0.0f, 2.41155}});
  add("sun of 120 degrees", LightKind::sun, [&](auto& l) { l.angle_rad = 120 * degree; }, {{0.0f, 2.0}});
  add("sun of 180 degrees", LightKind::sun, [&](auto& l) { l.angle_rad = 180 * degree; }, {{0.0f, 0.0}});
  add("square", LightKind::area, [](auto&) {}, {{0.0f, 5.77081}, {1.5f, 2.56536}});
  add("tilted rectangle", LightKind::area,
      [&](auto& l) {
        l.size_m = {2, 0.5f};
        l.world_from_light = rotated_x(30 * degree, {0, 0, 2});
      },
      {{0.0f, 4.66988}, {1.5f, 2.43872}});
  add("disk", LightKind::area, [](auto& l) { l.round = true; }, {{0.0f, 5.88234}, {1.5f, 2.56585}});
  add("tilted ellipse", LightKind::area,
      [&](auto& l) {
        l.round = true;
        l.size_m = {2, 0.5f};
        l.world_from_light = rotated_x(30 * degree, {0, 0, 2});
      },
      {{0.0f, 4.83889}, {1.5f, 2.38858}});
  add("spread of 60 degrees", LightKind::area, [&](auto& l) { l.spread_rad = 60 * degree; },
      {{0.0f, 41.8215}, {0.5f, 28.7570}, {1.5f, 0.25832}});
  add("disk, spread of 90 degrees", LightKind::area,
      [&](auto& l) {
        l.round = true;
        l.spread_rad = 90 * degree;
      },
      {{0.0f, 22.8977}, {0.5f, 17.9655}, {1.5f, 3.21365}});
  add("scaled square", LightKind::area,
      [](auto& l) {
        l.world_from_light = l.world_from_light * Transform::scale({2, 1, 1});
      },
      {{0.0f, 5.19769}, {1.5f, 2.74102}});
  add("mirrored square", LightKind::area,
      [](auto& l) {
        l.world_from_light = l.world_from_light * Transform::scale({-2, 1, 1});
      },
      {{0.0f, 5.19769}, {1.5f, 2.74102}});
  add("square mirrored in z", LightKind::area,
      [](auto& l) {
        l.world_from_light = l.world_from_light * Transform::scale({1, 1, -1});
      },
      {{0.0f, 0.0}});
  add("negative square", LightKind::area, [](auto& l) { l.energy = Color(-100.0f); }, {{0.0f, -5.77081}});
  for (const Case& c : cases) {
    ASSERT_EQ(Lamp::validate(c.lamp), "");
    for (const auto& [x, measured] : c.measured)
      EXPECT_NEAR(irradiance(Lamp(c.lamp), {x, 0, 0}, {0, 0, 1}), measured, 1e-6 + 1e-3 * std::fabs(measured))
          << c.name << " at " << x;
  }
}

TEST(Lamp, narrow_spread_keeps_the_flux) {
  // Seen from within its beam a lamp of any spread gives pi/4 · power / area. (Cycles 3.4.1: 98.04 for 78.54 at 1
  // degree, where its float normalisation cancels.)
  AnalyticLight light = lamp_at(LightKind::area);
  for (const float degrees : {0.0f, 0.02f, 0.1f, 1.0f, 5.0f}) {
    light.spread_rad = degrees * k_pi / 180.0f;
    EXPECT_NEAR(irradiance(Lamp(light), {0.3f, 0, 0}, {0, 0, 1}), 25.0 * std::numbers::pi,
                25.0 * std::numbers::pi * 2e-3)
        << degrees;
  }
}

TEST(Lamp, camera_sees_the_radiance_that_cycles_shows) {
  // Rays straight up from the plane: measured with Cycles 3.4.1.
  const auto seen = [](AnalyticLight light, float x) {
    const Lamp lamp(light);
    LightHit hit;
    const bool met = lamp.is_infinite() ? lamp.intersect_infinite({0, 0, 1}, hit)
                                        : lamp.intersect({x, 0, 0}, {0, 0, 1}, 0, 1e6f, hit);
    return met ? hit.radiance.x : 0.0f;
  };
  AnalyticLight light = lamp_at(LightKind::point);
  light.radius_m = 0.5f;
  EXPECT_NEAR(seen(light, 0.48f), 10.13212f, 1e-4f);
  EXPECT_EQ(seen(light, 0.52f), 0.0f);
  light = lamp_at(LightKind::spot);
  light.radius_m = 0.3f;
  light.spot_size_rad = k_pi / 3;
  EXPECT_NEAR(seen(light, 0.25f), 28.14477f, 1e-4f);
  light = lamp_at(LightKind::sun);
  light.energy = Color(3.0f);
  light.angle_rad = k_pi / 3;
  EXPECT_NEAR(seen(light, 0), 2.86479f, 1e-4f);
  light = lamp_at(LightKind::area);
  EXPECT_NEAR(seen(light, 0.4f), 25.0f, 1e-4f);
  light.spread_rad = k_pi / 3;
  EXPECT_NEAR(seen(light, 0.4f), 268.5276f, 1e-2f);
  light = lamp_at(LightKind::area);
  light.round = true;
  EXPECT_NEAR(seen(light, 0.4f), 31.83096f, 1e-4f);
  EXPECT_EQ(seen(light, 0.6f), 0.0f);
}

TEST(Lamp, useless_descriptions_are_named) {
  const auto problem = [](auto&& change) {
    AnalyticLight light = lamp_at(LightKind::area);
    light.name = "Key";
    change(light);
    return Lamp::validate(light);
  };
  for (const std::string& text :
       {problem([](auto& l) { l.size_m.x = 0; }), problem([](auto& l) { l.energy.x = NAN; }), problem([](auto& l) {
          l.world_from_light = Transform::scale({1, 0, 1});
        }),
        problem([](auto& l) { l.world_from_light.m[0][3] = INFINITY; }), problem([](auto& l) {
          l.kind = LightKind::point;
          l.radius_m = -1;
        }),
        problem([](auto& l) {
          l.kind = LightKind::sun;
          l.angle_rad = 4;
        }),
        problem([](auto& l) {
          l.kind = LightKind::spot;
          l.spot_size_rad = NAN;
        }),
        problem([](auto& l) {
          l.kind = LightKind::spot;
          l.spot_size_rad = 1e-4f;
        })})
    EXPECT_NE(text.find("Key"), std::string::npos) << text;
}

}  // namespace
}  // namespace lambent
