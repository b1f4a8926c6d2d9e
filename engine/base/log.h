// Logging through spdlog: one default logger, set up once by the program.
#pragma once

#include <spdlog/spdlog.h>

#include <string>

namespace lambent {

/// Sends the default logger to stderr and, unless empty, also to `file` (appended). `level`: trace, debug, info, warn,
/// error. A file that cannot be opened is reported on stderr and otherwise ignored.
void set_up_log(const std::string& level, const std::string& file);

}  // namespace lambent
