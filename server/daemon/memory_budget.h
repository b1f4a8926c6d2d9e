// Accounts of memory that clients make the daemon hold.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

namespace lambent {

/// A limit in bytes, within that of a parent. Thread-safe.
class MemoryBudget : public std::enable_shared_from_this<MemoryBudget> {
 public:
  static std::shared_ptr<MemoryBudget> create(uint64_t limit, std::shared_ptr<MemoryBudget> parent = nullptr) {
    return std::shared_ptr<MemoryBudget>(new MemoryBudget(limit, std::move(parent)));
  }

  /// Takes `bytes` until the result is destroyed; null if they are not left.
  std::shared_ptr<const void> reserve(uint64_t bytes) {
    if (!take(bytes)) return nullptr;
    return std::shared_ptr<const void>(this,
                                       [self = shared_from_this(), bytes](const void*) { self->give_back(bytes); });
  }

  uint64_t used() const { return used_.load(); }
  uint64_t limit() const { return limit_; }

 private:
  MemoryBudget(uint64_t limit, std::shared_ptr<MemoryBudget> parent) : limit_(limit), parent_(std::move(parent)) {}

  bool take(uint64_t bytes) {
    uint64_t used = used_.load();
    do {
      if (bytes > limit_ || used > limit_ - bytes) return false;
    } while (!used_.compare_exchange_weak(used, used + bytes));
    if (!parent_ || parent_->take(bytes)) return true;
    used_ -= bytes;
    return false;
  }
  void give_back(uint64_t bytes) {
    used_ -= bytes;
    if (parent_) parent_->give_back(bytes);
  }

  const uint64_t limit_;
  const std::shared_ptr<MemoryBudget> parent_;
  std::atomic<uint64_t> used_{0};
};

}  // namespace lambent
