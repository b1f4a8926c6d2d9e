// Writing a file so that its name never holds half of it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "engine/base/result.h"

namespace lambent {

/// A file under a temporary name beside its final one. commit() renames it; otherwise the destructor removes it.
class AtomicFile {
 public:
  /// Opens the temporary file. Check status().
  explicit AtomicFile(std::string path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Ok as long as everything so far worked; then the first failure, naming file and cause.
  const Status& status() const { return status_; }
  /// Appends; does nothing after a failure.
  void write(const void* bytes, size_t count);
  void write(std::string_view text) { write(text.data(), text.size()); }
  uint64_t bytes_written() const { return bytes_written_; }
  /// Flushes to the disk and gives the file its name.
  Status commit();

 private:
  void fail(const char* what);

  std::string path_, temporary_path_;
  int descriptor_ = -1;
  uint64_t bytes_written_ = 0;
  Status status_ = Ok{};
};

}  // namespace lambent
