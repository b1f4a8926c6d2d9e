#include "engine/shading/sky.h"

#include <tbb/parallel_for.h>

#include "engine/shading/hosek_sky.h"
#include "engine/shading/spectral_atmosphere.h"

namespace lambent {
namespace {

// Perez's five coefficients of luminance, x and y as linear functions of turbidity, and the zenith's cubic in the sun's
// angle (Preetham, Shirley & Smits 1999, appendix A.2).
constexpr float k_slope[3][5] = {{0.1787f, -0.3554f, -0.0227f, 0.1206f, -0.0670f},
                                 {-0.0193f, -0.0665f, -0.0004f, -0.0641f, -0.0033f},
                                 {-0.0167f, -0.0950f, -0.0079f, -0.0441f, -0.0109f}};
constexpr float k_offset[3][5] = {{-1.4630f, 0.4275f, 5.3251f, -2.5771f, 0.3703f},
                                  {-0.2592f, 0.0008f, 0.2125f, -0.8989f, 0.0452f},
                                  {-0.2608f, 0.0092f, 0.2102f, -1.6537f, 0.0529f}};
constexpr float k_zenith_x[3][4] = {{0.00166f, -0.00375f, 0.00209f, 0.0f},
                                    {-0.02903f, 0.06377f, -0.03202f, 0.00394f},
                                    {0.11693f, -0.21196f, 0.06052f, 0.25886f}};
constexpr float k_zenith_y[3][4] = {{0.00275f, -0.00610f, 0.00317f, 0.0f},
                                    {-0.04214f, 0.08970f, -0.04153f, 0.00516f},
                                    {0.15346f, -0.26756f, 0.06670f, 0.26688f}};
constexpr float k_luminance_scale = 0.06f;  // Blender's, from kcd/m² to scene units

float perez(const float* c, float cos_theta, float gamma) {
  const float cos_gamma = std::cos(gamma);
  return (1.0f + c[0] * std::exp(c[1] / cos_theta)) *
         (1.0f + c[2] * std::exp(c[3] * gamma) + c[4] * cos_gamma * cos_gamma);
}

float zenith(const float coefficients[3][4], float turbidity, float theta) {
  const float powers[3] = {turbidity * turbidity, turbidity, 1.0f};
  float sum = 0.0f;
  for (int i = 0; i < 3; ++i) {
    const float* c = coefficients[i];
    sum += powers[i] * (((c[0] * theta + c[1]) * theta + c[2]) * theta + c[3]);
  }
  return sum;
}

constexpr size_t k_preetham_floats = 21;

Color rgb_from_xyz(const Color& c) {
  return Color(3.2409699f * c.x - 1.5373832f * c.y - 0.4986108f * c.z,
               -0.9692436f * c.x + 1.8759675f * c.y + 0.0415551f * c.z,
               0.0556301f * c.x - 0.2039770f * c.y + 1.0569715f * c.z);
}

// --- Scattering once

// The atmosphere as Blender models it, so that skies agree; every 20 nm from 380 to 780.
constexpr int k_wavelengths = 21;
constexpr float k_wavelength_step = 20.0f;
constexpr float k_irradiance[k_wavelengths] = {  // of the sun above the atmosphere, W/(m² nm)
    1.457568f, 1.565963f, 1.651485f, 1.714962f, 1.757980f, 1.782564f, 1.790951f,
    1.785415f, 1.768156f, 1.741221f, 1.706471f, 1.665561f, 1.619934f, 1.570836f,
    1.519323f, 1.466285f, 1.412459f, 1.358450f, 1.304749f, 1.251750f, 1.199760f};
constexpr float k_rayleigh[k_wavelengths] = {  // scattering at sea level, 1/m
    5.424820e-5f, 4.418550e-5f, 3.635152e-5f, 3.017929e-5f, 2.526320e-5f, 2.130859e-5f, 1.809838e-5f,
    1.547057e-5f, 1.330285e-5f, 1.150185e-5f, 9.995574e-6f, 8.728000e-6f, 7.655137e-6f, 6.742172e-6f,
    5.961341e-6f, 5.290346e-6f, 4.711157e-6f, 4.209105e-6f, 3.772184e-6f, 3.390513e-6f, 3.055915e-6f};
constexpr float k_ozone[k_wavelengths] = {  // absorption in the densest layer, 1/m
    3.251268e-9f, 5.853954e-9f, 1.977191e-8f, 7.309569e-8f, 2.008456e-7f, 4.038396e-7f, 6.355134e-7f,
    9.670704e-7f, 1.547974e-6f, 2.090386e-6f, 2.461281e-6f, 2.735513e-6f, 2.151259e-6f, 1.590518e-6f,
    1.123562e-6f, 7.352755e-7f, 4.645013e-7f, 3.309608e-7f, 2.251261e-7f, 1.487913e-7f, 1.682862e-7f};
constexpr float k_observer[k_wavelengths][3] = {  // CIE 1931
    {0.001368f, 0.000039f, 0.006450f}, {0.014310f, 0.000396f, 0.067850f}, {0.134380f, 0.004000f, 0.645600f},
    {0.348280f, 0.023000f, 1.747060f}, {0.290800f, 0.060000f, 1.669200f}, {0.095640f, 0.139020f, 0.812950f},
    {0.004900f, 0.323000f, 0.272000f}, {0.063270f, 0.710000f, 0.078250f}, {0.290400f, 0.954000f, 0.020300f},
    {0.594500f, 0.995000f, 0.003900f}, {0.916300f, 0.870000f, 0.001650f}, {1.062200f, 0.631000f, 0.000800f},
    {0.854450f, 0.381000f, 0.000190f}, {0.447900f, 0.175000f, 0.000020f}, {0.164900f, 0.061000f, 0.0f},
    {0.046770f, 0.017000f, 0.0f},      {0.011359f, 0.004102f, 0.0f},      {0.002899f, 0.001047f, 0.0f},
    {0.000690f, 0.000249f, 0.0f},      {0.000166f, 0.000060f, 0.0f},      {0.000042f, 0.000015f, 0.0f}};
constexpr float k_mie = 2e-5f, k_mie_extinction = 1.11f * k_mie;  // 1/m
constexpr float k_anisotropy = 0.76f;
constexpr float k_earth_radius = 6360e3f, k_top_radius = 6420e3f;
constexpr float k_rayleigh_height = 8e3f, k_mie_height = 1.2e3f;
constexpr int k_view_steps = 32;
// Gauss–Laguerre quadrature of eight nodes, its last node but just inside of the atmosphere: densities fall about
// exponentially. Nodes by the length of the ray and weights with their exponentials.
constexpr int k_sun_nodes = 8;
constexpr double k_sun_node[k_sun_nodes] = {0.006811185292, 0.03614807107, 0.09004346519, 0.1706680068,
                                            0.2818362161,   0.4303406404,  0.6296271457,  0.9145252695};
constexpr float k_sun_weight[k_sun_nodes] = {0.01750893642f, 0.04135477391f, 0.06678839063f, 0.09507698807f,
                                             0.1283416365f,  0.1707430204f,  0.2327233347f,  0.3562490486f};

// Layout of a table: what follows, then rows of XYZ from the horizon up, or (h_whole) from the nadir up.
enum Header {
  h_elevation,
  h_rotation,
  h_angle,
  h_intensity,
  h_whole,
  h_horizon,  // elevation that the sun's disc ends at
  h_bottom,
  h_top = h_bottom + 3,
  h_size = h_top + 3
};
constexpr int k_columns = 512, k_rows = 128;

// Densities of air, dust and ozone relative to their coefficients.
Vec3 densities(float height) {
  float ozone = 0.0f;
  if (height >= 10e3f && height < 25e3f) ozone = (height - 10e3f) / 15e3f;
  if (height >= 25e3f && height < 40e3f) ozone = (40e3f - height) / 15e3f;
  return {std::exp(-height / k_rayleigh_height), std::exp(-height / k_mie_height), ozone};
}

Vec3 optical_depth(const Vec3d& from, const Vec3d& d) {
  const double length = distance_to_sphere(from, d, k_top_radius);
  Vec3 sum(0.0f);
  for (int i = 0; i < k_sun_nodes; ++i)
    sum += densities(static_cast<float>((from + d * (k_sun_node[i] * length)).length() - k_earth_radius)) *
           k_sun_weight[i];
  return sum * static_cast<float>(length);
}

bool earth_hides(const Vec3d& p, const Vec3d& d) {
  if (d.z >= 0.0) return false;
  const double b = p ^ d;
  return b * b - (p ^ p) + static_cast<double>(k_earth_radius) * k_earth_radius >= 0.0;
}

Color xyz_of(const float* spectrum) {
  Color sum(0.0f);
  for (int i = 0; i < k_wavelengths; ++i)
    sum += Color(k_observer[i][0], k_observer[i][1], k_observer[i][2]) * (spectrum[i] * k_wavelength_step);
  return sum;
}

// Sunlight scattered once towards the eye along d.
Color scattered(const AtmosphereSky& sky, const Vec3d& eye, const Vec3d& d, const Vec3d& sun) {
  const double step = distance_to_sphere(eye, d, k_top_radius) / k_view_steps;
  const Vec3 scale(sky.air_density, sky.dust_density, sky.ozone_density);
  const float mu = static_cast<float>(d ^ sun), g2 = k_anisotropy * k_anisotropy;
  const float phase_air = 3.0f / (16.0f * k_pi) * (1.0f + mu * mu);
  const float phase_dust = 3.0f * (1.0f - g2) * (1.0f + mu * mu) /
                           (8.0f * k_pi * (2.0f + g2) * std::pow(1.0f + g2 - 2.0f * k_anisotropy * mu, 1.5f));
  float spectrum[k_wavelengths] = {};
  Vec3 depth(0.0f);
  for (int i = 0; i < k_view_steps; ++i) {
    const Vec3d p = eye + d * ((i + 0.5) * step);
    const Vec3 density = scale * densities(static_cast<float>(p.length() - k_earth_radius));
    depth += density * static_cast<float>(step);
    if (earth_hides(p, sun)) continue;
    const Vec3 total = depth + scale * optical_depth(p, sun);
    for (int w = 0; w < k_wavelengths; ++w) {
      const float extinction = total.x * k_rayleigh[w] + total.y * k_mie_extinction + total.z * k_ozone[w];
      const float scattering = density.x * k_rayleigh[w] * phase_air + density.y * k_mie * phase_dust;
      spectrum[w] += std::exp(-extinction) * scattering * k_irradiance[w] * static_cast<float>(step);
    }
  }
  return xyz_of(spectrum);
}

// Radiance of the sun's disc at an elevation.
Color disc(const AtmosphereSky& sky, const Vec3d& eye, float elevation) {
  const float e = std::max(elevation, 0.0f);
  const Vec3 depth = optical_depth(eye, {std::cos(e), 0.0, std::sin(e)});
  const float solid_angle = 2.0f * k_pi * (1.0f - std::cos(0.5f * sky.sun_angle_rad));
  float spectrum[k_wavelengths];
  for (int w = 0; w < k_wavelengths; ++w)
    spectrum[w] =
        k_irradiance[w] / std::max(solid_angle, 1e-12f) *
        std::exp(-(k_rayleigh[w] * depth.x * sky.air_density + k_mie_extinction * depth.y * sky.dust_density));
  return xyz_of(spectrum);
}

int row_count(const std::vector<float>& table) { return table[h_whole] > 0.0f ? 2 * k_rows : k_rows; }

Color atmosphere_pixel(const std::vector<float>& table, int x, int y) {
  const float* p =
      table.data() + h_size +
      3 * (static_cast<size_t>(std::clamp(y, 0, row_count(table) - 1)) * k_columns + std::clamp(x, 0, k_columns - 1));
  return Color(p[0], p[1], p[2]);
}

// Bilinear, extended beyond the edges; u, v in [0, 1].
Color atmosphere_lookup(const std::vector<float>& table, float u, float v) {
  const float x = u * k_columns - 0.5f, y = v * static_cast<float>(row_count(table)) - 0.5f;
  const float x0 = std::floor(x), y0 = std::floor(y);
  const int i = static_cast<int>(x0), j = static_cast<int>(y0);
  return lerp(lerp(atmosphere_pixel(table, i, j), atmosphere_pixel(table, i + 1, j), x - x0),
              lerp(atmosphere_pixel(table, i, j + 1), atmosphere_pixel(table, i + 1, j + 1), x - x0), y - y0);
}

// XYZ of the sun's disc, or 0 beside it.
Color disc_radiance(const std::vector<float>& table, const Vec3& d, float view_elevation) {
  const float elevation = table[h_elevation], angle = table[h_angle], half = 0.5f * angle;
  if (!(angle > 0.0f) || view_elevation < table[h_horizon]) return Color(0.0f);
  const Vec3 sun = sun_direction(elevation, table[h_rotation]);
  const float from_centre = std::atan2(length(cross(d, sun)), dot(d, sun));
  if (!(from_centre < half)) return Color(0.0f);
  const bool whole = table[h_whole] > 0.0f;
  if (!whole && elevation + half <= 0.0f) return Color(0.0f);
  const Color bottom(table[h_bottom], table[h_bottom + 1], table[h_bottom + 2]);
  const Color top(table[h_top], table[h_top + 1], table[h_top + 2]);
  const float t = whole || elevation - half > 0.0f ? (view_elevation - elevation) / angle + 0.5f
                                                   : view_elevation / (elevation + half);
  const float limb = 1.0f - 0.6f * (1.0f - safe_sqrt(1.0f - sqr(from_centre / half)));
  return lerp(bottom, top, t) * (table[h_intensity] * limb);
}

// What is left of the horizon's light below it, at a height z of a unit direction.
float horizon_fade(float z) {
  const float fade = std::max(1.0f + z * 2.5f, 0.0f);
  return fade * fade * fade;
}

Color atmosphere_radiance(const std::vector<float>& table, const Vec3& d) {
  const float view_elevation = std::asin(std::clamp(d.z, -1.0f, 1.0f));
  const Color disc = disc_radiance(table, d, view_elevation);
  // The rotation is stored as the node has it; the table has the sun in its middle column
  float u = (std::atan2(d.x, d.y) + k_pi - table[h_rotation]) / (2.0f * k_pi);
  u -= std::floor(u);
  const float height = safe_sqrt(std::abs(view_elevation) / (0.5f * k_pi));
  if (table[h_whole] > 0.0f)
    return rgb_from_xyz(disc + atmosphere_lookup(table, u, 0.5f + 0.5f * std::copysign(height, view_elevation)));
  // Blender before 5.0: the disc hides the sky, and the horizon fades below.
  if (max_component(disc) > 0.0f) return rgb_from_xyz(disc);
  if (d.z >= 0.0f) return rgb_from_xyz(atmosphere_lookup(table, u, height));
  return rgb_from_xyz(atmosphere_lookup(table, u, 0.0f) * horizon_fade(d.z));
}

// Fills a table's rows with the radiance of directions in half the sky, the sun at longitude 0.
template <class Latitude, class Longitude, class Radiance>
void fill_sky(std::vector<float>& table, const Latitude& latitude_of, const Longitude& longitude_of,
              const Radiance& radiance) {
  tbb::parallel_for(0, row_count(table), [&](int row) {
    const double latitude = latitude_of(row);
    for (int column = 0; column < k_columns / 2; ++column) {
      const double longitude = longitude_of(column);
      const Color xyz = radiance(Vec3d(std::cos(latitude) * std::cos(longitude),
                                       std::cos(latitude) * std::sin(longitude), std::sin(latitude)));
      for (const int x : {column, k_columns - 1 - column})
        for (int k = 0; k < 3; ++k) table[h_size + 3 * (static_cast<size_t>(row) * k_columns + x) + k] = xyz[k];
    }
  });
}

// The same sun with an elevation within ±90°.
void wrap_sun(AtmosphereSky& sky) {
  float e = std::remainder(sky.sun_elevation_rad, 2.0f * k_pi);
  if (std::abs(e) > 0.5f * k_pi) {
    e = std::copysign(k_pi, e) - e;
    sky.sun_rotation_rad += k_pi;
  }
  sky.sun_elevation_rad = e;
}

void make_single_scattering(const AtmosphereSky& sky, std::vector<float>& table, Color& bottom, Color& top) {
  const Vec3d eye(0.0, 0.0, k_earth_radius + static_cast<double>(std::clamp(sky.altitude_m, 1.0f, 59999.0f)));
  bottom = disc(sky, eye, sky.sun_elevation_rad - 0.5f * sky.sun_angle_rad);
  top = disc(sky, eye, sky.sun_elevation_rad + 0.5f * sky.sun_angle_rad);
  const Vec3d sun(std::cos(sky.sun_elevation_rad), 0.0, std::sin(sky.sun_elevation_rad));
  const bool whole = table[h_whole] > 0.0f;
  // More rows towards the horizon.
  const auto latitude = [&](int row) {
    const double above = whole ? row - k_rows : row;
    return (0.5 * std::numbers::pi + (whole ? 0.0 : 0.25 * std::numbers::pi / k_rows)) * above / k_rows * above /
           k_rows * (above < 0.0 ? -1.0 : 1.0);
  };
  const auto longitude = [](int column) { return 2.0 * std::numbers::pi * column / k_columns - std::numbers::pi; };
  fill_sky(table, latitude, longitude,
           [&](const Vec3d& d) { return d.z < 0.0 ? Color(0.0f) : scattered(sky, eye, d, sun); });
  if (!whole) return;
  // Below the horizon it fades.
  const size_t row_floats = 3 * k_columns;
  const float* horizon = table.data() + h_size + k_rows * row_floats;
  for (int row = 0; row < k_rows; ++row) {
    const float fade = horizon_fade(static_cast<float>(std::sin(latitude(row))));
    for (size_t i = 0; i < row_floats; ++i)
      table[h_size + static_cast<size_t>(row) * row_floats + i] = horizon[i] * fade;
  }
}

void make_multiple_scattering(const AtmosphereSky& sky, std::vector<float>& table, Color& bottom, Color& top) {
  const SpectralAtmosphere atmosphere(sky.air_density, sky.dust_density, sky.ozone_density);
  const double altitude_km = std::clamp(sky.altitude_m, 1.0f, 99999.0f) / 1000.0, half = 0.5 * sky.sun_angle_rad;
  const double solid_angle = std::max(2.0 * std::numbers::pi * (1.0 - std::cos(half)), 1e-12);
  bottom = atmosphere.sunlight(altitude_km, sky.sun_elevation_rad - half, solid_angle);
  top = atmosphere.sunlight(altitude_km, sky.sun_elevation_rad + half, solid_angle);
  const Vec3d sun(std::cos(sky.sun_elevation_rad), 0.0, std::sin(sky.sun_elevation_rad));
  const auto latitude = [&](int row) {
    const double l = (row + 0.5) / k_rows - 1.0;
    return std::copysign(l * l, l) * 0.5 * std::numbers::pi;
  };
  const auto longitude = [](int column) {
    return 2.0 * std::numbers::pi * (column + 0.5) / k_columns - std::numbers::pi;
  };
  fill_sky(table, latitude, longitude, [&](const Vec3d& d) { return atmosphere.radiance(altitude_km, d, sun); });
}

}  // namespace

Vec3 sun_direction(float elevation, float rotation) {
  return {std::cos(elevation) * std::sin(rotation), std::cos(elevation) * std::cos(rotation), std::sin(elevation)};
}

std::vector<float> make_atmosphere_sky(const AtmosphereSky& described) {
  AtmosphereSky sky = described;
  wrap_sun(sky);
  const bool whole = sky.model != AtmosphereSky::Model::nishita;
  std::vector<float> table(h_size + static_cast<size_t>(3) * k_columns * (whole ? 2 * k_rows : k_rows));
  table[h_elevation] = sky.sun_elevation_rad;
  table[h_rotation] = sky.sun_rotation_rad;
  table[h_angle] = sky.sun_disc ? sky.sun_angle_rad : -1.0f;
  table[h_intensity] = sky.sun_intensity;
  table[h_whole] = whole ? 1.0f : 0.0f;
  if (whole) {
    const double radius = SpectralAtmosphere::k_earth_radius_km;
    table[h_horizon] = static_cast<float>(
        std::asin(std::min(radius / (radius + 1e-3 * std::max(sky.altitude_m, 0.0f)), 1.0)) - 0.5 * std::numbers::pi);
  }
  Color bottom, top;
  if (sky.model == AtmosphereSky::Model::multiple_scattering)
    make_multiple_scattering(sky, table, bottom, top);
  else
    make_single_scattering(sky, table, bottom, top);
  for (int k = 0; k < 3; ++k) table[h_bottom + k] = bottom[k], table[h_top + k] = top[k];
  return table;
}

std::vector<float> make_preetham_sky(const Vec3& sun_direction, float turbidity) {
  // 15 coefficients, 3 factors, the sun's direction
  std::vector<float> table(k_preetham_floats);
  const Vec3 sun = length_squared(sun_direction) > 0.0f ? normalize(sun_direction) : Vec3(0, 0, 1);
  const float t = std::clamp(turbidity, 1.0f, 10.0f), theta = std::acos(std::clamp(sun.z, -1.0f, 1.0f));
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 5; ++i) table[5 * k + i] = k_slope[k][i] * t + k_offset[k][i];
  const float chi = (4.0f / 9.0f - t / 120.0f) * (k_pi - 2.0f * theta);
  const float zeniths[3] = {((4.0453f * t - 4.9710f) * std::tan(chi) - 0.2155f * t + 2.4192f) * k_luminance_scale,
                            zenith(k_zenith_x, t, theta), zenith(k_zenith_y, t, theta)};
  for (int k = 0; k < 3; ++k) table[15 + k] = zeniths[k] / perez(table.data() + 5 * k, 1.0f, theta);
  table[18] = sun.x, table[19] = sun.y, table[20] = sun.z;
  return table;
}

Color sky_radiance(const std::vector<float>& table, const Vec3& d_in) {
  const Vec3 d = normalize(d_in);
  if (table.size() == k_hosek_floats) {
    const std::array<float, 3> xyz = hosek_xyz(table, d);
    return rgb_from_xyz(Color(xyz[0], xyz[1], xyz[2]));
  }
  if (table.size() > k_preetham_floats) return atmosphere_radiance(table, d);
  const Vec3 sun(table[18], table[19], table[20]);
  const float gamma = std::acos(std::clamp(dot(d, sun), -1.0f, 1.0f));
  const float cos_theta = std::max(d.z, 0.001f);
  float value[3];
  for (int k = 0; k < 3; ++k) value[k] = table[15 + k] * perez(table.data() + 5 * k, cos_theta, gamma);
  const float luminance_y = value[0], x = value[1], y = value[2];
  if (!(y > 0.0f)) return Color(0.0f);
  return rgb_from_xyz(Color(x / y * luminance_y, luminance_y, (1.0f - x - y) / y * luminance_y));
}

}  // namespace lambent
