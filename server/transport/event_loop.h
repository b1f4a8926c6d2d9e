// The I/O thread: everything in transport/ happens on it. Hides Asio.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <functional>
#include <memory>
#include <vector>

namespace lambent {

/// One thread's loop of socket events, timers and posted work.
class EventLoop {
 public:
  EventLoop();
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  /// Runs until stop(). Exceptions of handlers leave it; calling it again continues.
  void run();
  /// From any thread.
  void stop();
  /// Runs `work` on the loop's thread. From any thread; in order for one calling thread.
  void post(std::function<void()> work);
  /// Runs `work` once after `delay`. On the loop's thread.
  void after(std::chrono::milliseconds delay, std::function<void()> work);
  /// Runs `work` for each of the signals that arrives.
  void on_signals(const std::vector<int>& signals, std::function<void(int)> work);
  /// Runs `work` once when the process `pid` is gone (at once if there is none).
  void on_exit_of(pid_t pid, std::function<void()> work);

  struct State;  ///< Asio's; for the rest of transport/
  State& state() { return *state_; }

 private:
  void poll_exit_of(pid_t pid, std::function<void()> work);

  std::unique_ptr<State> state_;
};

}  // namespace lambent
