#include "engine/description/json_text.h"

#include <cstdint>
#include <iterator>

namespace lambent {
namespace {

/// Empty if nesting and counts keep within the limits. Brackets and commas outside strings bound both, whether or not
/// the text turns out to be JSON.
std::string over_limit(std::string_view text, const JsonLimits& limits) {
  size_t depth = 0, values = 1;
  bool in_string = false;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\')
        ++i;
      else if (c == '"')
        in_string = false;
      continue;
    }
    switch (c) {
      case '"':
        in_string = true;
        break;
      case '{':
      case '[':
        ++values;
        if (++depth > limits.depth) return "it is nested more than " + std::to_string(limits.depth) + " deep";
        break;
      case '}':
      case ']':
        if (depth) --depth;
        break;
      case ',':
        ++values;
        break;
      default:
        break;
    }
  }
  if (values > limits.values) return "it has more than " + std::to_string(limits.values) + " values";
  return {};
}

/// A text that ends early when nobody wants its value any more.
class AbandonableText {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  AbandonableText(const char* at, const std::atomic<bool>* abandoned) : at_(at), abandoned_(abandoned) {}
  reference operator*() const { return *at_; }
  AbandonableText& operator++() {
    ++at_;
    return *this;
  }
  AbandonableText operator++(int) { return {at_++, abandoned_}; }
  bool operator==(const AbandonableText& end) const {
    constexpr uintptr_t k_stride = 4096;  // bytes between looks
    if (reinterpret_cast<uintptr_t>(at_) % k_stride == 0 && abandoned_ && abandoned_->load(std::memory_order_relaxed))
      return true;
    return at_ == end.at_;
  }
  bool operator!=(const AbandonableText& end) const { return !(*this == end); }

 private:
  const char* at_;
  const std::atomic<bool>* abandoned_;
};

}  // namespace

Result<Json> parse_json(std::string_view text, const JsonLimits& limits) {
  if (std::string problem = over_limit(text, limits); !problem.empty())
    return Error{"The JSON text is over the limit: " + problem + "."};
  Json value = Json::parse(AbandonableText(text.data(), limits.abandoned),
                           AbandonableText(text.data() + text.size(), limits.abandoned), nullptr,
                           /*allow_exceptions=*/false);
  if (value.is_discarded()) return Error{"The text is not JSON in UTF-8 (or holds a number that is not finite)."};
  return value;
}

std::optional<uint64_t> whole_number(const Json& value) {
  if (value.is_number_unsigned()) return value.get<uint64_t>();
  if (!value.is_number_integer() || value.get<int64_t>() < 0) return std::nullopt;
  return static_cast<uint64_t>(value.get<int64_t>());
}

std::string json_text(const Json& value) {
  return value.dump(-1, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace);
}

}  // namespace lambent
