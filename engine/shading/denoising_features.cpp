#include "engine/shading/denoising_features.h"

#include <algorithm>
#include <cmath>

#include "engine/shading/lobe_functions.h"

namespace lambent {

namespace {

constexpr float k_blended_alpha = 0.15f, k_blended_rest = 0.5f;
constexpr float k_at_once_alpha = 0.075f, k_at_once_rest = 0.25f;

/// Smoothly from 0 at 0 to 1 at `end`.
float smooth_step(float value, float end) {
  const float t = std::clamp(value / end, 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

/// 1 of lobes without one.
float alpha_of(const Lobe& lobe) {
  if (!is_microfacet(lobe.kind)) return 1.0f;
  return is_delta(lobe) ? 0.0f : std::sqrt(lobe.alpha_x * lobe.alpha_y);
}

}  // namespace

SpecularFeatures specular_features(const Bsdf& bsdf, const Vec3& wi_world) {
  SpecularFeatures result;
  float weights = 0.0f;
  const Color* albedos = bsdf.lobe_albedos(wi_world);
  for (const Lobe& lobe : bsdf.lobes()) {
    const Color& albedo = *albedos++;
    if (goes_straight(lobe.kind)) continue;
    const float alpha = alpha_of(lobe);
    const float weight = average(albedo);
    result.albedo += albedo * sharpness(lobe, SharpRule::blended);
    result.roughness += weight * std::sqrt(alpha);
    weights += weight;
  }
  if (weights > 0.0f) result.roughness /= weights;
  return result;
}

float sharpness(const Lobe& lobe, SharpRule rule) {
  if (goes_straight(lobe.kind)) return 1.0f;
  const float alpha = alpha_of(lobe);
  if (rule == SharpRule::at_once) return alpha > k_at_once_alpha ? 0.0f : 1.0f;
  return 1.0f - smooth_step(alpha, k_blended_alpha);
}

SurfaceFeatures surface_features(const Bsdf& bsdf, const ShadingPoint& point, SharpRule rule) {
  SurfaceFeatures result;
  float all = 0.0f, straight = 0.0f, sharp = 0.0f;
  const Color* albedos = bsdf.lobe_albedos(point.wi_world);
  for (const Lobe& lobe : bsdf.lobes()) {
    const bool is_straight = goes_straight(lobe.kind);
    const Color& albedo = *albedos++;
    const float weight = average(albedo);
    all += weight;
    if (is_straight) {
      straight += weight;
      if (rule == SharpRule::at_once) result.normal_world += point.ns_world * weight;
      continue;
    }
    result.normal_world += lobe.n * weight;
    const float sharp_share = sharpness(lobe, rule);
    sharp += weight * sharp_share;
    // Before 4.0 Cycles has retro-reflection in the diffuse lobe's albedo already.
    if (sharp_share < 1.0f && lobe.kind != LobeKind::principled_retro) result.albedo += albedo * (1.0f - sharp_share);
  }
  const float opaque = all - straight;
  const float normals = rule == SharpRule::at_once ? all : opaque;
  if (!(normals > 0.0f)) return result;
  result.normal_world /= normals;
  result.opaque = opaque / all;
  if (rule == SharpRule::at_once)
    result.shown = opaque - sharp > k_at_once_rest * all ? 1.0f : 0.0f;
  else
    result.shown = smooth_step((opaque - sharp) / opaque, k_blended_rest);
  return result;
}

}  // namespace lambent
