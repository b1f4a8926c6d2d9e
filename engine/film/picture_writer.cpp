// The encoders write to memory and the file is written by AtomicFile: OpenEXR's own file output may notice a full disk
// only in a destructor, which says nothing.
#include "engine/film/picture_writer.h"

#include <Imath/half.h>
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/base/atomic_file.h"

namespace lambent {
namespace {

Error failure(const std::string& path, const std::string& cause) {
  return Error{fmt::format("The picture '{}' could not be written: {}.", path, cause)};
}

std::string lower_extension(const std::string& path) {
  const size_t dot = path.rfind('.');
  std::string extension = dot == std::string::npos ? "" : path.substr(dot);
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension;
}

int component_count(const PictureView& picture) {
  int count = 0;
  for (const Channel& channel : picture.channels) count += channel.components;
  return count;
}

/// IEC 61966-2-1.
float srgb_from_linear(float x) { return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1.0f / 2.4f) - 0.055f; }

uint8_t quantize(float x) { return static_cast<uint8_t>(std::lround(255.0f * std::clamp(x, 0.0f, 1.0f))); }

/// Encodes to memory and writes the file.
Status encode(const std::string& path, const char* format, const OIIO::ImageSpec& spec, OIIO::TypeDesc type,
              const void* top_row, OIIO::stride_t x_stride, OIIO::stride_t y_stride) {
  const auto output = OIIO::ImageOutput::create(format);
  if (!output) return failure(path, OIIO::geterror());
  OIIO::Filesystem::IOVecOutput memory;
  if (!output->set_ioproxy(&memory))
    return failure(path, fmt::format("this OpenImageIO cannot write {} to memory", format));
  if (!output->open(std::string("picture.") + format, spec) ||
      !output->write_image(type, top_row, x_stride, y_stride) || !output->close())
    return failure(path, output->geterror());
  AtomicFile file(path);
  file.write(memory.buffer().data(), memory.buffer().size());
  return file.commit();
}

bool is_color(const Channel& channel, bool main_picture) {
  return main_picture || channel.letters == "RGB" || channel.letters == "RGBA" ||
         (channel.letters.empty() && channel.components >= 3);
}

/// The rendered rows from the top, each component in its own format.
std::vector<char> packed(const PictureView& picture, const std::vector<OIIO::TypeDesc>& formats) {
  const size_t components = formats.size();
  const Rectangle& window = picture.rendered;
  std::vector<char> bytes;
  const auto put = [&](const auto& value) {
    const char* begin = reinterpret_cast<const char*>(&value);
    bytes.insert(bytes.end(), begin, begin + sizeof(value));
  };
  for (int y = window.y + window.height - 1; y >= window.y; --y)
    for (int x = window.x; x < window.x + window.width; ++x) {
      const float* pixel = &picture.pixels[(static_cast<size_t>(y) * picture.width + x) * components];
      for (size_t i = 0; i < components; ++i) {
        if (formats[i] == OIIO::TypeDesc::HALF)
          put(Imath::half(std::clamp(pixel[i], -float(HALF_MAX), float(HALF_MAX))));
        else
          put(pixel[i]);
      }
    }
  return bytes;
}

Status write_exr(const std::string& path, const PictureView& picture) {
  const int components = component_count(picture);
  const Rectangle& window = picture.rendered;
  OIIO::ImageSpec spec(window.width, window.height, components, OIIO::TypeDesc::FLOAT);
  spec.x = window.x;
  spec.y = picture.height - window.y - window.height;  // files count rows from the top
  spec.full_width = picture.width;
  spec.full_height = picture.height;
  spec.channelnames.clear();
  for (size_t i = 0; i < picture.channels.size(); ++i)
    for (std::string& name : channel_names(picture.channels[i], i == 0)) spec.channelnames.push_back(std::move(name));
  for (int i = 0; i < components; ++i)
    if (spec.channelnames[i] == "A") spec.alpha_channel = i;
  spec.attribute("compression", "zip");
  spec.attribute("oiio:ColorSpace", "Linear");
  for (const auto& [name, value] : picture.metadata) spec.attribute(name, value);
  if (picture.half_colors) {
    for (size_t i = 0; i < picture.channels.size(); ++i)
      spec.channelformats.insert(spec.channelformats.end(), static_cast<size_t>(picture.channels[i].components),
                                 is_color(picture.channels[i], i == 0) ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT);
    const std::vector<char> bytes = packed(picture, spec.channelformats);
    return encode(path, "exr", spec, OIIO::TypeDesc::UNKNOWN, bytes.data(), OIIO::AutoStride, OIIO::AutoStride);
  }

  const auto x_stride = static_cast<OIIO::stride_t>(components * sizeof(float));
  const OIIO::stride_t y_stride = x_stride * picture.width;
  const auto* top_row = reinterpret_cast<const char*>(picture.pixels.data()) +
                        y_stride * (window.y + window.height - 1) + x_stride * window.x;
  return encode(path, "exr", spec, OIIO::TypeDesc::FLOAT, top_row, x_stride, -y_stride);
}

Status write_png(const std::string& path, const PictureView& picture) {
  const int components = component_count(picture), first = picture.channels[0].components;
  const int written = first >= 4 ? 4 : first >= 3 ? 3 : 1;
  std::vector<uint8_t> bytes(static_cast<size_t>(picture.width) * picture.height * written);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const float* pixel = &picture.pixels[(static_cast<size_t>(y) * picture.width + x) * components];
      uint8_t* to = &bytes[(static_cast<size_t>(picture.height - 1 - y) * picture.width + x) * written];
      const float alpha = written == 4 ? pixel[3] : 1.0f;
      for (int i = 0; i < std::min(written, 3); ++i)
        to[i] = quantize(srgb_from_linear(alpha > 0 ? pixel[i] / alpha : pixel[i]));
      if (written == 4) to[3] = quantize(alpha);
    }
  OIIO::ImageSpec spec(picture.width, picture.height, written, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  spec.attribute("oiio:UnassociatedAlpha", 1);  // done above
  for (const auto& [name, value] : picture.metadata) spec.attribute(name, value);
  return encode(path, "png", spec, OIIO::TypeDesc::UINT8, bytes.data(), written,
                OIIO::stride_t(written) * picture.width);
}

}  // namespace

std::vector<std::string> channel_names(const Channel& channel, bool main_picture) {
  const std::string prefix = main_picture ? "" : channel.name + ".";
  std::string letters = main_picture ? "" : channel.letters;
  if (letters.empty()) letters = channel.components == 1 ? (main_picture ? "Y" : "V") : "RGBA";
  std::vector<std::string> names;
  for (int i = 0; i < channel.components; ++i)
    names.push_back(i < static_cast<int>(letters.size()) ? prefix + letters[i] : fmt::format("{}{}", prefix, i));
  return names;
}

bool is_picture_path(const std::string& path) {
  const std::string extension = lower_extension(path);
  return extension == ".exr" || extension == ".png";
}

Status write_picture(const std::string& path, const PictureView& picture) {
  const size_t components = component_count(picture);
  const Rectangle& window = picture.rendered;
  if (components == 0 || window.empty() || window.x < 0 || window.y < 0 || window.x + window.width > picture.width ||
      window.y + window.height > picture.height ||
      picture.pixels.size() != static_cast<size_t>(picture.width) * picture.height * components)
    return failure(path, "there is nothing in the picture");
  const std::string extension = lower_extension(path);
  if (extension == ".exr") return write_exr(path, picture);
  if (extension == ".png") return write_png(path, picture);
  return failure(path, "its name ends neither in .exr nor in .png");
}

}  // namespace lambent
