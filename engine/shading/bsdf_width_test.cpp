// Lobes told apart by how narrow they are.
#include <gtest/gtest.h>

#include "engine/sampling/sampler.h"
#include "engine/sampling/warp.h"
#include "engine/shading/bsdf_set.h"
#include "engine/shading/lobe.h"
#include "engine/shading/shading_point.h"

namespace lambent {
namespace {

const Vec3 k_wi = normalize(Vec3(0.4f, 0.1f, 0.9f));

Bsdf of(const std::vector<std::pair<LobeKind, float>>& kinds_and_alphas) {
  ShadingPoint point;
  point.ng_world = point.ns_world = Vec3(0, 0, 1);
  point.wi_world = k_wi;
  Bsdf bsdf;
  bsdf.begin(point);
  float weight = 0.3f;
  for (const auto& [kind, alpha] : kinds_and_alphas) {
    Lobe lobe;
    lobe.kind = kind;
    lobe.n = point.ns_world;
    lobe.weight = Color(weight, 0.2f, 0.1f);
    lobe.alpha_x = lobe.alpha_y = alpha;
    lobe.eta = 1.5f;
    bsdf.add(lobe);
    weight += 0.1f;
  }
  return bsdf;
}

const std::vector<Bsdf> k_mixed{
    of({{LobeKind::diffuse, 1.0f}, {LobeKind::reflection, 0.2f}}),
    of({{LobeKind::reflection, 0.0f}, {LobeKind::reflection, 0.1f}, {LobeKind::reflection, 0.6f}}),
    of({{LobeKind::glass, 0.15f}, {LobeKind::glass, 0.5f}, {LobeKind::transparent, 0.0f}}),
};

TEST(LobeWidth, narrow_are_microfacets_of_small_roughness_that_are_no_deltas) {
  const auto narrow = [](LobeKind kind, float alpha) { return of({{kind, alpha}}).has_narrow(); };
  for (const LobeKind kind : {LobeKind::reflection, LobeKind::refraction, LobeKind::glass}) {
    EXPECT_TRUE(narrow(kind, 0.01f));
    EXPECT_TRUE(narrow(kind, 0.29f));
    EXPECT_FALSE(narrow(kind, 0.31f));
    EXPECT_FALSE(narrow(kind, 0.0f));
  }
  EXPECT_FALSE(narrow(LobeKind::diffuse, 0.01f));
  EXPECT_FALSE(narrow(LobeKind::sheen, 0.01f));
}

TEST(LobeWidth, narrow_and_wide_lobes_have_together_what_all_have) {
  RandomStream random(1);
  for (const Bsdf& bsdf : k_mixed) {
    ASSERT_TRUE(bsdf.has_narrow());
    for (int i = 0; i < 1000; ++i) {
      const Vec3 wo = sample_uniform_sphere(random.next_2d());
      const BsdfEval all = bsdf.eval(k_wi, wo, Transport::radiance);
      EvalParts parts;
      const BsdfEval wide = bsdf.eval(k_wi, wo, Transport::radiance, LobeWidth::wide, nullptr);
      const BsdfEval narrow = bsdf.eval(k_wi, wo, Transport::radiance, LobeWidth::narrow, &parts);
      for (int c = 0; c < 3; ++c) {
        ASSERT_NEAR(wide.f_cos[c] + narrow.f_cos[c], all.f_cos[c], 1e-5f * (all.f_cos[c] + 1e-3f));
        ASSERT_NEAR(parts.f_cos[0][c] + parts.f_cos[1][c] + parts.f_cos[2][c], narrow.f_cos[c], 1e-6f);
      }
      ASSERT_NEAR(wide.pdf_solid_angle + narrow.pdf_solid_angle, all.pdf_solid_angle,
                  1e-5f * (all.pdf_solid_angle + 1e-3f));
      ASSERT_NEAR(wide.pdf_reverse_solid_angle + narrow.pdf_reverse_solid_angle, all.pdf_reverse_solid_angle,
                  1e-5f * (all.pdf_reverse_solid_angle + 1e-3f));
    }
  }
}

// What samples bring that keep their width is what all samples bring of that width's part of f.
TEST(LobeWidth, samples_that_keep_their_width_have_the_expectation_of_its_lobes) {
  constexpr int k_count = 200'000;
  for (const Bsdf& bsdf : k_mixed) {
    RandomStream random(2);
    std::array<double, 2> difference{}, squares{}, brought{};
    for (int i = 0; i < k_count; ++i) {
      BsdfSample sample = bsdf.sample(k_wi, random.next_1d(), random.next_2d(), Transport::radiance);
      if (sample.event == k_scatter_none || (sample.event & k_scatter_delta)) continue;
      const float pdf = sample.pdf_solid_angle;
      const LobeWidth width = bsdf.keep_width(k_wi, Transport::radiance, sample, nullptr);
      for (const LobeWidth one : {LobeWidth::narrow, LobeWidth::wide}) {
        const BsdfEval part = bsdf.eval(k_wi, sample.wo_world, Transport::radiance, one, nullptr);
        const double by_all = static_cast<double>(part.f_cos.x / pdf);
        const double by_own = one == width ? static_cast<double>(sample.weight.x) : 0.0;
        const size_t at = one == LobeWidth::wide ? 1 : 0;
        difference[at] += by_own - by_all;
        squares[at] += (by_own - by_all) * (by_own - by_all);
        brought[at] += by_own;
        if (one == width) {
          ASSERT_NEAR(sample.pdf_solid_angle, part.pdf_solid_angle, 1e-5f * part.pdf_solid_angle);
        }
      }
    }
    for (const size_t at : {0u, 1u}) {
      EXPECT_GT(brought[at], 0.02 * k_count);
      EXPECT_NEAR(difference[at], 0.0, 5.0 * std::sqrt(squares[at])) << at << ", of " << brought[at];
    }
  }
}

}  // namespace
}  // namespace lambent
