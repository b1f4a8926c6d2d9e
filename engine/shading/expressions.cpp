#include "engine/shading/expressions.h"

#include <algorithm>
#include <bit>

namespace lambent {
namespace {

// Operations that read the shading point or a texture: not to be computed ahead.
bool reads_point(Op op) {
  switch (op) {
    case Op::position:
    case Op::normal:
    case Op::true_normal:
    case Op::incoming:
    case Op::default_tangent:
    case Op::bitangent:
    case Op::parametric:
    case Op::backfacing:
    case Op::attribute:
    case Op::object_position:
    case Op::object_normal:
    case Op::object_location:
    case Op::reflection:
    case Op::light_path:
    case Op::object_index:
    case Op::material_index:
    case Op::object_random:
    case Op::particle:
    case Op::view_distance:
    case Op::view_vector:
    case Op::view_depth:
    case Op::camera_position:
    case Op::window_position:
    case Op::object_color:
    case Op::wireframe:
    case Op::light_falloff:
    case Op::object_normal_of:
    case Op::vector_transform:
    case Op::ambient_occlusion:
    case Op::bevel:
    case Op::raycast:
    case Op::met_attribute:
    case Op::fresnel:
    case Op::layer_weight_fresnel:
    case Op::layer_weight_facing:
    case Op::normal_map:
    case Op::bump:
    case Op::world_tangent:
    case Op::texture_image:
    case Op::texture_environment:
    case Op::voxels:
    case Op::closure:
      return true;
    default:
      return false;
  }
}

}  // namespace

Value Expressions::constant_value(std::vector<float> values) {
  const int width = static_cast<int>(values.size());
  for (float& v : values)
    if (!std::isfinite(v)) v = 0.0f;  // a constant sub-expression that overflows counts as 0, as at run time in lobes
  const auto [place, added] = known_constants_.try_emplace(values, static_cast<int>(nodes_.size()));
  if (added) {
    Node node;
    node.width = width;
    node.constant = true;
    node.values = std::move(values);
    nodes_.push_back(std::move(node));
  }
  return {place->second, 0, width};
}

Value Expressions::number(float x) { return constant_value({x}); }
Value Expressions::vector(const Vec3& v) { return constant_value({v.x, v.y, v.z}); }
Value Expressions::vector4(const Vec4& v) { return constant_value({v.x, v.y, v.z, v.w}); }

Value Expressions::operation(Op op, int variant, std::vector<Value> arguments, int width, uint32_t data) {
  bool constant = !reads_point(op);
  for (const Value& argument : arguments) constant &= nodes_[argument.expression].constant;
  if (constant) {
    const size_t first_operand = program_.operands.size(), first_constant = program_.constants.size();
    Instruction instruction{op, static_cast<uint8_t>(variant), 0, static_cast<uint32_t>(first_operand), data};
    for (const Value& argument : arguments) {
      program_.operands.push_back(~static_cast<Operand>(program_.constants.size()));
      const float* values = this->constant(argument);
      program_.constants.insert(program_.constants.end(), values, values + argument.width);
    }
    float result[k_max_width] = {};
    run_instruction(program_, instruction, ShadingPoint{}, nullptr, result);
    program_.operands.resize(first_operand);
    program_.constants.resize(first_constant);
    return constant_value(std::vector<float>(result, result + width));
  }
  std::vector<int64_t> key{static_cast<int64_t>(op), variant, data, width};
  for (const Value& argument : arguments) {
    key.push_back(argument.expression);
    key.push_back(argument.offset);
  }
  const auto [place, added] = known_.try_emplace(std::move(key), static_cast<int>(nodes_.size()));
  if (added) {
    Node node;
    node.op = op;
    node.variant = static_cast<uint8_t>(variant);
    node.data = data;
    node.width = width;
    node.arguments = std::move(arguments);
    nodes_.push_back(std::move(node));
  }
  return {place->second, 0, width};
}

Operand Expressions::constant_operand(const Value& value) {
  const float* values = constant(value);
  std::vector<float> key(values, values + value.width);
  const auto [place, added] =
      stored_constants_.try_emplace(std::move(key), static_cast<uint32_t>(program_.constants.size()));
  if (added) program_.constants.insert(program_.constants.end(), values, values + value.width);
  return ~static_cast<Operand>(place->second);
}

bool Expressions::depends_on(const std::vector<Value>& values, bool (*of_kind)(Op op)) const {
  std::vector<bool> reached(nodes_.size(), false);
  for (const Value& value : values) reached[value.expression] = true;
  for (int n = static_cast<int>(nodes_.size()) - 1; n >= 0; --n) {  // arguments come before what they are for
    if (!reached[n] || nodes_[n].constant) continue;
    if (of_kind(nodes_[n].op)) return true;
    for (const Value& argument : nodes_[n].arguments) reached[argument.expression] = true;
  }
  return false;
}

bool Expressions::never_negative(const Value& value) const {
  const Node& node = nodes_[value.expression];
  if (node.constant)
    return std::all_of(node.values.begin() + value.offset, node.values.begin() + value.offset + value.width,
                       [](float x) { return x >= 0.0f; });
  const auto all_arguments = [&] {
    return std::all_of(node.arguments.begin(), node.arguments.end(), [&](const Value& v) { return never_negative(v); });
  };
  switch (node.op) {
    case Op::backfacing:
    case Op::light_path:
    case Op::object_random:
    case Op::view_distance:
    case Op::clamp_color:
    case Op::ramp:  // Blender's ramps hold colours in [0, inf)
    case Op::ambient_occlusion:
    case Op::fresnel:
    case Op::layer_weight_fresnel:
    case Op::layer_weight_facing:
    case Op::ies:
    case Op::wave:
    case Op::white_noise:
    case Op::gradient:
      return true;
    case Op::blackbody:
    case Op::wavelength:
    case Op::sky:
      return node.variant == 0;
    case Op::clamp:
      return never_negative(node.arguments[1]) && never_negative(node.arguments[2]);
    case Op::noise:
      return !(node.variant & 8) && !(node.variant >> 5);
    case Op::math:
      switch (static_cast<MathOperation>(node.variant)) {
        case MathOperation::absolute:
        case MathOperation::exponent:
        case MathOperation::less_than:
        case MathOperation::greater_than:
          return true;
        case MathOperation::add:
        case MathOperation::multiply:
        case MathOperation::divide:
        case MathOperation::multiply_add:
        case MathOperation::power:
        case MathOperation::minimum:
          return all_arguments();
        case MathOperation::maximum:
          return never_negative(node.arguments[0]) || never_negative(node.arguments[1]);
        default:
          return false;
      }
    case Op::combine:
    case Op::luminance:
    case Op::average:
    case Op::scale_color:
    case Op::multiply:
    case Op::mix_weight_first:
    case Op::mix_weight_second:
    case Op::checker:
      return all_arguments();
    case Op::texture_image:
    case Op::texture_environment:
      return program_.textures[node.data].interpolation != TextureInterpolation::cubic;
    default:
      return false;
  }
}

bool Expressions::generate(const std::vector<Closure>& closures, Code& code) {
  // Order: for each closure its not yet ordered values, arguments first (nodes_ is in topological order).
  struct Step {
    int node;     // or -1
    int closure;  // index into `closures`
  };
  std::vector<Step> steps;
  std::vector<bool> ordered(nodes_.size(), false), wanted(nodes_.size());
  for (size_t c = 0; c < closures.size(); ++c) {
    std::fill(wanted.begin(), wanted.end(), false);
    for (const Value& operand : closures[c].operands) wanted[operand.expression] = true;
    for (int n = static_cast<int>(nodes_.size()) - 1; n >= 0; --n)
      if (wanted[n] && !nodes_[n].constant)
        for (const Value& argument : nodes_[n].arguments) wanted[argument.expression] = true;
    for (size_t n = 0; n < nodes_.size(); ++n)
      if (wanted[n] && !nodes_[n].constant && !ordered[n]) {
        ordered[n] = true;
        steps.push_back({static_cast<int>(n), -1});
      }
    steps.push_back({-1, static_cast<int>(c)});
  }
  // Last step that reads each value.
  std::vector<size_t> last_use(nodes_.size(), 0);
  const auto operands_of = [&](const Step& step) -> const std::vector<Value>& {
    return step.node >= 0 ? nodes_[step.node].arguments : closures[step.closure].operands;
  };
  for (size_t s = 0; s < steps.size(); ++s)
    for (const Value& operand : operands_of(steps[s])) last_use[operand.expression] = s;

  std::vector<int> register_of(nodes_.size(), -1);
  std::vector<int> free_registers[k_max_width + 1];  // by width
  int used = 0;
  for (size_t s = 0; s < steps.size(); ++s) {
    const Step& step = steps[s];
    Instruction instruction{Op::closure, 0, 0, static_cast<uint32_t>(program_.operands.size()), 0};
    for (const Value& operand : operands_of(step))
      program_.operands.push_back(nodes_[operand.expression].constant
                                      ? constant_operand(operand)
                                      : register_of[operand.expression] + operand.offset);
    if (step.node >= 0) {
      const Node& node = nodes_[step.node];
      instruction.op = node.op;
      instruction.variant = node.variant;
      instruction.data = node.data;
      std::vector<int>& pool = free_registers[node.width];
      int place = used;
      if (pool.empty()) {
        used += node.width;
        if (used > k_max_registers) return false;
      } else {
        place = pool.back();
        pool.pop_back();
      }
      register_of[step.node] = place;
      instruction.out = static_cast<uint16_t>(place);
    } else {
      instruction.data = closures[step.closure].index;
    }
    code.instructions.push_back(instruction);
    // Freed after the result has its place: an instruction never writes over its own operands.
    for (const Value& operand : operands_of(step)) {
      const int n = operand.expression;
      if (!nodes_[n].constant && last_use[n] == s && register_of[n] >= 0) {
        free_registers[nodes_[n].width].push_back(register_of[n]);
        register_of[n] = -1;
      }
    }
  }
  code.register_floats = used;
  return true;
}

}  // namespace lambent
