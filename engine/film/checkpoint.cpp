// A film on disk: a header, then one zstd frame (with checksum) of the exact sums. Little-endian.
//
//   "LMBTFILM", u32 version, u64 bytes of the header text, header text, zstd frame of
//   sums f64[P][D] and f32[P][F], things with their ids f32[P][T][1 + I], counts u32[P], second moments f64[P] and
//   stopped u8[P] (if the header has them), light paths u64 and splats (SplatBuffer::integers; if the header has them).
// The header text holds the identity and the layout; it must be equal to the loading film's, byte by byte.
// Versions 4 and 5, which are read too, have ids f32[P][T] and then their weights f32[P][T] for each channel of ids;
// where there are several they do not say which go together, and are refused. Version 4 has all sums f64[P][S], those
// of rule mean in the order of the channels before those of other rules, and weights f64[P][T].
#include <fmt/format.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "engine/film/film_storage.h"

namespace lambent {

namespace {

static_assert(std::endian::native == std::endian::little);
constexpr char k_magic[8] = {'L', 'M', 'B', 'T', 'F', 'I', 'L', 'M'};
constexpr uint32_t k_version = 6, k_ids_apart = 5, k_all_doubles = 4;
constexpr uint64_t k_header_limit = 1 << 20;
constexpr int k_level = 1;  // sums of noise hardly compress; untouched regions do at any level

struct FileCloser {
  void operator()(FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<FILE, FileCloser>;
struct ZstdFree {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

/// Everything that must be the same for sums to be continued.
std::string header_text(const Film& film, const std::string& identity) {
  const FilmSettings& s = film.settings();
  std::string text = fmt::format("frame {} {}\nregion {} {} {} {}\nsecond_moments {}\n", s.width, s.height, s.region.x,
                                 s.region.y, s.region.width, s.region.height, s.second_moments ? 1 : 0);
  if (film.takes_splats())
    text += fmt::format("splats {:.17g}{}\n", s.splat_unit, s.second_moments ? " with squares" : "");
  for (const FilmChannel& channel : s.channels)
    text += fmt::format("channel {} {} {} {} {}\n", channel.components, static_cast<int>(channel.rule),
                        channel.divided_by, channel.splats ? 1 : 0, channel.name);
  text += "identity ";
  text += identity;
  return text;
}

struct Part {
  void* bytes;
  size_t size;
};
template <typename Elements>
Part part(Elements& elements) {
  return {elements.data(), elements.size() * sizeof(*elements.data())};
}

/// Sums of version 4 of P pixels, in the places that they have now.
void place_doubles(const FilmSettings& settings, const FilmLayout& layout, std::span<const double> sums,
                   ZeroedVector<double>& doubles, ZeroedVector<float>& floats) {
  std::vector<int> order;  // channels
  for (const bool means : {true, false})
    for (size_t c = 0; c < settings.channels.size(); ++c) {
      const ChannelRule rule = settings.channels[c].rule;
      const bool other = rule == ChannelRule::first || rule == ChannelRule::error;
      if (means ? is_mean(rule) : other) order.push_back(static_cast<int>(c));
    }
  const size_t stride = static_cast<size_t>(layout.doubles + layout.floats), pixels = sums.size() / stride;
  const double* from = sums.data();
  for (size_t pixel = 0; pixel < pixels; ++pixel)
    for (const int c : order) {
      const FilmLayout::Place& place = layout.places[static_cast<size_t>(c)];
      const int components = settings.channels[static_cast<size_t>(c)].components;
      const size_t first =
          pixel * static_cast<size_t>(place.exact ? layout.doubles : layout.floats) + static_cast<size_t>(place.sum);
      if (place.exact)
        std::copy_n(from, components, doubles.data() + first);
      else
        std::transform(from, from + components, floats.data() + first, [](double sum) { return float(sum); });
      from += components;
    }
}

}  // namespace

Status Film::save(const std::string& path, const std::string& identity) const {
  const auto failed = [&](const std::string& why) {
    return Error{fmt::format("The checkpoint '{}' cannot be written: {}.", path, why)};
  };
  std::string temporary = path + "." + std::string(6, 'X');
  const int descriptor = mkstemp(temporary.data());
  if (descriptor < 0) return failed(std::strerror(errno));
  File file(fdopen(descriptor, "wb"));
  if (!file) {
    const std::string why = std::strerror(errno);
    close(descriptor);
    unlink(temporary.c_str());
    return failed(why);
  }

  bool good = true;
  const auto write = [&](const void* bytes, size_t size) {
    good = good && std::fwrite(bytes, 1, size, file.get()) == size;
  };
  const std::string header = header_text(*this, identity);
  const uint64_t header_size = header.size();
  write(k_magic, sizeof k_magic);
  write(&k_version, sizeof k_version);
  write(&header_size, sizeof header_size);
  write(header.data(), header.size());

  const std::unique_ptr<ZSTD_CCtx, ZstdFree> context(ZSTD_createCCtx());
  if (!context) good = false, errno = ENOMEM;
  if (good) {
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, k_level);
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  }
  std::vector<char> buffer(ZSTD_CStreamOutSize());
  Storage& s = *storage_;
  uint64_t light_paths = this->light_paths();
  const Part parts[] = {part(s.doubles),
                        part(s.floats),
                        part(s.things),
                        part(s.counts),
                        part(s.second_moments),
                        part(s.stopped),
                        {&light_paths, s.splats ? sizeof light_paths : 0},
                        {s.splats ? s.splats->integers() : nullptr, s.splats ? s.splats->bytes() : 0},
                        {nullptr, 0}};
  for (const Part& p : parts) {
    const bool last = p.bytes == nullptr && &p == std::end(parts) - 1;
    ZSTD_inBuffer in{p.bytes, p.size, 0};
    for (bool done = false; good && !done;) {
      ZSTD_outBuffer out{buffer.data(), buffer.size(), 0};
      const size_t left = ZSTD_compressStream2(context.get(), &out, &in, last ? ZSTD_e_end : ZSTD_e_continue);
      if (ZSTD_isError(left)) good = false, errno = EIO;
      write(buffer.data(), out.pos);
      done = last ? left == 0 : in.pos == in.size;
    }
  }
  good = good && std::fflush(file.get()) == 0 && fsync(descriptor) == 0;
  std::string why = good ? "" : std::strerror(errno);
  if (std::fclose(file.release()) != 0 && good) good = false, why = std::strerror(errno);
  if (good && std::rename(temporary.c_str(), path.c_str()) != 0) good = false, why = std::strerror(errno);
  if (good) return Ok{};
  unlink(temporary.c_str());
  return failed(why);
}

Status Film::load(const std::string& path, const std::string& identity) {
  const auto failed = [&](const std::string& why) {
    return Error{fmt::format("The checkpoint '{}' cannot be read: {}.", path, why)};
  };
  const File file(std::fopen(path.c_str(), "rb"));
  if (!file) return failed(std::strerror(errno));
  const auto read = [&](void* bytes, size_t size) { return std::fread(bytes, 1, size, file.get()) == size; };
  char magic[sizeof k_magic];
  uint32_t version = 0;
  uint64_t header_size = 0;
  if (!read(magic, sizeof magic) || std::memcmp(magic, k_magic, sizeof magic) != 0)
    return failed("it is not a Lambent checkpoint");
  if (!read(&version, sizeof version) || version < k_all_doubles || version > k_version)
    return failed(fmt::format("it has format version {}, this program reads {}", version, k_version));
  if (!read(&header_size, sizeof header_size) || header_size > k_header_limit) return failed("its header is damaged");
  std::string header(header_size, '\0');
  if (!read(header.data(), header.size())) return failed("it is truncated");
  if (header != header_text(*this, identity))
    return failed("it belongs to another scene, picture size or setting that changes samples");

  // Sizes are the film's own, whatever the file says.
  Storage& s = *storage_;
  const bool all_doubles = version == k_all_doubles, ids_apart = version <= k_ids_apart && layout_.id_channels > 0;
  if (ids_apart && layout_.id_channels > 1)
    return failed(
        fmt::format("it has format version {}, which this program reads with one Cryptomatte pass at most", version));
  ZeroedVector<double> doubles(s.doubles.size()), second_moments(s.second_moments.size());
  ZeroedVector<float> floats(s.floats.size()), things(s.things.size());
  const size_t old_ids = ids_apart ? things.size() / 2 : 0;
  std::vector<double> old_sums(all_doubles ? doubles.size() + floats.size() : 0),
      double_weights(all_doubles ? old_ids : 0);
  std::vector<float> ids(old_ids), weights(all_doubles ? 0 : old_ids);
  ZeroedVector<uint32_t> counts(s.counts.size());
  ZeroedVector<uint8_t> stopped(s.stopped.size());
  uint64_t light_paths = 0;
  std::vector<int64_t> splats(s.splats ? s.splats->bytes() / sizeof(int64_t) : 0);
  const std::unique_ptr<ZSTD_DCtx, ZstdFree> context(ZSTD_createDCtx());
  if (!context) return failed("not enough memory");
  std::vector<char> buffer(ZSTD_DStreamInSize());
  ZSTD_inBuffer in{buffer.data(), 0, 0};
  size_t left = 1;
  const auto refill = [&] {
    in = {buffer.data(), std::fread(buffer.data(), 1, buffer.size(), file.get()), 0};
    return in.size > 0;
  };
  char beyond;
  const Part light_paths_part{&light_paths, s.splats ? sizeof light_paths : 0};
  const Part none{nullptr, 0};
  for (const Part& p : {all_doubles ? part(old_sums) : part(doubles), all_doubles ? none : part(floats),
                        ids_apart ? part(ids) : part(things), part(weights), part(double_weights), part(counts),
                        part(second_moments), part(stopped), light_paths_part, part(splats), Part{&beyond, 1}}) {
    ZSTD_outBuffer out{p.bytes, p.size, 0};
    while (out.pos < out.size && left != 0) {
      const size_t consumed = in.pos, produced = out.pos;
      left = ZSTD_decompressStream(context.get(), &out, &in);
      if (ZSTD_isError(left)) return failed(fmt::format("it is damaged ({})", ZSTD_getErrorName(left)));
      if (left != 0 && in.pos == consumed && out.pos == produced && in.pos == in.size && !refill())
        return failed("it is truncated");
    }
    const bool expected = p.bytes == &beyond ? out.pos == 0 : out.pos == out.size;
    if (!expected) return failed("it is damaged (its size does not fit)");
  }
  if (left != 0) return failed("it is truncated");
  if (all_doubles) place_doubles(settings_, layout_, old_sums, doubles, floats);
  for (size_t i = 0; i < old_ids; ++i) {
    things[2 * i] = all_doubles ? static_cast<float>(double_weights[i]) : weights[i];
    things[2 * i + 1] = ids[i];
  }
  s.doubles.swap(doubles);
  s.floats.swap(floats);
  s.things.swap(things);
  s.counts.swap(counts);
  s.second_moments.swap(second_moments);
  s.stopped.swap(stopped);
  if (s.splats) {
    std::copy(splats.begin(), splats.end(), s.splats->integers());
    s.splats->set_paths(light_paths);
  }
  mark_filled_dirty();
  return Ok{};
}

}  // namespace lambent
