#include "engine/lights/environment.h"

#include <algorithm>
#include <cmath>

#include "engine/sampling/sampler.h"
#include "engine/sampling/warp.h"

namespace lambent {

Vec2 equirectangular_of_direction(const Vec3& d) {
  const float u = 0.5f - std::atan2(d.y, d.x) * (0.5f * k_inv_pi);
  // Polar angle by its tangent: exact near the poles, where the arc cosine is not.
  const float v = 1.0f - std::atan2(std::sqrt(d.x * d.x + d.y * d.y), d.z) * k_inv_pi;
  return {std::clamp(u, 0.0f, k_one_minus_epsilon), std::clamp(v, 0.0f, k_one_minus_epsilon)};
}

Vec3 direction_of_equirectangular(const Vec2& uv) {
  const float phi = (0.5f - uv.x) * 2.0f * k_pi, theta = (1.0f - uv.y) * k_pi;
  const float sin_theta = std::sin(theta);
  return {sin_theta * std::cos(phi), sin_theta * std::sin(phi), std::cos(theta)};
}

namespace {

/// Largest difference of luminance, of its greatest value, in a world that counts as even: rounding of its evaluation.
constexpr float k_even_variation = 1e-4f;

}  // namespace

Environment::Environment(EnvironmentLight light) : light_(std::move(light)) {
  const size_t pixels =
      static_cast<size_t>(std::max(light_.width, 0)) * static_cast<size_t>(std::max(light_.height, 0));
  mean_luminance_ = std::fabs(static_cast<double>(luminance(light_.radiance)));
  if (pixels == 0 || light_.luminance.size() < pixels) return;
  const auto [least, greatest] =
      std::minmax_element(light_.luminance.begin(), light_.luminance.begin() + static_cast<std::ptrdiff_t>(pixels));
  const float half = 0.5f * std::min(light_.sun_angle_rad, 2.0f * k_pi);
  const bool has_sun = half > 0.0f && light_.sun_luminance > 0.0f && std::isfinite(light_.sun_luminance);
  if (!has_sun && std::isfinite(*least) && *greatest - *least <= k_even_variation * std::fabs(*greatest)) {
    mean_luminance_ = std::fabs(static_cast<double>(*greatest));
    light_.luminance = {};  // one number says it all
    return;
  }
  is_even_ = false;
  // Weight by the solid angle of each row; sum the estimates for the mean.
  std::vector<float> weights(pixels);
  double sum = 0.0, weight_sum = 0.0;
  for (int y = 0; y < light_.height; ++y) {
    const double sin_theta = std::sin(std::numbers::pi * (y + 0.5) / light_.height);
    for (int x = 0; x < light_.width; ++x) {
      const size_t i = static_cast<size_t>(y) * static_cast<size_t>(light_.width) + static_cast<size_t>(x);
      const double value =
          std::isfinite(light_.luminance[i]) ? std::fabs(static_cast<double>(light_.luminance[i])) : 0.0;
      weights[i] = static_cast<float>(value * sin_theta);
      sum += value * sin_theta;
      weight_sum += sin_theta;
    }
  }
  mean_luminance_ = sum / weight_sum;
  if (has_sun) {
    sun_one_minus_cos_ = one_minus_cos_of_angle(half);
    // |d - s|² = 2 (1 - cos): without the cancellation of the cosine's difference from 1. Wider by the rounding of unit
    // vectors: a direction that was sampled on the rim must not count as one of the map's, which is a firefly. What
    // little of the sky that takes in is sampled by the map all the same.
    constexpr float k_rounding = 4e-7f;
    sun_chord_squared_ = sqr(std::sqrt(2.0f * sun_one_minus_cos_) + k_rounding);
    sun_frame_ = Frame::from_normal(light_.sun_direction_world);
    // Means over the sphere, of which the disc is this share
    const double sun = 0.5 * static_cast<double>(sun_one_minus_cos_) * static_cast<double>(light_.sun_luminance);
    prob_sun_ = mean_luminance_ > 0.0 ? static_cast<float>(sun / (sun + mean_luminance_)) : 1.0f;
    mean_luminance_ += sun;
  }
  distribution_ = Distribution2D(weights, light_.width, light_.height);
  light_.luminance = {};  // the distribution has it now
}

Vec3 Environment::sample(const Vec3& n, const Vec2& u, float& pdf_solid_angle) const {
  if (is_even_) {
    if (length_squared(n) > 0.0f) {
      const Vec3 local = sample_cosine_hemisphere(u);
      pdf_solid_angle = pdf_solid_angle_cosine_hemisphere(local.z);
      return Frame::from_normal(n).to_world(local);
    }
    pdf_solid_angle = k_pdf_solid_angle_uniform_sphere;
    return sample_uniform_sphere(u);
  }
  if (prob_sun_ > 0.0f) {
    ReusedNumber u_first(u);
    const double prob = static_cast<double>(prob_sun_);
    const bool chosen = u_first.value() < prob;
    u_first.stretch(chosen ? 0.0 : prob, chosen ? prob : 1.0 - prob);
    const Vec2 rest(u_first.rest(), u.y);
    const Vec3 direction = chosen ? normalize(sun_frame_.to_world(sample_cone(rest, sun_one_minus_cos_)))
                                  : direction_of_equirectangular(distribution_.sample(rest, nullptr));
    pdf_solid_angle = this->pdf_solid_angle(n, direction);
    return direction;
  }
  float pdf_uv = 0.0f;
  const Vec2 uv = distribution_.sample(u, &pdf_uv);
  const Vec3 direction = direction_of_equirectangular(uv);
  const float sin_theta = std::sqrt(direction.x * direction.x + direction.y * direction.y);
  // d(solid angle) = 2 pi² sin(theta) du dv.
  pdf_solid_angle = sin_theta > 0.0f ? pdf_uv / (2.0f * k_pi * k_pi * sin_theta) : 0.0f;
  return direction;
}

float Environment::pdf_solid_angle(const Vec3& n, const Vec3& direction) const {
  if (is_even_)
    return length_squared(n) > 0.0f ? pdf_solid_angle_cosine_hemisphere(dot(n, direction))
                                    : k_pdf_solid_angle_uniform_sphere;
  const float sin_theta = std::sqrt(direction.x * direction.x + direction.y * direction.y);
  const float of_map =
      sin_theta > 0.0f ? distribution_.pdf(equirectangular_of_direction(direction)) / (2.0f * k_pi * k_pi * sin_theta)
                       : 0.0f;
  if (!(prob_sun_ > 0.0f)) return of_map;
  return (1.0f - prob_sun_) * of_map +
         (in_sun(direction) ? prob_sun_ * pdf_solid_angle_cone(sun_one_minus_cos_) : 0.0f);
}

bool Environment::in_sun(const Vec3& direction) const {
  return length_squared(direction - light_.sun_direction_world) <= sun_chord_squared_;
}

}  // namespace lambent
