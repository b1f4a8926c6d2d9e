// The golden frames under golden/, which the add-on's tests read and write too (golden/make_golden.py).
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "engine/description/frame.h"
#include "engine/description/json_codec.h"
#include "server/daemon/session_messages.h"
#include "server/protocol/messages.h"
#include "server/transport/authentication.h"

namespace lambent {
namespace {

std::string read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The frames in `bytes` as (header, payload); empty with a reason if they are not frames.
Result<std::vector<std::pair<Json, std::string>>> read_frames(const std::string& bytes) {
  std::vector<std::pair<Json, std::string>> frames;
  for (size_t at = 0; at < bytes.size();) {
    if (bytes.size() - at < k_frame_head_bytes) return Error{"truncated"};
    FrameHead head;
    FrameError error;
    const auto raw = std::as_bytes(std::span(bytes.data() + at, bytes.size() - at));
    FrameLimits limits;
    limits.payload_bytes = uint64_t(1) << 32;
    if (!decode_frame_head(raw.first<k_frame_head_bytes>(), limits, head, error)) return Error{error.message};
    at += k_frame_head_bytes;
    if (bytes.size() - at < head.header_bytes + head.payload_bytes) return Error{"truncated"};
    Result<Json> header = decode_frame_header(bytes.substr(at, head.header_bytes));
    if (!header) return Error{header.error()};
    frames.emplace_back(std::move(*header), bytes.substr(at + head.header_bytes, head.payload_bytes));
    at += head.header_bytes + head.payload_bytes;
  }
  return frames;
}

std::vector<std::filesystem::path> golden_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(LAMBENT_GOLDEN))
    if (entry.path().extension() == ".bin") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

TEST(Golden, frames_are_read_as_described_and_malformed_ones_refused) {
  ASSERT_GT(golden_files().size(), 15u);
  for (const auto& path : golden_files()) {
    const Json description = Json::parse(read_file(std::filesystem::path(path).replace_extension(".json")));
    const auto frames = read_frames(read_file(path));
    if (description.contains("error")) {
      EXPECT_FALSE(frames) << path;
      continue;
    }
    ASSERT_TRUE(frames) << path << frames.error();
    ASSERT_EQ(frames->size(), description["frames"].size()) << path;
    for (size_t i = 0; i < frames->size(); ++i) {
      const Json& expected = description["frames"][i];
      const auto& [header, payload] = (*frames)[i];
      EXPECT_EQ(header, expected["header"]) << path;
      EXPECT_EQ(payload.size(), expected["payload_bytes"].get<size_t>()) << path;
      if (header["type"] != "arrays") continue;
      auto memory = std::make_shared<std::vector<std::byte>>(payload.size());
      std::memcpy(memory->data(), payload.data(), payload.size());
      const auto arrays = decode_arrays(header, {memory, *memory});
      ASSERT_TRUE(arrays) << path << arrays.error();
      for (size_t k = 0; k < arrays->size(); ++k)
        EXPECT_EQ((*arrays)[k]->hash, expected["arrays"][k]["hash"].get<std::string>()) << path;
    }
  }
}

TEST(Golden, frames_keep_their_bytes_when_written_again) {
  // JSON objects have no order, so the text may differ; head, sizes and payload may not.
  for (const auto& path : golden_files()) {
    const std::string bytes = read_file(path);
    const auto frames = read_frames(bytes);
    if (!frames) continue;
    std::string again;
    for (const auto& [header, payload] : *frames) again += encode_frame_start(header, payload.size()) + payload;
    EXPECT_EQ(again.size(), bytes.size()) << path;
    const auto reread = read_frames(again);
    ASSERT_TRUE(reread) << path;
    EXPECT_EQ(*reread, *frames) << path;
    EXPECT_EQ(again.substr(0, k_frame_head_bytes), bytes.substr(0, k_frame_head_bytes)) << path;
  }
}

TEST(Golden, transactions_are_accepted) {
  const auto frames = read_frames(read_file(std::string(LAMBENT_GOLDEN) + "/session.bin"));
  ASSERT_TRUE(frames) << frames.error();
  std::map<std::string, ArrayPointer> arrays;
  int transactions = 0;
  for (const auto& [header, payload] : *frames) {
    if (header["type"] == "arrays") {
      auto memory = std::make_shared<std::vector<std::byte>>(payload.size());
      std::memcpy(memory->data(), payload.data(), payload.size());
      const auto decoded = decode_arrays(header, {memory, *memory});
      ASSERT_TRUE(decoded) << decoded.error();
      for (const ArrayPointer& array : *decoded) arrays[array->hash] = array;
    } else if (header["type"] == "transaction") {
      Report report;
      EXPECT_TRUE(description::decode_transaction(
          header, [&](const std::string& hash) { return arrays[hash]; }, report));
      for (const Message& message : report.messages()) ADD_FAILURE() << message.text;
      ++transactions;
    } else {
      EXPECT_EQ(protocol::decode_client_message(header).index(), 0u) << header;
    }
  }
  EXPECT_GT(transactions, 0);
}

TEST(Golden, a_tile_is_written_as_python_expects_it) {
  const auto frames = read_frames(read_file(std::string(LAMBENT_GOLDEN) + "/tile.bin"));
  ASSERT_TRUE(frames);
  const Json& header = (*frames)[0].first;
  TileSnapshot tile;
  tile.epoch = 1;
  tile.rectangle = {64, 128, 3, 2};
  tile.samples = 16;
  tile.final = true;
  tile.channels = {{"combined", 4}};
  for (int i = 0; i < 24; ++i) tile.pixels.push_back(0.125f * i);
  const OutgoingMessage message = tile_message(std::move(tile));
  const std::string payload(reinterpret_cast<const char*>(message.payload.data()), message.payload.size());
  const auto written = read_frames(message.start + payload);
  ASSERT_TRUE(written);
  EXPECT_EQ((*written)[0].first, header);
  EXPECT_EQ((*written)[0].second, (*frames)[0].second);
}

TEST(Golden, proofs_are_those_of_python) {
  const Json golden = Json::parse(read_file(std::string(LAMBENT_GOLDEN) + "/handshake.json"));
  const std::string token = golden["token"].get<std::string>();
  std::string daemon_nonce, client_nonce, client_proof, daemon_proof;
  for (const Json& frame : golden["frames"]) {
    const Json& header = frame["header"];
    if (header["type"] == "challenge") daemon_nonce = header["nonce"].get<std::string>();
    if (header["type"] == "hello") {
      client_nonce = header["nonce"].get<std::string>();
      client_proof = header["proof"].get<std::string>();
    }
    if (header["type"] == "welcome") daemon_proof = header["proof"].get<std::string>();
  }
  EXPECT_EQ(proof(token, "client", daemon_nonce, client_nonce), client_proof);
  EXPECT_EQ(proof(token, "daemon", client_nonce, daemon_nonce), daemon_proof);
}

}  // namespace
}  // namespace lambent
