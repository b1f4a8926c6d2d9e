// Passes: what a sample adds to them, the same in every integrator.
//
// A pass of light is a rule over the path that brought the light (its events, its light, its technique); a pass of data
// is what the camera sees first. PassPlan turns what the user asked for into film channels; a PassRecorder follows one
// camera walk (and the light walks that splat) and fills a sample of them. Nothing of this exists in a render that asks
// for no passes.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/check.h"
#include "engine/base/report.h"
#include "engine/film/film.h"
#include "engine/path/event_counts.h"
#include "engine/path/light_path_expression.h"
#include "engine/path/light_walk.h"
#include "engine/path/technique.h"
#include "engine/scene/scene.h"
#include "engine/shading/denoising_features.h"

namespace lambent {

/// Another picture that passes are made of: of a changed scene, by the same random numbers, so that most of the noise
/// is the same too.
enum class OtherPicture : uint8_t {
  without_shadows,  ///< of a scene whose chosen objects cast no shadows (nor reflections...)
  catcher_lit,      ///< of the shadow catchers alone; what else there is stands before them and shades them, unseen
  catcher_bare,     ///< ... and does not shade them
};
inline constexpr int k_other_pictures = 3;

/// PROTOCOL.md, section "Passes", says what each shows.
enum class PassKind : uint8_t {
  depth,
  mist,
  position,
  normal,
  uv,
  object_index,
  material_index,
  diffuse_direct,
  diffuse_indirect,
  diffuse_color,
  glossy_direct,
  glossy_indirect,
  glossy_color,
  transmission_direct,
  transmission_indirect,
  transmission_color,
  volume_direct,
  volume_indirect,
  volume_scatter,
  volume_transmit,
  volume_majorant,
  emission,
  environment,
  ambient_occlusion,
  shadow,
  sample_count,
  noisy,
  noisy_shadow_catcher,
  denoising_albedo,
  denoising_normal,
  denoising_depth,
  denoising_specular_albedo,
  denoising_roughness,
  aov_color,
  aov_value,
  light_group,
  cryptomatte_object,
  cryptomatte_material,
  cryptomatte_asset,
  caustics_direct,
  caustics_indirect,
  technique_unidirectional,
  technique_connection,
  technique_merging,
  light_path,
  without_shadow,
  shadow_difference,
  shadow_ratio,
  shadow_catcher,
  error,
  time,
  render_time,
  vector,
  matte_light,
  matte,
  // Parts of others; nobody asks for them.
  unshadowed,     ///< what `shadow` is divided by
  vector_weight,  ///< what `vector` is divided by: share of the samples that met something
  catcher_lit,
  catcher_bare,
  catcher_cover,
  catcher_behind
};

/// Names that a client may ask for.
std::vector<std::string> pass_kind_names();

struct PassRequest {
  std::string name;      ///< of the channel
  std::string kind;      ///< one of pass_kind_names()
  std::string argument;  ///< what the kind asks for
};

struct PassSettings {
  float mist_start_m = 5.0f, mist_depth_m = 25.0f;
  float mist_exponent = 2.0f;  ///< 1 linear, 2 quadratic, 0.5 inverse quadratic
  float ambient_occlusion_distance_m = 10.0f;
  float alpha_threshold = 0.5f;
  int transparent_bounces = 8;
  float exposure = 1.0f;
  bool film_transparent = false;
  uint32_t seed = 0;
  /// Where light tracing brings something to the lens: vertices of the shortest path that it does (TechniqueSet).
  /// Passes that no such path counts for have no planes of splats.
  int first_light_tracing = 1;
};

/// The passes of one render. Immutable.
class PassPlan {
 public:
  /// Passes that cannot be made (unknown kinds and arguments, names given twice, too many) are reported by name and
  /// left out. Null if none is left and the picture needs none for itself (shadow catchers do).
  static std::shared_ptr<const PassPlan> create(const std::vector<PassRequest>& requests, const Scene& scene,
                                                const PassSettings& settings, Report& report);

  static constexpr size_t k_most_channels = 256;

  /// For the film: the picture first, then the passes in the order of the requests, hidden ones last.
  const std::vector<FilmChannel>& channels() const { return channels_; }
  /// Some pass, or the picture, is made of it: IntegratorSettings::others.
  bool wants(OtherPicture picture) const { return other_channel(picture) >= 0; }
  /// Where its splats go.
  int plane(OtherPicture picture) const { return layout_.places[static_cast<size_t>(other_channel(picture))].plane; }
  /// Some pass asks for the sequence of events.
  bool wants_events() const { return events_; }
  /// Some pass is a part of the light of another picture: its kernels need a PassRecorder.
  bool wants_parts(OtherPicture picture) const { return !other_light(picture).empty(); }

 private:
  friend class PassRecorder;
  struct Pass {
    PassKind kind;
    int channel = 0;
    int sample = 0;                      ///< first of its floats in a sample
    int divisor = 0;                     ///< that of what it is divided by
    bool picture = false;                ///< the whole picture, to be compared with another
    std::optional<uint16_t> group = {};  ///< of lights; the passes of shadows without one are of the whole picture
    size_t matte = 0;                    ///< Scene::mattes()
    std::string aov = {};
    std::optional<LightPathExpression> expression = {};
  };

  /// Where a contribution goes without looking through all passes: first floats of passes in a sample, -1: none asks.
  struct LightSlots {
    int emission = -1, environment = -1;
    std::array<int, k_lobe_classes> direct{-1, -1, -1}, indirect{-1, -1, -1};
    std::array<int, static_cast<size_t>(Technique::merging) + 1> techniques;
    int caustics_direct = -1, caustics_indirect = -1;
    std::vector<int> groups;    ///< by number of the light group
    std::vector<Pass> by_rule;  ///< all other passes: each is asked
  };
  static LightSlots slots_of(const std::vector<Pass>& passes);

  /// The same for what the camera sees. A kind that is asked for twice is copied when the sample is done.
  struct DataSlots {
    std::array<int, k_lobe_classes> colors{-1, -1, -1};
    int denoising_albedo = -1, denoising_specular_albedo = -1, denoising_roughness = -1, mist = -1,
        ambient_occlusion = -1;
    int shadow = -1, unshadowed = -1;
    int vector = -1, vector_weight = -1, normal = -1, uv = -1, denoising_normal = -1, denoising_depth = -1;
    int time = -1, render_time = -1;
    float mist_per_m = 0.0f;                                     ///< how much thicker it is a metre further on
    bool albedos = false, sharp = false, first_surface = false;  ///< some of these
    bool features = false;                                       ///< denoising albedo, normal or depth
    SharpRule sharp_rule = SharpRule::at_once;                   ///< of these
    bool world_moves = false;                                    ///< `vector` is also of samples that meet nothing
  };
  struct Copy {
    int from, to, floats;
  };
  void take_data_slot(const Pass& pass);

  void add(const PassRequest& request, PassKind kind, FilmChannel channel, const Scene& scene, Report& report);
  void divide(const Pass& pass);
  void compare_with_unshadowed();
  void catch_shadows(bool mattes);
  void lay_out();
  int other_channel(OtherPicture picture) const { return other_channels_[static_cast<size_t>(picture)]; }
  const std::vector<Pass>& other_light(OtherPicture picture) const {
    return other_light_[static_cast<size_t>(picture)];
  }
  std::vector<Pass>& other_light(OtherPicture picture) { return other_light_[static_cast<size_t>(picture)]; }
  const FilmLayout::Place& place(const Pass& pass) const { return layout_.places[static_cast<size_t>(pass.channel)]; }

  inline static const std::vector<Pass> k_none;
  PassSettings settings_;
  std::vector<FilmChannel> channels_{{.name = "combined", .splats = true}};
  std::vector<Pass> light_;            ///< sums what paths bring
  std::vector<Pass> data_;             ///< shows what the camera sees, or how it was sampled
  std::vector<Pass> pictures_, late_;  ///< those of them that are known when the sample is done
  std::vector<Pass> looked_at_;        ///< those of rule first
  std::vector<Pass> aovs_, mattes_;    ///< those of data_ of these kinds
  std::vector<PassKind> ids_;          ///< of Cryptomatte, in the order of the film's (FilmLayout::id_channels)
  LightSlots slots_;
  DataSlots data_slots_;
  std::vector<Copy> copies_;
  std::array<LightSlots, k_other_pictures> other_slots_;
  std::array<std::vector<Pass>, k_other_pictures> other_light_;  ///< as light_, of what paths bring in another picture
  FilmLayout layout_;
  std::array<int, k_other_pictures> other_channels_{-1, -1, -1};
  bool events_ = false;
  bool classes_ = false;      ///< some pass asks which class of lobes scattered at x_1
  bool expressions_ = false;  ///< some pass asks for all events
};

/// What light came through, for the passes of light.
struct PathSignature {
  int vertices = 0;  ///< n of technique.h
  const ClassShares* first =
      nullptr;           ///< of the scattering at x_1; null if n = 0 or no pass asks for it, see first_only
  EventSequence events;  ///< at x_1 ... x_n; kept only if a pass asks for it
  LightSource source = LightSource::lamp;
  uint16_t group = 0;  ///< number of the light's group
  Technique technique = Technique::emission_hit;
  bool brought = false;  ///< to a matte (x_1) by way of an object that is none; told in the picture catcher_lit alone
  std::optional<LobeClass> first_only = {};  ///< the class that has all of it at x_1: `first` is not looked at

  Color share(LobeClass c, const Color& value) const {
    if (first_only) return *first_only == c ? value : Color(0.0f);
    return value * first->of[static_cast<size_t>(c)];
  }
};

/// One thread's: follows one sample at a time.
///
/// A kernel that does next event at the first surface, and whose walk goes on from there, may share both: what its
/// light and its next ray show are the light received and the occlusion that passes ask for (share()). An even world is
/// no light that its next event chooses: the surface receives it by the next ray, by what that meets. Else the recorder
/// samples a light and traces rays of its own, in some of the samples: a Shadow pass is a ratio of sums, to which it
/// does not matter how many there are, and ambient occlusion a share (ChannelRule::share).
class PassRecorder {
 public:
  /// Keeps references.
  PassRecorder(const PassPlan& plan, const Scene& scene);
  /// For the parts (PassPlan::wants_parts) of another picture of `scene`: it records light alone.
  PassRecorder(const PassPlan& plan, const Scene& scene, OtherPicture picture);

  /// The kernel will tell received() of all lights that it samples while receiving(), sampled(), leave(), the even
  /// world that its next ray meets or does not (met_world(), hide_world()), and next_ray().
  void share() { shared_ = true; }

  /// The time of a pixel's samples is that since those of the pixel before, or since this.
  void start_clock();

  // --- The camera walk, in this order -------------------------------------------------------------------------------
  /// @param floats where the sample goes: FilmLayout::sample_floats zeros, to live until finish(); without, the
  /// recorder has floats of its own
  void begin(int x, int y, uint32_t sample, std::span<float> floats);
  void begin(int x, int y, uint32_t sample);
  /// evaluate() is to run the program at a surface that the camera sees, for the passes too.
  bool evaluates(const Program& program) const { return wants_aovs_ && program.aov_count() > 0; }
  void evaluate(const Program& program, const ShadingPoint& point, Bsdf& bsdf);
  /// A surface that the camera sees: directly or through transparent ones, whose transmittance is `throughput`.
  void visible(const SurfaceHit& hit, const SurfaceBinding& binding, const ShadingPoint& point, const Bsdf& bsdf,
               const Color& throughput);
  /// Next event is at the surface just seen: received() is to be told of its light.
  bool receiving() const { return receiving_; }
  /// The walk goes on under the surface: what is received where it comes out is none of this surface's.
  void pass_under() { receiving_ = false; }
  /// Light that a sampled light sends to the surface just seen and on to the camera, with what stands before the light
  /// and without; throughput included.
  void received(const Color& shadowed, const Color& unshadowed) {
    add_to(plan_.data_slots_.shadow, shadowed);
    add_to(plan_.data_slots_.unshadowed, unshadowed);
  }
  /// How the surface just seen sent the walk on, or would have: by lobe number `picked` of its several.
  void sampled(const SurfaceHit& hit, const ShadingPoint& point, const Bsdf& bsdf, const BsdfSample& sample,
               int picked);
  /// The walk scatters, and not straight on.
  void leave(const BsdfSample& sample) {
    meets_world_ = receiving_ && !(sample.event & k_scatter_delta) && scene_.lights().has_even_world();
    world_hidden_ = receiving_ = false;
  }
  bool waits_for_world() const { return meets_world_; }
  /// The even world that the next ray met. @param counts as light for the walk
  void met_world(const Color& radiance, bool counts) {
    received(counts ? radiance : Color(0.0f), world_hidden_ ? Color(0.0f) : radiance);
  }
  /// hide_world() is to be told if something stands before the world in the next ray's direction; a transparent surface
  /// perhaps.
  bool meets_world() const { return meets_world_ && !world_hidden_; }
  void hide_world(const Vec3& direction_world, const Color& throughput, const PathCounts& counts);
  /// The walk's next ray: what it met (null: nothing) at distance t. Asked for by waits_for_ray().
  void next_ray(float t, const Program* met);
  bool waits_for_ray() const { return occlusion_ == Occlusion::next_ray; }
  /// The walk scattered at its next vertex, on `instance`. @param parts of the evaluation in that direction, or null
  void scattered(uint32_t instance, const Bsdf& bsdf, const Vec3& wi_world, const BsdfSample& sample,
                 const EvalParts* parts = nullptr);
  /// What denoisers are to see (albedo, normal, depth) is not found yet: the walk has met nothing but what is sharp or
  /// transparent. follow(), followed() and follow_light() are to be told of each surface and light that it meets.
  bool following() const { return following_; }
  /// Whether a walk that would go on for following() alone does: a third of those that still show something whole, and
  /// fewer the less they show. It then stands for the others. @param u uniform, and again afterwards
  bool stays_following(float& u) {
    const float stays = shown_ / 3.0f;
    following_ = u < stays;
    if (!following_) return false;
    u /= stays;
    shown_ /= stays;
    stands_for_ /= stays;
    return true;
  }
  /// A surface. @param throughput the walk's there @param segment_m from the surface before @param sampled the share of
  /// walks that got here which go on (roulette): what they scatter stands for the others
  void follow(const ShadingPoint& point, const Bsdf& bsdf, const Color& throughput, float segment_m, float sampled);
  /// How that surface sends the walk on.
  void followed(const BsdfSample& sample, const Bsdf& bsdf, const Color& throughput);
  /// Light that the walk meets, throughput and the weight of the path tracer's rays included.
  void follow_light(const Color& value) { add_if(plan_.data_slots_.denoising_albedo, value * shown_); }
  /// The walk met nothing behind transparent surfaces alone.
  void missed(const Vec3& direction_world);
  /// Light that the walk met.
  void met(const Color& value, LightSource source, uint16_t group);
  /// The camera sees the world along `direction` through a transparent film: no part of the picture, but of what shows
  /// the world (as in Cycles).
  void see_through(const Vec3& direction_world, const Color& throughput, const PathCounts& counts);
  /// Light that was joined to the walk at its newest vertex, seen from `wi_world`, along `wo_world`; `light_side` are
  /// the events at x_(m+1) ... x_n (what connections join last is the first of them). @param walk whose they are; null
  /// where light_side is empty or of a photon @param parts of the evaluation in that direction, or null
  void joined(const Color& value, uint32_t instance, const Bsdf& bsdf, const Vec3& wi_world, const Vec3& wo_world,
              Technique technique, const EventSequence& light_side, LightSource source, uint16_t group,
              const LightWalk* walk = nullptr, const EvalParts* parts = nullptr);
  /// The same of a light that next event sampled.
  void lit(const Color& value, uint32_t instance, const Bsdf& bsdf, const Vec3& wi_world, const Vec3& wo_world,
           LightSource source, uint16_t group, const EvalParts& parts);
  /// What the sample is in another picture, exposure included. @param cover of catcher_lit: share of the sample that
  /// the catchers take @param parts the recorder of that picture's sample, or null
  void add_other(OtherPicture picture, const Color& radiance, float cover, const PassRecorder* parts);
  /// Completes the sample's floats. `picture` is the film's first channel, `behind` what of the world it would have
  /// where shadow catchers are, exposure included. @param last of this pixel's for now: it gets the time of all of
  /// them, whose mean is the same, as asking for the time takes longer than much of what passes ask
  void finish(const Vec4& picture, const Color& behind, bool last);

  // --- Light walks --------------------------------------------------------------------------------------------------
  /// What a light walk's vertex sends to the lens: calls splat(plane, color) for each pass of light that takes some.
  template <typename Splat>
  void splatted(const Color& value, const PathSignature& signature, Splat&& splat) const {
    for (const PassPlan::Pass& pass : light_) {
      Color part;
      if (!takes(pass, signature, value, part)) continue;
      const int plane = plan_.place(pass).plane;
      CHECK(plane >= 0, "light tracing reaches a pass that PassPlan took for one that it does not");
      splat(plane, part);
    }
  }
  bool wants_light() const { return !light_.empty(); }
  bool wants_events() const { return events_wanted_; }
  bool wants_classes() const { return classes_; }
  /// Whether joined() and scattered() have a use for what the walk's next evaluation tells of classes and events.
  bool wants_eval_parts(const Bsdf& bsdf) const {
    return (events_wanted_ || (classes_ && vertices_ == 0)) && bsdf.lobes().size() > 1;
  }
  /// The same of its next sample, or sampled() asks which lobe was picked.
  bool wants_sample_parts(const Bsdf& bsdf) const {
    return wants_eval_parts(bsdf) || (occlusion_ == Occlusion::scattering && bsdf.lobes().size() > 1);
  }
  /// Whether a light walk scatters at an object that is no catcher, up to `depth` from the light; asked for mattes.
  bool meets_other(const LightWalk& walk, int depth) const;
  bool wants_mattes() const { return mattes_; }
  /// An event for a pair of directions, chosen by what each kind of lobe has of the light.
  uint8_t event_at(const Bsdf& bsdf, const Vec3& wi_world, const Vec3& wo_world, const EvalParts* parts = nullptr) {
    return bsdf.lobes().size() == 1 ? bsdf.facts_of_only_lobe(wi_world, wo_world).event
                                    : event_of_several(bsdf, wi_world, wo_world, parts);
  }

 private:
  /// Of the seed and the pixel.
  uint32_t pixel_hash() const;
  /// Uniform in [0, 1).
  float random();
  /// What a surface is sampled for by passes alone.
  enum class Own : uint32_t { occlusion, light, world };
  /// Whether this sample is the one in `step` that does so.
  bool samples_for_passes(uint32_t step) const { return sample_ % step == 0; }
  /// Uniform in [0, 1)³ and well spread over those samples; others for each surface that one sees.
  Vec3 numbers(Own what, uint32_t step) const;
  static bool takes(const PassPlan::Pass& pass, const PathSignature& path, const Color& value, Color& part);
  void add(const Color& radiance, const PathSignature& path);
  void add_joined(const Color& value, uint32_t instance, const Bsdf& bsdf, const Vec3& wi_world, const Vec3& wo_world,
                  Technique technique, const EventSequence& light_side, LightSource source, uint16_t group,
                  const LightWalk* walk, const EvalParts* parts);
  void add_by_rule(const Color& radiance, PathSignature path);
  void add_to(const PassPlan::Pass& pass, const Color& value) { add_to(pass.sample, value); }
  void add_to(int sample_float, const Color& value) {
    float* to = values_ + sample_float;
    to[0] += value.x;
    to[1] += value.y;
    to[2] += value.z;
  }
  /// @param sample_float -1: nowhere
  void add_if(int sample_float, const Color& value) {
    if (sample_float >= 0) add_to(sample_float, value);
  }
  uint8_t event_of_several(const Bsdf& bsdf, const Vec3& wi_world, const Vec3& wo_world, const EvalParts* parts);
  void add_colors(const ShadingPoint& point, const Bsdf& bsdf, const Color& throughput);
  void add_sharp(const ShadingPoint& point, const Bsdf& bsdf, const Color& throughput);
  float mist(const ShadingPoint& point) const;
  void add_ids(const SurfaceBinding& binding, const ShadingPoint& point, float cover);
  void first_surface(const SurfaceHit& hit, const ShadingPoint& point, const Bsdf& bsdf, float seen);
  void add_motion(const Vec4& motion_px);
  void finish_time();
  void add_aovs(const Program& program, float cover);
  void look(int x, int y);
  void look_at(const PassPlan::Pass& pass, const ShadingPoint& point);
  bool opaque_enough(const SurfaceBinding& binding, const Bsdf& bsdf) const;
  void occlusion(const SurfaceHit& hit, const ShadingPoint& point, const Bsdf& bsdf, float cover);
  void occlude(const SurfaceHit& hit, const ShadingPoint& point);
  void add_occlusion(float open, float weight = 1.0f);
  float open(const Ray& ray) const;
  void receive_world(const SurfaceHit& hit, const ShadingPoint& point, const Bsdf& bsdf, const Color& throughput);
  void sample_received(const SurfaceHit& hit, const ShadingPoint& point, const Bsdf& bsdf, const Color& throughput);
  /// @param blockers LinkSets' of the light at its end
  Color transmittance(const Ray& ray, uint8_t blockers = 0) const;
  const Color& other(OtherPicture picture) const { return others_[static_cast<size_t>(picture)]; }
  float* at(const PassPlan::Pass& pass) { return values_ + pass.sample; }

  const PassPlan& plan_;
  const Scene& scene_;
  const std::vector<PassPlan::Pass>&light_, &data_;  ///< those that this records
  const PassPlan::LightSlots& slots_;
  std::vector<float> own_;
  float* values_ = nullptr;
  const bool classes_ = false, events_wanted_ = false;                      ///< as PassPlan's
  const bool mattes_ = false;                                               ///< follows what is brought to mattes
  const bool wants_aovs_ = false, wants_features_ = false, looks_ = false;  ///< as PassPlan's, of what this records
  bool shared_ = false;
  bool receiving_ = false;     ///< next event is to tell what the surface just seen receives
  bool meets_world_ = false;   ///< the even world that the next ray meets is received by what the camera saw
  bool world_hidden_ = false;  ///< ... and something stands before it
  int x_ = 0, y_ = 0;
  uint32_t sample_ = 0;
  uint32_t surfaces_ = 0;  ///< seen in the sample so far
  bool random_begun_ = false;
  uint32_t random_state_ = 0;
  std::chrono::steady_clock::time_point start_;
  std::array<Color, k_other_pictures> others_{Color(0.0f), Color(0.0f), Color(0.0f)};
  float cover_ = 0.0f;  ///< of shadow catchers
  // The camera walk under way.
  int vertices_ = 0;
  ClassShares first_;  ///< at x_1
  std::optional<LobeClass> first_only_;
  EventSequence events_;
  mutable uint32_t pixel_hash_ = 0;
  mutable int hashed_x_ = -1, hashed_y_ = -1;  ///< that it is of
  bool on_matte_ = false, met_other_ = false;  ///< x_1 is on a matte; an object that is none has scattered the walk
  bool saw_surface_ = false;                   ///< one that is opaque enough for normals, UVs...
  // What denoisers are to see: how far what the walk meets is shown, the samples that it stands for, and what was at
  // the last surface.
  bool following_ = false;
  float shown_ = 1.0f, stands_for_ = 1.0f;
  SurfaceFeatures features_;
  std::vector<AovValue> aov_values_;
  const Program* aovs_of_ = nullptr;     ///< what aov_numbers_ are of
  std::vector<int> aov_numbers_;         ///< by PassPlan::aovs_
  const TriangleMesh* uv_of_ = nullptr;  ///< what uv_number_ is of
  int uv_number_ = -1;
  /// Ambient occlusion by the walk's own next ray: where it is lost, the same ray is traced.
  enum class Occlusion : uint8_t { done, scattering, next_ray } occlusion_ = Occlusion::done;
  Ray occlusion_ray_;
  float occlusion_cover_ = 0.0f;
};

}  // namespace lambent
