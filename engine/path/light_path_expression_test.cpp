#include "engine/path/light_path_expression.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace lambent {
namespace {

const std::vector<std::string> k_groups{"key", "fill"};

/// Events as letters: D G S reflected, d g s transmitted.
EventSequence events_of(const std::string& letters) {
  EventSequence events;
  for (const char c : letters) {
    uint8_t event = c == 'D' || c == 'd'   ? k_scatter_diffuse
                    : c == 'G' || c == 'g' ? k_scatter_glossy
                                           : k_scatter_glossy | k_scatter_delta;
    if (c >= 'a') event |= k_scatter_transmission;
    events.append(event);
  }
  return events;
}

bool matches(const std::string& expression, const std::string& letters, LightSource source = LightSource::lamp,
             uint16_t group = 0) {
  const Result<LightPathExpression> parsed = LightPathExpression::parse(expression, k_groups);
  EXPECT_TRUE(parsed) << expression << ": " << (parsed ? "" : parsed.error());
  return parsed && parsed->matches(events_of(letters), source, group);
}

TEST(LightPathExpression, letters_stand_for_events) {
  EXPECT_TRUE(matches("CL", ""));
  EXPECT_FALSE(matches("CL", "D"));
  EXPECT_TRUE(matches("CDL", "D"));
  EXPECT_TRUE(matches("CDL", "d"));
  EXPECT_TRUE(matches("C<RD>L", "D"));
  EXPECT_FALSE(matches("C<RD>L", "d"));
  EXPECT_TRUE(matches("C<TS>L", "s"));
  EXPECT_FALSE(matches("C<TS>L", "g"));
  EXPECT_TRUE(matches("C<T.>L", "g"));
  EXPECT_TRUE(matches("C<.G>L", "g"));
  EXPECT_FALSE(matches("C<.G>L", "s"));
  EXPECT_TRUE(matches("CTL", "d"));
  EXPECT_FALSE(matches("CTL", "D"));
}

TEST(LightPathExpression, operators_repeat_and_choose) {
  for (const char* path : {"", "D", "dGs", "DDDDDDDDDDDD"}) EXPECT_TRUE(matches("C.*L", path)) << path;
  EXPECT_TRUE(matches("CD[GS]+L", "DGs"));
  EXPECT_FALSE(matches("CD[GS]+L", "D"));
  EXPECT_FALSE(matches("CD[GS]+L", "DGD"));
  EXPECT_TRUE(matches("C[^D]*L", "Gs"));
  EXPECT_FALSE(matches("C[^D]*L", "GD"));
  EXPECT_TRUE(matches("CD?L", ""));
  EXPECT_TRUE(matches("C(D|GG)L", "GG"));
  EXPECT_FALSE(matches("C(D|GG)L", "G"));
  EXPECT_TRUE(matches("C.{2}L", "DG"));
  EXPECT_FALSE(matches("C.{2}L", "D"));
  EXPECT_TRUE(matches("C(DG){1,2}L", "DGDG"));
  EXPECT_FALSE(matches("C(DG){1,2}L", "DGDGDG"));
  EXPECT_TRUE(matches("CD{0,2}L", ""));
  EXPECT_TRUE(matches("C(D+G)*L", "DDGDG"));
  EXPECT_FALSE(matches("C(D+G)*L", "DDGD"));
}

TEST(LightPathExpression, lights_by_kind_and_group) {
  for (const LightSource source : {LightSource::lamp, LightSource::surface, LightSource::background})
    EXPECT_TRUE(matches("C.*L", "D", source));
  EXPECT_TRUE(matches("C.*B", "D", LightSource::background));
  EXPECT_FALSE(matches("C.*B", "D", LightSource::lamp));
  EXPECT_TRUE(matches("C.*O", "D", LightSource::surface));
  EXPECT_FALSE(matches("C.*O", "D", LightSource::background));
  EXPECT_TRUE(matches("C.*<L.'key'>", "D", LightSource::lamp, 1));
  EXPECT_FALSE(matches("C.*<L.'key'>", "D", LightSource::lamp, 2));
  EXPECT_FALSE(matches("C.*<L.'key'>", "D", LightSource::lamp, 0));
  EXPECT_TRUE(matches("C.*<L.'fill'>", "D", LightSource::lamp, 2));
  EXPECT_FALSE(matches("C.*<L.'no such group'>", "D", LightSource::lamp, 2));
}

TEST(LightPathExpression, what_is_wrong_is_said_with_its_place) {
  const auto error = [](const std::string& text) {
    const Result<LightPathExpression> parsed = LightPathExpression::parse(text, k_groups);
    return parsed ? std::string("none") : parsed.error();
  };
  EXPECT_EQ(error("C.*X"), "character 4, 'X': one of . C R T D G S L O B < ( [ is expected");
  EXPECT_EQ(error("C(DL"), "at its end: a ')' is expected");
  EXPECT_EQ(error("C[DL"), "at its end: a ']' is expected");
  EXPECT_EQ(error("C<RDL"), "character 5, 'L': a '>' is expected");
  EXPECT_EQ(error("C<L.'key>"), "at its end: a closing quote is expected");
  EXPECT_EQ(error("CD)L"), "character 3, ')': is not expected here");
  EXPECT_EQ(error(""), "at its end: the expression is empty");
  EXPECT_NE(error("CD{3,2}L").find("repeats"), std::string::npos);
  EXPECT_NE(error("CD{1,1000}L").find("repeats"), std::string::npos);
  EXPECT_NE(error("C" + std::string(200, 'D')).find("more than 128 symbols"), std::string::npos);
  EXPECT_NE(error("C((D{60}){60})L").find("more than 128 symbols"), std::string::npos);
  EXPECT_EQ(error("C*"), "none");  // takes no path, which is not wrong
}

}  // namespace
}  // namespace lambent
