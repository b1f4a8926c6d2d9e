#include "tests/protocol/wire_client.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "engine/description/frame.h"
#include "server/transport/authentication.h"

namespace lambent {

WireClient::WireClient(int socket, double timeout_s) : socket_(socket) {
  const timeval time{static_cast<time_t>(timeout_s),
                     static_cast<suseconds_t>((timeout_s - static_cast<time_t>(timeout_s)) * 1e6)};
  ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &time, sizeof time);
  ::setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &time, sizeof time);
}

WireClient::~WireClient() { close(); }

void WireClient::close() {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
}

bool WireClient::send_bytes(const std::string& bytes) {
  for (size_t at = 0; at < bytes.size();) {
    const ssize_t sent = ::send(socket_, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
    if (sent <= 0) return false;
    at += static_cast<size_t>(sent);
  }
  return true;
}

bool WireClient::send(const Json& header, const std::vector<std::byte>& payload) {
  std::string bytes = encode_frame_start(header, payload.size());
  bytes.append(reinterpret_cast<const char*>(payload.data()), payload.size());
  return send_bytes(bytes);
}

bool WireClient::send_arrays(const std::vector<ArrayPointer>& arrays) {
  return send({{"type", "arrays"}, {"arrays", lay_out_arrays(arrays).descriptors}}, gather_payload(arrays));
}

bool WireClient::send_arrays_shared(const std::vector<ArrayPointer>& arrays, int seals) {
  const std::vector<std::byte> payload = gather_payload(arrays);
  const int memory = ::memfd_create("test", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  bool good = memory >= 0 && ::write(memory, payload.data(), payload.size()) == static_cast<ssize_t>(payload.size());
  good = good && (seals == 0 || ::fcntl(memory, F_ADD_SEALS, seals) == 0);
  good = good &&
         send_with_descriptor(encode_frame_start({{"type", "arrays"}, {"arrays", lay_out_arrays(arrays).descriptors}},
                                                 payload.size(), /*payload_in_fd=*/true),
                              memory);
  ::close(memory);
  return good;
}

bool WireClient::send_with_descriptor(const std::string& bytes, int descriptor) {
  iovec part{const_cast<char*>(bytes.data()), bytes.size()};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;
  cmsghdr* header = CMSG_FIRSTHDR(&message);
  header->cmsg_level = SOL_SOCKET;
  header->cmsg_type = SCM_RIGHTS;
  header->cmsg_len = CMSG_LEN(sizeof(int));
  std::memcpy(CMSG_DATA(header), &descriptor, sizeof descriptor);
  const ssize_t sent = ::sendmsg(socket_, &message, MSG_NOSIGNAL);
  return sent > 0 && send_bytes(bytes.substr(static_cast<size_t>(sent)));
}

bool WireClient::read(void* to, size_t count) {
  char* at = static_cast<char*>(to);
  while (count > 0) {
    const ssize_t got = ::recv(socket_, at, count, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += got;
    count -= static_cast<size_t>(got);
  }
  return true;
}

std::optional<WireMessage> WireClient::receive() {
  std::array<std::byte, k_frame_head_bytes> bytes;
  FrameHead head;
  FrameError error;
  if (!read(bytes.data(), bytes.size()) || !decode_frame_head(bytes, {}, head, error)) return std::nullopt;
  std::string text(head.header_bytes, '\0');
  WireMessage message;
  message.payload.resize(head.payload_bytes);
  if (!read(text.data(), text.size()) || !read(message.payload.data(), message.payload.size())) return std::nullopt;
  Result<Json> header = decode_frame_header(text);
  if (!header) return std::nullopt;
  message.header = std::move(*header);
  return message;
}

std::optional<WireMessage> WireClient::receive(const std::string& type) {
  for (;;) {
    std::optional<WireMessage> message = receive();
    if (!message || message->type() == type) return message;
  }
}

bool WireClient::drain() {
  char dropped[65536];
  for (;;) {
    const ssize_t got = ::recv(socket_, dropped, sizeof dropped, MSG_DONTWAIT);
    if (got == 0) return false;
    if (got < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
  }
}

std::optional<WireMessage> WireClient::shake_hands(const std::string& token) {
  const std::optional<WireMessage> challenge = receive();
  if (!challenge || challenge->type() != "challenge") return std::nullopt;
  const std::string nonce = make_nonce();
  send({{"type", "hello"},
        {"protocol", 1},
        {"client", "test"},
        {"nonce", nonce},
        {"proof", proof(token, "client", challenge->header["nonce"].get<std::string>(), nonce)}});
  return receive();
}

}  // namespace lambent
