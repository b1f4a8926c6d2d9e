// Typed, immutable, shared arrays: the bulk data of a description. They may own memory or view shared memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace lambent {

enum class ElementType : uint8_t { u8, u16, u32, i32, f32 };

/// Bytes of one element.
size_t element_size(ElementType type);
/// "u8", "u16", "u32", "i32" or "f32", as on the wire.
const char* element_name(ElementType type);

/// A C-contiguous little-endian array. Immutable once made; shared by pointer. `hash` is that of PROTOCOL.md (32 hex
/// digits).
struct Array {
  ElementType type = ElementType::f32;
  std::vector<uint64_t> shape;  ///< C order, slowest first
  const std::byte* data =
      nullptr;  ///< element_count() * element_size(type) bytes, 16-byte aligned, kept alive by `owner`
  std::shared_ptr<const void> owner;
  std::string hash;

  uint64_t element_count() const {
    uint64_t count = 1;
    for (const uint64_t n : shape) count *= n;
    return count;
  }
  uint64_t byte_count() const { return element_count() * element_size(type); }
  /// Rows of the slowest dimension (0 for a shapeless array).
  uint64_t rows() const { return shape.empty() ? 0 : shape[0]; }
  /// Elements in one row.
  uint64_t row_size() const { return rows() ? element_count() / rows() : 0; }

  /// The elements as T; the caller has validated `type`.
  template <typename T>
  std::span<const T> as() const {
    return {reinterpret_cast<const T*>(data), static_cast<size_t>(byte_count() / sizeof(T))};
  }
};
using ArrayPointer = std::shared_ptr<const Array>;

/// Copies elements into a new array and computes its hash.
ArrayPointer make_array(ElementType type, std::vector<uint64_t> shape, const void* elements);
/// The hash of PROTOCOL.md, section "Arrays".
std::string array_hash(ElementType type, std::span<const uint64_t> shape, const void* elements);

}  // namespace lambent
