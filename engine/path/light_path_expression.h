// Light path expressions: which paths a pass takes, in the notation of OSL.
//
//   C<RD>.*L       what is first reflected by a diffuse surface
//   CD[GS]+L       caustics that the camera sees directly
//   C.*<L.'key'>   light of the group "key"
//
// A path is written from the camera: C, one event a scattering, the light. An event is <type scattering>: type R or T
// (reflected, transmitted), scattering D, G or S (diffuse, glossy, singular: mirrors and smooth glass); `.` is any. One
// letter alone leaves the other open: D is <.D>. L is any light, B the background, O an emissive surface; a light may
// carry the label of its group. Operators: juxtaposition, |, *, +, ?, {n}, {n,m}, (...), [...] and [^...].
#pragma once

#include <bitset>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/result.h"
#include "engine/lights/light.h"
#include "engine/path/event_counts.h"

namespace lambent {

/// A compiled expression: a position automaton (Glushkov 1961), so that matching is a few operations an event.
class LightPathExpression {
 public:
  static constexpr size_t k_most_symbols = 128;

  /// Error: says what is wrong at which character.
  /// @param groups names of the light groups, numbered from 1
  static Result<LightPathExpression> parse(std::string_view text, std::span<const std::string> groups);

  /// @param group number of the light's group; 0: in none
  bool matches(const EventSequence& events, LightSource source, uint16_t group) const;

 private:
  friend class LightPathParser;
  using Positions = std::bitset<k_most_symbols>;
  /// What one symbol of the expression takes.
  struct Symbol {
    uint16_t takes = 0;    ///< bits of k_symbol_*
    uint32_t label = ~0u;  ///< number of the group; ~0: any
  };
  Positions step(const Positions& from, uint16_t what, uint16_t group) const;

  std::vector<Symbol> symbols_;
  std::vector<Positions> follow_;  ///< by symbol
  Positions first_, last_;
};

}  // namespace lambent
