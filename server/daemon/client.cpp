#include "server/daemon/client.h"

#include <fmt/format.h>

#include <exception>

#include "engine/base/log.h"
#include "engine/description/frame.h"
#include "server/daemon/session_messages.h"
#include "server/transport/authentication.h"

#ifndef LAMBENT_VERSION
#define LAMBENT_VERSION "0"
#endif

namespace lambent {
namespace {

/// Before the client has proved who it is.
constexpr uint64_t k_handshake_header_bytes = 4096;
/// Longer headers are parsed by the session's worker.
constexpr size_t k_parse_here_bytes = size_t(64) << 10;
/// Answers that a client leaves unread.
constexpr uint64_t k_pending_limit = uint64_t(64) << 20;
constexpr size_t k_queued_limit = 65536;

/// A client's text, fit for a log line.
std::string printable(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return text;
}

}  // namespace

Client::Client(const ClientContext& context, std::shared_ptr<Connection> connection)
    : context_(context), connection_(std::move(connection)), nonce_(make_nonce()), name_(connection_->name()) {}

void Client::start() {
  spdlog::info("{} connected", name_);
  connection_->start(shared_from_this());
  send(message_of(protocol::challenge(nonce_)));
  context_.loop.after(context_.handshake_time, [weak = weak_from_this()] {
    const auto self = weak.lock();
    if (self && self->handshaking()) self->fail("authentication", "The handshake took too long.");
  });
}

std::optional<MessageShape> Client::admit(std::span<const std::byte, k_message_head_bytes> bytes) {
  const protocol::Limits& limits = context_.capabilities.limits;
  FrameLimits accepted;
  accepted.header_bytes = handshaking() ? k_handshake_header_bytes : limits.header_bytes;
  accepted.payload_bytes = handshaking() ? 0 : limits.payload_bytes;
  accepted.payload_in_fd = !handshaking() && connection_->unix_socket();
  FrameHead head;
  FrameError error;
  if (!decode_frame_head(bytes, accepted, head, error)) {
    fail(error.over_limit ? "limit" : "malformed", error.message);
    return std::nullopt;
  }
  MessageShape shape{head.header_bytes, head.payload_bytes, head.payload_in_fd, nullptr};
  if (handshaking()) return shape;
  header_reservation_ = budget_->reserve(head.header_bytes);
  shape.reservation = budget_->reserve(head.payload_bytes);
  if (header_reservation_ && shape.reservation) return shape;
  fail("limit",
       fmt::format(
           "The session's arrays would take more than {} bytes (or all sessions' more than {}): {} are in use and "
           "a frame of {} came.",
           budget_->limit(), context_.budget->limit(), budget_->used(), head.payload_bytes));
  return std::nullopt;
}

void Client::received(IncomingMessage message) {
  if (phase_ == Phase::ended) return;
  try {
    dispatch(std::move(message));
  } catch (const std::exception& exception) {  // no memory, no thread for a session
    fail("internal", fmt::format("The request failed inside the daemon: {}", exception.what()));
  }
}

void Client::dispatch(IncomingMessage message) {
  if (message.header.size() > k_parse_here_bytes) {
    std::string text = std::move(message.header);
    forward(std::move(text), std::move(message));
    return;
  }
  Result<Json> header = decode_frame_header(message.header);
  if (!header) {
    fail("malformed", header.error());
    return;
  }
  auto decoded = protocol::decode_client_message(std::move(*header));
  if (const auto* error = std::get_if<protocol::MessageError>(&decoded)) {
    if (handshaking())
      fail(error->code, error->text);
    else
      send(message_of(protocol::error(error->code, error->text, false)));
    return;
  }
  handle(std::move(std::get<protocol::ClientMessage>(decoded)), std::move(message));
}

void Client::handle(protocol::ClientMessage message, IncomingMessage raw) {
  if (const auto* hello = std::get_if<protocol::Hello>(&message)) {
    if (handshaking())
      shake_hands(*hello);
    else
      send(message_of(protocol::error("malformed", "The handshake is over: 'hello' comes once.", false)));
  } else if (handshaking()) {
    fail("authentication", "The first message must be 'hello'.");
  } else if (const auto* ping = std::get_if<protocol::Ping>(&message)) {
    send(message_of(protocol::pong(ping->cookie)));
  } else if (const auto* cancel = std::get_if<protocol::RenderCancel>(&message)) {
    runner_->cancel(cancel->epoch);
  } else if (const auto* credit = std::get_if<protocol::TileCredit>(&message)) {
    runner_->add_credit(credit->tiles);
  } else if (const auto* render = std::get_if<protocol::RenderStart>(&message)) {
    if (runner_->queued() < k_queued_limit)
      runner_->start_render(*render);
    else
      fail("limit", "Too many messages are queued.");
  } else if (std::holds_alternative<protocol::Bye>(message)) {
    connection_->close("said goodbye");
  } else {
    forward(std::move(message), std::move(raw));
  }
}

void Client::forward(std::variant<std::string, protocol::ClientMessage> message, IncomingMessage raw) {
  if (runner_->queued() >= k_queued_limit) {
    fail("limit", "Too many messages are queued.");
    return;
  }
  runner_->enqueue({std::move(message), std::move(header_reservation_), std::move(raw.payload_owner), raw.payload});
}

void Client::shake_hands(const protocol::Hello& hello) {
  if (hello.protocol != protocol::k_version) {
    fail("protocol_version",
         fmt::format("The client speaks protocol {}, this daemon ({}) speaks {}: install matching versions.",
                     hello.protocol, LAMBENT_VERSION, protocol::k_version));
    return;
  }
  if (!is_nonce(hello.nonce) || !same_secret(hello.proof, proof(context_.token, "client", nonce_, hello.nonce))) {
    spdlog::warn("{}: authentication failed", name_);
    fail("authentication", "The client did not prove that it knows the daemon's token.");
    return;
  }
  if (context_.session_count() >= context_.sessions_limit) {
    fail("limit", fmt::format("The daemon has {} sessions, which is its limit.", context_.sessions_limit));
    return;
  }
  const uint64_t session = context_.next_session();
  name_ = fmt::format("session {}", session);
  spdlog::info("{} is {}, '{}'", name_, connection_->name(), printable(hello.client));
  phase_ = Phase::ready;
  budget_ = MemoryBudget::create(context_.capabilities.limits.session_bytes, context_.budget);
  // The daemon's lists outlive this client, who may be gone when its worker ends.
  const auto slot = std::make_shared<SessionRunner*>(nullptr);
  runner_ = SessionRunner::start(context_.loop, context_.engine, context_.capabilities.limits, name_, weak_from_this(),
                                 [slot, &context = context_] { context.runner_finished(*slot); });
  *slot = runner_.get();
  context_.runner_started(runner_);
  protocol::Capabilities capabilities = context_.capabilities;
  capabilities.shared_memory = connection_->unix_socket();
  send(message_of(
      protocol::welcome(LAMBENT_VERSION, session, proof(context_.token, "daemon", hello.nonce, nonce_), capabilities)));
}

void Client::send(OutgoingMessage message) {
  if (!connection_->open()) return;
  const bool has_payload = !message.payload.empty();
  connection_->send(std::move(message));
  // Tiles wait for room; everything else is small, so this much of it means that nobody reads.
  if (!has_payload && connection_->pending_bytes() > k_pending_limit)
    connection_->close(fmt::format("{} bytes of answers were left unread", connection_->pending_bytes()));
}

void Client::fail(const std::string& code, const std::string& text) {
  if (phase_ == Phase::ended) return;
  phase_ = Phase::ended;
  spdlog::warn("{}: {}: {}", name_, code, text);
  connection_->send(message_of(protocol::error(code, text, true)));
  connection_->close_when_sent(code);
  if (runner_) runner_->retire();  // the error may take a while to be read; the scene is freed now
}

void Client::violated(const std::string& what) { fail("malformed", what); }

void Client::sent() {
  if (runner_) runner_->service();
}

void Client::closed(const std::string& reason) {
  phase_ = Phase::ended;
  spdlog::info("{} disconnected: {}", name_, reason);
  if (runner_) runner_->retire();
  runner_ = nullptr;
  context_.client_closed(this);
}

}  // namespace lambent
