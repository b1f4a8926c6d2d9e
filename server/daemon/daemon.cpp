#include "server/daemon/daemon.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>

#include "engine/base/log.h"
#include "engine/base/memory.h"
#include "server/transport/authentication.h"

namespace lambent {
namespace {

/// Connections in their handshake; a further one ends the oldest, so that silent ones cannot lock others out.
constexpr size_t k_handshakes = 32;
constexpr std::chrono::seconds k_end_time{5};

}  // namespace

std::string default_path(const std::string& name) {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime && *runtime) return fmt::format("{}/lambent/{}", runtime, name);
  return fmt::format("/tmp/lambent-{}/{}", ::geteuid(), name);
}

Daemon::Daemon(const DaemonOptions& options)
    : context_{loop_, nullptr, {}, {}, nullptr, std::chrono::seconds(10), 64, {}, {}, {}, {}, {}} {
  const uint64_t memory = physical_bytes();
  protocol::Limits& limits = context_.capabilities.limits;
  limits.session_bytes = options.session_bytes ? options.session_bytes : memory / 2;
  limits.payload_bytes = std::min(limits.session_bytes, uint64_t(8) << 30);
  context_.budget = MemoryBudget::create(std::max(memory / 4 * 3, limits.session_bytes));
  context_.capabilities.integrators = available_integrators();
  context_.capabilities.node_types = supported_node_types();
  context_.capabilities.passes = available_passes();
  context_.engine = Engine::create({options.threads, options.texture_cache_bytes});

  context_.next_session = [this] { return ++sessions_; };
  context_.session_count = [this] { return runners_.size(); };
  context_.runner_started = [this](std::shared_ptr<SessionRunner> runner) { runners_.push_back(std::move(runner)); };
  context_.runner_finished = [this](SessionRunner* runner) {
    runner->join();
    runners_.remove_if([&](const auto& one) { return one.get() == runner; });
    spdlog::info("A session was freed; {} remain, holding {} bytes", runners_.size(), context_.budget->used());
    stop_if_done();
  };
  context_.client_closed = [this](Client* client) {
    clients_.remove_if([&](const auto& one) { return one.get() == client; });
    stop_if_done();
  };
}

Daemon::~Daemon() = default;

Result<std::unique_ptr<Daemon>> Daemon::create(const DaemonOptions& options) {
  std::unique_ptr<Daemon> daemon(new Daemon(options));
  if (Status opened = daemon->open(options); !opened) return Error{opened.error()};
  return daemon;
}

Status Daemon::open(const DaemonOptions& options) {
  // A token made in this moment is known to nobody on another machine: whoever opens the daemon to them has to have
  // chosen one.
  Result<std::string> token = read_token(options.token_path, /*may_create=*/!options.allow_remote);
  if (!token) return Error{token.error()};
  context_.token = *token;

  const auto accept_client = [this](std::shared_ptr<Connection> connection) { accept(std::move(connection)); };
  if (!options.socket_path.empty()) {
    auto listener = Listener::at_path(loop_, options.socket_path, accept_client);
    if (!listener) return Error{listener.error()};
    listeners_.push_back(std::move(*listener));
  }
  if (!options.listen_host.empty()) {
    auto listener =
        Listener::at_address(loop_, options.listen_host, options.listen_port, options.allow_remote, accept_client);
    if (!listener) return Error{listener.error()};
    listeners_.push_back(std::move(*listener));
  }
  loop_.on_signals({SIGTERM, SIGINT, SIGHUP}, [this](int signal) {
    if (stopping_) loop_.stop();  // the second time
    stop(fmt::format("signal {}", signal));
  });
  if (options.owner_pid > 0)
    loop_.on_exit_of(options.owner_pid,
                     [this, pid = options.owner_pid] { stop(fmt::format("the owner, process {}, is gone", pid)); });
  return Ok{};
}

std::string Daemon::addresses() const {
  std::string text;
  for (const auto& listener : listeners_) text += (text.empty() ? "" : " and ") + listener->address();
  return text;
}

void Daemon::accept(std::shared_ptr<Connection> connection) {
  if (stopping_) {
    connection->close("the daemon is ending");
    return;
  }
  if (static_cast<size_t>(std::count_if(clients_.begin(), clients_.end(),
                                        [](const auto& client) { return client->handshaking(); })) >= k_handshakes) {
    const auto oldest =
        std::find_if(clients_.begin(), clients_.end(), [](const auto& client) { return client->handshaking(); });
    const std::shared_ptr<Client> ended = *oldest;
    ended->fail("limit", "Too many connections are in their handshake.");
  }
  auto client = std::make_shared<Client>(context_, std::move(connection));
  clients_.push_back(client);
  client->start();
}

void Daemon::adopt(std::shared_ptr<Connection> connection) { accept(std::move(connection)); }

void Daemon::stop(const std::string& reason) {
  if (stopping_) return;
  stopping_ = true;
  spdlog::info("lambentd ends: {}", reason);
  for (const auto& listener : listeners_) listener->close();
  const std::vector<std::shared_ptr<Client>> clients(clients_.begin(), clients_.end());
  for (const auto& client : clients) client->close("the daemon is ending");
  loop_.after(k_end_time, [this] {
    spdlog::warn("{} sessions did not end in time", runners_.size());
    loop_.stop();
  });
  stop_if_done();
}

void Daemon::stop_if_done() {
  if (stopping_ && clients_.empty() && runners_.empty()) loop_.stop();
}

int Daemon::run() {
  for (;;) {
    try {
      loop_.run();
      break;
    } catch (const std::exception& exception) {
      // One request's misfortune; the others go on.
      spdlog::error("A request failed: {}", exception.what());
    }
  }
  if (runners_.empty()) return 0;
  // Sessions that do not end hold threads that cannot be joined.
  spdlog::shutdown();
  std::_Exit(1);
}

}  // namespace lambent
