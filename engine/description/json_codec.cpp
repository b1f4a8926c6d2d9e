#include "engine/description/json_codec.h"

#include <fmt/format.h>

#include "engine/description/field_reader.h"
#include "engine/description/field_writer.h"

namespace lambent::description {
namespace {

constexpr size_t k_max_id_bytes = 4096;

std::optional<Kind> kind_of(const std::string& name) {
  for (const auto& [kind_name, kind] : k_kinds)
    if (name == kind_name) return kind;
  return std::nullopt;
}

/// Rules that concern several members of a value.
template <typename T>
void check_whole(FieldReader& reader, const T& value, const DecodeLimits& limits) {
  if constexpr (std::is_same_v<T, Image>) {
    if (int(!value.path.empty()) + int(value.encoded != nullptr) + int(value.pixels != nullptr) > 1)
      reader.fail("path", "is given beside 'encoded' or 'pixels': an image has one of them");
  }
  if constexpr (std::is_same_v<T, Object>) {
    if (value.mesh.empty() == value.light.empty())
      reader.fail("mesh", "or 'light' must name what the object shows, not both");
    if (value.random_ids && value.transforms && value.random_ids->rows() != value.transforms->rows())
      reader.fail("random_ids",
                  fmt::format("has {} values for {} instances", value.random_ids->rows(), value.transforms->rows()));
    if (value.particles && value.transforms && value.particles->rows() != value.transforms->rows())
      reader.fail("particles",
                  fmt::format("has {} rows for {} instances", value.particles->rows(), value.transforms->rows()));
  }
  if constexpr (std::is_same_v<T, Settings>) {
    if (int64_t(value.width) * value.height > limits.pixels)
      reader.fail("width", fmt::format("x 'height' is {} x {} pixels; the limit is {} pixels", value.width,
                                       value.height, limits.pixels));
    if (value.region && ((*value.region)[2] > value.width || (*value.region)[3] > value.height))
      reader.fail("region", fmt::format("reaches outside the frame of {} x {} pixels", value.width, value.height));
    if (value.time_limit_s < 0) reader.fail("time_limit_s", "is negative");
    if (value.noise_threshold < 0) reader.fail("noise_threshold", "is negative");
  }
}

template <typename T>
std::optional<Value> read_value(const Json& json, ReadContext& context, const DecodeLimits& limits) {
  T value;
  FieldReader reader(json, context);
  visit_fields(reader, value);
  check_whole(reader, value, limits);
  reader.finish();
  if (context.failed) return std::nullopt;
  return Value(std::move(value));
}

std::optional<Value> read_value(Kind kind, const Json& json, ReadContext& context, const DecodeLimits& limits) {
  switch (kind) {
    case Kind::mesh:
      return read_value<Mesh>(json, context, limits);
    case Kind::image:
      return read_value<Image>(json, context, limits);
    case Kind::material:
      return read_value<Material>(json, context, limits);
    case Kind::light:
      return read_value<Light>(json, context, limits);
    case Kind::object:
      return read_value<Object>(json, context, limits);
    case Kind::camera:
      return read_value<Camera>(json, context, limits);
    case Kind::world:
      return read_value<World>(json, context, limits);
    case Kind::settings:
      return read_value<Settings>(json, context, limits);
  }
  return std::nullopt;
}

/// The user's name of a datablock, for messages: its "name", else its id.
std::string display_name(const Json& edit, const std::string& id) {
  if (const auto value = edit.find("value"); value != edit.end() && value->is_object())
    if (const auto name = value->find("name");
        name != value->end() && name->is_string() && !name->get_ref<const std::string&>().empty())
      return name->get<std::string>();
  return id;
}

std::optional<Edit> decode_edit(const Json& json, const ArrayResolver& arrays, Report& report,
                                const DecodeLimits& limits, size_t index) {
  ReadContext edit_context{arrays, report, fmt::format("Edit {}", index), {}};
  if (!json.is_object()) {
    edit_context.error("edits", fmt::format("holds {} at {}, not an object", type_of(json), index));
    return std::nullopt;
  }
  FieldReader reader(json, edit_context);
  const std::string* op = reader.find_text("op", true);
  if (!op) return std::nullopt;
  if (*op == "clear") {
    reader.finish();
    return Clear{};
  }
  if (*op != "upsert" && *op != "remove") {
    reader.fail("op", fmt::format("is '{}', not one of upsert remove clear", *op));
    return std::nullopt;
  }
  const std::string* kind_text = reader.find_text("kind", true);
  const std::string* id = reader.find_text("id", true);
  if (!kind_text || !id) return std::nullopt;
  const std::optional<Kind> kind = kind_of(*kind_text);
  if (!kind) {
    reader.fail("kind", fmt::format("is '{}', which is not a kind of datablock", *kind_text));
    return std::nullopt;
  }
  if (id->empty() || id->size() > k_max_id_bytes) {
    reader.fail("id", fmt::format("has {} bytes; it must have 1 to {}", id->size(), k_max_id_bytes));
    return std::nullopt;
  }
  if (*op == "remove") {
    reader.finish();
    return Remove{*kind, *id};
  }
  const Json* value = reader.find_object("value", true);
  reader.finish();
  if (!value) return std::nullopt;
  const std::string name = display_name(json, *id);
  ReadContext context{arrays, report, fmt::format("{} '{}'", *kind_text, name), name};
  std::optional<Value> decoded = read_value(*kind, *value, context, limits);
  if (!decoded) return std::nullopt;
  return Upsert{*id, std::move(*decoded)};
}

template <typename T>
Json encode_upsert(Kind kind, const std::string& id, const T& value, ArrayCollector& arrays) {
  Json json{{"op", "upsert"}, {"kind", kind_name(kind)}, {"id", id}};
  FieldWriter writer(json["value"], arrays);
  visit_fields(writer, value);
  return json;
}

constexpr const char* k_settings_id = "render";

}  // namespace

const char* kind_name(Kind kind) {
  for (const auto& [name, value] : k_kinds)
    if (value == kind) return name.data();
  return "";
}

std::optional<Transaction> decode_transaction(const Json& message, const ArrayResolver& arrays, Report& report,
                                              const DecodeLimits& limits) {
  ReadContext context{arrays, report, "The transaction", {}};
  if (!message.is_object()) {
    context.error("type", "is missing: the message is not an object");
    return std::nullopt;
  }
  Transaction transaction;
  FieldReader reader(message, context);
  reader.find("type");
  reader.integer("epoch", transaction.epoch, 0, INT64_MAX);
  if (!reader.find("epoch", true) || context.failed) return std::nullopt;
  const Json* edits = reader.find_list("edits");
  if (!edits && !context.failed) reader.fail("edits", "is missing");
  reader.finish();
  if (context.failed) return std::nullopt;

  bool good = true;
  transaction.edits.reserve(edits->size());
  for (const Json& json : *edits) {
    if (limits.abandoned && limits.abandoned->load(std::memory_order_relaxed)) {
      report.error("abandoned", {}, "The transaction was abandoned: its client is gone.");
      return std::nullopt;
    }
    std::optional<Edit> edit = decode_edit(json, arrays, report, limits, transaction.edits.size());
    good = good && edit.has_value();
    transaction.edits.push_back(edit ? std::move(*edit) : Edit(Clear{}));
  }
  if (!good) return std::nullopt;
  return transaction;
}

Json encode_edit(const Edit& edit, ArrayCollector& arrays) {
  if (const auto* remove = std::get_if<Remove>(&edit))
    return {{"op", "remove"}, {"kind", kind_name(remove->kind)}, {"id", remove->id}};
  if (const auto* upsert = std::get_if<Upsert>(&edit))
    return std::visit(
        [&](const auto& value) {
          return encode_upsert(static_cast<Kind>(upsert->value.index()), upsert->id, value, arrays);
        },
        upsert->value);
  return {{"op", "clear"}};
}

Json encode_transaction(const Transaction& transaction, ArrayCollector& arrays) {
  Json edits = Json::array();
  for (const Edit& edit : transaction.edits) edits.push_back(encode_edit(edit, arrays));
  return {{"type", "transaction"}, {"epoch", transaction.epoch}, {"edits", std::move(edits)}};
}

Json encode_scene(const SceneDescription& scene, ArrayCollector& arrays) {
  Json edits = Json::array();
  const auto add = [&](Kind kind, const auto& table) {
    for (const auto& [id, value] : table) edits.push_back(encode_upsert(kind, id, *value, arrays));
  };
  add(Kind::image, scene.images);
  add(Kind::material, scene.materials);
  add(Kind::mesh, scene.meshes);
  add(Kind::light, scene.lights);
  add(Kind::object, scene.objects);
  add(Kind::camera, scene.cameras);
  add(Kind::world, scene.worlds);
  edits.push_back(encode_upsert(Kind::settings, k_settings_id, *scene.settings, arrays));
  return {{"type", "transaction"}, {"epoch", 0}, {"edits", std::move(edits)}};
}

}  // namespace lambent::description
