#include "engine/assets/texture_system.h"

#include <Imath/half.h>

#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>

#include "engine/assets/texture.h"
#include "engine/base/hash.h"

namespace lambent {
namespace {

constexpr size_t k_minimal_cache_bytes = size_t{32} << 20;

struct Rgba {
  float r, g, b, a;
};
Rgba operator*(const Rgba& v, float s) { return {v.r * s, v.g * s, v.b * s, v.a * s}; }
Rgba operator+(const Rgba& x, const Rgba& y) { return {x.r + y.r, x.g + y.g, x.b + y.b, x.a + y.a}; }

float decode(uint8_t v) { return v * (1.0f / 255.0f); }
float decode(uint16_t v) { return v * (1.0f / 65535.0f); }
float decode(Imath::half v) { return static_cast<float>(v); }
float decode(float v) { return v; }
template <typename T>
T encode(float v) {
  if constexpr (std::is_same_v<T, uint8_t>)
    return static_cast<uint8_t>(std::clamp(v, 0.0f, 1.0f) * 255.0f + 0.5f);
  else if constexpr (std::is_same_v<T, uint16_t>)
    return static_cast<uint16_t>(std::clamp(v, 0.0f, 1.0f) * 65535.0f + 0.5f);
  else
    return T(v);
}

template <typename T>
Rgba read_resident(const Texture& texture, int x, int y) {
  const T* texel = reinterpret_cast<const T*>(texture.pixels.data()) +
                   (static_cast<size_t>(y) * texture.width + x) * texture.channels;
  switch (texture.channels) {
    case 1: {
      const float v = decode(texel[0]);
      return {v, v, v, 1.0f};
    }
    case 3:
      return {decode(texel[0]), decode(texel[1]), decode(texel[2]), 1.0f};
    default:
      return {decode(texel[0]), decode(texel[1]), decode(texel[2]), decode(texel[3])};
  }
}

// One texel at a resolution level; transparent black outside (only CLIP asks there).
Rgba read_texel(const Texture& texture, int level, int width, int height, int x, int y) {
  if (x < 0 || y < 0 || x >= width || y >= height) return {0, 0, 0, 0};
  if (!texture.tiles) {
    switch (texture.type) {
      case TexelType::u8:
        return read_resident<uint8_t>(texture, x, y);
      case TexelType::u16:
        return read_resident<uint16_t>(texture, x, y);
      case TexelType::f16:
        return read_resident<Imath::half>(texture, x, y);
      case TexelType::f32:
        return read_resident<float>(texture, x, y);
    }
  }
  Rgba value;
  texture.tiles->read(level, x, y, &value.r);
  if (texture.conversion.kind == ColorConversion::Kind::apply) texture.conversion.transform->apply(&value.r, 1, 4);
  if (texture.alpha_one) value.a = 1.0f;
  if (texture.associate) {
    value.r *= value.a;
    value.g *= value.a;
    value.b *= value.a;
  }
  const auto finite = [](float v) { return std::isfinite(v) ? v : 0.0f; };
  return {finite(value.r), finite(value.g), finite(value.b), finite(value.a)};
}

// Index of a texel that may lie outside, by extension. CLIP leaves it outside.
int wrap(int i, int size, TextureExtension extension) {
  switch (extension) {
    case TextureExtension::repeat: {
      const int rest = i % size;
      return rest < 0 ? rest + size : rest;
    }
    case TextureExtension::extend:
      return std::clamp(i, 0, size - 1);
    case TextureExtension::mirror: {
      int rest = i % (2 * size);
      if (rest < 0) rest += 2 * size;
      return rest < size ? rest : 2 * size - 1 - rest;
    }
    case TextureExtension::clip:
      return i;
  }
  return 0;
}

// Whole and fractional part of a texel coordinate, safe for huge values.
float split(float x, int& whole) {
  const float floored = std::floor(x);
  whole = static_cast<int>(std::clamp(floored, -1e9f, 1e9f));
  return x - floored;
}

Rgba filter(const Texture& texture, const TextureLookup& lookup, int level, int width, int height) {
  const TextureExtension extension = lookup.extension;
  int x, y;
  if (lookup.interpolation == TextureInterpolation::closest) {
    split(lookup.uv.x * width, x);
    split(lookup.uv.y * height, y);
    return read_texel(texture, level, width, height, wrap(x, width, extension), wrap(y, height, extension));
  }
  const float tx = split(lookup.uv.x * width - 0.5f, x), ty = split(lookup.uv.y * height - 0.5f, y);
  if (lookup.interpolation == TextureInterpolation::linear) {
    const int x0 = wrap(x, width, extension), x1 = wrap(x + 1, width, extension);
    const int y0 = wrap(y, height, extension), y1 = wrap(y + 1, height, extension);
    return (read_texel(texture, level, width, height, x0, y0) * (1 - tx) +
            read_texel(texture, level, width, height, x1, y0) * tx) *
               (1 - ty) +
           (read_texel(texture, level, width, height, x0, y1) * (1 - tx) +
            read_texel(texture, level, width, height, x1, y1) * tx) *
               ty;
  }
  // Cubic B-spline, as Blender
  const auto weights = [](float t, float* w) {
    const float s = 1.0f - t;
    w[0] = s * s * s / 6.0f;
    w[1] = (4.0f - 6.0f * t * t + 3.0f * t * t * t) / 6.0f;
    w[2] = (4.0f - 6.0f * s * s + 3.0f * s * s * s) / 6.0f;
    w[3] = t * t * t / 6.0f;
  };
  float wx[4], wy[4];
  weights(tx, wx);
  weights(ty, wy);
  Rgba sum{0, 0, 0, 0};
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i)
      sum = sum + read_texel(texture, level, width, height, wrap(x + i - 1, width, extension),
                             wrap(y + j - 1, height, extension)) *
                      (wx[i] * wy[j]);
  return sum;
}

Texel finish(const Texture& texture, Rgba value, bool straight_color) {
  if (straight_color && !texture.alpha_apart && value.a != 0.0f && value.a != 1.0f) {
    const float inverse = 1.0f / value.a;
    value.r *= inverse;
    value.g *= inverse;
    value.b *= inverse;
  }
  if (texture.conversion.kind == ColorConversion::Kind::srgb)
    return {Color(linear_from_srgb_fast(value.r), linear_from_srgb_fast(value.g), linear_from_srgb_fast(value.b)),
            value.a};
  return {Color(value.r, value.g, value.b), value.a};
}

// Applies alpha mode and colour transform to resident texels. 8- and 16-bit integers stay so unless a transform is due.
template <typename T>
void associate_alpha(std::vector<uint8_t>& pixels) {
  T* texel = reinterpret_cast<T*>(pixels.data());
  const size_t count = pixels.size() / sizeof(T) / 4;
  for (size_t i = 0; i < count; ++i, texel += 4) {
    const float alpha = decode(texel[3]);
    if (alpha == 1.0f) continue;
    for (int k = 0; k < 3; ++k) texel[k] = encode<T>(decode(texel[k]) * alpha);
  }
}
template <typename T>
void set_alpha_one(std::vector<uint8_t>& pixels) {
  T* texel = reinterpret_cast<T*>(pixels.data());
  const size_t count = pixels.size() / sizeof(T) / 4;
  for (size_t i = 0; i < count; ++i) texel[4 * i + 3] = encode<T>(1.0f);
}
template <typename T>
void clear_non_finite(std::vector<uint8_t>& pixels) {
  T* value = reinterpret_cast<T*>(pixels.data());
  const size_t count = pixels.size() / sizeof(T);
  for (size_t i = 0; i < count; ++i)
    if (!std::isfinite(decode(value[i]))) value[i] = T(0.0f);
}
template <typename T>
std::vector<uint8_t> to_floats(const std::vector<uint8_t>& pixels) {
  const size_t count = pixels.size() / sizeof(T);
  std::vector<uint8_t> floats(count * sizeof(float));
  const T* from = reinterpret_cast<const T*>(pixels.data());
  float* to = reinterpret_cast<float*>(floats.data());
  for (size_t i = 0; i < count; ++i) to[i] = decode(from[i]);
  return floats;
}

template <typename Visitor>
void with_type(TexelType type, const Visitor& visit) {
  switch (type) {
    case TexelType::u8:
      visit.template operator()<uint8_t>();
      break;
    case TexelType::u16:
      visit.template operator()<uint16_t>();
      break;
    case TexelType::f16:
      visit.template operator()<Imath::half>();
      break;
    case TexelType::f32:
      visit.template operator()<float>();
      break;
  }
}

void prepare_resident(Texture& texture, DecodedImage&& image, ImageAlpha alpha) {
  texture.width = image.width;
  texture.height = image.height;
  texture.channels = image.channels;
  texture.type = image.type;
  texture.pixels = std::move(image.pixels);
  if (image.is_float)
    with_type(texture.type, [&]<typename T>() {
      if constexpr (!std::is_integral_v<T>) clear_non_finite<T>(texture.pixels);
    });
  if (texture.conversion.kind == ColorConversion::Kind::apply) {
    if (texture.type != TexelType::f32) {
      with_type(texture.type, [&]<typename T>() { texture.pixels = to_floats<T>(texture.pixels); });
      texture.type = TexelType::f32;
    }
    float* values = reinterpret_cast<float*>(texture.pixels.data());
    const size_t count = static_cast<size_t>(texture.width) * texture.height;
    if (texture.channels == 1) {
      std::vector<uint8_t> rgb(count * 3 * sizeof(float));
      float* wide = reinterpret_cast<float*>(rgb.data());
      for (size_t i = 0; i < count; ++i) wide[3 * i] = wide[3 * i + 1] = wide[3 * i + 2] = values[i];
      texture.pixels = std::move(rgb);
      texture.channels = 3;
      values = reinterpret_cast<float*>(texture.pixels.data());
    }
    texture.conversion.transform->apply(values, count, texture.channels);
    texture.conversion.kind = ColorConversion::Kind::none;
    clear_non_finite<float>(texture.pixels);
  }
  if (texture.channels == 4) {
    if (alpha == ImageAlpha::none) with_type(texture.type, [&]<typename T>() { set_alpha_one<T>(texture.pixels); });
    if (!texture.alpha_apart && alpha == ImageAlpha::straight && image.alpha_unassociated)
      with_type(texture.type, [&]<typename T>() { associate_alpha<T>(texture.pixels); });
  }
}

Color average_of(const Texture& texture) {
  int level = 0, width = texture.width, height = texture.height;
  if (texture.tiles) {
    level = std::max(0, texture.tiles->levels() - 6);  // at most 32 texels wide
    const TextureSize size = texture.tiles->size(level);
    width = size.width;
    height = size.height;
  }
  // A grid of at most 64 x 64 texels: an estimate
  const int columns = std::min(width, 64), rows = std::min(height, 64);
  double sum[3] = {0, 0, 0};
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const int x = static_cast<int>((i + 0.5) * width / columns), y = static_cast<int>((j + 0.5) * height / rows);
      const Texel texel = finish(texture, read_texel(texture, level, width, height, x, y), false);
      sum[0] += texel.color.x, sum[1] += texel.color.y, sum[2] += texel.color.z;
    }
  const double count = static_cast<double>(columns) * rows;
  return Color(static_cast<float>(sum[0] / count), static_cast<float>(sum[1] / count),
               static_cast<float>(sum[2] / count));
}

uint64_t hash_bytes(const void* data, size_t size) {
  uint64_t hash = hash_u64(size);
  const uint8_t* bytes = static_cast<const uint8_t*>(data);
  for (; size >= 8; size -= 8, bytes += 8) {
    uint64_t word;
    std::memcpy(&word, bytes, 8);
    hash = hash_u64(hash ^ word);
  }
  uint64_t rest = 0;
  std::memcpy(&rest, bytes, size);
  return hash_u64(hash ^ rest);
}

// Same content and reading: same key.
std::string key_of(const ImageSource& source) {
  std::string key = source.colorspace + "|" + std::to_string(static_cast<int>(source.alpha)) + "|";
  if (!source.path.empty()) {
    std::error_code error;
    const auto time = std::filesystem::last_write_time(source.path, error);
    const auto size = std::filesystem::file_size(source.path, error);
    return key + source.path + "|" + std::to_string(time.time_since_epoch().count()) + "|" + std::to_string(size);
  }
  if (source.pixels) {
    const size_t count = static_cast<size_t>(source.width) * source.height * source.channels;
    return key + "pixels|" + std::to_string(source.width) + "x" + std::to_string(source.height) + "|" +
           std::to_string(hash_bytes(source.pixels, count * sizeof(float)));
  }
  return key + source.extension + "|" + std::to_string(hash_bytes(source.encoded.data(), source.encoded.size()));
}

void make_pink(Texture& texture, std::string code, std::string message) {
  texture.width = texture.height = 1;
  texture.channels = 4;
  texture.type = TexelType::f32;
  const float pink[4] = {1, 0, 1, 1};
  texture.pixels.resize(sizeof(pink));
  std::memcpy(texture.pixels.data(), pink, sizeof(pink));
  texture.tiles.reset();
  texture.conversion = {};
  texture.average = Color(1, 0, 1);
  texture.code = std::move(code);
  texture.message = std::move(message);
}

std::string place(const ImageSource& source) {
  return source.path.empty() ? (source.pixels ? "(generated pixels)" : "(packed" + source.extension + ")")
                             : "'" + source.path + "'";
}

}  // namespace

struct TextureSystem::State {
  explicit State(const Options& options_in)
      : options(options_in),
        color_spaces(options_in.ocio_config),
        cache_bytes(std::max(options_in.memory_limit_bytes / 8, k_minimal_cache_bytes)),
        resident(std::make_shared<std::atomic<size_t>>(0)) {}

  Options options;
  ColorSpaces color_spaces;
  size_t cache_bytes;
  std::shared_ptr<std::atomic<size_t>> resident;
  mutable std::mutex mutex;  // guards what follows
  std::map<std::string, std::weak_ptr<const Texture>> textures;
  std::unique_ptr<TileCache> tile_cache;
  bool config_error_reported = false;

  size_t resident_limit() const {
    return options.memory_limit_bytes > cache_bytes ? options.memory_limit_bytes - cache_bytes : 0;
  }
};

TextureSystem::TextureSystem() : TextureSystem(Options{}) {}
TextureSystem::TextureSystem(const Options& options) : state_(std::make_unique<State>(options)) {}
TextureSystem::~TextureSystem() = default;

TextureHandle TextureSystem::add_image(const ImageSource& source, Report& report) {
  const std::string key = key_of(source);
  {
    const std::lock_guard lock(state_->mutex);
    if (!state_->color_spaces.error().empty() && !state_->config_error_reported) {
      state_->config_error_reported = true;
      report.warning("color_config", source.name, state_->color_spaces.error());
    }
    if (TextureHandle known = state_->textures[key].lock()) {
      if (!known->message.empty()) report.error(known->code, source.name, known->message);
      return known;
    }
  }
  auto texture = std::make_shared<Texture>();
  const std::string subject = "Image '" + source.name + "' " + place(source);
  const auto remember = [&]() -> TextureHandle {
    const std::lock_guard lock(state_->mutex);
    state_->textures[key] = texture;
    return texture;
  };
  const auto fail = [&](const char* code, const std::string& why) -> TextureHandle {
    make_pink(*texture, code, subject + " cannot be used, pink takes its place: " + why + ".");
    report.error(texture->code, source.name, texture->message);
    return remember();
  };

  ImageHeader header;
  if (source.pixels) {
    if (source.width <= 0 || source.height <= 0 || source.channels <= 0 || source.channels > 4)
      return fail("corrupt_texture", "its size is " + std::to_string(source.width) + " x " +
                                         std::to_string(source.height) + " with " + std::to_string(source.channels) +
                                         " channels");
    header = {source.width, source.height, source.channels == 2 ? 4 : source.channels, TexelType::f32, true, 0, {}};
    header.resident_bytes = static_cast<size_t>(header.width) * header.height * header.channels * sizeof(float);
  } else {
    if (source.path.empty() && source.encoded.empty())
      return fail("missing_texture", "it has neither a file nor pixels");
    header = read_image_header(source);
    if (!header.error.empty())
      return fail(header.error == "the file does not exist" ? "missing_texture" : "corrupt_texture", header.error);
  }

  texture->conversion = state_->color_spaces.find(source.colorspace, header.is_float);
  if (!texture->conversion.warning.empty())
    report.warning("color_space", source.name, subject + ": " + texture->conversion.warning + ".");
  texture->alpha_apart =
      texture->conversion.is_data || source.alpha == ImageAlpha::channel_packed || source.alpha == ImageAlpha::none;

  size_t needed = header.resident_bytes;
  if (texture->conversion.kind == ColorConversion::Kind::apply)
    needed = static_cast<size_t>(header.width) * header.height * std::max(header.channels, 3) * sizeof(float);
  const size_t before = state_->resident->fetch_add(needed);
  texture->resident_total = state_->resident;
  texture->counted_bytes = needed;
  std::string error;
  if (before + needed > state_->resident_limit() && !source.pixels) {
    state_->resident->fetch_sub(needed);
    texture->counted_bytes = 0;
    {
      const std::lock_guard lock(state_->mutex);
      if (!state_->tile_cache) state_->tile_cache = std::make_unique<TileCache>(state_->cache_bytes);
      texture->tiles = state_->tile_cache->open(source, error);
    }
    if (!texture->tiles) return fail("corrupt_texture", error);
    texture->width = header.width;
    texture->height = header.height;
    texture->alpha_one = source.alpha == ImageAlpha::none;
    texture->associate = !texture->alpha_apart && source.alpha == ImageAlpha::straight && !header.is_float;
  } else {
    DecodedImage image;
    if (source.pixels) {
      const size_t count = static_cast<size_t>(source.width) * source.height;
      image = {source.width, source.height, header.channels, TexelType::f32, true, true, {}};
      image.pixels.resize(count * header.channels * sizeof(float));
      float* to = reinterpret_cast<float*>(image.pixels.data());
      if (source.channels == 2)
        for (size_t i = 0; i < count; ++i) {
          to[4 * i] = to[4 * i + 1] = to[4 * i + 2] = source.pixels[2 * i];
          to[4 * i + 3] = source.pixels[2 * i + 1];
        }
      else
        std::memcpy(to, source.pixels, image.pixels.size());
    } else {
      image = read_image(source, error);
      if (image.pixels.empty()) return fail("corrupt_texture", error);
    }
    prepare_resident(*texture, std::move(image), source.alpha);
  }
  texture->average = average_of(*texture);
  return remember();
}

Texel TextureSystem::lookup(const Texture& texture, const TextureLookup& request) const {
  TextureLookup safe = request;
  if (!std::isfinite(safe.uv.x) || !std::isfinite(safe.uv.y)) safe.uv = {0, 0};
  if (!texture.tiles)
    return finish(texture, filter(texture, safe, 0, texture.width, texture.height), safe.straight_color);
  // The coarsest level whose texels are no wider than the longer side of the footprint
  const TextureSize full = texture.tiles->size(0);
  const auto texels = [&](const Vec2& d) {
    return std::isfinite(d.x) && std::isfinite(d.y) ? std::hypot(d.x * full.width, d.y * full.height) : 0.0f;
  };
  const float footprint = std::max(texels(safe.duvdx), texels(safe.duvdy));
  int level = 0;
  if (footprint > 1.0f) level = std::min(static_cast<int>(std::log2(footprint)), texture.tiles->levels() - 1);
  const TextureSize size = texture.tiles->size(level);
  return finish(texture, filter(texture, safe, level, size.width, size.height), safe.straight_color);
}

size_t TextureSystem::bytes() const {
  const std::lock_guard lock(state_->mutex);
  return state_->resident->load() + (state_->tile_cache ? state_->tile_cache->bytes() : 0);
}

TextureSize texture_size(const Texture& texture) { return {texture.width, texture.height}; }
Color texture_average(const Texture& texture) { return texture.average; }

}  // namespace lambent
