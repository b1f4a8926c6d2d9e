#include "engine/shading/thin_film.h"

#include <array>

#include "engine/shading/color_math.h"
#include "engine/shading/fresnel.h"
#include "engine/shading/standard_observer.h"

namespace lambent {
namespace {

constexpr int k_orders = 3;
constexpr int k_table_size = 512;
constexpr float k_table_step_nm = 18.687f;  // what Cycles has: to 9.5 µm, where nothing is left of the colours

struct ResponseTable {
  std::array<FilmResponse, k_table_size> at;
  ResponseTable() {
    // Between the observer's samples phases turn by more than a radian: cubics (Catmull & Rom) fill in.
    constexpr int k_between = 5;
    const auto sample = [](int i, int axis) {
      return i < 0 || i >= k_observer_count ? 0.0 : static_cast<double>(k_observer_xyz[i][axis]);
    };
    for (FilmResponse& entry : at) {
      const double difference = static_cast<double>(&entry - at.data()) * static_cast<double>(k_table_step_nm);
      double xyz[2][3] = {};
      for (int i = 0; i < k_observer_count * k_between; ++i) {
        const int cell = i / k_between;
        const double t = static_cast<double>(i % k_between) / k_between;
        const double phase =
            2.0 * static_cast<double>(k_pi) * difference /
            (static_cast<double>(k_observer_start_nm) + (cell + t) * static_cast<double>(k_observer_step_nm));
        for (int axis = 0; axis < 3; ++axis) {
          const double a = sample(cell - 1, axis), b = sample(cell, axis), c = sample(cell + 1, axis),
                       d = sample(cell + 2, axis);
          const double value = b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
          xyz[0][axis] += value * std::cos(phase);
          xyz[1][axis] -= value * std::sin(phase);
        }
      }
      const auto rgb = [&](const double* v) {
        return rec709_from_xyz(static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]));
      };
      entry = {rgb(xyz[0]), rgb(xyz[1])};
    }
    const Color whole = at[0].cosine;
    for (FilmResponse& entry : at) entry = {entry.cosine / whole, entry.sine / whole};
  }
};

// A number by polarisation: across the plane of incidence, and in it.
struct Polarised {
  float s, p;
};
struct Phasor {
  float re, im;
};

// Reflectance of a dielectric and on which side of 0 the amplitudes are; false if all is reflected.
struct DielectricFacet {
  Polarised reflectance{1.0f, 1.0f}, sign{1.0f, 1.0f};
  float cos_beyond = 0.0f;
  bool transmits = false;

  DielectricFacet(float cosine, float eta) {
    const float cos2 = 1.0f - (1.0f - cosine * cosine) / (eta * eta);
    if (!(cos2 > 0.0f)) return;
    cos_beyond = std::sqrt(cos2);
    const float across = (cosine - eta * cos_beyond) / (cosine + eta * cos_beyond);
    const float along = (eta * cosine - cos_beyond) / (eta * cosine + cos_beyond);
    reflectance = {across * across, along * along};
    sign = {across >= 0.0f ? 1.0f : -1.0f, along >= 0.0f ? 1.0f : -1.0f};
    transmits = reflectance.s < 1.0f || reflectance.p < 1.0f;
  }
};

// Light that arrives through the film at a metal; one channel. Born & Wolf 1999, §14.4.1, with n + ik for the index.
struct ConductorFacet {
  Polarised reflectance;
  Phasor across, along;

  ConductorFacet(float cosine, float film_eta, float n, float k) {
    const float film2 = film_eta * film_eta, c2 = cosine * cosine;
    const float real = n * n - k * k, imaginary = 2.0f * n * k;
    const float t = real - film2 * (1.0f - c2), root = std::sqrt(t * t + imaginary * imaginary);
    const float u2 = std::max(0.5f * (root + t), 0.0f), v2 = std::max(0.5f * (root - t), 0.0f);
    const float u = std::sqrt(u2), v = std::sqrt(v2), fc = film_eta * cosine;
    reflectance.s = ratio(sqr(fc - u) + v2, sqr(fc + u) + v2);
    reflectance.p = ratio(sqr(real * cosine - film_eta * u) + sqr(imaginary * cosine - film_eta * v),
                          sqr(real * cosine + film_eta * u) + sqr(imaginary * cosine + film_eta * v));
    across = unit(fc * fc - u2 - v2, -2.0f * fc * v);
    along = unit(sqr((n * n + k * k) * cosine) - film2 * (u2 + v2), 2.0f * fc * (imaginary * u - real * v));
  }

 private:
  static float ratio(float a, float b) { return b > 0.0f ? std::min(a / b, 1.0f) : 1.0f; }
  static Phasor unit(float re, float im) {
    const float length = std::hypot(re, im);
    return length > 0.0f ? Phasor{re / length, im / length} : Phasor{1.0f, 0.0f};
  }
};

// Belcour & Barla, eq. 10: the sum over how often light went to and fro in the film. `turn` is the phase that both
// reflections inside add.
float airy_sum(float outer, float inner, Phasor turn, const FilmResponse (&response)[k_orders], int channel) {
  const float passed = 1.0f - outer, both = outer * inner;
  const float incoherent = passed * passed * inner / std::max(1.0f - both, 1e-12f);
  const float amplitude = std::sqrt(both);
  float sum = outer + incoherent, order = incoherent - passed;
  Phasor phase = turn;
  for (const FilmResponse& m : response) {
    order *= amplitude;
    sum += 2.0f * order * (phase.re * m.cosine[channel] + phase.im * m.sine[channel]);
    phase = {phase.re * turn.re - phase.im * turn.im, phase.re * turn.im + phase.im * turn.re};
  }
  return sum;
}

// The film, and light on its way through.
struct FilmPass {
  float eta;
  DielectricFacet outer;
  FilmResponse response[k_orders];

  FilmPass(float cosine, const ThinFilm& film) : eta(faded_eta(film)), outer(cosine, eta) {
    const float difference = 2.0f * eta * film.thickness_nm * outer.cos_beyond;
    for (int m = 0; m < k_orders; ++m) {
      const float of_order = static_cast<float>(m + 1) * difference;
      response[m] = film.fitted ? fitted_film_response(of_order) : film_response(of_order);
    }
  }

  float mean(float across, float along) const {
    const float sum = 0.5f * (across + along);
    return sum > 0.0f ? std::min(sum, 1.0f) : 0.0f;
  }

 private:
  // Below a nanometre (or 30) there is less and less of a film.
  static float faded_eta(const ThinFilm& film) {
    const float whole_from_nm = film.fitted ? 30.0f : 1.0f;
    if (film.thickness_nm >= whole_from_nm) return film.eta;
    const float t = std::max(film.thickness_nm, 0.0f) / whole_from_nm;
    return lerp(1.0f, film.eta, t * t * (3.0f - 2.0f * t));
  }
};

// @param reflectance what the metal reflects under the film by channel, for both polarisations; null: as computed
Color film_over_metal(float cosine, const Color& n, const Color& k, const ThinFilm& film, const Color* f0_f82) {
  const FilmPass pass(std::clamp(cosine, 0.0f, 1.0f), film);
  if (!pass.outer.transmits) return Color(1.0f);
  const float inside = pass.outer.cos_beyond;
  Color result;
  for (int c = 0; c < 3; ++c) {
    ConductorFacet inner(inside, pass.eta, n[c], k[c]);
    if (f0_f82) {
      // Seen from within the film the metal is darker at normal incidence; at 82° it stays as given.
      const float index = n[c] / pass.eta, extinction2 = sqr(k[c] / pass.eta);
      const float f0 = (sqr(index - 1.0f) + extinction2) / (sqr(index + 1.0f) + extinction2);
      inner.reflectance.s = inner.reflectance.p = fresnel_f82_by_value(inside, f0, (*f0_f82)[c]);
    }
    const float s = -pass.outer.sign.s, p = -pass.outer.sign.p;
    result[c] = pass.mean(airy_sum(pass.outer.reflectance.s, inner.reflectance.s,
                                   {s * inner.across.re, s * inner.across.im}, pass.response, c),
                          airy_sum(pass.outer.reflectance.p, inner.reflectance.p,
                                   {p * inner.along.re, p * inner.along.im}, pass.response, c));
  }
  return result;
}

}  // namespace

FilmResponse film_response(float difference_nm) {
  static const ResponseTable table;
  const float position = difference_nm * (1.0f / k_table_step_nm);
  if (!(position < static_cast<float>(k_table_size - 1))) return table.at[k_table_size - 1];
  const int i = static_cast<int>(position);
  const float t = position - static_cast<float>(i);
  return {lerp(table.at[i].cosine, table.at[i + 1].cosine, t), lerp(table.at[i].sine, table.at[i + 1].sine, t)};
}

FilmResponse fitted_film_response(float difference_nm) {
  // Transforms of Gaussians over the wave number: X by two of them, Y, Z. `weight` is at no difference.
  struct Gaussian {
    int axis;
    float weight, centre_per_m, variance_per_m2;
  };
  static constexpr Gaussian k_gaussians[] = {{0, 0.846590f, 1.6810e6f, 4.3278e9f},
                                             {0, 0.153868f, 2.2399e6f, 4.5282e9f},
                                             {1, 1.000222f, 1.7953e6f, 9.3046e9f},
                                             {2, 1.001123f, 2.2084e6f, 6.6121e9f}};
  constexpr float k_white[3] = {0.950456f, 1.0f, 1.089058f};  // of Rec. 709
  const float phase_m = 2.0f * k_pi * 1e-9f * difference_nm;
  float cosine[3] = {}, sine[3] = {};
  for (const Gaussian& g : k_gaussians) {
    const float size = k_white[g.axis] * g.weight * std::exp(-sqr(phase_m) * g.variance_per_m2);
    cosine[g.axis] += size * std::cos(g.centre_per_m * phase_m);
    sine[g.axis] -= size * std::sin(g.centre_per_m * phase_m);
  }
  return {rec709_from_xyz(cosine[0], cosine[1], cosine[2]), rec709_from_xyz(sine[0], sine[1], sine[2])};
}

Color film_dielectric(float cosine, float eta, const ThinFilm& film) {
  const FilmPass pass(std::clamp(cosine, 0.0f, 1.0f), film);
  if (!pass.outer.transmits) return Color(1.0f);
  const DielectricFacet inner(pass.outer.cos_beyond, eta / pass.eta);
  if (!inner.transmits) return Color(1.0f);
  const Phasor turn_s{-pass.outer.sign.s * inner.sign.s, 0.0f}, turn_p{-pass.outer.sign.p * inner.sign.p, 0.0f};
  Color result;
  for (int c = 0; c < 3; ++c)
    result[c] = pass.mean(airy_sum(pass.outer.reflectance.s, inner.reflectance.s, turn_s, pass.response, c),
                          airy_sum(pass.outer.reflectance.p, inner.reflectance.p, turn_p, pass.response, c));
  return result;
}

Color film_conductor(float cosine, const Color& n, const Color& k, const ThinFilm& film) {
  return film_over_metal(cosine, n, k, film, nullptr);
}

Color film_f82(float cosine, const Color& f0, const Color& f82_tint, const ThinFilm& film) {
  const Color f82 = fresnel_f82(1.0f / 7.0f, f0, f82_tint);
  Color n, k;
  for (int c = 0; c < 3; ++c) {
    const float r = std::clamp(f0[c], 0.0f, 0.999f), root = std::sqrt(r);
    n[c] = lerp((1.0f + root) / (1.0f - root), (1.0f - r) / (1.0f + r), f82[c]);
    k[c] = safe_sqrt((r * sqr(n[c] + 1.0f) - sqr(n[c] - 1.0f)) / (1.0f - r));
  }
  return film_over_metal(cosine, n, k, film, &f82);
}

}  // namespace lambent
