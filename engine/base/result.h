// Result<T>: a value or a message for the user. For failures that a user can cause.
#pragma once

#include <string>
#include <utility>
#include <variant>

namespace lambent {

/// Why something failed, complete by itself: it names the object, the parameter and the file.
struct Error {
  std::string message;
};

/// Either a T or an Error. Check with `if (result)`, then `*result` or `result.error()`.
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}
  Result(Error error) : state_(std::move(error)) {}

  explicit operator bool() const { return state_.index() == 0; }
  T& operator*() { return std::get<0>(state_); }
  const T& operator*() const { return std::get<0>(state_); }
  T* operator->() { return &std::get<0>(state_); }
  const T* operator->() const { return &std::get<0>(state_); }
  const std::string& error() const { return std::get<1>(state_).message; }

 private:
  std::variant<T, Error> state_;
};

/// Success without a value.
struct Ok {};
using Status = Result<Ok>;

}  // namespace lambent
