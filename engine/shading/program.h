// A material or world as a flat program: compiled once from the node graph, evaluated at shading points.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/base/report.h"
#include "engine/shading/bsdf.h"
#include "engine/shading/shading_point.h"

namespace lambent {

class TextureSystem;

/// Why a program is run: it computes only what is asked.
enum class Ask : uint8_t { surface, transparency, emission };

/// Static facts about a program, for the scene profile and the kernels.
struct ProgramTraits {
  bool emits = false;                ///< emission is not always zero
  bool constant_emission = false;    ///< emission needs no program: `emission`
  Color emission{0.0f};              ///< average or constant estimate, radiance
  bool may_be_transparent = false;   ///< transparency is not always zero: shadow rays must ask
  bool needs_differentials = false;  ///< bump, filtered textures
  bool scatters = false;             ///< has lobes besides emission and transparency
};

// class Program — defined by the shading module; interface:
//   const ProgramTraits& traits() const;
//   std::span<const AttributeRequest> attribute_requests() const;
//   void evaluate(const ShadingPoint&, const TextureSystem*, Bsdf&) const;                 // surface
//   Color transparency(const ShadingPoint&, const TextureSystem*) const;
//   Color emission(const ShadingPoint&, const TextureSystem*) const;                        // also worlds (Background)
//   and lights size_t bytes() const;

}  // namespace lambent
