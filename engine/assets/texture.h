// The inside of one texture: resident pixels, or a file behind the tile cache.
#pragma once

#include <Imath/half.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "engine/assets/color_space.h"
#include "engine/assets/texture_system.h"
#include "engine/base/cancel.h"

namespace lambent {

enum class TexelType : uint8_t { u8, u16, f16, f32 };
inline size_t texel_bytes(TexelType type) { return type == TexelType::u8 ? 1 : type == TexelType::f32 ? 4 : 2; }

/// Calls visit.operator()<T>() with the type of a channel.
template <typename Visitor>
void with_type(TexelType type, const Visitor& visit) {
  switch (type) {
    case TexelType::u8:
      return visit.template operator()<uint8_t>();
    case TexelType::u16:
      return visit.template operator()<uint16_t>();
    case TexelType::f16:
      return visit.template operator()<Imath::half>();
    case TexelType::f32:
      return visit.template operator()<float>();
  }
}

/// A stored channel value as a float, and back; integers are fractions of their largest value, rounded and clamped.
inline float decode(uint8_t v) { return v * (1.0f / 255.0f); }
inline float decode(uint16_t v) { return v * (1.0f / 65535.0f); }
inline float decode(Imath::half v) { return static_cast<float>(v); }
inline float decode(float v) { return v; }
template <typename T>
T encode(float v) {
  if constexpr (std::is_same_v<T, uint8_t>)
    return static_cast<uint8_t>(std::clamp(v, 0.0f, 1.0f) * 255.0f + 0.5f);
  else if constexpr (std::is_same_v<T, uint16_t>)
    return static_cast<uint16_t>(std::clamp(v, 0.0f, 1.0f) * 65535.0f + 0.5f);
  else
    return T(v);
}

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

/// Bytes of the images of one TextureSystem.
struct TextureMemory {
  std::atomic<size_t> reserved{0};  ///< that images may take
  std::atomic<size_t> held{0};      ///< that they take
};

/// Loads a texture when it is first asked for. Thread-safe.
class DeferredTexture {
 public:
  virtual ~DeferredTexture() = default;
  /// Returns once the texture is ready; false if `cancel` (may be null) came first.
  virtual bool load(const CancelFlag* cancel) = 0;
};

class Texture {
 public:
  Texture() = default;
  ~Texture() {
    if (!memory) return;
    memory->reserved -= reserved_bytes;
    memory->held -= held_bytes;
  }
  Texture(const Texture&) = delete;
  Texture& operator=(const Texture&) = delete;

  int width = 1, height = 1;
  int channels = 4;  ///< 1, 3 or 4 as stored
  TexelType type = TexelType::f32;
  /// Resident texels, row 0 at the bottom. Not a vector, which would first fill it: half a second for a large image.
  std::unique_ptr<uint8_t[]> pixels;
  std::unique_ptr<TileSource> tiles;  ///< instead of pixels
  bool associate = false;             ///< tiles: multiply by alpha when read
  bool alpha_one = false;             ///< tiles: alpha is ignored
  ColorConversion conversion;         ///< `apply` is done already if resident
  bool alpha_apart = false;           ///< colour is not associated with alpha
  Color average{0.0f};
  std::string code, message;  ///< what went wrong, if anything, for each Report

  std::shared_ptr<TextureMemory> memory;  ///< null: takes none of it
  size_t reserved_bytes = 0, held_bytes = 0;

  /// What is above can be read: set last. Until then `deferred` loads it.
  std::atomic<bool> ready{true};
  std::unique_ptr<DeferredTexture> deferred;  ///< null: was loaded at once
};

/// What an image is, before its texels are read.
struct ImageHeader {
  int width = 0, height = 0;
  int channels = 0;  ///< as kept: 1, 3 or 4
  TexelType type = TexelType::u8;
  bool is_float = false;
  bool alpha_unassociated = false;  ///< the colour is not multiplied by its alpha
  bool random_access = false;       ///< any part can be read without decoding what lies before it
  friend bool operator==(const ImageHeader&, const ImageHeader&) = default;
};

/// An open image, read in blocks of rows: from a file, from packed bytes or from pixels in memory.
class ImageReader {
 public:
  /// Null on failure; `error` says why (without naming the image). The source must outlive the reader.
  static std::unique_ptr<ImageReader> open(const ImageSource& source, std::string& error);
  ~ImageReader();

  const ImageHeader& header() const { return header_; }
  /// Rows that are best read at a time: about k_block_bytes of them, whole rows of tiles.
  int block_rows() const { return block_rows_; }
  /// Reads `count` rows from `first`, which counts from the top and is a multiple of block_rows().
  /// @param texels receives header().channels values a texel of header().type; the first row read comes first.
  /// False on failure, with `error`.
  bool read_rows(int first, int count, uint8_t* texels, std::string& error);

  /// Some 10 to 40 ms of decoding, so that cancelling between blocks is prompt.
  static constexpr size_t k_block_bytes = size_t{4} << 20;

 private:
  ImageReader() = default;
  bool read_file_rows(int first, int count, uint8_t* texels);
  struct File;
  std::unique_ptr<File> file_;     ///< null: pixels_
  const float* pixels_ = nullptr;  ///< row 0 at the bottom
  int source_channels_ = 0;        ///< read of each texel: header_.channels, or 2 that become 4
  ImageHeader header_;
  int block_rows_ = 1;
};

/// Reads the whole image into `texture`, which has its alpha_apart and conversion already: colours converted and alpha
/// associated where the alpha mode asks for it, a block of rows at a time. Where width and height are less than the
/// image's, each texel is the mean of those that fall into it. False on failure, with `error`, and if cancelled.
bool load_resident(ImageReader& reader, ImageAlpha alpha, int width, int height, const CancelFlag& cancel,
                   Texture& texture, std::string& error);
/// Bytes of a texel as load_resident keeps it.
size_t resident_texel_bytes(const ImageHeader& header, const ColorConversion& conversion);

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
