#include "engine/description/array.h"

#include <openssl/evp.h>

#include <cstring>
#include <new>

#include "engine/base/check.h"

namespace lambent {
namespace {

constexpr std::align_val_t k_alignment{16};

std::string to_hex(const unsigned char* bytes, size_t count) {
  static constexpr char k_digits[] = "0123456789abcdef";
  std::string text(2 * count, '0');
  for (size_t i = 0; i < count; ++i) {
    text[2 * i] = k_digits[bytes[i] >> 4];
    text[2 * i + 1] = k_digits[bytes[i] & 15];
  }
  return text;
}

}  // namespace

size_t element_size(ElementType type) {
  switch (type) {
    case ElementType::u8:
      return 1;
    case ElementType::u16:
      return 2;
    case ElementType::u32:
    case ElementType::i32:
    case ElementType::f32:
      return 4;
  }
  return 0;
}

const char* element_name(ElementType type) {
  switch (type) {
    case ElementType::u8:
      return "u8";
    case ElementType::u16:
      return "u16";
    case ElementType::u32:
      return "u32";
    case ElementType::i32:
      return "i32";
    case ElementType::f32:
      return "f32";
  }
  return "";
}

std::string array_hash(ElementType type, std::span<const uint64_t> shape, const void* elements) {
  std::string prefix = std::string(element_name(type)) + ":";
  uint64_t bytes = element_size(type);
  for (size_t i = 0; i < shape.size(); ++i) {
    if (i) prefix += 'x';
    prefix += std::to_string(shape[i]);
    bytes *= shape[i];
  }
  prefix += ':';

  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  unsigned char digest[EVP_MAX_MD_SIZE];
  const bool hashed = context && EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) == 1 &&
                      EVP_DigestUpdate(context.get(), prefix.data(), prefix.size()) == 1 &&
                      (bytes == 0 || EVP_DigestUpdate(context.get(), elements, bytes) == 1) &&
                      EVP_DigestFinal_ex(context.get(), digest, nullptr) == 1;
  CHECK(hashed, "SHA-256 is not available from OpenSSL");
  return to_hex(digest, 16);
}

ArrayPointer make_array(ElementType type, std::vector<uint64_t> shape, const void* elements) {
  auto array = std::make_shared<Array>();
  array->type = type;
  array->shape = std::move(shape);
  const size_t bytes = array->byte_count();
  std::shared_ptr<std::byte> memory(static_cast<std::byte*>(::operator new(bytes ? bytes : 1, k_alignment)),
                                    [](std::byte* block) { ::operator delete(block, k_alignment); });
  if (bytes) std::memcpy(memory.get(), elements, bytes);
  array->data = memory.get();
  array->owner = std::move(memory);
  array->hash = array_hash(array->type, array->shape, array->data);
  return array;
}

}  // namespace lambent
