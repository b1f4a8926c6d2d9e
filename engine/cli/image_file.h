// Image files read for comparison.
#pragma once

#include <string>
#include <vector>

#include "engine/base/result.h"

namespace lambent {

/// One layer of an image: float[height][width][channels], row 0 at the top, over the whole display window (what lies
/// outside the data window is 0).
struct ImageLayer {
  int width = 0, height = 0;
  std::vector<std::string> channels;  ///< as in the file
  std::vector<float> pixels;

  size_t pixel_count() const { return static_cast<size_t>(width) * height; }
};

/// The colours of an image: `layer` (a pass, such as "normal" or Blender's "ViewLayer.DiffDir"), or if empty the main
/// picture: R, G, B without a prefix, else those of the first pass called Combined. Alpha is left out. Fails naming the
/// file and, where the layer is missing, the channels it has.
Result<ImageLayer> read_image_layer(const std::string& path, const std::string& layer);

}  // namespace lambent
