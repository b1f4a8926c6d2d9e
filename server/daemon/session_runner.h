// One client's session: a worker thread that decodes and edits, and the I/O thread's side that cancels and streams.
//
// Session's methods are called by one thread at a time, so both sides pass the gate, a mutex that the worker holds only
// around calls that are short by contract (apply, start, a copy of the scene). The I/O thread never waits for it: what
// it wanted is done when the worker leaves. So a cancel or a ping does not wait for a large transaction to be decoded.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <variant>

#include "engine/session/session.h"
#include "server/daemon/array_store.h"
#include "server/protocol/messages.h"
#include "server/transport/connection.h"

namespace lambent {

/// Where a runner's messages go. On the I/O thread.
class RunnerOutput {
 public:
  virtual ~RunnerOutput() = default;
  virtual void send(OutgoingMessage message) = 0;
  /// Bytes that the client has not taken yet.
  virtual uint64_t pending_bytes() const = 0;
  /// Sends a fatal error and closes the connection.
  virtual void fail(const std::string& code, const std::string& text) = 0;
};

class SessionRunner : public std::enable_shared_from_this<SessionRunner> {
 public:
  /// What the worker does in order: a header that is too long to parse on the I/O thread, or a decoded message.
  struct Work {
    std::variant<std::string, protocol::ClientMessage> message;
    std::shared_ptr<const void> header_reservation;
    std::shared_ptr<const void> payload_owner;
    std::span<const std::byte> payload;
  };

  /// Starts the worker. `name` is for the log. `finished` runs on the I/O thread when the worker is through after
  /// retire(); then join() does not block.
  static std::shared_ptr<SessionRunner> start(EventLoop& loop, std::shared_ptr<Engine> engine, protocol::Limits limits,
                                              std::string name, std::weak_ptr<RunnerOutput> output,
                                              std::function<void()> finished);
  ~SessionRunner();

  // On the I/O thread; none of them blocks.

  void enqueue(Work work);
  /// Queued work, to be limited by the caller.
  size_t queued() const;
  void start_render(const protocol::RenderStart& start);
  void cancel(int64_t epoch);
  void add_credit(int64_t tiles);
  /// Sends what may be sent: to be called when tiles, credit or room in the connection's queue became available.
  void service();
  /// The client is gone: cancels, drops queued work and frees everything.
  void retire();
  void join();

 private:
  using Clock = std::chrono::steady_clock;

  SessionRunner(EventLoop& loop, std::shared_ptr<Engine> engine, protocol::Limits limits, std::string name,
                std::weak_ptr<RunnerOutput> output, std::function<void()> finished);

  // Worker's side.
  void run();
  std::unique_ptr<Session> make_session();
  void handle(Work& work);
  void handle_text(Work& work, std::string text);
  void handle_message(Work& work, protocol::ClientMessage& message);
  void handle(Work& work, const protocol::Arrays& arrays);
  void handle(const protocol::Transaction& transaction);
  void handle(const protocol::ArraysQuery& query);
  void handle(const protocol::RenderStart& start);
  void handle(const protocol::SaveScene& save);
  void to_client(OutgoingMessage message);
  void to_client(const Json& header);
  void to_service();

  // I/O thread's side.
  void answer_cancelled(int64_t epoch);
  void add_outcome(RenderOutcome outcome);
  void send_stopped();
  bool send_tiles();
  void send_outcomes(bool drained);
  void schedule_progress();
  void send_progress();

  EventLoop& loop_;
  const std::shared_ptr<Engine> engine_;
  const protocol::Limits limits_;
  const std::string name_;
  const std::weak_ptr<RunnerOutput> output_;
  const std::function<void()> finished_;

  // The queue.
  mutable std::mutex queue_mutex_;
  std::condition_variable queue_changed_;
  std::deque<Work> queue_;
  std::atomic<bool> retired_{false};

  // Behind the gate.
  std::mutex gate_;
  std::unique_ptr<Session> session_;

  // Which renders were started and cancelled; taken inside the gate or alone, never the other way round.
  std::mutex epochs_mutex_;
  int64_t started_epoch_ = -1, cancelled_through_ = -1, finished_epoch_ = -1;
  std::vector<std::string> stream_;  ///< of the started render: RenderStart::stream
  bool cancel_wanted_ = false;
  int64_t stopped_epoch_ = -1;  ///< the newest of which nothing is rendered any more

  // Worker's own.
  ArrayStore arrays_;
  int64_t transaction_epoch_ = -1;

  // I/O thread's own.
  std::set<int64_t> queued_starts_;
  int64_t newest_start_ = -1;
  int64_t told_stopped_ = -1;
  int64_t credits_ = 0;
  Clock::time_point credit_waited_since_;  ///< the last credit or the last end of a render
  std::vector<RenderOutcome> outcomes_;    ///< of renders that ended and whose tiles are not all sent
  std::deque<TileSnapshot> held_tiles_;    ///< taken from the session to see whether there are any, not yet sent
  bool progress_scheduled_ = false;

  std::thread worker_;
};

}  // namespace lambent
