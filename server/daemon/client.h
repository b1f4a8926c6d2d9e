// One connected client: its handshake, and where its messages go.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/daemon/memory_budget.h"
#include "server/daemon/session_runner.h"
#include "server/protocol/messages.h"
#include "server/transport/connection.h"

namespace lambent {

/// What every client of a daemon shares.
struct ClientContext {
  EventLoop& loop;
  std::shared_ptr<Engine> engine;
  std::string token;
  protocol::Capabilities capabilities;
  std::shared_ptr<MemoryBudget> budget;  ///< of all sessions together
  std::chrono::milliseconds handshake_time{10'000};
  size_t sessions_limit = 64;

  // The daemon's books.
  std::function<uint64_t()> next_session;
  std::function<size_t()> session_count;
  std::function<void(std::shared_ptr<SessionRunner>)> runner_started;
  std::function<void(SessionRunner*)> runner_finished;
  std::function<void(class Client*)> client_closed;
};

/// On the I/O thread. Kept alive by its connection and by the daemon.
class Client : public ConnectionHandler, public RunnerOutput, public std::enable_shared_from_this<Client> {
 public:
  Client(const ClientContext& context, std::shared_ptr<Connection> connection);

  /// Sends the challenge and starts reading.
  void start();
  bool handshaking() const { return phase_ == Phase::handshake; }
  bool has_session() const { return runner_ != nullptr; }
  void close(const std::string& reason) { connection_->close(reason); }

  // ConnectionHandler
  std::optional<MessageShape> admit(std::span<const std::byte, k_message_head_bytes> head) override;
  void received(IncomingMessage message) override;
  void violated(const std::string& what) override;
  void sent() override;
  void closed(const std::string& reason) override;

  // RunnerOutput
  void send(OutgoingMessage message) override;
  uint64_t pending_bytes() const override { return connection_->pending_bytes(); }
  void fail(const std::string& code, const std::string& text) override;

 private:
  enum class Phase { handshake, ready, ended };

  void dispatch(IncomingMessage message);
  void handle(protocol::ClientMessage message, IncomingMessage raw);
  void shake_hands(const protocol::Hello& hello);
  void forward(std::variant<std::string, protocol::ClientMessage> message, IncomingMessage raw);

  const ClientContext& context_;
  const std::shared_ptr<Connection> connection_;
  Phase phase_ = Phase::handshake;
  std::string nonce_;
  std::string name_;
  std::shared_ptr<MemoryBudget> budget_;
  std::shared_ptr<SessionRunner> runner_;
  std::shared_ptr<const void> header_reservation_;  ///< of the message being received
};

}  // namespace lambent
