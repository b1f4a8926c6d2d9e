#include "engine/lights/light_set.h"

#include <gtest/gtest.h>

#include "engine/base/frame.h"
#include "engine/sampling/chi_square.h"
#include "engine/sampling/warp.h"

namespace lambent {
namespace {

Transform at(const Vec3& p) { return Transform::translation(p); }

AnalyticLight lamp(LightKind kind, const Vec3& p, float energy = 100.0f) {
  AnalyticLight light;
  light.name = "Lamp";
  light.kind = kind;
  light.energy = Color(energy);
  light.world_from_light = at(p);
  return light;
}

std::shared_ptr<const LightSet> build(LightSetBuilder& builder) {
  Report report;
  auto set = builder.build(report);
  EXPECT_TRUE(report.messages().empty()) << report.messages()[0].text;
  return set;
}

/// Quad z = height (normal down if `down`), two triangles.
std::vector<EmissiveTriangle> quad(float half, const Vec3& c, uint32_t emission, bool down = true) {
  const Vec3 a = c + Vec3(-half, -half, 0), b = c + Vec3(half, -half, 0), d = c + Vec3(half, half, 0),
             e = c + Vec3(-half, half, 0);
  if (down) return {{a, d, b, 0, emission}, {a, e, d, 1, emission}};
  return {{a, b, d, 0, emission}, {a, d, e, 1, emission}};
}

double irradiance(const LightSet& set, const Vec3& p, const Vec3& n, uint32_t samples = 1 << 16) {
  double sum = 0.0;
  for (uint32_t i = 0; i < samples; ++i) {
    const Sampler sampler(1, 0, 0, i);
    const LightSample s = set.sample(p, n, sampler.get_2d(1));
    if (s)
      sum += static_cast<double>(s.radiance.x) * static_cast<double>(std::max(dot(s.direction_world, n), 0.0f)) /
             static_cast<double>(s.pdf_solid_angle);
  }
  return sum / samples;
}

/// A bit of everything.
std::shared_ptr<const LightSet> mixed(float scale = 1.0f, bool image = true, float power = 1.0f) {
  LightSetBuilder builder;
  builder.set_scene_bounds({Vec3(-3.0f * scale), Vec3(3.0f * scale)});
  // Radiances stay the same under scaling: powers grow with area.
  const float watts = power * scale * scale;
  AnalyticLight light = lamp(LightKind::point, Vec3(1, 0.5f, 1.5f) * scale, 30 * watts);
  light.radius_m = 0.2f * scale;
  builder.add(light);
  builder.add(lamp(LightKind::point, Vec3(-1, 0.2f, 1) * scale, 20 * watts));
  light = lamp(LightKind::spot, Vec3(0, -1, 2) * scale, 60 * watts);
  light.radius_m = 0.1f * scale;
  light.spot_size_rad = 1.2f;
  builder.add(light);
  light = lamp(LightKind::area, Vec3(-1, -1, 2) * scale, 50 * watts);
  light.size_m = Vec2(0.6f * scale);
  light.round = true;
  builder.add(light);
  light.world_from_light = at(Vec3(1, -1.5f, 1.2f) * scale);
  light.round = false;
  light.spread_rad = 2.0f;
  builder.add(light);
  light = lamp(LightKind::sun, Vec3(0.0f), 2.0f * power);
  light.angle_rad = 0.4f;
  builder.add(light);
  builder.add(lamp(LightKind::sun, Vec3(0.0f), 1.0f * power));
  const uint32_t both = builder.add_emission({Color(5.0f * power), true, true, {}});
  const uint32_t front = builder.add_emission({Color(9.0f * power), true, false, {}});
  builder.add_mesh(3, "Panel", quad(0.4f * scale, Vec3(0, 1, 1.5f) * scale, both));
  builder.add_mesh(5, "One side", quad(0.3f * scale, Vec3(0.5f, 0, 1) * scale, front));
  EnvironmentLight sky;
  sky.radiance = Color(0.5f * power);
  if (image) {
    sky.width = 32;
    sky.height = 16;
    for (int i = 0; i < 512; ++i) sky.luminance.push_back((i % 37 == 0 ? 8.0f : 0.3f) * power);
  }
  builder.set_environment(sky);
  return build(builder);
}

/// Every light that a ray from p along w meets, occluded or not.
template <typename Visit>
void for_each_hit(const LightSet& set, const Vec3& p, const Vec3& w, Visit&& visit) {
  set.for_each_lamp(p, w, 0.0f, k_infinity, 1u, visit);
  set.for_each_infinite(w, 1u, visit);
}

struct Quad {
  uint32_t instance;
  Vec3 center;
  float half;
};

TEST(LightSet, density_over_all_directions_integrates_to_the_probability_of_a_sample) {
  for (const bool image : {false, true}) {
    const auto set = mixed(1.0f, image);
    for (const Vec3& n : {Vec3(0.0f), Vec3(0, 0, 1), normalize(Vec3(1, 0.4f, 0.2f))}) {
      const Vec3 p(0.2f, 0.1f, 0.1f);
      const uint32_t count = 400000;
      double valid = 0.0, integral = 0.0, square = 0.0;
      for (uint32_t i = 0; i < count; ++i) {
        const Sampler sampler(2, 0, 0, i);
        const LightSample s = set->sample(p, n, sampler.get_2d(1));
        if (s && !s.is_delta) valid += 1.0 / count;
        // Uniform directions; triangles by their own uniform points, as no ray of this test meets them.
        const Vec3 w = sample_uniform_sphere(sampler.get_2d(2));
        double sum = 0.0;
        for_each_hit(*set, p, w, [&](const LightHit& hit) {
          sum += static_cast<double>(set->pdf_solid_angle(p, n, hit)) * 4 * std::numbers::pi;
        });
        const Vec2 u = sampler.get_2d(3);
        for (const Quad& q : {Quad{3, {0, 1, 1.5f}, 0.4f}, Quad{5, {0.5f, 0, 1}, 0.3f}})
          for (uint32_t t = 0; t < 2; ++t) {
            const auto triangles = quad(q.half, q.center, 0);
            const Vec2 b = sample_triangle(u);
            const Vec2 uv(b.y, 1 - b.x - b.y);
            const Vec3 to = triangles[t].a * b.x + triangles[t].b * uv.x + triangles[t].c * uv.y - p;
            const float d = length(to), area = 2 * q.half * q.half;
            const LightIndex light = set->find_triangle(q.instance, t);
            EXPECT_NE(light, k_no_light);
            sum += static_cast<double>(set->pdf_solid_angle(p, n, light, to * (1 / d), d, uv)) *
                   static_cast<double>(area * std::fabs(to.z) / (d * d * d));
          }
        integral += sum / count;
        square += sum * sum / count;
      }
      EXPECT_NEAR(integral, valid, 5 * std::sqrt((square - integral * integral) / count)) << image << " " << n;
      EXPECT_GT(valid, 0.2);
    }
  }
}

TEST(LightSet, a_sample_knows_the_density_that_a_ray_in_its_direction_gets) {
  for (const float scale : {1e-6f, 1.0f, 1e6f}) {
    const auto set = mixed(scale);
    RandomStream random(5);
    int checked = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 p = Vec3(random.next_1d() * 2 - 1, random.next_1d() * 2 - 1, random.next_1d()) * scale;
      const Vec3 n = i % 2 ? sample_uniform_sphere(random.next_2d()) : Vec3(0.0f);
      const LightSample s = set->sample(p, n, random.next_2d());
      if (!s) continue;
      ASSERT_TRUE(std::isfinite(s.pdf_solid_angle) && s.pdf_solid_angle > 0 && is_finite(s.radiance));
      ASSERT_NEAR(length(s.direction_world), 1.0f, 1e-5f);
      ASSERT_EQ(set->prob_selection(p, n, s.light), s.prob_selection);
      ASSERT_EQ(set->is_delta(s.light), s.is_delta);
      const float pdf = set->pdf_solid_angle(p, n, s.light, s.direction_world, s.distance_m, s.uv);
      if (s.is_delta) {
        ASSERT_EQ(pdf, 0.0f);
        continue;
      }
      ++checked;
      ASSERT_NEAR(pdf / s.pdf_solid_angle, 1.0f, s.is_infinite ? 0.02f : 2e-3f) << static_cast<int>(set->kind(s.light));
    }
    EXPECT_GT(checked, 5000);
  }
}

TEST(LightSet, selection_probabilities_sum_to_one) {
  const auto set = mixed();
  RandomStream random(5);
  for (int i = 0; i < 200; ++i) {
    const Vec3 p(random.next_1d() * 2 - 1, random.next_1d() * 2 - 1, random.next_1d());
    double sum = 0.0;
    for (LightIndex light = 0; light < 7 + 4 + 1; ++light)
      sum += static_cast<double>(set->prob_selection(p, Vec3(0.0f), light));
    EXPECT_NEAR(sum, 1.0, 1e-5);
  }
  EXPECT_EQ(set->prob_selection(Vec3(0.0f), Vec3(0.0f), k_no_light), 0.0f);
  EXPECT_EQ(set->sampled_lights(), 12u);
}

TEST(LightSet, an_even_world_is_left_to_scattering_where_that_is_asked_and_no_other_world_is) {
  for (const bool even : {true, false}) {
    LightSetBuilder builder;
    AnalyticLight sun;
    sun.kind = LightKind::sun;
    const LightIndex sun_index = builder.add(sun);
    EnvironmentLight world;
    world.radiance = Color(0.5f);
    world.width = 4;
    world.height = 2;
    world.luminance = std::vector<float>(8, 0.5f);
    if (!even) world.luminance[3] = 0.6f;
    builder.set_environment(std::move(world));
    Report report;
    const auto set = builder.build(report);
    const Vec3 p(0.0f), n(0, 0, 1);
    const LightIndex world_index = sun_index + 1;
    ASSERT_EQ(set->kind(world_index), LightKind::environment);
    EXPECT_FALSE(set->empty());
    EXPECT_FALSE(set->empty(EvenWorld::left_to_scattering));
    EXPECT_GT(set->prob_selection(p, n, world_index), 0.1f);
    const float prob_world = set->prob_selection(p, n, world_index, EvenWorld::left_to_scattering);
    const float prob_sun = set->prob_selection(p, n, sun_index, EvenWorld::left_to_scattering);
    EXPECT_EQ(prob_world == 0.0f, even);
    EXPECT_EQ(prob_sun == 1.0f, even);
    EXPECT_NEAR(prob_sun + prob_world, 1.0f, 1e-6f);
    const float pdf = set->pdf_solid_angle(p, n, world_index, normalize(Vec3(0.3f, 0.5f, 0.8f)), k_infinity, Vec2(0.0f),
                                           EvenWorld::left_to_scattering);
    EXPECT_EQ(pdf == 0.0f, even);
    RandomStream random(1);
    for (int i = 0; i < 1000; ++i) {
      const LightSample sample = set->sample(p, n, random.next_2d(), EvenWorld::left_to_scattering);
      ASSERT_TRUE(sample);
      if (even) {
        ASSERT_EQ(sample.light, sun_index);
      }
    }
  }
  LightSetBuilder builder;
  EnvironmentLight world;
  world.radiance = Color(0.5f);
  builder.set_environment(std::move(world));
  Report report;
  const auto alone = builder.build(report);
  EXPECT_FALSE(alone->empty());
  EXPECT_TRUE(alone->empty(EvenWorld::left_to_scattering));
  EXPECT_FALSE(alone->sample(Vec3(0.0f), Vec3(0, 0, 1), Vec2(0.5f), EvenWorld::left_to_scattering));
}

TEST(LightSet, receivers_that_some_lights_do_not_reach_choose_among_the_others_alone) {
  LightSetBuilder builder;
  std::vector<LightIndex> lights;
  for (int i = 0; i < 40; ++i) {
    const float x = static_cast<float>(i % 8) - 4.0f, y = static_cast<float>(i / 8) - 2.0f;
    AnalyticLight light = lamp(i < 38 ? LightKind::point : LightKind::sun, {x, y, 2}, i < 38 ? 10.0f : 1.0f);
    light.traits.linked.receivers = static_cast<uint8_t>(i % 3);  // 0: all
    lights.push_back(builder.add(light));
  }
  const uint32_t emission = builder.add_emission({Color(5.0f), true, true, {.linked = {.receivers = 2}}});
  builder.add_mesh(0, "Panel", quad(0.4f, {0, 1, 1.5f}, emission));
  const uint64_t sets[] = {0, 1, 2, 3};
  for (const uint64_t in : sets) EXPECT_EQ(builder.add_receivers(in), in + 1);
  EXPECT_EQ(builder.add_receivers(2), 3);
  const auto set = build(builder);
  const Vec3 p(0.3f, -0.2f, 0), n(0, 0, 1);
  for (const uint64_t in : sets) {
    const LightChoices choices(EvenWorld::sampled, static_cast<uint8_t>(in + 1));
    const auto reaches = [&](LightIndex light) {
      const uint8_t receivers = set->traits(light).linked.receivers;
      return receivers == 0 || (in >> (receivers - 1) & 1u);
    };
    double sum = 0.0;
    for (LightIndex light = 0; light < 42; ++light) {
      const float prob = set->prob_selection(p, n, light, choices);
      EXPECT_EQ(prob > 0.0f, reaches(light)) << in << " light " << light;
      sum += static_cast<double>(prob);
    }
    EXPECT_NEAR(sum, 1.0, 1e-5);
    RandomStream random(3);
    for (int i = 0; i < 1000; ++i) {
      const LightSample sample = set->sample(p, n, random.next_2d(), choices);
      ASSERT_TRUE(sample);
      EXPECT_TRUE(reaches(sample.light));
      EXPECT_NEAR(sample.prob_selection, set->prob_selection(p, n, sample.light, choices),
                  1e-5f * sample.prob_selection);
    }
  }
}

TEST(LightSet, a_point_lamp_of_100_watts_gives_what_blender_measures) {
  LightSetBuilder builder;
  builder.add(lamp(LightKind::point, {0, 0, 2}));
  EXPECT_NEAR(irradiance(*build(builder), {0, 0, 0}, {0, 0, 1}, 16), 1.98942, 2e-5);
}

double polygon_irradiance(const Vec3& p, const Vec3& n, const std::vector<Vec3>& vertices) {
  double sum = 0.0;
  for (size_t i = 0; i < vertices.size(); ++i) {
    const Vec3d a = (Vec3d(vertices[i]) - Vec3d(p)).normalized(),
                b = (Vec3d(vertices[(i + 1) % vertices.size()]) - Vec3d(p)).normalized();
    const Vec3d c = a.cross(b);
    sum += std::atan2(c.length(), a.dot(b)) * c.normalized().dot(Vec3d(n));
  }
  return std::fabs(0.5 * sum);
}

TEST(LightSet, emissive_polygons_give_lamberts_irradiance_at_any_scale) {
  for (const float scale : {1e-6f, 1e-3f, 1.0f, 1e3f, 1e6f}) {
    LightSetBuilder builder;
    const uint32_t emission = builder.add_emission({Color(4.0f), true, true, {}});
    builder.add_mesh(0, "Panel", quad(0.5f * scale, Vec3(0.2f, 0.1f, 0.6f) * scale, emission));
    const auto set = build(builder);
    const Vec3 n = normalize(Vec3(0.2f, -0.1f, 1));
    const double expected =
        4 * polygon_irradiance(Vec3(0.0f), n,
                               {{-0.3f, -0.4f, 0.6f}, {0.7f, -0.4f, 0.6f}, {0.7f, 0.6f, 0.6f}, {-0.3f, 0.6f, 0.6f}});
    EXPECT_NEAR(irradiance(*set, Vec3(0.0f), n) / expected, 1.0, 5e-4) << scale;
  }
}

/// UV sphere.
std::vector<EmissiveTriangle> sphere(const Vec3& c, float r, int rings, uint32_t emission) {
  std::vector<EmissiveTriangle> triangles;
  const auto vertex = [&](int i, int j) {
    const float theta = k_pi * static_cast<float>(i) / static_cast<float>(rings),
                phi = 2 * k_pi * static_cast<float>(j) / static_cast<float>(rings);
    return c + Vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)) * r;
  };
  uint32_t number = 0;
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < rings; ++j) {
      // At the poles a quad is a triangle.
      if (i + 1 < rings)
        triangles.push_back({vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), number++, emission});
      if (i > 0) triangles.push_back({vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1), number++, emission});
    }
  return triangles;
}

TEST(LightSet, a_finely_tessellated_sphere_gives_the_irradiance_of_its_triangles_and_of_a_sphere) {
  // Cycles 3.4.1 is 3 to 5 % dark with 27,000 triangles.
  const int rings = 120;
  LightSetBuilder builder;
  const uint32_t emission = builder.add_emission({Color(4.0f), true, false, {}});
  const Vec3 c(0.5f, 0, 2);
  auto triangles = sphere(c, 0.3f, rings, emission);
  const Vec3 n(0, 0, 1);
  double exact = 0.0;
  for (const auto& t : triangles)
    if (dot(cross(t.b - t.a, t.c - t.a), t.a) < 0) exact += 4 * polygon_irradiance(Vec3(0.0f), n, {t.a, t.b, t.c});
  builder.add_mesh(0, "Ball", triangles);
  const auto set = build(builder);
  EXPECT_EQ(set->triangle_count(), static_cast<size_t>(2 * rings * (rings - 1)));
  const double measured = irradiance(*set, Vec3(0.0f), n, 1 << 18);
  EXPECT_NEAR(measured / exact, 1.0, 2e-3);
  // pi L (r/d)² cos; the tessellation is inscribed and loses about (2 pi / rings)² / 4 of the area.
  const double d = std::sqrt(4.25);
  EXPECT_NEAR(measured / (std::numbers::pi * 4 * 0.09 / 4.25 * 2 / d), 1.0, 3e-3);
}

TEST(LightSet, both_transport_directions_give_a_patch_the_same_light) {
  // Irradiance averaged over the patch |x|, |y| < 1/2 of the plane z = 0: by asking for light there, and by sending it.
  struct Case {
    const char* name;
    std::function<void(LightSetBuilder&)> add;
  };
  const auto with = [](AnalyticLight light, auto&& change) {
    change(light);
    return [light](LightSetBuilder& b) { b.add(light); };
  };
  const Vec3 p(0.3f, 0.2f, 1);
  const std::vector<Case> cases = {
      {"point", with(lamp(LightKind::point, p), [](auto&) {})},
      {"sphere", with(lamp(LightKind::point, p), [](auto& l) { l.radius_m = 0.6f; })},
      {"spot", with(lamp(LightKind::spot, p), [](auto&) {})},
      {"wide spot", with(lamp(LightKind::spot, p),
                         [](auto& l) {
                           l.radius_m = 0.5f;
                           l.spot_size_rad = 2;
                         })},
      {"round lamp", with(lamp(LightKind::point, p),
                          [](auto& l) {
                            l.radius_m = 0.6f;
                            l.sphere = true;
                          })},
      {"wide round spot", with(lamp(LightKind::spot, p),
                               [](auto& l) {
                                 l.radius_m = 0.5f;
                                 l.spot_size_rad = 2;
                                 l.sphere = true;
                                 l.spot_cosine = false;
                               })},
      {"elliptic spot", with(lamp(LightKind::spot, p),
                             [](auto& l) {
                               l.spot_cosine = false;
                               l.spot_size_rad = 1.2f;
                               const float rows[12] = {2, 0, 0, 0.3f, 0, 0.5f, 0, 0.2f, 0, 0, 1.5f, 1};
                               l.world_from_light = Transform::from_rows(rows);
                             })},
      {"even sun disk", with(lamp(LightKind::sun, p, 3),
                             [](auto& l) {
                               l.angle_rad = 2;
                               l.even_sun = true;
                             })},
      {"sun", with(lamp(LightKind::sun, p, 3), [](auto&) {})},
      {"sun disk", with(lamp(LightKind::sun, p, 3), [](auto& l) { l.angle_rad = 1; })},
      {"area", with(lamp(LightKind::area, p), [](auto&) {})},
      {"ellipse", with(lamp(LightKind::area, p),
                       [](auto& l) {
                         l.round = true;
                         l.size_m = {2, 1};
                       })},
      {"spread", with(lamp(LightKind::area, p), [](auto& l) { l.spread_rad = 1; })},
      {"triangles",
       [&](LightSetBuilder& b) {
         b.add_mesh(0, "Panel", quad(0.5f, p, b.add_emission({Color(4.0f), true, true, {}})));
       }},
      {"one side",
       [&](LightSetBuilder& b) {
         b.add_mesh(0, "Panel", quad(0.5f, p, b.add_emission({Color(4.0f), true, false, {}})));
       }},
      {"other side",
       [&](LightSetBuilder& b) {
         b.add_mesh(0, "Panel", quad(0.5f, p, b.add_emission({Color(4.0f), false, true, {}}), false));
       }},
      {"sky",
       [](LightSetBuilder& b) {
         EnvironmentLight sky;
         sky.radiance = Color(0.5f);
         b.set_environment(sky);
       }},
      {"two of them",
       [&](LightSetBuilder& b) {
         b.add(lamp(LightKind::sun, p, 3));
         b.add(lamp(LightKind::area, p));
         b.add(lamp(LightKind::point, p));
       }},
  };
  const Vec3 n(0, 0, 1);
  for (const Case& c : cases) {
    LightSetBuilder builder;
    builder.set_scene_bounds({{-1, -1, 0}, {1, 1, 1.5f}});
    c.add(builder);
    const auto set = build(builder);
    const uint32_t count = 1 << 17;
    double asked = 0.0, asked_square = 0.0;
    for (uint32_t i = 0; i < count; ++i) {
      const Sampler sampler(3, 0, 0, i);
      const Vec2 u = sampler.get_2d(2);
      const LightSample s = set->sample(Vec3(u.x - 0.5f, u.y - 0.5f, 0), n, sampler.get_2d(1));
      if (!s) continue;
      const double value = static_cast<double>(s.radiance.x * std::max(s.direction_world.z, 0.0f)) /
                           static_cast<double>(s.pdf_solid_angle);
      asked += value / count;
      asked_square += value * value / count;
    }
    EXPECT_GT(asked, 0.1) << c.name;

    // Not aimed; at that patch; at another, which is worse but as right.
    const auto arrival_at = [&](const EmissionSample& e, float from_x) {
      const float t = -e.p_light_world.z / e.direction_world.z;
      const Vec3 hit = e.p_light_world + e.direction_world * t;
      const bool inside =
          t > 0 && e.direction_world.z < 0 && hit.x > from_x && hit.x < from_x + 1 && std::fabs(hit.y) < 0.5f;
      return EmissionArrival{e.light, e.is_infinite, hit, inside ? 1.0f : 0.0f};
    };
    std::vector<EmissionAim> aims(1);
    for (const float from_x : {-0.5f, 0.4f}) {
      std::vector<EmissionArrival> arrivals;
      for (uint32_t i = 0; i < 1 << 12; ++i) {
        const Sampler sampler(4, 0, 0, i);
        const EmissionSample e = set->sample_emission(sampler.get_2d(4), sampler.get_2d(5));
        if (e) arrivals.push_back(arrival_at(e, from_x));
      }
      aims.emplace_back(arrivals, 1e-3f);
      ASSERT_FALSE(aims.back().empty()) << c.name;
    }
    std::vector<double> variance;
    for (const EmissionAim& aim : aims) {
      double sent = 0.0, sent_square = 0.0;
      for (uint32_t i = 0; i < count; ++i) {
        const Sampler sampler(3, 0, 0, i);
        const EmissionSample e = set->sample_emission(sampler.get_2d(4), sampler.get_2d(5), &aim);
        if (!e) continue;
        const EmissionPdf pdf =
            set->pdf_emission(e.light, e.n_light_world, e.direction_world,
                              e.p_light_world + e.direction_world * (e.is_infinite ? 1.0f : 0.0f), &aim);
        ASSERT_NEAR(pdf.prob_selection / e.prob_selection, 1.0f, 1e-5f) << c.name;
        ASSERT_NEAR(pdf.pdf_area / e.pdf_area, 1.0f, 1e-4f) << c.name;
        ASSERT_NEAR(pdf.pdf_direction_solid_angle / e.pdf_direction_solid_angle, 1.0f, 1e-3f) << c.name;
        if (arrival_at(e, -0.5f).worth == 0.0f) continue;
        const double value = static_cast<double>(e.radiance.x * e.cos_light) /
                             static_cast<double>(e.prob_selection * e.pdf_area * e.pdf_direction_solid_angle);
        sent += value / count;
        sent_square += value * value / count;
      }
      variance.push_back(sent_square - sent * sent);
      const double deviation = std::sqrt((asked_square - asked * asked + variance.back()) / count);
      EXPECT_NEAR(sent, asked, 4 * deviation + 1e-4 * asked) << c.name << ", aim " << variance.size() - 1;
    }
    EXPECT_LT(variance[1], variance[2]) << c.name;
  }
}

TEST(LightSet, hits_are_found_by_kind_of_ray) {
  LightSetBuilder builder;
  AnalyticLight light = lamp(LightKind::area, {0, 0, 2});
  light.traits.hidden_from = 1u;
  const LightIndex hidden = builder.add(light);
  light.traits = {};
  light.world_from_light = at({0, 0, 3});
  const LightIndex far = builder.add(light);
  light.traits.hit_by_rays = false;
  light.world_from_light = at({0, 0, 1});
  builder.add(light);
  light = lamp(LightKind::sun, Vec3(0.0f), 3);
  light.angle_rad = 0.5f;
  light.traits.hidden_from = 4u;
  builder.add(light);
  const auto set = build(builder);
  EXPECT_EQ(set->intersect({0, 0, 0}, {0, 0, 1}, 0, 100, 1u).light, far);
  const LightHit hit = set->intersect({0, 0, 0}, {0, 0, 1}, 0, 100, 2u);
  EXPECT_EQ(hit.light, hidden);
  EXPECT_NEAR(hit.distance_m, 2.0f, 1e-6f);
  EXPECT_EQ(set->intersect({0, 0, 0}, {0, 0, 1}, 0, 1.9f, 2u).light, k_no_light);
  EXPECT_EQ(set->intersect({0, 0, 0}, {0, 0, -1}, 0, 100, 2u).light, k_no_light);
  int lamps = 0, suns = 0;
  set->for_each_lamp({0, 0, 0}, {0, 0, 1}, 0, 100, 2u, [&](const LightHit&) { ++lamps; });
  set->for_each_infinite({0, 0, 1}, 2u, [&](const LightHit&) { ++suns; });
  set->for_each_infinite({0, 0, 1}, 4u, [&](const LightHit&) { ++suns; });
  EXPECT_EQ(lamps, 2);
  EXPECT_EQ(suns, 1);
}

TEST(LightSet, a_side_that_is_not_sampled_has_no_density) {
  for (const bool front : {false, true}) {
    LightSetBuilder builder;
    auto triangles = quad(0.5f, {0, 0, 1}, builder.add_emission({Color(1.0f), front, !front, {}}));
    triangles.pop_back();
    builder.add_mesh(0, "Panel", triangles);
    const auto set = build(builder);
    const LightIndex light = set->find_triangle(0, 0);
    const float below = set->pdf_solid_angle({0.1f, -0.1f, 0}, Vec3(0.0f), light, {0, 0, 1}, 1, {0.3f, 0.3f});
    const float above = set->pdf_solid_angle({0.1f, -0.1f, 2}, Vec3(0.0f), light, {0, 0, -1}, 1, {0.3f, 0.3f});
    EXPECT_EQ(below > 0.0f, front);  // the quad faces down
    EXPECT_EQ(above > 0.0f, !front);
    EXPECT_EQ(static_cast<bool>(set->sample({0.1f, -0.1f, 0}, Vec3(0.0f), {0.5f, 0.5f})), front);
    EXPECT_EQ(static_cast<bool>(set->sample({0.1f, -0.1f, 2}, Vec3(0.0f), {0.5f, 0.5f})), !front);
  }
}

TEST(LightSet, zero_negative_and_enormous_powers_are_handled) {
  LightSetBuilder builder;
  builder.add(lamp(LightKind::point, {0, 0, 2}, 0.0f));
  builder.add(lamp(LightKind::point, {0, 0, 2}, -100.0f));
  const auto set = build(builder);
  EXPECT_EQ(set->sampled_lights(), 1u);
  EXPECT_NEAR(irradiance(*set, {0, 0, 0}, {0, 0, 1}, 16), -1.98942, 2e-5);
  const auto bright = mixed(1.0f, true, 1e28f);
  RandomStream random(1);
  for (int i = 0; i < 10000; ++i) {
    const Vec3 p(random.next_1d() * 2 - 1, random.next_1d() * 2 - 1, random.next_1d());
    const LightSample s = bright->sample(p, Vec3(0.0f), random.next_2d());
    ASSERT_TRUE(!s || (std::isfinite(s.pdf_solid_angle) && is_finite(s.radiance)));
    const EmissionSample e = bright->sample_emission(random.next_2d(), random.next_2d());
    ASSERT_TRUE(!e || (std::isfinite(e.pdf_area) && is_finite(e.radiance)));
  }
}

TEST(LightSet, what_defines_no_light_is_reported_and_left_out) {
  LightSetBuilder builder;
  AnalyticLight bad = lamp(LightKind::area, {0, 0, 2});
  bad.name = "Flat";
  bad.size_m.y = 0;
  EXPECT_EQ(builder.add(bad), 0u);
  bad = lamp(LightKind::point, {0, 0, 2}, NAN);
  bad.name = "Broken";
  builder.add(bad);
  bad = lamp(LightKind::point, {0, 0, 2}, 1e30f);
  bad.name = "Blinding";
  bad.radius_m = 1e-9f;
  builder.add(bad);
  EXPECT_EQ(builder.add(lamp(LightKind::point, {0, 0, 2})), 3u);
  const uint32_t emission = builder.add_emission({Color(1.0f), true, true, {}});
  auto triangles = quad(1, {0, 0, 2}, emission);
  triangles.push_back({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, 2, emission});
  triangles.push_back({{0, 0, 0}, {NAN, 1, 1}, {0, 2, 2}, 3, emission});
  triangles.push_back({{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, 4, 99});
  builder.add_mesh(2, "Panel", triangles);
  Report report;
  const auto set = builder.build(report);
  std::string all;
  for (const Message& m : report.messages()) all += m.text + "\n";
  for (const char* name : {"Flat", "Broken", "Blinding", "Panel\": 2 of its 5"})
    EXPECT_NE(all.find(name), std::string::npos) << all;
  EXPECT_EQ(set->sampled_lights(), 3u);
  EXPECT_NE(set->find_triangle(2, 1), k_no_light);
  for (const uint32_t t : {2u, 3u, 4u, 5u, 0xffffffffu}) EXPECT_EQ(set->find_triangle(2, t), k_no_light);
  for (const uint32_t i : {0u, 1u, 3u}) EXPECT_EQ(set->find_triangle(i, 0), k_no_light);
  EXPECT_EQ(set->kind(0), LightKind::point);
  EXPECT_EQ(set->pdf_solid_angle(Vec3(0.0f), Vec3(0.0f), 0, {0, 0, 1}, 2, {0, 0}), 0.0f);
}

TEST(LightSet, a_scene_without_lights_gives_no_samples) {
  LightSetBuilder builder;
  builder.set_environment({});
  const auto set = build(builder);
  EXPECT_TRUE(set->empty());
  EXPECT_FALSE(set->sample(Vec3(0.0f), Vec3(0, 0, 1), {0.5f, 0.5f}));
  EXPECT_FALSE(set->sample_emission({0.5f, 0.5f}, {0.5f, 0.5f}));
  EXPECT_FALSE(set->has_infinite_lights());
  EXPECT_FALSE(set->intersect(Vec3(0.0f), {0, 0, 1}, 0, 1, 1u));
}

TEST(LightSet, receivers_at_a_light_get_no_nonsense) {
  const auto set = mixed();
  RandomStream random(7);
  for (const Vec3& p :
       {Vec3(-1, 0.2f, 1), Vec3(1, 0.5f, 1.5f), Vec3(-1, -1, 2), Vec3(0, 1, 1.5f), Vec3(0.4f, 1.4f, 1.5f)})
    for (int i = 0; i < 1000; ++i) {
      const LightSample s = set->sample(p, Vec3(0.0f), random.next_2d());
      ASSERT_TRUE(!s || (std::isfinite(s.pdf_solid_angle) && s.pdf_solid_angle > 0 && is_finite(s.direction_world)));
    }
}

}  // namespace
}  // namespace lambent
