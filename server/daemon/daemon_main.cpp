// `lambentd`: the render daemon.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <exception>

#include "engine/base/log.h"
#include "engine/base/memory.h"
#include "server/daemon/daemon.h"

namespace {

/// "host:port" or "[v6]:port"; false if it is neither.
bool split_address(const std::string& text, std::string& host, uint16_t& port) {
  const size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == text.size()) return false;
  host = text.substr(0, colon);
  if (host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  unsigned long number = 0;
  for (const char c : text.substr(colon + 1)) {
    if (c < '0' || c > '9' || number > 65535) return false;
    number = number * 10 + static_cast<unsigned long>(c - '0');
  }
  if (number > 65535) return false;
  port = static_cast<uint16_t>(number);
  return !host.empty();
}

int run(int argc, char** argv) {
  lambent::DaemonOptions options;
  options.socket_path = lambent::default_path("socket");
  options.token_path = lambent::default_path("token");
  std::string listen, log_file, log_level = "info";
  size_t texture_cache_mb = 0, session_memory_mb = 0;

  CLI::App app("lambentd: renders for clients such as Blender (see PROTOCOL.md).");
  app.set_version_flag("--version", std::string("lambentd ") + LAMBENT_VERSION);
  app.add_option("--socket", options.socket_path, "Unix socket to listen on")->capture_default_str();
  app.add_option("--token-file", options.token_path, "File with the secret that clients must know; made if absent")
      ->capture_default_str();
  app.add_option("--listen", listen, "Also listen on TCP at HOST:PORT (the loopback, unless --allow-remote)");
  app.add_flag("--allow-remote", options.allow_remote,
               "Permit --listen on other addresses; the token file must exist already. The stream is not encrypted");
  app.add_option("--log-file", log_file, "Also append the log to this file");
  app.add_option("--log-level", log_level, "trace, debug, info, warn or error")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error"}))
      ->capture_default_str();
  app.add_option("--owner-pid", options.owner_pid, "End when this process ends")->check(CLI::PositiveNumber);
  app.add_option("--threads", options.threads, "Render threads; 0: all cores")->check(CLI::Range(0, 4096));
  app.add_option("--texture-cache", texture_cache_mb,
                 "Most memory that one client's textures may take, in MB; 0: a quarter of the machine's")
      ->check(CLI::Range(0, 1 << 24));
  app.add_option("--session-memory", session_memory_mb,
                 "Most memory that one client's scene may take, in MB; 0: half of the machine's")
      ->check(CLI::Range(0, 1 << 24));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  lambent::set_up_log(log_level, log_file);
  if (const std::string missing = lambent::missing_instructions(); !missing.empty()) {
    spdlog::error("{}", missing);
    return 1;
  }
  if (!listen.empty() && !split_address(listen, options.listen_host, options.listen_port)) {
    spdlog::error("--listen '{}' is not HOST:PORT.", listen);
    return 2;
  }
  options.texture_cache_bytes = texture_cache_mb << 20;
  options.session_bytes = static_cast<uint64_t>(session_memory_mb) << 20;
  std::signal(SIGPIPE, SIG_IGN);

  auto daemon = lambent::Daemon::create(options);
  if (!daemon) {
    spdlog::error("{}", daemon.error());
    return 1;
  }
  spdlog::info("lambentd {} listens on {}", LAMBENT_VERSION, (*daemon)->addresses());
  std::printf("lambentd listening on %s\n", (*daemon)->addresses().c_str());
  std::fflush(stdout);
  return (*daemon)->run();
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "lambentd: %s\n", exception.what());
    return 1;
  }
}
