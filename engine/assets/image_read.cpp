// Decoding of image files through OpenImageIO. Limits: the first subimage, the first four channels.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstring>
#include <filesystem>

#include "engine/assets/texture.h"

namespace lambent {
namespace {

// An open file, from a path or from memory.
struct OpenImage {
  std::unique_ptr<OIIO::Filesystem::IOMemReader> memory;
  std::unique_ptr<OIIO::ImageInput> input;
  OIIO::ImageSpec spec;
};

std::string without_newline(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text.empty() ? "unknown reason" : text;
}

bool open_image(const ImageSource& source, OpenImage& image, std::string& error) {
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);  // alpha is associated here, where its rules are known
  std::string name = source.path;
  if (source.path.empty()) {
    image.memory = std::make_unique<OIIO::Filesystem::IOMemReader>(const_cast<uint8_t*>(source.encoded.data()),
                                                                   source.encoded.size());
    name = "packed" + source.extension;
    image.input = OIIO::ImageInput::create(name, false, &config, image.memory.get());
  } else {
    std::error_code ignored;
    if (!std::filesystem::exists(source.path, ignored)) {
      error = "the file does not exist";
      return false;
    }
    if (std::filesystem::is_directory(source.path, ignored)) {
      error = "the path is a folder";
      return false;
    }
    image.input = OIIO::ImageInput::create(name, false, &config);
  }
  if (!image.input) {
    error = without_newline(OIIO::geterror());
    return false;
  }
  if (image.memory) image.input->set_ioproxy(image.memory.get());
  if (!image.input->open(name, image.spec, config)) {
    error = without_newline(image.input->geterror());
    return false;
  }
  if (image.spec.width <= 0 || image.spec.height <= 0 || image.spec.nchannels <= 0) {
    error = "it has no pixels";
    return false;
  }
  return true;
}

TexelType texel_type(const OIIO::ImageSpec& spec) {
  if (spec.format == OIIO::TypeDesc::HALF) return TexelType::f16;
  if (spec.format.is_floating_point()) return TexelType::f32;
  for (const OIIO::TypeDesc& format : spec.channelformats)
    if (format.is_floating_point()) return TexelType::f32;
  return spec.format.basesize() > 1 ? TexelType::u16 : TexelType::u8;
}

OIIO::TypeDesc oiio_type(TexelType type) {
  switch (type) {
    case TexelType::u8:
      return OIIO::TypeDesc::UINT8;
    case TexelType::u16:
      return OIIO::TypeDesc::UINT16;
    case TexelType::f16:
      return OIIO::TypeDesc::HALF;
    case TexelType::f32:
      return OIIO::TypeDesc::FLOAT;
  }
  return OIIO::TypeDesc::FLOAT;
}

bool unassociated(const OpenImage& image) {
  if (image.spec.alpha_channel < 0) return false;
  if (image.spec.get_int_attribute("oiio:UnassociatedAlpha", 0)) return true;
  // Blender takes Targa files as unassociated unless they say otherwise, and DDS always
  if (std::strcmp(image.input->format_name(), "targa") == 0)
    return image.spec.get_int_attribute("targa:alpha_type", -1) != 4;
  return std::strcmp(image.input->format_name(), "dds") == 0;
}

// Grey with alpha becomes RGBA, five and more channels the first four.
template <typename T>
void repack(const std::vector<uint8_t>& from, int from_channels, std::vector<uint8_t>& to, size_t pixels) {
  const T* source = reinterpret_cast<const T*>(from.data());
  to.resize(pixels * 4 * sizeof(T));
  T* target = reinterpret_cast<T*>(to.data());
  for (size_t i = 0; i < pixels; ++i) {
    if (from_channels == 2) {
      target[4 * i] = target[4 * i + 1] = target[4 * i + 2] = source[2 * i];
      target[4 * i + 3] = source[2 * i + 1];
    } else {
      for (int k = 0; k < 4; ++k) target[4 * i + k] = source[from_channels * i + k];
    }
  }
}

}  // namespace

ImageHeader read_image_header(const ImageSource& source) {
  ImageHeader header;
  OpenImage image;
  try {
    if (!open_image(source, image, header.error)) return header;
  } catch (const std::exception& exception) {
    header.error = exception.what();
    return header;
  }
  header.width = image.spec.width;
  header.height = image.spec.height;
  header.channels = image.spec.nchannels == 2 ? 4 : std::min(image.spec.nchannels, 4);
  header.type = texel_type(image.spec);
  header.is_float = header.type == TexelType::f16 || header.type == TexelType::f32;
  header.resident_bytes =
      static_cast<size_t>(header.width) * header.height * header.channels * texel_bytes(header.type);
  return header;
}

DecodedImage read_image(const ImageSource& source, std::string& error) {
  DecodedImage decoded;
  OpenImage image;
  try {
    if (!open_image(source, image, error)) return decoded;
    decoded.width = image.spec.width;
    decoded.height = image.spec.height;
    decoded.type = texel_type(image.spec);
    decoded.is_float = decoded.type == TexelType::f16 || decoded.type == TexelType::f32;
    decoded.alpha_unassociated = unassociated(image);
    const int file_channels = image.spec.nchannels;
    const size_t pixels = static_cast<size_t>(decoded.width) * decoded.height;
    const size_t row = static_cast<size_t>(decoded.width) * file_channels * texel_bytes(decoded.type);
    decoded.pixels.resize(row * decoded.height);
    // The last row first: row 0 is at the bottom.
    if (!image.input->read_image(0, 0, 0, file_channels, oiio_type(decoded.type),
                                 decoded.pixels.data() + row * (decoded.height - 1), OIIO::AutoStride,
                                 -static_cast<OIIO::stride_t>(row), OIIO::AutoStride)) {
      error = without_newline(image.input->geterror());
      decoded.pixels.clear();
      return decoded;
    }
    image.input->close();
    decoded.channels = file_channels;
    if (file_channels == 2 || file_channels > 4) {
      std::vector<uint8_t> packed;
      switch (texel_bytes(decoded.type)) {
        case 1:
          repack<uint8_t>(decoded.pixels, file_channels, packed, pixels);
          break;
        case 2:
          repack<uint16_t>(decoded.pixels, file_channels, packed, pixels);
          break;
        default:
          repack<uint32_t>(decoded.pixels, file_channels, packed, pixels);
          break;
      }
      decoded.pixels = std::move(packed);
      decoded.channels = 4;
    }
  } catch (const std::exception& exception) {  // a file can make libraries throw, bad_alloc included
    error = exception.what();
    decoded.pixels.clear();
  }
  return decoded;
}

}  // namespace lambent
