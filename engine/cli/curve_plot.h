// Error curves drawn as a picture.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/cli/canvas.h"
#include "engine/cli/error_curves.h"

namespace lambent {

/// One diagram: curves over time, both axes logarithmic.
struct Diagram {
  std::string title, time_label;
  std::vector<ErrorCurve> curves;
};

/// Draws diagrams side by side, each 560 x 420 px, curves in the colours of their position in `integrators` (so that
/// one integrator has one colour in all diagrams), with a legend. Curves of other names are not drawn.
Canvas plot(std::span<const Diagram> diagrams, std::span<const std::string> integrators);

}  // namespace lambent
