// The bidirectional family's kernel: light walks, camera walks, and every technique that joins them, weighed against
// each other. Compiled once for each KernelProfile; which techniques run is data (TechniqueSet).
#pragma once

#include <optional>
#include <utility>

#include "engine/integrators/bidirectional/vertex_pool.h"
#include "engine/integrators/integrator.h"
#include "engine/integrators/passes.h"
#include "engine/path/light_walk.h"
#include "engine/path/linked_light.h"
#include "engine/path/path_pdfs.h"
#include "engine/path/photon_map.h"
#include "engine/sampling/event_numbers.h"

namespace lambent::bidirectional {

/// Steps of the golden section: each by itself is uniform.
inline constexpr float k_golden = 0.61803399f;

/// What connections to the pool bring, for who learns.
struct ConnectionLog {
  struct From {
    Vec3 p_world{0.0f}, ng_world{0.0f};
    bool first = true;                                ///< to connect on its walk
    std::vector<std::pair<uint32_t, float>> brought;  ///< number in the pool, luminance
  };
  std::vector<From> from;
};

/// What all walks of a pass share. Immutable while it runs.
struct Pass {
  TechniqueSet set;
  TechniqueCounts counts;
  const EmissionAim* aim = nullptr;                 ///< of light walks; null: none
  const PhotonMap* photons = nullptr;               ///< merging
  std::span<const LightWalk* const> shared_lights;  ///< VPL: walks that every pixel connects to
  const VertexPool* pool = nullptr;                 ///< what camera walks connect to; null: to the own walk
  const ConnectionGuide* guide = nullptr;           ///< of the pool; null: all of it is as likely
  float radius_scale = 0.0f;                        ///< merge radius over the pixel's footprint at x_1
  float radius_limit_m = 0.0f;                      ///< largest merge radius
  bool correlation_aware = true;
  float clamp_connection = 0.0f;  ///< VPL: largest sum of R, G, B of one connection; 0: none

  /// Connections are chosen by what they are worth, and weights know it.
  bool guided() const { return pool && guide; }
};

/// Camera walks that count the emission they meet leave an even world to that.
inline EvenWorld even_world(const TechniqueSet& set) {
  return set.emission ? EvenWorld::left_to_scattering : EvenWorld::sampled;
}

LightWalkSettings walk_settings(const IntegratorSettings& settings, const Pass& pass);

/// One thread's working memory and walks. Reused from sample to sample.
template <KernelProfile profile>
class Kernel {
 public:
  /// Keeps references to all of them. @param film takes the splats @param plane not 0: the film's plane of splats for
  /// another picture than the first
  Kernel(const Scene& scene, const IntegratorSettings& settings, const Pass& pass, Film& film, int plane = 0);

  /// What was traced since this was last asked.
  RayCounts take_counts() { return std::exchange(counts_, {}); }

  /// Gives the film the splats of the light walks since this or drop_splats was last called.
  void give_splats();
  void drop_splats() { splats_.clear(); }

  /// Traces the sample's light walk, connects it to the lens unless `silent`, and appends its photons if there is a
  /// batch.
  void light_sample(const Sampler& sampler, PhotonBatch* batch, bool silent);
  /// Traces the camera walk; connects to the light walk traced last.
  PathEstimate camera_sample(const Sampler& sampler, const CameraRay& camera_ray, int x, int y);
  /// The light walk traced last.
  const LightWalk& light_walk() const { return walk_; }
  /// From now on the records (PhotonRecord) of what is merged are appended, with the luminance that each adds.
  void note_merged(std::vector<std::pair<uint32_t, float>>* merged) { merged_ = merged; }
  /// From now on connections to the pool are noted.
  void note_connected(ConnectionLog* connected) { connected_ = connected; }
  /// Follows the camera walks; null: there are no passes.
  PassRecorder* passes() { return passes_ ? &*passes_ : nullptr; }

 private:
  static constexpr bool k_transparency = profile >= KernelProfile::surfaces;

  /// The camera walk's newest scattering vertex, x_m.
  struct Last {
    Vec3 p_world{0.0f}, ng_world{0.0f}, receiver_normal{0.0f};
    float pdf_solid_angle = 0.0f;  ///< of the direction it scattered to; discrete after delta events
    bool connectible = false;
    uint32_t instance = k_no_index;
    int place = 0;  ///< the guide's leaf of light there
  };
  /// A vertex that techniques work at.
  struct Here {
    const ShadingPoint& point;
    const SurfaceHit& hit;
    const Bsdf& bsdf;
    Vec3 receiver_normal;
    int i;                           ///< its number, x_i
    float previous_per_solid_angle;  ///< cos / d² at x_(i-1)
    int place;                       ///< the guide's leaf of light there
    bool gloss;                      ///< the walk may go on by narrow lobes (TechniqueSet::passes_gloss)
    const EventNumbers& numbers;

    /// The lobes that light which scattered with a density on its way is joined with.
    LobeWidth joined() const { return gloss ? LobeWidth::wide : LobeWidth::any; }
  };
  /// A light chosen for a vertex, and what its shadow ray showed once that was traced.
  struct Chosen {
    const LightSample& light;
    std::optional<Color> seen_through;
    bool depended = false;
  };

  /// Whether emission that the ray meets counts.
  bool finds_emission() const { return pass_.set.emission || only_sharp_; }
  /// Whether denoisers are to be told of what the ray meets.
  bool following() const { return passes_ && passes_->following(); }
  float emission_weight(LightIndex light, const Vec3& n_light, const Vec3& direction, float distance, const Vec2& uv,
                        const LightTraits& traits);
  float follow_weight(LightIndex light, const Vec3& direction, float distance, const Vec2& uv,
                      const LightTraits& traits) const;
  void add_lamps(const Ray& ray, float t_end);
  void add_background(const Vec3& direction);
  void add_surface_emission(const SurfaceHit& hit, const SurfaceBinding& binding, const Vec3& direction, float distance,
                            const Color& emission);
  void add_shadow_linked(const Ray& ray);
  /// Whether light that the ray meets counts there (light linking).
  bool meets(LinkSets linked) const {
    return meets_linked(scene_, linked, (bounces_.ray_kind & k_ray_camera) != 0, last_.instance);
  }
  int place(const SurfaceHit& hit) const { return pass_.guided() ? pass_.guide->light_leaf_at(hit) : 0; }
  /// Where the pool has just become empty, connections go to the own walk again.
  void forget_connections() {
    if (connections_known_ && !pass_.guided())
      for (PathPdfs* pdfs : {&pdfs_, &lens_pdfs_}) std::fill(pdfs->connections.begin(), pdfs->connections.end(), 1.0f);
    connections_known_ = pass_.guided();
  }
  /// Sets PathPdfs::connections of the vertex before, and notes the region if this is the first to connect so far.
  void note_place(const Here& here);
  /// PathPdfs::connections of x_m to a vertex, by where both lie.
  float connections(bool first, int region, int light_leaf) const {
    return static_cast<float>(pass_.pool->picks(first)) * pass_.guide->chosen(region, light_leaf);
  }
  float later_connections(int place_of_m, int light_leaf) const {
    if (pass_.pool->picks(false) == 0) return 1.0f;
    return connections(false, pass_.guide->later_region(place_of_m), light_leaf);
  }
  /// ... with x_m the camera walk's newest vertex.
  float connections_from(const Here& here, int light_leaf) const {
    return here.i == first_ ? connections(true, region_, light_leaf) : later_connections(here.place, light_leaf);
  }
  /// Where the techniques end, some walks go on for what denoisers are to see; false: this one does not.
  /// @param u as stays_following()
  bool follow_alone(float& u) {
    if (!following() || (!follows_alone_ && !passes_->stays_following(u))) return false;
    follows_alone_ = true;
    only_transparent_ = false;
    return true;
  }
  /// Joins the vertex to lights, light walks and photons, as far as the techniques do.
  void join(const Here& here, const Sampler& sampler, uint32_t event_index);
  /// Of the camera walk's surface; where passes have a use for them parts_ too.
  BsdfEval eval(const Bsdf& bsdf, const Vec3& wi_world, const Vec3& wo_world, LobeWidth width = LobeWidth::any) {
    if (passes_) parts_.clear();
    const bool wants_parts = passes_ && passes_->wants_eval_parts(bsdf);
    if (width != LobeWidth::any)
      return bsdf.eval(wi_world, wo_world, Transport::radiance, width, wants_parts ? &parts_ : nullptr);
    if (wants_parts) return bsdf.eval(wi_world, wo_world, Transport::radiance, ReversePdf::yes, parts_);
    return bsdf.eval(wi_world, wo_world, Transport::radiance);
  }
  BsdfSample sample(const Bsdf& bsdf, const Vec3& wi_world, const EventNumbers& numbers) {
    if (passes_) {
      parts_.clear();
      if (follows_alone_)
        return bsdf.sample(wi_world, numbers.lobe, numbers.direction, Transport::radiance, ReversePdf::no);
      if (passes_->wants_sample_parts(bsdf))
        return bsdf.sample(wi_world, numbers.lobe, numbers.direction, Transport::radiance, ReversePdf::yes, parts_);
    }
    return bsdf.sample(wi_world, numbers.lobe, numbers.direction, Transport::radiance);
  }
  /// Bsdf::keep_width, for passes too.
  LobeWidth keep_width(const Bsdf& bsdf, const Vec3& wi_world, BsdfSample& sample) {
    const bool wants_parts = passes_ && passes_->wants_sample_parts(bsdf);
    return bsdf.keep_width(wi_world, Transport::radiance, sample, wants_parts ? &parts_ : nullptr);
  }
  void next_event(const Here& here);
  void next_event(const Here& here, Chosen& chosen, LobeWidth width);
  void connect(const Here& here, const LightWalk& walk, float scale);
  void connect_to_pool(const Here& here, const Sampler& sampler, uint32_t event_index);
  /// Returns what it adds.
  Color connect(const Here& here, const LightWalk& walk, const LightVertex& vertex, float scale, float u_roulette);
  void merge(const Here& here, const Sampler& sampler, uint32_t event_index);
  void connect_to_lens(const LightWalk& walk, const LightVertex& vertex, const Vec2& u_lens, float u_roulette);

  void part_splat(const LightWalk& walk, const LightVertex& vertex, const Vec3& direction_world,
                  const Color& contribution);
  /// Adds splat_parts_ to splats_ for the pixels that the filter gives some of it.
  void splat(const Vec2& raster_px, float u);

  /// The scatter at x_i towards the next vertex, as far as the densities of what lies before it go.
  void set_scatter(const Here& here, const BsdfEval& eval) {
    if (here.i > 1) pdfs_.light[here.i - 1] = eval.pdf_reverse_solid_angle * here.previous_per_solid_angle;
  }
  /// Appends a light walk's densities: `vertex` becomes x_index, those nearer to the light follow.
  void append_light(PathPdfs& pdfs, int index, const LightWalk& walk, const LightVertex& vertex,
                    const LightScatter& scatter) const;
  /// Whether weigh() looks at the path.
  bool weighted(LobeWidth width) const { return pass_.set.weighted() || width == LobeWidth::narrow; }
  /// @param width narrow: of light that comes straight, or by deltas alone, to such lobes (TechniqueSet::at_gloss)
  float weigh(PathPdfs& pdfs, Technique technique, int vertex, const MergeReach& reach,
              LobeWidth width = LobeWidth::any) const {
    if (width == LobeWidth::narrow) return path_weight(pdfs, at_gloss_, pass_.counts, reach, technique, vertex);
    return pass_.set.weighted() ? path_weight(pdfs, pass_.set, pass_.counts, reach, technique, vertex) : 1.0f;
  }
  MergeReach reach_at(const Vec3& p_first_hit) const;
  /// Whether what needs a shadow ray will lose its roulette, which goes by contribution times weight: known before the
  /// weight where the contribution itself is that small.
  bool loses_at_any_weight(const Color& contribution, float u_roulette) const {
    return u_roulette >= max_component(abs(contribution)) * threshold_scale_;
  }

  /// Adds what is left of a contribution after weight and clamping, and returns it.
  Color add(const Color& contribution, Technique technique, float weight, LightIndex light, bool indirect);
  void add_met(const Color& contribution, float weight, LightIndex light, LightSource source, uint16_t group);
  /// For observers: the likeliest kind of event for a pair of directions.
  static uint8_t likeliest_event(const Bsdf& bsdf, const Vec3& wi, const Vec3& wo);
  /// @param depended as for segment_transmittance
  Color visibility(const Ray& ray, uint32_t ray_kind, int transparent_before, bool* depended = nullptr,
                   uint8_t blockers = 0);
  EventCounts counts() const {
    return {bounces_.total, bounces_.diffuse, bounces_.glossy, bounces_.transmission, bounces_.transparent};
  }
  PathCounts path_counts() const {
    return {bounces_.ray_kind, bounces_.total,        bounces_.diffuse,
            bounces_.glossy,   bounces_.transmission, bounces_.transparent};
  }

  const Scene& scene_;
  const IntegratorSettings& settings_;
  const Pass& pass_;
  const TechniqueSet at_gloss_;
  Film& film_;
  const int plane_;
  RayCounts counts_;
  LightWalk walk_;
  LightWalk::Scratch scratch_;
  PathPdfs pdfs_;       ///< the camera walk's, with what it is joined to
  PathPdfs lens_pdfs_;  ///< of light tracing
  std::vector<float> splat_x_, splat_y_;
  struct Splat {
    int x, y, plane;
    Color value;
  };
  std::vector<Splat> splats_;                       ///< for the film, once the sample is whole
  std::vector<std::pair<int, Color>> splat_parts_;  ///< what the planes of the film get of one path
  float threshold_scale_ = k_infinity;
  std::optional<PassRecorder> passes_;
  EvalParts parts_;  ///< with passes: of the newest evaluation on the camera walk
  std::vector<std::pair<uint32_t, float>>* merged_ = nullptr;
  ConnectionLog* connected_ = nullptr;

  // The camera walk under way.
  PathEstimate estimate_;
  Color throughput_{1.0f};
  BounceState bounces_;
  Last last_;
  MergeReach reach_;
  int first_ = 0;  ///< number of the first connectible vertex, and the guide's region there
  int region_ = 0;
  int m_ = 0;  ///< scattering vertices so far
  int pixel_x_ = 0, pixel_y_ = 0;
  uint32_t first_instance_ = ~0u;
  EventSequence events_;          ///< at x_1 ... x_m; with an observer, while a technique works, also of what it joins
  float distance_before_ = 0.0f;  ///< from x_m to the present ray's origin, through transparent surfaces
  bool depended_ = false;         ///< one of these depends on the camera's path: no light walk passes it
  bool only_transparent_ = true;
  bool only_sharp_ = true;          ///< it scattered by deltas, and by narrow lobes where walks pass gloss, alone
  int gloss_ = 0;                   ///< number of the last vertex whose narrow lobes it went on by; 0: none
  bool follows_alone_ = false;      ///< what denoisers are to see is all that the walk still finds
  bool connections_known_ = false;  ///< pdfs_.connections and lens_pdfs_'s may differ from 1
};

extern template class Kernel<KernelProfile::solid>;
extern template class Kernel<KernelProfile::surfaces>;

}  // namespace lambent::bidirectional
