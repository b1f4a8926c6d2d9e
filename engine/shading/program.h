// A material or world as a flat program: compiled once from the node graph, evaluated at shading points.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/report.h"
#include "engine/shading/bsdf_set.h"
#include "engine/shading/shading_point.h"

namespace lambent {

class Texture;
class TextureSystem;
using TextureHandle = std::shared_ptr<const Texture>;

/// Why a program is run: it computes only what is asked.
enum class Ask : uint8_t { surface, transparency, emission };

/// Static facts about a program, for the scene profile and the kernels.
struct ProgramTraits {
  bool emits = false;                ///< emission is not always zero
  bool constant_emission = false;    ///< emission needs no program: `emission`
  Color emission{0.0f};              ///< average or constant estimate, radiance
  bool emits_negative = false;       ///< emission may be negative: not a constant, nor built of what never is
  bool may_be_transparent = false;   ///< transparency is not always zero: shadow rays must ask
  bool transparent_shadow = true;    ///< false: they need not, it blocks them all the same
  bool needs_differentials = false;  ///< bump, filtered textures
  bool scatters = false;             ///< has lobes besides emission and transparency
  bool reads_particle = false;       ///< asks for ShadingPoint::particle
  bool casts_rays = false;           ///< looks around: ShadingPoint::rays
  bool holdout = false;              ///< has holes
  bool subsurface = false;           ///< has subsurface lobes
  bool portal = false;               ///< sends rays elsewhere
  bool subsurface_normal = false;    ///< whose normals are not the surface's
  /// The lobes or the transparency change with the direction towards the camera (Layer Weight, Fresnel, Incoming, the
  /// layers of Principled 2), so that a walk from a light must evaluate again for the direction in which it connects.
  /// Not counted: the side of the surface that is seen, and what bends bumped normals back towards the view.
  bool view_dependent = false;
  /// The lobes, the transparency or the emission change with the path that led here (Light Path).
  bool path_dependent = false;
  /// Displacements: what they give changes with the object's rotation and scale, or with where it stands.
  bool reads_orientation = false, reads_place = false;
  float sun_angle_rad = 0.0f;  ///< worlds: whole angle of a sun's disc in the sky, which a map may miss; 0: none
  Vec3 sun_direction_world{0, 0, 1};
};

/// Whether light may go straight through a surface, seen by rays of a kind.
inline bool lets_through(const ProgramTraits& traits, uint32_t ray_kind) {
  return traits.may_be_transparent && (traits.transparent_shadow || ray_kind != k_ray_shadow);
}

/// What one AOV output node gives at a point.
struct AovValue {
  Color color{0.0f};
  float number = 0.0f;
};

class ProgramData;  // the code and its constants; program_data.h

/// Immutable, shared by threads. Evaluation allocates nothing; see program.cpp for the interpreter.
class Program {
 public:
  explicit Program(std::unique_ptr<const ProgramData> data);
  ~Program();

  const ProgramTraits& traits() const { return traits_; }
  /// What to fill ShadingPoint::attributes with, in this order. At most k_max_attributes.
  std::span<const AttributeRequest> attribute_requests() const;

  /// Fills `bsdf` (begin() included) with the lobes and emission at the point.
  /// @param textures may be null; images then give their mean colour.
  void evaluate(const ShadingPoint& point, const TextureSystem* textures, Bsdf& bsdf) const;
  /// Weight of light that passes straight through; in [0, inf) per channel.
  Color transparency(const ShadingPoint& point, const TextureSystem* textures) const;
  /// Radiance towards wi_world. Also worlds (Background; wi_world = minus the ray's direction) and lights.
  Color emission(const ShadingPoint& point, const TextureSystem* textures) const;

  /// What compile_displacement() made: by how much the vertex at the point moves, in object space. Its normals are
  /// those along which it moves; wi is 0. May be non-finite.
  Vec3 displacement(const ShadingPoint& point, const TextureSystem* textures) const;
  /// Whether two displacements compute the same from the same images.
  friend bool same_displacement(const Program& a, const Program& b);

  /// The AOV of that name that the graph writes: its number, -1 if there is none.
  int find_aov(std::string_view name) const;
  int aov_count() const { return aov_count_; }
  /// As evaluate(), and what all AOVs of the graph are there, in the same run of the nodes. @param aovs [aov_count()]
  void evaluate_with_aovs(const ShadingPoint& point, const TextureSystem* textures, Bsdf& bsdf,
                          std::span<AovValue> aovs) const;

  /// The images that it may look up.
  std::vector<TextureHandle> images() const;

  /// For the compiler, before the program is shared.
  void set_emission_estimate(const Color& mean_radiance) { traits_.emission = mean_radiance; }

  /// Heap memory of the program, textures not included.
  size_t bytes() const;

 private:
  std::unique_ptr<const ProgramData> data_;
  ProgramTraits traits_;
  int aov_count_ = 0;
};

}  // namespace lambent
