// A minimal blocking client for tests, over a connected socket.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "engine/description/array.h"
#include "engine/description/json_text.h"

namespace lambent {

struct WireMessage {
  Json header;
  std::vector<std::byte> payload;
  std::string type() const { return header.value("type", ""); }
};

class WireClient {
 public:
  /// Takes over a connected socket. Reads time out after `timeout_s`.
  explicit WireClient(int socket, double timeout_s = 20.0);
  ~WireClient();
  WireClient(const WireClient&) = delete;
  WireClient& operator=(const WireClient&) = delete;

  /// False if the other end is gone.
  bool send_bytes(const std::string& bytes);
  bool send(const Json& header, const std::vector<std::byte>& payload = {});
  bool send_arrays(const std::vector<ArrayPointer>& arrays);
  /// With the payload in a memfd. `seals`: as for fcntl(F_ADD_SEALS).
  bool send_arrays_shared(const std::vector<ArrayPointer>& arrays, int seals);
  /// Bytes with a file descriptor beside them.
  bool send_with_descriptor(const std::string& bytes, int descriptor);
  /// The next message; empty at the end of the stream or after the timeout.
  std::optional<WireMessage> receive();
  /// The next message of a type, dropping others.
  std::optional<WireMessage> receive(const std::string& type);
  /// Reads and drops what is there, without waiting; false if the stream has ended.
  bool drain();
  /// Handshake with `token`; the daemon's answer.
  std::optional<WireMessage> shake_hands(const std::string& token);
  int socket() const { return socket_; }
  void close();

 private:
  bool read(void* to, size_t count);
  int socket_;
};

}  // namespace lambent
