#include "engine/base/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace lambent {

AtomicFile::AtomicFile(std::string path) : path_(std::move(path)) {
  temporary_path_ = fmt::format("{}.{}.tmp", path_, ::getpid());
  descriptor_ = ::open(temporary_path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0666);
  if (descriptor_ < 0) fail("created");
}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(temporary_path_.c_str());
}

void AtomicFile::fail(const char* what) {
  if (status_) status_ = Error{fmt::format("The file '{}' could not be {}: {}.", path_, what, std::strerror(errno))};
}

void AtomicFile::write(const void* bytes, size_t count) {
  const char* from = static_cast<const char*>(bytes);
  while (status_ && count > 0) {
    // Linux writes at most some 2 GiB in one call.
    const ssize_t written = ::write(descriptor_, from, std::min(count, size_t(1) << 30));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      fail("written");
      return;
    }
    from += written;
    count -= static_cast<size_t>(written);
    bytes_written_ += static_cast<uint64_t>(written);
  }
}

Status AtomicFile::commit() {
  if (status_ && ::fsync(descriptor_) != 0 && errno != EINVAL && errno != EROFS) fail("written");
  if (status_ && ::rename(temporary_path_.c_str(), path_.c_str()) != 0) fail("renamed from its temporary name");
  if (status_) {
    ::close(descriptor_);
    descriptor_ = -1;
  }
  return status_;
}

}  // namespace lambent
