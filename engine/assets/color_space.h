// From an image's named colour space to scene-linear: Rec. 709 primaries, unless the configuration or the user's choice
// of a working space says otherwise.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "engine/base/vec.h"

namespace lambent {

/// sRGB's decoding (IEC 61966-2-1) of one channel; linear below 0, the power curve continues above 1.
float linear_from_srgb(float encoded);
/// Likewise by table: absolute error below 1e-6 on [0, 1].
float linear_from_srgb_fast(float encoded);
float srgb_from_linear(float linear);

/// What has to be done with an image's values.
struct ColorConversion {
  enum class Kind : uint8_t {
    none,  ///< scene-linear already, or data
    srgb,  ///< linear_from_srgb, after filtering (as Cycles does, so that 8-bit files stay 8-bit)
    apply  ///< `transform`, before filtering
  };
  /// Converts n pixels of 3 floats, `stride` floats apart, in place. Thread-safe.
  class Transform {
   public:
    virtual ~Transform() = default;
    virtual void apply(float* rgb, size_t n, int stride) const = 0;
  };
  Kind kind = Kind::none;
  bool is_data = false;  ///< not a colour: alpha stays apart
  std::shared_ptr<const Transform> transform;
  std::string warning;  ///< not empty: the space is unknown, and what was used in its place
};

/// Names to conversions, by an OpenColorIO configuration or, without one, by built-in transforms of Blender's names.
class ColorSpaces {
 public:
  /// @param ocio_config path of a configuration; empty: built-in. A configuration that does not load gives the built-in
  /// ones and a non-empty error().
  /// @param working_space a colour space of it that takes the place of its scene_linear role's; empty: that one
  explicit ColorSpaces(const std::string& ocio_config, const std::string& working_space = "");
  ~ColorSpaces();

  /// @param name OpenColorIO's or Blender's; empty: `file_is_float` decides (scene-linear, else sRGB).
  ColorConversion find(const std::string& name, bool file_is_float) const;
  const std::string& error() const { return error_; }
  /// Rows of the matrix from linear Rec. 709 to scene-linear; none if they are the same.
  const std::optional<std::array<float, 9>>& scene_from_rec709() const { return scene_from_rec709_; }
  /// The same for colours that shaders compute from CIE XYZ, in what the matrix of Lindbloom (sRGB, D65) makes of it:
  /// as Cycles, by the configuration's own way from ACES 2065-1 to scene-linear, if it names that space.
  const std::optional<std::array<float, 9>>& scene_from_computed() const { return scene_from_computed_; }

 private:
  struct Config;
  std::unique_ptr<Config> config_;
  std::string error_;
  std::string rec709_name_;  ///< of the configuration, if scene-linear is another space
  std::optional<std::array<float, 9>> scene_from_rec709_, scene_from_computed_;
};

}  // namespace lambent
