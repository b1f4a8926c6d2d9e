// The medium under a surface: from the surface's colour and radius to what a random walk needs. The walk itself:
// engine/path/subsurface_walk.h.
//
// Methods and their fits are those of Cycles, so that materials look the same: Chiang, Kutz & Burley 2016, "Practical
// and Controllable Subsurface Scattering for Production Path Tracing"; Wrenninge, Villemin & Hery 2017, "Path Traced
// Subsurface Scattering using Anisotropic Phase Functions and Non-Exponential Free Flights"; d'Eon 2022, "A
// Hitchhiker's Guide to Multiple Scattering", eq. 53.7.
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/shading/lobe.h"

namespace lambent {

/// Smaller mean free paths, m, are a diffuse surface's.
inline constexpr float k_least_subsurface_radius_m = 1e-8f;

/// Mean free path (burley: scale of the profile) by channel, m, of a node's radius. @param albedo of the surface, in
/// [0, 1] @param ior above 1
Color subsurface_mean_free_path(SubsurfaceMethod method, const Color& radius_m, const Color& albedo, float ior);

/// Christensen & Burley 2015, "Approximate Reflectance Profiles for Efficient Subsurface Scattering", eq. 3, cut off at
/// 16 scales, where 0.4% of it is missing, and normalised. @param scale_m d of the paper, above 0
class BurleyProfile {
 public:
  explicit BurleyProfile(float scale_m) : d_(scale_m) {}
  float reach_m() const { return 16.0f * d_; }
  /// Of the distance, per metre: 2πr·R(r).
  float density(float r_m) const {
    if (!(r_m < reach_m())) return 0.0f;
    const float third = std::exp(r_m * (-1.0f / 3.0f) / d_);
    return (third * third * third + third) / (4.0f * k_within_reach * d_);
  }
  /// A distance. Source: Golubev 2019, "Efficient Screen-Space Subsurface Scattering Using Burley's Normalized
  /// Diffusion in Real-Time": the inverse in closed form. @param u in [0, 1]
  float sample(float u) const {
    const float left = 1.0f - u * k_within_reach;
    const float g = 1.0f + 4.0f * left * (2.0f * left + std::sqrt(1.0f + 4.0f * left * left));
    const float root = std::cbrt(g);
    return std::clamp(3.0f * d_ * std::log((1.0f + root + 1.0f / root) / (4.0f * left)), 0.0f, reach_m());
  }

 private:
  static constexpr float k_within_reach = 0.99637901f;  ///< 1 − exp(−16)/4 − 3·exp(−16/3)/4
  float d_;
};

/// A homogeneous medium.
struct SubsurfaceMedium {
  Color extinction{0.0f};  ///< m⁻¹
  Color albedo{0.0f};      ///< of one scattering event
  Color weight{1.0f};      ///< of the walk: albedos below the least one that walks are made for
  float anisotropy = 0.0f;
};
/// Of a subsurface lobe. @param least_m mean free paths are at least this
SubsurfaceMedium subsurface_medium(const Lobe& lobe, float least_m);

}  // namespace lambent
