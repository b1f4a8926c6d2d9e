// Which random dimension serves which decision: one fixed layout for every SceneProfile and integrator, so that the
// same scene gives the same image in any profile that covers it. A number names one padded 1D or 2D sequence; sequences
// with different numbers are independent. Unused numbers cost nothing.
#pragma once

#include <cstdint>

namespace lambent {

/// Decisions taken once a camera sample.
enum CameraDimension : uint32_t {
  k_dimension_pixel_filter = 0,  ///< 2D
  k_dimension_lens = 1,          ///< 2D
  k_dimension_time = 2,          ///< 1D
  k_dimension_wavelength = 3,    ///< 1D
  k_camera_dimensions = 8,       ///< first number that a walk may use
};

/// Decisions taken once a scattering event (surface or medium), relative to the event's first dimension.
enum BounceDimension : uint32_t {
  k_dimension_lobe = 0,                ///< 1D: what one lobe chooses by itself: glass between its two sides
  k_dimension_direction = 1,           ///< 2D: which lobe scatters and where to
  k_dimension_light = 2,               ///< 2D: which light next event asks and where on it
  k_dimension_roulette = 4,            ///< 1D
  k_dimension_transparency = 5,        ///< 1D: stochastic alpha
  k_dimension_free_flight = 6,         ///< 1D: distance in a medium
  k_dimension_medium_event = 7,        ///< 1D: scatter, absorb or null
  k_dimension_subsurface_channel = 8,  ///< 1D
  k_dimension_subsurface_offset = 9,   ///< 2D
  k_dimension_connection = 10,         ///< 1D: which stored vertex to connect to
  k_dimension_lens_connection = 11,    ///< 2D: where on the lens light tracing connects
  k_dimension_shadow_roulette = 12,    ///< 1D: whether a shadow ray that matters little is traced
  k_bounce_stride = 16,
};

/// Decisions taken once a light subpath, relative to k_light_path_dimension.
enum LightPathDimension : uint32_t {
  k_dimension_emitter = 0,            ///< 2D: which one and where on it
  k_dimension_emitter_direction = 1,  ///< 2D
};

/// First dimension of light subpaths; above every camera walk of up to 2^15 events.
inline constexpr uint32_t k_light_path_dimension = 1u << 20;

/// Dimension number of decision `which` at event `bounce` (0: the first hit) of a camera walk.
constexpr uint32_t bounce_dimension(uint32_t bounce, BounceDimension which) {
  return k_camera_dimensions + bounce * k_bounce_stride + which;
}

/// Dimension number of a decision at the start of a light subpath.
constexpr uint32_t light_path_dimension(LightPathDimension which) { return k_light_path_dimension + which; }

/// Dimension number of decision `which` at event `bounce` (0: the first hit) of a light walk.
constexpr uint32_t light_bounce_dimension(uint32_t bounce, BounceDimension which) {
  return k_light_path_dimension + bounce_dimension(bounce, which);
}

}  // namespace lambent
