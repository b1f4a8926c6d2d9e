// Cooperative cancellation.
#pragma once

#include <atomic>

namespace lambent {

/// Set by one thread, polled by others. Long work polls at least every few milliseconds.
class CancelFlag {
 public:
  void cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }

 private:
  std::atomic<bool> cancelled_{false};
};

}  // namespace lambent
