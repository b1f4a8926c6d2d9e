#include "engine/description/frame.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <optional>

namespace lambent {
namespace {

static_assert(std::endian::native == std::endian::little, "frames and arrays are read in place");

constexpr char k_magic[4] = {'L', 'M', 'B', 'T'};
constexpr uint16_t k_framing_version = 1;
constexpr uint16_t k_flag_fd = 1, k_flag_zstd = 2;

/// The wire's layout, which has no padding.
struct WireHead {
  char magic[4];
  uint16_t version, flags;
  uint32_t header_bytes, reserved;
  uint64_t payload_bytes;
};
static_assert(sizeof(WireHead) == k_frame_head_bytes);

std::optional<ElementType> element_type(const std::string& name) {
  for (const ElementType type :
       {ElementType::u8, ElementType::u16, ElementType::u32, ElementType::i32, ElementType::f32})
    if (name == element_name(type)) return type;
  return std::nullopt;
}

uint64_t aligned(uint64_t offset) { return (offset + k_array_alignment - 1) / k_array_alignment * k_array_alignment; }

Result<ArrayPointer> decode_array(const Json& descriptor, const Payload& payload, uint64_t budget,
                                  const ArrayLimits& limits) {
  const auto member = [&](const char* name) -> const Json* {
    const auto found = descriptor.find(name);
    return found == descriptor.end() ? nullptr : &*found;
  };
  if (!descriptor.is_object()) return Error{"it is not an object"};
  const Json *hash = member("hash"), *dtype = member("dtype"), *shape = member("shape"),
             *offset_member = member("offset");
  if (!hash || !hash->is_string() || !is_array_hash(hash->get_ref<const std::string&>()))
    return Error{"'hash' is not 32 lower-case hexadecimal digits"};
  const auto named = [&](const std::string& problem) {
    return Error{fmt::format("{}: {}", hash->get_ref<const std::string&>(), problem)};
  };
  if (!dtype || !dtype->is_string()) return named("'dtype' is not a string");
  const std::optional<ElementType> type = element_type(dtype->get_ref<const std::string&>());
  if (!type)
    return named(fmt::format("'dtype' is '{}', not one of u8 u16 u32 i32 f32", dtype->get_ref<const std::string&>()));
  if (!shape || !shape->is_array() || shape->empty() || shape->size() > limits.dimensions)
    return named(fmt::format("'shape' is not a list of 1 to {} numbers", limits.dimensions));
  const std::optional<uint64_t> given_offset = offset_member ? whole_number(*offset_member) : std::nullopt;
  if (!given_offset || *given_offset % k_array_alignment) return named("'offset' is not a multiple of 16");
  const uint64_t offset = *given_offset;

  auto array = std::make_shared<Array>();
  array->type = *type;
  // Every dimension is at most `elements` (2^32) and the product is checked at each step, so nothing here overflows;
  // zero dimensions count as one, lest they hide that the others do not fit.
  uint64_t count = 1;
  for (const Json& dimension : *shape) {
    const std::optional<uint64_t> size = whole_number(dimension);
    if (!size) return named("'shape' holds something that is not a whole number from 0");
    const uint64_t factor = *size ? *size : 1;
    if (factor > limits.elements || count > limits.elements / factor)
      return named(fmt::format("'shape' has more than {} elements", limits.elements));
    count *= factor;
    array->shape.push_back(*size);
  }
  const uint64_t bytes = array->byte_count(), available = payload.bytes.size();
  if (offset > available || bytes > available - offset)
    return named(fmt::format("{} bytes at offset {} do not fit the payload of {} bytes", bytes, offset, available));
  if (bytes > budget) return named("the arrays overlap in the payload");
  array->data = payload.bytes.data() + offset;
  array->owner = payload.owner;
  array->hash = array_hash(array->type, array->shape, array->data);
  if (array->hash != hash->get_ref<const std::string&>())
    return named(fmt::format("the content has the hash {}: it was changed or damaged on the way", array->hash));
  return ArrayPointer(std::move(array));
}

}  // namespace

bool is_array_hash(std::string_view text) {
  if (text.size() != 32) return false;
  for (const char c : text)
    if (!((c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'))) return false;
  return true;
}

bool decode_frame_head(std::span<const std::byte, k_frame_head_bytes> bytes, const FrameLimits& limits, FrameHead& head,
                       FrameError& error) {
  WireHead wire;
  std::memcpy(&wire, bytes.data(), sizeof wire);
  const auto malformed = [&](std::string message) {
    error = {false, std::move(message)};
    return false;
  };
  const auto over_limit = [&](std::string message) {
    error = {true, std::move(message)};
    return false;
  };
  if (std::memcmp(wire.magic, k_magic, sizeof k_magic) != 0)
    return malformed("This is not a Lambent frame: it does not start with 'LMBT'.");
  if (wire.version != k_framing_version)
    return malformed(
        fmt::format("The frame has framing version {}; this program reads {}.", wire.version, k_framing_version));
  if (wire.flags & ~(k_flag_fd | k_flag_zstd))
    return malformed(fmt::format("The frame has unknown flags ({:#x}).", wire.flags));
  if (wire.reserved != 0) return malformed("The frame's reserved field is not 0.");
  head.payload_in_fd = wire.flags & k_flag_fd;
  head.payload_zstd = wire.flags & k_flag_zstd;
  if (head.payload_in_fd && !limits.payload_in_fd)
    return malformed("The frame's payload is said to be in a file descriptor, which only a Unix socket passes.");
  if (head.payload_zstd && !limits.payload_zstd)
    return malformed("The frame's payload is compressed, which only saved files may be.");
  if (wire.header_bytes < 2) return malformed("The frame has no JSON header.");
  if (wire.header_bytes > limits.header_bytes)
    return over_limit(
        fmt::format("The frame's header has {} bytes; the limit is {}.", wire.header_bytes, limits.header_bytes));
  if (wire.payload_bytes > limits.payload_bytes)
    return over_limit(
        fmt::format("The frame's payload has {} bytes; the limit is {}.", wire.payload_bytes, limits.payload_bytes));
  head.header_bytes = wire.header_bytes;
  head.payload_bytes = wire.payload_bytes;
  return true;
}

std::array<std::byte, k_frame_head_bytes> encode_frame_head(const FrameHead& head) {
  WireHead wire{};
  std::memcpy(wire.magic, k_magic, sizeof k_magic);
  wire.version = k_framing_version;
  wire.flags = static_cast<uint16_t>((head.payload_in_fd ? k_flag_fd : 0) | (head.payload_zstd ? k_flag_zstd : 0));
  wire.header_bytes = head.header_bytes;
  wire.payload_bytes = head.payload_bytes;
  std::array<std::byte, k_frame_head_bytes> bytes;
  std::memcpy(bytes.data(), &wire, sizeof wire);
  return bytes;
}

std::string encode_frame_start(const Json& header, uint64_t payload_bytes, bool payload_in_fd, bool payload_zstd) {
  const std::string text = json_text(header);
  const auto head = encode_frame_head({payload_in_fd, payload_zstd, static_cast<uint32_t>(text.size()), payload_bytes});
  std::string start(reinterpret_cast<const char*>(head.data()), head.size());
  start += text;
  return start;
}

Result<Json> decode_frame_header(std::string_view text, const JsonLimits& limits) {
  Result<Json> header = parse_json(text, limits);
  if (!header) return header;
  const auto type = header->is_object() ? header->find("type") : header->end();
  if (!header->is_object() || type == header->end() || !type->is_string())
    return Error{"The frame's header is not a JSON object with a string member 'type'."};
  return header;
}

Result<std::vector<ArrayPointer>> decode_arrays(const Json& header, const Payload& payload, const ArrayLimits& limits) {
  const auto descriptors = header.find("arrays");
  if (descriptors == header.end() || !descriptors->is_array())
    return Error{"The message 'arrays' has no list 'arrays' of descriptors."};
  std::vector<ArrayPointer> arrays;
  arrays.reserve(descriptors->size());
  // Arrays that overlap would make a small message cost any amount of hashing, so what is left of the payload's size
  // bounds each.
  uint64_t budget = payload.bytes.size();
  for (const Json& descriptor : *descriptors) {
    Result<ArrayPointer> array = decode_array(descriptor, payload, budget, limits);
    if (!array) return Error{fmt::format("Array {}: {}.", arrays.size(), array.error())};
    budget -= (*array)->byte_count();
    arrays.push_back(std::move(*array));
  }
  return arrays;
}

ArrayLayout lay_out_arrays(std::span<const ArrayPointer> arrays) {
  ArrayLayout layout;
  for (const ArrayPointer& array : arrays) {
    const uint64_t offset = aligned(layout.payload_bytes);
    layout.descriptors.push_back(
        {{"hash", array->hash}, {"dtype", element_name(array->type)}, {"shape", array->shape}, {"offset", offset}});
    layout.payload_bytes = offset + array->byte_count();
  }
  return layout;
}

std::vector<std::byte> gather_payload(std::span<const ArrayPointer> arrays) {
  uint64_t total = 0;
  for (const ArrayPointer& array : arrays) total = aligned(total) + array->byte_count();
  std::vector<std::byte> payload(total);
  uint64_t offset = 0;
  for (const ArrayPointer& array : arrays) {
    offset = aligned(offset);
    if (array->byte_count()) std::memcpy(payload.data() + offset, array->data, array->byte_count());
    offset += array->byte_count();
  }
  return payload;
}

}  // namespace lambent
