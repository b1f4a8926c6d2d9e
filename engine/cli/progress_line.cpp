#include "engine/cli/progress_line.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "engine/base/memory.h"

namespace lambent {
namespace {

using namespace std::chrono_literals;

/// Done, in [0, 1]; negative if that is not known.
double fraction_of(const Progress& progress) {
  if (progress.remaining_s) {
    const double total = progress.elapsed_s + *progress.remaining_s;
    return total > 0.0 ? progress.elapsed_s / total : 0.0;
  }
  if (progress.samples_total > 0)
    return static_cast<double>(progress.samples) / static_cast<double>(progress.samples_total);
  return -1.0;
}

int terminal_width(std::FILE* stream) {
  winsize size{};
  return ::ioctl(::fileno(stream), TIOCGWINSZ, &size) == 0 && size.ws_col > 20 ? size.ws_col : 100;
}

}  // namespace

std::string clock_text(double seconds) {
  if (!(seconds >= 0.0) || seconds > 1e9) return "--:--";
  const auto whole = static_cast<int64_t>(std::llround(seconds));
  const int64_t hours = whole / 3600, minutes = whole / 60 % 60, rest = whole % 60;
  return hours ? fmt::format("{}:{:02}:{:02}", hours, minutes, rest) : fmt::format("{:02}:{:02}", minutes, rest);
}

std::string memory_text(size_t bytes) {
  const double mega = static_cast<double>(bytes) / (1 << 20);
  return mega < 1024.0 ? fmt::format("{:.2f}M", mega) : fmt::format("{:.2f}G", mega / 1024.0);
}

std::string progress_text(const Progress& progress, size_t memory_bytes, int width) {
  std::string text;
  switch (progress.stage) {
    case Stage::idle:
      text = "done";
      break;
    case Stage::updating:
    case Stage::building:
      text = fmt::format("building the scene, {}", clock_text(progress.elapsed_s));
      break;
    case Stage::rendering: {
      const std::string total = progress.samples_total > 0 ? fmt::format("/{}", progress.samples_total) : "";
      text = fmt::format("Sample {}{}, Tile {}/{} | {} elapsed", progress.samples, total, progress.tiles,
                         progress.tiles_total, clock_text(progress.elapsed_s));
      if (progress.remaining_s) text += fmt::format(", {} remaining", clock_text(*progress.remaining_s));
      break;
    }
  }
  text += fmt::format(" | Mem:{}", memory_text(memory_bytes));
  const double fraction = progress.stage == Stage::rendering ? fraction_of(progress) : -1.0;
  const int room = std::min(30, width - static_cast<int>(text.size()) - 9);
  if (fraction >= 0.0 && room >= 5) {
    const int done = static_cast<int>(std::clamp(fraction, 0.0, 1.0) * room);
    text = fmt::format("[{}{}] {:3.0f}% {}", std::string(done, '='), std::string(room - done, ' '),
                       100.0 * std::clamp(fraction, 0.0, 1.0), text);
  }
  if (static_cast<int>(text.size()) >= width) text.resize(width - 1);
  return text;
}

ProgressLine::ProgressLine(std::FILE* stream) : stream_(stream), terminal_(::isatty(::fileno(stream)) != 0) {}

void ProgressLine::show(const Progress& progress) {
  const auto now = std::chrono::steady_clock::now();
  if (!terminal_ && now - last_ < 5s) return;
  last_ = now;
  const std::string text = progress_text(progress, resident_bytes(), terminal_ ? terminal_width(stream_) : 200);
  std::fprintf(stream_, terminal_ ? "\r\x1b[K%s" : "%s\n", text.c_str());
  std::fflush(stream_);
  shown_ = terminal_;
}

void ProgressLine::clear() {
  if (shown_) std::fputs("\r\x1b[K", stream_);
  shown_ = false;
}

}  // namespace lambent
