// Frames of PROTOCOL.md, section "Frames": their fixed head, JSON header and the arrays in their payload. No I/O.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/base/result.h"
#include "engine/description/array.h"
#include "engine/description/json_text.h"

namespace lambent {

inline constexpr size_t k_frame_head_bytes = 24;
inline constexpr uint64_t k_max_header_bytes = uint64_t(64) << 20;
inline constexpr uint64_t k_array_alignment = 16;

/// The 24 bytes that start a frame.
struct FrameHead {
  bool payload_in_fd = false;
  bool payload_zstd = false;
  uint32_t header_bytes = 0;
  uint64_t payload_bytes = 0;
  friend bool operator==(const FrameHead&, const FrameHead&) = default;
};

/// What a reader of frames accepts.
struct FrameLimits {
  uint64_t header_bytes = k_max_header_bytes;
  uint64_t payload_bytes = uint64_t(1) << 40;
  bool payload_in_fd = false;
  bool payload_zstd = false;
};

/// Why a frame was refused: over a limit (error code `limit`), or not a frame of this protocol (`malformed`).
struct FrameError {
  bool over_limit = false;
  std::string message;
};

/// The head in `bytes`; on failure, returns false and says why in `error`.
bool decode_frame_head(std::span<const std::byte, k_frame_head_bytes> bytes, const FrameLimits& limits, FrameHead& head,
                       FrameError& error);
std::array<std::byte, k_frame_head_bytes> encode_frame_head(const FrameHead& head);

/// The head and header of a frame, ready to be followed by `payload_bytes` of payload.
std::string encode_frame_start(const Json& header, uint64_t payload_bytes = 0, bool payload_in_fd = false,
                               bool payload_zstd = false);

/// The header of a frame: a JSON object with a string member "type". Fails on anything else.
Result<Json> decode_frame_header(std::string_view text, const JsonLimits& limits = {});

/// What a payload's arrays may be.
struct ArrayLimits {
  uint64_t elements = uint64_t(1) << 32;  ///< of one array
  size_t dimensions = 4;
};

/// A payload in memory: `bytes` are 16-byte aligned and kept alive by `owner`.
struct Payload {
  std::shared_ptr<const void> owner;
  std::span<const std::byte> bytes;
};

/// The arrays that header["arrays"] describes, as views of the payload. Checks every descriptor (type, shape, overflow,
/// offset, limits) and that the content has the hash it claims; the first failure is returned and names the array.
/// Cost: one SHA-256 over the payload.
Result<std::vector<ArrayPointer>> decode_arrays(const Json& header, const Payload& payload,
                                                const ArrayLimits& limits = {});

/// Descriptors for header["arrays"] with the arrays laid out in order, and the bytes of the payload they need.
struct ArrayLayout {
  Json descriptors = Json::array();
  uint64_t payload_bytes = 0;
};
ArrayLayout lay_out_arrays(std::span<const ArrayPointer> arrays);
/// The payload that lay_out_arrays() describes; gaps are zero.
std::vector<std::byte> gather_payload(std::span<const ArrayPointer> arrays);

/// True for 32 lower-case hexadecimal digits.
bool is_array_hash(std::string_view text);

}  // namespace lambent
