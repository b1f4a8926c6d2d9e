#include "engine/cli/technique_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "engine/cli/canvas.h"
#include "engine/film/picture_writer.h"

namespace lambent {

namespace {

constexpr int k_gap = 6, k_label = 12;

/// Rows bottom up, as the film has them, to top down.
ImageLayer layer_of(const std::vector<float>& pixels, int width, int height, int channels, float factor) {
  ImageLayer layer{width, height,
                   channels == 1 ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"},
                   std::vector<float>(pixels.size())};
  const size_t row = static_cast<size_t>(width) * static_cast<size_t>(channels);
  for (int y = 0; y < height; ++y)
    for (size_t i = 0; i < row; ++i)
      layer.pixels[static_cast<size_t>(height - 1 - y) * row + i] = pixels[static_cast<size_t>(y) * row + i] * factor;
  return layer;
}

}  // namespace

std::string TechniquePictures::name_of(const Key& key) const {
  if (key.merging) return fmt::format("merged_{}_of_{}", key.t - 1, key.vertices);
  return fmt::format("s{}_t{}", key.vertices + 2 - key.t, key.t);
}

void TechniquePictures::on_contribution(const Contribution& contribution) {
  const int x = static_cast<int>(std::floor(contribution.raster_px.x)),
            y = static_cast<int>(std::floor(contribution.raster_px.y));
  if (x < 0 || y < 0 || x >= width_ || y >= height_ || !is_finite(contribution.value)) return;
  const size_t pixel = static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  const size_t pixels = static_cast<size_t>(width_) * static_cast<size_t>(height_);
  Key key{contribution.vertices, contribution.camera_vertices + 1, false};
  int group = 0;
  switch (contribution.technique) {
    case Technique::emission_hit:
      key.t = contribution.vertices + 2;
      break;
    case Technique::next_event:
      break;
    case Technique::connection:
    case Technique::light_tracing:
      group = 1;
      break;
    case Technique::merging:
      key.merging = true;
      group = 2;
      break;
  }
  const std::lock_guard lock(mutex_);
  std::vector<float>& share = shares_[static_cast<size_t>(group)];
  share.resize(pixels);
  share[pixel] += luminance(contribution.value) * contribution.weight;
  if (contribution.vertices > k_most_vertices) return;
  Sums& sums = pictures_[key];
  sums.weighted.resize(3 * pixels);
  sums.unweighted.resize(3 * pixels);
  for (int c = 0; c < 3; ++c) {
    sums.weighted[3 * pixel + static_cast<size_t>(c)] += contribution.value[c] * contribution.weight;
    sums.unweighted[3 * pixel + static_cast<size_t>(c)] += contribution.value[c];
  }
}

Status TechniquePictures::write(const std::string& folder, int64_t samples, float exposure) const {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Error{fmt::format("--techniques: the folder '{}' cannot be made: {}", folder, error.message())};
  const std::filesystem::path place(folder);
  const std::lock_guard lock(mutex_);
  const float scale = exposure / static_cast<float>(std::max<int64_t>(samples, 1));
  const Rectangle all{0, 0, width_, height_};

  // The pyramid: path lengths down, in a row emission hits to light tracing, then merging.
  const int width = std::min(width_, 160), height = std::max(1, width * height_ / width_);
  const int columns = 2 * k_most_vertices + 2;
  for (const bool weighted : {true, false}) {
    Canvas canvas(k_gap + columns * (width + k_gap), k_gap + (k_most_vertices + 1) * (height + k_label + k_gap),
                  Vec3(0.02f));
    for (const auto& [key, sums] : pictures_) {
      const int column = key.merging ? k_most_vertices + 1 + key.t - 1 : key.vertices + 2 - key.t;
      const int x = k_gap + column * (width + k_gap), y = k_gap + key.vertices * (height + k_label + k_gap);
      canvas.picture(x, y, width, height,
                     layer_of(weighted ? sums.weighted : sums.unweighted, width_, height_, 3, scale), 1.0f);
      canvas.text(x, y + height + 2, name_of(key), Vec3(0.7f));
    }
    if (Status written = canvas.write_png(place / (weighted ? "weighted.png" : "unweighted.png")); !written)
      return written;
  }

  // All of it as numbers.
  std::vector<Channel> channels{{"combined", 4}};
  for (const auto& [key, sums] : pictures_) {
    channels.push_back({"weighted_" + name_of(key), 3});
    channels.push_back({"unweighted_" + name_of(key), 3});
  }
  const size_t pixels = static_cast<size_t>(width_) * static_cast<size_t>(height_);
  std::vector<float> values;
  values.reserve(pixels * (4 + 6 * pictures_.size()));
  for (size_t i = 0; i < pixels; ++i) {
    float sum[3] = {};
    for (const auto& [key, sums] : pictures_)
      for (size_t c = 0; c < 3; ++c) sum[c] += sums.weighted[3 * i + c] * scale;
    values.insert(values.end(), {sum[0], sum[1], sum[2], 1.0f});
    for (const auto& [key, sums] : pictures_)
      for (const std::vector<float>* part : {&sums.weighted, &sums.unweighted})
        for (size_t c = 0; c < 3; ++c) values.push_back((*part)[3 * i + c] * scale);
  }
  if (Status written = write_picture(place / "techniques.exr", {width_, height_, all, channels, values, {}}); !written)
    return written;

  // Who contributes how much of each pixel, in false colour.
  std::vector<float> shares(4 * pixels, 1.0f);
  for (size_t i = 0; i < pixels; ++i) {
    float parts[3], total = 0.0f;
    for (size_t c = 0; c < 3; ++c) total += parts[c] = shares_[c].empty() ? 0.0f : shares_[c][i];
    for (size_t c = 0; c < 3; ++c) shares[4 * i + c] = total > 0.0f ? parts[c] / total : 0.0f;
  }
  const std::vector<Channel> one{{"combined", 4}};
  for (const char* name : {"shares.png", "shares.exr"})
    if (Status written = write_picture(place / name, {width_, height_, all, one, shares, {}}); !written) return written;
  return Ok{};
}

}  // namespace lambent
