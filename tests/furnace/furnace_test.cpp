// How much light every lobe returns from white surroundings, over roughness and angle.
#include <gtest/gtest.h>

#include "engine/shading/lobe_functions.h"
#include "tests/furnace/lobe_cases.h"

namespace lambent {
namespace {

struct Estimate {
  Color mean{0.0f};
  float error = 0.0f;  ///< standard error of the green channel
};

// Mean weight of samples: the directional albedo.
Estimate albedo(const std::vector<Lobe>& lobes, const Vec3& wi, int count = 40000,
                Transport transport = Transport::radiance) {
  const Bsdf bsdf = plane_bsdf(lobes, wi);
  RandomStream random(11);
  double sum[3] = {0, 0, 0}, squares = 0.0;
  for (int i = 0; i < count; ++i) {
    const float choice = random.next_1d();
    const BsdfSample sample = bsdf.sample(wi, choice, random.next_2d(), transport);
    if (sample.event == k_scatter_none) continue;
    for (int k = 0; k < 3; ++k) sum[k] += sample.weight[k];
    squares += sqr(sample.weight.y);
  }
  Estimate estimate;
  for (int k = 0; k < 3; ++k) estimate.mean[k] = static_cast<float>(sum[k] / count);
  estimate.error = static_cast<float>(std::sqrt(std::max(squares / count - sqr(estimate.mean.y), 0.0) / count));
  return estimate;
}

// The same by uniform directions over the sphere: independent of the sampler.
Estimate albedo_by_uniform_directions(const std::vector<Lobe>& lobes, const Vec3& wi, int count = 200000) {
  const Bsdf bsdf = plane_bsdf(lobes, wi);
  RandomStream random(12);
  double sum[3] = {0, 0, 0}, squares = 0.0;
  for (int i = 0; i < count; ++i) {
    const Color f = bsdf.eval(wi, uniform_direction(random.next_2d()), Transport::radiance).f_cos * (4.0f * k_pi);
    for (int k = 0; k < 3; ++k) sum[k] += f[k];
    squares += static_cast<double>(f.y) * f.y;
  }
  Estimate estimate;
  for (int k = 0; k < 3; ++k) estimate.mean[k] = static_cast<float>(sum[k] / count);
  estimate.error = static_cast<float>(std::sqrt(std::max(squares / count - sqr(estimate.mean.y), 0.0) / count));
  return estimate;
}

constexpr float k_alphas[] = {0.002f, 0.05f, 0.25f, 0.6f, 1.0f};
constexpr float k_angles[] = {0.0f, 0.5f, 1.0f, 1.4f, 1.55f};

TEST(Furnace, no_lobe_returns_more_than_it_gets) {
  for (const float alpha : k_alphas)
    for (const LobeCase& lobe_case : lobe_cases(alpha))
      for (const float angle : k_angles) {
        const Estimate estimate = albedo({lobe_case.lobe}, direction(angle, 0.4f));
        // Burley's lobes of Blender before 4.0 are known to exceed 1 at grazing angles: rough retro-reflection by up to
        // half, sheen (which lacks 1/π) by a tenth. GTR1, whose masking does not belong to it, is only used with weight
        // 0.25. Multiscatter is tabulated to about 1%.
        float bound = 1.0f;
        if (lobe_case.lobe.kind == LobeKind::principled_diffuse) bound = 1.6f;
        if (lobe_case.lobe.kind == LobeKind::principled_sheen) bound = 1.1f;
        if (lobe_case.lobe.distribution == Distribution::gtr1) bound = 1.0f / 0.25f;
        if (lobe_case.lobe.energy_compensation) bound = 1.02f;
        EXPECT_LE(estimate.mean.y, bound + 4.0f * estimate.error + 1e-4f) << lobe_case.name << " at " << angle;
      }
}

TEST(Furnace, samples_and_uniform_directions_agree_on_the_albedo) {
  for (const LobeCase& lobe_case : lobe_cases(0.5f))
    for (const float angle : {0.0f, 0.9f, 1.4f}) {
      const Vec3 wi = direction(angle, 0.4f);
      const Estimate sampled = albedo({lobe_case.lobe}, wi),
                     uniform = albedo_by_uniform_directions({lobe_case.lobe}, wi);
      EXPECT_NEAR(sampled.mean.y, uniform.mean.y, 4.5f * std::hypot(sampled.error, uniform.error) + 1e-4f)
          << lobe_case.name << " at " << angle;
    }
}

TEST(Furnace, lossless_lobes_return_everything) {
  for (const float angle : k_angles) {
    const Vec3 wi = direction(angle, 0.4f);
    for (const LobeKind kind : {LobeKind::diffuse, LobeKind::translucent, LobeKind::transparent})
      EXPECT_NEAR(albedo({make_lobe(kind)}, wi, 1000).mean.y, 1.0f, 1e-3f);
    EXPECT_NEAR(albedo({make_lobe(LobeKind::reflection, 0, 0)}, wi, 100).mean.y, 1.0f, 1e-5f);
    for (const float eta : {1.45f, 1.0f / 1.45f, 1.0f, 2.4f}) {
      Lobe glass = make_lobe(LobeKind::glass, 0, 0);
      glass.eta = eta;
      EXPECT_NEAR(albedo({glass}, wi, 1000).mean.y, 1.0f, 1e-4f) << eta;
      // Reflection and refraction as two lobes; beyond the critical angle all is reflected
      Lobe reflection = make_lobe(LobeKind::reflection, 0, 0), refraction = make_lobe(LobeKind::refraction, 0, 0);
      reflection.eta = refraction.eta = eta;
      reflection.macro_fresnel = refraction.macro_fresnel = true;
      EXPECT_NEAR(albedo({reflection, refraction}, wi, 4000).mean.y, 1.0f, 1e-3f) << eta;
    }
  }
}

TEST(Furnace, compensated_rough_diffuse_is_white_and_otherwise_between_its_albedo_and_that_of_single_scattering) {
  for (const float sigma : {0.01f, 0.3f, 1.0f})
    for (const float angle : {0.0f, 0.6f, 1.2f, 1.5f}) {
      Lobe lobe = make_lobe(LobeKind::oren_nayar);
      lobe.param = sigma;
      lobe.energy_compensation = true;
      const Vec3 wi = direction(angle, 0.4f);
      const Estimate white = albedo({lobe}, wi);
      EXPECT_NEAR(white.mean.x, 1.0f, 4.5f * white.error + 2e-3f) << sigma << " " << angle;
      lobe.f0 = lobe.weight = Color(0.5f);
      const Estimate grey = albedo({lobe}, wi);
      lobe.energy_compensation = false;
      const Estimate single = albedo({lobe}, wi);
      EXPECT_LT(grey.mean.x, 0.5f + 4.5f * grey.error) << sigma << " " << angle;
      EXPECT_GT(grey.mean.x, single.mean.x - 4.5f * (grey.error + single.error)) << sigma << " " << angle;
    }
}

TEST(Furnace, multiscatter_reflection_is_white_within_the_table) {
  for (const bool correlated : {false, true})
    for (const float alpha : {0.1f, 0.3f, 0.6f, 1.0f})
      for (const float angle : {0.0f, 0.5f, 1.0f, 1.4f}) {
        Lobe lobe = make_lobe(LobeKind::reflection, alpha, alpha);
        lobe.energy_compensation = true;
        lobe.correlated_masking = correlated;
        const Estimate estimate = albedo({lobe}, direction(angle, 0.4f));
        EXPECT_NEAR(estimate.mean.y, 1.0f, 0.015f + 4.0f * estimate.error) << correlated << alpha << " at " << angle;
      }
}

TEST(Furnace, correlated_masking_loses_less_than_separable) {
  for (const float alpha : {0.3f, 1.0f})
    for (const float angle : {0.3f, 1.2f}) {
      Lobe lobe = make_lobe(LobeKind::reflection, alpha, alpha);
      const Estimate separable = albedo({lobe}, direction(angle, 0.4f));
      lobe.correlated_masking = true;
      const Estimate correlated = albedo({lobe}, direction(angle, 0.4f));
      EXPECT_GT(correlated.mean.y, separable.mean.y) << alpha << " at " << angle;
      EXPECT_LT(correlated.mean.y, 1.0f + 4.0f * correlated.error) << alpha << " at " << angle;
    }
}

TEST(Furnace, a_clear_hair_fibre_returns_everything_and_an_absorbing_one_what_its_estimate_says_across_it) {
  for (const float roughness : {0.002f, 0.1f, 0.4f, 1.0f})
    for (const float index : {1.1f, 1.55f})
      for (const float angle : k_angles)
        for (const float phi : {0.0f, 0.4f, 0.5f * k_pi}) {
          Lobe lobe = make_lobe(LobeKind::hair_fibre, roughness, 0.3f);
          lobe.tangent = {1, 0, 0};
          lobe.param = 0.1f;
          lobe.f0 = Color(0.0f);
          lobe.f90 = Color(0.7f, index, 0.0f);
          const Vec3 wi = direction(angle, phi);
          for (const Estimate& estimate : {albedo({lobe}, wi, 1000), albedo_by_uniform_directions({lobe}, wi, 20000)}) {
            if (roughness < 0.05f && estimate.error > 0.01f) continue;  // uniform directions miss narrow lobes
            EXPECT_NEAR(estimate.mean.y, 1.0f, 2e-3f + 4.5f * estimate.error)
                << roughness << " " << index << " at " << angle << " " << phi;
          }
          if (phi < 1.0f) continue;
          for (const float absorption : {0.1f, 0.5f, 2.0f}) {
            lobe.f0 = Color(absorption);
            const Estimate dark = albedo({lobe}, wi, 1000);
            EXPECT_NEAR(dark.mean.y, HairFibre::albedo(lobe, std::cos(angle)).y, 2e-3f + 4.5f * dark.error)
                << roughness << " " << index << " " << angle << " " << absorption;
          }
        }
}

// Facets' compensation for what they scatter more than once, and what is assumed of the light that stays inside, leave
// the model a few hundredths off.
TEST(Furnace, a_clear_rough_hair_returns_about_everything) {
  for (const float roughness : {0.05f, 0.3f, 0.6f})
    for (const float aspect : {1.0f, 0.85f})
      for (const float phi : {0.0f, 0.5f * k_pi}) {
        Lobe lobe = make_lobe(LobeKind::hair_microfacets, roughness, aspect);
        lobe.tangent = {1, 0, 0};
        lobe.param = 0.05f;
        lobe.eta = 1.55f;
        lobe.f0 = Color(0.0f);
        lobe.f90 = Color(1.0f);
        const Estimate sampled = albedo({lobe}, direction(0.8f, phi), 4000);
        EXPECT_NEAR(sampled.mean.y, 1.0f, 0.03f + 4.5f * sampled.error) << roughness << " " << aspect << " " << phi;
        const Estimate uniform = albedo_by_uniform_directions({lobe}, direction(0.8f, phi), 20000);
        EXPECT_NEAR(sampled.mean.y, uniform.mean.y, 4.5f * std::hypot(sampled.error, uniform.error));
      }
}

TEST(Furnace, sheen_returns_the_albedo_that_its_layer_takes) {
  for (const float roughness : {0.1f, 0.4f, 1.0f})
    for (const float angle : {0.0f, 0.7f, 1.4f}) {
      const Estimate estimate = albedo({make_lobe(LobeKind::sheen, roughness, roughness)}, direction(angle, 0.4f));
      const float expected = SheenFit(std::cos(angle), roughness).albedo;
      EXPECT_NEAR(estimate.mean.y, expected, 2e-3f + 4.0f * estimate.error) << roughness << " at " << angle;
    }
}

TEST(Furnace, multiscatter_glass_is_white_within_the_table) {
  for (const bool correlated : {false, true})
    for (const float eta : {1.45f, 1.0f / 1.45f})
      for (const float alpha : {0.1f, 0.3f, 0.6f, 1.0f})
        for (const float angle : {0.0f, 0.5f, 1.0f, 1.4f}) {
          Lobe lobe = make_lobe(LobeKind::glass, alpha, alpha);
          lobe.eta = eta;
          lobe.energy_compensation = true;
          lobe.correlated_masking = correlated;
          const Estimate estimate = albedo({lobe}, direction(angle, 0.4f));
          EXPECT_NEAR(estimate.mean.y, 1.0f, 0.03f + 4.0f * estimate.error)
              << correlated << eta << " " << alpha << " at " << angle;
        }
}

TEST(Furnace, roughness_goes_over_into_the_mirror_without_a_step) {
  // Just above the delta threshold the rough lobe returns what the mirror does
  const float alpha = 1.2f * k_delta_alpha;
  for (const float angle : {0.0f, 0.7f, 1.3f}) {
    const Vec3 wi = direction(angle, 0.4f);
    for (const Distribution distribution : {Distribution::ggx, Distribution::beckmann})
      EXPECT_NEAR(albedo({make_lobe(LobeKind::reflection, alpha, alpha, distribution)}, wi).mean.y, 1.0f, 2e-3f);
    for (const float eta : {1.45f, 1.0f / 1.45f}) {
      Lobe rough = make_lobe(LobeKind::glass, alpha, alpha), smooth = make_lobe(LobeKind::glass, 0, 0);
      rough.eta = smooth.eta = eta;
      const Estimate a = albedo({rough}, wi), b = albedo({smooth}, wi);
      EXPECT_NEAR(a.mean.y, b.mean.y, 4.0f * (a.error + b.error) + 3e-3f) << eta << " at " << angle;
    }
  }
}

TEST(Furnace, refraction_without_change_of_index_goes_straight_on) {
  for (const float alpha : {0.0f, 0.3f, 1.0f}) {
    Lobe lobe = make_lobe(LobeKind::refraction, alpha, alpha);
    lobe.eta = 1.0f;
    const Vec3 wi = direction(0.8f, 0.4f);
    const Bsdf bsdf = plane_bsdf({lobe}, wi);
    const BsdfSample sample = bsdf.sample(wi, 0.5f, {0.3f, 0.6f}, Transport::radiance);
    EXPECT_LT(length(sample.wo_world + wi), 1e-5f);
    EXPECT_NEAR(sample.weight.y, 1.0f, 1e-5f);
    EXPECT_EQ(sample.event, k_scatter_glossy | k_scatter_transmission | k_scatter_delta);
  }
}

TEST(Furnace, what_goes_into_smooth_glass_as_importance_comes_out_unchanged) {
  // In at eta and out at 1/eta: the scale of importance by n² cancels, leaving the transmittances
  Lobe glass = make_lobe(LobeKind::refraction, 0, 0);
  glass.eta = 1.5f;
  const Vec3 wi = direction(0.6f, 0.0f);
  for (const Transport transport : {Transport::radiance, Transport::importance}) {
    const BsdfSample in = plane_bsdf({glass}, wi).sample(wi, 0.5f, {0.5f, 0.5f}, transport);
    const Vec3 inside = in.wo_world * -1.0f;  // seen from within at the far side of a slab
    const Vec3 wi_out = {inside.x, inside.y, inside.z};
    Lobe back = glass;
    back.eta = 1.0f / glass.eta;
    const BsdfSample out = plane_bsdf({back}, wi_out).sample(wi_out, 0.5f, {0.5f, 0.5f}, transport);
    EXPECT_NEAR(in.weight.y * out.weight.y, 1.0f, 1e-4f);
  }
}

TEST(Furnace, dielectric_slab_reflects_as_the_closed_form_says) {
  // Fresnel at normal incidence, both ways, and Brewster's angle
  EXPECT_NEAR(fresnel_dielectric(1.0f, 1.5f), 0.04f, 1e-6f);
  EXPECT_NEAR(fresnel_dielectric(1.0f, 1.0f / 1.5f), 0.04f, 1e-6f);
  const float brewster = std::atan(1.5f);
  const float cos_t = std::sqrt(1.0f - sqr(std::sin(brewster) / 1.5f));
  const float s = sqr((std::cos(brewster) - 1.5f * cos_t) / (std::cos(brewster) + 1.5f * cos_t));
  EXPECT_NEAR(fresnel_dielectric(std::cos(brewster), 1.5f), 0.5f * s, 1e-5f);
  EXPECT_EQ(fresnel_dielectric(0.1f, 1.0f / 1.5f), 1.0f);
  EXPECT_EQ(fresnel_dielectric(0.5f, 1.0f), 0.0f);
}

}  // namespace
}  // namespace lambent
