// The inside of one texture: resident pixels, or a file behind the tile cache.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "engine/assets/color_space.h"
#include "engine/assets/texture_system.h"

namespace lambent {

enum class TexelType : uint8_t { u8, u16, f16, f32 };
inline size_t texel_bytes(TexelType type) { return type == TexelType::u8 ? 1 : type == TexelType::f32 ? 4 : 2; }

/// Reads texels of images that are not resident.
class TileSource {
 public:
  virtual ~TileSource() = default;
  /// Width and height of a resolution level; level 0 is the file's own.
  virtual TextureSize size(int level) const = 0;
  virtual int levels() const = 0;
  /// One texel as the file has it, 4 floats (missing channels: grey repeats, alpha 1), row 0 at the bottom.
  virtual void read(int level, int x, int y, float* rgba) const = 0;
  virtual size_t bytes() const = 0;
};

class Texture {
 public:
  Texture() = default;
  ~Texture() {
    if (resident_total) resident_total->fetch_sub(counted_bytes);
  }
  Texture(const Texture&) = delete;
  Texture& operator=(const Texture&) = delete;

  int width = 1, height = 1;
  int channels = 4;  ///< 1, 3 or 4 as stored
  TexelType type = TexelType::f32;
  std::vector<uint8_t> pixels;        ///< resident texels, row 0 at the bottom
  std::unique_ptr<TileSource> tiles;  ///< instead of pixels
  bool associate = false;             ///< tiles: multiply by alpha when read
  bool alpha_one = false;             ///< tiles: alpha is ignored
  ColorConversion conversion;         ///< `apply` is done already if resident
  bool alpha_apart = false;           ///< colour is not associated with alpha
  Color average{0.0f};
  std::string code, message;  ///< what went wrong, if anything, for each Report

  std::shared_ptr<std::atomic<size_t>> resident_total;
  size_t counted_bytes = 0;
};

/// Decoded file in memory. Row 0 at the bottom.
struct DecodedImage {
  int width = 0, height = 0, channels = 0;  ///< 1, 3 or 4
  TexelType type = TexelType::u8;
  bool is_float = false;
  bool alpha_unassociated = false;  ///< the file's colour is not multiplied by its alpha
  std::vector<uint8_t> pixels;
};

/// What a file would need; cheap (header only).
struct ImageHeader {
  int width = 0, height = 0, channels = 0;
  TexelType type = TexelType::u8;
  bool is_float = false;
  size_t resident_bytes = 0;
  std::string error;
};

ImageHeader read_image_header(const ImageSource& source);
/// Decodes the whole image. On failure `error` says why (without naming the image).
DecodedImage read_image(const ImageSource& source, std::string& error);

/// The process-wide cache of tiles shared by all textures of a TextureSystem.
class TileCache {
 public:
  explicit TileCache(size_t limit_bytes);
  ~TileCache();
  /// Opens the file (an encoded image is first written to a temporary one). Null with `error` on failure.
  std::unique_ptr<TileSource> open(const ImageSource& source, std::string& error);
  size_t bytes() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace lambent
