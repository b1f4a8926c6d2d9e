#include "server/transport/listener.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <asio/generic/stream_protocol.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "engine/base/log.h"
#include "server/transport/descriptor.h"
#include "server/transport/event_loop_state.h"

namespace lambent {
namespace {

using GenericAcceptor = asio::basic_socket_acceptor<asio::generic::stream_protocol>;

Error failure(const std::string& where, const std::string& cause) {
  return Error{fmt::format("lambentd cannot listen on {}: {}.", where, cause)};
}

}  // namespace

struct Listener::State : std::enable_shared_from_this<Listener::State> {
  State(EventLoop& event_loop, int family, int descriptor)
      : loop(event_loop), acceptor(event_loop.state().context, asio::generic::stream_protocol(family, 0), descriptor) {}

  EventLoop& loop;
  GenericAcceptor acceptor;
  Accept accept;
  ConnectionLimits limits;
  std::string address, path;
  uint64_t accepted = 0;

  void wait() {
    acceptor.async_wait(asio::socket_base::wait_read, [self = shared_from_this()](const std::error_code& error) {
      if (error || !self->acceptor.is_open()) return;
      self->accept_all();
    });
  }

  void accept_all() {
    for (;;) {
      sockaddr_storage peer{};
      socklen_t length = sizeof peer;
      Descriptor socket(::accept4(acceptor.native_handle(), reinterpret_cast<sockaddr*>(&peer), &length,
                                  SOCK_CLOEXEC | SOCK_NONBLOCK));
      if (!socket) {
        if (errno == EINTR || errno == ECONNABORTED) continue;
        if (errno == EAGAIN || errno == EWOULDBLOCK) {
          wait();
        } else {
          // Out of descriptors or memory: others may free some.
          spdlog::warn("A connection on {} could not be accepted: {}", address, std::strerror(errno));
          loop.after(std::chrono::milliseconds(200), [self = shared_from_this()] {
            if (self->acceptor.is_open()) self->wait();
          });
        }
        return;
      }
      take(std::move(socket), peer);
    }
  }

  void take(Descriptor socket, const sockaddr_storage& peer) {
    const bool is_unix = !path.empty();
    std::string name = fmt::format("client {}", ++accepted);
    if (is_unix) {
      ucred credentials{};
      socklen_t length = sizeof credentials;
      if (::getsockopt(socket.number(), SOL_SOCKET, SO_PEERCRED, &credentials, &length) != 0 ||
          credentials.uid != ::geteuid()) {
        spdlog::warn("Turned away a process of user {} (pid {}) on {}", credentials.uid, credentials.pid, address);
        return;
      }
      name += fmt::format(" (pid {})", credentials.pid);
    } else {
      asio::ip::tcp::endpoint endpoint;
      std::memcpy(endpoint.data(), &peer, std::min(sizeof peer, endpoint.capacity()));
      name += fmt::format(" ({})", endpoint.address().to_string());
      const int on = 1;
      ::setsockopt(socket.number(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      ::setsockopt(socket.number(), SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);  // notices machines that vanish
    }
    accept(Connection::adopt(loop, socket.release(), is_unix, std::move(name), limits));
  }
};

Listener::Listener(std::shared_ptr<State> state) : state_(std::move(state)) {}

Listener::~Listener() { close(); }

void Listener::close() {
  if (!state_->acceptor.is_open()) return;
  std::error_code ignored;
  state_->acceptor.close(ignored);
  if (!state_->path.empty()) ::unlink(state_->path.c_str());
}

const std::string& Listener::address() const { return state_->address; }

Status make_private_folder_of(const std::string& path) {
  const std::filesystem::path parent = std::filesystem::absolute(path).parent_path();
  if (!std::filesystem::exists(parent)) {
    std::error_code error;
    std::filesystem::create_directories(parent.parent_path(), error);
    if (::mkdir(parent.c_str(), 0700) != 0 && errno != EEXIST)
      return Error{fmt::format("The folder '{}' cannot be made: {}.", parent.string(), std::strerror(errno))};
  }
  struct stat status {};
  if (::lstat(parent.c_str(), &status) != 0 || (!S_ISDIR(status.st_mode) && !S_ISLNK(status.st_mode)))
    return Error{fmt::format("'{}' is not a folder.", parent.string())};
  // A sticky folder of the system (/tmp) is safe too: nobody else can replace our files there.
  const bool ours = S_ISDIR(status.st_mode) && status.st_uid == ::geteuid() && !(status.st_mode & 022);
  const bool sticky = S_ISDIR(status.st_mode) && (status.st_mode & S_ISVTX) && status.st_uid == 0;
  if (!ours && !sticky)
    return Error{
        fmt::format("The folder '{}' must be this user's and writable by nobody else (chmod 700).", parent.string())};
  return Ok{};
}

Result<std::unique_ptr<Listener>> Listener::at_path(EventLoop& loop, const std::string& path, Accept accept,
                                                    const ConnectionLimits& limits) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path)
    return failure("'" + path + "'",
                   fmt::format("the path is longer than the {} bytes of a socket's", sizeof address.sun_path - 1));
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  if (Status folder = make_private_folder_of(path); !folder) return failure("'" + path + "'", folder.error());

  const auto* generic = reinterpret_cast<const sockaddr*>(&address);
  struct stat status {};
  if (::lstat(path.c_str(), &status) == 0) {
    if (!S_ISSOCK(status.st_mode))
      return failure("'" + path + "'", "there is a file of that name that is not a socket");
    const Descriptor probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (::connect(probe.number(), generic, sizeof address) == 0)
      return failure("'" + path + "'", "another lambentd already does");
    ::unlink(path.c_str());  // of a daemon that is gone
  }
  Descriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const mode_t old_mask = ::umask(0177);  // the socket is never open to others, not even for a moment
  const bool bound = socket && ::bind(socket.number(), generic, sizeof address) == 0;
  const int bind_error = errno;
  ::umask(old_mask);
  if (!bound) return failure("'" + path + "'", std::strerror(bind_error));
  if (::listen(socket.number(), SOMAXCONN) != 0) return failure("'" + path + "'", std::strerror(errno));

  auto state = std::make_shared<State>(loop, AF_UNIX, socket.release());
  state->accept = std::move(accept);
  state->limits = limits;
  state->address = state->path = path;
  state->wait();
  return std::unique_ptr<Listener>(new Listener(std::move(state)));
}

Result<std::unique_ptr<Listener>> Listener::at_address(EventLoop& loop, const std::string& host, uint16_t port,
                                                       bool allow_remote, Accept accept,
                                                       const ConnectionLimits& limits) {
  const std::string where = fmt::format("{}:{}", host, port);
  std::error_code error;
  asio::ip::tcp::resolver resolver(loop.state().context);
  const auto found = resolver.resolve(host, std::to_string(port), asio::ip::tcp::resolver::passive, error);
  if (error || found.empty()) return failure(where, error ? error.message() : "the host has no address");
  const asio::ip::tcp::endpoint endpoint = found.begin()->endpoint();
  if (!endpoint.address().is_loopback() && !allow_remote)
    return failure(
        where,
        "it is reachable from other machines; give --allow-remote if that is meant (the stream is not encrypted)");

  asio::ip::tcp::acceptor acceptor(loop.state().context);
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(SOMAXCONN, error);
  if (!error) acceptor.non_blocking(true, error);
  if (error) return failure(where, error.message());
  const asio::ip::tcp::endpoint local = acceptor.local_endpoint();
  const int family = endpoint.protocol().family();
  auto state = std::make_shared<State>(loop, family, acceptor.release());
  state->accept = std::move(accept);
  state->limits = limits;
  state->address = local.address().is_v6() ? fmt::format("[{}]:{}", local.address().to_string(), local.port())
                                           : fmt::format("{}:{}", local.address().to_string(), local.port());
  state->wait();
  return std::unique_ptr<Listener>(new Listener(std::move(state)));
}

}  // namespace lambent
