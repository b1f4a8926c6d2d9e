// Ctrl-C, and messages on the terminal: what commands that run for long share.
#pragma once

#include <string>

#include "engine/base/report.h"

namespace lambent {

constexpr int k_interrupted = 130;  ///< exit code, as shells report SIGINT

/// From now on the first SIGINT or SIGTERM only makes `interrupted()` true; a second one ends the program at once.
void catch_interrupts();
bool interrupted();

/// Prints "lambent: TEXT" to stderr.
void say(const std::string& text);
/// Prints a report's messages to stderr; only errors if `quiet`.
void print_messages(const Report& report, bool quiet);

}  // namespace lambent
