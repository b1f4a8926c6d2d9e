#include "engine/assets/texture_system.h"

#include <Imath/half.h>

#include <condition_variable>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <utility>

#include "engine/assets/texture.h"
#include "engine/base/check.h"

namespace lambent {
namespace {

constexpr size_t k_minimal_cache_bytes = size_t{32} << 20;
/// An image is never reduced below this, however little memory is left.
constexpr int k_least_reduced_px = 256;

struct Rgba {
  float r, g, b, a;
};
Rgba operator*(const Rgba& v, float s) { return {v.r * s, v.g * s, v.b * s, v.a * s}; }
Rgba operator+(const Rgba& x, const Rgba& y) { return {x.r + y.r, x.g + y.g, x.b + y.b, x.a + y.a}; }

template <typename T>
Rgba read_resident(const Texture& texture, int x, int y) {
  const T* texel = reinterpret_cast<const T*>(texture.pixels.get()) +
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

// Same content and reading: same key.
std::string key_of(const ImageSource& source) {
  std::string key = source.colorspace + "|" + std::to_string(static_cast<int>(source.alpha)) + "|";
  if (!source.path.empty()) {
    std::error_code error;
    const auto time = std::filesystem::last_write_time(source.path, error);
    const auto size = std::filesystem::file_size(source.path, error);
    return key + source.path + "|" + std::to_string(time.time_since_epoch().count()) + "|" + std::to_string(size);
  }
  return key + source.extension + "|" + source.content_hash;
}

void make_pink(Texture& texture, std::string code, std::string message) {
  texture.width = texture.height = 1;
  texture.channels = 4;
  texture.type = TexelType::f32;
  const float pink[4] = {1, 0, 1, 1};
  texture.pixels = std::make_unique<uint8_t[]>(sizeof(pink));
  if (texture.memory) texture.memory->reserved -= std::exchange(texture.reserved_bytes, 0);
  std::memcpy(texture.pixels.get(), pink, sizeof(pink));
  texture.tiles.reset();
  texture.conversion = {};
  texture.average = Color(1, 0, 1);
  texture.code = std::move(code);
  texture.message = std::move(message);
}

/// The image and where it comes from, for messages.
std::string subject_of(const ImageSource& source) {
  const std::string place = source.path.empty()
                                ? (source.pixels ? "(generated pixels)" : "(packed" + source.extension + ")")
                                : "'" + source.path + "'";
  return "Image '" + source.name + "' " + place;
}

}  // namespace

struct TextureSystem::State {
  explicit State(const Options& options_in)
      : options(options_in),
        color_spaces(options_in.ocio_config, options_in.working_space),
        cache_bytes(std::max(options_in.memory_limit_bytes / 8, k_minimal_cache_bytes)),
        memory(std::make_shared<TextureMemory>()) {}

  Options options;
  ColorSpaces color_spaces;
  size_t cache_bytes;
  std::shared_ptr<TextureMemory> memory;
  mutable Report problems;   ///< of deferred images
  mutable std::mutex mutex;  // guards what follows
  std::map<std::string, std::weak_ptr<const Texture>> textures;
  std::unique_ptr<TileCache> tile_cache;
  bool config_error_reported = false;

  size_t resident_limit() const {
    return options.memory_limit_bytes > cache_bytes ? options.memory_limit_bytes - cache_bytes : 0;
  }
  void settle(PendingTexture::State& pending, Report& report);
  void fail(PendingTexture::State& pending, const std::string& why, Report& report);
  void remember(const PendingTexture::State& pending);
  bool load(PendingTexture::State& pending, Report& report, const CancelFlag& cancel);
};

TextureSystem::TextureSystem() : TextureSystem(Options{}) {}
TextureSystem::TextureSystem(const Options& options) : state_(std::make_shared<State>(options)) {}
TextureSystem::~TextureSystem() = default;

/// An image whose place in memory is settled and whose texels are not read yet.
struct PendingTexture::State {
  ImageSource source;
  std::string key;
  std::shared_ptr<Texture> texture;
  TextureHandle known;  ///< an earlier one that it shares, instead
  ImageHeader header;
  int width = 0, height = 0;  ///< to be kept
  bool tiled = false;         ///< to be read through the tile cache
  bool failed = false;
};
PendingTexture::PendingTexture() = default;
PendingTexture::PendingTexture(PendingTexture&&) noexcept = default;
PendingTexture& PendingTexture::operator=(PendingTexture&&) noexcept = default;
PendingTexture::~PendingTexture() = default;

PendingTexture TextureSystem::reserve(const ImageSource& source, Report& report) {
  PendingTexture result;
  result.state_ = std::make_unique<PendingTexture::State>();
  PendingTexture::State& pending = *result.state_;
  pending.source = source;
  pending.key = key_of(source);
  {
    const std::lock_guard lock(state_->mutex);
    if (!state_->color_spaces.error().empty() && !state_->config_error_reported) {
      state_->config_error_reported = true;
      report.warning("color_config", source.name, state_->color_spaces.error());
    }
    const auto known = state_->textures.find(pending.key);
    if (known != state_->textures.end()) pending.known = known->second.lock();
  }
  if (pending.known) {
    const TextureProblem problem = texture_problem(*pending.known);
    if (!problem.message.empty()) report.error(problem.code, source.name, problem.message);
    return result;
  }
  pending.texture = std::make_shared<Texture>();
  if (!source.pixels && source.path.empty() && source.encoded.empty()) {
    state_->fail(pending, "it has neither a file nor pixels", report);
    state_->remember(pending);
    return result;
  }
  std::string error;
  const std::unique_ptr<ImageReader> reader = ImageReader::open(source, error);
  if (!reader) {
    state_->fail(pending, error, report);
    state_->remember(pending);
    return result;
  }
  pending.header = reader->header();
  Texture& texture = *pending.texture;
  texture.conversion = state_->color_spaces.find(source.colorspace, pending.header.is_float);
  if (!texture.conversion.warning.empty())
    report.warning("color_space", source.name, subject_of(source) + ": " + texture.conversion.warning + ".");
  texture.alpha_apart =
      texture.conversion.is_data || source.alpha == ImageAlpha::channel_packed || source.alpha == ImageAlpha::none;
  state_->settle(pending, report);
  return result;
}

/// Gives the image its share of the memory: as it is, through the tile cache, or smaller.
void TextureSystem::State::settle(PendingTexture::State& pending, Report& report) {
  const ImageHeader& header = pending.header;
  const size_t texel = resident_texel_bytes(header, pending.texture->conversion);
  const size_t used = memory->reserved, limit = resident_limit();
  const size_t left = limit > used ? limit - used : 0;
  int divisor = 1;
  const auto reduced = [&](int size) { return (size + divisor - 1) / divisor; };
  const auto bytes = [&] { return static_cast<size_t>(reduced(header.width)) * reduced(header.height) * texel; };
  if (bytes() > left && header.random_access) {
    pending.tiled = true;
    return;
  }
  while (bytes() > left && std::max(header.width, header.height) > divisor * k_least_reduced_px) ++divisor;
  pending.width = reduced(header.width);
  pending.height = reduced(header.height);
  if (divisor > 1)
    report.warning("large_texture", pending.source.name,
                   subject_of(pending.source) + " of " + std::to_string(header.width) + " x " +
                       std::to_string(header.height) + " pixels exceeds the memory left for textures (" +
                       std::to_string(left >> 20) + " MB): used at " + std::to_string(pending.width) + " x " +
                       std::to_string(pending.height) +
                       ". Give lambentd more with --texture-cache, or make the file a tiled TIFF or EXR.");
  pending.texture->memory = memory;
  pending.texture->reserved_bytes = bytes();
  memory->reserved += pending.texture->reserved_bytes;
}

/// Makes the texture pink, with a message.
void TextureSystem::State::fail(PendingTexture::State& pending, const std::string& why, Report& report) {
  pending.failed = true;
  Texture& texture = *pending.texture;
  const bool missing = why == "the file does not exist" || why == "it has neither a file nor pixels";
  make_pink(texture, missing ? "missing_texture" : "corrupt_texture",
            subject_of(pending.source) + " cannot be used, pink takes its place: " + why + ".");
  report.error(texture.code, pending.source.name, texture.message);
}

void TextureSystem::State::remember(const PendingTexture::State& pending) {
  const std::lock_guard lock(mutex);
  textures[pending.key] = pending.texture;
}

/// Reads the texels. False if cancelled: then it can be tried again.
bool TextureSystem::State::load(PendingTexture::State& pending, Report& report, const CancelFlag& cancel) {
  Texture& texture = *pending.texture;
  std::string error;
  if (pending.tiled) {
    {
      const std::lock_guard lock(mutex);
      if (!tile_cache) tile_cache = std::make_unique<TileCache>(cache_bytes);
      texture.tiles = tile_cache->open(pending.source, error);
    }
    texture.width = pending.header.width;
    texture.height = pending.header.height;
    texture.alpha_one = pending.source.alpha == ImageAlpha::none;
    texture.associate =
        !texture.alpha_apart && pending.source.alpha == ImageAlpha::straight && !pending.header.is_float;
  } else if (const auto reader = ImageReader::open(pending.source, error)) {
    if (reader->header() == pending.header)
      load_resident(*reader, pending.source.alpha, pending.width, pending.height, cancel, texture, error);
    else
      error = "the file was changed while it was in use";
  }
  if (cancel.cancelled()) {
    texture.pixels.reset();
    return false;
  }
  if (error.empty()) {
    texture.average = average_of(texture);
    texture.held_bytes = texture.tiles ? 0 : texture.reserved_bytes;
    if (texture.memory) texture.memory->held += texture.held_bytes;
  } else {
    fail(pending, error, report);
  }
  pending.source = {};  // frees its bytes, unless others need them
  return true;
}

TextureHandle TextureSystem::load(PendingTexture reserved, Report& report, const CancelFlag& cancel) {
  PendingTexture::State& pending = *reserved.state_;
  if (pending.known) return pending.known;
  if (pending.failed) return pending.texture;
  if (!state_->load(pending, report, cancel)) return nullptr;
  state_->remember(pending);
  return pending.texture;
}

namespace {

/// One thread loads, the others wait.
template <typename Load>
class SharedLoad final : public DeferredTexture {
 public:
  SharedLoad(Texture& texture, Load load) : texture_(texture), load_(std::move(load)) {}

  bool load(const CancelFlag* cancel) override {
    constexpr auto k_between_polls = std::chrono::milliseconds(5);
    static const CancelFlag never;
    std::unique_lock lock(mutex_);
    while (!texture_.ready.load(std::memory_order_acquire)) {
      if (cancel && cancel->cancelled()) return false;
      if (loading_) {
        done_.wait_for(lock, k_between_polls);
        continue;
      }
      loading_ = true;
      lock.unlock();
      const bool loaded = load_(cancel ? *cancel : never);
      lock.lock();
      loading_ = false;
      if (loaded) texture_.ready.store(true, std::memory_order_release);
      done_.notify_all();
    }
    return true;
  }

 private:
  Texture& texture_;
  Load load_;
  std::mutex mutex_;
  std::condition_variable done_;
  bool loading_ = false;
};

/// Loads the texture if it is deferred; false if the thread is interrupted.
bool load_if_deferred(const Texture& texture) {
  if (texture.ready.load(std::memory_order_acquire)) [[likely]]
    return true;
  RenderContext& context = render_context();
  if (texture.deferred->load(context.cancel)) return true;
  context.interrupted = true;
  return false;
}

}  // namespace

TextureHandle TextureSystem::defer(PendingTexture reserved) {
  PendingTexture::State& pending = *reserved.state_;
  if (pending.known) return pending.known;
  const std::shared_ptr<Texture> texture = pending.texture;
  if (pending.failed) return texture;
  texture->width = pending.width;
  texture->height = pending.height;
  texture->ready = false;
  state_->remember(pending);
  // The loader belongs to the texture: it must not hold it.
  pending.texture = std::shared_ptr<Texture>(std::shared_ptr<Texture>(), texture.get());
  auto load = [state = state_, of = std::shared_ptr<PendingTexture::State>(std::move(reserved.state_))](
                  const CancelFlag& cancel) { return state->load(*of, state->problems, cancel); };
  texture->deferred = std::make_unique<SharedLoad<decltype(load)>>(*texture, std::move(load));
  return texture;
}

bool TextureSystem::fetch(const Texture& texture, const CancelFlag& cancel) const {
  return texture.ready.load(std::memory_order_acquire) || texture.deferred->load(&cancel);
}

Report TextureSystem::take_problems() const { return state_->problems.take(); }

TextureHandle TextureSystem::add_image(const ImageSource& source, Report& report) {
  return load(reserve(source, report), report, CancelFlag());
}

Texel TextureSystem::lookup(const Texture& texture, const TextureLookup& request) const {
  if (!load_if_deferred(texture)) return {};
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

const std::optional<std::array<float, 9>>& TextureSystem::scene_from_computed() const {
  return state_->color_spaces.scene_from_computed();
}

size_t TextureSystem::bytes() const {
  const std::lock_guard lock(state_->mutex);
  return state_->memory->held + (state_->tile_cache ? state_->tile_cache->bytes() : 0);
}

TextureProblem texture_problem(const Texture& texture) {
  if (!texture.ready.load(std::memory_order_acquire)) return {};
  return {texture.code, texture.message};
}
TextureSize texture_size(const Texture& texture) { return {texture.width, texture.height}; }
Color texture_average(const Texture& texture) { return load_if_deferred(texture) ? texture.average : Color(0.0f); }

}  // namespace lambent
