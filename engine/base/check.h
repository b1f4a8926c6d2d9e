// CHECK: an invariant that only a programming error can break. Always on and cold; DCHECK only in debug builds.
#pragma once

#include <string>

namespace lambent {

class CancelFlag;

/// Prints the expression, place, message and the thread's render context (scene, pixel, sample), then aborts.
[[noreturn]] void check_failed(const char* expression, const char* file, int line, const std::string& message = {});

/// What the current thread is rendering; printed by a failing check so that the sample can be replayed.
struct RenderContext {
  const char* scene = nullptr;
  int pixel_x = -1, pixel_y = -1;
  long sample = -1;
  /// Whoever waits deep inside of a sample (for an image to be decoded) gives up when it is set, and says so in
  /// `interrupted`: what the thread is computing is void then. Null: never.
  const CancelFlag* cancel = nullptr;
  bool interrupted = false;
};
/// The calling thread's context.
RenderContext& render_context();

/// Has waits of this thread end with `cancel`, for as long as it lives.
class Interruptible {
 public:
  explicit Interruptible(const CancelFlag& cancel) : before_(render_context().cancel) {
    render_context().cancel = &cancel;
    render_context().interrupted = false;
  }
  ~Interruptible() { render_context().cancel = before_; }
  Interruptible(const Interruptible&) = delete;
  Interruptible& operator=(const Interruptible&) = delete;

 private:
  const CancelFlag* before_;
};

}  // namespace lambent

#define CHECK(expression, ...)                                                             \
  do {                                                                                     \
    if (!(expression)) [[unlikely]]                                                        \
      ::lambent::check_failed(#expression, __FILE__, __LINE__ __VA_OPT__(, ) __VA_ARGS__); \
  } while (false)

#ifdef NDEBUG
#define DCHECK(expression, ...) static_cast<void>(0)
#else
#define DCHECK(expression, ...) CHECK(expression __VA_OPT__(, ) __VA_ARGS__)
#endif
