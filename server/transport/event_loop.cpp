#include "server/transport/event_loop.h"

#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>

#include "server/transport/event_loop_state.h"

namespace lambent {
namespace {

void wait_for_signal(asio::signal_set& signals, const std::shared_ptr<std::function<void(int)>>& work) {
  signals.async_wait([&signals, work](const std::error_code& error, int signal) {
    if (error) return;
    (*work)(signal);
    wait_for_signal(signals, work);
  });
}

}  // namespace

EventLoop::EventLoop() : state_(std::make_unique<State>()) {}
EventLoop::~EventLoop() = default;

void EventLoop::run() {
  state_->context.restart();
  state_->context.run();
}

void EventLoop::stop() { state_->context.stop(); }

void EventLoop::post(std::function<void()> work) { asio::post(state_->context, std::move(work)); }

void EventLoop::after(std::chrono::milliseconds delay, std::function<void()> work) {
  auto timer = std::make_shared<asio::steady_timer>(state_->context, delay);
  timer->async_wait([timer, work = std::move(work)](const std::error_code& error) {
    if (!error) work();
  });
}

void EventLoop::on_signals(const std::vector<int>& signals, std::function<void(int)> work) {
  for (const int signal : signals) state_->signals.add(signal);
  wait_for_signal(state_->signals, std::make_shared<std::function<void(int)>>(std::move(work)));
}

void EventLoop::on_exit_of(pid_t pid, std::function<void()> work) {
  // A pidfd becomes readable when the process ends, without delay and without mistaking a later process of the same
  // number for it.
  const int descriptor = static_cast<int>(::syscall(SYS_pidfd_open, pid, 0));
  if (descriptor < 0) {
    poll_exit_of(pid, std::move(work));
    return;
  }
  auto process = std::make_shared<asio::posix::stream_descriptor>(state_->context, descriptor);
  process->async_wait(asio::posix::stream_descriptor::wait_read,
                      [process, work = std::move(work)](const std::error_code& error) {
                        if (!error) work();
                      });
}

/// For kernels without pidfd_open (before 5.3), and for processes that are gone already.
void EventLoop::poll_exit_of(pid_t pid, std::function<void()> work) {
  if (::kill(pid, 0) != 0 && errno == ESRCH) {
    post(std::move(work));
    return;
  }
  after(std::chrono::milliseconds(500), [this, pid, work = std::move(work)] { poll_exit_of(pid, work); });
}

}  // namespace lambent
