// One client's byte stream, cut into messages: a fixed head, a header, a payload. What the head means is the owner's
// business. All functions and callbacks on the event loop's thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "server/transport/event_loop.h"

namespace lambent {

inline constexpr size_t k_message_head_bytes = 24;

/// What follows a head, as admitted by the owner.
struct MessageShape {
  uint64_t header_bytes = 0;
  uint64_t payload_bytes = 0;
  bool payload_in_descriptor = false;
  /// Kept alive as long as the payload's memory: the owner's account of it.
  std::shared_ptr<const void> reservation;
};

/// A whole message. The payload is read-only, 16-byte aligned, and lives as long as `payload_owner`.
struct IncomingMessage {
  std::string header;
  std::shared_ptr<const void> payload_owner;
  std::span<const std::byte> payload;
};

/// Bytes to send: `start`, then `payload`, which `payload_owner` keeps alive.
struct OutgoingMessage {
  std::string start;
  std::shared_ptr<const void> payload_owner;
  std::span<const std::byte> payload;
};

class Connection;

/// What a connection reports to.
class ConnectionHandler {
 public:
  virtual ~ConnectionHandler() = default;
  /// A head arrived. Returns what may follow, before memory is taken for it; nothing if the message is refused, in
  /// which case the handler has closed the connection (or will).
  virtual std::optional<MessageShape> admit(std::span<const std::byte, k_message_head_bytes> head) = 0;
  virtual void received(IncomingMessage message) = 0;
  /// The client broke the transport's rules (a payload that is not a sealed memfd, say). The connection reads no more.
  virtual void violated(const std::string& what) = 0;
  /// Something was sent: pending_bytes() fell.
  virtual void sent() = 0;
  /// The last callback. `reason` is for the log.
  virtual void closed(const std::string& reason) = 0;
};

struct ConnectionLimits {
  std::chrono::milliseconds inside_message{60'000};  ///< longest silence inside a message
  std::chrono::milliseconds last_words{2'000};       ///< for what is queued when close_when_sent() is called
};

/// A connected stream socket (Unix or TCP).
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  /// Takes over a connected socket. `name` is for the log.
  static std::shared_ptr<Connection> adopt(EventLoop& loop, int socket, bool unix_socket, std::string name,
                                           const ConnectionLimits& limits = {});
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Starts reading. The connection keeps the handler until closed() has been called.
  void start(std::shared_ptr<ConnectionHandler> handler);
  /// Queues a message; never blocks.
  void send(OutgoingMessage message);
  /// Bytes queued and not yet taken by the system.
  uint64_t pending_bytes() const;
  /// Reads no more, sends what is queued (for a limited time), then closes.
  void close_when_sent(std::string reason);
  void close(std::string reason);
  bool open() const;
  /// Whether messages may carry descriptors.
  bool unix_socket() const;
  const std::string& name() const;

  struct State;

 private:
  Connection();
  void wait_readable();
  void on_readable();
  bool read_some();
  void advance();
  void finish_header();
  void finish_payload();
  void violate(const std::string& what);
  void wait_writable();
  void write_queued();
  void arm_timeout();

  std::unique_ptr<State> state_;
};

}  // namespace lambent
