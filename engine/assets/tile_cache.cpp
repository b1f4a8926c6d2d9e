// Images too large to be resident, through OpenImageIO's cache of tiles. Only calls that OpenImageIO 2.4 to 3.1 share.
#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/imageio.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <random>

#include "engine/assets/texture.h"

namespace lambent {

struct TileCache::State {
#if OIIO_VERSION >= OIIO_MAKE_VERSION(3, 0, 0)
  std::shared_ptr<OIIO::ImageCache> cache = OIIO::ImageCache::create(false);
#else
  std::shared_ptr<OIIO::ImageCache> cache{OIIO::ImageCache::create(false),
                                          [](OIIO::ImageCache* c) { OIIO::ImageCache::destroy(c); }};
#endif
};

namespace {

class CachedFile : public TileSource {
 public:
  CachedFile(std::shared_ptr<OIIO::ImageCache> cache, const std::string& path, bool temporary)
      : cache_(std::move(cache)), path_(path), file_(path), temporary_(temporary) {}
  ~CachedFile() override {
    cache_->invalidate(file_);
    std::error_code ignored;
    if (temporary_) std::filesystem::remove(path_, ignored);
  }

  bool open(std::string& error) {
    int resolution[2] = {0, 0};
    if (!cache_->get_image_info(file_, 0, 0, OIIO::ustring("channels"), OIIO::TypeDesc::INT, &channels_)) {
      error = cache_->geterror();
      return false;
    }
    for (int level = 0; level < 24; ++level) {
      if (!cache_->get_image_info(file_, 0, level, OIIO::ustring("resolution"), OIIO::TypeDesc(OIIO::TypeDesc::INT, 2),
                                  resolution))
        break;
      sizes_.push_back({resolution[0], resolution[1]});
    }
    cache_->geterror();  // asking for one level too many is how their count is found
    if (sizes_.empty()) error = "no resolution level could be read";
    return !sizes_.empty();
  }

  TextureSize size(int level) const override { return sizes_[level]; }
  int levels() const override { return static_cast<int>(sizes_.size()); }
  void read(int level, int x, int y, float* rgba) const override {
    const int row = sizes_[level].height - 1 - y;
    const int count = std::min(channels_, 4);
    float values[4] = {1, 0, 1, 1};
    if (!cache_->get_pixels(file_, 0, level, x, x + 1, row, row + 1, 0, 1, 0, count, OIIO::TypeDesc::FLOAT, values)) {
      cache_->geterror();  // a file that breaks while rendering shows as pink
      const float pink[4] = {1, 0, 1, 1};
      std::copy(pink, pink + 4, rgba);
      return;
    }
    if (count < 3) {
      rgba[3] = count == 2 ? values[1] : 1.0f;
      rgba[0] = rgba[1] = rgba[2] = values[0];
    } else {
      std::copy(values, values + 3, rgba);
      rgba[3] = count == 4 ? values[3] : 1.0f;
    }
  }
  size_t bytes() const override { return 0; }

 private:
  std::shared_ptr<OIIO::ImageCache> cache_;
  std::string path_;
  OIIO::ustring file_;
  bool temporary_;
  int channels_ = 0;
  std::vector<TextureSize> sizes_;
};

}  // namespace

TileCache::TileCache(size_t limit_bytes) : state_(std::make_shared<State>()) {
  OIIO::ImageCache& cache = *state_->cache;
  cache.attribute("max_memory_MB", static_cast<float>(limit_bytes) / 1048576.0f);
  cache.attribute("autotile", 64);
  // Levels that the file has are used; making them would read the whole file past the memory limit
  cache.attribute("automip", 0);
  cache.attribute("unassociatedalpha", 1);
  cache.attribute("max_open_files", 64);
}
TileCache::~TileCache() = default;

std::unique_ptr<TileSource> TileCache::open(const ImageSource& source, std::string& error) {
  std::string path = source.path;
  bool temporary = false;
  try {
    if (path.empty()) {
      std::random_device random;
      path = (std::filesystem::temp_directory_path() /
              ("lambent-texture-" + std::to_string(random()) + std::to_string(random()) + source.extension))
                 .string();
      temporary = true;
      std::ofstream file(path, std::ios::binary);
      file.write(reinterpret_cast<const char*>(source.encoded.data()),
                 static_cast<std::streamsize>(source.encoded.size()));
      if (!file) {
        error = "a temporary copy could not be written to '" + path + "'";
        return nullptr;
      }
    }
    auto file = std::make_unique<CachedFile>(state_->cache, path, temporary);
    if (!file->open(error)) return nullptr;
    return file;
  } catch (const std::exception& exception) {
    error = exception.what();
    return nullptr;
  }
}

size_t TileCache::bytes() const {
  int64_t used = 0;
  state_->cache->getattribute("stat:cache_memory_used", OIIO::TypeDesc::INT64, &used);
  return static_cast<size_t>(used);
}

}  // namespace lambent
