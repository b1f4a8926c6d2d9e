// JSON text to and from values, with limits that hold before memory is taken and without exceptions.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "engine/base/result.h"

namespace lambent {

using Json = nlohmann::json;

struct JsonLimits {
  size_t depth = 64;                ///< nested objects and lists
  size_t values = size_t(8) << 20;  ///< values and members in all: a parsed value takes up to some 100 bytes
  const std::atomic<bool>* abandoned = nullptr;  ///< set by another thread: parsing fails soon, nobody wants the value
};

/// Parses one JSON text. Fails (never throws) on text that is not JSON, not UTF-8, or over the limits, which are
/// checked in one pass over the text before anything is allocated; and soon after it is abandoned.
Result<Json> parse_json(std::string_view text, const JsonLimits& limits = {});

/// The whole number from 0 that `value` is; empty if it is something else.
std::optional<uint64_t> whole_number(const Json& value);

/// Compact JSON. Strings that are not UTF-8 get replacement characters; never throws.
std::string json_text(const Json& value);

}  // namespace lambent
