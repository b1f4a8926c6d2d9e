#include "engine/cli/interruption.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <ctime>

namespace lambent {
namespace {

std::atomic<int64_t> interrupted_at_ms{0};  ///< 0: not yet. Set by the signal handler, which can reach nothing else

/// The first interrupt stops in order, a second quits at once, without a picture. One Ctrl-C may arrive twice (from the
/// terminal and from a parent such as timeout(1)), so what comes together counts as one.
void on_interrupt(int) {
  constexpr int64_t k_together_ms = 300;
  timespec time{};
  ::clock_gettime(CLOCK_MONOTONIC, &time);
  const int64_t now_ms = int64_t(time.tv_sec) * 1000 + time.tv_nsec / 1'000'000;
  int64_t first_ms = 0;
  if (!interrupted_at_ms.compare_exchange_strong(first_ms, now_ms) && now_ms - first_ms > k_together_ms)
    ::_exit(k_interrupted);
}

}  // namespace

void catch_interrupts() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
}

bool interrupted() { return interrupted_at_ms != 0; }

void say(const std::string& text) { std::fprintf(stderr, "lambent: %s\n", text.c_str()); }

void print_messages(const Report& report, bool quiet) {
  static constexpr const char* k_names[] = {"info", "warning", "error"};
  for (const Message& message : report.messages())
    if (!quiet || message.severity == Severity::error)
      std::fprintf(stderr, "lambent: %s: %s\n", k_names[size_t(message.severity)], message.text.c_str());
  if (const size_t dropped = report.dropped(); dropped && !quiet) say(fmt::format("and {} more messages", dropped));
}

}  // namespace lambent
