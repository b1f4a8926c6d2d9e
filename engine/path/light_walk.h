// A walk from a light: its vertices and densities, for whatever connects to or merges with them.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/path/event_counts.h"
#include "engine/path/path_pdfs.h"
#include "engine/path/technique.h"
#include "engine/sampling/sampler.h"
#include "engine/scene/scene.h"
#include "engine/shading/bsdf_set.h"

namespace lambent {

/// Where a light walk met a surface. "Depth" counts from the light: 1 is the first hit, x_n of technique.h.
struct LightVertex {
  SurfaceHit surface;
  const SurfaceBinding* binding = nullptr;
  Vec3 wi_world{0.0f};     ///< unit, towards the light's side
  Vec3 ng_world{0.0f};     ///< geometric normal on wi's side
  Color throughput{0.0f};  ///< flux of the walk on arrival, W
  int depth = 1;
  float time = 0.0f;  ///< when, as CameraRay's: a walk happens at one moment, that of the camera walk it is joined to
  float own_area = 0.0f;  ///< l of this vertex (path_pdfs.h); depth 1: of leaving the light and getting here
  float previous_per_solid_angle =
      0.0f;  ///< cos / d² at the vertex before: turns densities of directions to it into areas
  float next_event = 0.0f, conditional = 0.0f;  ///< depth 1: next_event and light_conditional of path_pdfs.h
  EventCounts counts;   ///< events at depths 2 ... depth - 1 (that at depth 1 is free, see EventCounts)
  uint64_t events = 0;  ///< ScatterEvent bits at depths depth - 1 ... 1, four bits each, this end lowest
  uint16_t place = 0;   ///< the part of the scene, for whoever chooses vertices; set by them
  Bsdf bsdf;            ///< as seen from wi
};

/// The densities of a walk by depth (index 0 is unused): what the vertices share.
struct LightWalkPdfs {
  std::vector<float> own, other;     ///< l and c of path_pdfs.h; other[d] is final once the walk scattered at d + 1
  std::vector<uint8_t> connectible;  ///< of the event at that depth
  std::vector<uint16_t> place;       ///< LightVertex::place of the vertex that scattered there
  float next_event = 0.0f, conditional = 0.0f;  ///< LightVertex's where the walk scattered at depth 1
};

struct LightWalkSettings {
  int max_vertices = 1;
  int total = 12, diffuse = 4, glossy = 4, transmission = 12, transparent = 8;  ///< limits as bounces.h
  bool caustics_reflective = true, caustics_refractive = true;
  EvenWorld even_world = EvenWorld::sampled;  ///< as the camera walks' next events have it
  const EmissionAim* aim = nullptr;           ///< may be filled until the first walk; null: none
  bool want_next_event = true;                ///< LightVertex::next_event; 0 without it
  bool events_by_share = false;  ///< LightVertex::events as passes need them (event_by_share), not as sampled
};

/// What scattering at a light vertex towards the camera's side gives.
struct LightScatter {
  Color f_cos{0.0f};       ///< for Transport::importance: times flux and J or 1/d² it is what the camera's side gets
  float to_camera = 0.0f;  ///< density with which a light walk chooses that direction, sr⁻¹
  float to_light = 0.0f;   ///< density with which a camera walk from there chooses the vertex's wi, sr⁻¹
  EventShares shares;      ///< filled on request
};

/// Traces one walk and keeps its vertices until the next. Memory is reused. One thread's.
class LightWalk {
 public:
  LightWalk(const Scene& scene, const LightWalkSettings& settings);

  /// Walks from a light chosen by power. Vertices on surfaces that do not let light walks scatter are kept with an
  /// empty bsdf: they serve merging alone.
  void trace(const Sampler& sampler, float time = 0.0f);

  const std::vector<LightVertex>& storage() const { return vertices_; }
  int size() const { return count_; }
  LightVertex& operator[](int i) { return vertices_[static_cast<size_t>(i)]; }
  const LightVertex& operator[](int i) const { return vertices_[static_cast<size_t>(i)]; }
  const LightWalkPdfs& pdfs() const { return pdfs_; }
  void set_place(int i, uint16_t place) {
    pdfs_.place[static_cast<size_t>((*this)[i].depth)] = (*this)[i].place = place;
  }

  /// Where it began; of walks that have vertices.
  const EmissionSample& start() const { return start_; }
  LightIndex light() const { return start_.light; }
  const LightTraits& traits() const { return *start_.traits; }
  bool can_be_hit() const { return can_be_hit_; }
  uint64_t rays() const { return rays_; }

  /// Working memory of scatter(), a thread's own.
  struct Scratch {
    Bsdf bsdf;
    ShadingPoint point;
  };
  /// Evaluates a vertex towards `direction_world` (unit, to the camera's side), as a camera walk would see it: programs
  /// that depend on the view run again. False if nothing gets there.
  /// @param first_hit the camera itself is there, so that its walk's least share holds
  bool scatter(const LightVertex& vertex, const Vec3& direction_world, bool first_hit, bool want_shares,
               Scratch& scratch, LightScatter& result) const;

  /// Whether a walk that arrives from the side of `wi_world` (unit) can pick a delta lobe of that kind there: what
  /// depends on the view may be there for the camera's direction alone (Fresnel nodes beyond the critical angle).
  bool has_delta_lobe(const SurfaceHit& surface, const SurfaceBinding& binding, const Vec3& wi_world, LobeKind kind,
                      Scratch& scratch) const;

 private:
  bool same_from(const LightVertex& vertex, const Vec3& direction) const;
  void evaluate_from(const LightVertex& vertex, const Vec3& direction, Scratch& scratch) const;
  LightVertex& next_vertex();

  const Scene& scene_;
  const LightWalkSettings settings_;
  std::vector<LightVertex> vertices_;
  int count_ = 0;
  LightWalkPdfs pdfs_;
  EmissionSample start_;
  bool can_be_hit_ = false;
  uint64_t rays_ = 0;
  Scratch seen_;
};

/// PathVertexFlag bits of a surface: whether light walks arrive and scatter there. They scatter where every kind of
/// scattered camera ray would find the surface, since which of them the segment stands for is not known beforehand, and
/// where what is scattered does not depend on the camera's path: not by the program, nor because caustics are switched
/// off, which drops glossy lobes after diffuse events.
uint8_t light_walk_flags(const Scene& scene, const SurfaceHit& surface, const Program& program);
/// Whether the lobes are such that switched-off caustics may drop some.
template <typename Settings>
bool caustics_drop_lobes(const Bsdf& bsdf, const Settings& settings) {
  if (settings.caustics_reflective && settings.caustics_refractive) return false;
  for (const Lobe& lobe : bsdf.lobes())
    if (lobe.kind >= LobeKind::reflection) return true;
  return false;
}

/// Density of light walks that leave `light` so as to pass p_receiver, `distance_m` away along `direction_from_light`,
/// per area perpendicular to it and solid angle (delta positions: per area; delta directions: per area): l_n of
/// path_pdfs.h before its cosine. 0 if no walk does. `conditional`: per area given the point on the light.
float light_walk_density(const LightSet& lights, const EmissionAim* aim, LightIndex light, const Vec3& n_light_world,
                         const Vec3& p_receiver_world, const Vec3& direction_from_light, float distance_m,
                         float* conditional = nullptr);

}  // namespace lambent
