#include "tests/protocol/local_daemon.h"

#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <future>

#include "engine/base/check.h"
#include "server/transport/authentication.h"

namespace lambent {

LocalDaemon::LocalDaemon(uint64_t session_bytes) {
  std::string name = (std::filesystem::temp_directory_path() / "lambent_test_XXXXXX").string();
  CHECK(::mkdtemp(name.data()), name);
  folder_ = name;
  DaemonOptions options;
  options.token_path = folder_ + "/token";
  options.session_bytes = session_bytes;
  auto daemon = Daemon::create(options);
  CHECK(daemon, daemon.error());
  daemon_ = std::move(*daemon);
  token_ = *read_token(options.token_path, false);
  thread_ = std::thread([this] { daemon_->run(); });
}

LocalDaemon::~LocalDaemon() {
  daemon_->loop().post([this] { daemon_->stop("the test is over"); });
  thread_.join();
  std::filesystem::remove_all(folder_);
}

std::unique_ptr<WireClient> LocalDaemon::connect() {
  int pair[2];
  CHECK(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) == 0);
  daemon_->loop().post(
      [this, socket = pair[0]] { daemon_->adopt(Connection::adopt(daemon_->loop(), socket, true, "test")); });
  return std::make_unique<WireClient>(pair[1]);
}

std::unique_ptr<WireClient> LocalDaemon::open_session() {
  auto client = connect();
  const auto answer = client->shake_hands(token_);
  if (!answer || answer->type() != "welcome") return nullptr;
  return client;
}

bool LocalDaemon::wait_until_free() {
  for (int i = 0; i < 1000; ++i) {
    std::promise<size_t> busy;
    daemon_->loop().post([&] { busy.set_value(daemon_->busy_count()); });
    if (busy.get_future().get() == 0) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

}  // namespace lambent
