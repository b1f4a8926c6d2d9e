// Throws mutated frames at everything that reads them: frame and edit decoders directly, and a daemon's connection
// handler through a socket. Passes if nothing crashes, hangs or is left behind.
//
//   fuzz_frames [FRAMES] [SEED]
//
// Run a million under the address sanitizer before a release: build/address/bin/fuzz_frames 1000000
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>

#include "engine/base/check.h"
#include "engine/base/log.h"
#include "engine/base/memory.h"
#include "engine/description/frame.h"
#include "engine/description/json_codec.h"
#include "engine/description/test_values.h"
#include "tests/protocol/local_daemon.h"

namespace lambent {
namespace {

using Random = std::mt19937_64;

struct Sample {
  Json header;
  std::vector<std::byte> payload;
};

/// Correct messages of every kind.
std::vector<Sample> correct_messages() {
  description::ArrayCollector collector;
  const Json transaction = description::encode_transaction(description::full_transaction(), collector);
  std::vector<Sample> samples;
  samples.push_back({transaction, {}});
  // Each edit alone too: mutations of a short message go deeper into it.
  for (const Json& edit : transaction["edits"])
    samples.push_back({{{"type", "transaction"}, {"epoch", 1}, {"edits", Json::array({edit})}}, {}});
  const std::vector<ArrayPointer>& arrays = collector.arrays();
  samples.push_back({{{"type", "arrays"}, {"arrays", lay_out_arrays(arrays).descriptors}}, gather_payload(arrays)});
  samples.push_back({{{"type", "arrays_query"}, {"hashes", {arrays[0]->hash, std::string(32, 'a')}}}, {}});
  samples.push_back({{{"type", "render_start"}, {"epoch", 1}}, {}});
  samples.push_back({{{"type", "render_cancel"}, {"epoch", 1}}, {}});
  samples.push_back({{{"type", "tile_credit"}, {"tiles", 5}}, {}});
  samples.push_back({{{"type", "save_scene"}, {"path", "relative.lambent"}}, {}});  // refused: nothing is written
  samples.push_back({{{"type", "ping"}, {"cookie", {{"a", Json::array({1, 2.5, nullptr})}}}}, {}});
  samples.push_back({{{"type", "hello"}, {"protocol", 1}, {"client", "x"}, {"nonce", "00"}, {"proof", "11"}}, {}});
  samples.push_back({{{"type", "bye"}}, {}});
  return samples;
}

size_t below(Random& random, size_t bound) { return bound ? random() % bound : 0; }

/// A value that readers may not expect.
Json odd_value(Random& random) {
  switch (below(random, 18)) {
    case 0:
      return nullptr;
    case 1:
      return -1;
    case 2:
      return int64_t(random());
    case 3:
      return uint64_t(random());
    case 4:
      return std::ldexp(1.0, int(below(random, 2000)) - 1000);
    case 5:
      return std::string(below(random, 70), 'x');
    case 6:
      return Json::array();
    case 7:
      return Json::object();
    case 8:
      return Json::array({Json::array({Json::object()})});
    case 9:
      return true;
    case 10:
      return std::string(32, '0');
    case 11:
      return 0.5;
    case 12:
      return Json{{"array", std::string(32, '0')}};
    case 13:
      return Json{{"link", Json::array({int64_t(random() % 5), "x"})}};
    case 14:
      return uint64_t(1) << below(random, 64);
    case 15:
      return Json::array({1, 2, 3, 4});
    case 16:
      return "\xf0\x9f\x92\xa1";
    default:
      return 1e300;
  }
}

/// Changes something somewhere in the tree.
void mutate_json(Json& json, Random& random) {
  Json* at = &json;
  while (at->is_structured() && !at->empty() && below(random, 5) != 0) {
    auto child = at->begin();
    std::advance(child, static_cast<std::ptrdiff_t>(below(random, at->size())));
    at = &*child;
  }
  if (at->is_object() && below(random, 2)) {
    if (!at->empty() && below(random, 2)) {
      auto child = at->begin();
      std::advance(child, static_cast<std::ptrdiff_t>(below(random, at->size())));
      at->erase(child);
    } else {
      (*at)[std::string(1 + below(random, 3), 'q')] = odd_value(random);
    }
  } else if (at->is_array() && below(random, 2)) {
    if (!at->empty() && below(random, 2))
      at->erase(below(random, at->size()));
    else
      at->push_back(at->empty() ? odd_value(random) : (*at)[0]);
  } else {
    *at = odd_value(random);
  }
}

void mutate_bytes(std::string& bytes, Random& random) {
  for (size_t i = 1 + below(random, 4); i > 0 && !bytes.empty(); --i) {
    const size_t at = below(random, bytes.size());
    switch (below(random, 6)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(random, 8)));
        break;
      case 1:
        bytes[at] = static_cast<char>(random());
        break;
      case 2:
        bytes.erase(at, 1 + below(random, 16));
        break;
      case 3:
        bytes.insert(at, 1 + below(random, 16), static_cast<char>(random()));
        break;
      case 4:
        bytes.resize(at);
        break;
      default:
        bytes += bytes.substr(at, below(random, 64));
        break;
    }
  }
}

std::string frame_of(const Sample& sample) {
  std::string bytes = encode_frame_start(sample.header, sample.payload.size());
  bytes.append(reinterpret_cast<const char*>(sample.payload.data()), sample.payload.size());
  return bytes;
}

/// A frame, more or less. `whole` says that its lengths are right, so that the stream stays in step.
std::string mutated_frame(const std::vector<Sample>& samples, Random& random, bool& whole) {
  Sample sample = samples[below(random, samples.size())];
  whole = true;
  const size_t kind = below(random, 20);
  if (kind < 14) {
    for (size_t i = below(random, 4); i > 0; --i) mutate_json(sample.header, random);
    if (!sample.header.is_object()) sample.header = {{"type", "transaction"}};
    if (kind == 0 && !sample.payload.empty()) sample.payload.resize(below(random, sample.payload.size()));
    return frame_of(sample);
  }
  if (kind < 18) {  // header text damaged, lengths right
    std::string text = json_text(sample.header);
    mutate_bytes(text, random);
    if (text.size() < 2) text = "{}";
    const auto head = encode_frame_head({false, false, static_cast<uint32_t>(text.size()), 0});
    return std::string(reinterpret_cast<const char*>(head.data()), head.size()) + text;
  }
  whole = false;
  std::string bytes = frame_of(sample);
  if (kind == 18) {
    mutate_bytes(bytes, random);
  } else {
    bytes.resize(below(random, 200));
    for (char& c : bytes) c = static_cast<char>(random());
  }
  return bytes;
}

/// Everything that reads frames, called directly.
void decode_directly(const std::string& bytes, const description::ArrayResolver& arrays) {
  if (bytes.size() < k_frame_head_bytes) return;
  FrameLimits limits;
  limits.payload_in_fd = limits.payload_zstd = true;
  FrameHead head;
  FrameError error;
  const auto raw = std::as_bytes(std::span(bytes.data(), bytes.size()));
  if (!decode_frame_head(raw.first<k_frame_head_bytes>(), limits, head, error)) return;
  const std::string rest = bytes.substr(k_frame_head_bytes);
  Result<Json> header = decode_frame_header(rest.substr(0, head.header_bytes));
  if (!header) return;
  auto memory =
      std::make_shared<std::vector<std::byte>>(rest.size() > head.header_bytes ? rest.size() - head.header_bytes : 0);
  if (!memory->empty()) std::memcpy(memory->data(), rest.data() + (rest.size() - memory->size()), memory->size());
  static_cast<void>(decode_arrays(*header, {memory, *memory}));
  Report report;
  if (auto transaction = description::decode_transaction(*header, arrays, report)) {
    // What was accepted must survive being written and read again.
    description::ArrayCollector collector;
    const Json again = description::encode_transaction(*transaction, collector);
    Report second;
    CHECK(description::decode_transaction(again, arrays, second), json_text(again));
    description::SceneDescription scene;
    description::apply(std::move(*transaction), scene);
  }
  static_cast<void>(protocol::decode_client_message(std::move(*header)));
}

int fuzz(size_t frames, uint64_t seed) {
  Random random(seed);
  const std::vector<Sample> samples = correct_messages();
  description::ArrayCollector collector;
  description::encode_transaction(description::full_transaction(), collector);
  const description::ArrayResolver arrays = description::resolver_of(collector);
  LocalDaemon daemon;
  std::unique_ptr<WireClient> client;
  size_t connections = 0, handshakes_attacked = 0;
  for (size_t i = 0; i < frames; ++i) {
    bool whole = true;
    const std::string bytes = mutated_frame(samples, random, whole);
    decode_directly(bytes, arrays);
    if (!client) {
      ++connections;
      if (below(random, 50) == 0) {  // before the handshake
        ++handshakes_attacked;
        const auto stranger = daemon.connect();
        stranger->send_bytes(bytes);
      }
      client = daemon.open_session();
      // The number of sessions is limited, and on a busy machine those that ended are not freed yet.
      if (!client && daemon.wait_until_free()) client = daemon.open_session();
      CHECK(client, "the daemon does not answer a handshake");
      client->send_arrays(collector.arrays());
    }
    const bool sent = client->send_bytes(bytes) && client->drain();
    // In step again after a ping is answered; a stream that is out of step is left to the daemon.
    if (!sent || !whole) {
      client.reset();
    } else if (i % 64 == 0) {
      client->send({{"type", "ping"}, {"cookie", i}});
      if (!client->receive("pong")) client.reset();
    }
  }
  client.reset();
  CHECK(daemon.open_session(), "the daemon does not answer at the end");
  CHECK(daemon.wait_until_free(), "sessions are left behind");
  CHECK(daemon.used_bytes() == 0, fmt::format("{} bytes are left behind", daemon.used_bytes()));
  fmt::print("{} frames, {} connections ({} attacked before the handshake), seed {}, peak memory {} MB\n", frames,
             connections, handshakes_attacked, seed, peak_resident_bytes() >> 20);
  return 0;
}

}  // namespace
}  // namespace lambent

int main(int argc, char** argv) {
  const size_t frames = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 10'000;
  const uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  lambent::set_up_log("off", {});
  const auto start = std::chrono::steady_clock::now();
  const int code = lambent::fuzz(frames, seed);
  fmt::print("{:.1f} s\n", std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  return code;
}
