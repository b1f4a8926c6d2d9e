// Reflectance of a surface under a transparent film as thin as light's waves: what is reflected off both sides of the
// film interferes, so that the colour changes with thickness and angle.
//
// Belcour & Barla 2017, "A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence", with
// three orders of interference. The observer's response to a path difference is from a table, as in Cycles since 5.0,
// or the paper's fit by Gaussians, as in 4.2 to 4.5. Indices are relative to the side that the light comes from.
#pragma once

#include "engine/base/vec.h"

namespace lambent {

struct ThinFilm {
  float thickness_nm;   ///< finite, above 0
  float eta;            ///< of the film, in [k_least_film_eta, k_most_film_eta]
  bool fitted = false;  ///< as Cycles 4.2 to 4.5: by the fit, and fading below 30 nm instead of 1 nm
};
inline constexpr float k_least_film_eta = 1e-3f, k_most_film_eta = 1e3f;
/// Thinner films do nothing.
inline constexpr float k_least_film_thickness_nm = 0.1f;

/// What the observer sees of waves that differ by a path of `difference_nm` (the film's optical one): the mean of cos
/// and of −sin of the phase over the channel's response, in linear Rec. 709. 1 and 0 for no difference.
struct FilmResponse {
  Color cosine, sine;
};
/// Linear in a table that is integrated once per process on first use (1 ms). @param difference_nm >= 0.
FilmResponse film_response(float difference_nm);
/// The same by the fit of the paper's supplement, for an observer whose white is the gamut's.
FilmResponse fitted_film_response(float difference_nm);

/// Unpolarised reflectance of a film over a dielectric, seen at `cosine` in [0, 1]; 1 where no light gets through.
Color film_dielectric(float cosine, float eta, const ThinFilm& film);

/// Likewise over a metal of index n and extinction k by channel, finite.
Color film_conductor(float cosine, const Color& n, const Color& k, const ThinFilm& film);

/// Likewise over the metal of fresnel_f82, whose index is made up to fit (Gulbrandsen 2014).
Color film_f82(float cosine, const Color& f0, const Color& f82_tint, const ThinFilm& film);

}  // namespace lambent
