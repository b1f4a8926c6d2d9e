// Decoding of image files through OpenImageIO, in blocks of rows. Limits: the first subimage, the first four channels;
// formats that OpenImageIO decodes whole when opened (HEIF, WebP, GIF) do so here too.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstring>
#include <filesystem>

#include "engine/assets/texture.h"

namespace lambent {

/// An open file, from a path or from memory.
struct ImageReader::File {
  std::unique_ptr<OIIO::Filesystem::IOMemReader> memory;
  std::unique_ptr<OIIO::ImageInput> input;
  OIIO::ImageSpec spec;

  bool open(const ImageSource& source, std::string& error);
};

namespace {

std::string without_newline(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text.empty() ? "unknown reason" : text;
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

bool unassociated(const OIIO::ImageInput& input, const OIIO::ImageSpec& spec) {
  if (spec.alpha_channel < 0) return false;
  if (spec.get_int_attribute("oiio:UnassociatedAlpha", 0)) return true;
  // Blender takes Targa files as unassociated unless they say otherwise, and DDS always
  if (std::strcmp(input.format_name(), "targa") == 0) return spec.get_int_attribute("targa:alpha_type", -1) != 4;
  return std::strcmp(input.format_name(), "dds") == 0;
}

// Grey with alpha becomes RGBA, in place: from the last texel to the first, which lie at a quarter and at a half.
template <typename T>
void spread_grey_alpha(uint8_t* texels, size_t count) {
  T* values = reinterpret_cast<T*>(texels);
  for (size_t i = count; i-- > 0;) {
    const T grey = values[2 * i], alpha = values[2 * i + 1];
    values[4 * i] = values[4 * i + 1] = values[4 * i + 2] = grey;
    values[4 * i + 3] = alpha;
  }
}

}  // namespace

ImageReader::~ImageReader() = default;

bool ImageReader::File::open(const ImageSource& source, std::string& error) {
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);  // alpha is associated here, where its rules are known
  std::string name = source.path;
  if (source.path.empty()) {
    memory = std::make_unique<OIIO::Filesystem::IOMemReader>(const_cast<uint8_t*>(source.encoded.data()),
                                                             source.encoded.size());
    name = "packed" + source.extension;
    input = OIIO::ImageInput::create(name, false, &config, memory.get());
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
    input = OIIO::ImageInput::create(name, false, &config);
  }
  if (!input) {
    error = without_newline(OIIO::geterror());
    return false;
  }
  if (memory) input->set_ioproxy(memory.get());
  if (!input->open(name, spec, config)) {
    error = without_newline(input->geterror());
    return false;
  }
  if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0) {
    error = "it has no pixels";
    return false;
  }
  return true;
}

std::unique_ptr<ImageReader> ImageReader::open(const ImageSource& source, std::string& error) {
  std::unique_ptr<ImageReader> reader(new ImageReader);
  ImageHeader& header = reader->header_;
  int rows_together = 1;
  if (source.pixels) {
    if (source.width <= 0 || source.height <= 0 || source.channels <= 0 || source.channels > 4) {
      error = "its size is " + std::to_string(source.width) + " x " + std::to_string(source.height) + " with " +
              std::to_string(source.channels) + " channels";
      return nullptr;
    }
    reader->pixels_ = source.pixels;
    reader->source_channels_ = source.channels;
    header = {source.width, source.height, 0, TexelType::f32, true, true, false};
  } else {
    reader->file_ = std::make_unique<File>();
    File& file = *reader->file_;
    try {
      if (!file.open(source, error)) return nullptr;
    } catch (const std::exception& exception) {
      error = exception.what();
      return nullptr;
    }
    reader->source_channels_ = std::min(file.spec.nchannels, 4);
    header.width = file.spec.width;
    header.height = file.spec.height;
    header.type = texel_type(file.spec);
    header.is_float = header.type == TexelType::f16 || header.type == TexelType::f32;
    header.alpha_unassociated = unassociated(*file.input, file.spec);
    const std::string format = file.input->format_name();
    header.random_access = file.spec.tile_width > 0 || format == "tiff" || format == "openexr";
    if (file.spec.tile_width > 0) rows_together = std::max(1, file.spec.tile_height);
  }
  header.channels = reader->source_channels_ == 2 ? 4 : reader->source_channels_;
  const size_t row_bytes = static_cast<size_t>(header.width) * header.channels * texel_bytes(header.type);
  const size_t blocks = std::max<size_t>(1, k_block_bytes / (row_bytes * rows_together));
  reader->block_rows_ = static_cast<int>(std::min<size_t>(blocks * rows_together, static_cast<size_t>(header.height)));
  return reader;
}

bool ImageReader::read_file_rows(int first, int count, uint8_t* texels) {
  const OIIO::ImageSpec& spec = file_->spec;
  const int begin = spec.y + first, end = begin + count;
  if (spec.tile_width > 0)
    return file_->input->read_tiles(0, 0, spec.x, spec.x + spec.width, begin, end, spec.z, spec.z + 1, 0,
                                    source_channels_, oiio_type(header_.type), texels);
  return file_->input->read_scanlines(0, 0, begin, end, spec.z, 0, source_channels_, oiio_type(header_.type), texels);
}

bool ImageReader::read_rows(int first, int count, uint8_t* texels, std::string& error) {
  const size_t row_texels = static_cast<size_t>(header_.width);
  if (!file_) {
    const size_t row = row_texels * source_channels_;
    for (int i = 0; i < count; ++i)
      std::memcpy(texels + i * row * sizeof(float), pixels_ + (header_.height - 1 - first - i) * row,
                  row * sizeof(float));
  } else {
    try {
      if (!read_file_rows(first, count, texels)) {
        error = without_newline(file_->input->geterror());
        return false;
      }
    } catch (const std::exception& exception) {  // a file can make libraries throw, bad_alloc included
      error = exception.what();
      return false;
    }
  }
  if (source_channels_ == 2)
    with_type(header_.type, [&]<typename T>() { spread_grey_alpha<T>(texels, row_texels * count); });
  return true;
}

}  // namespace lambent
