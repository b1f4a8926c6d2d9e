#include "engine/shading/denoising_features.h"

#include <algorithm>
#include <cmath>

#include "engine/shading/lobe_functions.h"

namespace lambent {

namespace {

constexpr float k_sharp_alpha = 0.15f;

/// 1 at alpha 0, smoothly 0 at k_sharp_alpha.
float sharpness(float alpha) {
  const float t = std::clamp(alpha / k_sharp_alpha, 0.0f, 1.0f);
  return 1.0f - t * t * (3.0f - 2.0f * t);
}

}  // namespace

SpecularFeatures specular_features(const Bsdf& bsdf, const Vec3& wi_world) {
  SpecularFeatures result;
  float weights = 0.0f;
  for (const Lobe& lobe : bsdf.lobes()) {
    if (lobe.kind == LobeKind::transparent || lobe.kind == LobeKind::portal) continue;
    const Color albedo = lobe.weight * lobe_albedo(lobe, dot(lobe.n, wi_world));
    const float alpha = !is_microfacet(lobe.kind) ? 1.0f
                        : is_delta(lobe)          ? 0.0f
                                                  : std::sqrt(lobe.alpha_x * lobe.alpha_y);
    const float weight = average(albedo);
    result.albedo += albedo * sharpness(alpha);
    result.roughness += weight * std::sqrt(alpha);
    weights += weight;
  }
  if (weights > 0.0f) result.roughness /= weights;
  return result;
}

}  // namespace lambent
