// What denoisers ask of a surface beside its albedo.
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

}  // namespace lambent
