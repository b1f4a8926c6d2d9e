// How much of what the camera sees is seen by each light: a light behind a wall or in a lamp's glass must not be chosen
// as often as its distance asks for.
#pragma once

#include <vector>

#include "engine/base/cancel.h"
#include "engine/camera/camera.h"
#include "engine/geometry/geometry.h"
#include "engine/lights/light_set.h"

namespace lambent {

/// By light, the share (in (0, 1], smoothed and bounded below, so that nothing is given up) of the receivers choosing
/// it that see it: for LightSet::scale_importance. Receivers are what some thousand walks from the camera meet, which
/// go on by cosine or straight through; neighbours in the light tree are counted together. Surfaces that let
/// shadow rays through block nothing. Empty if there is nothing to learn: fewer than two finite lights, no geometry, or
/// cancelled. Parallel; the same whatever the number of threads. Costs some 20,000 rays.
std::vector<float> learn_light_visibility(const Geometry& geometry, const Camera& camera, const LightSet& lights,
                                          const CancelFlag& cancel);

}  // namespace lambent
