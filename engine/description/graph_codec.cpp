// Shader graphs in JSON (PROTOCOL.md, "GRAPH").
#include "engine/description/field_reader.h"
#include "engine/description/field_writer.h"

namespace lambent::description {
namespace {

constexpr size_t k_max_nodes = 65536;
constexpr size_t k_max_curve_points = 65536;

/// [node index, "socket"] with an existing node.
bool read_link(const Json& json, size_t node_count, Link& link) {
  if (!json.is_array() || json.size() != 2 || !json[1].is_string()) return false;
  const std::optional<uint64_t> node = whole_number(json[0]);
  if (!node || *node >= node_count) return false;
  link.node = static_cast<int>(*node);
  link.socket = json[1].get<std::string>();
  return true;
}

/// Empty on success, else what is wrong.
std::string read_value(const Json& json, size_t node_count, bool links, SocketValue& value) {
  if (json.is_boolean()) {
    value = json.get<bool>();
  } else if (json.is_number()) {
    float number = 0;
    if (!read_float(json, number)) return "is too large for a 32-bit number";
    value = number;
  } else if (json.is_string()) {
    value = json.get<std::string>();
  } else if (json.is_array()) {
    Numbers numbers(json.size() <= 4 ? json.size() : 0);
    if (numbers.size() < 2) return "is not a list of 2 to 4 numbers";
    for (size_t i = 0; i < numbers.size(); ++i)
      if (!read_float(json[i], numbers[i])) return "is not a list of 2 to 4 finite numbers";
    value = std::move(numbers);
  } else if (json.is_object() && links && json.size() == 1 && json.contains("link")) {
    Link link;
    if (!read_link(json["link"], node_count, link))
      return "is not a link [index of a node, \"socket\"] to a node of this graph";
    value = std::move(link);
  } else {
    return fmt::format("is {}, which no socket has", type_of(json));
  }
  return {};
}

void read_values(FieldReader& reader, std::string_view name, size_t node_count, bool links,
                 std::map<std::string, SocketValue>& values, std::initializer_list<std::string_view> except = {}) {
  const Json* json = reader.find_object(name);
  if (!json) return;
  for (const auto& [key, element] : json->items()) {
    if (element.is_null() || std::find(except.begin(), except.end(), key) != except.end()) continue;
    SocketValue value;
    if (const std::string problem = read_value(element, node_count, links, value); !problem.empty())
      reader.fail(fmt::format("{}.{}", name, key), problem);
    else
      values.emplace(key, std::move(value));
  }
}

void read_ramp(FieldReader& reader, const Json& json, Node& node) {
  bool good = json.is_array() && json.size() <= k_max_curve_points;
  for (size_t i = 0; good && i < json.size(); ++i) {
    auto& stop = node.ramp.emplace_back();
    good = json[i].is_array() && json[i].size() == stop.size();
    for (size_t k = 0; good && k < stop.size(); ++k) good = read_float(json[i][k], stop[k]);
  }
  if (!good) reader.fail("properties.ramp", "is not a list of [position, r, g, b, a] with finite numbers");
}

void read_curves(FieldReader& reader, const Json& json, Node& node) {
  bool good = json.is_array() && json.size() <= 16;
  for (size_t i = 0; good && i < json.size(); ++i) {
    auto& curve = node.curves.emplace_back();
    good = json[i].is_array() && json[i].size() <= k_max_curve_points;
    for (size_t k = 0; good && k < json[i].size(); ++k) {
      const Json& point = json[i][k];
      float xy[2];
      good = point.is_array() && point.size() == 2 && read_float(point[0], xy[0]) && read_float(point[1], xy[1]);
      if (good) curve.insert(curve.end(), xy, xy + 2);
    }
  }
  if (!good) reader.fail("properties.curves", "is not a list of at most 16 lists of [x, y] with finite numbers");
}

void read_node(FieldReader& reader, Node& node, size_t node_count) {
  reader.text("name", node.name);
  reader.text("type", node.type, k_required);
  read_values(reader, "inputs", node_count, /*links=*/true, node.inputs);
  read_values(reader, "properties", node_count, /*links=*/false, node.properties, {"ramp", "curves"});
  const Json* properties = reader.find("properties");
  if (!properties || !properties->is_object()) return;
  if (const auto ramp = properties->find("ramp"); ramp != properties->end() && !ramp->is_null())
    read_ramp(reader, *ramp, node);
  if (const auto curves = properties->find("curves"); curves != properties->end() && !curves->is_null())
    read_curves(reader, *curves, node);
}

void read_output(FieldReader& reader, std::string_view name, size_t node_count, std::optional<Link>& output) {
  const Json* json = reader.find(name);
  if (!json) return;
  Link link;
  if (read_link(*json, node_count, link))
    output = std::move(link);
  else
    reader.fail(name, "is not [index of a node, \"socket\"] with a node of this graph");
}

void read_graph(FieldReader& reader, Graph& graph) {
  const Json* nodes = reader.find_list("nodes");
  const size_t count = nodes ? nodes->size() : 0;
  if (count > k_max_nodes) {
    reader.fail("nodes", fmt::format("has {} nodes; the limit is {}", count, k_max_nodes));
    return;
  }
  for (size_t i = 0; i < count; ++i) {
    const Json& json = (*nodes)[i];
    Node& node = graph.nodes.emplace_back();
    const std::string path = reader.path_of(fmt::format("nodes[{}]", i));
    if (!json.is_object()) {
      reader.context().error(path, "is not an object");
      continue;
    }
    reader.read_object(json, path + ".", [&](FieldReader& one) { read_node(one, node, count); });
  }
  reader.integer("cycles_version", graph.cycles_version, 0, 10000);
  reader.boolean("bump_map_correction", graph.bump_map_correction);
  reader.boolean("transparent_shadow", graph.transparent_shadow);
  reader.choice("displacement_method", graph.displacement_method, k_displacement_methods);
  reader.group("outputs", [&](FieldReader& outputs) {
    read_output(outputs, "surface", count, graph.surface);
    read_output(outputs, "displacement", count, graph.displacement);
    read_output(outputs, "volume", count, graph.volume);
    const Json* aovs = outputs.find_list("aovs");
    for (size_t i = 0; aovs && i < aovs->size(); ++i) {
      const Json& index = (*aovs)[i];
      if (index.is_number_unsigned() && index.get<uint64_t>() < count)
        graph.aovs.push_back(index.get<int>());
      else
        outputs.fail(fmt::format("aovs[{}]", i), "is not the index of a node of this graph");
    }
  });
}

Json encode_link(const Link& link) { return Json::array({link.node, link.socket}); }

Json encode_value(const SocketValue& value) {
  return std::visit(
      []<typename T>(const T& one) -> Json {
        if constexpr (std::is_same_v<T, Link>)
          return {{"link", encode_link(one)}};
        else
          return one;
      },
      value);
}

}  // namespace

void FieldReader::graph(std::string_view name, Graph& value) {
  group(name, [&](FieldReader& reader) { read_graph(reader, value); });
}

void FieldReader::optional_graph(std::string_view name, std::optional<Graph>& value) {
  optional_group(name, value, [](FieldReader& reader, Graph& graph) { read_graph(reader, graph); });
}

Json encode_graph(const Graph& graph) {
  Json nodes = Json::array(), outputs = Json::object();
  for (const Node& node : graph.nodes) {
    Json inputs = Json::object(), properties = Json::object();
    for (const auto& [name, value] : node.inputs) inputs[name] = encode_value(value);
    for (const auto& [name, value] : node.properties) properties[name] = encode_value(value);
    if (!node.ramp.empty()) properties["ramp"] = node.ramp;
    if (!node.curves.empty()) {
      Json& curves = properties["curves"] = Json::array();
      for (const auto& curve : node.curves) {
        Json& points = curves.emplace_back(Json::array());
        for (size_t i = 0; i + 1 < curve.size(); i += 2) points.push_back(Json::array({curve[i], curve[i + 1]}));
      }
    }
    nodes.push_back({{"name", node.name}, {"type", node.type}, {"inputs", inputs}, {"properties", properties}});
  }
  if (graph.surface) outputs["surface"] = encode_link(*graph.surface);
  if (graph.displacement) outputs["displacement"] = encode_link(*graph.displacement);
  if (graph.volume) outputs["volume"] = encode_link(*graph.volume);
  if (!graph.aovs.empty()) outputs["aovs"] = graph.aovs;
  Json encoded = {{"nodes", std::move(nodes)}, {"outputs", std::move(outputs)}};
  if (graph.cycles_version != Graph().cycles_version) encoded["cycles_version"] = graph.cycles_version;
  if (!graph.bump_map_correction) encoded["bump_map_correction"] = false;
  if (!graph.transparent_shadow) encoded["transparent_shadow"] = false;
  if (graph.displacement_method != DisplacementMethod::bump)
    encoded["displacement_method"] = k_displacement_methods[static_cast<size_t>(graph.displacement_method)].first;
  return encoded;
}

}  // namespace lambent::description
