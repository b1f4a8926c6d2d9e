// Renders through an Integrator itself, without a session: for tests that look inside.
#pragma once

#include <memory>

#include "engine/film/film.h"
#include "engine/integrators/integrator.h"
#include "tests/common/scene_maker.h"

namespace lambent::test {

/// Builds what `maker` describes; fails the test if that does not work.
std::shared_ptr<const Scene> build_scene(const SceneMaker& maker);

/// Renders `samples` samples a pixel as a session would, on one thread: prepare, then for each sample the stages and
/// the tiles. `settings` are taken as they are, but for the kernel's profile if `profile` is left out.
std::shared_ptr<Film> render_directly(const std::string& integrator, const std::shared_ptr<const Scene>& scene,
                                      IntegratorSettings settings, int64_t samples,
                                      std::optional<KernelProfile> profile = {});

}  // namespace lambent::test
