// Nothing that comes in makes something non-finite come out.
#include <gtest/gtest.h>

#include "engine/shading/closures.h"
#include "tests/furnace/lobe_cases.h"

namespace lambent {
namespace {

constexpr float k_nan = std::numeric_limits<float>::quiet_NaN();
const float k_extremes[] = {0.0f,      -1.0f,  1.0f, 1e-30f,     1e30f,       1e-4f, 3e-4f,
                            0.999999f, -1e30f, 5.0f, k_infinity, -k_infinity, k_nan};

void expect_sane(const Bsdf& bsdf, const Vec3& wi, const Vec3& wo, RandomStream& random, const std::string& name) {
  for (const Transport transport : {Transport::radiance, Transport::importance}) {
    const BsdfEval eval = bsdf.eval(wi, wo, transport);
    ASSERT_TRUE(is_finite(eval.f_cos)) << name;
    ASSERT_TRUE(std::isfinite(eval.pdf_solid_angle) && std::isfinite(eval.pdf_reverse_solid_angle)) << name;
    ASSERT_GE(min_component(eval.f_cos), 0.0f) << name;
    ASSERT_GE(eval.pdf_solid_angle, 0.0f) << name;
    ASSERT_GE(eval.pdf_reverse_solid_angle, 0.0f) << name;
    const float choice = random.next_1d();
    const BsdfSample sample = bsdf.sample(wi, choice, random.next_2d(), transport);
    if (sample.event == k_scatter_none) continue;
    ASSERT_TRUE(is_finite(sample.weight) && is_finite(sample.wo_world)) << name;
    ASSERT_GE(min_component(sample.weight), 0.0f) << name;
    if (!(sample.event & k_scatter_subsurface)) {
      ASSERT_NEAR(length(sample.wo_world), 1.0f, 1e-4f) << name;
    }
    ASSERT_GT(sample.pdf_solid_angle, 0.0f) << name;
    ASSERT_TRUE(std::isfinite(sample.pdf_solid_angle) && std::isfinite(sample.pdf_reverse_solid_angle)) << name;
  }
  ASSERT_TRUE(is_finite(bsdf.albedo(wi))) << name;
}

Vec3 extreme_direction(RandomStream& random) {
  Vec3 w = uniform_direction(random.next_2d());
  const float choice = random.next_1d();
  if (choice < 0.2f) w.z *= 1e-4f;
  if (choice < 0.1f) w.z *= 1e-6f;
  if (choice > 0.95f) w = {0, 0, w.z < 0.0f ? -1.0f : 1.0f};
  return normalize(w);
}

TEST(Extremes, lobes_with_any_parameters_stay_finite_and_not_negative) {
  RandomStream random(21);
  const auto extreme = [&] { return k_extremes[static_cast<size_t>(random.next_1d() * std::size(k_extremes))]; };
  for (int i = 0; i < 60000; ++i) {
    Lobe lobe;
    lobe.kind = static_cast<LobeKind>(i % (static_cast<int>(LobeKind::thin_transmission) + 1));
    lobe.distribution = static_cast<Distribution>(static_cast<int>(random.next_1d() * 3));
    lobe.fresnel = static_cast<FresnelMode>(static_cast<int>(random.next_1d() * 7));
    lobe.macro_fresnel = random.next_1d() < 0.3f;
    lobe.energy_compensation = random.next_1d() < 0.3f;
    lobe.correlated_masking = random.next_1d() < 0.5f;
    lobe.alpha_x = extreme(), lobe.alpha_y = extreme(), lobe.eta = extreme(), lobe.param = extreme();
    lobe.film_nm = extreme() * (random.next_1d() < 0.5f ? 500.0f : 1.0f), lobe.film_eta = extreme();
    lobe.f0 = Color(extreme(), extreme(), extreme());
    lobe.f90 = Color(extreme(), extreme(), extreme());
    lobe.weight = Color(random.next_1d() < 0.1f ? extreme() : 0.8f);
    if (random.next_1d() < 0.2f) lobe.n = uniform_direction(random.next_2d());
    if (random.next_1d() < 0.2f) lobe.tangent = {extreme(), extreme(), 1.0f};
    const Vec3 wi = extreme_direction(random), wo = extreme_direction(random);
    Bsdf bsdf;
    bsdf.begin(plane_point(wi));
    bsdf.add(lobe);
    if (i % 3 == 0) bsdf.add(make_lobe(LobeKind::diffuse));
    expect_sane(bsdf, wi, wo, random,
                "lobe kind " + std::to_string(static_cast<int>(lobe.kind)) + " case " + std::to_string(i));
    if (HasFatalFailure()) return;
  }
}

TEST(Extremes, closures_with_any_parameters_stay_finite_and_not_negative) {
  RandomStream random(22);
  const auto extreme = [&] { return k_extremes[static_cast<size_t>(random.next_1d() * std::size(k_extremes))]; };
  for (int i = 0; i < 40000; ++i) {
    const auto kind = static_cast<ClosureKind>(i % (static_cast<int>(ClosureKind::emission) + 1));
    float parameters[k_max_closure_parameters];
    for (float& p : parameters) p = random.next_1d() < 0.5f ? extreme() : random.next_1d();
    const Vec3 wi = extreme_direction(random), wo = extreme_direction(random);
    LobeTemplates templates;
    make_lobes(kind, static_cast<GlossModel>(i % 4), parameters, wi.z < 0.0f, std::fabs(wi.z), templates);
    Bsdf bsdf;
    bsdf.begin(plane_point(wi));
    for (int k = 0; k < templates.count; ++k) {
      Lobe lobe = templates.entries[k].lobe;
      lobe.n = {0, 0, wi.z < 0.0f ? -1.0f : 1.0f};
      bsdf.add(lobe);
    }
    expect_sane(bsdf, wi, wo, random,
                "closure " + std::to_string(static_cast<int>(kind)) + " case " + std::to_string(i));
    if (HasFatalFailure()) return;
  }
}

TEST(Extremes, more_lobes_than_fit_keep_the_albedo) {
  Bsdf bsdf;
  bsdf.begin(plane_point({0, 0, 1}));
  Lobe lobe = make_lobe(LobeKind::reflection, 0.3f, 0.3f);
  lobe.weight = Color(0.02f);
  for (int i = 0; i < 40; ++i) bsdf.add(lobe);
  EXPECT_LE(bsdf.lobes().size(), static_cast<size_t>(k_max_lobes));
  EXPECT_NEAR(bsdf.albedo({0, 0, 1}).x, 0.8f, 1e-4f);
}

TEST(Extremes, valid_reflection_normal_mirrors_the_view_above_the_surface) {
  RandomStream random(23);
  for (int i = 0; i < 100000; ++i) {
    const Vec3 ng(0, 0, 1);
    Vec3 wi = extreme_direction(random), n = extreme_direction(random);
    wi.z = std::fabs(wi.z), n.z = std::fabs(n.z);
    const Vec3 valid = valid_reflection_normal(ng, wi, n);
    ASSERT_NEAR(length(valid), 1.0f, 1e-4f);
    const Vec3 mirrored = valid * (2.0f * dot(valid, wi)) - wi;
    ASSERT_GE(mirrored.z, -5e-4f);  // up to rounding
  }
}

}  // namespace
}  // namespace lambent
