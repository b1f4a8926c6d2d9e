// Accepting clients, on a Unix socket of this user alone or on TCP.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "engine/base/result.h"
#include "server/transport/connection.h"
#include "server/transport/event_loop.h"

namespace lambent {

/// A listening socket; closed (and the Unix socket's file removed) by the destructor.
class Listener {
 public:
  using Accept = std::function<void(std::shared_ptr<Connection>)>;

  /// Listens at `path` (mode 0600; its folder is made with mode 0700 if absent). Clients of other users are turned
  /// away. Replaces the socket of a daemon that is gone; fails if one still answers there.
  static Result<std::unique_ptr<Listener>> at_path(EventLoop& loop, const std::string& path, Accept accept,
                                                   const ConnectionLimits& limits = {});
  /// Listens on TCP; port 0 takes a free one. `allow_remote` permits addresses other than the loopback's.
  static Result<std::unique_ptr<Listener>> at_address(EventLoop& loop, const std::string& host, uint16_t port,
                                                      bool allow_remote, Accept accept,
                                                      const ConnectionLimits& limits = {});
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  /// The path, or "address:port" with the port in use.
  const std::string& address() const;
  /// Stops accepting.
  void close();

  struct State;

 private:
  explicit Listener(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

/// Makes the folder of `path` with mode 0700 if it is absent. Fails if it is not a folder of this user, or others may
/// write to it (then they could replace what is in it).
Status make_private_folder_of(const std::string& path);

}  // namespace lambent
