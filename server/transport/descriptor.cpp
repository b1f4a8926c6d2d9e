#include "server/transport/descriptor.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace lambent {

void Descriptor::reset() {
  if (number_ >= 0) ::close(number_);
  number_ = -1;
}

Received receive_with_descriptor(int socket, void* to, size_t count) {
  constexpr size_t k_room = 8;  ///< descriptors received at once; the kernel closes what does not fit
  iovec part{to, count};
  alignas(cmsghdr) char control[CMSG_SPACE(k_room * sizeof(int))];
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;
  Received received;
  do {
    received.bytes = ::recvmsg(socket, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
  } while (received.bytes < 0 && errno == EINTR);
  if (received.bytes < 0) return received;
  received.too_many = message.msg_flags & MSG_CTRUNC;
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header; header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_RIGHTS) continue;
    const size_t descriptors = (header->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (size_t i = 0; i < descriptors; ++i) {
      int number;
      std::memcpy(&number, CMSG_DATA(header) + i * sizeof number, sizeof number);
      Descriptor one(number);
      if (received.descriptor)
        received.too_many = true;
      else
        received.descriptor = std::move(one);
    }
  }
  return received;
}

Result<std::shared_ptr<const std::byte>> map_sealed_memory(const Descriptor& descriptor, uint64_t bytes) {
  constexpr int k_needed = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE;
  const int seals = ::fcntl(descriptor.number(), F_GET_SEALS);
  if (seals < 0 || (seals & k_needed) != k_needed)
    return Error{"The payload's file descriptor is not a memfd sealed against shrinking, growing and writing."};
  struct stat status {};
  if (::fstat(descriptor.number(), &status) != 0 || status.st_size < 0 || static_cast<uint64_t>(status.st_size) < bytes)
    return Error{"The payload's memfd is shorter than the frame says."};
  if (bytes == 0) return std::shared_ptr<const std::byte>();
  void* memory = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, descriptor.number(), 0);
  if (memory == MAP_FAILED)
    return Error{std::string("The payload's memfd cannot be mapped: ") + std::strerror(errno) + "."};
  return std::shared_ptr<const std::byte>(static_cast<const std::byte*>(memory),
                                          [bytes](const std::byte* p) { ::munmap(const_cast<std::byte*>(p), bytes); });
}

}  // namespace lambent
