#include "server/transport/authentication.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>

#include "engine/base/check.h"
#include "server/transport/descriptor.h"
#include "server/transport/listener.h"

namespace lambent {
namespace {

std::string to_hex(const unsigned char* bytes, size_t count) {
  std::string text;
  for (size_t i = 0; i < count; ++i) text += fmt::format("{:02x}", bytes[i]);
  return text;
}

Error failure(const std::string& path, const std::string& cause) {
  return Error{fmt::format("The token file '{}' {}.", path, cause)};
}

/// Makes the file under another name first, so that whoever opens it finds a whole token; keeps one that is there.
Status create_token(const std::string& path) {
  if (Status folder = make_private_folder_of(path); !folder) return folder;
  const std::string temporary = fmt::format("{}.{}.tmp", path, ::getpid());
  ::unlink(temporary.c_str());
  const Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
  const std::string text = make_nonce() + "\n";
  const bool written = file && ::write(file.number(), text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const bool linked = written && (::link(temporary.c_str(), path.c_str()) == 0 || errno == EEXIST);
  const int error = errno;
  if (file) ::unlink(temporary.c_str());
  if (!linked) return failure(path, fmt::format("cannot be made: {}", std::strerror(error)));
  return Ok{};
}

}  // namespace

std::string make_nonce() {
  unsigned char bytes[32];
  CHECK(RAND_bytes(bytes, sizeof bytes) == 1, "the system has no random numbers");
  return to_hex(bytes, sizeof bytes);
}

bool is_nonce(std::string_view text) {
  return text.size() == 64 && std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isxdigit(c); });
}

Result<std::string> read_token(const std::string& path, bool may_create) {
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY));
  if (!file && errno == ENOENT && may_create) {
    if (Status created = create_token(path); !created) return Error{created.error()};
    file = Descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY));
  }
  if (!file) return failure(path, fmt::format("cannot be read: {}", std::strerror(errno)));
  struct stat status {};
  if (::fstat(file.number(), &status) != 0 || !S_ISREG(status.st_mode)) return failure(path, "is not a file");
  if (status.st_uid != ::geteuid()) return failure(path, "belongs to another user");
  if (status.st_mode & 077) return failure(path, "can be read by other users (chmod 600)");
  char text[256];
  const ssize_t count = ::read(file.number(), text, sizeof text);
  std::string token(text, count > 0 ? static_cast<size_t>(count) : 0);
  while (!token.empty() && std::isspace(static_cast<unsigned char>(token.back()))) token.pop_back();
  token.erase(0, token.find_first_not_of(" \t\r\n"));
  if (!is_nonce(token)) return failure(path, "does not hold 64 hexadecimal digits");
  return token;
}

std::string proof(std::string_view token, std::string_view role, std::string_view first_nonce,
                  std::string_view second_nonce) {
  const std::string text = fmt::format("{}:{}:{}", role, first_nonce, second_nonce);
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  const unsigned char* made = HMAC(EVP_sha256(), token.data(), static_cast<int>(token.size()),
                                   reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest, &length);
  CHECK(made && length == 32, "HMAC-SHA256 is not available from OpenSSL");
  return to_hex(digest, length);
}

bool same_secret(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace lambent
