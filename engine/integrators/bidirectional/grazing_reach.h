// How far merging reaches on lobes that have no cosine.
//
// A photon map holds light as it falls on a surface, times the cosine. Toon and hair reflect the radiance itself, so
// that merging divides by the cosine, and photons of grazing light are few and bright. There, photons are looked for
// around the ray of light instead of around the point: those whose rays pass the point within the radius. On the
// surface that is an ellipse, longer by the cosine's inverse in the light's direction, cut off at k_longest_reach
// radii. Its area times the cosine is the same at any angle until it is cut, so that all photons count alike, and the
// more grazing, the more of them are found. Weights (MIS) go on with the circle's area: any function of the path may
// serve there.
#pragma once

#include <cmath>

#include "engine/shading/bsdf_set.h"

namespace lambent::bidirectional {

inline constexpr float k_longest_reach = 4.0f;  ///< over the merge radius; a query costs the square of it

/// Whether some lobe's value does not fall with the cosine of the light's direction.
inline bool any_without_cosine(const Bsdf& bsdf) {
  for (const Lobe& lobe : bsdf.lobes())
    if (lacks_cosine(lobe.kind)) return true;
  return false;
}

/// Area on a plane, over that of a disc of radius 1, where a ray that meets the plane with cosine `cos_light` in (0, 1]
/// passes the origin within 1, and no further than k_longest_reach from it; times that cosine. 1 until it is cut.
inline float reach_across(float cos_light) {
  const float c = cos_light, k = k_longest_reach;
  if (c * k >= 1.0f) return 1.0f;
  // An ellipse of half axes 1/c and 1 in a disc of radius k: they cross at x.
  const float x = std::sqrt((k * k - 1.0f) / (1.0f - c * c));
  const float sin_ellipse = std::fmin(c * x, 1.0f), sin_disc = std::fmin(x / k, 1.0f);
  const float across = 2.0f * (x * std::sqrt(1.0f - sin_ellipse * sin_ellipse) + std::asin(sin_ellipse) / c);
  const float ends = 2.0f * k * k * (std::acos(sin_disc) - sin_disc * std::sqrt(1.0f - sin_disc * sin_disc));
  return c * (across + ends) * k_inv_pi;
}

}  // namespace lambent::bidirectional
