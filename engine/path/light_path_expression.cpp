#include "engine/path/light_path_expression.h"

#include <fmt/format.h>

#include <algorithm>

namespace lambent {

namespace {

// Bits of Symbol::takes, one for everything that a path can be written with.
constexpr uint16_t k_symbol_camera = 1;
constexpr uint16_t k_symbol_events = 0b1111110;  // reflected D G S, transmitted D G S
constexpr uint16_t k_symbol_reflected = 0b1110, k_symbol_transmitted = 0b1110000;
constexpr uint16_t k_symbol_diffuse = 0b10010, k_symbol_glossy = 0b100100, k_symbol_singular = 0b1001000;
constexpr uint16_t k_symbol_lamp = 1 << 7, k_symbol_surface = 1 << 8, k_symbol_background = 1 << 9;
constexpr uint16_t k_symbol_lights = k_symbol_lamp | k_symbol_surface | k_symbol_background;
constexpr uint16_t k_symbol_any = (1 << 10) - 1;

uint16_t symbol_of_event(uint8_t event) {
  const uint16_t scattering = event & k_scatter_delta     ? k_symbol_singular
                              : event & k_scatter_diffuse ? k_symbol_diffuse
                                                          : k_symbol_glossy;
  return scattering & (event & k_scatter_transmission ? k_symbol_transmitted : k_symbol_reflected);
}

uint16_t symbol_of_source(LightSource source) {
  return source == LightSource::lamp      ? k_symbol_lamp
         : source == LightSource::surface ? k_symbol_surface
                                          : k_symbol_background;
}

constexpr int k_most_repeats = 64;

}  // namespace

/// Recursive descent over the text; builds the automaton's sets on the way.
class LightPathParser {
 public:
  LightPathParser(std::string_view text, std::span<const std::string> groups) : text_(text), groups_(groups) {}

  Result<LightPathExpression> parse() {
    Part whole = alternatives();
    if (error_.empty() && at_ < text_.size()) fail("is not expected here");
    if (error_.empty() && whole.first.none()) fail("the expression is empty");
    if (!error_.empty()) return Error{error_};
    made_.first_ = whole.first;
    made_.last_ = whole.last;
    return made_;
  }

 private:
  using Positions = LightPathExpression::Positions;
  struct Part {
    bool nullable = true;
    Positions first, last;
  };

  char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  bool take(char c) {
    if (peek() != c || at_ >= text_.size()) return false;
    ++at_;
    return true;
  }
  void fail(const std::string& what) {
    if (!error_.empty()) return;
    error_ = at_ < text_.size() ? fmt::format("character {}, '{}': {}", at_ + 1, text_[at_], what)
                                : fmt::format("at its end: {}", what);
  }

  Part alternatives() {
    Part result = sequence();
    while (error_.empty() && take('|')) {
      const Part other = sequence();
      result.nullable = result.nullable || other.nullable;
      result.first |= other.first;
      result.last |= other.last;
    }
    return result;
  }

  Part sequence() {
    Part result;
    while (error_.empty() && at_ < text_.size() && peek() != '|' && peek() != ')') result = joined(result, repeated());
    return result;
  }

  Part joined(const Part& a, const Part& b) {
    link(a.last, b.first);
    Part result;
    result.nullable = a.nullable && b.nullable;
    result.first = a.nullable ? a.first | b.first : a.first;
    result.last = b.nullable ? a.last | b.last : b.last;
    return result;
  }
  void link(const Positions& from, const Positions& to) {
    for (size_t i = 0; i < made_.symbols_.size(); ++i)
      if (from[i]) made_.follow_[i] |= to;
  }

  Part repeated() {
    const size_t begin = at_;
    Part part = atom();
    while (error_.empty()) {
      if (take('*')) {
        link(part.last, part.first);
        part.nullable = true;
      } else if (take('+')) {
        link(part.last, part.first);
      } else if (take('?')) {
        part.nullable = true;
      } else if (peek() == '{') {
        part = counted(begin, at_, part);
      } else {
        break;
      }
    }
    return part;
  }

  /// {n} or {n,m}: the text of what is repeated is read again for each further copy.
  Part counted(size_t begin, size_t end, const Part& once) {
    ++at_;
    const int least = integer();
    const int most = take(',') ? integer() : least;
    if (error_.empty() && !take('}')) fail("a '}' is expected");
    if (error_.empty() && (most < least || most < 1 || most > k_most_repeats))
      fail(fmt::format("the repeats before are not 1 to {}", k_most_repeats));
    const size_t after = at_;
    Part result = once;
    if (least == 0) result.nullable = true;
    for (int i = 1; i < most && error_.empty(); ++i) {
      LightPathParser copy(text_.substr(0, end), groups_);
      copy.at_ = begin;
      std::swap(copy.made_, made_);
      Part next = copy.repeated();
      std::swap(copy.made_, made_);
      error_ = copy.error_;
      if (i >= least) next.nullable = true;
      result = joined(result, next);
    }
    at_ = after;
    return result;
  }

  int integer() {
    int value = 0;
    const size_t begin = at_;
    while (peek() >= '0' && peek() <= '9') value = std::min(10 * value + (text_[at_++] - '0'), k_most_repeats + 1);
    if (at_ == begin) fail("a number is expected");
    return value;
  }

  Part atom() {
    if (take('(')) {
      const Part part = alternatives();
      if (error_.empty() && !take(')')) fail("a ')' is expected");
      return part;
    }
    LightPathExpression::Symbol symbol;
    if (take('[')) {
      const bool inverted = take('^');
      while (error_.empty() && !take(']')) {
        if (at_ >= text_.size()) fail("a ']' is expected");
        if (error_.empty()) symbol.takes |= letter_or_event().takes;
      }
      if (inverted) symbol.takes = static_cast<uint16_t>(k_symbol_any & ~symbol.takes);
    } else {
      symbol = letter_or_event();
    }
    if (made_.symbols_.size() >= LightPathExpression::k_most_symbols)
      fail(fmt::format("there are more than {} symbols", LightPathExpression::k_most_symbols));
    if (!error_.empty()) return {};
    Part part;
    part.nullable = false;
    part.first[made_.symbols_.size()] = part.last[made_.symbols_.size()] = true;
    made_.symbols_.push_back(symbol);
    made_.follow_.emplace_back();
    return part;
  }

  LightPathExpression::Symbol letter_or_event() {
    LightPathExpression::Symbol symbol;
    if (!take('<')) {
      symbol.takes = letter();
      return symbol;
    }
    symbol.takes = letter();
    if (!(symbol.takes & k_symbol_lights) || symbol.takes == k_symbol_any) {
      if (symbol.takes == k_symbol_any) symbol.takes = k_symbol_events;
      const uint16_t scattering = letter();
      symbol.takes &= scattering;
    } else {
      take('.');  // lights have no kind of scattering
    }
    if (take('\'')) {
      const size_t begin = at_;
      while (at_ < text_.size() && peek() != '\'') ++at_;
      const std::string_view name = text_.substr(begin, at_ - begin);
      if (!take('\'')) fail("a closing quote is expected");
      const auto found = std::find(groups_.begin(), groups_.end(), name);
      symbol.label = static_cast<uint32_t>(found - groups_.begin()) + 1;  // an unknown group: a number that none has
    }
    if (error_.empty() && !take('>')) fail("a '>' is expected");
    return symbol;
  }

  uint16_t letter() {
    const char c = peek();
    const uint16_t takes = c == '.'   ? k_symbol_any
                           : c == 'C' ? k_symbol_camera
                           : c == 'R' ? k_symbol_reflected
                           : c == 'T' ? k_symbol_transmitted
                           : c == 'D' ? k_symbol_diffuse
                           : c == 'G' ? k_symbol_glossy
                           : c == 'S' ? k_symbol_singular
                           : c == 'L' ? k_symbol_lights
                           : c == 'O' ? k_symbol_surface
                           : c == 'B' ? k_symbol_background
                                      : 0;
    if (takes == 0)
      fail("one of . C R T D G S L O B < ( [ is expected");
    else
      ++at_;
    return takes;
  }

  std::string_view text_;
  std::span<const std::string> groups_;
  size_t at_ = 0;
  std::string error_;
  LightPathExpression made_;
};

Result<LightPathExpression> LightPathExpression::parse(std::string_view text, std::span<const std::string> groups) {
  return LightPathParser(text, groups).parse();
}

LightPathExpression::Positions LightPathExpression::step(const Positions& from, uint16_t what, uint16_t group) const {
  Positions to;
  for (size_t i = 0; i < symbols_.size(); ++i)
    if (from[i] && symbols_[i].takes & what && (symbols_[i].label == ~0u || symbols_[i].label == group)) to[i] = true;
  return to;
}

bool LightPathExpression::matches(const EventSequence& events, LightSource source, uint16_t group) const {
  const auto following = [&](const Positions& at) {
    Positions result;
    for (size_t i = 0; i < symbols_.size(); ++i)
      if (at[i]) result |= follow_[i];
    return result;
  };
  Positions at = step(first_, k_symbol_camera, 0);
  for (int i = 0; i < events.count && at.any(); ++i) at = step(following(at), symbol_of_event(events[i]), 0);
  if (at.none()) return false;
  return (step(following(at), symbol_of_source(source), group) & last_).any();
}

}  // namespace lambent
