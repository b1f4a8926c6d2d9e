// The techniques of the bidirectional family. A full path is lens, x_1 ... x_n, light with n scattering vertices; it is
// made by joining a walk from the camera with one from a light:
//
//   emission hit    the camera walk scatters at x_n and meets the light
//   next event      the camera walk reaches x_n, a point on the light is chosen for it
//   connection m    camera walk to x_m, light walk to x_(m+1), 1 <= m < n, joined by a visible segment
//   light tracing   light walk to x_1, connected to the lens
//   merging i       camera walk and light walk both reach x_i, within a radius
//
// LT, VPL, BPT, PPM, BPM and VCM are sets of these with counts (Georgiev et al. 2012, "Light Transport Simulation with
// Vertex Connection and Merging").
#pragma once

#include <cstdint>

namespace lambent {

/// What finds light. Constant during a render.
struct TechniqueSet {
  /// Camera walks go on after non-delta scattering. If not, their first non-delta vertex is the last ...
  bool camera_scatters = false;
  /// ... but by narrow lobes (LobeWidth) they go on as by mirrors: what light walks bring is joined with the others
  /// alone, unless it came straight from the light or through delta events alone. That, which only emission hits find
  /// further on, is shared with them (at_gloss()).
  bool passes_gloss = false;
  /// Emission met after non-delta scattering counts; what is met through delta events alone always does, and so does
  /// what is met after narrow lobes where walks go on by these.
  bool emission = false;
  bool next_event = false;
  bool connections = false;    ///< to the light walk of the same sample
  bool shared_lights = false;  ///< connections go to light walks that all pixels share (VPL)
  bool light_tracing = false;
  int first_light_tracing = 1;  ///< which needs x_1 to be at least so far along the light walk
  bool merging = false;
  int first_merge_camera = 1;  ///< merging i needs i at least this ...
  int first_merge_light = 1;   ///< ... and x_i to be at least so far along the light walk (1: its first hit)

  /// Several techniques may find one path: they are weighed against each other. If not, each path has one technique,
  /// but for at_gloss().
  bool weighted() const { return camera_scatters; }
  /// What finds light that comes straight, or through delta events alone, to the last narrow lobe by which a camera
  /// walk goes on where it passes gloss.
  TechniqueSet at_gloss() const {
    TechniqueSet set;
    set.camera_scatters = set.emission = true;
    set.next_event = next_event;
    set.merging = merging;
    return set;
  }
  bool light_walks() const { return connections || light_tracing || merging || shared_lights; }
};

inline constexpr TechniqueSet k_techniques_lt{.light_tracing = true};
inline constexpr TechniqueSet k_techniques_vpl{.passes_gloss = true, .next_event = true, .shared_lights = true};
inline constexpr TechniqueSet k_techniques_ppm{.passes_gloss = true, .merging = true};
inline constexpr TechniqueSet k_techniques_bpm{.camera_scatters = true, .merging = true};
/// No light tracing for direct light on what the camera sees: next events and emission hits find all of it and vary far
/// less than the number of walks that happen to arrive in a pixel, which weights, blind to variance, would not know
/// (Grittmann et al. 2019, "Variance-Aware Multiple Importance Sampling").
inline constexpr TechniqueSet k_techniques_bpt{.camera_scatters = true,
                                               .emission = true,
                                               .next_event = true,
                                               .connections = true,
                                               .light_tracing = true,
                                               .first_light_tracing = 2};
/// No merging for direct light (first_merge_light) and what the camera sees directly (first_merge_camera): others find
/// that better, and merging would blur it.
inline constexpr TechniqueSet k_techniques_vcm{.camera_scatters = true,
                                               .emission = true,
                                               .next_event = true,
                                               .connections = true,
                                               .light_tracing = true,
                                               .first_light_tracing = 2,
                                               .merging = true,
                                               .first_merge_camera = 2,
                                               .first_merge_light = 2};

/// How often each technique is tried a camera sample (of raster density 1 px⁻²), and how far merging reaches.
struct TechniqueCounts {
  float light_paths = 1.0f;    ///< light walks of a pass whose splats may reach any pixel
  float merge_paths = 1.0f;    ///< light walks whose photons are merged with
  int max_light_vertices = 1;  ///< light walks are no longer; techniques that would need it do not exist
  /// What a technique's term in weights counts for with each scatter (delta ones aside) by which the camera walk went
  /// on to a further vertex. Heuristics take techniques as independent, but all that is found from x_2 on has the noise
  /// of the scatter at x_1, all from x_3 on that of the one at x_2 too; of light walks, each vertex adds to another
  /// pixel or is one of many that are chosen from. Half is best or near it on those scenes of
  /// tests/perf/LIGHT_TRANSPORT.md where light walks matter.
  float shared_scatter = 0.5f;
};

enum class Technique : uint8_t { emission_hit, next_event, connection, light_tracing, merging };

}  // namespace lambent
