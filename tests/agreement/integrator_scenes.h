// Small scenes that between them have every light, camera, lobe and limit, for comparing integrators.
#pragma once

#include <string>
#include <vector>

#include "tests/common/scene_maker.h"

namespace lambent::test {

/// A scene and which integrators find all of its light (the path tracer always does). Not LT where the camera sees
/// something through delta surfaces, not VPL where light arrives through them (caustics); merging blurs by its radius,
/// so PPM and BPM render what is flat and open, VCM with a small radius everything.
struct IntegratorCase {
  std::string name;
  SceneMaker maker;
  std::vector<std::string> integrators;
};

/// A world brighter towards one side and with a hard edge: its importance map matters.
description::Graph uneven_world();

std::vector<IntegratorCase> light_cases();
std::vector<IntegratorCase> camera_cases();
std::vector<IntegratorCase> lobe_cases();
std::vector<IntegratorCase> surface_cases();
/// Narrow gloss (LobeWidth), by which camera walks of VPL and PPM go on, under all that may light it.
std::vector<IntegratorCase> gloss_cases();
std::vector<IntegratorCase> limit_cases();
/// Light and shadow linking.
std::vector<IntegratorCase> linking_cases();

/// All of them.
std::vector<IntegratorCase> integrator_cases();

}  // namespace lambent::test
