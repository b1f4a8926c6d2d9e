// Sampling against density, forwards and reversed, and both directions of transport against each other.
#include <gtest/gtest.h>

#include "engine/sampling/chi_square.h"
#include "engine/shading/lobe_functions.h"
#include "tests/furnace/lobe_cases.h"

namespace lambent {
namespace {

constexpr float k_angles[] = {0.0f, 0.7f, 1.3f};

// A surface with several lobes of every sort.
std::vector<Lobe> mixture() {
  std::vector<Lobe> lobes;
  Lobe diffuse = make_lobe(LobeKind::diffuse);
  diffuse.weight = Color(0.4f, 0.2f, 0.1f);
  Lobe specular = make_lobe(LobeKind::reflection, 0.2f, 0.2f);
  specular.fresnel = FresnelMode::schlick;
  specular.eta = 1.5f;
  specular.f0 = Color(0.04f);
  Lobe refraction = make_lobe(LobeKind::refraction, 0.3f, 0.3f);
  refraction.eta = 1.45f;
  refraction.macro_fresnel = true;
  refraction.weight = Color(0.5f);
  Lobe translucent = make_lobe(LobeKind::translucent);
  translucent.weight = Color(0.1f, 0.1f, 0.3f);
  return {diffuse, specular, refraction, translucent};
}

// In (theta, phi), where narrow lobes around the poles are wide enough for the cells' integration. Refraction has poles
// near the critical angle, which need many steps.
ChiSquareResult test_density(const std::vector<Lobe>& lobes, const Vec3& wi, Transport transport, int steps,
                             float least_share = 0.0f) {
  Bsdf bsdf = plane_bsdf(lobes, wi);
  bsdf.set_least_share(least_share);
  RandomStream choice(7);
  return chi_square_test_2d(
      {0.0f, -k_pi}, {k_pi, k_pi},
      [&](const Vec2& u) {
        const BsdfSample sample = bsdf.sample(wi, choice.next_1d(), u, transport, ReversePdf::no);
        if (sample.event == k_scatter_none) return Vec2(10.0f, 10.0f);
        const Vec3& wo = sample.wo_world;
        return Vec2(std::acos(std::clamp(wo.z, -1.0f, 1.0f)), std::atan2(wo.y, wo.x));
      },
      [&](const Vec2& p) {
        return bsdf.eval(wi, direction(p.x, p.y), transport, ReversePdf::no).pdf_solid_angle * std::sin(p.x);
      },
      steps);
}

TEST(Sampler, every_lobe_is_sampled_with_its_density) {
  std::vector<std::pair<LobeCase, float>> tests;
  for (const float alpha : {0.25f, 0.7f})
    for (const LobeCase& lobe_case : lobe_cases(alpha))
      for (const float angle : k_angles) {
        // Lobes without alpha need one round only; a nearly matched index gives a spike that cells cannot integrate
        if (alpha > 0.5f && !is_microfacet(lobe_case.lobe.kind)) continue;
        if (std::fabs(lobe_case.lobe.eta - 1.05f) < 1e-3f) continue;
        if (lobe_case.lobe.macro_fresnel) continue;  // the density of a single lobe does not depend on it
        tests.push_back({lobe_case, angle});
      }
  const double significance = sidak_significance(static_cast<int>(tests.size()));
  for (const auto& [lobe_case, angle] : tests) {
    const ChiSquareResult result =
        test_density({lobe_case.lobe}, direction(angle, 0.3f), Transport::radiance, lobe_case.transmits ? 160 : 32);
    EXPECT_GT(result.p_value, significance) << lobe_case.name << " at " << angle << ", chi² " << result.statistic
                                            << " of " << result.degrees << ", integral " << result.total_probability;
    EXPECT_LT(result.total_probability, 1.003) << lobe_case.name << " at " << angle;
  }
}

TEST(Sampler, a_mixture_is_sampled_with_its_density_from_both_sides_and_in_both_transports) {
  const double significance = sidak_significance(12);
  for (const float angle : {0.1f, 0.7f, 1.3f})
    for (const float side : {1.0f, -1.0f})
      for (const Transport transport : {Transport::radiance, Transport::importance}) {
        Vec3 wi = direction(angle, 0.3f);
        wi.z *= side;
        const ChiSquareResult result = test_density(mixture(), wi, transport, 96);
        EXPECT_GT(result.p_value, significance)
            << angle << " side " << side << ", integral " << result.total_probability;
      }
}

TEST(Sampler, a_hair_fibre_is_sampled_with_its_density_from_lights_and_from_behind) {
  const double significance = sidak_significance(12);
  for (const float roughness : {0.2f, 0.6f})
    for (const float angle : {0.1f, 0.9f, 2.5f})
      for (const Transport transport : {Transport::radiance, Transport::importance}) {
        Lobe lobe = make_lobe(LobeKind::hair_fibre, roughness, 0.8f * roughness);
        lobe.tangent = {1, 0, 0};
        lobe.param = -0.1f;
        lobe.f0 = Color(0.2f);
        lobe.f90 = Color(0.8f, 1.55f, 0.0f);
        const ChiSquareResult result = test_density({lobe}, direction(angle, 0.9f), transport, 96);
        EXPECT_GT(result.p_value, significance)
            << roughness << " at " << angle << ", chi² " << result.statistic << " of " << result.degrees;
      }
}

TEST(Sampler, a_rough_hair_is_sampled_with_its_density_from_all_sides) {
  const double significance = sidak_significance(12);
  for (const float roughness : {0.1f, 0.3f, 0.8f})
    for (const float angle : {0.1f, 0.9f, 1.6f, 2.5f}) {
      Lobe lobe = make_lobe(LobeKind::hair_microfacets, roughness, 0.85f);
      lobe.tangent = {1, 0, 0};
      lobe.param = -0.1f;
      lobe.eta = 1.55f;
      lobe.f0 = Color(0.2f);
      lobe.f90 = Color(1.0f);
      const HairMicrofacets hair(lobe);  // by itself: values, which cost much, do not matter here
      const Vec3 from = direction(angle, 0.9f);
      RandomStream choice(7);
      const ChiSquareResult result = chi_square_test_2d(
          {0.0f, -k_pi}, {k_pi, k_pi},
          [&](const Vec2& u) {
            const Vec3 to = hair.sample(from, choice.next_1d(), u);
            return Vec2(std::acos(std::clamp(to.z, -1.0f, 1.0f)), std::atan2(to.y, to.x));
          },
          [&](const Vec2& p) { return hair.pdf_solid_angle(from, direction(p.x, p.y)) * std::sin(p.x); }, 96);
      EXPECT_GT(result.p_value, significance)
          << roughness << " at " << angle << ", chi² " << result.statistic << " of " << result.degrees;
      EXPECT_NEAR(result.total_probability, 1.0, 3e-3) << roughness << " at " << angle;
    }
}

TEST(Sampler, a_mixture_with_a_least_share_is_sampled_with_its_density) {
  const double significance = sidak_significance(3);
  for (const float angle : {0.1f, 0.7f, 1.3f}) {
    const ChiSquareResult result = test_density(mixture(), direction(angle, 0.3f), Transport::radiance, 96, 0.25f);
    EXPECT_GT(result.p_value, significance) << angle << ", integral " << result.total_probability;
  }
}

TEST(Sampler, a_dim_mirror_gets_its_least_share_and_keeps_its_light) {
  Lobe mirror = make_lobe(LobeKind::reflection, 0.0f, 0.0f);
  mirror.weight = Color(0.01f);
  Lobe clear = make_lobe(LobeKind::transparent);
  clear.weight = Color(0.99f);
  const Vec3 wi = direction(0.7f, 0.3f);
  Bsdf bsdf = plane_bsdf({mirror, clear}, wi);
  bsdf.set_least_share(0.125f);
  const float prob_mirror = 0.125f / (0.125f + 0.99f);
  double reflected = 0.0;
  int count = 0;
  constexpr int k_samples = 1 << 14;
  for (int i = 0; i < k_samples; ++i) {
    const BsdfSample sample =
        bsdf.sample(wi, 0.5f, Vec2((i + 0.5f) / k_samples, 0.5f), Transport::radiance, ReversePdf::no);
    ASSERT_NE(sample.event, k_scatter_none);
    if (sample.event & k_scatter_transparent) continue;
    EXPECT_NEAR(sample.pdf_solid_angle, prob_mirror, 1e-5f);
    reflected += sample.weight.x;
    ++count;
  }
  EXPECT_NEAR(count, k_samples * prob_mirror, 1.5);
  EXPECT_NEAR(reflected / k_samples, 0.01, 1e-5);
}

// Smooth shading shows directions that lie below the facet: next event alone finds light there, so nothing there may be
// as bright as a highlight that only scattering finds well.
TEST(Sampler, highlights_below_the_facet_are_held_down_and_wide_lobes_there_are_not) {
  const Vec3 ng = direction(0.6f, 0.0f), wi = direction(1.2f, 0.0f), mirrored = direction(1.2f, k_pi);
  const auto value = [&](float alpha, const Vec3& facet) {
    ShadingPoint point = plane_point(wi);
    point.ng_world = facet;
    Bsdf bsdf;
    bsdf.begin(point);
    bsdf.add(make_lobe(LobeKind::reflection, alpha, alpha));
    return bsdf.eval(wi, mirrored, Transport::radiance, ReversePdf::no);
  };
  ASSERT_LT(dot(ng, mirrored), 0.0f);
  const BsdfEval sharp = value(0.01f, {0, 0, 1}), sharp_below = value(0.01f, ng);
  EXPECT_GT(sharp.f_cos.x, 1000.0f);
  EXPECT_NEAR(sharp_below.f_cos.x, sharp.f_cos.x / sharp.pdf_solid_angle, 1e-3f);
  EXPECT_EQ(sharp_below.pdf_solid_angle, 0.0f);
  const BsdfEval wide = value(1.0f, {0, 0, 1}), wide_below = value(1.0f, ng);
  ASSERT_LT(wide.pdf_solid_angle, 1.0f);
  EXPECT_GT(wide.f_cos.x, 0.0f);
  EXPECT_EQ(wide_below.f_cos.x, wide.f_cos.x);
}

TEST(Sampler, microfacet_normals_follow_their_density_at_small_alpha) {
  // In slopes scaled by alpha, where narrow distributions are as wide as others
  const float alphas[] = {0.001f, 0.02f, 0.3f, 1.0f};
  const double significance = sidak_significance(2 * 4 * 3);
  for (const Distribution distribution : {Distribution::ggx, Distribution::beckmann})
    for (const float alpha : alphas)
      for (const float angle : {0.0f, 0.9f, 1.5f}) {
        const Microfacets facets(distribution, alpha, alpha);
        const Vec3 w = direction(angle, 0.0f);
        const ChiSquareResult result = chi_square_test_2d(
            {-3.0f, -3.0f}, {3.0f, 3.0f},
            [&](const Vec2& u) {
              const Vec3 m = facets.sample_normal(w, u);
              return Vec2(m.x / (m.z * alpha), m.y / (m.z * alpha));
            },
            [&](const Vec2& slope) {
              const Vec3 m = normalize(Vec3(slope.x * alpha, slope.y * alpha, 1.0f));
              return facets.pdf_normal_solid_angle(w, m) * alpha * alpha * m.z * m.z * m.z;
            });
        EXPECT_GT(result.p_value, significance)
            << (distribution == Distribution::ggx ? "ggx" : "beckmann") << " alpha " << alpha << " at " << angle
            << ", chi² " << result.statistic << " of " << result.degrees;
      }
}

TEST(Sampler, parts_of_an_evaluation_are_what_each_lobe_has_of_it) {
  const std::vector<Lobe> lobes = mixture();
  RandomStream random(21);
  for (const float angle : k_angles) {
    const Vec3 wi = direction(angle, 0.4f);
    const Bsdf bsdf = plane_bsdf(lobes, wi);
    for (int i = 0; i < 200; ++i) {
      const Vec3 wo = uniform_direction(random.next_2d());
      EvalParts parts;
      const BsdfEval whole = bsdf.eval(wi, wo, Transport::radiance, ReversePdf::no, parts);
      EXPECT_EQ(whole.f_cos, bsdf.eval(wi, wo, Transport::radiance, ReversePdf::no).f_cos);
      Color of_class[k_lobe_classes] = {Color(0.0f), Color(0.0f), Color(0.0f)};
      for (const Lobe& lobe : lobes) {
        const Color alone = plane_bsdf({lobe}, wi).eval(wi, wo, Transport::radiance).f_cos;
        of_class[static_cast<size_t>(class_of(lobe.kind, lobe.n.z * wi.z * wo.z < 0.0f))] += alone;
      }
      const ClassShares shares = bsdf.class_shares(wi, wo, Transport::radiance);
      for (size_t c = 0; c < k_lobe_classes; ++c)
        for (int k = 0; k < 3; ++k) {
          EXPECT_NEAR(parts.f_cos[c][k], of_class[c][k], 1e-5f * (whole.f_cos[k] + 1.0f));
          if (whole.f_cos[k] > 0.0f) {
            EXPECT_NEAR(shares.of[c][k] * whole.f_cos[k], of_class[c][k], 1e-5f * (whole.f_cos[k] + 1.0f));
          }
        }
      EXPECT_EQ(parts.pdf.diffuse + parts.pdf.glossy + parts.pdf.transmission > 0.0f, whole.pdf_solid_angle > 0.0f);

      const float choice = random.next_1d();
      const Vec2 u = random.next_2d();
      const BsdfSample plain = bsdf.sample(wi, choice, u, Transport::radiance, ReversePdf::no);
      const BsdfSample with_parts = bsdf.sample(wi, choice, u, Transport::radiance, ReversePdf::no, parts = {});
      EXPECT_EQ(plain.wo_world, with_parts.wo_world);
      EXPECT_EQ(plain.weight, with_parts.weight);
      ASSERT_GE(parts.picked, 0);
      if (plain.event != k_scatter_none) {
        EXPECT_EQ(parts.picked, plain.lobe);
      }
    }
  }
}

TEST(Sampler, weight_is_value_over_density) {
  RandomStream random(3);
  for (const Transport transport : {Transport::radiance, Transport::importance})
    for (const LobeCase& lobe_case : lobe_cases(0.3f)) {
      const Vec3 wi = direction(0.8f, 1.0f);
      const Bsdf bsdf = plane_bsdf({lobe_case.lobe}, wi);
      for (int i = 0; i < 100; ++i) {
        const float choice = random.next_1d();
        const BsdfSample sample = bsdf.sample(wi, choice, random.next_2d(), transport);
        if (sample.event == k_scatter_none) continue;
        const BsdfEval eval = bsdf.eval(wi, sample.wo_world, transport);
        ASSERT_NEAR(sample.pdf_solid_angle, eval.pdf_solid_angle, 1e-3f * eval.pdf_solid_angle) << lobe_case.name;
        for (int k = 0; k < 3; ++k)
          ASSERT_NEAR(sample.weight[k] * eval.pdf_solid_angle, eval.f_cos[k], 1e-3f * eval.f_cos[k] + 1e-9f)
              << lobe_case.name;
      }
    }
}

TEST(Sampler, reverse_density_is_the_forward_density_of_the_reversed_walk) {
  std::vector<std::pair<std::string, std::vector<Lobe>>> surfaces{{"mixture", mixture()}};
  for (const LobeCase& lobe_case : lobe_cases(0.4f)) surfaces.push_back({lobe_case.name, {lobe_case.lobe}});
  RandomStream random(5);
  for (const auto& [name, lobes] : surfaces) {
    int compared = 0;
    for (int i = 0; i < 4000; ++i) {
      const Vec3 wi = uniform_direction(random.next_2d()), wo = uniform_direction(random.next_2d());
      if (std::fabs(wi.z) < 0.02f || std::fabs(wo.z) < 0.02f) continue;
      const BsdfEval forward = plane_bsdf(lobes, wi).eval(wi, wo, Transport::radiance);
      const BsdfEval reversed = plane_bsdf(lobes, wo).eval(wo, wi, Transport::importance);
      // Far out in Beckmann's tails the exponent is large: what rounding leaves of the half vector shows at 1%
      const float tolerance = 1e-2f;
      ASSERT_NEAR(forward.pdf_reverse_solid_angle, reversed.pdf_solid_angle,
                  tolerance * reversed.pdf_solid_angle + 1e-6f)
          << name;
      ASSERT_NEAR(forward.pdf_solid_angle, reversed.pdf_reverse_solid_angle,
                  tolerance * forward.pdf_solid_angle + 1e-6f)
          << name;
      compared += forward.pdf_solid_angle > 0.0f;
    }
    EXPECT_GT(compared, 30) << name;
  }
}

TEST(Sampler, importance_is_radiance_with_the_ends_swapped) {
  std::vector<std::pair<std::string, std::vector<Lobe>>> surfaces{{"mixture", mixture()}};
  for (const LobeCase& lobe_case : lobe_cases(0.4f)) surfaces.push_back({lobe_case.name, {lobe_case.lobe}});
  RandomStream random(6);
  for (const auto& [name, lobes] : surfaces)
    for (int i = 0; i < 4000; ++i) {
      const Vec3 wi = uniform_direction(random.next_2d()), wo = uniform_direction(random.next_2d());
      if (std::fabs(wi.z) < 0.02f || std::fabs(wo.z) < 0.02f) continue;
      const Color importance = plane_bsdf(lobes, wi).eval(wi, wo, Transport::importance).f_cos;
      // The camera's view of the same pair: f(wo, wi)·|wi·n|; cosines at the two ends are exchanged
      const Color radiance = plane_bsdf(lobes, wo).eval(wo, wi, Transport::radiance).f_cos * std::fabs(wo.z / wi.z);
      for (int k = 0; k < 3; ++k) ASSERT_NEAR(importance[k], radiance[k], 2e-3f * radiance[k] + 1e-6f) << name;
    }
}

TEST(Sampler, reflection_is_reciprocal_where_claimed) {
  RandomStream random(8);
  for (const LobeCase& lobe_case : lobe_cases(0.3f)) {
    if (!lobe_case.reciprocal) continue;
    for (int i = 0; i < 2000; ++i) {
      Vec3 wi = uniform_direction(random.next_2d()), wo = uniform_direction(random.next_2d());
      wi.z = std::max(std::fabs(wi.z), 0.02f), wo.z = std::max(std::fabs(wo.z), 0.02f);
      wi = normalize(wi), wo = normalize(wo);
      const float there = plane_bsdf({lobe_case.lobe}, wi).eval(wi, wo, Transport::radiance).f_cos.y / wo.z;
      const float back = plane_bsdf({lobe_case.lobe}, wo).eval(wo, wi, Transport::radiance).f_cos.y / wi.z;
      ASSERT_NEAR(there, back, 1e-3f * there + 1e-6f) << lobe_case.name;
    }
  }
}

TEST(Sampler, delta_lobes_have_probabilities_that_sum_to_one_and_agree_reversed) {
  Lobe mirror = make_lobe(LobeKind::reflection, 0.0f, 0.0f);
  mirror.weight = Color(0.5f);
  Lobe glass = make_lobe(LobeKind::glass, 0.0f, 0.0f);
  glass.eta = 1.5f;
  Lobe transparent = make_lobe(LobeKind::transparent);
  transparent.weight = Color(0.25f);
  const std::vector<Lobe> lobes{mirror, glass, transparent};
  const Vec3 wi = direction(0.9f, 0.2f);
  const Bsdf bsdf = plane_bsdf(lobes, wi);
  EXPECT_FALSE(bsdf.has_non_delta());
  std::map<std::array<int, 3>, float> probabilities;
  RandomStream random(9);
  for (int i = 0; i < 5000; ++i) {
    const BsdfSample sample = bsdf.sample(wi, random.next_1d(), random.next_2d(), Transport::radiance);
    ASSERT_NE(sample.event, k_scatter_none);
    ASSERT_TRUE(sample.event & k_scatter_delta);
    const std::array<int, 3> key{static_cast<int>(sample.event), static_cast<int>(sample.pdf_solid_angle * 1e6f),
                                 static_cast<int>(sample.wo_world.z * 1e3f)};
    probabilities[key] = sample.pdf_solid_angle;
    // The walk reversed chooses the same event with the probability that was announced
    const Bsdf other = plane_bsdf(lobes, sample.wo_world);
    bool found = false;
    for (int j = 0; j < 200 && !found; ++j) {
      const BsdfSample back = other.sample(sample.wo_world, random.next_1d(), random.next_2d(), Transport::radiance);
      if (length(back.wo_world - wi) > 1e-3f || back.event != sample.event) continue;
      if (std::fabs(back.pdf_solid_angle - sample.pdf_reverse_solid_angle) < 1e-3f) found = true;
    }
    if (i < 50) {
      ASSERT_TRUE(found) << static_cast<int>(sample.event) << " " << sample.pdf_reverse_solid_angle;
    }
  }
  float sum = 0.0f;
  for (const auto& [key, probability] : probabilities) sum += probability;
  EXPECT_NEAR(sum, 1.0f, 1e-3f);
}

}  // namespace
}  // namespace lambent
