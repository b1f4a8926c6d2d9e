// Images as textures: loading, colour spaces, filtering, within a memory limit.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/cancel.h"
#include "engine/base/report.h"
#include "engine/base/vec.h"

namespace lambent {

/// How the file's alpha relates to its colour (Blender's Image.alpha_mode).
enum class ImageAlpha : uint8_t { straight, premultiplied, channel_packed, none };

/// An image to load: exactly one of `path`, `encoded` and `pixels`.
struct ImageSource {
  std::string name;  ///< the user's, for messages
  std::string path;  ///< absolute
  std::span<const uint8_t> encoded;
  std::string extension;          ///< of `encoded`, with the dot
  const float* pixels = nullptr;  ///< float[height][width][channels], row 0 at the bottom
  int width = 0, height = 0, channels = 0;
  std::shared_ptr<const void> owner;  ///< keeps `encoded` or `pixels` alive
  std::string content_hash;           ///< of `encoded`, or of `pixels` and their shape: equal for equal content alone
  std::string colorspace;             ///< OpenColorIO's or Blender's name; empty: decided by the file
  ImageAlpha alpha = ImageAlpha::straight;
};

enum class TextureInterpolation : uint8_t { linear, closest, cubic };
enum class TextureExtension : uint8_t { repeat, extend, clip, mirror };

struct TextureLookup {
  Vec2 uv{0, 0};                  ///< (0, 0) is the lower left corner of the image
  Vec2 duvdx{0, 0}, duvdy{0, 0};  ///< footprint of one pixel; used by images too large to be resident
  TextureInterpolation interpolation = TextureInterpolation::linear;
  TextureExtension extension = TextureExtension::repeat;
  /// Divide colour by alpha, as Blender does where a node's Alpha output is used.
  bool straight_color = false;
};

/// Scene-linear colour, premultiplied by alpha unless straight_color was asked or the image is channel-packed, without
/// alpha, or not a colour.
struct Texel {
  Color color{0.0f};
  float alpha = 1.0f;
};

/// One loaded image; opaque, immutable, freed with its last handle. Defined in texture.h.
class Texture;
using TextureHandle = std::shared_ptr<const Texture>;

/// An image whose header was read and which has its share of the memory: between TextureSystem::reserve and load.
class PendingTexture {
 public:
  PendingTexture(PendingTexture&&) noexcept;
  PendingTexture& operator=(PendingTexture&&) noexcept;
  ~PendingTexture();

 private:
  friend class TextureSystem;
  struct State;
  PendingTexture();
  std::unique_ptr<State> state_;
};

/// Loads images and looks them up. load, add_image and lookup are safe to call from any thread.
class TextureSystem {
 public:
  struct Options {
    size_t memory_limit_bytes = size_t{4} << 30;  ///< of resident images and the tile cache together
    std::string ocio_config;                      ///< path; empty: built-in transforms for Blender's names
    std::string working_space;                    ///< ColorSpaces'
  };

  TextureSystem();
  explicit TextureSystem(const Options& options);
  ~TextureSystem();
  TextureSystem(const TextureSystem&) = delete;
  TextureSystem& operator=(const TextureSystem&) = delete;

  /// Reads an image's header and settles how it is kept. Which images find no room in the memory limit follows from
  /// the order of these calls alone, so pictures do not depend on threads. Such an image goes through the tile cache if
  /// its format lets parts be read (TIFF, EXR, anything tiled); else it is kept smaller, with a warning.
  PendingTexture reserve(const ImageSource& source, Report& report);
  /// Loads (or shares an already loaded) image. Never throws: a missing or corrupt file gives pink (1, 0, 1, 1) as in
  /// Blender and an error that names image and file. Null only if cancelled, within some 40 ms of decoding.
  TextureHandle load(PendingTexture reserved, Report& report, const CancelFlag& cancel);
  /// The same, but texels are read by whoever first asks for one: lookup, texture_average, fetch. What is wrong with
  /// them then goes to take_problems(). Never null.
  TextureHandle defer(PendingTexture reserved);
  /// Loads a deferred image now; false if cancelled.
  bool fetch(const Texture& texture, const CancelFlag& cancel) const;
  /// What was found wrong with deferred images since the last call.
  Report take_problems() const;
  /// reserve and load, without cancelling.
  TextureHandle add_image(const ImageSource& source, Report& report);

  /// Filtered value. Loads a deferred image, which other threads then wait for; black if the thread is interrupted
  /// (RenderContext). Resident images are filtered at full resolution, as in Cycles (the footprint is ignored); those
  /// behind the tile cache at the resolution of the footprint, if the file has resolution levels. Non-finite
  /// coordinates give the value at (0, 0).
  Texel lookup(const Texture& texture, const TextureLookup& lookup) const;

  /// ColorSpaces' of the options.
  const std::optional<std::array<float, 9>>& scene_from_computed() const;

  /// Bytes now held by resident images and the tile cache.
  size_t bytes() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

/// What is wrong with it (code and text), if anything is and it was tried to be loaded.
struct TextureProblem {
  std::string code, message;
};
TextureProblem texture_problem(const Texture& texture);
/// Width and height in px.
struct TextureSize {
  int width = 0, height = 0;
};
TextureSize texture_size(const Texture& texture);
/// Mean colour over the image (estimated from at most 64 x 64 texels), for emission estimates. Loads a deferred one.
Color texture_average(const Texture& texture);

}  // namespace lambent
