// The messages of PROTOCOL.md as values: decoding what clients send, encoding what the daemon answers. What carries
// pixels and figures of a render is encoded in daemon/session_messages.h, next to the types it comes from.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/base/report.h"
#include "engine/base/result.h"
#include "engine/description/json_text.h"

namespace lambent::protocol {

inline constexpr int k_version = 1;

// --- Client -> daemon ---------------------------------------------------------------------------------------------

struct Hello {
  int64_t protocol = 0;
  std::string client, nonce, proof;
};
struct ArraysQuery {
  std::vector<std::string> hashes;
};
/// The header is decoded together with the payload, by decode_arrays().
struct Arrays {
  Json header;
};
/// The header is decoded by description::decode_transaction().
struct Transaction {
  Json header;
};
struct RenderStart {
  int64_t epoch = 0;
  std::vector<std::string> stream;  ///< channels of tiles that are not final; empty: all
  bool repeat_tiles = true;         ///< final tiles are all there are, also those whose pixels were sent before
};
struct RenderCancel {
  int64_t epoch = 0;
};
struct TileCredit {
  int64_t tiles = 0;
};
struct SaveScene {
  std::string path;
};
struct Ping {
  Json cookie;
};
struct Bye {};

using ClientMessage =
    std::variant<Hello, ArraysQuery, Arrays, Transaction, RenderStart, RenderCancel, TileCredit, SaveScene, Ping, Bye>;

/// Why a message was refused, as the `error` message has it.
struct MessageError {
  std::string code;  ///< "malformed" or "unknown_type"
  std::string text;
};

/// The message in a frame's header (an object with a string "type"). Unknown members are ignored here.
std::variant<ClientMessage, MessageError> decode_client_message(Json header);

// --- Daemon -> client ---------------------------------------------------------------------------------------------

struct Limits {
  uint64_t header_bytes = uint64_t(64) << 20;
  uint64_t payload_bytes = 0;  ///< of one frame
  uint64_t session_bytes = 0;  ///< of a session's arrays and queued messages together
  int64_t pixels = int64_t(1) << 28;
  uint64_t elements = uint64_t(1) << 32;  ///< of one array
  int64_t tile_credits = 4096;
};

struct Capabilities {
  std::vector<std::string> integrators, node_types, passes;
  bool shared_memory = false;
  Limits limits;
};

Json challenge(const std::string& nonce);
Json welcome(const std::string& version, uint64_t session, const std::string& proof, const Capabilities& capabilities);
Json arrays_missing(const std::vector<std::string>& hashes);
Json transaction_result(int64_t epoch, bool accepted, const Report& report);
Json render_report(int64_t epoch, const Report& report);
Json scene_saved(const std::string& path, uint64_t bytes);
Json render_stopped(int64_t epoch);
Json pong(const Json& cookie);
Json error(const std::string& code, const std::string& text, bool fatal, std::optional<int64_t> epoch = {});

}  // namespace lambent::protocol
