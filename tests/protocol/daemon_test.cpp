// The daemon's behaviour towards clients, with the stand-in session.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <set>

#include "engine/description/frame.h"
#include "engine/description/json_codec.h"
#include "engine/description/test_values.h"
#include "tests/protocol/local_daemon.h"
#include "tests/protocol/stand_in_pixels.h"

namespace lambent {
namespace {

using testing::HasSubstr;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// 100 ms; on a machine that is given more work than it has processors, its share of them.
double latency_limit_s() {
  double load = 0;
  ::getloadavg(&load, 1);
  return 0.1 * std::max(1.0, load / std::thread::hardware_concurrency());
}

class DaemonTest : public testing::Test {
 protected:
  DaemonTest() : client_(daemon_.open_session()) {}

  Json transaction(int64_t epoch, Json metadata = Json::object(), int64_t samples = 2) {
    return {{"type", "transaction"},
            {"epoch", epoch},
            {"edits",
             {{{"op", "upsert"},
               {"kind", "settings"},
               {"id", "render"},
               {"value",
                {{"width", 100},
                 {"height", 70},
                 {"samples", samples},
                 {"tile_size_px", 64},
                 {"metadata", std::move(metadata)}}}}}}};
  }
  void configure(int64_t epoch, Json metadata = Json::object(), int64_t samples = 2) {
    client_->send(transaction(epoch, std::move(metadata), samples));
    const auto result = client_->receive("transaction_result");
    ASSERT_TRUE(result && result->header["accepted"].get<bool>());
  }
  void credit(int64_t tiles) { client_->send({{"type", "tile_credit"}, {"tiles", tiles}}); }
  void start(int64_t epoch) { client_->send({{"type", "render_start"}, {"epoch", epoch}}); }
  void cancel(int64_t epoch) { client_->send({{"type", "render_cancel"}, {"epoch", epoch}}); }
  void ping() {
    client_->send({{"type", "ping"}, {"cookie", "c"}});
    const auto pong = client_->receive("pong");
    ASSERT_TRUE(pong);
    EXPECT_EQ(pong->header["cookie"], "c");
  }
  /// The error that answers `bytes` and whether the connection then ends.
  std::string fatal_error_after(const std::string& bytes) {
    const auto victim = daemon_.open_session();
    victim->send_bytes(bytes);
    const auto error = victim->receive("error");
    if (!error || !error->header["fatal"].get<bool>()) return "no fatal error";
    if (victim->receive()) return "the connection is still open";
    return error->header["code"].get<std::string>() + ": " + error->header["message"].get<std::string>();
  }

  LocalDaemon daemon_;
  std::unique_ptr<WireClient> client_;
};

TEST_F(DaemonTest, proves_that_it_knows_the_token_and_announces_its_capabilities) {
  const auto client = daemon_.connect();
  const auto welcome = client->shake_hands(daemon_.token());
  ASSERT_TRUE(welcome);
  EXPECT_EQ(welcome->type(), "welcome");
  EXPECT_EQ(welcome->header["protocol"], 1);
  EXPECT_EQ(welcome->header["proof"].get<std::string>().size(), 64u);
  const Json& capabilities = welcome->header["capabilities"];
  EXPECT_EQ(capabilities["integrators"], Json::array({"PT"}));
  EXPECT_TRUE(capabilities["shared_memory"].get<bool>());
  for (const char* limit : {"header_bytes", "payload_bytes", "session_bytes", "pixels", "elements", "tile_credits"})
    EXPECT_GT(capabilities["limits"][limit].get<uint64_t>(), 0u) << limit;
}

TEST_F(DaemonTest, a_wrong_token_and_a_wrong_version_are_refused_and_disconnected) {
  const auto stranger = daemon_.connect();
  const auto refused = stranger->shake_hands(std::string(64, '0'));
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->header["code"], "authentication");
  EXPECT_FALSE(stranger->receive());

  const auto future = daemon_.connect();
  ASSERT_TRUE(future->receive());
  future->send({{"type", "hello"}, {"protocol", 2}});
  const auto error = future->receive();
  ASSERT_TRUE(error);
  EXPECT_EQ(error->header["code"], "protocol_version");
  EXPECT_FALSE(future->receive());
}

TEST_F(DaemonTest, nothing_but_hello_is_heard_before_the_handshake) {
  for (const Json& header :
       {Json{{"type", "ping"}, {"cookie", 1}}, Json{{"type", "transaction"}, {"epoch", 1}, {"edits", Json::array()}},
        Json{{"type", "nonsense"}}}) {
    const auto stranger = daemon_.connect();
    stranger->send(header);
    const auto error = stranger->receive("error");
    ASSERT_TRUE(error) << header;
    EXPECT_TRUE(error->header["fatal"].get<bool>());
    EXPECT_FALSE(stranger->receive());
  }
  const auto big = daemon_.connect();
  big->send_bytes(encode_frame_start({{"type", "hello"}}, 1000));
  const auto error = big->receive("error");
  ASSERT_TRUE(error);
  EXPECT_EQ(error->header["code"], "limit");
}

TEST_F(DaemonTest, a_render_sends_every_pixel_once_final_and_then_done) {
  configure(1);
  credit(1000);
  start(1);
  std::vector<int> covered(100 * 70);
  for (;;) {
    const auto message = client_->receive();
    ASSERT_TRUE(message);
    if (message->type() == "render_done") {
      EXPECT_EQ(message->header["status"], "finished");
      EXPECT_EQ(message->header["samples"], 2);
      EXPECT_EQ(message->header["epoch"], 1);
      break;
    }
    if (message->type() != "tile" || !message->header["final"].get<bool>()) continue;
    const auto rect = message->header["rect"].get<std::array<int, 4>>();
    EXPECT_EQ(message->header["samples"], 2);
    ASSERT_EQ(message->payload.size(), size_t(rect[2]) * rect[3] * 16);
    for (int y = 0; y < rect[3]; ++y)
      for (int x = 0; x < rect[2]; ++x) {
        float pixel[4];
        std::memcpy(pixel, message->payload.data() + (size_t(y) * rect[2] + x) * 16, 16);
        for (int c = 0; c < 4; ++c) ASSERT_EQ(pixel[c], stand_in_pixel(rect[0] + x, rect[1] + y, c));
        ++covered[(rect[1] + y) * 100 + rect[0] + x];
      }
  }
  for (const int count : covered) ASSERT_EQ(count, 1);
}

TEST_F(DaemonTest, tiles_never_exceed_the_credit_and_done_waits_for_the_last_tile) {
  configure(1, Json::object(), 50);
  start(1);
  ping();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  credit(3);
  int tiles = 0;
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  client_->send({{"type", "ping"}, {"cookie", 1}});
  for (;;) {
    const auto message = client_->receive();
    ASSERT_TRUE(message);
    EXPECT_NE(message->type(), "render_done");
    tiles += message->type() == "tile";
    if (message->type() == "pong") break;
  }
  EXPECT_EQ(tiles, 3);
  credit(1);  // the fourth and last
  const auto last = client_->receive("tile");
  ASSERT_TRUE(last);
  EXPECT_EQ(last->header["samples"], 50);
  EXPECT_TRUE(last->header["final"].get<bool>());
  EXPECT_TRUE(client_->receive("render_done"));
}

TEST_F(DaemonTest, a_client_that_grants_no_credit_is_told_of_the_end_after_10_s_and_may_still_have_its_tiles) {
  configure(1);
  credit(1);
  start(1);
  const auto before = Clock::now();
  int tiles = 0;
  std::vector<Json> ended;
  std::set<Json> final_rectangles;
  const auto receive_until = [&](const auto& enough) {
    while (!enough()) {
      const auto message = client_->receive();
      ASSERT_TRUE(message);
      tiles += message->type() == "tile";
      if (message->type() == "tile" && message->header["final"].get<bool>())
        final_rectangles.insert(message->header["rect"]);
      if (message->type() == "render_done") ended.push_back(message->header);
    }
  };
  receive_until([&] { return ended.size() == 1; });
  ASSERT_EQ(ended.size(), 1u);
  EXPECT_EQ(ended[0]["status"], "finished");
  EXPECT_EQ(ended[0].value("tiles_waiting", false), true);
  EXPECT_EQ(tiles, 1);
  EXPECT_GT(seconds_since(before), 9.5);
  credit(10);
  receive_until([&] { return final_rectangles.size() == 4; });
  configure(2);
  start(2);
  receive_until([&] { return ended.size() == 2; });
  ASSERT_EQ(ended.size(), 2u);
  EXPECT_EQ(ended[1]["epoch"], 2);
  EXPECT_FALSE(ended[1].contains("tiles_waiting"));
}

TEST_F(DaemonTest, only_the_newest_pixels_of_a_tile_are_sent) {
  configure(1, {{"tile_ms", "5"}}, 30);
  start(1);
  int64_t samples = 0;
  while (samples < 5) samples = client_->receive("progress")->header["samples"].get<int64_t>();
  credit(4);
  for (int i = 0; i < 4; ++i) {
    const auto tile = client_->receive("tile");
    ASSERT_TRUE(tile);
    EXPECT_GE(tile->header["samples"].get<int64_t>(), samples);
  }
}

TEST_F(DaemonTest, cancel_acts_within_100_ms_while_building_and_rendering) {
  credit(1000);
  int64_t epoch = 0;
  for (const Json& metadata : {Json{{"build_ms", "60000"}}, Json{{"tile_ms", "20"}}}) {
    configure(++epoch, metadata, 0);
    start(epoch);
    ping();
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    const auto before = Clock::now();
    cancel(epoch);
    const auto done = client_->receive("render_done");
    ASSERT_TRUE(done);
    EXPECT_LT(seconds_since(before), latency_limit_s()) << metadata;
    EXPECT_EQ(done->header["status"], "cancelled");
    EXPECT_EQ(done->header["epoch"], epoch);
  }
}

TEST_F(DaemonTest, once_a_cancel_is_heard_no_tile_comes_before_the_render_has_stopped_and_then_all_do) {
  configure(1, {{"tile_ms", "1"}, {"stop_ms", "300"}}, 0);
  start(1);
  while (client_->receive("progress")->header["samples"].get<int64_t>() < 1) continue;
  cancel(1);  // with all four tiles waiting for credit
  client_->send({{"type", "ping"}, {"cookie", 1}});
  credit(1000);
  std::vector<std::string> types;
  while (types.empty() || types.back() != "render_done") {
    const auto message = client_->receive();
    ASSERT_TRUE(message);
    if (message->type() == "progress") continue;
    types.push_back(message->type());
    if (message->type() == "tile") {
      EXPECT_TRUE(message->header["final"].get<bool>());
    }
    if (message->type() == "render_stopped") {
      EXPECT_EQ(message->header["epoch"], 1);
    }
  }
  EXPECT_EQ(types, (std::vector<std::string>{"pong", "render_stopped", "tile", "tile", "tile", "tile", "render_done"}));
}

TEST_F(DaemonTest, cancel_and_ping_are_answered_at_once_while_a_large_export_is_being_decoded) {
  configure(1);
  Json edits = Json::array();
  description::ArrayCollector collector;
  const Json light = description::encode_edit(description::Upsert{"x", description::Light{}}, collector);
  for (int i = 0; i < 60'000; ++i) {
    edits.push_back(light);
    edits.back()["id"] = std::to_string(i);
  }
  const std::string large = encode_frame_start({{"type", "transaction"}, {"epoch", 2}, {"edits", std::move(edits)}});
  ASSERT_TRUE(client_->send_bytes(large));
  start(2);
  const auto before = Clock::now();
  cancel(2);
  client_->send({{"type", "ping"}, {"cookie", 1}});
  // Both come before the transaction's result: the first from the queue of renders, the second at once.
  const auto first = client_->receive(), second = client_->receive();
  EXPECT_LT(seconds_since(before), latency_limit_s());
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->type(), "render_done");
  EXPECT_EQ(first->header["status"], "cancelled");
  EXPECT_EQ(second->type(), "pong");
  const auto result = client_->receive();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->type(), "transaction_result");
  EXPECT_TRUE(result->header["accepted"].get<bool>());
  ping();  // and the cancelled render says nothing more
}

TEST_F(DaemonTest, a_new_render_supersedes_the_running_one) {
  credit(1000);
  configure(1, {{"tile_ms", "10"}}, 0);
  start(1);
  ping();
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  configure(2);
  start(2);
  const auto old = client_->receive("render_done");
  ASSERT_TRUE(old);
  EXPECT_EQ(old->header["epoch"], 1);
  EXPECT_EQ(old->header["status"], "cancelled");
  for (;;) {
    const auto message = client_->receive();
    ASSERT_TRUE(message);
    if (message->type() == "tile") {
      EXPECT_EQ(message->header["epoch"], 2);
    }
    if (message->type() == "render_done") {
      EXPECT_EQ(message->header["epoch"], 2);
      break;
    }
  }
}

TEST_F(DaemonTest, progress_comes_at_most_ten_times_a_second_with_the_stage) {
  configure(1, {{"build_ms", "500"}, {"tile_ms", "50"}}, 2);
  credit(1000);
  start(1);
  int building = 0, rendering = 0;
  const auto before = Clock::now();
  for (;;) {
    const auto message = client_->receive();
    ASSERT_TRUE(message);
    if (message->type() == "render_done") break;
    if (message->type() != "progress") continue;
    building += message->header["stage"] == "building";
    rendering += message->header["stage"] == "rendering";
    EXPECT_GT(message->header["memory_bytes"].get<uint64_t>(), 0u);
  }
  EXPECT_LE(building + rendering, 1 + seconds_since(before) * 10);
  EXPECT_GE(building, 2);
  EXPECT_GE(rendering, 1);
}

TEST_F(DaemonTest, reports_and_failures_reach_the_client) {
  configure(1, {{"report", "Cube: the file /a.png is missing"}, {"fail", "No camera."}});
  credit(100);
  start(1);
  const auto report = client_->receive("render_report");
  ASSERT_TRUE(report);
  EXPECT_EQ(report->header["messages"][0]["code"], "missing_texture");
  EXPECT_EQ(report->header["messages"][0]["object"], "Cube");
  const auto done = client_->receive("render_done");
  ASSERT_TRUE(done);
  EXPECT_EQ(done->header["status"], "failed");
  EXPECT_EQ(done->header["message"], "No camera.");
}

TEST_F(DaemonTest, an_exception_inside_a_request_is_an_answer_and_the_session_goes_on) {
  configure(1, {{"throw", "a library is unhappy"}});
  start(1);
  const auto error = client_->receive("error");
  ASSERT_TRUE(error);
  EXPECT_EQ(error->header["code"], "internal");
  EXPECT_THAT(error->header["message"].get<std::string>(), HasSubstr("a library is unhappy"));
  EXPECT_FALSE(error->header["fatal"].get<bool>());
  ping();
  configure(2);
  credit(100);
  start(2);
  EXPECT_TRUE(client_->receive("render_done"));
}

TEST_F(DaemonTest, arrays_are_asked_for_only_when_missing_and_kept_while_used) {
  description::ArrayCollector collector;
  Json all = description::encode_transaction(description::full_transaction(), collector);
  all["epoch"] = 1;
  Json hashes = Json::array();
  for (const ArrayPointer& array : collector.arrays()) hashes.push_back(array->hash);
  const auto missing = [&] {
    client_->send({{"type", "arrays_query"}, {"hashes", hashes}});
    return client_->receive("arrays_missing")->header["hashes"].size();
  };
  EXPECT_EQ(missing(), hashes.size());
  client_->send_arrays(collector.arrays());
  EXPECT_EQ(missing(), 0u);
  client_->send(all);
  EXPECT_TRUE(client_->receive("transaction_result")->header["accepted"].get<bool>());
  EXPECT_EQ(missing(), 0u);
  EXPECT_GT(daemon_.used_bytes(), 0u);
  client_->send({{"type", "transaction"}, {"epoch", 2}, {"edits", {{{"op", "clear"}}}}});
  EXPECT_TRUE(client_->receive("transaction_result")->header["accepted"].get<bool>());
  EXPECT_EQ(missing(), hashes.size());
}

TEST_F(DaemonTest, arrays_serve_all_transactions_of_an_epoch) {
  description::ArrayCollector collector;
  const Json all = description::encode_transaction(description::full_transaction(), collector);
  client_->send_arrays(collector.arrays());
  for (const Json& edit : all["edits"]) {
    client_->send({{"type", "transaction"}, {"epoch", 5}, {"edits", Json::array({edit})}});
    const auto result = client_->receive("transaction_result");
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->header["accepted"].get<bool>()) << result->header;
  }
}

TEST_F(DaemonTest, sealed_shared_memory_is_taken_and_unsealed_is_refused) {
  description::ArrayCollector collector;
  Json all = description::encode_transaction(description::full_transaction(), collector);
  ASSERT_TRUE(client_->send_arrays_shared(collector.arrays(), F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE));
  client_->send(all);
  EXPECT_TRUE(client_->receive("transaction_result")->header["accepted"].get<bool>());
  for (const int seals : {0, F_SEAL_SHRINK | F_SEAL_GROW, F_SEAL_WRITE}) {
    const auto client = daemon_.open_session();
    client->send_arrays_shared(collector.arrays(), seals);
    const auto error = client->receive("error");
    ASSERT_TRUE(error);
    EXPECT_THAT(error->header["message"].get<std::string>(), HasSubstr("sealed"));
    EXPECT_FALSE(client->receive());
  }
}

TEST_F(DaemonTest, descriptors_in_the_wrong_place_are_refused) {
  const int pipe_end = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  const auto refused = [&](const std::string& bytes) {
    const auto client = daemon_.open_session();
    client->send_with_descriptor(bytes, pipe_end);
    const auto error = client->receive("error");
    return error ? error->header["message"].get<std::string>() : "no error";
  };
  const Json arrays{{"type", "arrays"}, {"arrays", Json::array()}};
  EXPECT_THAT(refused(encode_frame_start(arrays)), HasSubstr("does not say so"));
  EXPECT_THAT(refused(encode_frame_start(arrays, 10, true)), HasSubstr("sealed"));
  ::close(pipe_end);
  EXPECT_THAT(fatal_error_after(encode_frame_start(arrays, 10, true)), HasSubstr("none came"));
}

TEST_F(DaemonTest, a_sealed_memfd_that_is_too_short_is_refused) {
  description::ArrayCollector collector;
  description::encode_transaction(description::full_transaction(), collector);
  const int memory = ::memfd_create("short", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  ASSERT_EQ(::ftruncate(memory, 16), 0);
  ASSERT_EQ(::fcntl(memory, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE), 0);
  const ArrayLayout layout = lay_out_arrays(collector.arrays());
  client_->send_with_descriptor(
      encode_frame_start({{"type", "arrays"}, {"arrays", layout.descriptors}}, layout.payload_bytes, true), memory);
  ::close(memory);
  const auto error = client_->receive("error");
  ASSERT_TRUE(error);
  EXPECT_THAT(error->header["message"].get<std::string>(), HasSubstr("shorter"));
}

TEST_F(DaemonTest, frames_that_are_not_the_protocol_end_the_connection_with_a_reason) {
  EXPECT_THAT(fatal_error_after("GET / HTTP/1.1\r\nHost: x\r\n\r\n"), HasSubstr("LMBT"));
  EXPECT_THAT(fatal_error_after(encode_frame_start(Json::array())), HasSubstr("malformed"));
  EXPECT_THAT(fatal_error_after(encode_frame_start({{"type", "arrays"}}, uint64_t(1) << 60)), HasSubstr("limit"));
  std::string deep = std::string(100, '[') + std::string(100, ']');
  deep = "{\"type\":\"ping\",\"cookie\":" + deep + "}";
  const auto head = encode_frame_head({false, false, uint32_t(deep.size()), 0});
  EXPECT_THAT(fatal_error_after(std::string(reinterpret_cast<const char*>(head.data()), head.size()) + deep),
              HasSubstr("malformed"));
  ping();  // others do not notice
}

TEST_F(DaemonTest, unknown_and_malformed_messages_are_answered_and_the_connection_stays) {
  for (const Json& header :
       {Json{{"type", "pick"}}, Json{{"type", "render_start"}}, Json{{"type", "render_start"}, {"epoch", -1}},
        Json{{"type", "render_start"}, {"epoch", 9}, {"repeat_tiles", "no"}},
        Json{{"type", "tile_credit"}, {"tiles", "many"}}, Json{{"type", "arrays_query"}, {"hashes", {"x"}}},
        Json{{"type", "arrays"}, {"arrays", {{{"hash", "x"}}}}}, Json{{"type", "ping"}},
        Json{{"type", "save_scene"}, {"path", "relative.lambent"}}, Json{{"type", "hello"}, {"protocol", 1}}}) {
    client_->send(header);
    const auto error = client_->receive("error");
    ASSERT_TRUE(error) << header;
    EXPECT_FALSE(error->header["fatal"].get<bool>());
  }
  ping();
}

TEST_F(DaemonTest, a_refused_transaction_changes_nothing_and_names_the_datablock) {
  Json bad = transaction(1);
  bad["edits"].push_back(
      {{"op", "upsert"}, {"kind", "light"}, {"id", "l"}, {"value", {{"name", "Key"}, {"type", "laser"}}}});
  client_->send(bad);
  const auto result = client_->receive("transaction_result");
  ASSERT_TRUE(result);
  EXPECT_FALSE(result->header["accepted"].get<bool>());
  EXPECT_EQ(result->header["epoch"], 1);
  EXPECT_EQ(result->header["messages"][0]["object"], "Key");
  const std::string path = testing::TempDir() + "lambent_refused.lambent";
  client_->send({{"type", "save_scene"}, {"path", path}});
  ASSERT_TRUE(client_->receive("scene_saved"));
  ::unlink(path.c_str());
}

TEST_F(DaemonTest, epochs_that_go_back_are_refused) {
  configure(5);
  client_->send(transaction(4));
  EXPECT_EQ(client_->receive("error")->header["code"], "epoch");
  credit(100);
  start(5);
  ASSERT_TRUE(client_->receive("render_done"));
  start(5);
  EXPECT_EQ(client_->receive("error")->header["code"], "epoch");
}

TEST_F(DaemonTest, a_client_that_vanishes_frees_everything_even_in_the_middle_of_a_frame_or_a_render) {
  description::ArrayCollector collector;
  const Json all = description::encode_transaction(description::full_transaction(), collector);
  configure(1, {{"tile_ms", "10"}}, 0);
  client_->send_arrays(collector.arrays());
  client_->send(all);
  start(50);
  ping();
  client_->send_bytes(encode_frame_start({{"type", "arrays"}}, 1'000'000) + "some");
  const auto before = Clock::now();
  client_.reset();
  EXPECT_TRUE(daemon_.wait_until_free());
  EXPECT_LT(seconds_since(before), 1.0);
  EXPECT_EQ(daemon_.used_bytes(), 0u);
}

TEST_F(DaemonTest, a_client_that_reads_nothing_is_cut_off_at_the_limit_of_answers) {
  const std::string request = encode_frame_start({{"type", "ping"}, {"cookie", std::string(900, 'x')}});
  std::string many;
  for (int i = 0; i < 100; ++i) many += request;
  bool open = true;
  for (int i = 0; open && i < 3000; ++i) open = client_->send_bytes(many);  // 270 MB
  EXPECT_FALSE(open);
  EXPECT_TRUE(daemon_.open_session());
}

TEST_F(DaemonTest, many_silent_connections_do_not_lock_others_out) {
  std::vector<std::unique_ptr<WireClient>> silent;
  for (int i = 0; i < 300; ++i) silent.push_back(daemon_.connect());
  EXPECT_TRUE(daemon_.open_session());
  ping();
}

TEST_F(DaemonTest, sessions_beyond_the_limit_are_refused_and_leave_room_when_they_end) {
  std::vector<std::unique_ptr<WireClient>> sessions;
  for (int i = 0; i < 63; ++i) {
    sessions.push_back(daemon_.open_session());
    ASSERT_TRUE(sessions.back()) << i;
  }
  EXPECT_FALSE(daemon_.open_session());
  sessions.clear();
  std::unique_ptr<WireClient> next;
  for (int i = 0; i < 100 && !next; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    next = daemon_.open_session();
  }
  EXPECT_TRUE(next);
}

TEST_F(DaemonTest, goodbye_closes_the_connection) {
  client_->send({{"type", "bye"}});
  EXPECT_FALSE(client_->receive());
  EXPECT_TRUE(daemon_.wait_until_free());
}

TEST(DaemonMemory, a_session_over_its_memory_is_refused_before_the_payload_is_read) {
  LocalDaemon daemon(4 << 20);
  const auto client = daemon.open_session();
  const std::vector<float> values(500'000);
  const auto array = make_array(ElementType::f32, {500'000}, values.data());
  client->send_arrays({array});
  client->send({{"type", "arrays_query"}, {"hashes", Json::array()}});
  ASSERT_TRUE(client->receive("arrays_missing"));
  EXPECT_GE(daemon.used_bytes(), 2'000'000u);
  client->send_bytes(encode_frame_start({{"type", "arrays"}, {"arrays", Json::array()}}, 3 << 20));
  const auto error = client->receive("error");
  ASSERT_TRUE(error);
  EXPECT_EQ(error->header["code"], "limit");
  EXPECT_FALSE(client->receive());
  EXPECT_TRUE(daemon.wait_until_free());
  EXPECT_EQ(daemon.used_bytes(), 0u);
}

}  // namespace
}  // namespace lambent
