#include "engine/description/frame.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

namespace lambent {
namespace {

using testing::HasSubstr;

FrameLimits open_limits() {
  FrameLimits limits;
  limits.payload_in_fd = limits.payload_zstd = true;
  return limits;
}

std::string why_refused(std::array<std::byte, k_frame_head_bytes> bytes, const FrameLimits& limits) {
  FrameHead head;
  FrameError error;
  return decode_frame_head(bytes, limits, head, error) ? "accepted"
                                                       : (error.over_limit ? "limit: " : "") + error.message;
}

TEST(Frame, heads_survive_the_round_trip) {
  for (const FrameHead head : {FrameHead{false, false, 2, 0}, FrameHead{true, false, 64 << 20, uint64_t(1) << 40},
                               FrameHead{false, true, 77, 123456789}}) {
    FrameHead decoded;
    FrameError error;
    ASSERT_TRUE(decode_frame_head(encode_frame_head(head), open_limits(), decoded, error)) << error.message;
    EXPECT_EQ(decoded, head);
  }
}

TEST(Frame, heads_that_are_wrong_or_over_a_limit_are_refused) {
  const auto good = encode_frame_head({false, false, 10, 20});
  EXPECT_EQ(why_refused(good, {}), "accepted");
  const auto with = [&](size_t at, unsigned char value) {
    auto bytes = good;
    bytes[at] = std::byte{value};
    return bytes;
  };
  EXPECT_THAT(why_refused(with(0, 'X'), {}), HasSubstr("LMBT"));
  EXPECT_THAT(why_refused(with(4, 2), {}), HasSubstr("framing version 2"));
  EXPECT_THAT(why_refused(with(6, 4), {}), HasSubstr("unknown flags"));
  EXPECT_THAT(why_refused(with(7, 0x80), {}), HasSubstr("unknown flags"));
  EXPECT_THAT(why_refused(with(6, 1), {}), HasSubstr("file descriptor"));
  EXPECT_THAT(why_refused(with(6, 2), {}), HasSubstr("compressed"));
  EXPECT_THAT(why_refused(with(12, 1), {}), HasSubstr("reserved"));
  EXPECT_THAT(why_refused(with(8, 1), {}), HasSubstr("no JSON header"));
  EXPECT_THAT(why_refused(with(11, 0xff), {}), HasSubstr("limit: "));
  EXPECT_THAT(why_refused(with(23, 0xff), {}), HasSubstr("limit: "));
}

TEST(Frame, headers_must_be_objects_with_a_type_in_utf8) {
  EXPECT_TRUE(decode_frame_header(R"({"type":"ping"})"));
  for (const char* text : {"", "{}", "[]", "1", "\"type\"", R"({"type":1})", R"({"type":"a")", "{\"type\":\"\xff\"}",
                           R"({"type":"a","x":1e999})", R"({"type":"a","x":NaN})", R"({"type":"\ud800"})"})
    EXPECT_FALSE(decode_frame_header(text)) << text;
}

TEST(Frame, deep_and_crowded_json_is_refused_before_it_is_parsed) {
  const auto nested = [](size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  EXPECT_TRUE(parse_json(nested(64)));
  EXPECT_FALSE(parse_json(nested(65)));
  EXPECT_FALSE(parse_json(std::string(10'000'000, '[')));
  EXPECT_TRUE(parse_json("\"" + std::string(100, '[') + "\""));
  EXPECT_TRUE(parse_json(R"(["\"[[[[",1])"));
  EXPECT_FALSE(parse_json("[1,2,3,4]", {64, 4}));
  EXPECT_TRUE(parse_json("[1,2,3,4]", {64, 5}));
}

TEST(Frame, parsing_ends_early_when_its_value_is_abandoned) {
  std::string text = "[0";
  for (int i = 0; i < 1000000; ++i) text += ",1";
  text += "]";
  std::atomic<bool> abandoned{false};
  JsonLimits limits;
  limits.abandoned = &abandoned;
  const Result<Json> whole = parse_json(text, limits);
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->size(), 1000001u);
  abandoned = true;
  EXPECT_FALSE(parse_json(text, limits));
}

TEST(Frame, text_that_is_not_utf8_is_written_with_replacements) {
  EXPECT_EQ(json_text({{"name", "a\xff"}}), "{\"name\":\"a\xef\xbf\xbd\"}");
}

TEST(Array, hashes_are_those_of_the_protocol) {
  // python3: hashlib.sha256(b"f32:2x3:" + numpy.arange(6, dtype="<f4").tobytes()).hexdigest()[:32]
  const float values[] = {0, 1, 2, 3, 4, 5};
  EXPECT_EQ(make_array(ElementType::f32, {2, 3}, values)->hash, "251cc973896805c8685a2fb00c796004");
  EXPECT_EQ(array_hash(ElementType::u8, std::vector<uint64_t>{0}, nullptr), "128583afa5fd3a18b548513f9ef44f80");
}

struct Packed {
  Json header;
  Payload payload;
  std::vector<ArrayPointer> arrays;
};

Packed packed() {
  const float values[] = {0, 1, 2, 3, 4, 5};
  const uint8_t bytes[] = {1, 2, 3};
  Packed result;
  result.arrays = {make_array(ElementType::u8, {3}, bytes), make_array(ElementType::f32, {2, 3}, values),
                   make_array(ElementType::u32, {0, 3}, values)};
  result.header = {{"type", "arrays"}, {"arrays", lay_out_arrays(result.arrays).descriptors}};
  auto memory = std::make_shared<std::vector<std::byte>>(gather_payload(result.arrays));
  result.payload = {memory, *memory};
  return result;
}

TEST(Arrays, survive_the_round_trip_through_a_payload) {
  const Packed sent = packed();
  EXPECT_EQ(lay_out_arrays(sent.arrays).payload_bytes, sent.payload.bytes.size());
  const auto got = decode_arrays(sent.header, sent.payload);
  ASSERT_TRUE(got) << got.error();
  ASSERT_EQ(got->size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ((*got)[i]->shape, sent.arrays[i]->shape);
    EXPECT_EQ((*got)[i]->hash, sent.arrays[i]->hash);
  }
  EXPECT_EQ((*got)[1]->as<float>()[5], 5.0f);
}

TEST(Arrays, descriptors_that_lie_are_refused) {
  const auto refused = [](const char* member, const Json& value) {
    Packed sent = packed();
    sent.header["arrays"][1][member] = value;
    const auto got = decode_arrays(sent.header, sent.payload);
    return got ? std::string("accepted") : got.error();
  };
  EXPECT_THAT(refused("dtype", "f64"), HasSubstr("dtype"));
  EXPECT_THAT(refused("dtype", "u32"), HasSubstr("content has the hash"));
  EXPECT_THAT(refused("hash", std::string(32, '0')), HasSubstr("content has the hash"));
  EXPECT_THAT(refused("hash", "E2"), HasSubstr("hexadecimal"));
  EXPECT_THAT(refused("offset", 8), HasSubstr("multiple of 16"));
  EXPECT_THAT(refused("offset", 48), HasSubstr("do not fit"));
  EXPECT_THAT(refused("offset", uint64_t(0xfffffffffffffff0)), HasSubstr("do not fit"));
  EXPECT_THAT(refused("offset", -16), HasSubstr("multiple of 16"));
  EXPECT_THAT(refused("shape", Json::array({2, -3})), HasSubstr("whole number"));
  EXPECT_THAT(refused("shape", Json::array()), HasSubstr("'shape'"));
  EXPECT_THAT(refused("shape", Json::array({1, 1, 1, 1, 6})), HasSubstr("'shape'"));
  EXPECT_THAT(refused("shape", Json::array({uint64_t(1) << 33, uint64_t(1) << 33})), HasSubstr("elements"));
  EXPECT_THAT(refused("shape", Json::array({uint64_t(1) << 32, uint64_t(1) << 32, 0})), HasSubstr("elements"));
  EXPECT_THAT(refused("shape", Json::array({1 << 30})), HasSubstr("do not fit"));
}

TEST(Arrays, overlapping_descriptors_cannot_multiply_the_work) {
  Packed sent = packed();
  for (int i = 0; i < 10; ++i) sent.header["arrays"].push_back(sent.header["arrays"][1]);
  const auto got = decode_arrays(sent.header, sent.payload);
  ASSERT_FALSE(got);
  EXPECT_THAT(got.error(), HasSubstr("overlap"));
}

TEST(Arrays, damaged_content_is_noticed) {
  Packed sent = packed();
  auto memory = std::make_shared<std::vector<std::byte>>(gather_payload(sent.arrays));
  (*memory)[17] ^= std::byte{1};
  EXPECT_FALSE(decode_arrays(sent.header, {memory, *memory}));
}

}  // namespace
}  // namespace lambent
