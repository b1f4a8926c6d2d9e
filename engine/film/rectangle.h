// Pixel rectangles and image channels.
#pragma once

#include <string>

namespace lambent {

/// Half-open pixel rectangle; row 0 at the bottom of the full frame.
struct Rectangle {
  int x = 0, y = 0, width = 0, height = 0;
  friend bool operator==(const Rectangle&, const Rectangle&) = default;

  bool contains(int px, int py) const { return px >= x && px < x + width && py >= y && py < y + height; }
  bool empty() const { return width <= 0 || height <= 0; }
};

/// What a reader of pixels gets.
struct Channel {
  std::string name;
  int components = 4;
  std::string letters = {};  ///< what files call the components, one each; empty: R G B A, or by the name
  friend bool operator==(const Channel&, const Channel&) = default;
};

}  // namespace lambent
