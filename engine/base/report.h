// What went wrong or was stood in for, datablock by datablock: collected while the rest goes on.
#pragma once

#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace lambent {

enum class Severity { info, warning, error };

/// One finding. `text` is complete by itself: it names the datablock, the parameter and the file.
struct Message {
  Severity severity = Severity::warning;
  std::string code;    ///< stable identifier, such as "missing_texture" or "unsupported"
  std::string object;  ///< the user's name of the datablock
  std::string text;
};

/// Thread-safe list of messages. At most k_limit are kept; how many more there were is counted.
class Report {
 public:
  static constexpr size_t k_limit = 1000;

  Report() = default;
  Report(const Report& other) : messages_(other.messages()), dropped_(other.dropped()) {}
  Report& operator=(const Report& other) {
    if (this != &other) {
      messages_ = other.messages();
      dropped_ = other.dropped();
    }
    return *this;
  }

  void add(Severity severity, std::string code, std::string object, std::string text) {
    const std::lock_guard lock(mutex_);
    if (messages_.size() >= k_limit)
      ++dropped_;
    else
      messages_.push_back({severity, std::move(code), std::move(object), std::move(text)});
  }
  void info(std::string code, std::string object, std::string text) {
    add(Severity::info, std::move(code), std::move(object), std::move(text));
  }
  void warning(std::string code, std::string object, std::string text) {
    add(Severity::warning, std::move(code), std::move(object), std::move(text));
  }
  void error(std::string code, std::string object, std::string text) {
    add(Severity::error, std::move(code), std::move(object), std::move(text));
  }
  void append(const Report& other) {
    for (Message& message : other.messages())
      add(message.severity, std::move(message.code), std::move(message.object), std::move(message.text));
  }

  /// Everything, which is removed here.
  Report take() {
    const std::lock_guard lock(mutex_);
    Report taken;
    taken.messages_.swap(messages_);
    std::swap(taken.dropped_, dropped_);
    return taken;
  }

  std::vector<Message> messages() const {
    const std::lock_guard lock(mutex_);
    return messages_;
  }
  size_t dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }
  bool has_errors() const {
    const std::lock_guard lock(mutex_);
    for (const Message& message : messages_)
      if (message.severity == Severity::error) return true;
    return false;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<Message> messages_;
  size_t dropped_ = 0;
};

}  // namespace lambent
