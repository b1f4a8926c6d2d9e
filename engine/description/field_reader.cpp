#include "engine/description/field_reader.h"

#include <algorithm>
#include <cmath>

#include "engine/description/frame.h"

namespace lambent::description {
namespace {

constexpr size_t k_max_text_bytes = size_t(1) << 20;

std::string describe_form(const ArrayForm& form) {
  std::string text = element_name(form.type);
  for (const auto& [least, most] : form.dimensions) {
    if (most == k_any)
      text += "[N]";
    else if (least == most)
      text += fmt::format("[{}]", least);
    else
      text += fmt::format("[{}..{}]", least, most);
  }
  return text;
}

std::string describe_array(const Array& array) {
  std::string text = element_name(array.type);
  for (const uint64_t size : array.shape) text += fmt::format("[{}]", size);
  return text;
}

bool has_form(const Array& array, const ArrayForm& form) {
  if (array.type != form.type || array.shape.size() != form.dimensions.size()) return false;
  for (size_t i = 0; i < array.shape.size(); ++i)
    if (array.shape[i] < form.dimensions[i].least || array.shape[i] > form.dimensions[i].most) return false;
  return true;
}

}  // namespace

const char* type_of(const Json& json) {
  switch (json.type()) {
    case Json::value_t::object:
      return "an object";
    case Json::value_t::array:
      return "a list";
    case Json::value_t::string:
      return "a string";
    case Json::value_t::boolean:
      return "a boolean";
    case Json::value_t::null:
      return "null";
    default:
      return "a number";
  }
}

bool read_float(const Json& json, float& value) {
  if (!json.is_number()) return false;
  const auto narrow = static_cast<float>(json.get<double>());
  if (!std::isfinite(narrow)) return false;
  value = narrow;
  return true;
}

FieldReader::FieldReader(const Json& json, ReadContext& context, std::string path)
    : json_(json), context_(context), path_(std::move(path)) {}

const Json* FieldReader::find(std::string_view name, bool required) {
  asked_.push_back(name);
  const auto found = json_.find(name);
  if (found != json_.end() && !found->is_null()) return &*found;
  if (required) fail(name, "is missing");
  return nullptr;
}

void FieldReader::finish() {
  if (json_.size() == 0) return;
  for (const auto& [name, value] : json_.items())
    if (std::find(asked_.begin(), asked_.end(), name) == asked_.end())
      context_.warning(path_ + name, "is not known to this version and was ignored");
}

const std::string* FieldReader::find_text(std::string_view name, bool required) {
  const Json* json = find(name, required);
  if (!json) return nullptr;
  if (!json->is_string()) {
    fail(name, fmt::format("is {}, not a string", type_of(*json)));
    return nullptr;
  }
  const auto& text = json->get_ref<const std::string&>();
  if (text.size() <= k_max_text_bytes) return &text;
  fail(name, fmt::format("is a string of {} bytes; the limit is {}", text.size(), k_max_text_bytes));
  return nullptr;
}

const Json* FieldReader::find_list(std::string_view name) {
  const Json* json = find(name);
  if (!json || json->is_array()) return json;
  fail(name, fmt::format("is {}, not a list", type_of(*json)));
  return nullptr;
}

const Json* FieldReader::find_object(std::string_view name, bool required) {
  const Json* json = find(name, required);
  if (!json || json->is_object()) return json;
  fail(name, fmt::format("is {}, not an object", type_of(*json)));
  return nullptr;
}

void FieldReader::text(std::string_view name, std::string& value, bool required) {
  if (const std::string* text = find_text(name, required)) value = *text;
}

void FieldReader::number(std::string_view name, float& value) {
  if (const Json* json = find(name); json && !read_float(*json, value))
    fail(name,
         json->is_number() ? "is too large for a 32-bit number" : fmt::format("is {}, not a number", type_of(*json)));
}

void FieldReader::number(std::string_view name, double& value) {
  const Json* json = find(name);
  if (!json) return;
  if (!json->is_number())
    fail(name, fmt::format("is {}, not a number", type_of(*json)));
  else if (const double wide = json->get<double>(); std::isfinite(wide))
    value = wide;
  else
    fail(name, "is not finite");
}

bool FieldReader::read_integer(std::string_view name, int64_t& value, int64_t least, int64_t most) {
  const Json* json = find(name);
  if (!json) return false;
  bool whole = false, within = false;
  if (json->is_number_unsigned()) {
    const auto wide = json->get<uint64_t>();
    whole = true;
    within = wide <= static_cast<uint64_t>(INT64_MAX);
    if (within) value = static_cast<int64_t>(wide);
  } else if (json->is_number_integer()) {
    value = json->get<int64_t>();
    whole = within = true;
  } else if (json->is_number_float()) {
    const double wide = json->get<double>();
    whole = std::isfinite(wide) && wide == std::floor(wide);
    within = whole && std::fabs(wide) <= 0x1p53;
    if (within) value = static_cast<int64_t>(wide);
  }
  if (!whole) {
    fail(name, fmt::format("is {}, not a whole number", json->is_number() ? "a fraction" : type_of(*json)));
    return false;
  }
  if (!within || value < least || value > most) {
    fail(name, fmt::format("is outside {} to {}", least, most));
    return false;
  }
  return true;
}

void FieldReader::boolean(std::string_view name, bool& value) {
  const Json* json = find(name);
  if (!json) return;
  if (json->is_boolean())
    value = json->get<bool>();
  else
    fail(name, fmt::format("is {}, not a boolean", type_of(*json)));
}

void FieldReader::numbers(std::string_view name, float* values, size_t count, bool required) {
  const Json* json = find(name, required);
  if (!json) return;
  if (!json->is_array() || json->size() != count) {
    fail(name, fmt::format("is not a list of {} numbers", count));
    return;
  }
  for (size_t i = 0; i < count; ++i)
    if (!read_float((*json)[i], values[i]))
      fail(name, fmt::format("holds {} at {}, not a finite 32-bit number", type_of((*json)[i]), i));
}

void FieldReader::pair(std::string_view name, float& first, float& second) {
  float values[2] = {first, second};
  numbers(name, values, 2);
  first = values[0];
  second = values[1];
}

void FieldReader::array(std::string_view name, ArrayPointer& value, const ArrayForm& form, bool required) {
  const Json* json = find(name, required);
  if (!json) return;
  const auto hash = json->is_object() ? json->find("array") : json->end();
  if (!json->is_object() || json->size() != 1 || hash == json->end() || !hash->is_string() ||
      !is_array_hash(hash->get_ref<const std::string&>())) {
    fail(name, R"(is not {"array": "32 hexadecimal digits"})");
    return;
  }
  ArrayPointer found = context_.arrays(hash->get_ref<const std::string&>());
  if (!found)
    fail(name, fmt::format("names the array {}, which was not sent", hash->get_ref<const std::string&>()));
  else if (!has_form(*found, form))
    fail(name, fmt::format("is an array {}, not {}", describe_array(*found), describe_form(form)));
  else
    value = std::move(found);
}

void FieldReader::passes(std::string_view name, std::vector<Pass>& values) {
  const Json* json = find_list(name);
  if (!json) return;
  values.clear();
  for (size_t i = 0; i < json->size(); ++i) {
    const Json& element = (*json)[i];
    const std::string member = fmt::format("{}[{}]", name, i);
    Pass pass;
    if (element.is_string()) {
      pass.name = pass.kind = element.get<std::string>();
    } else if (element.is_object()) {
      read_object(element, path_of(member) + ".", [&](FieldReader& one) {
        one.text("kind", pass.kind, k_required);
        pass.name = pass.kind;
        one.text("name", pass.name);
        const Json* argument = one.find("argument");
        if (!argument) return;
        if (argument->is_string())
          pass.argument = argument->get<std::string>();
        else if (argument->is_number())
          pass.argument = argument->dump();
        else
          one.fail("argument", "is neither a string nor a number");
      });
    } else {
      fail(member, "is neither a kind nor an object");
    }
    if (pass.kind != "combined") values.push_back(std::move(pass));
  }
}

void FieldReader::text_map(std::string_view name, std::map<std::string, std::string>& values) {
  const Json* json = find_object(name);
  if (!json) return;
  for (const auto& [key, element] : json->items()) {
    if (element.is_string())
      values[key] = element.get<std::string>();
    else
      fail(fmt::format("{}.{}", name, key), fmt::format("is {}, not a string", type_of(element)));
  }
}

void FieldReader::number_map(std::string_view name, std::map<std::string, std::array<float, 4>>& values) {
  const Json* json = find_object(name);
  if (!json) return;
  for (const auto& [key, element] : json->items()) {
    std::array<float, 4> numbers{};
    bool good = element.is_array() && element.size() == numbers.size();
    for (size_t i = 0; good && i < numbers.size(); ++i) good = read_float(element[i], numbers[i]);
    if (good)
      values[key] = numbers;
    else
      fail(fmt::format("{}.{}", name, key), "is not a list of 4 finite numbers");
  }
}

void FieldReader::region(std::string_view name, std::optional<std::array<int, 4>>& value) {
  const Json* json = find(name);
  if (!json) return;
  std::array<int, 4> corners{};
  bool whole = json->is_array() && json->size() == 4;
  for (size_t i = 0; whole && i < 4; ++i) {
    const std::optional<uint64_t> corner = whole_number((*json)[i]);
    whole = corner && *corner <= static_cast<uint64_t>(k_max_frame_side_px);
  }
  if (!whole) {
    fail(name, fmt::format("is not a list of 4 whole numbers from 0 to {}", k_max_frame_side_px));
    return;
  }
  for (size_t i = 0; i < 4; ++i) corners[i] = (*json)[i].get<int>();
  if (corners[0] >= corners[2] || corners[1] >= corners[3])
    fail(name, "is empty: it must be [x0, y0, x1, y1] with x0 < x1 and y0 < y1");
  else
    value = corners;
}

void FieldReader::transforms(std::string_view one, std::string_view many, ArrayPointer& value) {
  array(many, value, {ElementType::f32, {{0, k_any}, {3, 3}, {4, 4}}});
  const bool has_many = value != nullptr;
  const Json* single = find(one);
  if (single && has_many) {
    fail(one, fmt::format("is given beside '{}': give one of them", many));
  } else if (single) {
    float rows[12];
    std::fill(std::begin(rows), std::end(rows), 0.0f);
    numbers(one, rows, 12);
    value = make_array(ElementType::f32, {1, 3, 4}, rows);
  } else if (!has_many && !context_.failed) {
    fail(one, fmt::format("is missing (and so is '{}')", many));
  }
}

void FieldReader::texts(std::string_view name, std::vector<std::string>& values) {
  const Json* json = find_list(name);
  if (!json) return;
  for (const Json& element : *json) {
    if (element.is_string())
      values.push_back(element.get<std::string>());
    else
      fail(name, fmt::format("holds {}, not a string", type_of(element)));
  }
}

void FieldReader::slots(std::string_view name, std::vector<std::optional<std::string>>& values) {
  const Json* json = find_list(name);
  if (!json) return;
  if (json->size() > UINT16_MAX) {
    fail(name, fmt::format("has {} slots; the limit is {}", json->size(), UINT16_MAX));
    return;
  }
  for (const Json& element : *json) {
    if (element.is_null())
      values.emplace_back();
    else if (element.is_string())
      values.emplace_back(element.get<std::string>());
    else
      fail(name, fmt::format("holds {}, neither an id nor null", type_of(element)));
  }
}

}  // namespace lambent::description
