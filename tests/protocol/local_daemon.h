// A daemon inside the test's process, on a thread of its own, with connections by socket pairs.
#pragma once

#include <memory>
#include <string>
#include <thread>

#include "server/daemon/daemon.h"
#include "tests/protocol/wire_client.h"

namespace lambent {

class LocalDaemon {
 public:
  explicit LocalDaemon(uint64_t session_bytes = 0);
  ~LocalDaemon();

  /// A new connection, before its handshake.
  std::unique_ptr<WireClient> connect();
  /// A new session; null if the handshake failed.
  std::unique_ptr<WireClient> open_session();
  const std::string& token() const { return token_; }
  uint64_t used_bytes() const { return daemon_->used_bytes(); }
  /// Waits until clients and sessions are gone; false after 10 s.
  bool wait_until_free();

 private:
  std::string folder_, token_;
  std::unique_ptr<Daemon> daemon_;
  std::thread thread_;
};

}  // namespace lambent
