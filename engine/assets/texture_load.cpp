// From an open image to a resident texture, block by block: what is held beside the result is one block.
#include <cmath>
#include <new>

#include "engine/assets/texture.h"

namespace lambent {
namespace {

template <typename T>
void associate_alpha(T* texel, size_t count) {
  for (size_t i = 0; i < count; ++i, texel += 4) {
    const float alpha = decode(texel[3]);
    if (alpha == 1.0f) continue;
    for (int k = 0; k < 3; ++k) texel[k] = encode<T>(decode(texel[k]) * alpha);
  }
}
template <typename T>
void clear_non_finite(T* values, size_t count) {
  for (size_t i = 0; i < count; ++i)
    if (!std::isfinite(decode(values[i]))) values[i] = T(0.0f);
}

/// Texels of one block, in the type and channels of the texture.
struct Block {
  std::vector<uint8_t> texels;
  std::vector<float> floats;  ///< instead, if a colour transform is due
};

/// Turns `count` texels as the image has them into texels as the texture keeps them.
/// @return where those are: in the block.
uint8_t* convert_block(const ImageHeader& header, ImageAlpha alpha, const Texture& texture, size_t count,
                       Block& block) {
  uint8_t* result = block.texels.data();
  if (texture.conversion.kind == ColorConversion::Kind::apply) {
    block.floats.resize(count * texture.channels);
    float* to = block.floats.data();
    with_type(header.type, [&]<typename T>() {
      const T* from = reinterpret_cast<const T*>(block.texels.data());
      if (header.channels == texture.channels)
        for (size_t i = 0; i < count * header.channels; ++i) to[i] = decode(from[i]);
      else  // grey, whose channels the transform may tell apart
        for (size_t i = 0; i < count; ++i) to[3 * i] = to[3 * i + 1] = to[3 * i + 2] = decode(from[i]);
    });
    clear_non_finite(to, count * texture.channels);
    texture.conversion.transform->apply(to, count, texture.channels);
    result = reinterpret_cast<uint8_t*>(to);
  }
  with_type(texture.type, [&]<typename T>() {
    T* texel = reinterpret_cast<T*>(result);
    if constexpr (!std::is_integral_v<T>) clear_non_finite(texel, count * texture.channels);
    if (texture.channels != 4) return;
    if (alpha == ImageAlpha::none)
      for (size_t i = 0; i < count; ++i) texel[4 * i + 3] = encode<T>(1.0f);
    if (!texture.alpha_apart && alpha == ImageAlpha::straight && header.alpha_unassociated)
      associate_alpha(texel, count);
  });
  return result;
}

/// Means of the rows of a larger image. Rows come in order from the top.
class RowAverage {
 public:
  RowAverage(int width, int height, Texture& texture)
      : texture_(texture), width_(width), height_(height), sums_(row_values(), 0.0f), counts_(texture.width, 0) {}

  template <typename T>
  void add(int row, const T* texel) {
    const int target = static_cast<int>(static_cast<int64_t>(row) * texture_.height / height_);
    if (target != target_) write<T>(target);
    for (int x = 0; x < width_; ++x) {
      const size_t to = static_cast<size_t>(static_cast<int64_t>(x) * texture_.width / width_);
      for (int k = 0; k < texture_.channels; ++k) sums_[to * texture_.channels + k] += decode(*texel++);
      ++counts_[to];
    }
  }
  /// Writes the row that was added to, and goes on to `next`.
  template <typename T>
  void write(int next) {
    T* to = reinterpret_cast<T*>(texture_.pixels.get()) + (texture_.height - 1 - target_) * row_values();
    for (int x = 0; x < texture_.width; ++x)
      for (int k = 0; k < texture_.channels; ++k) {
        const size_t i = static_cast<size_t>(x) * texture_.channels + k;
        to[i] = encode<T>(sums_[i] / static_cast<float>(counts_[x]));
      }
    std::fill(sums_.begin(), sums_.end(), 0.0f);
    std::fill(counts_.begin(), counts_.end(), 0);
    target_ = next;
  }

 private:
  size_t row_values() const { return static_cast<size_t>(texture_.width) * texture_.channels; }

  Texture& texture_;
  int width_, height_;
  int target_ = 0;
  std::vector<float> sums_;
  std::vector<int> counts_;
};

}  // namespace

size_t resident_texel_bytes(const ImageHeader& header, const ColorConversion& conversion) {
  if (conversion.kind == ColorConversion::Kind::apply) return std::max(header.channels, 3) * sizeof(float);
  return header.channels * texel_bytes(header.type);
}

bool load_resident(ImageReader& reader, ImageAlpha alpha, int width, int height, const CancelFlag& cancel,
                   Texture& texture, std::string& error) {
  const ImageHeader& header = reader.header();
  const bool transformed = texture.conversion.kind == ColorConversion::Kind::apply;
  texture.width = width;
  texture.height = height;
  texture.channels = transformed ? std::max(header.channels, 3) : header.channels;
  texture.type = transformed ? TexelType::f32 : header.type;
  const size_t row_bytes = static_cast<size_t>(header.width) * texture.channels * texel_bytes(texture.type);
  const bool reduced = width < header.width || height < header.height;
  try {
    texture.pixels = std::make_unique_for_overwrite<uint8_t[]>(static_cast<size_t>(width) * height * texture.channels *
                                                               texel_bytes(texture.type));
    RowAverage average(header.width, header.height, texture);
    Block block;
    block.texels.resize(static_cast<size_t>(header.width) * reader.block_rows() * header.channels *
                        texel_bytes(header.type));
    for (int first = 0; first < header.height; first += reader.block_rows()) {
      if (cancel.cancelled()) return false;
      const int rows = std::min(reader.block_rows(), header.height - first);
      if (!reader.read_rows(first, rows, block.texels.data(), error)) return false;
      if (cancel.cancelled()) return false;
      const uint8_t* texels = convert_block(header, alpha, texture, static_cast<size_t>(header.width) * rows, block);
      for (int i = 0; i < rows; ++i) {
        const uint8_t* row = texels + i * row_bytes;
        if (reduced)
          with_type(texture.type, [&]<typename T>() { average.add(first + i, reinterpret_cast<const T*>(row)); });
        else
          std::copy_n(row, row_bytes, texture.pixels.get() + (header.height - 1 - first - i) * row_bytes);
      }
    }
    if (reduced) with_type(texture.type, [&]<typename T>() { average.write<T>(height); });
  } catch (const std::bad_alloc&) {
    error = "there is not enough memory for it";
    return false;
  }
  if (transformed) texture.conversion.kind = ColorConversion::Kind::none;
  return true;
}

}  // namespace lambent
