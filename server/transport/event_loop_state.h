// Internal to transport/: the Asio side of EventLoop.
#pragma once

#include <asio.hpp>

#include "server/transport/event_loop.h"

namespace lambent {

struct EventLoop::State {
  asio::io_context context{1};
  asio::executor_work_guard<asio::io_context::executor_type> work = asio::make_work_guard(context);
  asio::signal_set signals{context};
};

}  // namespace lambent
