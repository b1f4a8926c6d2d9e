#include "server/protocol/messages.h"

#include <fmt/format.h>

#include "engine/description/frame.h"

namespace lambent::protocol {
namespace {

constexpr size_t k_max_cookie_bytes = 1024;
constexpr size_t k_max_path_bytes = 4096;

/// Reads members of one message; the first that is wrong stays in error().
class Members {
 public:
  explicit Members(const Json& header) : header_(header), type_(header["type"].get_ref<const std::string&>()) {}

  int64_t integer(const char* name, int64_t least) {
    const Json* json = find(name);
    if (!json) return 0;
    if (!json->is_number_integer() || (json->is_number_unsigned() && json->get<uint64_t>() > uint64_t(INT64_MAX)) ||
        json->get<int64_t>() < least) {
      fail(name, fmt::format("is not a whole number from {}", least));
      return 0;
    }
    return json->get<int64_t>();
  }
  std::string text(const char* name, size_t most_bytes) {
    const Json* json = find(name);
    if (!json) return {};
    if (!json->is_string() || json->get_ref<const std::string&>().size() > most_bytes) {
      fail(name, fmt::format("is not a string of at most {} bytes", most_bytes));
      return {};
    }
    return json->get<std::string>();
  }
  std::vector<std::string> hashes(const char* name) {
    std::vector<std::string> values;
    const Json* json = find(name);
    if (!json) return values;
    if (!json->is_array()) fail(name, "is not a list");
    for (const Json& element : *json) {
      if (!element.is_string() || !is_array_hash(element.get_ref<const std::string&>())) {
        fail(name, "holds something that is not 32 lower-case hexadecimal digits");
        return {};
      }
      values.push_back(element.get<std::string>());
    }
    return values;
  }
  /// A list of strings that may be absent.
  std::vector<std::string> names(const char* name) {
    std::vector<std::string> values;
    const auto json = header_.find(name);
    if (json == header_.end() || json->is_null()) return values;
    if (!json->is_array()) fail(name, "is not a list");
    for (const Json& element : *json) {
      if (element.is_string())
        values.push_back(element.get<std::string>());
      else
        fail(name, "holds something that is not a string");
    }
    return values;
  }
  /// A boolean that may be absent.
  bool flag(const char* name, bool absent) {
    const auto json = header_.find(name);
    if (json == header_.end() || json->is_null()) return absent;
    if (!json->is_boolean()) fail(name, "is neither true nor false");
    return json->is_boolean() ? json->get<bool>() : absent;
  }
  const Json* find(const char* name) {
    const auto found = header_.find(name);
    if (found != header_.end()) return &*found;
    fail(name, "is missing");
    return nullptr;
  }
  void fail(const char* name, const std::string& problem) {
    if (error_.empty()) error_ = fmt::format("The message '{}' is malformed: '{}' {}.", type_, name, problem);
  }
  const std::string& error() const { return error_; }

 private:
  const Json& header_;
  const std::string& type_;
  std::string error_;
};

const char* severity_name(Severity severity) {
  switch (severity) {
    case Severity::info:
      return "info";
    case Severity::warning:
      return "warning";
    case Severity::error:
      return "error";
  }
  return "";
}

Json messages_json(const Report& report) {
  Json list = Json::array();
  for (const Message& message : report.messages())
    list.push_back({{"severity", severity_name(message.severity)},
                    {"code", message.code},
                    {"object", message.object},
                    {"text", message.text}});
  if (const size_t dropped = report.dropped())
    list.push_back({{"severity", "warning"},
                    {"code", "more_messages"},
                    {"object", ""},
                    {"text", fmt::format("There were {} more messages.", dropped)}});
  return list;
}

}  // namespace

std::variant<ClientMessage, MessageError> decode_client_message(Json header) {
  const std::string type = header["type"].get<std::string>();
  if (type == "arrays") return ClientMessage(Arrays{std::move(header)});
  if (type == "transaction") return ClientMessage(Transaction{std::move(header)});

  Members members(header);
  ClientMessage message = Bye{};
  if (type == "hello") {
    Hello hello;
    hello.protocol = members.integer("protocol", 0);
    // Another version's hello may lack what follows; the answer must be about the version.
    if (hello.protocol == k_version) {
      hello.client = members.text("client", 256);
      hello.nonce = members.text("nonce", 64);
      hello.proof = members.text("proof", 64);
    }
    message = std::move(hello);
  } else if (type == "arrays_query") {
    message = ArraysQuery{members.hashes("hashes")};
  } else if (type == "render_start") {
    message = RenderStart{members.integer("epoch", 0), members.names("stream"), members.flag("repeat_tiles", true)};
  } else if (type == "render_cancel") {
    message = RenderCancel{members.integer("epoch", 0)};
  } else if (type == "tile_credit") {
    message = TileCredit{members.integer("tiles", 0)};
  } else if (type == "save_scene") {
    message = SaveScene{members.text("path", k_max_path_bytes)};
  } else if (type == "ping") {
    const Json* cookie = members.find("cookie");
    if (cookie && json_text(*cookie).size() > k_max_cookie_bytes)
      members.fail("cookie", fmt::format("is longer than {} bytes", k_max_cookie_bytes));
    message = Ping{cookie ? *cookie : Json()};
  } else if (type != "bye") {
    return MessageError{"unknown_type",
                        fmt::format("This daemon does not know messages of the type '{}'.", type.substr(0, 64))};
  }
  if (!members.error().empty()) return MessageError{"malformed", members.error()};
  return message;
}

Json challenge(const std::string& nonce) { return {{"type", "challenge"}, {"protocol", k_version}, {"nonce", nonce}}; }

Json welcome(const std::string& version, uint64_t session, const std::string& proof, const Capabilities& capabilities) {
  const Limits& limits = capabilities.limits;
  return {{"type", "welcome"},
          {"protocol", k_version},
          {"version", version},
          {"session", session},
          {"proof", proof},
          {"capabilities",
           {{"integrators", capabilities.integrators},
            {"filters", {"BOX", "GAUSSIAN", "BLACKMAN_HARRIS"}},
            {"node_types", capabilities.node_types},
            {"passes", capabilities.passes},
            {"shared_memory", capabilities.shared_memory},
            {"limits",
             {{"header_bytes", limits.header_bytes},
              {"payload_bytes", limits.payload_bytes},
              {"session_bytes", limits.session_bytes},
              {"pixels", limits.pixels},
              {"elements", limits.elements},
              {"tile_credits", limits.tile_credits}}}}}};
}

Json arrays_missing(const std::vector<std::string>& hashes) { return {{"type", "arrays_missing"}, {"hashes", hashes}}; }

Json transaction_result(int64_t epoch, bool accepted, const Report& report) {
  return {
      {"type", "transaction_result"}, {"epoch", epoch}, {"accepted", accepted}, {"messages", messages_json(report)}};
}

Json render_report(int64_t epoch, const Report& report) {
  return {{"type", "render_report"}, {"epoch", epoch}, {"messages", messages_json(report)}};
}

Json scene_saved(const std::string& path, uint64_t bytes) {
  return {{"type", "scene_saved"}, {"path", path}, {"bytes", bytes}};
}

Json render_stopped(int64_t epoch) { return {{"type", "render_stopped"}, {"epoch", epoch}}; }

Json pong(const Json& cookie) { return {{"type", "pong"}, {"cookie", cookie}}; }

Json error(const std::string& code, const std::string& text, bool fatal, std::optional<int64_t> epoch) {
  Json message{{"type", "error"}, {"code", code}, {"message", text}, {"fatal", fatal}};
  if (epoch) message["epoch"] = *epoch;
  return message;
}

}  // namespace lambent::protocol
