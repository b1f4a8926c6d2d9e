// Large arrays of zeros that take no time to make.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <limits>
#include <new>
#include <vector>

namespace lambent {

/// Memory that the system gives as zeros when it is first touched, by whoever touches it: a film of gigabytes is there
/// at once, and its pages are made by the threads that render. Elements that are not given a value are not written at
/// all, so a ZeroedVector is to be sized once, while it is empty. T: any type whose zero is all bytes 0.
template <typename T>
struct ZeroedAllocator {
  using value_type = T;
  ZeroedAllocator() = default;
  template <typename U>
  ZeroedAllocator(const ZeroedAllocator<U>&) {}

  T* allocate(size_t count) {
    if (count > std::numeric_limits<size_t>::max() / sizeof(T)) throw std::bad_alloc();
    const size_t bytes = count * sizeof(T);
    if (!is_mapped(bytes)) {
      void* const found = std::calloc(count, sizeof(T));
      if (!found) throw std::bad_alloc();
      return static_cast<T*>(found);
    }
    void* const found = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (found == MAP_FAILED) throw std::bad_alloc();
    ::madvise(found, bytes, MADV_HUGEPAGE);  // a wish: fewer faults, and given back in a moment
    return static_cast<T*>(found);
  }
  void deallocate(T* place, size_t count) {
    const size_t bytes = count * sizeof(T);
    if (is_mapped(bytes))
      ::munmap(place, bytes);
    else
      std::free(place);
  }
  template <typename U>
  void construct(U*) noexcept {}  // zeros already
  template <typename U, typename... Arguments>
  void construct(U* place, Arguments&&... arguments) {
    ::new (static_cast<void*>(place)) U(static_cast<Arguments&&>(arguments)...);
  }
  template <typename U>
  bool operator==(const ZeroedAllocator<U>&) const {
    return true;
  }

 private:
  /// The allocator's own large blocks are zeroed anew when they are used again; under the address sanitizer all memory
  /// is its business.
  static bool is_mapped([[maybe_unused]] size_t bytes) {
#if defined(__SANITIZE_ADDRESS__)
    return false;
#else
    return bytes >= size_t(1) << 20;
#endif
  }
};

template <typename T>
using ZeroedVector = std::vector<T, ZeroedAllocator<T>>;

}  // namespace lambent
