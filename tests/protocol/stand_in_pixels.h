// The pixels that the stand-in session renders.
#pragma once

namespace lambent {

inline float stand_in_pixel(int x, int y, int component) {
  return component == 3 ? 1.0f : static_cast<float>(x + 1000 * y) + 0.25f * component;
}

}  // namespace lambent
