// The shared secret: its file, and the proofs by which both ends show that they know it (PROTOCOL.md, "Handshake and
// authentication").
#pragma once

#include <string>
#include <string_view>

#include "engine/base/result.h"

namespace lambent {

/// 64 hexadecimal digits from the system's random numbers.
std::string make_nonce();

/// The token in the file at `path`. If there is none and `may_create`, makes one with mode 0600. Fails, naming the
/// file, if it cannot be read, is not 64 hexadecimal digits, or other users may read or own it.
Result<std::string> read_token(const std::string& path, bool may_create);

/// HMAC-SHA256(token, "<role>:<first nonce>:<second nonce>") in lower-case hexadecimal. `role` is "client" or "daemon".
std::string proof(std::string_view token, std::string_view role, std::string_view first_nonce,
                  std::string_view second_nonce);

/// Comparison in a time that does not depend on where the texts differ.
bool same_secret(std::string_view a, std::string_view b);

/// True for 64 hexadecimal digits.
bool is_nonce(std::string_view text);

}  // namespace lambent
