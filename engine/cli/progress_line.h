// What the terminal shows while rendering.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>

#include "engine/session/session.h"

namespace lambent {

/// "01:05", "1:02:03"; minutes and seconds, hours if there are any.
std::string clock_text(double seconds);
/// "512.00M", "1.50G".
std::string memory_text(size_t bytes);
/// The state of a render in one line of at most `width` characters, a bar first. `memory_bytes`: of the process.
std::string progress_text(const Progress& progress, size_t memory_bytes, int width);

/// Shows progress on a stream: a line that is overwritten on a terminal, else a plain line every few seconds.
class ProgressLine {
 public:
  explicit ProgressLine(std::FILE* stream);
  ~ProgressLine() { clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const Progress& progress);
  /// Removes the line, so that other text may follow.
  void clear();

 private:
  std::FILE* stream_;
  bool terminal_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace lambent
