#include "engine/description/scene_file.h"

#include <fmt/format.h>
#include <unistd.h>
#include <zstd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>
#include <unordered_map>

#include "engine/base/atomic_file.h"
#include "engine/description/frame.h"
#include "engine/description/json_codec.h"

namespace lambent::description {
namespace {

constexpr uint64_t k_group_bytes = uint64_t(64) << 20;  ///< arrays are grouped into frames of about this size
constexpr int k_compression_level = 3;

/// Writes one `arrays` frame, compressed. Fails only for lack of memory.
Status write_arrays(AtomicFile& file, std::span<const ArrayPointer> arrays) {
  ArrayLayout layout = lay_out_arrays(arrays);
  const std::vector<std::byte> payload = gather_payload(arrays);
  std::vector<std::byte> compressed(ZSTD_compressBound(payload.size()));
  const size_t size =
      ZSTD_compress(compressed.data(), compressed.size(), payload.data(), payload.size(), k_compression_level);
  if (ZSTD_isError(size)) return Error{fmt::format("The arrays could not be compressed: {}.", ZSTD_getErrorName(size))};
  const Json header{{"type", "arrays"}, {"arrays", std::move(layout.descriptors)}, {"payload_size", payload.size()}};
  file.write(encode_frame_start(header, size, false, /*payload_zstd=*/true));
  file.write(compressed.data(), size);
  return Ok{};
}

/// Appends the edits as `transaction` frames: one, or where their JSON is over the limit of a frame several, which are
/// read one after the other.
void append_transactions(Json&& edits, std::vector<std::string>& frames) {
  const size_t count = edits.size();
  Json halves[2] = {Json::array(), Json::array()};
  {
    const Json transaction = {{"type", "transaction"}, {"epoch", 0}, {"edits", std::move(edits)}};
    std::string frame = encode_frame_start(transaction);
    if (frame.size() - k_frame_head_bytes <= k_max_header_bytes || count == 1) {
      frames.push_back(std::move(frame));
      return;
    }
    for (size_t i = 0; i < count; ++i) halves[2 * i >= count].push_back(transaction["edits"][i]);
  }
  for (Json& half : halves) append_transactions(std::move(half), frames);
}

Result<uint64_t> save(const std::string& path, const SceneDescription& scene, const std::string& created_by) {
  ArrayCollector collector;
  std::vector<std::string> transactions;
  append_transactions(std::move(encode_scene(scene, collector)["edits"]), transactions);
  for (const std::string& transaction : transactions)
    if (transaction.size() - k_frame_head_bytes > k_max_header_bytes)
      return Error{
          fmt::format("The scene cannot be saved to '{}': one datablock needs {} bytes of JSON, the limit is {}.", path,
                      transaction.size(), k_max_header_bytes)};
  AtomicFile file(path);
  file.write(encode_frame_start(
      {{"type", "scene_file"}, {"protocol", 1}, {"created_by", created_by}, {"transactions", transactions.size()}}));
  const std::vector<ArrayPointer>& arrays = collector.arrays();
  for (size_t first = 0; first < arrays.size() && file.status();) {
    size_t last = first;
    for (uint64_t bytes = 0; last < arrays.size(); ++last) {
      bytes += arrays[last]->byte_count();
      if (last > first && bytes > k_group_bytes) break;
    }
    if (Status written = write_arrays(file, std::span(arrays).subspan(first, last - first)); !written)
      return Error{written.error()};
    first = last;
  }
  for (const std::string& transaction : transactions) file.write(transaction);
  if (Status committed = file.commit(); !committed) return Error{committed.error()};
  return file.bytes_written();
}

/// A saved scene being read.
class Reader {
 public:
  Reader(const std::string& path, uint64_t payload_limit)
      : path_(path), file_(std::fopen(path.c_str(), "rb"), &std::fclose), payload_left_(payload_limit) {}

  Result<SceneDescription> read(Report& report) {
    if (!file_) return failure(std::strerror(errno));
    if (Status good = read_preamble(); !good) return Error{good.error()};
    for (;;) {
      Result<Frame> frame = read_frame();
      if (!frame) return Error{frame.error()};
      const std::string type = frame->header["type"].get<std::string>();
      if (type == "arrays") {
        Result<std::vector<ArrayPointer>> arrays = decode_arrays(frame->header, frame->payload);
        if (!arrays) return failure(arrays.error());
        for (ArrayPointer& array : *arrays) arrays_.emplace(array->hash, std::move(array));
      } else if (type == "transaction") {
        if (Status applied = apply_transaction(frame->header, report); !applied) return Error{applied.error()};
        if (--transactions_left_ == 0) return std::move(scene_);
      } else {
        return failure(fmt::format("it holds a frame '{}', which saved scenes do not have", type));
      }
    }
  }

 private:
  struct Frame {
    Json header;
    Payload payload;
  };

  Error failure(const std::string& cause) const {
    return Error{
        fmt::format("The saved scene '{}' cannot be read: {}", path_, cause.ends_with('.') ? cause : cause + ".")};
  }

  Status read_preamble() {
    Result<Frame> first = read_frame();
    if (!first) return Error{first.error()};
    if (first->header["type"] != "scene_file") return failure("it does not start as a saved scene");
    const auto protocol = first->header.find("protocol");
    if (protocol == first->header.end() || *protocol != 1)
      return failure("it was written for another version of the protocol; this program reads version 1");
    const auto transactions = first->header.find("transactions");
    if (transactions != first->header.end()) {
      if (!transactions->is_number_unsigned() || *transactions == 0)
        return failure("its number of transactions is malformed");
      transactions_left_ = transactions->get<uint64_t>();
    }
    return Ok{};
  }

  Status apply_transaction(const Json& header, Report& report) {
    const auto resolve = [&](const std::string& hash) {
      const auto found = arrays_.find(hash);
      return found == arrays_.end() ? nullptr : found->second;
    };
    std::optional<Transaction> transaction = decode_transaction(header, resolve, report);
    if (!transaction) {
      for (const Message& message : report.messages())
        if (message.severity == Severity::error) return failure(message.text);
      return failure("its transaction is malformed");
    }
    apply(std::move(*transaction), scene_);
    return Ok{};
  }

  bool read_bytes(void* to, size_t count) { return std::fread(to, 1, count, file_.get()) == count; }
  uint64_t bytes_left() {
    const long at = std::ftell(file_.get());
    std::fseek(file_.get(), 0, SEEK_END);
    const long end = std::ftell(file_.get());
    std::fseek(file_.get(), at, SEEK_SET);
    return end > at ? static_cast<uint64_t>(end - at) : 0;
  }

  Result<Frame> read_frame() {
    std::array<std::byte, k_frame_head_bytes> bytes;
    if (!read_bytes(bytes.data(), bytes.size())) return failure("it ends too early");
    FrameLimits limits;
    limits.payload_zstd = true;
    FrameHead head;
    FrameError error;
    if (!decode_frame_head(bytes, limits, head, error)) return failure(error.message);
    // What the file cannot hold is not allocated.
    const uint64_t left = bytes_left();
    if (head.header_bytes > left || head.payload_bytes > left - head.header_bytes) return failure("it ends too early");

    std::string text(head.header_bytes, '\0');
    if (!read_bytes(text.data(), text.size())) return failure("it ends too early");
    Result<Json> header = decode_frame_header(text);
    if (!header) return failure(header.error());
    Frame frame{std::move(*header), {}};
    if (head.payload_bytes == 0) return frame;
    Result<Payload> payload =
        head.payload_zstd ? read_compressed(head.payload_bytes, frame.header) : read_plain(head.payload_bytes);
    if (!payload) return Error{payload.error()};
    frame.payload = std::move(*payload);
    return frame;
  }

  /// Memory for a payload, within what is left of the limit.
  Result<std::shared_ptr<std::byte>> allocate(uint64_t bytes) {
    if (bytes > payload_left_)
      return failure(fmt::format("its arrays need {} bytes more than the {} that are allowed", bytes, payload_left_));
    payload_left_ -= bytes;
    constexpr std::align_val_t alignment{k_array_alignment};
    void* block = ::operator new(bytes ? bytes : 1, alignment, std::nothrow);
    if (!block) return failure(fmt::format("there is no memory for {} bytes of arrays", bytes));
    return std::shared_ptr<std::byte>(static_cast<std::byte*>(block),
                                      [alignment](std::byte* p) { ::operator delete(p, alignment); });
  }

  Result<Payload> read_plain(uint64_t bytes) {
    Result<std::shared_ptr<std::byte>> memory = allocate(bytes);
    if (!memory) return Error{memory.error()};
    if (!read_bytes(memory->get(), bytes)) return failure("it ends too early");
    return Payload{*memory, {memory->get(), bytes}};
  }

  Result<Payload> read_compressed(uint64_t bytes, const Json& header) {
    const auto member = header.find("payload_size");
    if (member == header.end() || !member->is_number_unsigned())
      return failure("a compressed frame does not say its 'payload_size'");
    const auto size = member->get<uint64_t>();
    std::vector<std::byte> compressed(bytes);
    if (!read_bytes(compressed.data(), bytes)) return failure("it ends too early");
    Result<std::shared_ptr<std::byte>> memory = allocate(size);
    if (!memory) return Error{memory.error()};
    const size_t got = ZSTD_decompress(memory->get(), size, compressed.data(), bytes);
    if (ZSTD_isError(got)) return failure(fmt::format("it is damaged ({})", ZSTD_getErrorName(got)));
    if (got != size) return failure("it is damaged (a frame is shorter than it says)");
    return Payload{*memory, {memory->get(), size}};
  }

  const std::string& path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  uint64_t payload_left_;
  std::unordered_map<std::string, ArrayPointer> arrays_;
  uint64_t transactions_left_ = 1;
  SceneDescription scene_;
};

}  // namespace

Result<uint64_t> save_scene_file(const std::string& path, const SceneDescription& scene,
                                 const std::string& created_by) {
  try {
    return save(path, scene, created_by);
  } catch (const std::bad_alloc&) {
    return Error{fmt::format("The scene cannot be saved to '{}': there is not enough memory to compress it.", path)};
  }
}

Result<SceneDescription> load_scene_file(const std::string& path, Report& report, const SceneFileLimits& limits) {
  uint64_t payload_limit = limits.payload_bytes;
  if (!payload_limit)
    payload_limit =
        static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE)) / 4 * 3;
  try {
    return Reader(path, payload_limit).read(report);
  } catch (const std::bad_alloc&) {
    return Error{fmt::format("The saved scene '{}' cannot be read: there is not enough memory for it.", path)};
  }
}

}  // namespace lambent::description
