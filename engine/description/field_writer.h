// The visitor of fields.h that writes JSON. Every member is written; absent arrays and groups are left out.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/description/fields.h"
#include "engine/description/json_codec.h"

namespace lambent::description {

Json encode_graph(const Graph& graph);

/// Writes the members of one value into a JSON object.
class FieldWriter {
 public:
  FieldWriter(Json& json, ArrayCollector& arrays) : json_(json), arrays_(arrays) { json_ = Json::object(); }

  void text(std::string_view name, const std::string& value, bool = false) { set(name) = value; }
  template <typename T>
  void number(std::string_view name, T value) {
    set(name) = value;
  }
  template <typename T>
  void integer(std::string_view name, T value, int64_t, int64_t) {
    set(name) = value;
  }
  void boolean(std::string_view name, bool value) { set(name) = value; }
  void numbers(std::string_view name, const float* values, size_t count, bool = false) {
    set(name) = std::vector<float>(values, values + count);
  }
  void pair(std::string_view name, float first, float second) { set(name) = Json::array({first, second}); }
  void array(std::string_view name, const ArrayPointer& value, const ArrayForm&, bool = false) {
    if (!value) return;
    arrays_.add(value);
    set(name) = {{"array", value->hash}};
  }
  void passes(std::string_view name, const std::vector<Pass>& values) {
    Json& list = set(name) = Json::array({"combined"});
    for (const Pass& pass : values)
      list.push_back({{"name", pass.name}, {"kind", pass.kind}, {"argument", pass.argument}});
  }
  void texts(std::string_view name, const std::vector<std::string>& values) { set(name) = values; }
  void text_map(std::string_view name, const std::map<std::string, std::string>& values) { set(name) = values; }
  void number_map(std::string_view name, const std::map<std::string, std::array<float, 4>>& values) {
    set(name) = values;
  }
  void region(std::string_view name, const std::optional<std::array<int, 4>>& value) {
    if (value) set(name) = *value;
  }
  void transforms(std::string_view, std::string_view many, const ArrayPointer& value) { array(many, value, {}); }
  void slots(std::string_view name, const std::vector<std::optional<std::string>>& values) {
    Json& list = set(name) = Json::array();
    for (const auto& value : values) list.push_back(value ? Json(*value) : Json());
  }
  void graph(std::string_view name, const Graph& value) { set(name) = encode_graph(value); }
  void optional_graph(std::string_view name, const std::optional<Graph>& value) {
    if (value) set(name) = encode_graph(*value);
  }

  template <typename T, size_t N>
  void choice(std::string_view name, T value, const Choice<T> (&choices)[N], bool = false) {
    for (const auto& [choice_name, choice_value] : choices)
      if (choice_value == value) set(name) = choice_name;
  }
  template <typename F>
  void group(std::string_view name, F&& visit) {
    FieldWriter writer(set(name), arrays_);
    visit(writer);
  }
  template <typename F>
  void group_if(std::string_view name, bool present, F&& visit) {
    if (present) group(name, visit);
  }
  template <typename T, typename F>
  void optional_group(std::string_view name, const std::optional<T>& value, F&& visit) {
    if (value) group(name, [&](FieldWriter& writer) { visit(writer, *value); });
  }
  template <typename T, typename F>
  void objects(std::string_view name, const std::vector<T>& values, F&& visit) {
    Json& list = set(name) = Json::array();
    for (const T& value : values) {
      FieldWriter writer(list.emplace_back(), arrays_);
      visit(writer, value);
    }
  }

 private:
  Json& set(std::string_view name) { return json_[std::string(name)]; }

  Json& json_;
  ArrayCollector& arrays_;
};

}  // namespace lambent::description
