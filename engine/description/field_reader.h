// The visitor of fields.h that reads JSON: it checks types, ranges and arrays, and reports what is wrong by name.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/description/fields.h"
#include "engine/description/json_codec.h"

namespace lambent::description {

/// Shared by the readers of one datablock: where findings go and whose they are.
struct ReadContext {
  const ArrayResolver& arrays;
  Report& report;
  std::string datablock;  ///< `light 'Key'`: starts every message
  std::string object;     ///< the user's name, for Message::object
  bool failed = false;

  void error(const std::string& member, const std::string& problem) {
    failed = true;
    report.error("malformed", object, fmt::format("{}: '{}' {}.", datablock, member, problem));
  }
  void warning(const std::string& member, const std::string& problem) {
    report.warning("unknown_member", object, fmt::format("{}: '{}' {}.", datablock, member, problem));
  }
};

/// Reads the members of one JSON object. Call finish() at the end to report members that nobody asked for.
class FieldReader {
 public:
  /// `path` is the member that holds `json` ("depth_of_field."), empty for the datablock itself.
  FieldReader(const Json& json, ReadContext& context, std::string path = {});

  /// The member, or null if it is absent or null (which is an error if it is required).
  const Json* find(std::string_view name, bool required = false);
  /// Warns of members that were not asked for.
  void finish();
  void fail(std::string_view name, const std::string& problem) { context_.error(path_ + std::string(name), problem); }
  ReadContext& context() { return context_; }
  std::string path_of(std::string_view name) const { return path_ + std::string(name); }

  void text(std::string_view name, std::string& value, bool required = false);
  void number(std::string_view name, float& value);
  void number(std::string_view name, double& value);
  void boolean(std::string_view name, bool& value);
  void numbers(std::string_view name, float* values, size_t count, bool required = false);
  void array(std::string_view name, ArrayPointer& value, const ArrayForm& form, bool required = false);
  void passes(std::string_view name, std::vector<Pass>& values);
  void texts(std::string_view name, std::vector<std::string>& values);
  void text_map(std::string_view name, std::map<std::string, std::string>& values);
  void number_map(std::string_view name, std::map<std::string, std::array<float, 4>>& values);
  void pair(std::string_view name, float& first, float& second);
  void region(std::string_view name, std::optional<std::array<int, 4>>& value);
  void transforms(std::string_view one, std::string_view many, ArrayPointer& value);
  void slots(std::string_view name, std::vector<std::optional<std::string>>& values);
  void graph(std::string_view name, Graph& value);
  void optional_graph(std::string_view name, std::optional<Graph>& value);

  template <typename T>
  void integer(std::string_view name, T& value, int64_t least, int64_t most) {
    int64_t wide = 0;
    if (read_integer(name, wide, least, most)) value = static_cast<T>(wide);
  }

  template <typename T, size_t N>
  void choice(std::string_view name, T& value, const Choice<T> (&choices)[N], bool required = false) {
    const std::string* given = find_text(name, required);
    if (!given) return;
    std::string known;
    for (const auto& [choice_name, choice_value] : choices) {
      if (*given == choice_name) {
        value = choice_value;
        return;
      }
      known += fmt::format(" {}", choice_name);
    }
    fail(name, fmt::format("is '{}', not one of{}", *given, known));
  }

  template <typename F>
  void group(std::string_view name, F&& visit) {
    if (const Json* json = find_object(name)) read_object(*json, path_of(name) + ".", visit);
  }
  template <typename F>
  void group_if(std::string_view name, bool, F&& visit) {
    group(name, visit);
  }
  template <typename T, typename F>
  void optional_group(std::string_view name, std::optional<T>& value, F&& visit) {
    const Json* json = find_object(name);
    if (!json) return;
    value.emplace();
    read_object(*json, path_of(name) + ".", [&](FieldReader& reader) { visit(reader, *value); });
  }
  template <typename T, typename F>
  void objects(std::string_view name, std::vector<T>& values, F&& visit) {
    const Json* json = find_list(name);
    if (!json) return;
    for (const Json& element : *json) {
      const std::string path = fmt::format("{}[{}]", path_of(name), values.size());
      T& value = values.emplace_back();
      if (element.is_object())
        read_object(element, path + ".", [&](FieldReader& reader) { visit(reader, value); });
      else
        context_.error(path, "is not an object");
    }
  }

  const std::string* find_text(std::string_view name, bool required = false);
  const Json* find_list(std::string_view name);
  const Json* find_object(std::string_view name, bool required = false);

  template <typename F>
  void read_object(const Json& json, std::string path, F&& visit) {
    FieldReader reader(json, context_, std::move(path));
    visit(reader);
    reader.finish();
  }

 private:
  bool read_integer(std::string_view name, int64_t& value, int64_t least, int64_t most);

  const Json& json_;
  ReadContext& context_;
  std::string path_;
  std::vector<std::string_view> asked_;  ///< names are literals
};

/// A number that is finite as a float; reports and returns false otherwise.
bool read_float(const Json& json, float& value);

/// "a number", "a list"...: for messages.
const char* type_of(const Json& json);

}  // namespace lambent::description
