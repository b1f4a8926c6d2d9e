// How much a rough lobe reflects by single scattering: what multiscatter GGX restores.
#pragma once

#include "engine/base/vec.h"

namespace lambent {

/// Directional albedo of single-scattering GGX with reflectance 1 and masking correlated by height. @param cos_view in
/// [0, 1] @param alpha in [0, 1]. In (0, 1]. Bilinear in a table that is integrated once per process on first use
/// (20 ms); error below 0.3%.
float ggx_correlated_albedo(float cos_view, float alpha);

/// What multiscatter GGX reflects in all over what single scattering with separable masking does, where each facet
/// reflects `reflectance` in [0, 1] of the light. @param cos_view, alpha as above.
Color ggx_multiscatter_factor(float cos_view, float alpha, const Color& reflectance);
/// The same for masking correlated by height, as Cycles has it since 4.0: what single scattering loses comes back
/// coloured by the mean reflectance (Kulla & Conty 2017; Turquin 2019).
Color ggx_compensation(float cos_view, float alpha, const Color& reflectance);
/// Mean of the dielectric rise towards grazing angles (fresnel_rise) over the facets that a view sees and whose light
/// leaves: 0 as at normal incidence, 1 as at grazing. What a layer takes from those below it is by this.
float ggx_fresnel_rise(float cos_view, float alpha, float eta);

/// Likewise for glass: reflection plus refraction with the dielectric Fresnel term at the microfacet.
/// @param eta index beyond the surface over index on the side of the view, clamped to [1/3, 3].
float ggx_glass_albedo(float cos_view, float alpha, float eta, bool correlated);

}  // namespace lambent
