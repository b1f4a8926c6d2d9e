// The worker's side of SessionRunner: everything that may take long.
#include <fmt/format.h>
#include <malloc.h>

#include <exception>
#include <new>
#include <unordered_set>

#include "engine/base/log.h"
#include "engine/description/frame.h"
#include "engine/description/json_codec.h"
#include "engine/description/scene_file.h"
#include "server/daemon/session_messages.h"
#include "server/daemon/session_runner.h"

namespace lambent {

void SessionRunner::to_client(OutgoingMessage message) {
  loop_.post([weak = weak_from_this(), message = std::make_shared<OutgoingMessage>(std::move(message))] {
    const auto self = weak.lock();
    if (!self || self->retired_) return;
    if (const auto output = self->output_.lock()) output->send(std::move(*message));
  });
}

void SessionRunner::to_client(const Json& header) { to_client(message_of(header)); }

void SessionRunner::to_service() {
  loop_.post([weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->service();
  });
}

std::unique_ptr<Session> SessionRunner::make_session() {
  SessionEvents events;
  events.report = [weak = weak_from_this()](int64_t epoch, const Report& report) {
    if (const auto self = weak.lock()) self->to_client(protocol::render_report(epoch, report));
  };
  events.tiles_ready = [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->to_service();
  };
  events.stopped = [weak = weak_from_this()](int64_t epoch) {
    const auto self = weak.lock();
    if (!self) return;
    {
      const std::lock_guard lock(self->epochs_mutex_);
      self->stopped_epoch_ = epoch;
    }
    self->to_service();
  };
  events.done = [weak = weak_from_this()](const RenderOutcome& outcome) {
    const auto self = weak.lock();
    if (!self) return;
    // Posted, like everything that goes to the client, so that it comes after what was said before.
    self->loop_.post([weak, outcome] {
      if (const auto runner = weak.lock()) runner->add_outcome(outcome);
    });
  };
  return std::make_unique<Session>(engine_, std::move(events));
}

void SessionRunner::run() {
  try {
    auto session = make_session();
    const std::lock_guard gate(gate_);
    session_ = std::move(session);
  } catch (const std::exception& exception) {
    spdlog::error("{}: the session could not be made: {}", name_, exception.what());
    to_client(protocol::error("internal", fmt::format("The session could not be made: {}", exception.what()), true));
  }
  for (;;) {
    Work work;
    {
      std::unique_lock lock(queue_mutex_);
      queue_changed_.wait(lock, [&] { return retired_ || !queue_.empty(); });
      if (retired_) break;
      work = std::move(queue_.front());
      queue_.pop_front();
    }
    try {
      if (session_) handle(work);
    } catch (const std::bad_alloc&) {
      spdlog::error("{}: out of memory", name_);
      to_client(protocol::error("memory", "The daemon has not enough memory for this request.", false));
    } catch (const std::exception& exception) {
      spdlog::error("{}: a request failed: {}", name_, exception.what());
      to_client(protocol::error("internal", fmt::format("The request failed inside the daemon: {}", exception.what()),
                                false));
    }
    to_service();  // what the I/O thread wanted while this held the gate
  }
  std::unique_ptr<Session> ended;
  {
    const std::lock_guard gate(gate_);
    ended = std::move(session_);
  }
  ended.reset();
  arrays_.clear();
  ::malloc_trim(0);  // freed scenes go back to the system, not into the allocator's reserve
  loop_.post(finished_);
}

void SessionRunner::handle(Work& work) {
  if (auto* text = std::get_if<std::string>(&work.message))
    handle_text(work, std::move(*text));
  else
    handle_message(work, std::get<protocol::ClientMessage>(work.message));
}

void SessionRunner::handle_text(Work& work, std::string text) {
  JsonLimits limits;
  limits.abandoned = &retired_;
  Result<Json> header = decode_frame_header(text, limits);
  if (!header) {
    loop_.post([weak = output_, message = header.error()] {
      if (const auto output = weak.lock()) output->fail("malformed", message);
    });
    return;
  }
  text = {};
  auto decoded = protocol::decode_client_message(std::move(*header));
  if (const auto* error = std::get_if<protocol::MessageError>(&decoded))
    to_client(protocol::error(error->code, error->text, false));
  else
    handle_message(work, std::get<protocol::ClientMessage>(decoded));
}

void SessionRunner::handle_message(Work& work, protocol::ClientMessage& message) {
  if (const auto* arrays = std::get_if<protocol::Arrays>(&message))
    handle(work, *arrays);
  else if (const auto* transaction = std::get_if<protocol::Transaction>(&message))
    handle(*transaction);
  else if (const auto* query = std::get_if<protocol::ArraysQuery>(&message))
    handle(*query);
  else if (const auto* start = std::get_if<protocol::RenderStart>(&message))
    handle(*start);
  else if (const auto* save = std::get_if<protocol::SaveScene>(&message))
    handle(*save);
  else  // only a header too long for the I/O thread gets here with another type
    to_client(protocol::error("limit", "The header of this message is too long for its type.", false));
}

void SessionRunner::handle(Work& work, const protocol::Arrays& arrays) {
  Result<std::vector<ArrayPointer>> decoded =
      decode_arrays(arrays.header, {std::move(work.payload_owner), work.payload}, {limits_.elements, 4});
  if (!decoded) {
    spdlog::warn("{}: arrays refused: {}", name_, decoded.error());
    to_client(protocol::error("arrays", decoded.error(), false));
    return;
  }
  spdlog::info("{}: {} arrays, {} bytes", name_, decoded->size(), work.payload.size());
  arrays_.add(std::move(*decoded));
}

void SessionRunner::handle(const protocol::ArraysQuery& query) {
  to_client(protocol::arrays_missing(arrays_.missing(query.hashes)));
}

void SessionRunner::handle(const protocol::Transaction& message) {
  Report report;
  const auto resolve = [this](const std::string& hash) { return arrays_.find(hash); };
  std::optional<description::Transaction> transaction =
      description::decode_transaction(message.header, resolve, report, {limits_.pixels, &retired_});
  if (!transaction) {
    const auto epoch = message.header.find("epoch");
    const bool known = epoch != message.header.end() && epoch->is_number_integer();
    const std::vector<Message> found = report.messages();
    spdlog::warn("{}: transaction refused: {}", name_, found.empty() ? "" : found.front().text);
    to_client(protocol::transaction_result(known ? epoch->get<int64_t>() : 0, false, report));
    return;
  }
  const int64_t epoch = transaction->epoch;
  const size_t edits = transaction->edits.size();
  if (epoch < transaction_epoch_) {
    to_client(
        protocol::error("epoch",
                        fmt::format("The transaction of epoch {} was not applied: epochs increase, and {} came before.",
                                    epoch, transaction_epoch_),
                        false, epoch));
    return;
  }
  transaction_epoch_ = epoch;
  {
    const std::lock_guard gate(gate_);
    session_->apply(std::move(*transaction));
  }
  arrays_.sweep(epoch);
  spdlog::info("{}: transaction of epoch {}: {} edits, {} arrays held", name_, epoch, edits, arrays_.size());
  to_client(protocol::transaction_result(epoch, true, report));
}

void SessionRunner::handle(const protocol::RenderStart& start) {
  arrays_.sweep_all();
  bool started = false;
  {
    const std::lock_guard gate(gate_);
    {
      const std::lock_guard lock(epochs_mutex_);
      started = start.epoch > cancelled_through_;
      if (started) {
        started_epoch_ = start.epoch;
        stream_ = start.stream;
      }
    }
    if (started) {
      spdlog::info("{}: render {} starts", name_, start.epoch);
      session_->start(start.epoch, start.repeat_tiles);
    }
  }
  loop_.post([weak = weak_from_this(), epoch = start.epoch, started] {
    const auto self = weak.lock();
    if (!self) return;
    if (self->queued_starts_.erase(epoch) && !started) self->answer_cancelled(epoch);
  });
}

void SessionRunner::handle(const protocol::SaveScene& save) {
  const std::string& path = save.path;
  if (!path.starts_with('/') || !path.ends_with(".lambent")) {
    to_client(protocol::error(
        "save_scene",
        fmt::format("The scene was not saved to '{}': the path must be absolute and end in '.lambent'.", path), false));
    return;
  }
  description::SceneDescription scene;
  {
    const std::lock_guard gate(gate_);
    scene = session_->scene();  // a copy of pointers
  }
  const Result<uint64_t> bytes = description::save_scene_file(path, scene, "lambentd");
  if (!bytes) {
    spdlog::warn("{}: {}", name_, bytes.error());
    to_client(protocol::error("save_scene", bytes.error(), false));
    return;
  }
  spdlog::info("{}: saved the scene to '{}', {} bytes", name_, path, *bytes);
  to_client(protocol::scene_saved(path, *bytes));
}

}  // namespace lambent
