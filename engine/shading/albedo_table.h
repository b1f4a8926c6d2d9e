// How much a rough lobe reflects by single scattering: what multiscatter GGX restores.
#pragma once

namespace lambent {

/// Directional albedo of single-scattering GGX with reflectance 1. @param cos_view in [0, 1] @param alpha in [0, 1].
/// In (0, 1]. Bilinear in a table that is integrated once per process on first use (20 ms); error below 0.3%.
float ggx_reflection_albedo(float cos_view, float alpha);

/// Likewise for glass: reflection plus refraction with the dielectric Fresnel term at the microfacet.
/// @param eta index beyond the surface over index on the side of the view, clamped to [1/3, 3].
float ggx_glass_albedo(float cos_view, float alpha, float eta);

}  // namespace lambent
