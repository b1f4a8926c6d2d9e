// What denoisers ask of a surface beside its albedo, and how far a mirror or glass passes the question on.
#pragma once

#include "engine/base/vec.h"
#include "engine/shading/bsdf_set.h"

namespace lambent {

struct SpecularFeatures {
  Color albedo{0.0f};  ///< of what reflects and refracts sharply
  float roughness =
      0.0f;  ///< mean over the lobes of the root of alpha, by albedo; 1 where a lobe has none, 0 without lobes
};

/// Seen from `wi`, what is transparent left out. As Cycles 5.2: lobes count as sharp below an alpha of 0.15, fading.
SpecularFeatures specular_features(const Bsdf& bsdf, const Vec3& wi_world);

/// Which lobes show what lies behind them (Cycles' kernel/film/denoising_passes.h).
enum class SharpRule : uint8_t {
  at_once,  ///< Cycles before 5.1: below an alpha of 0.075, where they and what is transparent have three quarters
  blended,  ///< since then: by smooth steps of alpha (0 to 0.15) and of what is not sharp (none to half)
};

/// A surface as denoisers are to see it.
struct SurfaceFeatures {
  Color albedo{0.0f};       ///< of what is not sharp
  Vec3 normal_world{0.0f};  ///< mean of the lobes' by albedo, where something is opaque; of at_once transparency's too
  float opaque = 0.0f;      ///< what is not transparent has of the whole
  float shown = 0.0f;       ///< how far the surface itself is shown and not what its sharp lobes show: 0 to 1
};
SurfaceFeatures surface_features(const Bsdf& bsdf, const ShadingPoint& point, SharpRule rule);

/// How sharp a lobe is, 0 to 1; 1 of those that are straight ways on.
float sharpness(const Lobe& lobe, SharpRule rule);

}  // namespace lambent
