#include "server/transport/connection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <string>
#include <thread>
#include <vector>

namespace lambent {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// Messages of these tests: a head of 24 bytes with the header's and the payload's length as decimal text.
std::string message(const std::string& header, const std::string& payload) {
  std::string head = std::to_string(header.size()) + " " + std::to_string(payload.size());
  head.resize(k_message_head_bytes, ' ');
  return head + header + payload;
}

struct Recorder : ConnectionHandler {
  explicit Recorder(EventLoop& event_loop) : loop(event_loop) {}
  std::optional<MessageShape> admit(std::span<const std::byte, k_message_head_bytes> head) override {
    const std::string text(reinterpret_cast<const char*>(head.data()), head.size());
    MessageShape shape;
    std::sscanf(text.c_str(), "%lu %lu", &shape.header_bytes, &shape.payload_bytes);
    if (shape.payload_bytes > 1'000'000) {
      connection->close("refused");
      return std::nullopt;
    }
    return shape;
  }
  void received(IncomingMessage got) override {
    headers.push_back(got.header);
    payloads.emplace_back(reinterpret_cast<const char*>(got.payload.data()), got.payload.size());
    if (headers.size() == stop_after) loop.stop();
  }
  void violated(const std::string& what) override { violation = what; }
  void sent() override { ++sent_count; }
  void closed(const std::string& why) override {
    reason = why;
    loop.stop();
  }

  EventLoop& loop;
  std::shared_ptr<Connection> connection;
  std::vector<std::string> headers, payloads;
  size_t stop_after = 0;
  int sent_count = 0;
  std::string violation, reason;
};

class ConnectionTest : public testing::Test {
 protected:
  ~ConnectionTest() override {
    if (peer_ >= 0) ::close(peer_);
    if (handler_) handler_->connection = nullptr;
  }
  void open(const ConnectionLimits& limits = {}) {
    int pair[2];
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, pair), 0);
    peer_ = pair[1];
    handler_ = std::make_shared<Recorder>(loop_);
    handler_->connection = Connection::adopt(loop_, pair[0], true, "test", limits);
    handler_->connection->start(handler_);
  }
  void write(const std::string& bytes) { ASSERT_EQ(::write(peer_, bytes.data(), bytes.size()), ssize_t(bytes.size())); }

  EventLoop loop_;
  std::shared_ptr<Recorder> handler_;
  int peer_ = -1;
};

TEST_F(ConnectionTest, messages_are_cut_however_the_bytes_arrive) {
  open();
  std::string stream;
  for (int i = 0; i < 40; ++i) stream += message("header " + std::to_string(i), std::string(i * 7, char('a' + i % 26)));
  handler_->stop_after = 40;
  std::thread writer([&] {
    for (size_t at = 0, step = 1; at < stream.size(); at += step, step = step % 97 + 1) write(stream.substr(at, step));
  });
  loop_.run();
  writer.join();
  ASSERT_EQ(handler_->headers.size(), 40u);
  for (int i = 0; i < 40; ++i) {
    EXPECT_EQ(handler_->headers[i], "header " + std::to_string(i));
    EXPECT_EQ(handler_->payloads[i], std::string(i * 7, char('a' + i % 26)));
  }
}

TEST_F(ConnectionTest, silence_inside_a_message_ends_the_connection_but_between_messages_does_not) {
  ConnectionLimits limits;
  limits.inside_message = 150ms;
  open(limits);
  write(message("whole", ""));
  handler_->stop_after = 1;
  loop_.run();
  bool alive = false;
  loop_.after(400ms, [&] {
    alive = handler_->connection->open();
    write("half");
  });
  const auto before = std::chrono::steady_clock::now();
  loop_.run();
  EXPECT_TRUE(alive);
  EXPECT_THAT(handler_->reason, HasSubstr("silent"));
  EXPECT_LT(std::chrono::steady_clock::now() - before, 3s);
}

TEST_F(ConnectionTest, a_refused_message_is_not_read) {
  open();
  write(
      message("header", std::string(10, 'x')).replace(0, 24, message("", "").replace(0, 9, "6 2000000").substr(0, 24)));
  loop_.run();
  EXPECT_EQ(handler_->reason, "refused");
  EXPECT_TRUE(handler_->headers.empty());
}

TEST_F(ConnectionTest, sending_never_blocks_and_what_is_pending_is_known) {
  open();
  const auto payload = std::make_shared<std::vector<std::byte>>(10 << 20);
  handler_->connection->send({"start", payload, *payload});
  EXPECT_GT(handler_->connection->pending_bytes(), uint64_t(5) << 20);
  std::thread reader([&] {
    std::vector<char> bytes(1 << 20);
    size_t total = 0;
    while (total < payload->size() + 5) {
      const ssize_t got = ::read(peer_, bytes.data(), bytes.size());
      if (got <= 0) break;
      total += static_cast<size_t>(got);
    }
    EXPECT_EQ(total, payload->size() + 5);
    loop_.post([&] { loop_.stop(); });
  });
  loop_.run();
  reader.join();
  EXPECT_EQ(handler_->connection->pending_bytes(), 0u);
  EXPECT_GT(handler_->sent_count, 0);
}

TEST_F(ConnectionTest, last_words_arrive_even_over_unread_input) {
  open();
  write(std::string(3000, 'x'));
  handler_->connection->send({"goodbye", nullptr, {}});
  handler_->connection->close_when_sent("over");
  std::string heard;
  std::thread reader([&] {
    char bytes[100];
    for (ssize_t got; (got = ::read(peer_, bytes, sizeof bytes)) > 0;) heard.append(bytes, static_cast<size_t>(got));
    ::shutdown(peer_, SHUT_WR);
  });
  loop_.run();
  reader.join();
  EXPECT_EQ(heard, "goodbye");
  EXPECT_EQ(handler_->reason, "over");
}

TEST_F(ConnectionTest, last_words_to_one_who_does_not_read_are_given_up) {
  ConnectionLimits limits;
  limits.last_words = 100ms;
  open(limits);
  const auto payload = std::make_shared<std::vector<std::byte>>(10 << 20);
  handler_->connection->send({"start", payload, *payload});
  handler_->connection->close_when_sent("over");
  loop_.run();
  EXPECT_EQ(handler_->reason, "over");
}

TEST(EventLoop, tells_when_another_process_ends) {
  EventLoop loop;
  const pid_t child = ::fork();
  if (child == 0) {
    ::usleep(200'000);
    ::_exit(0);
  }
  bool told = false;
  loop.on_exit_of(child, [&] {
    told = true;
    loop.stop();
  });
  loop.after(5s, [&] { loop.stop(); });
  loop.run();
  EXPECT_TRUE(told);
}

}  // namespace
}  // namespace lambent
