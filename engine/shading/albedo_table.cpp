#include "engine/shading/albedo_table.h"

#include <array>

#include "engine/base/vec.h"
#include "engine/shading/fresnel.h"
#include "engine/shading/microfacet.h"

namespace lambent {
namespace {

constexpr int k_size = 32;        // cosines and alphas
constexpr int k_glass_size = 16;  // cosines, alphas and indices
constexpr float k_eta_min = 1.0f / 3.0f, k_eta_max = 3.0f;

// Nodes: both are spaced by their root, since the albedo changes fastest at grazing angles and small alpha; the cosine
// starts above 0, where the albedo is still defined.
float node_cos(int i, int size) { return std::max(1e-4f, sqr(static_cast<float>(i) / (size - 1))); }
float node_alpha(int i, int size) { return std::max(1e-3f, sqr(static_cast<float>(i) / (size - 1))); }
// Uniform in the logarithm, with 1 exactly between two nodes: there the lobe is a delta.
float node_eta(int i) {
  return k_eta_min * std::pow(k_eta_max / k_eta_min, static_cast<float>(i) / (k_glass_size - 1));
}

// Means over an R2 sequence (Roberts 2018) of sampled visible normals; f·cos/pdf = G1(other) by construction.
template <typename Estimate>
float integrate(float cos_view, float alpha, int samples, const Estimate& estimate) {
  const Microfacets facets(Distribution::ggx, alpha, alpha);
  const Vec3 w{safe_sqrt(1.0f - cos_view * cos_view), 0.0f, cos_view};
  double sum = 0.0, x = 0.5, y = 0.5;
  for (int i = 0; i < samples; ++i) {
    x += 0.7548776662466927, y += 0.5698402909980532;
    x -= std::floor(x), y -= std::floor(y);
    const Vec3 m = facets.sample_normal(w, {static_cast<float>(x), static_cast<float>(y)});
    if (dot(w, m) > 0.0f) sum += estimate(facets, w, m);
  }
  return static_cast<float>(std::clamp(sum / samples, 1e-3, 1.0));
}

float reflected(const Microfacets& facets, const Vec3& w, const Vec3& m) {
  const Vec3 r = m * (2.0f * dot(w, m)) - w;
  return r.z > 0.0f ? facets.g1(r) : 0.0f;
}

// With masking and shadowing correlated by height, G2/G1 = (1 + Λ(w)) / (1 + Λ(w) + Λ(r)) (Heitz 2014, eq. 99): what a
// walk within the microsurface leaves it with at its first bounce.
float first_bounce(const Microfacets& facets, const Vec3& w, const Vec3& m) {
  const Vec3 r = m * (2.0f * dot(w, m)) - w;
  if (r.z <= 0.0f) return 0.0f;
  const float g1_w = facets.g1(w);
  return correlated_masking(g1_w, facets.g1(r)) / g1_w;
}

float glass(const Microfacets& facets, const Vec3& w, const Vec3& m, float eta, bool correlated) {
  const float f = fresnel_dielectric(dot(w, m), eta);
  float sum = f * (correlated ? first_bounce : reflected)(facets, w, m);
  Vec3 t;
  if (f < 1.0f && refract(w, m, eta, t) && t.z < 0.0f) {
    const float g_w = facets.g1(w), g_t = facets.g1(t);
    sum += (1.0f - f) * (correlated ? correlated_masking(g_w, g_t) / g_w : g_t);
  }
  return sum;
}

struct ReflectionTable {
  std::array<float, k_size * k_size> value, first;
  std::array<float, k_size> first_mean;  // over all cosines, weighted by them
  ReflectionTable() {
    for (int a = 0; a < k_size; ++a) {
      double sum = 0.0;
      for (int c = 0; c < k_size; ++c) {
        value[a * k_size + c] = integrate(node_cos(c, k_size), node_alpha(a, k_size), 1024, reflected);
        first[a * k_size + c] = integrate(node_cos(c, k_size), node_alpha(a, k_size), 1024, first_bounce);
        const float* e = &first[a * k_size + c];
        if (c == 0) continue;
        const float from = node_cos(c - 1, k_size), to = node_cos(c, k_size);
        sum += static_cast<double>((e[-1] * from + e[0] * to) * (to - from));
      }
      first_mean[a] = static_cast<float>(std::min(sum, 1.0));
    }
  }
};
const ReflectionTable& reflection_table() {
  static const ReflectionTable table;
  return table;
}

struct GlassTable {
  std::array<float, k_glass_size * k_glass_size * k_glass_size> value;
  explicit GlassTable(bool correlated) {
    for (int e = 0; e < k_glass_size; ++e)
      for (int a = 0; a < k_glass_size; ++a)
        for (int c = 0; c < k_glass_size; ++c)
          value[(e * k_glass_size + a) * k_glass_size + c] =
              integrate(node_cos(c, k_glass_size), node_alpha(a, k_glass_size), 512,
                        [eta = node_eta(e), correlated](const Microfacets& facets, const Vec3& w, const Vec3& m) {
                          return glass(facets, w, m, eta, correlated);
                        });
  }
};

// Where a dielectric's reflectance at normal incidence is r², its index is (1 + r) / (1 − r); nodes are spaced by the
// root of r.
float node_rise_eta(int i) {
  const float r = sqr(0.97f * static_cast<float>(i) / (k_glass_size - 1));
  return (1.0f + r) / (1.0f - r);
}

struct RiseTable {
  std::array<float, k_glass_size * k_glass_size * k_glass_size> value;
  RiseTable() {
    for (int a = 0; a < k_glass_size; ++a)
      for (int c = 0; c < k_glass_size; ++c) {
        const float cosine = node_cos(c, k_glass_size), alpha = node_alpha(a, k_glass_size);
        const float all = integrate(cosine, alpha, 128, first_bounce);
        for (int e = 0; e < k_glass_size; ++e) {
          const float risen = integrate(cosine, alpha, 128, [eta = node_rise_eta(e)](const auto& f, auto& w, auto& m) {
            return fresnel_rise(dot(w, m), eta) * first_bounce(f, w, m);
          });
          value[(e * k_glass_size + a) * k_glass_size + c] = risen / all;
        }
      }
  }
};

// Position of x in [0, 1] on a grid: index and fraction.
struct Cell {
  int index;
  float fraction;
  Cell(float x, int size) {
    const float scaled = std::clamp(x, 0.0f, 1.0f) * (size - 1);
    index = std::min(static_cast<int>(scaled), size - 2);
    fraction = scaled - index;
  }
};

float bilinear(const float* table, int size, const Cell& a, const Cell& c) {
  const float* row = table + a.index * size + c.index;
  return lerp(lerp(row[0], row[1], c.fraction), lerp(row[size], row[size + 1], c.fraction), a.fraction);
}

// Of a table of that size by index, alpha and cosine.
float trilinear(const float* table, const Cell& e, float alpha, float cos_view) {
  const Cell a(std::sqrt(std::max(alpha, 0.0f)), k_glass_size), c(std::sqrt(std::max(cos_view, 0.0f)), k_glass_size);
  const float* slice = table + e.index * k_glass_size * k_glass_size;
  return lerp(bilinear(slice, k_glass_size, a, c), bilinear(slice + k_glass_size * k_glass_size, k_glass_size, a, c),
              e.fraction);
}

float look_up(const GlassTable& table, float cos_view, float alpha, float eta) {
  const float position = std::log(std::clamp(eta, k_eta_min, k_eta_max) / k_eta_min) / std::log(k_eta_max / k_eta_min);
  return trilinear(table.value.data(), Cell(position, k_glass_size), alpha, cos_view);
}

}  // namespace

float ggx_correlated_albedo(float cos_view, float alpha) {
  return bilinear(reflection_table().first.data(), k_size, Cell(std::sqrt(std::max(alpha, 0.0f)), k_size),
                  Cell(std::sqrt(std::max(cos_view, 0.0f)), k_size));
}

Color ggx_multiscatter_factor(float cos_view, float alpha, const Color& reflectance) {
  const ReflectionTable& table = reflection_table();
  const Cell a(std::sqrt(std::max(alpha, 0.0f)), k_size), c(std::sqrt(std::max(cos_view, 0.0f)), k_size);
  const float single = bilinear(table.value.data(), k_size, a, c), first = bilinear(table.first.data(), k_size, a, c);
  // Of the light that the first bounce leaves inside, each further one lets `leaving` out: a geometric series in the
  // reflectance. This share of theirs fits the walks of Cycles 3.4.1 (Heitz et al. 2016) within 1% for three
  // reflectances, roughnesses of 0.5 to 1 and cosines of 0.2 to 0.95.
  const float leaving = 1.0f - 0.4f * alpha * cos_view * (2.0f - cos_view);
  Color factor;
  for (int k = 0; k < 3; ++k)
    factor[k] =
        (first + reflectance[k] * (1.0f - first) * leaving / (1.0f - (1.0f - leaving) * reflectance[k])) / single;
  return factor;
}

Color ggx_compensation(float cos_view, float alpha, const Color& reflectance) {
  const ReflectionTable& table = reflection_table();
  const Cell a(std::sqrt(std::max(alpha, 0.0f)), k_size), c(std::sqrt(std::max(cos_view, 0.0f)), k_size);
  const float single = bilinear(table.first.data(), k_size, a, c);
  const float mean = lerp(table.first_mean[a.index], table.first_mean[a.index + 1], a.fraction);
  Color factor;
  for (int k = 0; k < 3; ++k) {
    const float further = reflectance[k] * mean / (1.0f - reflectance[k] * (1.0f - mean));
    factor[k] = 1.0f + further * (1.0f - single) / single;
  }
  return factor;
}

float ggx_fresnel_rise(float cos_view, float alpha, float eta) {
  static const RiseTable table;
  const Cell e(std::sqrt(std::fabs((eta - 1.0f) / (eta + 1.0f))) / 0.97f, k_glass_size);
  return trilinear(table.value.data(), e, alpha, cos_view);
}

float ggx_glass_albedo(float cos_view, float alpha, float eta, bool correlated) {
  // Each when it is first needed
  if (correlated) {
    static const GlassTable table(true);
    return look_up(table, cos_view, alpha, eta);
  }
  static const GlassTable table(false);
  return look_up(table, cos_view, alpha, eta);
}

}  // namespace lambent
