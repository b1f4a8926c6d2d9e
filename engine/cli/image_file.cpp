#include "engine/cli/image_file.h"

#include <OpenImageIO/imageio.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

namespace lambent {
namespace {

/// "ViewLayer.Combined.R" without its last part.
std::string prefix_of(const std::string& channel) {
  const size_t dot = channel.rfind('.');
  return dot == std::string::npos ? "" : channel.substr(0, dot);
}

bool ends_in(const std::string& text, const std::string& layer) { return text == layer || text.ends_with("." + layer); }

/// Indices of the layer's channels in their order of use (R G B or X Y Z); empty if there is no such layer.
std::vector<int> find_layer(const std::vector<std::string>& names, const std::string& layer) {
  std::string prefix;
  bool found = false;
  for (const std::string& name : names) {
    const std::string candidate = prefix_of(name);
    if (layer.empty() ? candidate.empty() : ends_in(candidate, layer)) {
      prefix = candidate;
      found = true;
      break;
    }
  }
  if (!found) return layer.empty() ? find_layer(names, "Combined") : std::vector<int>{};
  std::vector<int> indices;
  for (size_t i = 0; i < names.size(); ++i) {
    const std::string last = names[i].substr(names[i].rfind('.') + 1);
    if (prefix_of(names[i]) == prefix && last != "A") indices.push_back(static_cast<int>(i));
  }
  const std::string order = "RGBXYZ";
  const auto rank = [&](int i) { return order.find(names[i].back()); };
  std::stable_sort(indices.begin(), indices.end(), [&](int a, int b) { return rank(a) < rank(b); });
  return indices;
}

}  // namespace

Result<ImageLayer> read_image_layer(const std::string& path, const std::string& layer) {
  const auto input = OIIO::ImageInput::open(path);
  if (!input) return Error{fmt::format("The image '{}' cannot be read: {}", path, OIIO::geterror())};
  const OIIO::ImageSpec& spec = input->spec();
  const std::vector<int> indices = find_layer(spec.channelnames, layer);
  if (indices.empty())
    return Error{fmt::format("The image '{}' has no layer '{}'; its channels are {}", path,
                             layer.empty() ? "Combined" : layer, fmt::join(spec.channelnames, " "))};
  std::vector<float> all(static_cast<size_t>(spec.width) * spec.height * spec.nchannels);
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, all.data()))
    return Error{fmt::format("The image '{}' cannot be read: {}", path, input->geterror())};
  ImageLayer result;
  result.width = spec.full_width;
  result.height = spec.full_height;
  for (const int i : indices) result.channels.push_back(spec.channelnames[i]);
  const size_t channels = indices.size();
  result.pixels.assign(result.pixel_count() * channels, 0.0f);
  for (int y = 0; y < spec.height; ++y)
    for (int x = 0; x < spec.width; ++x) {
      const int to_x = x + spec.x - spec.full_x, to_y = y + spec.y - spec.full_y;
      if (to_x < 0 || to_y < 0 || to_x >= result.width || to_y >= result.height) continue;
      for (size_t c = 0; c < channels; ++c)
        result.pixels[(static_cast<size_t>(to_y) * result.width + to_x) * channels + c] =
            all[(static_cast<size_t>(y) * spec.width + x) * spec.nchannels + indices[c]];
    }
  return result;
}

}  // namespace lambent
