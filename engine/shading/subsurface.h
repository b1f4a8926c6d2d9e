// The medium under a surface: from the surface's colour and radius to what a random walk needs. The walk itself:
// engine/path/subsurface_walk.h.
//
// Methods and their fits are those of Cycles, so that materials look the same: Chiang, Kutz & Burley 2016, "Practical
// and Controllable Subsurface Scattering for Production Path Tracing"; Wrenninge, Villemin & Hery 2017, "Path Traced
// Subsurface Scattering using Anisotropic Phase Functions and Non-Exponential Free Flights"; d'Eon 2022, "A
// Hitchhiker's Guide to Multiple Scattering", eq. 53.7.
#pragma once

#include "engine/shading/lobe.h"

namespace lambent {

/// Smaller mean free paths, m, are a diffuse surface's.
inline constexpr float k_least_subsurface_radius_m = 1e-8f;

/// Mean free path by channel, m, of a node's radius. @param albedo of the surface, in [0, 1] @param ior above 1
Color subsurface_mean_free_path(SubsurfaceMethod method, const Color& radius_m, const Color& albedo, float ior);

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
