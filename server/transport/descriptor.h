// File descriptors that travel beside bytes on Unix sockets, and the sealed memory in them.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "engine/base/result.h"

namespace lambent {

/// Owns a file descriptor.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { reset(); }
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    if (this != &other) {
      reset();
      number_ = std::exchange(other.number_, -1);
    }
    return *this;
  }
  int number() const { return number_; }
  explicit operator bool() const { return number_ >= 0; }
  void reset();
  /// Gives it up: the caller closes it.
  int release() { return std::exchange(number_, -1); }

 private:
  int number_ = -1;
};

/// Bytes read and the descriptor that came with them.
struct Received {
  ssize_t bytes = 0;      ///< as recvmsg(2): 0 at the end, -1 with errno
  Descriptor descriptor;  ///< the first, if any
  bool too_many = false;  ///< more than one came (all others are closed)
};

/// Reads at most `count` bytes without blocking.
Received receive_with_descriptor(int socket, void* to, size_t count);

/// Maps `bytes` bytes of a memfd read-only. Fails unless it is sealed against shrinking, growing and writing (so that
/// its content can neither change nor vanish under us) and large enough.
Result<std::shared_ptr<const std::byte>> map_sealed_memory(const Descriptor& descriptor, uint64_t bytes);

}  // namespace lambent
