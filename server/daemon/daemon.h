// The daemon: its listeners, clients, sessions, and its orderly end.
#pragma once

#include <list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/result.h"
#include "server/daemon/client.h"
#include "server/transport/listener.h"

namespace lambent {

struct DaemonOptions {
  std::string socket_path;
  std::string token_path;
  std::string listen_host;  ///< empty: no TCP
  uint16_t listen_port = 0;
  bool allow_remote = false;
  int owner_pid = 0;
  int threads = 0;
  size_t texture_cache_bytes = 0;  ///< for one session; 0: a quarter of this machine's memory
  uint64_t session_bytes = 0;      ///< 0: half of this machine's memory
};

/// `$XDG_RUNTIME_DIR/lambent/<name>`, else `/tmp/lambent-<uid>/<name>`.
std::string default_path(const std::string& name);

/// Runs until a signal, or until its owner is gone.
class Daemon {
 public:
  /// Opens the listeners. Fails with a message for the user.
  static Result<std::unique_ptr<Daemon>> create(const DaemonOptions& options);
  ~Daemon();

  /// Serves clients; returns the exit code.
  int run();
  /// The Unix socket's path, and " and host:port" if there is TCP.
  std::string addresses() const;

  /// Serves a socket that is connected already (tests, fuzzing).
  void adopt(std::shared_ptr<Connection> connection);
  EventLoop& loop() { return loop_; }
  /// Bytes that sessions hold.
  uint64_t used_bytes() const { return context_.budget->used(); }
  /// Clients and ended sessions that are still being freed.
  size_t busy_count() const { return clients_.size() + runners_.size(); }
  /// Closes all clients; the loop stops once their sessions are freed.
  void stop(const std::string& reason);

 private:
  explicit Daemon(const DaemonOptions& options);
  Status open(const DaemonOptions& options);
  void accept(std::shared_ptr<Connection> connection);
  void stop_if_done();

  EventLoop loop_;
  ClientContext context_;
  std::vector<std::unique_ptr<Listener>> listeners_;
  std::list<std::shared_ptr<Client>> clients_;  ///< oldest first
  std::list<std::shared_ptr<SessionRunner>> runners_;
  uint64_t sessions_ = 0;
  bool stopping_ = false;
};

}  // namespace lambent
