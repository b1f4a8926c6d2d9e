// Reading takes exactly what the current message still needs, never more: so a descriptor that arrives with some bytes
// belongs to the message that those bytes are of.
#include "server/transport/connection.h"

#include <sys/socket.h>

#include <array>
#include <asio/generic/stream_protocol.hpp>
#include <cerrno>
#include <cstring>
#include <deque>
#include <new>

#include "server/transport/descriptor.h"
#include "server/transport/event_loop_state.h"

namespace lambent {
namespace {

using Clock = std::chrono::steady_clock;

/// Headers grow as they arrive, so that announcing a large one takes no memory.
constexpr size_t k_header_step_bytes = size_t(1) << 20;
/// Read for one client before others have their turn.
constexpr size_t k_turn_bytes = size_t(4) << 20;
constexpr std::align_val_t k_payload_alignment{64};

std::shared_ptr<std::byte> allocate_payload(uint64_t bytes) {
  void* block = ::operator new(bytes, k_payload_alignment, std::nothrow);
  if (!block) return nullptr;
  return {static_cast<std::byte*>(block), [](std::byte* p) { ::operator delete(p, k_payload_alignment); }};
}

/// Ties memory and its account together.
std::shared_ptr<const void> owner_of(std::shared_ptr<const void> memory, std::shared_ptr<const void> reservation) {
  struct Both {
    std::shared_ptr<const void> reservation, memory;  // the memory goes first
  };
  return std::make_shared<Both>(Both{std::move(reservation), std::move(memory)});
}

}  // namespace

struct Connection::State {
  State(EventLoop& event_loop, asio::generic::stream_protocol::socket connected)
      : loop(event_loop), socket(std::move(connected)), timeout(event_loop.state().context) {}

  enum class Phase { head, header, payload };

  EventLoop& loop;
  asio::generic::stream_protocol::socket socket;
  asio::steady_timer timeout;
  bool is_unix = false, open = true, reading = true, closing = false, timeout_armed = false, writing = false;
  std::string name, close_reason;
  ConnectionLimits limits;
  std::shared_ptr<ConnectionHandler> handler;

  Phase phase = Phase::head;
  std::array<std::byte, k_message_head_bytes> head;
  uint64_t got = 0;  ///< bytes of the current phase
  Clock::time_point last_byte;
  Descriptor descriptor;
  MessageShape shape;
  std::string header;
  std::shared_ptr<std::byte> payload;

  std::deque<OutgoingMessage> queue;
  uint64_t pending = 0;
  uint64_t front_sent = 0;  ///< bytes of queue.front() already taken by the system
};

Connection::Connection() = default;
Connection::~Connection() = default;

std::shared_ptr<Connection> Connection::adopt(EventLoop& loop, int socket, bool unix_socket, std::string name,
                                              const ConnectionLimits& limits) {
  sockaddr_storage address{};
  socklen_t length = sizeof address;
  const int family =
      ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &length) == 0 ? address.ss_family : AF_UNIX;
  asio::generic::stream_protocol::socket connected(loop.state().context);
  std::error_code error;
  connected.assign(asio::generic::stream_protocol(family, 0), socket, error);
  auto connection = std::shared_ptr<Connection>(new Connection);
  connection->state_ = std::make_unique<State>(loop, std::move(connected));
  State& state = *connection->state_;
  state.socket.non_blocking(true, error);
  state.is_unix = unix_socket;
  state.name = std::move(name);
  state.limits = limits;
  return connection;
}

bool Connection::open() const { return state_->open; }
bool Connection::unix_socket() const { return state_->is_unix; }
const std::string& Connection::name() const { return state_->name; }
uint64_t Connection::pending_bytes() const { return state_->pending; }

void Connection::start(std::shared_ptr<ConnectionHandler> handler) {
  state_->handler = std::move(handler);
  wait_readable();
}

void Connection::close(std::string reason) {
  if (!state_->open) return;
  state_->open = state_->reading = false;
  std::error_code ignored;
  state_->timeout.cancel();
  state_->socket.close(ignored);
  state_->queue.clear();
  state_->pending = 0;
  state_->payload.reset();
  state_->header = {};
  state_->descriptor.reset();
  state_->shape = {};
  // Later, so that no handler is called back from inside its own call.
  state_->loop.post([self = shared_from_this(), reason = std::move(reason)] {
    if (const auto last = std::exchange(self->state_->handler, nullptr)) last->closed(reason);
  });
}

void Connection::close_when_sent(std::string reason) {
  if (!state_->open || state_->closing) return;
  state_->closing = true;
  state_->close_reason = reason;
  // What still arrives is read and dropped: closing over unread bytes would reset the connection, and the client could
  // lose the error that it is about to read.
  state_->reading = false;
  state_->payload.reset();
  state_->header = {};
  state_->descriptor.reset();
  state_->loop.after(state_->limits.last_words,
                     [self = shared_from_this(), reason = std::move(reason)] { self->close(reason); });
  write_queued();
}

void Connection::violate(const std::string& what) {
  state_->reading = false;
  state_->handler->violated(what);
}

void Connection::wait_readable() {
  state_->socket.async_wait(asio::socket_base::wait_read, [self = shared_from_this()](const std::error_code& error) {
    if (error || !self->state_->open) return;
    self->on_readable();
  });
}

void Connection::on_readable() {
  size_t turn = 0;
  const auto self = shared_from_this();
  while (state_->open && turn < k_turn_bytes) {
    const uint64_t before = state_->got;
    if (!read_some()) break;
    turn += state_->got > before ? state_->got - before : k_message_head_bytes;
  }
  if (state_->open) wait_readable();
}

/// Reads once into the current phase; false when nothing more can be read now.
bool Connection::read_some() {
  State& state = *state_;
  std::byte dropped[4096];
  void* to = dropped;
  size_t count = sizeof dropped;
  if (state.reading) {
    switch (state.phase) {
      case State::Phase::head:
        to = state.head.data() + state.got;
        count = k_message_head_bytes - state.got;
        break;
      case State::Phase::header:
        if (state.header.size() == state.got)
          state.header.resize(std::min<uint64_t>(state.shape.header_bytes, state.got + k_header_step_bytes));
        to = state.header.data() + state.got;
        count = state.header.size() - state.got;
        break;
      case State::Phase::payload:
        to = state.payload.get() + state.got;
        count = std::min<uint64_t>(state.shape.payload_bytes - state.got, k_turn_bytes);
        break;
    }
  }
  Received received = receive_with_descriptor(state.socket.native_handle(), to, count);
  if (received.bytes < 0) {
    if (errno != EAGAIN && errno != EWOULDBLOCK) close(std::strerror(errno));
    return false;
  }
  if (received.bytes == 0) {
    close(state.closing ? state.close_reason : "the client closed the connection");
    return false;
  }
  if (!state.reading) return true;
  if (received.descriptor || received.too_many) {
    if (received.too_many || state.phase != State::Phase::head || state.got != 0) {
      violate("A file descriptor may come only alone and with the first byte of a frame.");
      return true;
    }
    state.descriptor = std::move(received.descriptor);
  }
  state.got += static_cast<uint64_t>(received.bytes);
  state.last_byte = Clock::now();
  arm_timeout();
  advance();
  return true;
}

/// Goes on to the next phase when the current one is complete.
void Connection::advance() {
  State& state = *state_;
  if (state.phase == State::Phase::head && state.got == k_message_head_bytes) {
    std::optional<MessageShape> shape = state.handler->admit(state.head);
    if (!shape) {
      state.reading = false;
      return;
    }
    state.shape = std::move(*shape);
    if (state.shape.payload_in_descriptor != static_cast<bool>(state.descriptor)) {
      violate(state.descriptor ? "A file descriptor came with a frame that does not say so."
                               : "The frame's payload should be in a file descriptor, but none came.");
      return;
    }
    state.phase = State::Phase::header;
    state.got = 0;
    state.header.clear();
  }
  if (state.phase == State::Phase::header && state.got == state.shape.header_bytes) finish_header();
  if (state.reading && state.phase == State::Phase::payload && state.got == state.shape.payload_bytes) finish_payload();
}

void Connection::finish_header() {
  State& state = *state_;
  if (state.shape.payload_in_descriptor || state.shape.payload_bytes == 0) {
    finish_payload();
    return;
  }
  state.payload = allocate_payload(state.shape.payload_bytes);
  if (!state.payload) {
    violate("There is no memory for the frame's payload.");
    return;
  }
  state.phase = State::Phase::payload;
  state.got = 0;
}

void Connection::finish_payload() {
  State& state = *state_;
  IncomingMessage message{std::move(state.header), nullptr, {}};
  if (state.shape.payload_in_descriptor) {
    auto mapped = map_sealed_memory(state.descriptor, state.shape.payload_bytes);
    state.descriptor.reset();
    if (!mapped) {
      violate(mapped.error());
      return;
    }
    message.payload = {mapped->get(), *mapped ? state.shape.payload_bytes : 0};
    message.payload_owner = owner_of(std::move(*mapped), std::move(state.shape.reservation));
  } else if (state.payload) {
    message.payload = {state.payload.get(), state.shape.payload_bytes};
    message.payload_owner = owner_of(std::move(state.payload), std::move(state.shape.reservation));
  }
  state.phase = State::Phase::head;
  state.got = 0;
  state.header = {};
  state.payload.reset();
  state.shape = {};
  state.handler->received(std::move(message));
}

/// Watches, while a message is incomplete, that bytes keep coming.
void Connection::arm_timeout() {
  State& state = *state_;
  if (state.timeout_armed) return;
  state.timeout_armed = true;
  state.timeout.expires_at(state.last_byte + state.limits.inside_message);
  state.timeout.async_wait([weak = weak_from_this()](const std::error_code& error) {
    const auto self = weak.lock();
    if (error || !self || !self->state_->open) return;
    State& late = *self->state_;
    late.timeout_armed = false;
    if (late.phase == State::Phase::head && late.got == 0) return;
    if (Clock::now() - late.last_byte >= late.limits.inside_message)
      self->close("the client fell silent inside a frame");
    else
      self->arm_timeout();
  });
}

void Connection::send(OutgoingMessage message) {
  if (!state_->open || state_->closing) return;
  state_->pending += message.start.size() + message.payload.size();
  state_->queue.push_back(std::move(message));
  write_queued();
}

void Connection::wait_writable() {
  state_->writing = true;
  state_->socket.async_wait(asio::socket_base::wait_write, [self = shared_from_this()](const std::error_code& error) {
    self->state_->writing = false;
    if (error || !self->state_->open) return;
    const uint64_t before = self->state_->pending;
    self->write_queued();
    if (self->state_->open && !self->state_->closing && self->state_->pending < before && self->state_->handler)
      self->state_->handler->sent();
  });
}

/// Gives the system as much of the queue as it takes without blocking.
void Connection::write_queued() {
  State& state = *state_;
  if (!state.open || state.writing) return;
  size_t turn = 0;
  while (!state.queue.empty()) {
    if (turn >= k_turn_bytes) {
      wait_writable();
      return;
    }
    OutgoingMessage& front = state.queue.front();
    const uint64_t start_left = front.start.size() > state.front_sent ? front.start.size() - state.front_sent : 0;
    const uint64_t payload_sent = state.front_sent - (front.start.size() - start_left);
    iovec parts[2] = {
        {front.start.data() + (front.start.size() - start_left), start_left},
        {const_cast<std::byte*>(front.payload.data()) + payload_sent, front.payload.size() - payload_sent}};
    msghdr message{};
    message.msg_iov = parts;
    message.msg_iovlen = 2;
    const ssize_t sent = ::sendmsg(state.socket.native_handle(), &message, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0) {
      if (errno == EINTR) continue;
      if (errno == EAGAIN || errno == EWOULDBLOCK)
        wait_writable();
      else
        close(std::strerror(errno));
      return;
    }
    turn += static_cast<size_t>(sent);
    state.front_sent += static_cast<uint64_t>(sent);
    state.pending -= static_cast<uint64_t>(sent);
    if (state.front_sent == front.start.size() + front.payload.size()) {
      state.queue.pop_front();
      state.front_sent = 0;
    }
  }
  if (state.closing) ::shutdown(state.socket.native_handle(), SHUT_WR);
}

}  // namespace lambent
